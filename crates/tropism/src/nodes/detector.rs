//! Distinguishes the echo of a plant from the empty scene, daylight and noise.
//!
//! In: a node's reading and the mean reading of its siblings, the other nodes of its level. Out: how far the reading lies above
//! what the node is used to, in units of its threshold. The idea: daylight changes all sensors alike, so the difference to a
//! sibling is free of it. Mean and spread are learnt before the plant is there; the threshold is a multiple of the spread of
//! a whole day, never of the noise of the electronics.

use serde::{Deserialize, Serialize};

use crate::check::{self, OutOfRange};
use crate::math::exp;

/// Standard deviation over the mean absolute deviation of a normal distribution: the square root of pi / 2.
const SD_PER_MAD: f64 = 1.253_314_137_315_500_3;
/// Least spread of readings. Chosen: sensors with 8 bits do not resolve less.
const LEAST_SPREAD: f64 = 0.02;
/// Readings before the spread is learnt: the mean must be known. Chosen: an hour of five-minute steps.
const FIRST_READINGS: u32 = 12;

/// Settings of an [`EchoDetector`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct DetectorSettings {
    /// Threshold of the node's own reading, in standard deviations of its learning time: 1 to 20.
    pub threshold: f64,
    /// Threshold of the difference to the siblings, in standard deviations: 1 to 20.
    pub sibling_threshold: f64,
    /// Whether the siblings' readings are subtracted.
    pub siblings: bool,
    /// Time constant of the mean, in h: 0.1 to 1000.
    pub mean_h: f64,
    /// Time constant of the mean while something is near, in h: 0.1 to 10000. It is long, or a node would get used to a plant.
    pub mean_near_h: f64,
}

impl Default for DetectorSettings {
    /// Chosen by hand; docs/validation/nodes.md has what was measured with them.
    fn default() -> Self {
        Self { threshold: 4.0, sibling_threshold: 5.0, siblings: true, mean_h: 6.0, mean_near_h: 60.0 }
    }
}

impl DetectorSettings {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key.
    pub fn check(&self) -> Result<(), OutOfRange> {
        check::within("threshold", self.threshold, 1.0..=20.0)?;
        check::within("sibling_threshold", self.sibling_threshold, 1.0..=20.0)?;
        check::within("mean_h", self.mean_h, 0.1..=1000.0)?;
        check::within("mean_near_h", self.mean_near_h, 0.1..=10000.0)
    }
}

/// Readings whose spread must be known before anything is seen: a node that forgot everything learns so long again. Chosen: two
/// hours of five-minute steps.
const LEAST_READINGS: u32 = 24;

/// What is learnt of a stream of readings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Learned {
    /// Slow mean.
    pub mean: f64,
    /// Mean absolute deviation from the slow mean while learning.
    pub deviation: f64,
    /// Number of readings, and of those that count for the deviation.
    pub readings: [u32; 2],
}

impl Learned {
    /// The deviation of `reading` from the mean over `threshold` spreads; `None` before anything is learnt.
    fn strength(&self, reading: f64, threshold: f64) -> Option<f64> {
        (self.readings[1] >= LEAST_READINGS).then(|| (reading - self.mean) / (threshold * self.spread()))
    }

    /// Estimated standard deviation.
    fn spread(&self) -> f64 {
        (SD_PER_MAD * self.deviation).max(LEAST_SPREAD)
    }

    /// Learns a reading: the mean is the average at first, and then forgets with a time constant of `memory` readings.
    fn learn(&mut self, reading: f64, memory: f64, is_learning_time: bool) {
        let [count, counted] = &mut self.readings;
        if (is_learning_time || *counted < LEAST_READINGS) && *count >= FIRST_READINGS {
            *counted += 1;
            self.deviation += ((reading - self.mean).abs() - self.deviation) / f64::from(*counted);
        }
        *count = count.saturating_add(1);
        let share = (1.0 - exp(-1.0 / memory)).max(1.0 / f64::from(*count));
        self.mean += share * (reading - self.mean);
    }
}

/// All that an [`EchoDetector`] remembers: a node that restarts reads it from its own last message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DetectorMemory {
    /// Of the node's own reading.
    pub alone: Learned,
    /// Of the difference to the siblings.
    pub difference: Learned,
    /// Whether the latest reading was above its threshold.
    pub was_over: bool,
}

/// What a detector makes of a reading.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Echo {
    /// Deviation from what the node is used to, over its threshold: from 1 on something is near.
    pub strength: f64,
    /// Change of the strength since the latest reading.
    pub trend: f64,
    /// Whether something is near: two readings running are above the threshold.
    pub sees: bool,
}

/// Distinguishes a plant from everything else that changes a reading.
#[derive(Clone, Debug, Default)]
pub struct EchoDetector {
    settings: DetectorSettings,
    memory: DetectorMemory,
    strength: f64,
}

impl EchoDetector {
    /// A detector that has learnt nothing.
    #[must_use]
    pub fn new(settings: DetectorSettings) -> Self {
        Self { settings, ..Self::default() }
    }

    /// What the detector remembers.
    #[must_use]
    pub const fn memory(&self) -> DetectorMemory {
        self.memory
    }

    /// Forgets everything, or all but `memory`.
    pub fn restart(&mut self, memory: Option<DetectorMemory>) {
        self.memory = memory.unwrap_or_default();
        self.strength = 0.0;
    }

    /// Takes the next reading, and the mean reading of the siblings if they are heard. Without a reading nothing is seen.
    ///
    /// `is_learning_time`: no plant is there yet.
    pub fn take(
        &mut self,
        reading: Option<f64>,
        siblings: Option<f64>,
        period_h: f64,
        is_learning_time: bool,
    ) -> Echo {
        let Some(reading) = reading.filter(|reading| reading.is_finite()) else {
            self.memory.was_over = false;
            self.strength = 0.0;
            return Echo::default();
        };
        let DetectorSettings { threshold, sibling_threshold, siblings: uses_siblings, mean_h, mean_near_h } =
            self.settings;
        let difference = siblings.filter(|_| uses_siblings).map(|siblings| reading - siblings);
        let DetectorMemory { alone, difference: of_difference, was_over } = &mut self.memory;
        let strength = difference
            .and_then(|difference| of_difference.strength(difference, sibling_threshold))
            .or_else(|| alone.strength(reading, threshold))
            .unwrap_or(0.0);
        let is_over = strength >= 1.0;
        let memory = if is_over { mean_near_h } else { mean_h } / period_h;
        alone.learn(reading, memory, is_learning_time);
        if let Some(difference) = difference {
            of_difference.learn(difference, memory, is_learning_time);
        }
        let trend = strength - std::mem::replace(&mut self.strength, strength);
        Echo { strength, trend, sees: std::mem::replace(was_over, is_over) && is_over }
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::TAU;

    use super::*;
    use crate::math::sin;
    use crate::random::{NoiseStream, Purpose};

    /// Readings of an empty scene with noise 0.1 and a daily swing, of a node and its sibling.
    fn empty(step: u32, swing: f64) -> [f64; 2] {
        let mut noise = NoiseStream::new(1, Purpose::Nodes, [0; 3]).at(step);
        let day = swing * sin(TAU * f64::from(step) / 288.0);
        [0; 2].map(|_| day + 0.1 * noise.normal())
    }

    #[test]
    fn a_day_of_swing_is_no_plant_and_a_plant_is_seen_in_it() {
        for swing in [0.0, 0.1, 1.2] {
            let mut detector = EchoDetector::new(DetectorSettings::default());
            let mut take = |step: u32, echo: f64| {
                let [reading, sibling] = empty(step, swing);
                detector.take(Some(reading + echo), Some(sibling), 1.0 / 12.0, step < 288)
            };
            assert!((0..2880).all(|step| !take(step, 0.0).sees), "swing {swing}");
            assert!(!take(2880, 1.5).sees, "one reading is not enough");
            assert!(take(2881, 1.5).sees && take(2882, 1.5).sees);
            assert!(!take(2883, 0.0).sees);
        }
    }

    #[test]
    fn a_restarted_node_goes_on_with_what_it_wrote_down() {
        let mut first = EchoDetector::new(DetectorSettings::default());
        let step = |detector: &mut EchoDetector, step: u32| {
            let [reading, sibling] = empty(step, 0.1);
            detector.take(Some(reading), Some(sibling), 1.0 / 12.0, step < 288)
        };
        (0..400).for_each(|number| {
            step(&mut first, number);
        });
        let mut second = EchoDetector::new(DetectorSettings::default());
        second.restart(Some(first.memory()));
        let [one, other] = [&mut first, &mut second].map(|detector| step(detector, 400));
        assert_eq!((one.strength, one.sees), (other.strength, other.sees));
    }

    #[test]
    fn a_silent_sensor_and_a_silent_sibling_are_no_plant() {
        let mut detector = EchoDetector::new(DetectorSettings::default());
        for step in 0..1000 {
            let [reading, sibling] = empty(step, 0.1);
            let (reading, sibling) =
                (Some(reading).filter(|_| step % 7 > 0), Some(sibling).filter(|_| step % 5 > 0));
            assert!(!detector.take(reading, sibling, 1.0 / 12.0, step < 288).sees, "{step}");
        }
        assert_eq!(detector.take(Some(f64::NAN), None, 1.0 / 12.0, false), Echo::default());
    }
}
