//! The pixels of an LED strip that form one lamp: their brightness and their current.

use serde::{Deserialize, Serialize};

/// A lamp made of pixels. The paper (section 2.1): 144 pixels for each lamp, 0.24 W each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Strip {
    /// Number of the lamp's first pixel; pixels before it may belong to other lamps.
    #[serde(default)]
    pub first: u16,
    /// Number of pixels.
    pub pixels: u16,
    /// Red, green and blue, 0 to 255.
    #[serde(default = "white")]
    pub color: [u8; 3],
    /// Duty cycle, linear in light and current: above 0, at most 1.
    #[serde(default = "half")]
    pub duty: f64,
    /// Current of one white pixel at full duty, in mA.
    #[serde(default = "sixty")]
    pub ma_per_pixel: f64,
    /// Current that supply, wires and fuse carry, in A.
    #[serde(default = "four_and_a_half")]
    pub max_amps: f64,
}

const fn white() -> [u8; 3] {
    [255; 3]
}

const fn half() -> f64 {
    0.5
}

const fn sixty() -> f64 {
    60.0
}

const fn four_and_a_half() -> f64 {
    4.5
}

/// The largest pixel number: chosen above what one controller drives.
const MAX_PIXELS: u16 = 8192;

impl Strip {
    /// The pixel after the lamp's last.
    #[must_use]
    pub const fn stop(&self) -> u16 {
        self.first.saturating_add(self.pixels)
    }

    pub(crate) const fn overlaps(&self, other: &Self) -> bool {
        self.first < other.stop() && other.first < self.stop()
    }

    /// Current of the lit lamp, in A: all pixels at their duty, each channel a third of white.
    #[must_use]
    pub fn amps(&self) -> f64 {
        let white = self.color.iter().map(|&channel| f64::from(channel) / 255.0).sum::<f64>() / 3.0;
        f64::from(self.pixels) * self.ma_per_pixel / 1000.0 * self.duty * white
    }

    /// Checks ranges, and that the current is at most `max_amps`.
    pub(crate) fn check(&self) -> Result<(), String> {
        let Self { pixels, duty, ma_per_pixel, max_amps, .. } = *self;
        if pixels == 0 || self.first.checked_add(pixels).is_none_or(|stop| stop > MAX_PIXELS) {
            return Err(format!(
                "found {pixels} pixels from {}, wanted 1 to {MAX_PIXELS} in all",
                self.first
            ));
        }
        if !(duty > 0.0 && duty <= 1.0) {
            return Err(format!("found strip.duty = {duty}, wanted above 0 and at most 1"));
        }
        if !(1.0..=1000.0).contains(&ma_per_pixel) {
            return Err(format!("found strip.ma_per_pixel = {ma_per_pixel}, wanted 1 to 1000 mA"));
        }
        if !(max_amps > 0.0 && max_amps <= 100.0) {
            return Err(format!("found strip.max_amps = {max_amps}, wanted above 0 and at most 100 A"));
        }
        let amps = self.amps();
        if amps > max_amps {
            return Err(format!(
                "found a strip that draws {amps:.2} A ({pixels} pixels of {ma_per_pixel} mA, duty {duty}, color \
                 {:?}), wanted at most max_amps = {max_amps}: lower duty, or raise max_amps if supply, wires and fuse \
                 carry it",
                self.color
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(text: &str) -> Strip {
        toml::from_str(text).unwrap()
    }

    #[test]
    fn the_papers_strip_at_full_light_needs_a_bigger_supply_than_by_default() {
        let paper = strip("pixels = 144\nduty = 1.0");
        assert!((paper.amps() - 8.64).abs() < 1e-9);
        let problem = paper.check().unwrap_err();
        assert!(problem.contains("8.64 A") && problem.contains("max_amps = 4.5"), "{problem}");
        strip("pixels = 144").check().unwrap();
        strip("pixels = 144\nduty = 1.0\nmax_amps = 10").check().unwrap();
        // Blue alone is a third.
        strip("pixels = 144\nduty = 1.0\ncolor = [0, 0, 255]").check().unwrap();
    }

    #[test]
    fn values_that_no_strip_has_are_named() {
        for (text, wanted) in [
            ("pixels = 0", "0 pixels"),
            ("first = 8100\npixels = 144", "from 8100"),
            ("first = 65535\npixels = 65535", "from 65535"),
            ("pixels = 1\nduty = 0", "duty = 0,"),
            ("pixels = 1\nduty = nan", "duty = NaN"),
            ("pixels = 1\nma_per_pixel = 0.06", "ma_per_pixel = 0.06"),
            ("pixels = 1\nmax_amps = -1", "max_amps = -1"),
        ] {
            let problem = strip(text).check().unwrap_err();
            assert!(problem.contains(wanted), "{problem}");
        }
    }
}
