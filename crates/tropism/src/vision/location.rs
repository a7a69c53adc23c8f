//! Where the plant and its root are, from what moves in a series of photographs.
//!
//! In: photographs of a camera that stands still. Out: a region and a root, if exactly one thing in the picture moves and is
//! detected as a plant. The one idea: a plant sways and grows from a root that stays; lamps flicker at the edge, and
//! pictures between which the light changes are not compared.

use std::ops::Range;

use super::raster::turn::Turn;
use super::{Direction, VisionConfig, detect_from_base};
use crate::geometry::{Pixel, Region};
use crate::math::statistics::upper_median;
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

/// Photographs in which the plant is looked for in the region, and the share in which it must be detected.
const TRIED: usize = 12;
const LEAST_DETECTED: f64 = 0.8;

/// What moves in a series of photographs.
#[derive(Clone, Debug, PartialEq)]
pub enum Location {
    /// One plant.
    Plant {
        /// Around all its postures, down to the root.
        region: Region,
        /// The foot of the stem below what moves.
        base: Pixel,
        /// The direction in which it grows.
        up: Direction,
    },
    /// Nothing sure, and why.
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
            let places: Vec<String> =
                several.iter().map(|thing| motion.region(thing, 0.0).to_string()).collect();
            return Location::Unsure(format!(
                "{} things in them move, at {}: one plant is wanted, or a `region` for each",
                several.len(),
                places.join(" and ")
            ));
        }
    };
    let mut poses: Vec<Pose> = poses.iter().map(|&up| Pose::new(up, &motion, thing)).collect();
    for image in of(TRIED) {
        poses.iter_mut().for_each(|pose| pose.look_for_root(&image));
    }
    for image in of(TRIED) {
        for pose in &mut poses {
            let tip = pose.tip_in(&image, vision);
            pose.detected += usize::from(tip.is_some_and(|tip| motion.is_near(thing, tip)));
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

/// What moves, taken to be a plant that grows in one direction. Places are those of photographs that are turned so that it
/// grows up in them.
struct Pose {
    turn: Turn,
    /// Around what moves, with a margin, and its height without.
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
    fn new(up: Direction, motion: &Motion, thing: &Thing) -> Self {
        let turn = Turn::new(up, motion.size);
        let (motion, thing) = motion.turned(thing, up);
        let moving = motion.region(&thing, MARGIN_SHARE);
        let height = motion.region(&thing, 0.0).height;
        Self { turn, moving, height, lowest: motion.base(&thing), roots: Vec::new(), detected: 0 }
    }

    /// Looks for the root in a photograph.
    fn look_for_root(&mut self, image: &Image) {
        let back = self.turn.back();
        let grey = |x: usize, y: usize| {
            let Pixel { x, y } = back.pixel(Pixel::new(x as f64, y as f64));
            image.at(x as usize, y as usize).iter().map(|&value| f64::from(value)).sum::<f64>() / 3.0
        };
        self.roots.push(root_below(grey, self.turn.size(), self.lowest, self.height));
    }

    /// The tip of the plant on the root in a photograph as it is, once the root was looked for in all of them; `None` if
    /// there is none, or if it reaches an edge.
    fn tip_in(&self, image: &Image, vision: &VisionConfig) -> Option<Pixel> {
        let (region, base) = self.place();
        let config = VisionConfig { crop: Some(region), up: self.turn.up, ..vision.clone() };
        let found = detect_from_base(image, Some(base), &config)?;
        found.clipped_at.is_none().then_some(found.tip)
    }

    /// Region and root in photographs as they are.
    fn place(&self) -> (Region, Pixel) {
        let middle = |of: fn(&Pixel) -> f64| {
            let values: Vec<f64> = self.roots.iter().map(of).collect();
            upper_median(&values, f64::total_cmp).unwrap_or(0.0)
        };
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

/// Reach to each side in which a stem is looked for below what moves, and in which it stands out, as shares of the height
/// of what moves.
const STEM_REACH: f64 = 0.1;
const SIDE_REACH: f64 = 0.4;

/// Width at which it is no stem any more, as a multiple of the width of the stem above.
const MOST_WIDENING: f64 = 2.5;

/// Rows in which a stem may not stand out, as a share of that height: before the edge of a pot, say.
const GAP_REACH: f64 = 0.04;

/// Least prominence of a stem below what moves, as a share of that above. Measured on the first sets: at least 0.9 on a
/// stem, at most 0.2 below a root.
const LEAST_PROMINENCE: f64 = 0.5;

/// The root below the lowest point that moves: the foot of a stem does not.
///
/// `grey` gives the grey level of a pixel. A stem is brighter than what lies beside it; it is followed downwards as long as
/// it stands out as above. It may pass something as bright, such as the edge of a pot, if it stands out again within
/// [`GAP_REACH`]. It ends where it meets something wide: a pot, or soil.
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
    let usual = |of: fn(&Row) -> f64| {
        upper_median(&above.iter().map(of).collect::<Vec<f64>>(), f64::total_cmp).unwrap_or(0.0)
    };
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

/// What may be a stem in a row of a picture.
struct Row {
    /// The brightest column where the stem may be.
    column: usize,
    /// By how much it stands out from the columns beside, in grey levels.
    prominence: f64,
    /// Columns about it that stand out by half as much.
    width: usize,
}

impl Row {
    /// The row near column `x`: the stem is in `near`, and what lies beside it in `around`.
    fn at(x: usize, near: Range<usize>, around: Range<usize>, grey: impl Fn(usize) -> f64) -> Self {
        let column = near.max_by(|&one, &other| grey(one).total_cmp(&grey(other))).unwrap_or(x);
        let beside: Vec<f64> = around.clone().map(&grey).collect();
        let beside = upper_median(&beside, f64::total_cmp).unwrap_or(0.0);
        let prominence = grey(column) - beside;
        let stands_out = |column: &usize| grey(*column) > beside + 0.5 * prominence;
        let right = (column + 1..around.end).take_while(stands_out).count();
        let left = (around.start..column).rev().take_while(stands_out).count();
        Self { column, prominence, width: left + 1 + right }
    }
}

/// How often each pixel of the reduced picture changed.
struct Motion {
    width: usize,
    height: usize,
    /// Pixels of a photograph a pixel.
    scale: usize,
    size: (usize, usize),
    /// Share of the comparisons in which each pixel changed.
    shares: Vec<f64>,
}

/// Pixels that move together.
struct Thing {
    pixels: Vec<usize>,
    /// Sum of their shares.
    motion: f64,
}

impl Motion {
    fn of(mut pictures: impl Iterator<Item = Image>) -> Option<Self> {
        let first = pictures.next()?;
        let size = (first.width, first.height);
        let scale = (first.width.max(first.height) / SIDE).max(1);
        let (width, height) = (first.width / scale, first.height / scale);
        let mut before = reduced(&first, scale);
        let mut motion = Self { width, height, scale, size, shares: vec![0.0; before.len()] };
        let mut compared = 0;
        for picture in pictures.filter(|picture| (picture.width, picture.height) == size) {
            let after = reduced(&picture, scale);
            let changed: Vec<bool> = before.iter().zip(&after).map(|(a, b)| (a - b).abs() > CHANGE).collect();
            let share =
                changed.iter().filter(|is_changed| **is_changed).count() as f64 / changed.len() as f64;
            if share <= MOST_CHANGED {
                compared += 1;
                for (sum, is_changed) in motion.shares.iter_mut().zip(changed) {
                    *sum += f64::from(u8::from(is_changed));
                }
            }
            before = after;
        }
        motion.shares.iter_mut().for_each(|share| *share /= f64::from(compared));
        (compared as usize >= LEAST_COMPARED).then_some(motion)
    }

    /// The same in pictures turned so that the end of `up` is at the top, with one of the things.
    fn turned(&self, thing: &Thing, up: Direction) -> (Self, Thing) {
        let turn = Turn::new(up, (self.width, self.height));
        let (width, height) = turn.size();
        let place = |at: usize| {
            let there = turn.pixel(Pixel::new((at % self.width) as f64, (at / self.width) as f64));
            there.y as usize * width + there.x as usize
        };
        let mut shares = vec![0.0; self.shares.len()];
        self.shares.iter().enumerate().for_each(|(at, share)| shares[place(at)] = *share);
        let thing = Thing { pixels: thing.pixels.iter().map(|&at| place(at)).collect(), ..*thing };
        let size = Turn::new(up, self.size).size();
        (Self { width, height, scale: self.scale, size, shares }, thing)
    }

    /// What moves, is large enough and touches no edge of the picture.
    fn things(&self) -> Vec<Thing> {
        let mut is_open: Vec<bool> = self.shares.iter().map(|share| *share >= LEAST_SHARE).collect();
        let mut things = Vec::new();
        for start in 0..is_open.len() {
            if !is_open[start] {
                continue;
            }
            is_open[start] = false;
            let (mut pixels, mut next) = (vec![start], 0);
            while let Some(&pixel) = pixels.get(next) {
                next += 1;
                let (x, y) = (pixel % self.width, pixel / self.width);
                for row in y.saturating_sub(REACH)..(y + REACH + 1).min(self.height) {
                    for column in x.saturating_sub(REACH)..(x + REACH + 1).min(self.width) {
                        let other = row * self.width + column;
                        if std::mem::take(&mut is_open[other]) {
                            pixels.push(other);
                        }
                    }
                }
            }
            things.push(Thing { motion: pixels.iter().map(|&pixel| self.shares[pixel]).sum(), pixels });
        }
        things.retain(|thing| {
            let (low, high) = self.ends(thing);
            let touches = low.0 == 0 || low.1 == 0 || high.0 + 1 == self.width || high.1 + 1 == self.height;
            thing.pixels.len() >= LEAST_PIXELS && !touches
        });
        things
    }

    /// The least and the greatest column and row.
    fn ends(&self, thing: &Thing) -> ((usize, usize), (usize, usize)) {
        let places = thing.pixels.iter().map(|pixel| (pixel % self.width, pixel / self.width));
        places.fold(((usize::MAX, usize::MAX), (0, 0)), |(low, high), (x, y)| {
            ((low.0.min(x), low.1.min(y)), (high.0.max(x), high.1.max(y)))
        })
    }

    /// Around a thing in a photograph, with a margin to the sides and above.
    fn region(&self, thing: &Thing, margin_share: f64) -> Region {
        let (low, high) = self.ends(thing);
        let [left, top, right, bottom] =
            [low.0, low.1, high.0 + 1, high.1 + 1].map(|value| value * self.scale);
        let margin = (margin_share * (right - left).max(bottom - top) as f64) as usize;
        let (x, y) = (left.saturating_sub(margin), top.saturating_sub(margin));
        let right = (right + margin).min(self.size.0);
        Region { x, y, width: right - x, height: bottom.min(self.size.1) - y }
    }

    /// The middle of the lowest rows of a thing, in a photograph.
    fn base(&self, thing: &Thing) -> Pixel {
        let lowest = self.ends(thing).1.1;
        let mut columns: Vec<usize> = thing
            .pixels
            .iter()
            .filter(|&&pixel| pixel / self.width + 2 > lowest)
            .map(|pixel| pixel % self.width)
            .collect();
        columns.sort_unstable();
        let middle = columns[columns.len() / 2];
        let in_photograph = |value: usize| (value as f64 + 0.5) * self.scale as f64 - 0.5;
        Pixel::new(in_photograph(middle), in_photograph(lowest))
    }

    /// Whether a pixel of a photograph is near what moved.
    fn is_near(&self, thing: &Thing, pixel: Pixel) -> bool {
        let (low, high) = self.ends(thing);
        let (x, y) = (pixel.x / self.scale as f64, pixel.y / self.scale as f64);
        let margin = (2 * REACH) as f64;
        let is_within = |value: f64, low: usize, high: usize| {
            value >= low as f64 - margin && value <= high as f64 + margin
        };
        is_within(x, low.0, high.0) && is_within(y, low.1, high.1)
    }
}

/// Grey levels of a picture: means of square blocks.
fn reduced(image: &Image, scale: usize) -> Vec<f64> {
    let (width, height) = (image.width / scale, image.height / scale);
    let mut sums = vec![0_u32; width * height];
    for (y, row) in image.rgb.chunks_exact(3 * image.width).take(height * scale).enumerate() {
        for (x, pixel) in row.chunks_exact(3).take(width * scale).enumerate() {
            sums[y / scale * width + x / scale] += pixel.iter().map(|&value| u32::from(value)).sum::<u32>();
        }
    }
    let values = (3 * scale * scale) as f64;
    sums.into_iter().map(|sum| f64::from(sum) / values).collect()
}
