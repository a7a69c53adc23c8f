//! The paper's stem (section 4): plant pixels by the colour thresholds of eq. (10), and the median x of each row.
//!
//! In: the pixels of a crop. Out: one point a row, from the lowest row up; a tracker resamples them to ten vertices.

use crate::geometry::{Pixel, Region};
use crate::photo::Image;
use crate::vision::config::{Brightness, StemConfig};

impl StemConfig {
    /// Whether a pixel is plant by eq. (10); channels run from 0 to 1.
    ///
    /// ```
    /// use tropism::vision::config::StemConfig;
    /// let config = StemConfig::default();
    /// assert!(config.is_plant(0.1, 0.65, 0.1) && config.is_plant(0.9, 0.76, 0.2));
    /// assert!(!config.is_plant(0.4, 0.7, 0.1));
    /// ```
    #[must_use]
    pub fn is_plant(&self, r: f64, g: f64, b: f64) -> bool {
        let v = match self.value {
            Brightness::Max => r.max(g).max(b),
            Brightness::Lightness => f64::midpoint(r.max(g).max(b), r.min(g).min(b)),
            Brightness::Luma => 0.299 * r + 0.587 * g + 0.114 * b,
        };
        (g - r >= self.excess && g - b >= self.excess) || g >= self.green || v >= self.brightness
    }
}

/// The median x of the plant pixels (eq. 10) of each row of `crop`, from the lowest row up; rows without plant are
/// left out.
///
/// # Panics
/// If `crop` does not lie inside the picture.
#[must_use]
pub fn row_medians(image: &Image, crop: Region, config: &StemConfig) -> Vec<Pixel> {
    let row = |y: usize| {
        let start = 3 * (y * image.width + crop.x);
        image.rgb[start..start + 3 * crop.width].chunks_exact(3)
    };
    // A pixel without a channel of at least this value cannot be plant: almost all of a dark tent is skipped.
    let threshold = (255.0 * config.excess.min(config.green).min(config.brightness)) as u8;
    let mut stem = Vec::new();
    let mut columns = Vec::new();
    for y in (crop.y..crop.y + crop.height).rev() {
        columns.clear();
        columns.extend(row(y).enumerate().filter_map(|(x, pixel)| {
            let may_be_plant = pixel.iter().any(|&level| level >= threshold);
            let [r, g, b] = [0, 1, 2].map(|channel| f64::from(pixel[channel]) / 255.0);
            (may_be_plant && config.is_plant(r, g, b)).then_some(x)
        }));
        if let (Some(low), Some(high)) =
            (columns.get(columns.len().saturating_sub(1) / 2), columns.get(columns.len() / 2))
        {
            stem.push(Pixel::new(crop.x as f64 + (low + high) as f64 / 2.0, y as f64));
        }
    }
    stem
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CROP: Region = Region { x: 2, y: 0, width: 16, height: 12 };

    /// A bright stem two pixels wide that leans right, before a dark wall.
    fn leaning() -> Image {
        let mut image = Image { width: 20, height: 12, rgb: vec![30; 720] };
        for y in 2..12 {
            let x = 14 - y;
            for column in [x, x + 1] {
                image.rgb[3 * (20 * y + column)..][..3].copy_from_slice(&[180, 220, 60]);
            }
        }
        image
    }

    #[test]
    fn each_row_gives_its_median_from_the_base_up() {
        let stem = row_medians(&leaning(), CROP, &StemConfig::default());
        assert_eq!(stem.len(), 10);
        assert_eq!((stem[0], stem[9]), (Pixel::new(3.5, 11.0), Pixel::new(12.5, 2.0)));
    }

    #[test]
    fn v_follows_its_definition() {
        let pixel = (0.8, 0.6, 0.1);
        let with = |value| StemConfig { value, ..StemConfig::default() }.is_plant(pixel.0, pixel.1, pixel.2);
        assert_eq!(
            [Brightness::Max, Brightness::Lightness, Brightness::Luma].map(with),
            [true, false, false]
        );
        let pale = |value| StemConfig { value, ..StemConfig::default() }.is_plant(1.0, 0.6, 0.55);
        assert_eq!([Brightness::Max, Brightness::Lightness, Brightness::Luma].map(pale), [true, true, false]);
        assert!(StemConfig { value: Brightness::Luma, ..StemConfig::default() }.is_plant(1.0, 0.74, 0.8));
    }

    proptest! {
        #[test]
        fn skipping_dark_pixels_changes_nothing(
            pixel in any::<[u8; 3]>(), gates in (0.0..1.0, 0.0..1.0, 0.0..1.0), value in 0..3_usize,
        ) {
            let config = StemConfig {
                excess: gates.0,
                green: gates.1,
                brightness: gates.2,
                value: [Brightness::Max, Brightness::Lightness, Brightness::Luma][value],
            };
            let image = Image { width: 1, height: 1, rgb: pixel.to_vec() };
            let found = !row_medians(&image, Region { x: 0, y: 0, width: 1, height: 1 }, &config).is_empty();
            let [r, g, b] = pixel.map(|level| f64::from(level) / 255.0);
            prop_assert_eq!(found, config.is_plant(r, g, b));
        }
    }
}
