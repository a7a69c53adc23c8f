//! Estimates the parameters of a plant from its open-loop track.
//!
//! In: a track, and a species to start from. Out: estimates of five parameters with intervals. The idea: growth, sensitivity
//! to light, motile zone and memory of light are those with which a noise-free plant under the same lamps comes closest to the
//! track (CMA-ES), unless they are too far from those of the species: how plants of a species differ is
//! known before, and a track of a few days says little about some of it. Nutation's period is read off the spectrum of what
//! that plant leaves over, with the same caution. Where the track is silent, an estimate is the species' own value and
//! its interval the species' spread.
//!
//! # References
//! Spectrum as a likelihood: Bretthorst 1988,
//! doi:10.1007/978-1-4684-9399-3.

use core::f64::consts::TAU;

use tropism::CmaEs;
use tropism::geometry::Point;
use tropism::lamps::Light;
use tropism::math::{self, matrix};
use tropism::observation::Quality;
use tropism::track::Track;

use super::{Bean, Fluctuation, Individual, Species};
use crate::detector;

/// Estimated parameters: the key of the bean file, the letter of the literature, the unit.
pub const PARAMETERS: [(&str, &str, &str); 5] = [
    ("growth.rate", "G", "cm per 5 min"),
    ("tropism.light", "nu", "rad/cm/h"),
    ("motility.zone", "La", "cm"),
    ("tropism.light_memory_h", "tau_p", "h"),
    ("nutation.period_h", "Tcn", "h"),
];

/// Those that are fitted: all but nutation's period.
const FITTED: usize = 4;
/// Those that move the tip and differ between plants: the fitted ones, and the age at which growth slows, which is left at
/// the species' own but is easily mistaken for how fast the plant grows.
const MOVING: usize = FITTED + 1;
/// A track must have so many measured steps. Chosen by hand: some four hours.
const FEWEST: usize = 50;
/// First standard deviation of the search, as a logarithm. Chosen: about that of plants of a species. And the most that a
/// parameter may move. Chosen by hand: a factor of five.
const INITIAL_SD: f64 = 0.2;
const MAX_LOG_CHANGE: f64 = 1.6;
/// Plants that the search grows at once: 4 + 3 ln(4), the default of Hansen's tutorial.
const POPULATION: usize = 8;
/// The search ends after so many generations, or at this standard deviation. Chosen by hand: far below any interval of an
/// estimate.
const GENERATIONS: u32 = 40;
const CONVERGED_SD: f64 = 0.004;
/// Time between two looks at a plant that grows to its first measured length in the dark, in min. Chosen by hand: it
/// grows 0.03 cm.
const WAITING_MIN: f64 = 5.0;
/// Chance goes its own way for hours, so that a reading every five minutes is no news: a track counts as one reading in so
/// many hours. Chosen so that intervals hold the truth as often as they say.
const DECORRELATION_H: f64 = 4.0;
/// Step of a numerical derivative, as a logarithm. Chosen by hand.
const NUDGE: f64 = 0.05;
/// 90 % of a normal distribution lie within so many standard deviations.
const NINETY: f64 = 1.645;
/// Periods of nutation that are looked at, in standard deviations of the species to either side, and their number. Chosen
/// by hand.
const PERIODS: f64 = 3.5;
const BANDS: usize = 64;
/// Nutation keeps no strict time, which spreads its line over so much of the logarithm of the period. Chosen by hand.
const LINE: f64 = 0.05;

/// An estimate with its 90 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The value, in the unit of [`PARAMETERS`].
    pub value: f64,
    /// Least and greatest value of the interval.
    pub interval: [f64; 2],
    /// Share of the estimate that is the species' own, 0 to 1: variance of the logarithm after the track, as a share of that
    /// before. Near 1 the track says nothing about the parameter.
    pub prior_share: f64,
}

/// Estimated parameters of one plant.
#[derive(Clone, Debug, PartialEq)]
pub struct BeanCalibration {
    /// In the order of [`PARAMETERS`].
    pub estimates: [Estimate; 5],
    /// Root-mean-square distance between the tip of the best noise-free plant and the track, in cm.
    pub rms_cm: f64,
}

/// Why a track cannot be calibrated.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// Too few steps.
    #[error("found {0} measured steps under a lamp, wanted at least {FEWEST}")]
    Short(usize),
    /// Only one lamp was ever lit: what bends the plant cannot be distinguished from its growing crooked.
    #[error("one lamp was lit all the time: light both in turn")]
    OneLamp,
    /// No upright plant at the start.
    #[error("the first tip is below the soil")]
    Below,
}

/// A track as the fit needs it.
struct Fit<'t> {
    track: &'t Track,
    period_min: f64,
    /// Length and lean of the plant at the start, in cm and rad.
    start: (f64, f64),
    species: &'t Species,
    /// Standard deviations of the moving parameters' logarithms over plants of the species.
    spread: [f64; MOVING],
}

/// Estimates the parameters of the plant of `track`, whose rows are `period_min` minutes apart. What is not estimated is the
/// species' own. `None` if `may_go_on`, which is asked for each plant that is tried, said no.
///
/// # Errors
/// [`CalibrateError`].
pub fn calibrate(
    track: &Track,
    period_min: f64,
    species: &Species,
    may_go_on: &dyn Fn() -> bool,
) -> Result<Option<BeanCalibration>, CalibrateError> {
    let fit = Fit::new(track, period_min, species)?;
    let Some(best) = fit.fit(may_go_on) else { return Ok(None) };
    let quiet = fit.tips(&best);
    let rms_cm = fit.distance(&quiet).sqrt();
    let slopes: [Vec<f64>; MOVING] = core::array::from_fn(|parameter| {
        let mut nudged = best;
        nudged[parameter] += NUDGE;
        fit.apart(&fit.tips(&nudged), &quiet).into_iter().map(|apart| apart / NUDGE).collect()
    });
    let squares = rms_cm * rms_cm * slopes[0].len() as f64 / 2.0;
    let precision: [[f64; MOVING]; MOVING] = core::array::from_fn(|row| {
        core::array::from_fn(|column| {
            let both: f64 = slopes[row].iter().zip(&slopes[column]).map(|(a, b)| a * b).sum();
            let before = if row == column { fit.spread[row].powi(-2) } else { 0.0 };
            fit.news() / squares * both + before
        })
    });
    let inverse = matrix::inverse_positive_definite(precision);
    let mut variances: [f64; MOVING] = core::array::from_fn(|at| inverse[at][at]);
    variances[0] += fit.growth_noise_variance(&best);
    let sd = variances.map(f64::sqrt);
    let plant = fit.plant(&best);
    let fitted = [plant.growth.rate, plant.tropism.light, plant.motility.zone, plant.tropism.light_memory_h];
    let residual: Vec<f64> =
        track.samples.iter().zip(&quiet).map(|(sample, tip)| sample.tip.x - tip.x).collect();
    let nutation = (species.typical.nutation.period_h, logarithmic(species.spread.nutation_period_h));
    let period = spectral(&residual, period_min / 60.0, nutation);
    Ok(Some(BeanCalibration {
        estimates: core::array::from_fn(|parameter| match parameter {
            FITTED => Estimate::new(period.0, period.1, nutation.1),
            fitted_one => Estimate::new(fitted[fitted_one], sd[fitted_one], fit.spread[fitted_one]),
        }),
        rms_cm,
    }))
}

impl Estimate {
    /// A value whose logarithm has the standard deviation `sd`, and had `before` over plants of the species.
    fn new(value: f64, sd: f64, before: f64) -> Self {
        Self {
            value,
            interval: [-NINETY, NINETY].map(|deviations| value * math::exp(deviations * sd)),
            prior_share: (sd / before).powi(2).min(1.0),
        }
    }
}

/// The standard deviation of the logarithm that belongs to a coefficient of variation; a species without variation leaves a
/// little room.
fn logarithmic(variation: f64) -> f64 {
    math::ln(1.0 + variation * variation).sqrt().max(0.02)
}

impl<'t> Fit<'t> {
    fn new(track: &'t Track, period_min: f64, species: &'t Species) -> Result<Self, CalibrateError> {
        let is_measured = |sample: &&tropism::track::Sample| sample.quality != Quality::CarriedForward;
        let measured = track.samples.iter().filter(is_measured).filter(|sample| !sample.is_dark()).count();
        if measured < FEWEST {
            return Err(CalibrateError::Short(measured));
        }
        let is_lit = |light: &Light| track.samples.iter().any(|sample| sample.light == Some(*light));
        if track.layout.lights().filter(is_lit).count() < 2 {
            return Err(CalibrateError::OneLamp);
        }
        let tip = track.samples[0].tip;
        if tip.y <= 0.5 {
            return Err(CalibrateError::Below);
        }
        let start = (math::hypot(tip.x, tip.y), math::atan2(tip.x, tip.y));
        let spread = &species.spread;
        let spread = [
            spread.growth_rate,
            spread.tropism_light,
            spread.motility_zone,
            spread.tropism_light_memory_h,
            spread.growth_slows_h,
        ];
        Ok(Self { track, period_min, start, species, spread: spread.map(logarithmic) })
    }

    /// Readings that the track counts for.
    fn news(&self) -> f64 {
        self.track.samples.len() as f64 * self.period_min / 60.0 / DECORRELATION_H
    }

    /// The species' average plant with the moving parameters at `log_factors`, logarithms of their change.
    fn plant(&self, log_factors: &[f64; MOVING]) -> Individual {
        let mut plant = self.species.average();
        let [rate, light, zone, memory, slows] =
            log_factors.map(|log_factors| math::exp(log_factors.clamp(-MAX_LOG_CHANGE, MAX_LOG_CHANGE)));
        plant.growth.rate *= rate;
        plant.tropism.light *= light;
        plant.motility.zone *= zone;
        plant.tropism.light_memory_h *= memory;
        plant.growth.slows_h *= slows;
        plant
    }

    /// Tip of a noise-free plant at each sample. Its leaves unfold at the typical age. It does not circumnutate, because the
    /// phase is unknown.
    fn tips(&self, log_factors: &[f64; MOVING]) -> Vec<Point> {
        self.live(log_factors, |bean| detector::highest_point(&bean.pose()))
    }

    /// What `look` sees of that plant at each sample.
    fn live<T>(&self, log_factors: &[f64; MOVING], look: impl Fn(&Bean) -> T) -> Vec<T> {
        let mut plant = self.plant(log_factors);
        let (length, lean) = self.start;
        plant.growth.start = plant.growth.start.min(length);
        plant.nutation.curvature = 0.0;
        plant.pauses.episodes_per_h = 0.0;
        plant.fluctuation =
            Fluctuation { motility: 0.0, growth: 0.0, curvature: 0.0, phase: 0.0, ..plant.fluctuation };
        let mut bean = Bean::new(plant, 0).under(&self.track.layout);
        // A plant that was taller when the track began is older.
        while bean.length() < length && bean.age_h() < 1000.0 {
            bean.advance(&[], WAITING_MIN);
        }
        bean.tip_over(lean);
        let samples = &self.track.samples;
        let mut seen = Vec::with_capacity(samples.len());
        for (index, sample) in samples.iter().enumerate() {
            seen.push(look(&bean));
            let steps = samples.get(index + 1).map_or(0, |next| next.step - sample.step);
            let lit = sample.lighting().within(&self.track.layout);
            bean.advance(&lit.powers(), f64::from(steps) * self.period_min);
        }
        seen
    }

    /// Variance of the logarithm of mean growth over the track from growth noise, which leaves no trace in the residuals.
    ///
    /// That of the mean of a log-normal Ornstein-Uhlenbeck process over the time in which the plant grew, counted as Kish
    /// counts unequal weights.
    fn growth_noise_variance(&self, log_factors: &[f64; MOVING]) -> f64 {
        let Fluctuation { growth, growth_h, .. } = self.species.typical.fluctuation;
        let lengths = self.live(log_factors, Bean::length);
        let steps: Vec<f64> = lengths.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let squares: f64 = steps.iter().map(|step| step * step).sum();
        let whole: f64 = steps.iter().sum();
        let hours = self.period_min / 60.0 * whole * whole / squares.max(f64::MIN_POSITIVE);
        let square = growth * growth;
        (2.0 * growth_h * (square + square * square / 4.0) / hours.max(growth_h)).min(square)
    }

    /// x and y of `tips` less those of `others`, at the measured samples.
    fn apart(&self, tips: &[Point], others: &[Point]) -> Vec<f64> {
        let pairs = self.track.samples.iter().zip(tips.iter().zip(others));
        let measured = pairs.filter(|(sample, _)| sample.quality != Quality::CarriedForward);
        measured.flat_map(|(_, (tip, other))| [tip.x - other.x, tip.y - other.y]).collect()
    }

    /// Mean squared distance of `tips` from the track, in cm^2.
    fn distance(&self, tips: &[Point]) -> f64 {
        let track: Vec<Point> = self.track.samples.iter().map(|sample| sample.tip).collect();
        let apart = self.apart(tips, &track);
        2.0 * apart.iter().map(|apart| apart * apart).sum::<f64>() / apart.len() as f64
    }

    /// The fitted parameters, as logarithms of their change from the species' own; `None` if interrupted.
    fn fit(&self, may_go_on: &dyn Fn() -> bool) -> Option<[f64; MOVING]> {
        let all = |fitted: &[f64]| -> [f64; MOVING] {
            core::array::from_fn(|parameter| fitted.get(parameter).copied().unwrap_or(0.0))
        };
        let mut search = CmaEs::new(&[0.0; FITTED], INITIAL_SD, POPULATION, 0);
        for _ in 0..GENERATIONS {
            let points = search.ask();
            let cost = |point: &Vec<f64>| may_go_on().then(|| self.negative_log_posterior(&all(point)));
            let costs: Vec<f64> = points.iter().map(cost).collect::<Option<_>>()?;
            search.tell(&points, &costs);
            if search.sd() < CONVERGED_SD {
                break;
            }
        }
        Some(all(search.mean()).map(|log_factors| log_factors.clamp(-MAX_LOG_CHANGE, MAX_LOG_CHANGE)))
    }

    /// Twice the negative logarithm of how likely the moving parameters are, after the track, but for a constant.
    fn negative_log_posterior(&self, log_factors: &[f64; MOVING]) -> f64 {
        let unlikely: f64 = log_factors
            .iter()
            .zip(self.spread)
            .map(|(log_factors, spread)| (log_factors / spread).powi(2))
            .sum();
        self.news() * math::ln(self.distance(&self.tips(log_factors))) + unlikely
    }
}

/// The period of the oscillation in `values`, `interval` h apart, and the standard deviation of its logarithm, where `before`
/// are the period that a species has and the same.
///
/// The power of the changes at a period, over its mean, is the logarithm of how likely an oscillation of that period is.
fn spectral(values: &[f64], interval: f64, before: (f64, f64)) -> (f64, f64) {
    let changes: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let count = changes.len() as f64;
    let (typical, spread) = before;
    let log_factors = |band: usize| PERIODS * spread * (2.0 * band as f64 / (BANDS as f64 - 1.0) - 1.0);
    let power: Vec<f64> = (0..BANDS)
        .map(|band| {
            let turn = TAU * interval / (typical * math::exp(log_factors(band)));
            let (mut even, mut odd) = (0.0, 0.0);
            for (index, change) in changes.iter().enumerate() {
                let window = 0.5 - 0.5 * math::cos(TAU * (index as f64 + 0.5) / count);
                even += window * change * math::cos(turn * index as f64);
                odd += window * change * math::sin(turn * index as f64);
            }
            even * even + odd * odd
        })
        .collect();
    let mean = math::statistics::mean(power.iter().copied());
    let smooth = |at: usize| {
        let weight = |band: usize| math::exp(-0.5 * ((log_factors(band) - log_factors(at)) / LINE).powi(2));
        let weights: f64 = (0..BANDS).map(weight).sum();
        (0..BANDS).map(|band| weight(band) * power[band]).sum::<f64>() / weights / mean
    };
    let likely: Vec<f64> =
        (0..BANDS).map(|band| math::exp(smooth(band) - 0.5 * (log_factors(band) / spread).powi(2))).collect();
    let whole: f64 = likely.iter().sum();
    let expected = |value: &dyn Fn(f64) -> f64| {
        (0..BANDS).map(|band| likely[band] * value(log_factors(band))).sum::<f64>() / whole
    };
    let centre = expected(&|log_factors| log_factors);
    (typical * math::exp(centre), expected(&|log_factors| (log_factors - centre).powi(2)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_swing_has_its_period_and_silence_that_of_the_species() {
        let swing = |period: f64, size: f64| -> Vec<f64> {
            let turn = |step: i32| TAU * f64::from(step) / 12.0 / period;
            (0..1000)
                .map(|step| size * math::sin(turn(step)) + 0.3 * math::sin(1e4 * math::sin(f64::from(step))))
                .collect()
        };
        for period in [1.4, 1.65, 2.0] {
            let (found, sd) = spectral(&swing(period, 3.0), 1.0 / 12.0, (1.6667, 0.2));
            assert!((math::ln(found / period)).abs() < 0.1 && sd < 0.15, "{found} ({sd}) for {period}");
        }
        let (found, sd) = spectral(&swing(1.0, 0.0), 1.0 / 12.0, (1.6667, 0.1));
        assert!((found / 1.6667 - 1.0).abs() < 0.1 && (0.05..0.15).contains(&sd), "{found} ({sd})");
    }
}
