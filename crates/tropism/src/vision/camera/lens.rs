//! Lens distortion and perspective, calibrated from a checkerboard in the plane of the stem.
//!
//! In: corners of a checkerboard in one photograph, and their positions on the board. Out: a [`Lens`] and its
//! residuals. The one idea: the division model r / (1 + k r²) removes radial distortion and can be inverted exactly;
//! a homography then maps the undistorted picture to the plane. It starts from a linear least-squares solution and is
//! refined to the least reprojection error, as in Zhang's calibration, but of one plane and without the camera's
//! intrinsic parameters.
//!
//! # References
//! - Fitzgibbon 2001, *Simultaneous linear estimation of multiple view geometry and lens distortion*,
//!   doi:10.1109/CVPR.2001.990465: the division model.
//! - Hartley and Zisserman 2003, *Multiple View Geometry in Computer Vision*, section 4.1: homography by least
//!   squares.
//! - Zhang 2000, *A flexible new technique for camera calibration*, doi:10.1109/34.888718: refinement of the
//!   reprojection error.
//! - Levenberg 1944, doi:10.1090/qam/10666; Marquardt 1963, doi:10.1137/0111030: the refinement's algorithm.

use serde::{Deserialize, Serialize};

use crate::geometry::{Pixel, Point};
use crate::math::matrix::{
    Matrix3, determinant, identity, inverse, least_squares, multiply, solve, transform,
};
use crate::math::vector::{Vec2, Vec3, dot, normalize_or, sub};
use crate::vision::error::VisionError;

/// Map from a picture to the plane of the stem. Its origin is anywhere in the plane; [`Calibration`] moves it to the
/// root.
///
/// [`Calibration`]: crate::vision::Calibration
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Lens {
    /// Distortion k of the division model, for radii in halves of the picture's diagonal: negative for barrel
    /// distortion, 0 for none, above -1 and below 1.
    pub distortion: f64,
    /// Homography by rows: from undistorted points, in halves of the diagonal from the picture's centre with y down,
    /// to cm in the plane with y up.
    pub homography: [[f64; 3]; 3],
}

/// A fitted lens and the root mean square of its residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensFit {
    /// Fitted lens.
    pub lens: Lens,
    /// Residual in the plane, in mm.
    pub residual_mm: f64,
    /// Residual in the picture, in pixels.
    pub residual_px: f64,
}

/// A corner in the picture, in normalised coordinates, and in the plane, in cm.
type Correspondence = ((f64, f64), (f64, f64));

/// The nine parameters of the fit: the homography from plane to picture without its last element, which is 1, and the
/// distortion.
type Parameters = [f64; 9];

impl Lens {
    /// Checks that the lens maps pictures of `width` x `height` to a plane in front of the camera, finitely and one
    /// to one.
    ///
    /// # Errors
    /// [`VisionError::Value`] names the key.
    pub fn check(&self, width: usize, height: usize) -> Result<(), VisionError> {
        VisionError::check_value(
            "lens.distortion",
            self.distortion,
            self.distortion > -1.0 && self.distortion < 1.0,
            "more than -1 and less than 1",
        )?;
        let corners = [(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1)];
        let depth = |(x, y): (usize, usize)| {
            let undistorted =
                undistort(normalise(Pixel::new(x as f64, y as f64), width, height), self.distortion);
            transform(&self.homography, undistorted)[2]
        };
        let depths = corners.map(depth);
        let is_in_front = depths.iter().all(|depth| *depth > 0.0) || depths.iter().all(|depth| *depth < 0.0);
        let is_finite = self.homography.iter().flatten().all(|value| value.is_finite());
        let is_invertible = is_finite && determinant(&self.homography) != 0.0;
        VisionError::check_value(
            "lens.homography",
            format!("{:?}", self.homography),
            is_invertible && is_in_front,
            "a homography of a plane that the whole picture shows",
        )
    }

    /// Maps a pixel of a picture of `width` x `height` to the plane, in cm.
    #[must_use]
    pub fn point(&self, pixel: Pixel, width: usize, height: usize) -> Point {
        let undistorted = undistort(normalise(pixel, width, height), self.distortion);
        let [x, y, z] = transform(&self.homography, undistorted);
        Point::new(x / z, y / z)
    }

    /// Maps a point of the plane, in cm, to a pixel of a picture of `width` x `height`.
    #[must_use]
    pub fn pixel(&self, point: Point, width: usize, height: usize) -> Pixel {
        let inverse = inverse(&self.homography).unwrap_or_else(identity);
        let [x, y, z] = transform(&inverse, [point.x, point.y, 1.0]);
        let (x, y) = distort(x / z, y / z, self.distortion);
        let unit = half_diagonal(width, height);
        Pixel::new(x * unit + (width as f64 - 1.0) / 2.0, y * unit + (height as f64 - 1.0) / 2.0)
    }

    /// Local scale around a pixel, in pixels per cm: the square root of the ratio of areas.
    #[must_use]
    pub fn px_per_cm(&self, pixel: Pixel, width: usize, height: usize) -> f64 {
        let [right, up] = self.steps(pixel, width, height);
        1.0 / (right[0] * up[1] - up[0] * right[1]).abs().sqrt()
    }

    /// The Jacobian around a pixel, by central differences: a step of one pixel to the right and one up, in cm.
    fn steps(&self, pixel: Pixel, width: usize, height: usize) -> [Vec2; 2] {
        let at = |dx, dy| <[f64; 2]>::from(self.point(pixel + Pixel::new(dx, dy), width, height));
        [sub(at(0.5, 0.0), at(-0.5, 0.0)), sub(at(0.0, -0.5), at(0.0, 0.5))]
    }

    /// Fits a lens to corners, given as pixels of a picture of `width` x `height` and points of the plane in cm, by
    /// least squares of the reprojection error. Up in the plane is up in the picture at the centroid of the corners.
    ///
    /// `None` for fewer than twelve corners, or for collinear ones.
    #[must_use]
    pub fn fit(corners: &[(Pixel, Point)], width: usize, height: usize) -> Option<LensFit> {
        if corners.len() < 12 {
            return None;
        }
        let count = corners.len() as f64;
        let centroid =
            corners.iter().fold((0.0, 0.0), |sum, (_, at)| (sum.0 + at.x / count, sum.1 + at.y / count));
        let correspondences: Vec<Correspondence> = corners
            .iter()
            .map(|&(pixel, at)| (normalise(pixel, width, height), (at.x - centroid.0, at.y - centroid.1)))
            .collect();
        let parameters = refine(linear_homography(&correspondences)?, &correspondences)?;
        let matrix = inverse(&plane_to_picture(&parameters))?;
        let homography = matrix.map(|row| row.map(|value| value / matrix[2][2]));
        let mut lens = Self { distortion: parameters[8], homography };
        let centre = lens.pixel(Point::default(), width, height);
        lens.homography = multiply(&upright(&lens, centre, width, height), &lens.homography);
        lens.check(width, height).ok()?;
        let squares = sum_of_squares(&parameters, &correspondences);
        let error_cm = |&(pixel, at): &(Pixel, Point)| {
            let undistorted = undistort(normalise(pixel, width, height), lens.distortion);
            let [x, y, z] = transform(&matrix, undistorted);
            Point::new(x / z + centroid.0, y / z + centroid.1).distance(at)
        };
        let squares_cm: f64 = corners.iter().map(|corner| error_cm(corner) * error_cm(corner)).sum();
        Some(LensFit {
            lens,
            residual_mm: 10.0 * (squares_cm / count).sqrt(),
            residual_px: half_diagonal(width, height) * (squares / count).sqrt(),
        })
    }
}

/// Half of a picture's diagonal, in pixels: the unit of normalised coordinates.
fn half_diagonal(width: usize, height: usize) -> f64 {
    crate::math::hypot(width as f64, height as f64) / 2.0
}

/// Normalised coordinates of a pixel: halves of the diagonal from the picture's centre.
fn normalise(pixel: Pixel, width: usize, height: usize) -> (f64, f64) {
    let unit = half_diagonal(width, height);
    ((pixel.x - (width as f64 - 1.0) / 2.0) / unit, (pixel.y - (height as f64 - 1.0) / 2.0) / unit)
}

/// Removes distortion by the division model; homogeneous coordinates.
fn undistort((x, y): (f64, f64), distortion: f64) -> Vec3 {
    [x, y, 1.0 + distortion * (x * x + y * y)]
}

/// Applies distortion: inverts the division model, r = d / (1 + k d²), by its smaller root d.
fn distort(x: f64, y: f64, distortion: f64) -> (f64, f64) {
    let root = (1.0 - 4.0 * distortion * (x * x + y * y)).max(0.0).sqrt();
    (2.0 * x / (1.0 + root), 2.0 * y / (1.0 + root))
}

/// The homography from plane to picture.
fn plane_to_picture(p: &Parameters) -> Matrix3 {
    [[p[0], p[1], p[2]], [p[3], p[4], p[5]], [p[6], p[7], 1.0]]
}

/// Reprojection error of one corner, in normalised coordinates.
fn reprojection_error(parameters: &Parameters, &((x, y), (u, v)): &Correspondence) -> Vec2 {
    let [projected_x, projected_y, projected_z] = transform(&plane_to_picture(parameters), [u, v, 1.0]);
    let (found_x, found_y) = distort(projected_x / projected_z, projected_y / projected_z, parameters[8]);
    [found_x - x, found_y - y]
}

/// Sum of the squares of all corners' reprojection errors.
fn sum_of_squares(parameters: &Parameters, correspondences: &[Correspondence]) -> f64 {
    correspondences.iter().map(|one| reprojection_error(parameters, one)).map(|error| dot(error, error)).sum()
}

/// The homography without distortion, by linear least squares (direct linear transform with its last element set to
/// 1). `None` for collinear corners, which leave a direction of the homography undetermined.
fn linear_homography(correspondences: &[Correspondence]) -> Option<Parameters> {
    let count = 2 * correspondences.len();
    let (mut rows, mut right) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for &((x, y), (u, v)) in correspondences {
        rows.push([u, v, 1.0, 0.0, 0.0, 0.0, -x * u, -x * v]);
        rows.push([0.0, 0.0, 0.0, u, v, 1.0, -y * u, -y * v]);
        right.extend([x, y]);
    }
    let [a, b, c, d, e, f, g, h] = least_squares(&rows, &right, 1e-9)?;
    Some([a, b, c, d, e, f, g, h, 0.0])
}

/// Minimises the squares of [`reprojection_error`] by the Levenberg-Marquardt algorithm with numerical derivatives.
fn refine(start: Parameters, correspondences: &[Correspondence]) -> Option<Parameters> {
    let (mut best, mut least, mut damping) = (start, sum_of_squares(&start, correspondences), 1e-3);
    for _ in 0..100 {
        let mut normal = [[0.0; 9]; 9];
        let mut gradient = [0.0; 9];
        for correspondence in correspondences {
            let error = reprojection_error(&best, correspondence);
            // Columns of the Jacobian.
            let jacobian: [Vec2; 9] = std::array::from_fn(|i| {
                let step = 1e-6 * best[i].abs().max(1e-2);
                let mut moved = best;
                moved[i] += step;
                sub(reprojection_error(&moved, correspondence), error).map(|change| change / step)
            });
            for (i, &column) in jacobian.iter().enumerate() {
                normal[i].iter_mut().zip(jacobian).for_each(|(sum, other)| *sum += dot(column, other));
                gradient[i] += dot(column, error);
            }
        }
        for (i, row) in normal.iter_mut().enumerate() {
            row[i] += row[i] * damping;
        }
        let next = sub(best, solve(normal, gradient)?);
        let squares = sum_of_squares(&next, correspondences);
        if squares < least {
            let is_converged = least - squares < 1e-12 * least;
            (best, least, damping) = (next, squares, damping * 0.1);
            if is_converged {
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

/// The rotation that makes up in the picture up in the plane around `pixel`, with a reflection where the corners were
/// counted the other way round.
fn upright(lens: &Lens, pixel: Pixel, width: usize, height: usize) -> Matrix3 {
    let [right, up] = lens.steps(pixel, width, height);
    let [sin, cos] = normalize_or(up, [0.0, 1.0]);
    // The side of "up" on which the picture's right lies: -1 where the corners were counted in a mirror.
    let side = (right[0] * cos - right[1] * sin).signum();
    [[side * cos, -side * sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SIZE: (usize, usize) = (1296, 972);

    /// A camera 60 cm from the plane, pitched and turned, with barrel distortion.
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
