//! One value for each sample of a crop.

use crate::geometry::Pixel;

/// Weights of red, green and blue in the desaturated picture (Rec. 601, as OpenCV has them).
pub const LUMA: [f32; 3] = [0.299, 0.587, 0.114];

/// One value for each sample of a crop: grey from 0 to 255, or whatever weights of red, green and blue make of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Values, row by row from the top left.
    pub values: Vec<f32>,
    /// The photograph's column and row that the first value was sampled at.
    pub origin: (f64, f64),
    /// Pixels of the photograph from one sample to the next.
    pub step: usize,
}

impl Plane {
    /// The place in the photograph of column `x`, row `y` of this plane; fractions lie between samples.
    #[must_use]
    pub fn to_pixel(&self, x: f64, y: f64) -> Pixel {
        let step = self.step as f64;
        Pixel::new(self.origin.0 + x * step, self.origin.1 + y * step)
    }

    /// The column and row of this plane that hold a place in the photograph, fractions between samples.
    #[must_use]
    pub fn to_sample(&self, pixel: Pixel) -> (f64, f64) {
        let step = self.step as f64;
        ((pixel.x - self.origin.0) / step, (pixel.y - self.origin.1) / step)
    }

    /// The value of the sample nearest to a place in the photograph; `None` outside.
    #[must_use]
    pub fn nearest(&self, pixel: Pixel) -> Option<f32> {
        let (x, y) = self.to_sample(pixel);
        let is_inside =
            x > -0.5 && y > -0.5 && x.round() < self.width as f64 && y.round() < self.height as f64;
        is_inside.then(|| self.values[y.round() as usize * self.width + x.round() as usize])
    }

    /// One row.
    #[must_use]
    pub fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width..][..self.width]
    }
}
