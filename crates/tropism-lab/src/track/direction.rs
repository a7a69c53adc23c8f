//! In which direction a plant grows, from its root and its stem in the first photographs.
//!
//! In: photographs, the root and the region of a plant. Out: the direction in which its stem leaves the root. The one
//! idea: the same stem is found whichever way a picture is turned, and its lower half shows where it leads.

use tropism::geometry::{Pixel, Region};
use tropism::vision::location::{Location, locate};
use tropism::vision::raster::source::PixelSource;
use tropism::vision::{Direction, Frame as Picture, VisionConfig, detect_from_base};

use super::clicks::PlantClick;
use super::plan::TrackPlan;
use super::plants::{PlantPlan, foot};
use super::series::Frame;
use crate::{Monitor, files};

/// Photographs that are looked at: chosen, half an hour.
const LOOKED_AT: usize = 6;

/// Share of them in which the stem must lead in one direction.
const LEAST_AGREEING: f64 = 0.6;

/// Least length of a stem, in its widths: chosen, what is shorter shows no direction.
const LEAST_LENGTH: f64 = 5.0;

/// How much farther a stem leads in its direction than across it: chosen, about 63 degrees, so that a stem that leans grows up.
const LEAST_SLOPE: f64 = 2.0;

impl TrackPlan {
    /// Whether the direction in which the plant grows is to be found.
    pub(super) fn finds_up(&self) -> bool {
        self.find_up && self.vision.up == Direction::Up && self.vision.poles.is_empty()
    }

    /// The plan with the direction in which its only plant grows, where that is to be found. A root that is not known is
    /// looked for at the middle of each edge. Where the stem shows no direction, what moves in the region may.
    pub(super) fn turned(&self, frames: &[Frame], monitor: &dyn Monitor) -> Self {
        let mut plan = self.clone();
        let [PlantPlan { base, region, clicks, .. }] = self.plants.as_slice() else { return plan };
        if !self.finds_up() {
            return plan;
        }
        let clicked = clicks.root.first().map(PlantClick::at);
        let base = base.or(clicked).or_else(|| self.scale.base());
        let by_stem = self.direction_of_stem(frames, base, *region).map(|up| (up, "the stem leads"));
        let by_motion = || {
            let is_series = !self.each && frames.len() > 1;
            let region = region.filter(|_| is_series && base.is_none())?;
            Some((self.direction_of_motion(frames, region)?, "what moves leads"))
        };
        let found = by_stem.or_else(by_motion).filter(|(up, _)| *up != Direction::Up);
        if let Some((up, evidence)) = found {
            let word = up.name();
            monitor.note(&format!(
                "{evidence} {word} from the root: the plant is taken to grow {word}. `up` gives another direction"
            ));
            plan.vision.up = up;
        }
        plan
    }

    /// The direction in which the stem leads from the root in most of the first photographs, if it does in one.
    fn direction_of_stem(
        &self,
        frames: &[Frame],
        base: Option<Pixel>,
        region: Option<Region>,
    ) -> Option<Direction> {
        let config = VisionConfig { crop: region, ..self.vision.clone() };
        let read = |frame: &Frame| files::read_photo(&frame.path, frame.time_s).ok();
        let pictures = frames.iter().filter_map(read).map(Picture::new);
        let found: Vec<Option<Direction>> = pictures
            .filter_map(|picture| Some(growth(picture.picture().ok()?, base, &config)))
            .take(LOOKED_AT)
            .collect();
        let agreeing = |up: Direction| found.iter().filter(|other| **other == Some(up)).count() as f64;
        let is_agreed = |up: &Direction| agreeing(*up) >= LEAST_AGREEING * found.len().max(1) as f64;
        Direction::ALL.into_iter().find(is_agreed)
    }

    /// The direction in which the only thing that moves in a region grows, if it is a plant.
    fn direction_of_motion(&self, frames: &[Frame], region: Region) -> Option<Direction> {
        let read = |index: usize| {
            let frame = &frames[index];
            let picture = frame.picture()?;
            let (width, height) = picture.size();
            region.fits(width, height).then(|| picture.crop(region).into_owned())
        };
        match locate(frames.len(), read, &self.vision, &Direction::ALL) {
            Location::Plant { up, .. } => Some(up),
            Location::Several(_) | Location::Unsure(_) => None,
        }
    }
}

/// The direction in which the stem leads from `base` in a picture, or from the middle of the edge opposite to it; `None` where
/// none is clear.
fn growth(picture: &dyn PixelSource, base: Option<Pixel>, config: &VisionConfig) -> Option<Direction> {
    let (width, height) = picture.size();
    let region = config.crop.unwrap_or(Region { x: 0, y: 0, width, height });
    let leads = |up: Direction| {
        let base = base.unwrap_or_else(|| foot(region, up));
        let config = VisionConfig { up, ..config.clone() };
        let found = detect_from_base(picture, Some(base), &config)?;
        let (stem, width) = (found.stem?, found.stem_width?);
        let length: f64 = stem.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        let middle = stem[stem.len() / 2];
        let (right, down) = (middle.x - stem[0].x, middle.y - stem[0].y);
        let (along, across) = match up {
            Direction::Up => (-down, right),
            Direction::Left => (-right, down),
            Direction::Right => (right, down),
            Direction::Down => (down, right),
        };
        (length >= LEAST_LENGTH * width && along > 0.0).then_some((along / across.abs().max(1e-9), length))
    };
    // A stem that leans grows up. Its tip may be as near to an edge as its root, which is known where it is given.
    let upwards = leads(Direction::Up).is_some_and(|(slope, _)| slope * LEAST_SLOPE >= 1.0);
    if upwards && base.is_some() {
        return Some(Direction::Up);
    }
    let turned = Direction::ALL.into_iter().filter(|up| *up != Direction::Up);
    let leading = turned.filter_map(|up| Some((up, leads(up)?)));
    let clear = leading.filter(|(_, (slope, _))| *slope >= LEAST_SLOPE);
    let longest = clear.max_by(|(_, one), (_, other)| one.1.total_cmp(&other.1));
    match longest {
        Some(_) if upwards => None,
        Some((up, _)) => Some(up),
        None => upwards.then_some(Direction::Up),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use tropism::photo::Image;

    use super::*;

    /// A bent shoot that grows to the right out of a root at the left edge, turned by quarters to the left.
    fn shoot(quarters: usize) -> (Image, Pixel) {
        let side = 120;
        let mut image = Image { width: side, height: side, rgb: vec![20; 3 * side * side] };
        let turn = |x: usize, y: usize| (0..quarters).fold((x, y), |(x, y), _| (y, side - 1 - x));
        for x in 5..100 {
            let middle = 60 - x * x / 400;
            for y in middle - 3..=middle + 3 {
                let (column, row) = turn(x, y);
                image.rgb[3 * (row * side + column)..][..3].copy_from_slice(&[90, 200, 60]);
            }
        }
        let (x, y) = turn(5, 60);
        (image, Pixel::new(x as f64, y as f64))
    }

    #[test]
    fn a_shoot_grows_where_its_stem_leads() {
        let wanted = [Direction::Right, Direction::Up, Direction::Left, Direction::Down];
        for (quarters, wanted) in wanted.into_iter().enumerate() {
            let (image, base) = shoot(quarters);
            for base in [Some(base), None] {
                assert_eq!(growth(&image, base, &VisionConfig::default()), Some(wanted));
            }
        }
    }

    /// Side of the pictures in which a shoot moves.
    const SIDE: usize = 130;

    /// Photographs of a shoot in soil that leans to the right by `lean` more in each, turned by quarters to the left. Beside it
    /// something else moves.
    fn leaning(folder: &Path, quarters: usize, lean: usize) -> Vec<Frame> {
        let turn = |x: usize, y: usize| (0..quarters).fold((x, y), |(x, y), _| (y, SIDE - 1 - x));
        let photograph = |step: usize| {
            let mut image = Image { width: SIDE, height: SIDE, rgb: vec![20; 3 * SIDE * SIDE] };
            let mut paint = |x: usize, y: usize| {
                let (x, y) = turn(x, y);
                image.rgb[3 * (y * SIDE + x)..][..3].fill(200);
            };
            (0..SIDE).for_each(|x| (90..SIDE).for_each(|y| paint(x, y)));
            for y in 30..90 {
                let left = 40 + lean * step * (90 - y) * (90 - y) / 1_800;
                (left..left + 5).for_each(|x| paint(x, y));
            }
            let jump = 5 + 30 * (step % 2);
            (0..8).for_each(|x| (jump..jump + 12).for_each(|y| paint(SIDE - 4 - x, y)));
            let name = format!("{step}.jpg");
            let path = folder.join(&name);
            std::fs::write(&path, image.to_jpeg(95).unwrap()).unwrap();
            Frame { path, name, step: step as u32, time_s: 300.0 * step as f64 }
        };
        (0..9).map(photograph).collect()
    }

    /// The region of [`leaning`] without what moves beside the shoot: the right tenth, turned with the pictures.
    fn region(quarters: usize) -> Region {
        let most = SIDE * 9 / 10;
        let (x, y) = [(0, 0), (0, SIDE - most), (SIDE - most, 0), (0, 0)][quarters];
        let (width, height) = if quarters.is_multiple_of(2) { (most, SIDE) } else { (SIDE, most) };
        Region { x, y, width, height }
    }

    #[test]
    fn what_moves_in_a_region_grows_away_from_its_root() {
        let folder = tempfile::tempdir().unwrap();
        let plan = TrackPlan::default();
        let wanted = [Direction::Up, Direction::Left, Direction::Down, Direction::Right];
        for (quarters, wanted) in wanted.into_iter().enumerate() {
            let frames = leaning(folder.path(), quarters, 1);
            assert_eq!(plan.direction_of_motion(&frames, region(quarters)), Some(wanted));
        }
        // With two things that move, where nothing moves, and where a region is larger than the pictures, it is not known.
        let frames = leaning(folder.path(), 0, 1);
        let whole = Region { x: 0, y: 0, width: SIDE, height: SIDE };
        assert_eq!(plan.direction_of_motion(&frames, whole), None);
        assert_eq!(plan.direction_of_motion(&frames, Region { width: SIDE + 1, ..whole }), None);
        assert_eq!(plan.direction_of_motion(&leaning(folder.path(), 0, 0), region(0)), None);
    }
}
