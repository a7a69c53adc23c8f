//! A plane of samples, and interpolation between them.

use crate::geometry::Pixel;
use crate::math::interpolate::bilinear;
use crate::math::vector::Vec2;

/// Weights of red, green and blue in luma (ITU-R BT.601, as in OpenCV).
pub const LUMA: [f32; 3] = [0.299, 0.587, 0.114];

/// One value for each sample of a crop: luma from 0 to 255, or another weighted sum of red, green and blue.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Values, row by row from the top left.
    pub values: Vec<f32>,
    /// Place of the first sample in the photograph.
    pub origin: Pixel,
    /// Sampling step, in pixels.
    pub step: usize,
}

impl Plane {
    /// Converts column and row of this plane to a place in the photograph.
    #[must_use]
    pub fn to_pixel(&self, [x, y]: Vec2) -> Pixel {
        let step = self.step as f64;
        self.origin + Pixel::new(x * step, y * step)
    }

    /// Converts a place in the photograph to a column and row of this plane, with fractions between samples.
    #[must_use]
    pub fn to_sample(&self, pixel: Pixel) -> Vec2 {
        let Pixel { x, y } = pixel - self.origin;
        [x, y].map(|at| at / self.step as f64)
    }

    /// The value at column `x` and row `y`, by bilinear interpolation; beyond the edge the outermost samples are
    /// repeated.
    #[inline]
    pub(in crate::vision) fn bilinear(&self, place: Vec2) -> f64 {
        let neighbours = Neighbours::of(place, self.width, self.height);
        neighbours.interpolate(neighbours.indices.map(|index| f64::from(self.values[index])))
    }

    /// Row `y`.
    #[must_use]
    pub fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width..][..self.width]
    }
}

/// The four samples around a place, and where the place lies between them.
pub(in crate::vision) struct Neighbours {
    /// Upper left, upper right, lower left and lower right sample, as indices into rows of values.
    pub(in crate::vision) indices: [usize; 4],
    /// Distance from the left and from the upper samples, 0 to 1.
    fraction: (f64, f64),
}

impl Neighbours {
    /// The neighbours of a place in a grid of `width` x `height` samples; a place outside is moved to the edge.
    #[inline]
    pub(in crate::vision) fn of([x, y]: Vec2, width: usize, height: usize) -> Self {
        let (x, y) = (x.clamp(0.0, width as f64 - 1.0), y.clamp(0.0, height as f64 - 1.0));
        let (left, top) = (x as usize, y as usize);
        let (right, bottom) = ((left + 1).min(width - 1), (top + 1).min(height - 1));
        let indices =
            [top * width + left, top * width + right, bottom * width + left, bottom * width + right];
        Self { indices, fraction: (x - left as f64, y - top as f64) }
    }

    /// Bilinear interpolation of the neighbours' values.
    #[inline]
    pub(in crate::vision) fn interpolate(&self, values: [f64; 4]) -> f64 {
        bilinear(values, self.fraction.0, self.fraction.1)
    }
}
