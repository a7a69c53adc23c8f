//! How a lens and a tilted camera map the plane of the stem, learned from a checkerboard held there.
//!
//! In: corners of a board in a photograph, and where on the board they are. Out: a [`Lens`], and how well it fits. The
//! one idea: a distorted radius becomes a straight one by division, r / (1 + distortion r²), which can be undone exactly;
//! what is straight maps to the plane by a homography.
//!
//! # References
//! Fitzgibbon 2001, *Simultaneous linear estimation of multiple view geometry and lens distortion*,
//! doi:10.1109/CVPR.2001.990465 (the division model).

use serde::{Deserialize, Serialize};

use crate::geometry::{Pixel, Point};
use crate::math::matrix::{
    Matrix3, determinant, identity, inverse, least_squares, multiply, solve, transform,
};
use crate::math::vector::{Vec2, Vec3, dot, sub};
use crate::vision::error::VisionError;

/// The map from a picture to the plane of the stem. Its cm count from somewhere in the plane; [`Calibration`] counts them
/// from the root.
///
/// [`Calibration`]: crate::vision::Calibration
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lens {
    /// Distortion for radii in halves of the picture's diagonal: negative for a barrel, 0 for none, above -1 and below 1.
    pub distortion: f64,
    /// From undistorted places, in halves of the diagonal from the picture's centre with y down, to cm in the plane with y
    /// up: rows of a homography.
    pub homography: [[f64; 3]; 3],
}

/// A lens and how far the corners it was fitted to are from where it places them, as root mean squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensFit {
    /// The lens.
    pub lens: Lens,
    /// In the plane, in mm.
    pub residual_mm: f64,
    /// In the picture, in pixels.
    pub residual_px: f64,
}

/// Where a corner is in the picture, in halves of its diagonal from its centre, and in the plane, in cm.
type Pair = ((f64, f64), (f64, f64));

/// Nine numbers to fit: the homography from plane to picture but for its last element, which is 1, and the distortion.
type Parameters = [f64; 9];

impl Lens {
    /// Checks that it is a map of pictures of `width` x `height`: whole, one to one, and of a plane before the camera.
    ///
    /// # Errors
    /// [`VisionError::Value`] names the key.
    pub fn check(&self, width: usize, height: usize) -> Result<(), VisionError> {
        if !(self.distortion > -1.0 && self.distortion < 1.0) {
            let found = self.distortion.to_string();
            return Err(VisionError::Value {
                key: "lens.distortion",
                found,
                wanted: "more than -1 and less than 1",
            });
        }
        let corners = [(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1)];
        let depth = |(x, y): (usize, usize)| {
            let place = straight(normal(Pixel::new(x as f64, y as f64), width, height), self.distortion);
            transform(&self.homography, place)[2]
        };
        let depths = corners.map(depth);
        let is_before = depths.iter().all(|depth| *depth > 0.0) || depths.iter().all(|depth| *depth < 0.0);
        let is_finite = self.homography.iter().flatten().all(|value| value.is_finite());
        let is_whole = is_finite && determinant(&self.homography) != 0.0;
        if is_whole && is_before {
            return Ok(());
        }
        let found = format!("{:?}", self.homography);
        let wanted = "a homography of a plane that the whole picture shows";
        Err(VisionError::Value { key: "lens.homography", found, wanted })
    }

    /// The place in the plane, in cm, that a pixel of a picture of `width` x `height` shows.
    #[must_use]
    pub fn point(&self, pixel: Pixel, width: usize, height: usize) -> Point {
        let [x, y, z] = transform(&self.homography, straight(normal(pixel, width, height), self.distortion));
        Point::new(x / z, y / z)
    }

    /// The pixel that shows a place in the plane.
    #[must_use]
    pub fn pixel(&self, point: Point, width: usize, height: usize) -> Pixel {
        let inverse = inverse(&self.homography).unwrap_or_else(identity);
        let [x, y, z] = transform(&inverse, [point.x, point.y, 1.0]);
        let (x, y) = bent(x / z, y / z, self.distortion);
        let unit = unit(width, height);
        Pixel::new(x * unit + (width as f64 - 1.0) / 2.0, y * unit + (height as f64 - 1.0) / 2.0)
    }

    /// Pixels per cm around a pixel: the square root of how much larger areas are.
    #[must_use]
    pub fn px_per_cm(&self, pixel: Pixel, width: usize, height: usize) -> f64 {
        let near = |dx, dy| self.point(Pixel::new(pixel.x + dx, pixel.y + dy), width, height);
        let (left, right, up, down) = (near(-0.5, 0.0), near(0.5, 0.0), near(0.0, -0.5), near(0.0, 0.5));
        let area = (right.x - left.x) * (up.y - down.y) - (up.x - down.x) * (right.y - left.y);
        1.0 / area.abs().sqrt()
    }

    /// The lens that shows `corners`, places in the plane in cm, at their pixels in a picture of `width` x `height`: least
    /// squares of pixels. Up in the plane is what is up in the picture at the middle of the corners.
    ///
    /// `None` for fewer than twelve corners, or corners that lie on a line.
    #[must_use]
    pub fn fit(corners: &[(Pixel, Point)], width: usize, height: usize) -> Option<LensFit> {
        if corners.len() < 12 {
            return None;
        }
        let count = corners.len() as f64;
        let middle =
            corners.iter().fold((0.0, 0.0), |sum, (_, at)| (sum.0 + at.x / count, sum.1 + at.y / count));
        let pairs: Vec<Pair> = corners
            .iter()
            .map(|&(pixel, at)| (normal(pixel, width, height), (at.x - middle.0, at.y - middle.1)))
            .collect();
        let parameters = refined(linear(&pairs)?, &pairs)?;
        let matrix = inverse(&plane_to_picture(&parameters))?;
        let homography = matrix.map(|row| row.map(|value| value / matrix[2][2]));
        let mut lens = Self { distortion: parameters[8], homography };
        let centre = lens.pixel(Point::default(), width, height);
        lens.homography = multiply(&upright(&lens, centre, width, height), &lens.homography);
        lens.check(width, height).ok()?;
        let off = squares(&parameters, &pairs);
        let place = |&(pixel, at): &(Pixel, Point)| {
            let [x, y, z] = transform(&matrix, straight(normal(pixel, width, height), lens.distortion));
            Point::new(x / z + middle.0, y / z + middle.1).distance(at)
        };
        let off_cm: f64 = corners.iter().map(|corner| place(corner) * place(corner)).sum();
        Some(LensFit {
            lens,
            residual_mm: 10.0 * (off_cm / count).sqrt(),
            residual_px: unit(width, height) * (off / count).sqrt(),
        })
    }
}

/// Half of the picture's diagonal, in pixels.
fn unit(width: usize, height: usize) -> f64 {
    crate::math::hypot(width as f64, height as f64) / 2.0
}

/// A pixel in halves of the diagonal from the picture's centre.
fn normal(pixel: Pixel, width: usize, height: usize) -> (f64, f64) {
    let unit = unit(width, height);
    ((pixel.x - (width as f64 - 1.0) / 2.0) / unit, (pixel.y - (height as f64 - 1.0) / 2.0) / unit)
}

/// Where a place of the picture would be without distortion.
fn straight((x, y): (f64, f64), distortion: f64) -> Vec3 {
    [x, y, 1.0 + distortion * (x * x + y * y)]
}

/// Where an undistorted place is in the picture: the smaller root of r = bent / (1 + distortion bent²).
fn bent(x: f64, y: f64, distortion: f64) -> (f64, f64) {
    let root = (1.0 - 4.0 * distortion * (x * x + y * y)).max(0.0).sqrt();
    (2.0 * x / (1.0 + root), 2.0 * y / (1.0 + root))
}

fn plane_to_picture(p: &Parameters) -> Matrix3 {
    [[p[0], p[1], p[2]], [p[3], p[4], p[5]], [p[6], p[7], 1.0]]
}

/// How far a corner is from where the parameters place it, in the picture.
fn error(parameters: &Parameters, &((x, y), (u, v)): &Pair) -> Vec2 {
    let [place_x, place_y, place_z] = transform(&plane_to_picture(parameters), [u, v, 1.0]);
    let (seen_x, seen_y) = bent(place_x / place_z, place_y / place_z, parameters[8]);
    [seen_x - x, seen_y - y]
}

/// The sum of the squares of all corners' errors.
fn squares(parameters: &Parameters, pairs: &[Pair]) -> f64 {
    pairs.iter().map(|pair| error(parameters, pair)).map(|error| dot(error, error)).sum()
}

/// The homography without distortion, by linear least squares.
fn linear(pairs: &[Pair]) -> Option<Parameters> {
    let (mut rows, mut right) = (Vec::with_capacity(2 * pairs.len()), Vec::with_capacity(2 * pairs.len()));
    for &((x, y), (u, v)) in pairs {
        rows.push([u, v, 1.0, 0.0, 0.0, 0.0, -x * u, -x * v]);
        rows.push([0.0, 0.0, 0.0, u, v, 1.0, -y * u, -y * v]);
        right.extend([x, y]);
    }
    let [a, b, c, d, e, f, g, h] = least_squares(&rows, &right, 1e-9)?;
    Some([a, b, c, d, e, f, g, h, 0.0])
}

/// Levenberg's and Marquardt's descent to the least squares of [`error`].
fn refined(start: Parameters, pairs: &[Pair]) -> Option<Parameters> {
    let (mut best, mut least, mut damping) = (start, squares(&start, pairs), 1e-3);
    for _ in 0..100 {
        let mut normal = [[0.0; 9]; 9];
        let mut slope = [0.0; 9];
        for pair in pairs {
            let here = error(&best, pair);
            let change: [Vec2; 9] = std::array::from_fn(|i| {
                let step = 1e-6 * best[i].abs().max(1e-2);
                let mut there = best;
                there[i] += step;
                sub(error(&there, pair), here).map(|change| change / step)
            });
            for (i, &own) in change.iter().enumerate() {
                normal[i].iter_mut().zip(change).for_each(|(sum, other)| *sum += dot(own, other));
                slope[i] += dot(own, here);
            }
        }
        for (i, row) in normal.iter_mut().enumerate() {
            row[i] += row[i] * damping;
        }
        let next = sub(best, solve(normal, slope)?);
        let squares = squares(&next, pairs);
        if squares < least {
            let is_done = least - squares < 1e-12 * least;
            (best, least, damping) = (next, squares, damping * 0.1);
            if is_done {
                break;
            }
        } else if damping > 1e9 {
            break;
        } else {
            damping *= 10.0;
        }
    }
    least.is_finite().then_some(best)
}

/// The turn, and mirroring if the corners were counted the other way round, that lets up in the picture be up in the
/// plane around `pixel`.
fn upright(lens: &Lens, pixel: Pixel, width: usize, height: usize) -> Matrix3 {
    let near = |dx, dy| lens.point(Pixel::new(pixel.x + dx, pixel.y + dy), width, height);
    let (left, right, above, below) = (near(-0.5, 0.0), near(0.5, 0.0), near(0.0, -0.5), near(0.0, 0.5));
    let (x, y) = (above.x - below.x, above.y - below.y);
    let length = crate::math::hypot(x, y);
    let (sin, cos) = (x / length, y / length);
    // The direction at a right angle to up that the picture's right points to.
    let side = ((right.x - left.x) * cos - (right.y - left.y) * sin).signum();
    [[side * cos, -side * sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SIZE: (usize, usize) = (1296, 972);

    /// A camera that looks at the plane from 60 cm, pitched, turned and with a barrel of a lens.
    fn lens(distortion: f64, pitch: f64, turn: f64) -> Lens {
        let homography = [[40.0, 2.0 * turn, 1.0], [0.0, -40.0, 12.0], [turn, pitch, 1.0]];
        Lens { distortion, homography }
    }

    fn board(lens: &Lens) -> Vec<(Pixel, Point)> {
        let place = |i: i32| Point::new(2.0 * f64::from(i % 9) - 8.0, 2.0 * f64::from(i / 9) + 5.0);
        (0..54).map(|i| (lens.pixel(place(i), SIZE.0, SIZE.1), place(i))).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn pixel_undoes_point(
            x in 0.0..1296.0, y in 0.0..972.0, distortion in -0.3..0.2, pitch in -0.2..0.2, turn in -0.2..0.2
        ) {
            let lens = lens(distortion, pitch, turn);
            prop_assert!(lens.check(SIZE.0, SIZE.1).is_ok());
            let there = lens.pixel(lens.point(Pixel::new(x, y), SIZE.0, SIZE.1), SIZE.0, SIZE.1);
            prop_assert!((there.x - x).abs() < 1e-6 && (there.y - y).abs() < 1e-6, "{there:?}");
        }

        #[test]
        fn a_lens_is_found_again(
            distortion in -0.2..0.1, pitch in -0.15..0.15, turn in -0.1..0.1, corner in 0..4_usize, is_mirrored: bool
        ) {
            let truth = lens(distortion, pitch, turn);
            // Whichever corner of the board is counted first, and whichever way round.
            let counted: Vec<(Pixel, Point)> = board(&truth)
                .into_iter()
                .map(|(pixel, at)| {
                    let at = [at, Point::new(at.y, -at.x), Point::new(-at.x, -at.y), Point::new(-at.y, at.x)][corner];
                    (pixel, if is_mirrored { at.mirrored() } else { at })
                })
                .collect();
            let fit = Lens::fit(&counted, SIZE.0, SIZE.1).unwrap();
            prop_assert!(fit.residual_px < 1e-4 && fit.residual_mm < 1e-4, "{fit:?}");
            prop_assert!((fit.lens.distortion - distortion).abs() < 1e-4, "{fit:?}");
            let cm = |lens: &Lens, (a, b): (Pixel, Pixel)| {
                lens.point(a, SIZE.0, SIZE.1).distance(lens.point(b, SIZE.0, SIZE.1))
            };
            let ends = (Pixel::new(500.0, 700.0), Pixel::new(800.0, 250.0));
            prop_assert!((cm(&fit.lens, ends) - cm(&truth, ends)).abs() < 1e-3);
            let [low, high] = [750.0, 250.0].map(|y| fit.lens.point(Pixel::new(640.0, y), SIZE.0, SIZE.1).y);
            let [left, right] = [400.0, 900.0].map(|x| fit.lens.point(Pixel::new(x, 500.0), SIZE.0, SIZE.1).x);
            prop_assert!(high > low && right > left, "up is up and right is right");
        }
    }

    #[test]
    fn corners_on_a_line_or_too_few_fit_nothing() {
        let all = board(&lens(-0.1, 0.05, 0.05));
        assert!(Lens::fit(&all[..11], SIZE.0, SIZE.1).is_none());
        let row: Vec<(Pixel, Point)> = all[..9].iter().chain(&all[..9]).copied().collect();
        assert!(Lens::fit(&row, SIZE.0, SIZE.1).is_none());
    }

    #[test]
    fn what_cannot_be_a_lens_is_named() {
        let error = |lens: Lens| lens.check(SIZE.0, SIZE.1).unwrap_err().to_string();
        assert!(error(lens(1.0, 0.0, 0.0)).contains("lens.distortion = 1, wanted"));
        assert!(error(lens(f64::NAN, 0.0, 0.0)).contains("lens.distortion"));
        assert!(error(lens(0.0, 5.0, 0.0)).contains("lens.homography"));
        assert!(error(Lens { distortion: 0.0, homography: [[f64::NAN; 3]; 3] }).contains("lens.homography"));
    }

    #[test]
    fn the_scale_around_a_pixel_is_that_of_small_things_there() {
        let lens = lens(-0.1, 0.1, 0.0);
        let at = Pixel::new(700.0, 800.0);
        let near = Pixel::new(701.0, 800.0);
        let cm = lens.point(at, SIZE.0, SIZE.1).distance(lens.point(near, SIZE.0, SIZE.1));
        assert!((lens.px_per_cm(at, SIZE.0, SIZE.1) * cm - 1.0).abs() < 0.1);
    }
}
