//! Grey levels of background and plant, read from a histogram.
//!
//! In: the samples of a plane. Out: the level and noise of the background, the level of the brightest samples, and thresholds
//! between them. The one idea: a plant is bright before dark cloth, so its threshold is read from each picture and
//! never fixed.

/// Levels of background and plant in one plane, in grey values of 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    /// Median of the plane. A plant covers the smaller part of a crop, so this is background.
    pub background: f32,
    /// Standard deviation of the background, at least half a grey value.
    ///
    /// The larger of two estimates for a normal distribution: median less 16 % quantile, and 70 % quantile less
    /// median over 0.5244, for pictures in which black clips the lower one. A plant of up to 30 % of the crop changes
    /// neither.
    pub deviation: f32,
    /// Level that the brightest samples reach.
    pub bright: f32,
}

/// Histogram bins for each grey value. Chosen: 8, so that a level is read to an eighth of a grey value.
const BINS_PER_GREY: f32 = 8.0;

/// Bins of the histogram.
const BINS: usize = 256 * BINS_PER_GREY as usize;

impl Levels {
    /// Reads the levels of samples; `count` of them reach `bright`.
    #[must_use]
    pub fn of(values: &[f32], count: usize) -> Self {
        let histogram = histogram(values);
        let quantile = |rank: usize| {
            let mut below = 0;
            let is_reached = |count: &usize| {
                below += count;
                below > rank
            };
            let bin = histogram.iter().position(is_reached).unwrap_or(BINS - 1);
            bin as f32 / BINS_PER_GREY
        };
        let samples = values.len();
        let background = quantile(samples / 2);
        // A normal distribution has 15.8655 % of its values below the mean less one deviation, and 70 % below the
        // mean plus 0.5244 deviations.
        let darker = background - quantile((samples as f64 * 0.158_655) as usize);
        let brighter = (quantile(samples * 7 / 10) - background) / 0.524_4;
        let deviation = darker.max(brighter).max(0.5);
        Self { background, deviation, bright: quantile(samples.saturating_sub(count.max(1))) }
    }

    /// Contrast of the brightest samples, in standard deviations of the background.
    #[must_use]
    pub fn contrast(&self) -> f64 {
        f64::from((self.bright - self.background) / self.deviation)
    }

    /// The level at `share` of the way from the background to the brightest samples.
    #[must_use]
    pub fn threshold(&self, share: f64) -> f32 {
        self.background + share as f32 * (self.bright - self.background)
    }
}

/// Counts samples by grey value, in [`BINS`] bins.
fn histogram(values: &[f32]) -> Vec<usize> {
    const LAST: f32 = (BINS - 1) as f32;
    // Adding 2^23 rounds to the nearest whole number: at this size a number's last bit is worth one.
    let bin = |value: f32| ((value * BINS_PER_GREY).clamp(0.0, LAST) + 8_388_608.0).to_bits() % BINS as u32;
    // Neighbouring samples are alike. Four counters for each bin keep one increment from waiting for the one before.
    let mut counts = vec![[0_u32; 4]; BINS];
    let (chunks, rest) = values.as_chunks::<16>();
    for values in chunks {
        let bins = values.map(bin);
        bins.iter().enumerate().for_each(|(at, &bin)| counts[bin as usize][at % 4] += 1);
    }
    rest.iter().for_each(|&value| counts[bin(value) as usize][0] += 1);
    counts.iter().map(|lanes| lanes.iter().sum::<u32>() as usize).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_tell_plant_from_background() {
        let mut values: Vec<f32> = (0..10_000).map(|i| 20.0 + (i % 11) as f32).collect();
        values[5_000..5_040].fill(200.0);
        let levels = Levels::of(&values, 20);
        assert!((levels.background - 25.0).abs() < 0.2 && (levels.bright - 200.0).abs() < 0.2, "{levels:?}");
        assert!((levels.threshold(0.5) - 112.5).abs() < 0.2);
        assert!(levels.contrast() > 30.0 && Levels::of(&values, 50).contrast() < 3.0);
    }
}
