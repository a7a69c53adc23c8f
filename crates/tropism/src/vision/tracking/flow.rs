//! Optical flow of single points: the pyramidal method of Lucas and Kanade.
//!
//! In: two pictures and a pixel of the first. Out: where the second shows the same tissue, or `None`. The one idea: a
//! window is shifted until the sum of squared differences is least (Lucas and Kanade 1981), first in coarse pictures, then in
//! finer ones (Bouguet 2001); a point whose way back ends elsewhere is lost (Kalal et al. 2010, forward-backward error).
//!
//! Constants were chosen on the first halves of `scripts/score-clicks`.

use std::sync::Arc;

use crate::geometry::Pixel;
use crate::math::vector::Vec2;
use crate::vision::raster::plane::Plane;
use crate::vision::raster::source::{PixelSource, reduced_luma};

/// Levels of a pyramid.
const LEVELS: usize = 4;

/// Pixels from the middle of a window to its edge, as a share of the plant's height, and in samples at least and at most.
const RADIUS_SHARE: f64 = 0.1;
const LEAST_RADIUS: f64 = 7.0;
const MOST_RADIUS: f64 = 20.0;

/// Columns and rows of the coarsest level, at least.
const LEAST_SIDE: usize = 40;

/// Iterations on a level, at most, and the shift in samples below which they end.
const ITERATIONS: usize = 20;
const STILL: f32 = 0.01;

/// Smaller eigenvalue of the mean gradient matrix, in squared grey levels a sample, below which a window shows too little
/// structure.
const LEAST_STRUCTURE: f32 = 0.1;

/// Ratio of contrasts of two windows up to which light may have changed.
const MOST_GAIN: f32 = 3.0;

/// Forward-backward error above which a point is lost, in samples, and as a share of its motion: whichever is more.
const MOST_ERROR: f64 = 1.5;
const ERROR_SHARE: f64 = 0.25;

/// Correlation of two windows below which a point is lost.
const LEAST_CORRELATION: f32 = 0.5;

/// A picture's luma at several sizes, each half of the one before.
#[derive(Clone, Debug)]
pub struct Pyramid {
    levels: Vec<Plane>,
}

impl Pyramid {
    /// The pyramid of a picture.
    #[must_use]
    pub fn of(picture: &dyn PixelSource) -> Self {
        let mut levels = vec![reduced_luma(picture)];
        while levels.len() < LEVELS {
            let last = &levels[levels.len() - 1];
            if last.width.min(last.height) < LEAST_SIDE {
                break;
            }
            let half = halved(last);
            levels.push(half);
        }
        Self { levels }
    }

    /// Pixels along a sample of the finest level.
    fn step(&self) -> f64 {
        self.levels[0].step as f64
    }

    /// Where `other` shows what is `at` a pixel here, there and back; `None` where the point is lost. `height_px` is the
    /// plant's height.
    #[must_use]
    pub fn flow(&self, other: &Self, at: Pixel, height_px: f64) -> Option<Pixel> {
        let radius = (RADIUS_SHARE * height_px / self.step()).clamp(LEAST_RADIUS, MOST_RADIUS) as usize;
        let (there, correlation) = self.one_way(other, at, 2 * radius + 1)?;
        let (back, _) = other.one_way(self, there, 2 * radius + 1)?;
        let most_error = (MOST_ERROR * self.step()).max(ERROR_SHARE * there.distance(at));
        let is_found = correlation >= LEAST_CORRELATION && back.distance(at) <= most_error;
        is_found.then_some(there)
    }

    /// The place in `other`, and the correlation of the two windows of `side` samples.
    fn one_way(&self, other: &Self, at: Pixel, side: usize) -> Option<(Pixel, f32)> {
        let mut there = at;
        let mut found = None;
        for (one, two) in self.levels.iter().zip(&other.levels).rev() {
            found = Template::of(one, one.to_sample(at), side)
                .and_then(|template| template.find(two, two.to_sample(there)));
            if let Some((place, _)) = found {
                there = two.to_pixel(place);
            }
        }
        let (_, correlation) = found?;
        let finest = &other.levels[0];
        let [x, y] = finest.to_sample(there);
        let is_inside = x >= 0.0 && y >= 0.0 && x < finest.width as f64 && y < finest.height as f64;
        is_inside.then_some((there, correlation))
    }
}

/// A plane of half the size: means of four samples.
fn halved(plane: &Plane) -> Plane {
    let (width, height) = (plane.width / 2, plane.height / 2);
    let mut values = Vec::with_capacity(width * height);
    for y in 0..height {
        let (above, below) = (plane.row(2 * y), plane.row(2 * y + 1));
        let pairs = above.as_chunks::<2>().0.iter().zip(below.as_chunks::<2>().0);
        values.extend(pairs.map(|([a, b], [c, d])| 0.25 * (a + b + c + d)));
    }
    Plane { width, height, values, origin: plane.to_pixel([0.5, 0.5]), step: 2 * plane.step }
}

/// A window of `side` x `side` samples around a place, by bilinear interpolation; beyond the edge the outermost samples are
/// repeated.
pub(in crate::vision) fn window(plane: &Plane, [x, y]: Vec2, side: usize) -> Vec<f32> {
    let radius = (side / 2) as f64;
    let (left, top) = ((x - radius).floor(), (y - radius).floor());
    let (across, down) = ((x - radius - left) as f32, (y - radius - top) as f32);
    let index =
        |start: f64, step: usize, count: usize| (start + step as f64).clamp(0.0, count as f64 - 1.0) as usize;
    let mut values = Vec::with_capacity(side * side);
    let columns: Vec<usize> = (0..=side).map(|step| index(left, step, plane.width)).collect();
    for step in 0..side {
        let above = plane.row(index(top, step, plane.height));
        let below = plane.row(index(top, step + 1, plane.height));
        let mix = |column: usize| above[column] + down * (below[column] - above[column]);
        let mut left = mix(columns[0]);
        for &column in &columns[1..] {
            let right = mix(column);
            values.push(left + across * (right - left));
            left = right;
        }
    }
    values
}

/// Mean and standard deviation.
fn moments(values: &[f32]) -> (f32, f32) {
    let count = values.len() as f32;
    let mean = values.iter().sum::<f32>() / count;
    let variance = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f32>() / count;
    (mean, variance.sqrt())
}

/// Normalised cross-correlation of two windows, -1 to 1; 0 where one of them is flat.
#[must_use]
pub(in crate::vision) fn correlation(one: &[f32], other: &[f32]) -> f32 {
    let ((mean, deviation), (other_mean, other_deviation)) = (moments(one), moments(other));
    let scale = deviation * other_deviation * one.len() as f32;
    let sum: f32 = one.iter().zip(other).map(|(a, b)| (a - mean) * (b - other_mean)).sum();
    if scale > 1e-6 { sum / scale } else { 0.0 }
}

/// A window with its gradient.
struct Template {
    side: usize,
    values: Vec<f32>,
    mean: f32,
    deviation: f32,
    /// Of each sample, to the right and down, times its weight.
    gradient: Vec<[f32; 2]>,
    /// Inverse of the weighted sum of the outer products of the gradient: its three different entries.
    inverse: [f32; 3],
}

impl Template {
    /// `None` where the window shows too little structure to say where it is.
    fn of(plane: &Plane, place: Vec2, side: usize) -> Option<Self> {
        let wide = window(plane, place, side + 2);
        let row = side + 2;
        let (mut values, mut gradient) = (Vec::with_capacity(side * side), Vec::with_capacity(side * side));
        let [mut xx, mut xy, mut yy, mut weights] = [0.0; 4];
        // Square of the distance from the middle, as a share of the radius.
        let offset = |at: usize| {
            let share = 2.0 * at as f32 / (side + 1) as f32 - 1.0;
            share * share
        };
        for y in 1..=side {
            for x in 1..=side {
                let at = y * row + x;
                let (dx, dy) = (0.5 * (wide[at + 1] - wide[at - 1]), 0.5 * (wide[at + row] - wide[at - row]));
                values.push(wide[at]);
                // What lies towards the edge is more often background, which stands still.
                let inside = (1.0 - offset(x) - offset(y)).max(0.0);
                let weight = inside * inside;
                gradient.push([weight * dx, weight * dy]);
                weights += weight;
                (xx, xy, yy) = (xx + weight * dx * dx, xy + weight * dx * dy, yy + weight * dy * dy);
            }
        }
        let half_difference = 0.5 * (xx - yy);
        let smaller = 0.5 * (xx + yy) - (half_difference * half_difference + xy * xy).sqrt();
        if smaller < LEAST_STRUCTURE * weights {
            return None;
        }
        let determinant = xx * yy - xy * xy;
        let (mean, deviation) = moments(&values);
        Some(Self {
            side,
            values,
            mean,
            deviation,
            gradient,
            inverse: [yy, -xy, xx].map(|part| part / determinant),
        })
    }

    /// Where another plane shows the window, from a first guess on, and how well it correlates there.
    fn find(&self, plane: &Plane, guess: Vec2) -> Option<(Vec2, f32)> {
        let mut place = guess;
        let mut last = Vec::new();
        for _ in 0..ITERATIONS {
            last = window(plane, place, self.side);
            let (mean, deviation) = moments(&last);
            // Light may have changed: the window gets the template's mean and contrast.
            let gain = (self.deviation / deviation.max(1e-3)).clamp(1.0 / MOST_GAIN, MOST_GAIN);
            let [mut right, mut down] = [0.0_f32; 2];
            for ((value, wanted), [dx, dy]) in last.iter().zip(&self.values).zip(&self.gradient) {
                let difference = (wanted - self.mean) - gain * (value - mean);
                right += difference * dx;
                down += difference * dy;
            }
            let [a, b, c] = self.inverse;
            let step = [a * right + b * down, b * right + c * down];
            place = [place[0] + f64::from(step[0]), place[1] + f64::from(step[1])];
            if !place.iter().all(|at| at.is_finite()) {
                return None;
            }
            if step[0] * step[0] + step[1] * step[1] < STILL * STILL {
                break;
            }
        }
        Some((place, correlation(&last, &self.values)))
    }
}

/// A point that is followed from picture to picture.
#[derive(Clone, Debug)]
pub struct FollowedPoint {
    /// The latest picture that showed it.
    source: Arc<Pyramid>,
    at: Pixel,
    height_px: f64,
}

impl FollowedPoint {
    /// A point of a plant of a height in pixels, in a picture.
    #[must_use]
    pub const fn new(source: Arc<Pyramid>, at: Pixel, height_px: f64) -> Self {
        Self { source, at, height_px }
    }

    /// Where it is in the latest picture that showed it.
    #[must_use]
    pub const fn at(&self) -> Pixel {
        self.at
    }

    /// Follows the point into the next picture; `None` where it is lost. It is then looked for from the latest picture that
    /// showed it on, so that a black picture or a title ends nothing.
    pub fn follow(&mut self, next: &Arc<Pyramid>) -> Option<Pixel> {
        self.at = self.source.flow(next, self.at, self.height_px)?;
        self.source = Arc::clone(next);
        Some(self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photo::Image;
    use proptest::prelude::*;

    /// A smooth random texture whose content is shifted by (`right`, `down`) pixels, as bright as `gain` says.
    fn texture(right: f64, down: f64, gain: f64) -> Pyramid {
        let (width, height) = (160, 120);
        let value = |x: usize, y: usize| {
            let (x, y) = (x as f64 - right, y as f64 - down);
            let wave = |a: f64, b: f64| crate::math::sin(a * x + b * y);
            let sum = wave(0.31, 0.11) + wave(-0.17, 0.29) + wave(0.07, -0.05) + wave(0.05, 0.13);
            ((110.0 + 22.0 * sum) * gain) as u8
        };
        let rgb = (0..width * height).flat_map(|at| [value(at % width, at / width); 3]).collect();
        Pyramid::of(&Image { width, height, rgb })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn a_shift_is_found_in_any_light(right in -9.0..9.0, down in -9.0..9.0, gain in 0.6..1.4) {
            let at = Pixel::new(80.0, 60.0);
            let found = texture(0.0, 0.0, 1.0).flow(&texture(right, down, gain), at, 100.0);
            let found = found.expect("the texture is in both pictures");
            prop_assert!(found.distance(at + Pixel::new(right, down)) < 0.15, "{found:?}");
        }
    }

    #[test]
    fn a_point_is_lost_where_nothing_is_seen_and_found_again() {
        let black = Pyramid::of(&Image { width: 160, height: 120, rgb: vec![0; 3 * 160 * 120] });
        let mut point = FollowedPoint::new(Arc::new(texture(0.0, 0.0, 1.0)), Pixel::new(80.0, 60.0), 100.0);
        assert_eq!(point.follow(&Arc::new(black.clone())), None);
        assert_eq!(point.follow(&Arc::new(black)), None);
        let found = point.follow(&Arc::new(texture(3.0, 2.0, 1.0))).unwrap();
        assert!(found.distance(Pixel::new(83.0, 62.0)) < 0.15, "{found:?}");
    }

    #[test]
    fn pictures_of_any_size_have_a_pyramid() {
        for (width, height) in [(1, 1), (1, 3_000), (3_000, 2), (41, 43)] {
            let pyramid = Pyramid::of(&Image { width, height, rgb: vec![9; 3 * width * height] });
            assert_eq!(pyramid.flow(&pyramid, Pixel::default(), 100.0), None);
        }
    }
}
