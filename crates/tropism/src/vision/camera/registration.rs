//! What stands still around the plant, so that a camera that was moved is found out.
//!
//! In: the first picture of a camera, then others. Out: how far each is shifted. The one idea: small templates with corners
//! in them (the pot, the lamps, folds of cloth) are looked for where they were and around there; lamps change and plants
//! move, so what most templates agree on is the camera.
//!
//! # References
//! Shi and Tomasi 1994, doi:10.1109/CVPR.1994.323794: which templates can be told from their surroundings.

use crate::geometry::{Pixel, Region};
use crate::math;
use crate::vision::raster::source::PixelSource;

/// Columns that a picture is read at.
const COLUMNS: usize = 324;

/// Samples from a patch's middle to its edge.
const HALF: i32 = 5;

/// Columns and rows of the grid in whose every field the best patch is taken.
const FIELDS: (i32, i32) = (12, 9);

/// Patches that are kept.
const MOST: usize = 28;

/// How far a patch is looked for, in samples: 2.5 cm of the paper's camera.
const FAR: i32 = 11;

/// A patch is found again where its correlation is at least this.
const ALIKE: f32 = 0.75;

/// Patches that must agree, and twice as many as agree on anything else.
const LEAST: usize = 4;

/// Shifts below this many samples are the camera's noise.
const STILL: f64 = 0.4;

/// The templates of a first picture.
#[derive(Clone, Debug)]
pub struct ReferenceFeatures {
    templates: Vec<Template>,
    /// Pixels of the picture from one sample to the next, to find a patch by and to place it by.
    step: usize,
    fine: usize,
}

#[derive(Clone, Debug)]
struct Template {
    /// The same patch at the finer step.
    fine: Option<Box<Self>>,
    x: i32,
    y: i32,
    /// Values less their mean, the root of the sum of their squares, and their mean.
    values: Vec<f32>,
    norm: f32,
    mean: f32,
}

/// Samples of a part of a picture read at a lower resolution; beyond the picture's edge its outermost are repeated.
struct Samples {
    /// Columns and rows of the whole picture.
    size: (i32, i32),
    /// Column and row of the first sample, and columns of them.
    first: (i32, i32),
    width: i32,
    /// The mean brightness of the pixels of each.
    values: Vec<f32>,
}

impl Samples {
    fn size(image: &impl PixelSource, step: usize) -> (i32, i32) {
        ((image.size().0 / step) as i32, (image.size().1 / step) as i32)
    }

    /// All samples of a picture.
    fn all(image: &impl PixelSource, step: usize) -> Self {
        let (width, height) = Self::size(image, step);
        Self::within(image, step, (0, 0), (width - 1, height - 1))
    }

    /// Those around a place, `half` to each side.
    fn around(image: &impl PixelSource, step: usize, (x, y): (i32, i32), half: i32) -> Self {
        Self::within(image, step, (x - half, y - half), (x + half, y + half))
    }

    fn within(image: &impl PixelSource, step: usize, first: (i32, i32), last: (i32, i32)) -> Self {
        let size = Self::size(image, step);
        let inside = |at: (i32, i32)| (at.0.clamp(0, size.0 - 1), at.1.clamp(0, size.1 - 1));
        let (first, last) = (inside(first), inside(last));
        let length = |from: i32, to: i32| (to - from + 1) as usize * step;
        let region = Region {
            x: first.0 as usize * step,
            y: first.1 as usize * step,
            width: length(first.0, last.0),
            height: length(first.1, last.1),
        };
        Self { size, first, width: last.0 - first.0 + 1, values: image.downscale_luma(region, step) }
    }

    fn at(&self, x: i32, y: i32) -> f32 {
        let (x, y) = (x.clamp(0, self.size.0 - 1), y.clamp(0, self.size.1 - 1));
        self.values[((y - self.first.1) * self.width + x - self.first.0) as usize]
    }

    /// The samples around a place, `half` to each side, row by row.
    fn square(&self, (x, y): (i32, i32), half: i32) -> Vec<f32> {
        (y - half..=y + half).flat_map(|y| (x - half..=x + half).map(move |x| self.at(x, y))).collect()
    }
}

fn step(image: &impl PixelSource) -> usize {
    (image.size().0 / COLUMNS).max(1)
}

impl ReferenceFeatures {
    /// The templates of a picture; those in the inner part of `crop`, where the plant moves, are left out as long as others
    /// are there.
    #[must_use]
    pub fn extract(image: &impl PixelSource, crop: Option<Region>) -> Self {
        let step = step(image);
        let (width, height) = Samples::size(image, step);
        let fine = (step / 4).max(1);
        if width.min(height) <= 0 {
            return Self { templates: Vec::new(), step, fine };
        }
        let samples = Samples::all(image, step);
        let is_plants = |x: i32, y: i32| {
            crop.is_some_and(|crop| {
                let (x, y) = (x as usize * step, y as usize * step);
                let edge = crop.width / 5;
                (crop.x + edge..crop.x + crop.width - edge).contains(&x)
                    && (crop.y..crop.y + crop.height).contains(&y)
            })
        };
        let margin = HALF + 1;
        let mut found = Vec::new();
        for field in 0..FIELDS.0 * FIELDS.1 {
            let (column, row) = (field % FIELDS.0, field / FIELDS.0);
            let columns = (column * width / FIELDS.0).max(margin)
                ..((column + 1) * width / FIELDS.0).min(width - margin);
            let rows =
                (row * height / FIELDS.1).max(margin)..((row + 1) * height / FIELDS.1).min(height - margin);
            let places = rows.step_by(3).flat_map(|y| columns.clone().step_by(3).map(move |x| (x, y)));
            let best = places
                .filter(|&(x, y)| !is_plants(x, y))
                .map(|(x, y)| (min_eigenvalue(&samples, x, y), x, y))
                .max_by(|one, other| one.0.total_cmp(&other.0));
            found.extend(best.filter(|best| best.0 > 0.0));
        }
        found.sort_by(|one, other| other.0.total_cmp(&one.0));
        found.truncate(MOST);
        let ratio = (step / fine) as i32;
        let both = |(_, x, y): (f32, i32, i32)| Template {
            fine: Some(Box::new(Template::of(image, fine, (x * ratio, y * ratio)))),
            ..Template::of(image, step, (x, y))
        };
        Self { templates: found.into_iter().map(both).collect(), step, fine }
    }

    /// How far the camera's picture has moved, in pixels to the right and down; `None` where too little is found again to
    /// say.
    #[must_use]
    pub fn estimate_shift(&self, image: &impl PixelSource) -> Option<Pixel> {
        let nowhere = (0, 0);
        // Where most templates stand still there is no need to look farther.
        let near = self.templates.iter().filter_map(|patch| patch.match_in(image, self.step, nowhere, 1));
        if near.filter(|found| found.0 == nowhere).count() >= LEAST.max(self.templates.len() / 3) {
            return Some(Pixel::default());
        }
        let far: Vec<_> = self
            .templates
            .iter()
            .filter_map(|patch| Some((patch, patch.match_in(image, self.step, nowhere, FAR)?.0)))
            .collect();
        let is_like =
            |one: (i32, i32), other: (i32, i32)| (one.0 - other.0).abs().max((one.1 - other.1).abs()) <= 1;
        let agree = |with| far.iter().filter(move |(_, at)| is_like(*at, with));
        let (_, best) = *far.iter().max_by_key(|(_, at)| agree(*at).count())?;
        let count = agree(best).count();
        let others = far
            .iter()
            .filter(|(_, at)| !is_like(*at, best) && !agree(best).any(|(_, one)| is_like(*one, *at)));
        let next = others.map(|(_, at)| agree(*at).count()).max().unwrap_or(0);
        if count < LEAST || count < 2 * next {
            return None;
        }
        // Then between pixels, at the resolution of a pixel or as near to it as is worth the time.
        let (ratio, last) = ((self.step / self.fine) as i32, self.fine as f64);
        let found: Vec<Pixel> = agree(best)
            .filter_map(|(patch, at)| {
                let there = (at.0 * ratio, at.1 * ratio);
                Some(patch.fine.as_deref().unwrap_or(patch).match_in(image, self.fine, there, ratio)?.1)
            })
            .collect();
        let middle = |axis: fn(&Pixel) -> f64| {
            let values: Vec<f64> = found.iter().map(axis).collect();
            last * math::statistics::quantile_nearest(&values, 0.5)
        };
        let (x, y) = (middle(|at| at.x), middle(|at| at.y));
        let is_still = x.abs().max(y.abs()) < STILL * self.step as f64;
        Some(if is_still { Pixel::default() } else { Pixel::new(x, y) })
    }

    /// How clear a picture whose camera moved by `shift` is, as a share of the first: how much its templates vary for their
    /// brightness. Mist on the lens takes both fine detail and contrast away.
    #[must_use]
    pub fn relative_contrast(&self, image: &impl PixelSource, shift: Pixel) -> f64 {
        let along = |by: f64| (by / self.step as f64).round() as i32;
        let (right, down) = (along(shift.x), along(shift.y));
        let share = |patch: &Template| {
            let now = Template::of(image, self.step, (patch.x + right, patch.y + down));
            f64::from(now.norm / now.mean.max(1.0) / (patch.norm / patch.mean.max(1.0)).max(1e-6))
        };
        let shares: Vec<f64> = self.templates.iter().map(share).collect();
        if shares.is_empty() { 1.0 } else { math::statistics::quantile_nearest(&shares, 0.5) }
    }

    /// Whether there is enough in the first picture to find again.
    #[must_use]
    pub fn has_enough(&self) -> bool {
        self.templates.len() >= MOST / 2
    }
}

/// The lesser eigenvalue of the gradients' products around a place: what is large there is a corner.
fn min_eigenvalue(samples: &Samples, x: i32, y: i32) -> f32 {
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for row in (y - HALF..=y + HALF).step_by(2) {
        for column in (x - HALF..=x + HALF).step_by(2) {
            let dx = samples.at(column + 1, row) - samples.at(column - 1, row);
            let dy = samples.at(column, row + 1) - samples.at(column, row - 1);
            (xx, xy, yy) = (xx + dx * dx, xy + dx * dy, yy + dy * dy);
        }
    }
    // A saturated lamp has the sharpest corners of all and says the least: the root keeps it from outweighing the rest.
    (0.5 * (xx + yy - ((xx - yy) * (xx - yy) + 4.0 * xy * xy).sqrt())).max(0.0).sqrt()
}

impl Template {
    fn of(image: &impl PixelSource, step: usize, (x, y): (i32, i32)) -> Self {
        let mut values = Samples::around(image, step, (x, y), HALF).square((x, y), HALF);
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        values.iter_mut().for_each(|value| *value -= mean);
        let norm = values.iter().map(|value| value * value).sum::<f32>().sqrt();
        Self { fine: None, x, y, values, norm, mean }
    }

    /// Where the patch is found again within `far` samples of a shift, and where between samples; `None` where nothing is
    /// alike.
    fn match_in(
        &self,
        image: &impl PixelSource,
        step: usize,
        shift: (i32, i32),
        far: i32,
    ) -> Option<((i32, i32), Pixel)> {
        let place = (self.x + shift.0, self.y + shift.1);
        let around = Samples::around(image, step, place, HALF + far).square(place, HALF + far);
        let (side, wide) = (2 * HALF + 1, 2 * (HALF + far) + 1);
        let alike = |dx: i32, dy: i32| {
            let (mut sum, mut squares, mut product) = (0.0_f32, 0.0_f32, 0.0_f32);
            for row in 0..side {
                let from = ((row + dy + far) * wide + dx + far) as usize;
                let here = &around[from..from + side as usize];
                let there = &self.values[(row * side) as usize..][..side as usize];
                for (here, there) in here.iter().zip(there) {
                    sum += here;
                    squares += here * here;
                    product += here * there;
                }
            }
            let spread = (squares - sum * sum / (side * side) as f32).max(1.0);
            product / (spread.sqrt() * self.norm.max(1.0))
        };
        let places = (-far..=far).flat_map(|dy| (-far..=far).map(move |dx| (dx, dy)));
        let scored = places.map(|(dx, dy)| (alike(dx, dy), dx, dy));
        let (best, dx, dy) = scored.max_by(|one, other| one.0.total_cmp(&other.0))?;
        if best < ALIKE {
            return None;
        }
        // The top of a parabola through the best and its neighbours; a best at the rim has none.
        let between = |before: f32, after: f32| {
            let bend = before - 2.0 * best + after;
            if bend < -1e-6 { f64::from(0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
        };
        let (mut across, mut down) = (0.0, 0.0);
        if dx.abs() < far && dy.abs() < far {
            across = between(alike(dx - 1, dy), alike(dx + 1, dy));
            down = between(alike(dx, dy - 1), alike(dx, dy + 1));
        }
        let at = (shift.0 + dx, shift.1 + dy);
        Some((at, Pixel::new(f64::from(at.0) + across, f64::from(at.1) + down)))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::photo::Image;
    use crate::random::{self, Purpose};

    /// Boxes of many sizes and shades, moved by whole pixels, and noise.
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
        fn a_camera_that_moved_is_found_out(right in -18..18_i32, down in -18..18_i32, noise in 1..1000_u64) {
            let backdrop = ReferenceFeatures::extract(&scene(0, 0, 0), None);
            let found = backdrop.estimate_shift(&scene(right, down, noise)).unwrap();
            prop_assert!((found.x - f64::from(right)).abs() <= 1.0, "{found:?}");
            prop_assert!((found.y - f64::from(down)).abs() <= 1.0, "{found:?}");
        }
    }

    #[test]
    fn mist_is_found_out_and_dimmer_light_is_none() {
        let first = scene(0, 0, 0);
        let backdrop = ReferenceFeatures::extract(&first, None);
        let changed = |change: &dyn Fn(u8) -> u8| {
            let rgb = first.rgb.iter().map(|&value| change(value)).collect();
            backdrop.relative_contrast(&Image { rgb, ..first.clone() }, Pixel::default())
        };
        assert!((changed(&|value| value) - 1.0).abs() < 1e-6);
        assert!((changed(&|value| value / 2) - 1.0).abs() < 0.1);
        assert!(changed(&|value| value / 2 + 80) < 0.6);
    }

    #[test]
    fn nothing_is_said_of_another_scene() {
        let backdrop = ReferenceFeatures::extract(&scene(0, 0, 0), None);
        let flat = Image { width: 648, height: 486, rgb: vec![90; 3 * 648 * 486] };
        assert_eq!(backdrop.estimate_shift(&flat), None);
        assert_eq!(ReferenceFeatures::extract(&flat, None).estimate_shift(&flat), None);
        let tiny = Image { width: 1, height: 1, rgb: vec![9; 3] };
        assert_eq!(ReferenceFeatures::extract(&tiny, None).estimate_shift(&tiny), None);
    }
}
