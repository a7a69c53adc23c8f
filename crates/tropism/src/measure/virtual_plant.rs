//! Virtual plants with the constants of a measured one: what the same experiment recovers of them.
//!
//! In: the fit of a plant. Out: records of virtual plants at the same frames, with a forcing and noise of the fitted size, drawn
//! anew from a seed. Measured again, they show how far the estimates of this very experiment can be relied on. They obey the
//! model of the fit: what the model lacks, they lack too.

use super::fit::Fit;
use super::record::StemRecord;
use super::rod::{BASE, FREE_POINTS, Rod};
use super::{Measurement, Options, Status, measure, stem_of};
use crate::geometry::Point;
use crate::math::statistics::quantile_linear;
use crate::random::{self, Purpose};

/// A virtual plant with fitted constants.
#[derive(Clone, Debug)]
pub struct VirtualPlant {
    fit: Fit,
}

/// What the same experiment recovers of a constant.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Recovery {
    /// Symbol.
    pub symbol: String,
    /// Virtual plants of which it was measured.
    pub measured: usize,
    /// Virtual plants.
    pub plants: usize,
    /// Median of recovered over true values; NaN without any.
    pub ratio: f64,
    /// Half the range of the middle two thirds of recovered over true values.
    pub spread: f64,
    /// Share of the 90 % intervals that hold the true value.
    pub coverage: f64,
    /// Factor by which the intervals of logarithms must be wider to hold it in 90 %; at least 1, and 1 for fewer than ten plants.
    pub widening: f64,
}

impl VirtualPlant {
    pub(super) fn of(fit: Fit) -> Self {
        Self { fit }
    }

    /// A record of a virtual plant at the frames of `record`: forcing and noise are drawn from `seed`.
    #[must_use]
    pub fn record(&self, record: &StemRecord, seed: u64) -> StemRecord {
        self.grown(record, self.fit.rod.clone(), self.fit.unknowns[BASE], seed)
    }

    /// A record of the virtual plant in another experiment.
    #[must_use]
    pub fn record_of(&self, record: &StemRecord, change: Change, seed: u64) -> StemRecord {
        let mut record = record.clone();
        let mut base = self.fit.unknowns[BASE];
        match change {
            Change::Tilt => base = core::f64::consts::FRAC_PI_2.copysign(base),
            Change::Longer => {
                let frames = record.times_h.len();
                let every = record.duration_h() / (frames - 1) as f64;
                for more in 1..=frames / 2 {
                    let time = record.times_h[frames - 1] + more as f64 * every;
                    record.times_h.push(time);
                    record.length_cm.push(record.growth.at(time).max(0.1));
                    record.lamps.push(0.0);
                }
            }
            Change::Frames => {
                let between = |values: &[f64]| -> Vec<f64> {
                    let pairs = values.windows(2).flat_map(|pair| [pair[0], 0.5 * (pair[0] + pair[1])]);
                    pairs.chain(values.last().copied()).collect()
                };
                record.times_h = between(&record.times_h);
                record.length_cm = between(&record.length_cm);
                record.lamps =
                    record.lamps.iter().flat_map(|lamp| [*lamp, *lamp]).take(record.times_h.len()).collect();
            }
        }
        let rod = Rod::new(&record, self.fit.rod.law, self.fit.rod.is_lit, super::fit::knots(&record));
        self.grown(&record, rod, base, seed)
    }

    fn grown(&self, record: &StemRecord, rod: Rod, base: f64, seed: u64) -> StemRecord {
        let forcing = &self.fit.forcing;
        let mut draws = random::stream(seed, Purpose::SelfCheck, 0);
        let mut normal = || random::normal(&mut draws);
        let mut unknowns = self.fit.unknowns[..rod.rod_unknowns()].to_vec();
        unknowns[BASE] = base;
        let knots: Vec<f64> = (0..rod.knots).map(|_| normal()).collect();
        unknowns.extend(forcing.draw(rod.knot_h, &knots).unwrap_or(vec![0.0; knots.len()]));
        let places = rod.fine_places(&unknowns);
        let noise = forcing.noise_cm();
        let noisy = |mut stem: [Point; FREE_POINTS + 1]| {
            for point in &mut stem[1..] {
                *point = Point::new(point.x + noise * normal(), point.y + noise * normal());
            }
            stem
        };
        let stems = places.chunks_exact(2 * FREE_POINTS).map(stem_of).map(noisy).collect();
        StemRecord { stems, ..record.clone() }
    }

    /// The true value of a constant of the virtual plant.
    fn truth(&self, measured: &Measurement, symbol: &str) -> f64 {
        measured.estimate(symbol).map_or(f64::NAN, |estimate| estimate.value)
    }
}

/// A change of an experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Change {
    /// The pot tipped by 90 degrees.
    Tilt,
    /// Half as long again.
    Longer,
    /// Twice as many frames in the same time.
    Frames,
}

impl Change {
    /// All changes that are tried.
    pub const ALL: [Self; 3] = [Self::Tilt, Self::Longer, Self::Frames];

    /// What is changed.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Tilt => "pots tipped by 90 degrees",
            Self::Longer => "half as long again",
            Self::Frames => "twice as many frames in the same time",
        }
    }
}

/// What a change of the experiment would do to the intervals of a constant.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Sharpening {
    /// The change.
    pub change: Change,
    /// Symbol.
    pub symbol: String,
    /// Median width of the interval of the logarithm, as a multiple of that of the present experiment.
    pub width: f64,
}

/// Virtual plants of each experiment that is tried. Chosen: the median of six widths errs by some 10 %.
const TRIED_PLANTS: usize = 6;
/// Symbols that a change is judged by.
const SHARPENED: [&str; 3] = ["Lc", "beta", "gamma"];

/// What would sharpen the constants of measured plants: virtual ones of them in changed experiments.
#[must_use]
pub fn sharpenings(measured: &[(StemRecord, Options, Measurement)], seed: u64) -> Vec<Sharpening> {
    if measured.is_empty() {
        return Vec::new();
    }
    let count = 1 + Change::ALL.len();
    let again = crate::parallel::map(count * TRIED_PLANTS, |number| {
        let (record, options, measurement) = &measured[number % TRIED_PLANTS % measured.len()];
        let seed = random::derive(seed, Purpose::SelfCheck, (1 << 32) + (number % TRIED_PLANTS) as u64);
        let record = match (number / TRIED_PLANTS).checked_sub(1) {
            None => measurement.plant.record(record, seed),
            Some(change) => measurement.plant.record_of(record, Change::ALL[change], seed),
        };
        measure(&record, options)
    });
    let width = |experiment: usize, symbol: &str| {
        let of_plant = |found: &Measurement| found.estimate(symbol).map_or(f64::NAN, super::Estimate::half);
        let widths: Vec<f64> =
            again[experiment * TRIED_PLANTS..][..TRIED_PLANTS].iter().map(of_plant).collect();
        crate::math::statistics::median(&widths)
    };
    let of_change = |(number, change)| {
        SHARPENED.map(|symbol: &str| {
            let width = width(number, symbol) / width(0, symbol);
            Sharpening { change, symbol: symbol.to_owned(), width }
        })
    };
    (1..).zip(Change::ALL).flat_map(of_change).collect()
}

/// Least number of virtual plants by which intervals are widened. Chosen: the 90 % quantile of fewer is the greatest.
const MIN_WIDENING: usize = 10;

/// Symbols that the check looks at.
const CHECKED: [&str; 6] = ["Lgz", "W", "Lc", "B", "beta", "gamma"];

/// Measures virtual plants in the experiments of measured ones, each in turn: `plants` of them in all.
///
/// Docs: `docs/explanation/measure.md`.
#[must_use]
pub fn self_check(
    measured: &[(StemRecord, Options, Measurement)],
    plants: usize,
    seed: u64,
) -> Vec<Recovery> {
    let original = |number: usize| &measured[number % measured.len()];
    let again = crate::parallel::map(if measured.is_empty() { 0 } else { plants }, |number| {
        let (record, options, measurement) = original(number);
        let seed = random::derive(seed, Purpose::SelfCheck, number as u64);
        measure(&measurement.plant.record(record, seed), options)
    });
    let recovery = |symbol: &str| {
        let (mut ratios, mut holds, mut widenings) = (Vec::new(), 0, Vec::new());
        for (number, again) in again.iter().enumerate() {
            let (.., measurement) = original(number);
            let truth = measurement.plant.truth(measurement, symbol);
            let Some(found) = again.estimate(symbol).filter(|found| found.status == Status::Measured) else {
                continue;
            };
            ratios.push(found.value / truth);
            widenings.push(crate::math::ln(found.value / truth).abs() / found.half());
            holds += usize::from((found.interval[0]..=found.interval[1]).contains(&truth));
        }
        let quantile = |share| quantile_linear(&ratios, share);
        Recovery {
            symbol: symbol.to_owned(),
            measured: ratios.len(),
            plants: again.len(),
            ratio: quantile(0.5),
            spread: 0.5 * (quantile(5.0 / 6.0) - quantile(1.0 / 6.0)),
            coverage: holds as f64 / ratios.len() as f64,
            widening: if widenings.len() < MIN_WIDENING {
                1.0
            } else {
                quantile_linear(&widenings, 0.9).max(1.0)
            },
        }
    };
    CHECKED.map(recovery).to_vec()
}
