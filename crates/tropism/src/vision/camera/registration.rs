//! Registration: how far a camera's picture has shifted since the first one.
//!
//! In: the first picture of a camera, then others. Out: the shift of each, and its contrast relative to the first.
//! The one idea: small templates around corners (the pot, the lamps, folds of cloth) are matched in each picture.
//! Lamps change and plants move, so the displacement that most templates agree on is the camera's.
//!
//! # References
//! - Shi and Tomasi 1994, *Good features to track*, doi:10.1109/CVPR.1994.323794: the choice of templates by the
//!   smaller eigenvalue of the structure tensor.
//! - Lewis 1995, *Fast normalized cross-correlation*: matching by the zero-mean normalised cross-correlation.

use crate::geometry::{Pixel, Region};
use crate::math;
use crate::vision::raster::source::PixelSource;

/// Columns of the coarse picture in which templates are extracted and searched: an eighth of the paper's camera's
/// 2592.
const COARSE_COLUMNS: usize = 324;

/// Samples from a template's centre to its edge. Chosen by hand.
const HALF_SIDE: i32 = 5;

/// Columns and rows of the grid of cells; the best corner of each cell is a candidate. Chosen by hand.
const GRID_CELLS: (i32, i32) = (12, 9);

/// Most templates that are kept. Chosen by hand.
const MAX_TEMPLATES: usize = 28;

/// Search range, in coarse samples: 2.5 cm in the paper's setup.
const SEARCH_RANGE: i32 = 11;

/// Least correlation of a match. Chosen by hand.
const MIN_CORRELATION: f32 = 0.75;

/// Least number of templates that must agree on a displacement; twice as many must agree on it as on any other.
/// Chosen by hand.
const MIN_VOTES: usize = 4;

/// Shifts below so many coarse samples are noise and count as none. Chosen by hand.
const NOISE_SHIFT: f64 = 0.4;

/// Column and row of a sample, or a displacement.
type Offset = (i32, i32);

/// Templates of a camera's first picture, at two resolutions.
#[derive(Clone, Debug)]
pub struct ReferenceFeatures {
    templates: Vec<(Template, Template)>,
    /// Sampling step of the first template of each pair, to search by, in pixels.
    coarse_step: usize,
    /// Sampling step of the second, to refine the shift by, in pixels.
    fine_step: usize,
}

/// A square of samples around a corner.
#[derive(Clone, Debug)]
struct Template {
    /// Its centre.
    x: i32,
    y: i32,
    /// Values less their mean.
    values: Vec<f32>,
    /// Euclidean norm of `values`.
    norm: f32,
    /// Mean of the samples.
    mean: f32,
}

/// Samples of a part of a downscaled picture; beyond the picture's edge the outermost are repeated.
struct Samples {
    /// Columns and rows of the whole downscaled picture.
    size: Offset,
    /// Column and row of the first sample of the part.
    first: Offset,
    /// Columns of the part.
    width: i32,
    /// Luma of each sample.
    values: Vec<f32>,
}

impl Samples {
    fn size(image: &dyn PixelSource, step: usize) -> Offset {
        ((image.size().0 / step) as i32, (image.size().1 / step) as i32)
    }

    /// All samples of a picture.
    fn all(image: &dyn PixelSource, step: usize) -> Self {
        let (width, height) = Self::size(image, step);
        Self::between(image, step, (0, 0), (width - 1, height - 1))
    }

    /// The square of samples around a centre, `half_side` to each side.
    fn around(image: &dyn PixelSource, step: usize, (x, y): Offset, half_side: i32) -> Self {
        Self::between(image, step, (x - half_side, y - half_side), (x + half_side, y + half_side))
    }

    fn between(image: &dyn PixelSource, step: usize, first: Offset, last: Offset) -> Self {
        let size = Self::size(image, step);
        let clamp = |at: Offset| (at.0.clamp(0, size.0 - 1), at.1.clamp(0, size.1 - 1));
        let (first, last) = (clamp(first), clamp(last));
        let length = |from: i32, to: i32| (to - from + 1) as usize * step;
        let region = Region {
            x: first.0 as usize * step,
            y: first.1 as usize * step,
            width: length(first.0, last.0),
            height: length(first.1, last.1),
        };
        let values = image.downscale_luma(region, step);
        Self { size, first, width: last.0 - first.0 + 1, values }
    }

    fn at(&self, x: i32, y: i32) -> f32 {
        let (x, y) = (x.clamp(0, self.size.0 - 1), y.clamp(0, self.size.1 - 1));
        self.values[((y - self.first.1) * self.width + x - self.first.0) as usize]
    }

    /// The square of samples around a centre, `half_side` to each side, row by row.
    fn square(&self, (x, y): Offset, half_side: i32) -> Vec<f32> {
        let columns = x - half_side..=x + half_side;
        (y - half_side..=y + half_side).flat_map(|y| columns.clone().map(move |x| self.at(x, y))).collect()
    }
}

impl ReferenceFeatures {
    /// Extracts the templates of a picture. The inner part of `crop`, where the plant moves, has none.
    #[must_use]
    pub fn extract(image: &dyn PixelSource, crop: Option<Region>) -> Self {
        let step = (image.size().0 / COARSE_COLUMNS).max(1);
        let (width, height) = Samples::size(image, step);
        let fine_step = (step / 4).max(1);
        if width.min(height) <= 0 {
            return Self { templates: Vec::new(), coarse_step: step, fine_step };
        }
        let samples = Samples::all(image, step);
        let is_plant_area = |x: i32, y: i32| {
            crop.is_some_and(|crop| {
                let (x, y) = (x as usize * step, y as usize * step);
                let margin = crop.width / 5;
                (crop.x + margin..crop.x + crop.width - margin).contains(&x)
                    && (crop.y..crop.y + crop.height).contains(&y)
            })
        };
        let margin = HALF_SIDE + 1;
        let cells = |index: i32, count: i32, size: i32| {
            (index * size / count).max(margin)..((index + 1) * size / count).min(size - margin)
        };
        let mut corners = Vec::new();
        for cell in 0..GRID_CELLS.0 * GRID_CELLS.1 {
            let columns = cells(cell % GRID_CELLS.0, GRID_CELLS.0, width);
            let rows = cells(cell / GRID_CELLS.0, GRID_CELLS.1, height);
            let places = rows.step_by(3).flat_map(|y| columns.clone().step_by(3).map(move |x| (x, y)));
            let best = places
                .filter(|&(x, y)| !is_plant_area(x, y))
                .map(|(x, y)| (min_eigenvalue(&samples, x, y), x, y))
                .max_by(|one, other| one.0.total_cmp(&other.0));
            corners.extend(best.filter(|best| best.0 > 0.0));
        }
        corners.sort_by(|one, other| other.0.total_cmp(&one.0));
        corners.truncate(MAX_TEMPLATES);
        let ratio = (step / fine_step) as i32;
        let templates = corners
            .into_iter()
            .map(|(_, x, y)| {
                (Template::of(image, step, (x, y)), Template::of(image, fine_step, (x * ratio, y * ratio)))
            })
            .collect();
        Self { templates, coarse_step: step, fine_step }
    }

    /// Estimates the shift of a picture, in pixels to the right and down; `None` where too few templates agree.
    #[must_use]
    pub fn estimate_shift(&self, image: &dyn PixelSource) -> Option<Pixel> {
        let step = self.coarse_step;
        // Most pictures have not moved: where a third of the templates match at rest, the wide search is skipped.
        let at_rest = self
            .templates
            .iter()
            .filter_map(|(coarse, _)| coarse.match_in(image, step, (0, 0), 1))
            .filter(|(displacement, _)| *displacement == (0, 0));
        if at_rest.count() >= MIN_VOTES.max(self.templates.len() / 3) {
            return Some(Pixel::default());
        }
        let matches: Vec<(&Template, Offset)> = self
            .templates
            .iter()
            .filter_map(|(coarse, fine)| Some((fine, coarse.match_in(image, step, (0, 0), SEARCH_RANGE)?.0)))
            .collect();
        let voted = vote(&matches.iter().map(|(_, displacement)| *displacement).collect::<Vec<_>>())?;
        // The finer templates give the shift to a fraction of a pixel.
        let ratio = (step / self.fine_step) as i32;
        let refined: Vec<Pixel> = matches
            .iter()
            .filter(|(_, displacement)| is_similar(*displacement, voted))
            .filter_map(|(fine, displacement)| {
                let start = (displacement.0 * ratio, displacement.1 * ratio);
                Some(fine.match_in(image, self.fine_step, start, ratio)?.1)
            })
            .collect();
        let median = |axis: fn(&Pixel) -> f64| {
            let values: Vec<f64> = refined.iter().map(axis).collect();
            self.fine_step as f64 * math::statistics::quantile_nearest(&values, 0.5)
        };
        let (x, y) = (median(|at| at.x), median(|at| at.y));
        let is_at_rest = x.abs().max(y.abs()) < NOISE_SHIFT * step as f64;
        Some(if is_at_rest { Pixel::default() } else { Pixel::new(x, y) })
    }

    /// Contrast of a picture that has shifted by `shift`, as a share of the first picture's: the median over the
    /// templates of norm by mean. Mist on the lens lowers it; dimmer light does not.
    #[must_use]
    pub fn relative_contrast(&self, image: &dyn PixelSource, shift: Pixel) -> f64 {
        let in_samples = |pixels: f64| (pixels / self.coarse_step as f64).round() as i32;
        let (right, down) = (in_samples(shift.x), in_samples(shift.y));
        let ratio = |(before, _): &(Template, Template)| {
            let now = Template::of(image, self.coarse_step, (before.x + right, before.y + down));
            f64::from(now.norm / now.mean.max(1.0) / (before.norm / before.mean.max(1.0)).max(1e-6))
        };
        let ratios: Vec<f64> = self.templates.iter().map(ratio).collect();
        if ratios.is_empty() { 1.0 } else { math::statistics::quantile_nearest(&ratios, 0.5) }
    }

    /// Whether the first picture has so many templates that a failed registration means a turned camera.
    #[must_use]
    pub fn has_enough(&self) -> bool {
        self.templates.len() >= MAX_TEMPLATES / 2
    }
}

/// The displacement with the most votes; `None` where fewer than [`MIN_VOTES`] agree on it, or not twice as many as
/// on any other.
fn vote(displacements: &[Offset]) -> Option<Offset> {
    let voters = |with: Offset| displacements.iter().filter(move |other| is_similar(**other, with));
    let best = *displacements.iter().max_by_key(|with| voters(**with).count())?;
    let votes = voters(best).count();
    let is_rival =
        |with: Offset| !is_similar(with, best) && !voters(best).any(|other| is_similar(*other, with));
    let rivals = displacements.iter().filter(|with| is_rival(**with));
    let rival_votes = rivals.map(|with| voters(*with).count()).max().unwrap_or(0);
    (votes >= MIN_VOTES && votes >= 2 * rival_votes).then_some(best)
}

/// Whether two displacements differ by one sample at most.
fn is_similar(one: Offset, other: Offset) -> bool {
    (one.0 - other.0).abs().max((one.1 - other.1).abs()) <= 1
}

/// Square root of the smaller eigenvalue of the structure tensor around a sample: large at corners (Shi and Tomasi
/// 1994). The square root keeps a saturated lamp, which is no landmark, from outweighing the rest.
fn min_eigenvalue(samples: &Samples, x: i32, y: i32) -> f32 {
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for row in (y - HALF_SIDE..=y + HALF_SIDE).step_by(2) {
        for column in (x - HALF_SIDE..=x + HALF_SIDE).step_by(2) {
            let dx = samples.at(column + 1, row) - samples.at(column - 1, row);
            let dy = samples.at(column, row + 1) - samples.at(column, row - 1);
            (xx, xy, yy) = (xx + dx * dx, xy + dx * dy, yy + dy * dy);
        }
    }
    (0.5 * (xx + yy - ((xx - yy) * (xx - yy) + 4.0 * xy * xy).sqrt())).max(0.0).sqrt()
}

impl Template {
    fn of(image: &dyn PixelSource, step: usize, (x, y): Offset) -> Self {
        let mut values = Samples::around(image, step, (x, y), HALF_SIDE).square((x, y), HALF_SIDE);
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        values.iter_mut().for_each(|value| *value -= mean);
        let norm = values.iter().map(|value| value * value).sum::<f32>().sqrt();
        Self { x, y, values, norm, mean }
    }

    /// Matches the template within `range` samples of the displacement `start`, by zero-mean normalised
    /// cross-correlation.
    ///
    /// Returns the displacement in whole samples, and between samples by a parabola through the peak; `None` where
    /// the best correlation is below [`MIN_CORRELATION`].
    fn match_in(
        &self,
        image: &dyn PixelSource,
        step: usize,
        start: Offset,
        range: i32,
    ) -> Option<(Offset, Pixel)> {
        let centre = (self.x + start.0, self.y + start.1);
        let window =
            Samples::around(image, step, centre, HALF_SIDE + range).square(centre, HALF_SIDE + range);
        let (side, window_side) = (2 * HALF_SIDE + 1, 2 * (HALF_SIDE + range) + 1);
        let correlation = |dx: i32, dy: i32| {
            let (mut sum, mut squares, mut product) = (0.0_f32, 0.0_f32, 0.0_f32);
            for row in 0..side {
                let first = ((row + dy + range) * window_side + dx + range) as usize;
                let found = &window[first..first + side as usize];
                let wanted = &self.values[(row * side) as usize..][..side as usize];
                for (found, wanted) in found.iter().zip(wanted) {
                    sum += found;
                    squares += found * found;
                    product += found * wanted;
                }
            }
            let squared_norm = (squares - sum * sum / (side * side) as f32).max(1.0);
            product / (squared_norm.sqrt() * self.norm.max(1.0))
        };
        let displacements = (-range..=range).flat_map(|dy| (-range..=range).map(move |dx| (dx, dy)));
        let scored = displacements.map(|(dx, dy)| (correlation(dx, dy), dx, dy));
        let (best, dx, dy) = scored.max_by(|one, other| one.0.total_cmp(&other.0))?;
        if best < MIN_CORRELATION {
            return None;
        }
        let peak = |before: f32, after: f32| {
            let curvature = before - 2.0 * best + after;
            if curvature < -1e-6 {
                f64::from(0.5 * (before - after) / curvature).clamp(-0.5, 0.5)
            } else {
                0.0
            }
        };
        // A best match at the edge of the window has no neighbour on one side.
        let (mut across, mut down) = (0.0, 0.0);
        if dx.abs() < range && dy.abs() < range {
            across = peak(correlation(dx - 1, dy), correlation(dx + 1, dy));
            down = peak(correlation(dx, dy - 1), correlation(dx, dy + 1));
        }
        let displacement = (start.0 + dx, start.1 + dy);
        Some((displacement, Pixel::new(f64::from(displacement.0) + across, f64::from(displacement.1) + down)))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::photo::Image;
    use crate::random::{self, Purpose};

    /// Boxes of many sizes and shades, shifted by whole pixels, with noise.
    fn scene(right: i32, down: i32, noise: u64) -> Image {
        let (width, height) = (648, 486);
        let mut image = Image { width, height, rgb: vec![30; 3 * width * height] };
        let mut rng = random::stream(7, Purpose::Scene, 0);
        for _ in 0..60 {
            let mut draw = |most: f64| (most * random::uniform(&mut rng)) as i32;
            let (x, y, wide, high) = (draw(640.0), draw(480.0), 20 + draw(60.0), 20 + draw(60.0));
            let shade = 30 + draw(200.0) as u8;
            for row in (y + down).max(0)..(y + down + high).min(486) {
                for column in (x + right).max(0)..(x + right + wide).min(648) {
                    image.rgb[3 * (row as usize * width + column as usize)..][..3].fill(shade);
                }
            }
        }
        let mut rng = random::stream(noise, Purpose::Camera, 0);
        for value in &mut image.rgb {
            *value = value.saturating_add((4.0 * random::uniform(&mut rng)) as u8);
        }
        image
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn a_shifted_camera_is_registered(right in -18..18_i32, down in -18..18_i32, noise in 1..1000_u64) {
            let features = ReferenceFeatures::extract(&scene(0, 0, 0), None);
            let found = features.estimate_shift(&scene(right, down, noise)).unwrap();
            prop_assert!((found.x - f64::from(right)).abs() <= 1.0, "{found:?}");
            prop_assert!((found.y - f64::from(down)).abs() <= 1.0, "{found:?}");
        }
    }

    #[test]
    fn mist_lowers_contrast_and_dimmer_light_does_not() {
        let first = scene(0, 0, 0);
        let features = ReferenceFeatures::extract(&first, None);
        let changed = |change: &dyn Fn(u8) -> u8| {
            let rgb = first.rgb.iter().map(|&value| change(value)).collect();
            features.relative_contrast(&Image { rgb, ..first.clone() }, Pixel::default())
        };
        assert!((changed(&|value| value) - 1.0).abs() < 1e-6);
        assert!((changed(&|value| value / 2) - 1.0).abs() < 0.1);
        assert!(changed(&|value| value / 2 + 80) < 0.6);
    }

    #[test]
    fn another_scene_is_not_registered() {
        let features = ReferenceFeatures::extract(&scene(0, 0, 0), None);
        let flat = Image { width: 648, height: 486, rgb: vec![90; 3 * 648 * 486] };
        assert_eq!(features.estimate_shift(&flat), None);
        assert_eq!(ReferenceFeatures::extract(&flat, None).estimate_shift(&flat), None);
        let tiny = Image { width: 1, height: 1, rgb: vec![9; 3] };
        assert_eq!(ReferenceFeatures::extract(&tiny, None).estimate_shift(&tiny), None);
    }
}
