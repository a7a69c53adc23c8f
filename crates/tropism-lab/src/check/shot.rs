//! A photograph of a check: its brightness and sharpness.

use std::time::Duration;

use tropism::photo::{Image, Photo};

/// A decoded photograph and its brightness.
pub(super) struct Shot {
    pub(super) photo: Photo,
    pub(super) image: Image,
    /// How long the camera took.
    pub(super) took: Duration,
    /// Mean of all samples, in levels of 255.
    pub(super) mean: f64,
    /// Means of the left and the right half.
    pub(super) halves: [f64; 2],
}

impl Shot {
    /// Decodes `photo`, which the camera took in `took`.
    pub(super) fn new(photo: Photo, took: Duration) -> Result<Self, String> {
        let image = photo.decode().map_err(|error| error.to_string())?;
        // The middle of a row of RGB samples, between two pixels.
        let middle = 3 * image.width / 2 / 3 * 3;
        let (mut sums, mut counts) = ([0.0; 2], [0.0; 2]);
        for row in image.rgb.chunks_exact(3 * image.width) {
            for (side, half) in [&row[..middle], &row[middle..]].into_iter().enumerate() {
                sums[side] += half.iter().map(|&level| f64::from(level)).sum::<f64>();
                counts[side] += half.len() as f64;
            }
        }
        let mean = (sums[0] + sums[1]) / (counts[0] + counts[1]);
        let halves = [0, 1].map(|side| sums[side] / f64::max(counts[side], 1.0));
        Ok(Self { photo, image, took, mean, halves })
    }

    /// Mean difference of the green samples of neighbouring pixels in a row, in levels of 255: more if it is sharper.
    pub(super) fn sharpness(&self) -> f64 {
        let differences = self.image.rgb.chunks_exact(3 * self.image.width).flat_map(|row| {
            row.chunks_exact(3).zip(row.chunks_exact(3).skip(1)).map(|(a, b)| f64::from(a[1].abs_diff(b[1])))
        });
        let (sum, count) = differences.fold((0.0, 0.0), |(sum, count), found| (sum + found, count + 1.0));
        sum / f64::max(count, 1.0)
    }
}
