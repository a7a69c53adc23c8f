//! Errors with which stems are measured, and the states that an observed plant may be in.
//!
//! A forecast begins at a plant that was observed with errors. So each simulated plant begins with a draw from the states around
//! the observed one that look like it.

use super::measured::{MeasuredPlant, tip_of};
use super::shape::{Angles, Modes, Place, SEGMENTS, Scores, Stem, tilts};
use crate::lamps::Layout;
use crate::math::statistics::{mean, standard_deviation};
use crate::random::StepNoise;
use crate::track::Sample;

/// Minutes to either side over which the length is averaged. Chosen: a plant does not shrink and grow again within an hour.
const LENGTH_SMOOTHING_MIN: f64 = 25.0;

/// Standard deviation of the length now as a share of that of one length: it is of two means of six, 1.42 and -0.42 of them.
const LENGTH_ERROR: f64 = 0.6;

/// Weights of a parabola through seven values at the middle one.
const PARABOLA: [f64; 7] =
    [-2.0 / 21.0, 3.0 / 21.0, 6.0 / 21.0, 7.0 / 21.0, 6.0 / 21.0, 3.0 / 21.0, -2.0 / 21.0];

/// Standard deviations of the errors with which stems are measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Errors {
    scores: Scores,
    length_cm: f64,
}

impl Errors {
    /// The errors in the stems of `plants`, along all axes alike.
    pub(super) fn of<const AXES: usize>(plants: &[MeasuredPlant<AXES>], modes: &Modes) -> Self {
        let of_mode = |mode: usize| {
            let along = |axis: usize| {
                plants.iter().map(move |plant| {
                    let scores = plant.scores(modes).into_iter();
                    scores.map(|scores| Some(scores?[axis][mode])).collect::<Vec<_>>()
                })
            };
            roughness((0..AXES).flat_map(along))
        };
        let length_cm = roughness(plants.iter().map(|plant| plant.lengths(modes)));
        Self { scores: core::array::from_fn(of_mode), length_cm }
    }
}

/// The standard deviation of the errors of values that change smoothly: of what a parabola through seven successive values leaves
/// of the middle one (Savitzky-Golay filter); 0 without seven successive ones.
///
/// # References
/// Savitzky and Golay 1964, doi:10.1021/ac60214a047 (the parabola takes on a third of the error of the middle value).
fn roughness(series: impl Iterator<Item = Vec<Option<f64>>>) -> f64 {
    let left = |window: &[Option<f64>]| {
        let values: Vec<f64> = window.iter().copied().collect::<Option<_>>()?;
        let smooth: f64 = values.iter().zip(PARABOLA).map(|(value, weight)| value * weight).sum();
        Some((values[3] - smooth).powi(2))
    };
    let squares: Vec<f64> =
        series.flat_map(|values| values.windows(7).filter_map(left).collect::<Vec<_>>()).collect();
    if squares.is_empty() { 0.0 } else { (mean(squares) / (1.0 - PARABOLA[3])).sqrt() }
}

/// Lengths at each step, averaged over an hour; `None` without a stem.
pub(super) fn smooth_lengths(lengths: &[Option<f64>], period_min: f64) -> Vec<Option<f64>> {
    let reach = (LENGTH_SMOOTHING_MIN / period_min).round() as usize;
    let around = |(step, length): (usize, &Option<f64>)| {
        length.as_ref()?;
        let around = &lengths[step.saturating_sub(reach)..(step + reach + 1).min(lengths.len())];
        Some(mean(around.iter().flatten().copied()))
    };
    lengths.iter().enumerate().map(around).collect()
}

/// A state that a plant may be in whose past was observed.
pub(super) struct Past<const AXES: usize> {
    pub(super) plant: MeasuredPlant<AXES>,
    /// The scores at each step; `None` without a stem.
    pub(super) scores: Vec<Option<[Scores; AXES]>>,
    /// What the principal components leave of the tilts: mainly the lowest ones, which hardly bend any more.
    pub(super) rest: [Angles; AXES],
    /// The last tip, held or not; in space `None` where its depth is not known.
    pub(super) tip: Option<Place<AXES>>,
    /// The length now, in cm; `None` where no stem was seen.
    length_cm: Option<f64>,
}

impl<const AXES: usize> Past<AXES> {
    /// Draws from what may have happened in the latest `most_steps` of `samples`, of which there is one at least.
    pub(super) fn draw(
        samples: &[Sample],
        most_steps: usize,
        (layout, period_min): (&Layout, f64),
        (modes, errors): (&Modes, &Errors),
        noise: &mut StepNoise,
    ) -> Self {
        let last = &samples[samples.len() - 1];
        let from = samples.partition_point(|sample| sample.step as usize + most_steps < last.step as usize);
        let plant = MeasuredPlant::<AXES>::of_samples(&samples[from..], layout, most_steps);
        let rests: Vec<[Angles; AXES]> =
            plant.stems.iter().flatten().map(|stem| modes.rest(tilts(stem))).collect();
        let rest = drawn_mean(&rests, noise);
        let mut scores = plant.scores(modes);
        for scores in scores.iter_mut().flatten().flatten() {
            for (score, error) in scores.iter_mut().zip(errors.scores) {
                *score += error * noise.normal();
            }
        }
        let error = LENGTH_ERROR * errors.length_cm * noise.normal();
        let length_cm = length_now(&plant.lengths(modes), period_min).map(|length_cm| length_cm + error);
        Self { plant, scores, rest, tip: tip_of(&last.observation()), length_cm }
    }

    /// The last stem, its scores and its length; `None` where no stem was seen last.
    pub(super) fn now(&self) -> Option<(&Stem<AXES>, [Scores; AXES], f64)> {
        Some((self.plant.stems.last()?.as_ref()?, (*self.scores.last()?)?, self.length_cm?))
    }
}

/// The mean of what the components leave of the tilts of a plant, drawn with its standard error; 0 of fewer than two.
fn drawn_mean<const AXES: usize>(rests: &[[Angles; AXES]], noise: &mut StepNoise) -> [Angles; AXES] {
    let mut drawn = [[0.0; SEGMENTS]; AXES];
    if rests.len() > 1 {
        for (axis, along) in drawn.iter_mut().enumerate() {
            for (segment, drawn) in along.iter_mut().enumerate() {
                let values: Vec<f64> = rests.iter().map(|rest| rest[axis][segment]).collect();
                let error = standard_deviation(&values) / (values.len() as f64).sqrt();
                *drawn = mean(values) + error * noise.normal();
            }
        }
    }
    drawn
}

/// The last of some lengths, in cm: the mean of the last half hour, and what the plant grew since its middle.
fn length_now(lengths: &[Option<f64>], period_min: f64) -> Option<f64> {
    let half = (LENGTH_SMOOTHING_MIN / period_min).round() as usize + 1;
    let mean_of = |window: &[Option<f64>]| {
        let known: Vec<f64> = window.iter().flatten().copied().collect();
        (!known.is_empty()).then(|| mean(known))
    };
    let (before, latest) = lengths.split_at(lengths.len().saturating_sub(half));
    let latest_mean = mean_of(latest)?;
    let before = &before[before.len().saturating_sub(half)..];
    let growth = mean_of(before).map_or(0.0, |before| (latest_mean - before) / half as f64);
    Some(latest_mean + 0.5 * (latest.len() - 1) as f64 * growth.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{NoiseStream, Purpose};

    #[test]
    fn errors_are_told_from_smooth_changes() {
        let noise = NoiseStream::new(1, Purpose::Trial, [0; 3]);
        let value =
            |step: u32| Some(3.0 * crate::math::sin(f64::from(step) / 12.0) + 0.2 * noise.normal(step));
        let found = roughness([(0..4000).map(value).collect(), vec![Some(1.0), None]].into_iter());
        assert!((found - 0.2).abs() < 0.01, "{found}");
        assert_eq!(roughness([vec![Some(1.0); 6]].into_iter()), 0.0);
    }
}
