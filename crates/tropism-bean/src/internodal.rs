//! Another physiology on the same stem: a memory that sums and subtracts, a clock of many speeds, and internodes that mature
//! one after the other.
//!
//! In: what each segment of the rod perceives. Out: its rate of bending, and where the stem is motile. The idea: a second
//! plant simulator, on which methods are judged that were made for the first one. Elongation, mechanics, leaves, pauses and
//! fluctuations are those of any shoot; how bending answers light, gravity and its own clock is not:
//!
//! - **Memory.** Light and gravity are one stimulus `s = nu light + beta gravity`. The response is its integral over a kernel
//!   with a positive and a negative lobe: two stages of a low-pass filter, minus a share of what a slow third stage still
//!   holds of the past. So the plant answers sums over minutes, and differences over hours.
//! - **Clock.** Differential growth rotates about the stem at a speed that drifts (an Ornstein-Uhlenbeck process of its
//!   logarithm). The growth stays and the speed does not, so slow turns are wide.
//! - **Motility.** Tissue belongs to an internode, of which the apex lays down one each plastochron. A young internode bends
//!   throughout, later only near its upper node, and at last not at all; its age decides, not the distance from the apex.
//!
//! # References
//! Riviere and Meroz 2023, doi:10.1073/pnas.2306655120: coleoptiles sum stimuli over short times and subtract them over longer
//! ones. Meroz, Bastien and Mahadevan 2019: tropisms as responses with a memory kernel. Enright and Cumbie 1973: two
//! internodes of *Phaseolus vulgaris* grow at a time, early throughout, later at successively higher levels.

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use tropism::check::{OutOfRange, ensure, within};
use tropism::math;
use tropism::random::{self, Purpose};

use super::species::{Spread, log_normal};

/// Parameters of the physiology: the table `typical.internodal` of a bean file. Where it stands, the table `motility`, both
/// times of memory and the balance number of `tropism` have no effect.
///
/// Confidence as in [`Individual`](super::Individual): A known, B order of magnitude, C guess.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Internodal {
    /// Time constant of each of the two stages that sum, in h (B: sums over some minutes).
    pub summing_h: f64,
    /// Time constant of the stage that is subtracted, in h (B: differences over tens of minutes).
    pub subtracting_h: f64,
    /// Share of that stage that is subtracted (C).
    pub subtracted: f64,
    /// Rate of autotropic straightening of motile tissue, per h (B: 0.17 to 0.75 in root and hypocotyl).
    pub straightening: f64,
    /// Standard deviation of the logarithm of the speed of nutation (B: periods vary widely, even within a plant).
    pub speed: f64,
    /// Correlation time of that speed, in h (C).
    pub speed_h: f64,
    /// Age at which the lowest internode was laid down, in h: before the start, so negative (tuned).
    pub first_h: f64,
    /// Time between two internodes, in h (B: days).
    pub plastochron_h: f64,
    /// Age of an internode at which it has lost half of its motility, in h (B: cells elongate for more than a week, two
    /// internodes at a time; tuned).
    pub mature_h: f64,
    /// Time over which it loses it, in h (C).
    pub maturing_h: f64,
    /// Length below the upper node over which a young internode is motile, in cm (B: the free zone of a climber).
    pub reach: f64,
    /// Width of the lower edge of the motile part, in cm (C).
    pub edge: f64,
}

impl Default for Internodal {
    fn default() -> Self {
        Self {
            summing_h: 0.15,
            subtracting_h: 0.8,
            subtracted: 0.5,
            straightening: 0.4,
            speed: 0.4,
            speed_h: 6.0,
            first_h: -16.0,
            plastochron_h: 26.0,
            mature_h: 76.0,
            maturing_h: 8.0,
            reach: 10.0,
            edge: 2.0,
        }
    }
}

impl Internodal {
    /// Checks that every value lies in its range.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first key that is not.
    pub(super) fn check(&self) -> Result<(), OutOfRange> {
        within("summing_h", self.summing_h, 0.005..=6.0)?;
        within("subtracting_h", self.subtracting_h, 0.005..=48.0)?;
        within("subtracted", self.subtracted, 0.0..=1.0)?;
        within("straightening", self.straightening, 0.0..=10.0)?;
        within("speed", self.speed, 0.0..=1.0)?;
        within("speed_h", self.speed_h, 0.1..=1e4)?;
        let first = self.first_h;
        ensure((-1e4..=0.0).contains(&first), "first_h", first, "an age of 0 h or before")?;
        for (key, value) in [
            ("plastochron_h", self.plastochron_h),
            ("mature_h", self.mature_h),
            ("maturing_h", self.maturing_h),
        ] {
            within(key, value, 0.1..=1e4)?;
        }
        within("reach", self.reach, 0.05..=60.0)?;
        within("edge", self.edge, 0.05..=60.0)
    }

    /// The parameters of the plant of `seed`, varied by `scale` times the spread of what stands for the same in the first
    /// physiology: memories, balance number, and length and times of the motile zone.
    pub(super) fn varied(&self, seed: u64, scale: f64, spread: &Spread) -> Self {
        let mut rng = random::stream(seed, Purpose::Individual, 1);
        let mut plant = self.clone();
        for (value, variation) in [
            (&mut plant.summing_h, spread.tropism_light_memory_h),
            (&mut plant.subtracting_h, spread.tropism_gravity_memory_h),
            (&mut plant.straightening, spread.tropism_balance),
            (&mut plant.plastochron_h, spread.motility_zone_h),
            (&mut plant.mature_h, spread.motility_mature_h),
            (&mut plant.maturing_h, spread.motility_maturing_h),
            (&mut plant.reach, spread.motility_zone),
        ] {
            *value *= log_normal(&mut rng, scale * variation);
        }
        plant
    }

    /// Age at which an internode was laid down, counted from the lowest one, in h.
    fn laid_h(&self, internode: u32) -> f64 {
        self.first_h + f64::from(internode) * self.plastochron_h
    }

    /// The internode that was laid down last.
    pub(super) fn youngest(&self, age_h: f64) -> u32 {
        ((age_h - self.first_h) / self.plastochron_h) as u32
    }

    /// Motility of an internode, as a share: `below_cm` under its upper node, when the plant is `age_h` old.
    pub(super) fn motility(&self, internode: u32, below_cm: f64, age_h: f64) -> f64 {
        let left_h = self.mature_h - (age_h - self.laid_h(internode));
        let young = math::logistic(left_h / self.maturing_h);
        young * math::logistic((self.reach * young - below_cm) / self.edge)
    }
}

/// The drifting speed of nutation.
#[derive(Clone, Debug)]
pub(super) struct Clock {
    rng: ChaCha8Rng,
    /// Logarithm of the speed over its median.
    log_speed: f64,
}

impl Clock {
    pub(super) fn new(of: &Internodal, seed: u64) -> Self {
        let mut rng = random::stream(seed, Purpose::Fluctuation, 1);
        let log_speed = of.speed * random::normal(&mut rng);
        Self { rng, log_speed }
    }

    /// The speed as a multiple of the plant's own; then the process advances by `tick_h` (exact discretisation).
    pub(super) fn speed(&mut self, of: &Internodal, tick_h: f64) -> f64 {
        let speed = math::exp(self.log_speed);
        let kept = math::exp(-tick_h / of.speed_h);
        let drawn = random::normal(&mut self.rng);
        self.log_speed = kept * self.log_speed + of.speed * (1.0 - kept * kept).sqrt() * drawn;
        speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn internodes_mature_one_after_the_other_and_from_below() {
        let of = Internodal::default();
        let motility = |internode, below_cm| of.motility(internode, below_cm, 60.0);
        assert!(motility(0, 1.0) < motility(1, 1.0) && motility(1, 1.0) < motility(2, 1.0));
        assert!(motility(1, 6.0) < motility(1, 1.0));
        assert!(of.motility(1, 6.0, 10.0) > 0.8 && of.motility(1, 6.0, 150.0) < 0.01);
    }

    #[test]
    fn nutation_runs_at_many_speeds() {
        let of = Internodal::default();
        let mut logs: Vec<f64> = (0..50)
            .flat_map(|seed| {
                let mut clock = Clock::new(&of, seed);
                (0..1000).map(move |_| math::ln(clock.speed(&Internodal::default(), 1.0 / 12.0)))
            })
            .collect();
        let sd = tropism::math::statistics::standard_deviation(&logs);
        assert!((sd / of.speed - 1.0).abs() < 0.1, "{sd}");
        logs.sort_by(f64::total_cmp);
        // Nine tenths of all turns: from the slowest to the fastest a factor of more than three.
        assert!(logs[logs.len() * 95 / 100] - logs[logs.len() * 5 / 100] > math::ln(3.0));
    }
}
