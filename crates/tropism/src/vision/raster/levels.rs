//! How bright background and plant are.

use crate::vision::raster::plane::Plane;

/// How bright background and plant are in one crop, in grey values of 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    /// The median: a plant fills the smaller part of a crop.
    pub background: f32,
    /// One deviation of the background: as far below the median as a normal one has its 16 %, or as far above as it has
    /// its 70 % where black clips the darker side; at least half a grey value. A plant of up to 30 % of the crop does not
    /// disturb it.
    pub deviation: f32,
    /// The level that the brightest few pixels reach.
    pub bright: f32,
}

impl Levels {
    /// Reads the levels from a plane; `count` pixels reach `bright`.
    #[must_use]
    pub fn from_plane(plane: &Plane, count: usize) -> Self {
        const BINS_PER_GREY: f32 = 8.0;
        const BINS: usize = 256 * BINS_PER_GREY as usize;
        const LAST: f32 = (BINS - 1) as f32;
        // To the nearest bin: at this size a number's last bit is worth one.
        let bin =
            |value: f32| ((value * BINS_PER_GREY).clamp(0.0, LAST) + 8_388_608.0).to_bits() % BINS as u32;
        // Neighbours are alike: counted in one place, each would wait for the one before.
        let mut counts = vec![[0_u32; 4]; BINS];
        let (chunks, rest) = plane.values.as_chunks::<16>();
        for values in chunks {
            let bins = values.map(bin);
            bins.iter().enumerate().for_each(|(at, &bin)| counts[bin as usize][at % 4] += 1);
        }
        rest.iter().for_each(|&value| counts[bin(value) as usize][0] += 1);
        let histogram: Vec<usize> = counts.iter().map(|lanes| lanes.iter().sum::<u32>() as usize).collect();
        let last = BINS - 1;
        let quantile = |rank: usize| {
            let mut below = 0;
            let is_reached = |count: &usize| {
                below += count;
                below > rank
            };
            let bin = histogram.iter().position(is_reached).unwrap_or(last);
            bin as f32 / BINS_PER_GREY
        };
        let pixels = plane.values.len();
        let background = quantile(pixels / 2);
        let darker = background - quantile((pixels as f64 * 0.158_655) as usize);
        let brighter = (quantile(pixels * 7 / 10) - background) / 0.524_4;
        let deviation = darker.max(brighter).max(0.5);
        Self { background, deviation, bright: quantile(pixels.saturating_sub(count.max(1))) }
    }

    /// How many deviations of the background the brightest pixels stand above it.
    #[must_use]
    pub fn contrast(&self) -> f64 {
        f64::from((self.bright - self.background) / self.deviation)
    }

    /// The level `share` of the way from background to bright.
    #[must_use]
    pub fn threshold(&self, share: f64) -> f32 {
        self.background + share as f32 * (self.bright - self.background)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_tell_plant_from_background() {
        let mut values: Vec<f32> = (0..10_000).map(|i| 20.0 + (i % 11) as f32).collect();
        values[5_000..5_040].fill(200.0);
        let plane = Plane { width: 100, height: 100, values, origin: (0.0, 0.0), step: 1 };
        let levels = Levels::from_plane(&plane, 20);
        assert!((levels.background - 25.0).abs() < 0.2 && (levels.bright - 200.0).abs() < 0.2, "{levels:?}");
        assert!((levels.threshold(0.5) - 112.5).abs() < 0.2);
        assert!(levels.contrast() > 30.0 && Levels::from_plane(&plane, 50).contrast() < 3.0);
    }
}
