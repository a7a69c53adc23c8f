//! Calibration of a camera: the position of the root and the scale, or the lens.
//!
//! In: a root, and a scale or a fitted lens. Out: the map between pixels and centimetres. The one idea: all lengths
//! hold in the plane of the stem alone.

use serde::{Deserialize, Serialize};

use crate::geometry::{Pixel, Point};
use crate::vision::camera::lens::Lens;
use crate::vision::error::VisionError;

/// Map from the pictures of one camera to the plane of the stem, in cm ("stored in cm and scaled to the dimensions of
/// the experiment setup", section 2.2.2).
///
/// It is one scale for the whole picture, or a [`Lens`] that was fitted to a checkerboard.
///
/// ```
/// use tropism::geometry::{Pixel, Point};
/// use tropism::vision::Calibration;
/// let calibration = Calibration::from_scale(Pixel::new(320.0, 400.0), 10.0, 640, 480);
/// assert_eq!(calibration.point(Pixel::new(340.0, 370.0)), Point::new(2.0, 3.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// The root: the pixel where the stem leaves the soil, which is (0, 0) cm.
    pub base: Pixel,
    /// Scale in the plane of the stem, in pixels per cm; with a lens, around the root.
    pub px_per_cm: f64,
    /// Columns of the calibrated pictures.
    pub width: usize,
    /// Rows of the calibrated pictures.
    pub height: usize,
    /// Root mean square residual of the marks or corners that it was fitted to, in mm; `None` where they determine it
    /// exactly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_mm: Option<f64>,
    /// Lens distortion and perspective; a camera without either if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens: Option<Lens>,
}

/// The scales that are taken: from a field of a metre a pixel, to a pixel that is a tenth of a micrometre.
const PX_PER_CM: [f64; 2] = [0.01, 1e5];

/// The largest side of a picture: that of a JPEG.
const MOST_PIXELS: usize = 65_535;

impl Calibration {
    /// A calibration by one scale for the whole picture.
    #[must_use]
    pub const fn from_scale(base: Pixel, px_per_cm: f64, width: usize, height: usize) -> Self {
        Self { base, px_per_cm, width, height, residual_mm: None, lens: None }
    }

    /// Fits the scale, in pixels per cm, to marks of known length by least squares.
    ///
    /// A mark is its two ends in pixels and its length in cm. The second value is the root mean square residual of
    /// the lengths in mm, `None` for a single mark. `None` without a mark that has a length.
    #[must_use]
    pub fn fit_scale(marks: &[([Pixel; 2], f64)]) -> Option<(f64, Option<f64>)> {
        let length_px = |[a, b]: [Pixel; 2]| a.distance(b);
        let squares: f64 = marks.iter().map(|(_, cm)| cm * cm).sum();
        let scale = marks.iter().map(|&(ends, cm)| length_px(ends) * cm).sum::<f64>() / squares;
        let error_cm = |&(ends, cm): &([Pixel; 2], f64)| length_px(ends) / scale - cm;
        let squared_errors: f64 = marks.iter().map(|mark| error_cm(mark) * error_cm(mark)).sum();
        let residual = (marks.len() > 1).then(|| 10.0 * (squared_errors / marks.len() as f64).sqrt());
        (scale.is_finite() && scale > 0.0).then_some((scale, residual))
    }

    /// Checks that every value is in its range.
    ///
    /// # Errors
    /// [`VisionError::Value`] names the key. The root may lie outside the picture.
    pub fn check(&self) -> Result<(), VisionError> {
        let Self { base, px_per_cm, width, height, .. } = *self;
        let check = VisionError::check_value;
        check(
            "px_per_cm",
            px_per_cm.to_string(),
            (PX_PER_CM[0]..=PX_PER_CM[1]).contains(&px_per_cm),
            "0.01 to 100000",
        )?;
        let is_finite = base.x.is_finite() && base.y.is_finite();
        check("base", format!("({}, {})", base.x, base.y), is_finite, "finite pixels")?;
        let is_size = |pixels: usize| (1..=MOST_PIXELS).contains(&pixels);
        check(
            "width, height",
            format!("{width} x {height}"),
            is_size(width) && is_size(height),
            "1 to 65535 pixels each",
        )?;
        self.lens.map_or(Ok(()), |lens| lens.check(width, height))
    }

    /// Maps a pixel to the plane of the stem, in cm.
    #[must_use]
    pub fn point(&self, pixel: Pixel) -> Point {
        if let Some(lens) = &self.lens {
            let [point, root] = [pixel, self.base].map(|pixel| lens.point(pixel, self.width, self.height));
            return Point::new(point.x - root.x, point.y - root.y);
        }
        Point::new((pixel.x - self.base.x) / self.px_per_cm, (self.base.y - pixel.y) / self.px_per_cm)
    }

    /// Maps a point of the plane of the stem, in cm, to a pixel.
    #[must_use]
    pub fn pixel(&self, point: Point) -> Pixel {
        if let Some(lens) = &self.lens {
            let root = lens.point(self.base, self.width, self.height);
            return lens.pixel(Point::new(root.x + point.x, root.y + point.y), self.width, self.height);
        }
        Pixel::new(self.base.x + point.x * self.px_per_cm, self.base.y - point.y * self.px_per_cm)
    }

    /// Checks that a picture of `width` x `height` has the calibrated size.
    ///
    /// # Errors
    /// [`VisionError::Size`] with both sizes.
    pub fn check_size(&self, width: usize, height: usize) -> Result<(), VisionError> {
        if (width, height) == (self.width, self.height) {
            return Ok(());
        }
        Err(VisionError::Size { width, height, wanted_width: self.width, wanted_height: self.height })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn calibration() -> Calibration {
        Calibration::from_scale(Pixel::new(360.0, 336.0), 11.0, 720, 480)
    }

    proptest! {
        #[test]
        fn pixel_undoes_point(x in -1e3..1e3, y in -1e3..1e3) {
            let there = calibration().pixel(calibration().point(Pixel::new(x, y)));
            prop_assert!((there.x - x).abs() < 1e-9 && (there.y - y).abs() < 1e-9);
        }
    }

    #[test]
    fn up_in_the_world_is_up_in_the_picture() {
        assert_eq!(calibration().point(Pixel::new(371.0, 314.0)), Point::new(1.0, 2.0));
    }

    #[test]
    fn errors_name_key_and_size() {
        let error = |calibration: Calibration| calibration.check().unwrap_err().to_string();
        assert!(error(Calibration { px_per_cm: 0.0, ..calibration() }).contains("px_per_cm = 0"));
        assert!(error(Calibration { base: Pixel::new(f64::NAN, 0.0), ..calibration() }).contains("base"));
        assert!(error(Calibration { width: 0, ..calibration() }).contains("0 x 480"));
        let size = calibration().check_size(10, 20).unwrap_err().to_string();
        assert!(size.contains("10 x 20") && size.contains("720 x 480"), "{size}");
    }

    #[test]
    fn several_marks_tell_how_well_they_agree() {
        let mark = |length, cm| ([Pixel::new(3.0, 4.0), Pixel::new(3.0, 4.0 + length)], cm);
        assert_eq!(Calibration::fit_scale(&[mark(110.0, 10.0)]), Some((11.0, None)));
        let (scale, residual) = Calibration::fit_scale(&[mark(111.0, 10.0), mark(109.0, 10.0)]).unwrap();
        assert!((scale - 11.0).abs() < 1e-12 && (residual.unwrap() - 10.0 / 11.0).abs() < 1e-12);
        assert_eq!(Calibration::fit_scale(&[mark(0.0, 10.0)]), None);
        assert_eq!(Calibration::fit_scale(&[]), None);
    }
}
