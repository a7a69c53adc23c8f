//! Location of the plant and its root, by frame differencing over a series of photographs.
//!
//! In: photographs of a camera that stands still. Out: a region and a root, if exactly one thing in the picture moves and is
//! detected as a plant. The one idea: a plant sways and grows above a fixed root; lamps flicker at the edge, and pictures
//! between which the light changes are not compared.
//!
//! Constants were chosen by hand on the first halves of the bean and the sunflowers, of which the root is found within 15
//! pixels (`cargo test -p tropism --test vision location` with the data).

use std::ops::Range;

use super::detect::connected_components::{BoundingBox, ConnectedComponents};
use super::detect::curve::median;
use super::detect::hysteresis::Evidence;
use super::raster::filter::downscale;
use super::raster::turn::Turn;
use super::{Direction, VisionConfig, detect_from_base};
use crate::geometry::{Pixel, Region};
use crate::photo::Image;

/// Photographs that are compared, each with the next of them, at equal distances over the series.
const COMPARED: usize = 49;

/// Least number of comparisons: fewer show too little motion.
const LEAST_COMPARED: usize = 8;

/// Columns or rows, whichever are more, to which a picture is reduced.
const SIDE: usize = 360;

/// Grey levels by which a pixel changes where something moves.
const CHANGE: f64 = 12.0;

/// Share of the pixels that change between two pictures at most: of more the light changed.
const MOST_CHANGED: f64 = 0.03;

/// Share of the comparisons in which a pixel changes where something moves.
const LEAST_SHARE: f64 = 0.06;

/// Pixels by which moving pixels may be apart and belong together.
const REACH: usize = 2;

/// Pixels of a plant, at least.
const LEAST_PIXELS: usize = 40;

/// Share of the motion of the strongest from which on another thing may be a plant, too.
const RIVAL_SHARE: f64 = 0.2;

/// Space around what moved, in shares of its larger side: plants grow.
const MARGIN_SHARE: f64 = 0.35;

/// Number of photographs in which the plant is searched in the region, and the share in which it must be detected.
const TRIED: usize = 12;
const LEAST_DETECTED: f64 = 0.8;

/// Result of [`locate`].
#[derive(Clone, Debug, PartialEq)]
pub enum Location {
    /// One plant.
    Plant {
        /// Around all its postures, down to the root.
        region: Region,
        /// The foot of the stem below the moving part.
        base: Pixel,
        /// The direction in which it grows.
        up: Direction,
    },
    /// Several things move, where each is.
    Several(Vec<Region>),
    /// No plant is found for sure, and why.
    Unsure(String),
}

/// Finds the plant in a series of `count` photographs, in the order of their times. It grows in one of `poses`.
///
/// `read` gives a photograph by its index, from 0; one that gives `None` is passed over. At most 49 are read for their
/// motion, and 12 of them twice more: once for the root, once to see whether a plant is detected there.
pub fn locate(
    count: usize,
    read: impl Fn(usize) -> Option<Image>,
    vision: &VisionConfig,
    poses: &[Direction],
) -> Location {
    let of = |most: usize| evenly(count, most).filter_map(&read);
    let unsure = |reason: &str| Location::Unsure(reason.to_owned());
    let Some(motion) = Motion::of(of(COMPARED)) else {
        return unsure("too few photographs follow each other in the same light");
    };
    let mut things = motion.things();
    let strongest = things.iter().map(|thing| thing.motion).fold(0.0, f64::max);
    things.retain(|thing| thing.motion >= RIVAL_SHARE * strongest);
    let thing = match things.as_slice() {
        [] => return unsure("nothing in them moves like a plant"),
        [only] => only,
        several => {
            let places = several.iter().map(|thing| motion.grid.region(thing, 0.0));
            return Location::Several(places.collect());
        }
    };
    let mut poses: Vec<Pose> = poses.iter().map(|&up| Pose::new(up, &motion.grid, thing)).collect();
    for image in of(TRIED) {
        poses.iter_mut().for_each(|pose| pose.look_for_root(&image));
    }
    for image in of(TRIED) {
        for pose in &mut poses {
            let tip = pose.tip_in(&image, vision);
            pose.detected += usize::from(tip.is_some_and(|tip| motion.grid.is_near(thing, tip)));
        }
    }
    let Some(pose) = best(&poses) else { return unsure("no photograph can be read") };
    let (region, base) = pose.place();
    if (pose.detected as f64) < LEAST_DETECTED * pose.roots.len() as f64 {
        return Location::Unsure(format!(
            "something moves at {region}, but a plant is detected there in {} of {} photographs only",
            pose.detected,
            pose.roots.len()
        ));
    }
    Location::Plant { region, base, up: pose.turn.up }
}

/// The pose in which the plant is detected most often, the first of equals; `None` where no photograph was seen.
fn best(poses: &[Pose]) -> Option<&Pose> {
    poses.iter().rev().filter(|pose| !pose.roots.is_empty()).max_by_key(|pose| pose.detected)
}

/// The moving thing as a plant that grows in one direction. Coordinates are those of photographs turned so that it grows
/// up.
struct Pose {
    turn: Turn,
    /// Region of the moving thing with a margin, and its height without.
    moving: Region,
    height: usize,
    /// The middle of its lowest rows.
    lowest: Pixel,
    /// The root in each photograph.
    roots: Vec<Pixel>,
    /// Number of photographs in which a plant is detected on its root where something moves.
    detected: usize,
}

impl Pose {
    fn new(up: Direction, grid: &Grid, thing: &Thing) -> Self {
        let turn = Turn::new(up, grid.photo);
        let (grid, thing) = grid.turned(thing, up);
        let moving = grid.region(&thing, MARGIN_SHARE);
        let height = grid.region(&thing, 0.0).height;
        Self { turn, moving, height, lowest: grid.base(&thing), roots: Vec::new(), detected: 0 }
    }

    /// Looks for the root in a photograph.
    fn look_for_root(&mut self, image: &Image) {
        let back = self.turn.back();
        let grey_at = |x: usize, y: usize| {
            let Pixel { x, y } = back.pixel(Pixel::new(x as f64, y as f64));
            grey(image.at(x as usize, y as usize))
        };
        self.roots.push(root_below(grey_at, self.turn.size(), self.lowest, self.height));
    }

    /// The tip of the plant on the median root, in the photograph's own coordinates; `None` where no plant is detected, or it
    /// reaches an edge.
    fn tip_in(&self, image: &Image, vision: &VisionConfig) -> Option<Pixel> {
        let (region, base) = self.place();
        let config = VisionConfig { crop: Some(region), up: self.turn.up, ..vision.clone() };
        let found = detect_from_base(image, Some(base), &config)?;
        found.clipped_at.is_none().then_some(found.tip)
    }

    /// Region and median root, in the photographs' own coordinates.
    fn place(&self) -> (Region, Pixel) {
        let middle = |of: fn(&Pixel) -> f64| median(self.roots.iter().map(of));
        let base = Pixel::new(middle(|root| root.x), middle(|root| root.y));
        let height = (base.y as usize + 1).max(self.moving.y + 1) - self.moving.y;
        let back = self.turn.back();
        (back.region(Region { height, ..self.moving }), back.pixel(base))
    }
}

/// At most `most` of `count` indices at equal distances, from the first to the last.
fn evenly(count: usize, most: usize) -> impl Iterator<Item = usize> {
    let taken = count.min(most);
    (0..taken).map(move |index| index * (count - 1) / (taken - 1).max(1))
}

/// Reach to each side within which the stem is searched below the moving part, and of its surroundings, as shares of the
/// height of the moving part.
const STEM_REACH: f64 = 0.1;
const SIDE_REACH: f64 = 0.4;

/// Width above which it is no stem, as a multiple of the stem's above.
const MOST_WIDENING: f64 = 2.5;

/// Longest gap in a stem, as a share of that height: the edge of a pot.
const GAP_REACH: f64 = 0.04;

/// Least prominence of a stem below the moving part, as a share of that above. Measured on the first sets: at least 0.9 on a
/// stem, at most 0.2 below a root.
const LEAST_PROMINENCE: f64 = 0.5;

/// The root below the lowest moving point: the foot of a stem does not move.
///
/// `grey` gives the grey level of a pixel. A stem is brighter than its surroundings and is followed downwards while its
/// prominence lasts. It may pass a bright edge, such as a pot's, within [`GAP_REACH`]. It ends at something wide: a pot, or
/// soil.
fn root_below(
    grey: impl Fn(usize, usize) -> f64,
    (columns, rows): (usize, usize),
    lowest: Pixel,
    height: usize,
) -> Pixel {
    let reach = |share: f64| ((share * height as f64) as usize).max(4);
    let beside = |x: usize, reach: usize| x.saturating_sub(reach)..(x + reach + 1).min(columns);
    let row = |x: usize, y: usize| {
        Row::at(x, beside(x, reach(STEM_REACH)), beside(x, reach(SIDE_REACH)), |x| grey(x, y))
    };
    let (x, y) = (lowest.x as usize, lowest.y as usize);
    let above = y.saturating_sub(reach(STEM_REACH))..y.saturating_sub(reach(STEM_REACH) / 2).max(1);
    let above: Vec<Row> = above.map(|y| row(x, y)).collect();
    let usual = |of: fn(&Row) -> f64| median(above.iter().map(of));
    let (prominence, width) = (usual(|row| row.prominence), usual(|row| row.width as f64));
    let (mut root, mut x, mut last) = (lowest, x, y);
    for y in y + 1..rows {
        let row = row(x, y);
        if y - last > reach(GAP_REACH) || row.width as f64 > MOST_WIDENING * width {
            break;
        }
        if row.prominence < LEAST_PROMINENCE * prominence {
            continue;
        }
        // A stem does not jump aside.
        x = row.column.clamp(x.saturating_sub(y - last), x + y - last);
        root = Pixel::new(x as f64, y as f64);
        last = y;
    }
    root
}

/// A candidate for the stem in a row of a picture.
struct Row {
    /// The brightest column where the stem may be.
    column: usize,
    /// Its brightness above the median of its surroundings, in grey levels.
    prominence: f64,
    /// Number of columns around it above half of that.
    width: usize,
}

impl Row {
    /// The candidate nearest to column `x`: the stem is searched in `near`, its surroundings are `around`.
    fn at(x: usize, near: Range<usize>, around: Range<usize>, grey: impl Fn(usize) -> f64) -> Self {
        let column = near.max_by(|&one, &other| grey(one).total_cmp(&grey(other))).unwrap_or(x);
        let beside = median(around.clone().map(&grey));
        let prominence = grey(column) - beside;
        let stands_out = |column: &usize| grey(*column) > beside + 0.5 * prominence;
        let right = (column + 1..around.end).take_while(stands_out).count();
        let left = (around.start..column).rev().take_while(stands_out).count();
        Self { column, prominence, width: left + 1 + right }
    }
}

/// A photograph reduced to means of square blocks.
#[derive(Clone, Copy)]
struct Grid {
    /// Columns and rows.
    size: (usize, usize),
    /// Pixels of the photograph along a block.
    scale: usize,
    /// Width and height of the photograph.
    photo: (usize, usize),
}

/// Blocks that move together.
struct Thing {
    blocks: Vec<usize>,
    /// The least rectangle of blocks around them.
    extent: Region,
    /// Sum of the shares of the comparisons in which they changed.
    motion: f64,
}

/// How often each block of a series changed.
struct Motion {
    grid: Grid,
    /// Share of the comparisons in which each block changed.
    shares: Vec<f64>,
}

impl Motion {
    fn of(mut pictures: impl Iterator<Item = Image>) -> Option<Self> {
        let first = pictures.next()?;
        let photo = (first.width, first.height);
        let scale = (photo.0.max(photo.1) / SIDE).max(1);
        let grid = Grid { size: (photo.0 / scale, photo.1 / scale), scale, photo };
        let mut before = reduced(&first, scale);
        let mut shares = vec![0.0; before.len()];
        let mut compared = 0;
        for picture in pictures.filter(|picture| (picture.width, picture.height) == photo) {
            let after = reduced(&picture, scale);
            let changed: Vec<bool> = before.iter().zip(&after).map(|(a, b)| (a - b).abs() > CHANGE).collect();
            let count = changed.iter().filter(|is_changed| **is_changed).count();
            if count as f64 <= MOST_CHANGED * changed.len() as f64 {
                compared += 1;
                shares.iter_mut().zip(changed).for_each(|(sum, is_changed)| *sum += f64::from(is_changed));
            }
            before = after;
        }
        shares.iter_mut().for_each(|share| *share /= compared as f64);
        (compared >= LEAST_COMPARED).then_some(Self { grid, shares })
    }

    /// What moves, is large enough and touches no edge of the picture.
    fn things(&self) -> Vec<Thing> {
        let moves = |share: &f64| if *share >= LEAST_SHARE { Evidence::Strong } else { Evidence::None };
        let evidence: Vec<Evidence> = self.shares.iter().map(moves).collect();
        let (width, height) = self.grid.size;
        let found = ConnectedComponents::label(&evidence, width, REACH, [0.0; 2]);
        let thing = |bounds: BoundingBox| Thing { blocks: Vec::new(), extent: bounds.region(), motion: 0.0 };
        let mut things: Vec<Thing> = found.components.iter().map(|one| thing(one.bounds)).collect();
        for (block, &label) in found.labels.iter().enumerate().filter(|(_, label)| **label > 0) {
            let thing = &mut things[label as usize - 1];
            thing.blocks.push(block);
            thing.motion += self.shares[block];
        }
        things.retain(|Thing { extent: Region { x, y, width: wide, height: high }, blocks, .. }| {
            let touches = *x == 0 || *y == 0 || x + wide == width || y + high == height;
            blocks.len() >= LEAST_PIXELS && !touches
        });
        things
    }
}

impl Grid {
    /// The same in photographs turned so that the end of `up` is at the top, with one of the things.
    fn turned(&self, thing: &Thing, up: Direction) -> (Self, Thing) {
        let turn = Turn::new(up, self.size);
        let size = turn.size();
        let place = |&at: &usize| {
            let there = turn.pixel(Pixel::new((at % self.size.0) as f64, (at / self.size.0) as f64));
            there.y as usize * size.0 + there.x as usize
        };
        let blocks = thing.blocks.iter().map(place).collect();
        let thing = Thing { blocks, extent: turn.region(thing.extent), motion: thing.motion };
        (Self { size, photo: Turn::new(up, self.photo).size(), ..*self }, thing)
    }

    /// Around a thing in a photograph, with a margin to the sides and above.
    fn region(&self, thing: &Thing, margin_share: f64) -> Region {
        let Region { x, y, width, height } = thing.extent;
        let [left, top, right, bottom] = [x, y, x + width, y + height].map(|value| value * self.scale);
        let margin = (margin_share * (right - left).max(bottom - top) as f64) as usize;
        let (x, y) = (left.saturating_sub(margin), top.saturating_sub(margin));
        let right = (right + margin).min(self.photo.0);
        Region { x, y, width: right - x, height: bottom.min(self.photo.1) - y }
    }

    /// The middle of the lowest rows of a thing, in a photograph.
    fn base(&self, thing: &Thing) -> Pixel {
        let lowest = thing.extent.y + thing.extent.height - 1;
        let low = thing.blocks.iter().filter(|&block| block / self.size.0 + 2 > lowest);
        let middle = median(low.map(|block| (block % self.size.0) as f64));
        let in_photograph = |block: f64| (block + 0.5) * self.scale as f64 - 0.5;
        Pixel::new(in_photograph(middle), in_photograph(lowest as f64))
    }

    /// Whether a pixel of a photograph is near what moved.
    fn is_near(&self, thing: &Thing, pixel: Pixel) -> bool {
        let Region { x, y, width, height } = thing.extent;
        let margin = (2 * REACH) as f64;
        let is_within = |at: f64, first: usize, count: usize| {
            (first as f64 - margin..=(first + count - 1) as f64 + margin).contains(&(at / self.scale as f64))
        };
        is_within(pixel.x, x, width) && is_within(pixel.y, y, height)
    }
}

/// Grey levels of a picture: means of square blocks.
fn reduced(image: &Image, scale: usize) -> Vec<f64> {
    let small = downscale(image, image.region(), scale);
    small.rgb.as_chunks::<3>().0.iter().map(|&rgb| grey(rgb)).collect()
}

/// Mean of the three channels.
fn grey(rgb: [u8; 3]) -> f64 {
    rgb.map(f64::from).iter().sum::<f64>() / 3.0
}
