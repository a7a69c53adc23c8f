//! The forecasts of one model for one plant, judged.

use serde::{Deserialize, Serialize};
use tropism::geometry::space::SpacePoint;
use tropism::math::statistics::mean;
use tropism::math::vector::distance;
use tropism::observation::Observation;
use tropism::plant::PlantModel;
use tropism::random::{NoiseStream, Purpose};

use super::left_out::{LeftOut, Points, State, View, steps_of};

/// Simulated plants of each forecast. Of 59 draws, 54 of 60 further ones lie between the third from below and the third from
/// above: 90 %.
const MEMBERS: u32 = 59;

/// The place of the ends of the 90 % interval among the sorted members, from either end.
const END: usize = 2;

/// Why a plant is known at a start and after it.
const AT_STARTS: &str = "starts are known, and followed by what is known";

/// How much forecasts miss at one horizon: means over the starts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Miss {
    /// Distance from the mean of the members to the truth, in cm.
    pub(super) distance_cm: f64,
    /// Share of true coordinates within the 90 % interval of the members; `None` without members.
    pub(super) within_90: Option<f64>,
}

/// The forecasts of one model for one plant: misses at each horizon.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PlantScore {
    pub(super) tip: Vec<Miss>,
    /// `None` where the model or the plant has no stem.
    pub(super) stem: Option<Vec<Miss>>,
}

/// The miss of the tip or of the stem, of both.
type OneMiss<'f> = &'f dyn Fn(&(Miss, Option<Miss>)) -> Option<Miss>;

impl PlantScore {
    /// The means over starts of misses at each horizon, of the tip and of the stem.
    fn mean(starts: &[Vec<(Miss, Option<Miss>)>], horizons: usize) -> Self {
        let means = |of: OneMiss<'_>| -> Option<Vec<Miss>> {
            let at = |horizon: usize| {
                let misses: Vec<Miss> =
                    starts.iter().map(|start| of(&start[horizon])).collect::<Option<_>>()?;
                let within: Option<Vec<f64>> = misses.iter().map(|miss| miss.within_90).collect();
                let distance_cm = mean(misses.iter().map(|miss| miss.distance_cm));
                Some(Miss { distance_cm, within_90: within.map(mean) })
            };
            (0..horizons).map(at).collect()
        };
        Self { tip: means(&|(tip, _)| Some(*tip)).unwrap_or_default(), stem: means(&|(_, stem)| *stem) }
    }
}

/// The score of the plant that stands still: tip and stem stay where they were seen at the start.
pub(super) fn score_still(plant: &LeftOut, starts: &[usize], horizons_min: &[f64], view: View) -> PlantScore {
    let still = |&start: &usize| -> Vec<(Miss, Option<Miss>)> {
        let seen = State::of(&plant.observed.samples[start].observation(), view).expect(AT_STARTS);
        let at = |minutes: &f64| {
            let truth = truth_at(plant, start, *minutes, view);
            let miss = |distance_cm| Miss { distance_cm, within_90: None };
            let stem = seen.stem.zip(truth.stem).map(|(stem, truth)| miss(mean_distance(&stem, &truth)));
            (miss(distance(seen.tip, truth.tip)), stem)
        };
        horizons_min.iter().map(at).collect()
    };
    PlantScore::mean(&starts.iter().map(still).collect::<Vec<_>>(), horizons_min.len())
}

/// The score of `model` on a plant. The number of the plant names its random numbers.
pub(super) fn score(
    model: &impl PlantModel,
    plant: &LeftOut,
    starts: &[usize],
    horizons_min: &[f64],
    view: View,
    seed: u64,
    number: u32,
) -> PlantScore {
    let of_start = |&start: &usize| -> Vec<(Miss, Option<Miss>)> {
        let members: Vec<Vec<State>> = (0..MEMBERS)
            .map(|member| {
                let noise = NoiseStream::new(seed, Purpose::Forecast, [number, start as u32, member]);
                let seen = forecast(model, plant, start, horizons_min, noise);
                seen.iter().map(|seen| State::of(seen, view).expect("a model in space")).collect()
            })
            .collect();
        let axes = view.axes();
        let at = |(horizon, minutes): (usize, &f64)| {
            let truth = truth_at(plant, start, *minutes, view);
            let tips: Vec<[SpacePoint; 1]> = members.iter().map(|member| [member[horizon].tip]).collect();
            let stems: Option<Vec<Points>> = members.iter().map(|member| member[horizon].stem).collect();
            let stem = stems.zip(truth.stem).map(|(stems, truth)| miss(&stems, &truth, 1, axes));
            (miss(&tips, &[truth.tip], 0, axes), stem)
        };
        horizons_min.iter().enumerate().map(at).collect()
    };
    PlantScore::mean(&starts.iter().map(of_start).collect::<Vec<_>>(), horizons_min.len())
}

/// What one simulated plant shows at each horizon.
fn forecast(
    model: &impl PlantModel,
    plant: &LeftOut,
    start: usize,
    horizons_min: &[f64],
    noise: NoiseStream,
) -> Vec<Observation> {
    let samples = &plant.observed.samples;
    let mut simulated = model.resumed(&samples[..=start], &mut noise.of_seedling());
    let ends: Vec<usize> =
        horizons_min.iter().map(|&minutes| steps_of(minutes, plant.observed.period_min)).collect();
    let mut seen = vec![Observation::simulated(samples[start].tip); ends.len()];
    for step in 1..=ends.iter().copied().max().unwrap_or(0) {
        let light = samples[start + step - 1].light.expect("starts are followed by lit steps");
        model.step(&mut simulated, light, &mut noise.at(step as u32));
        for (seen, _) in seen.iter_mut().zip(&ends).filter(|(_, end)| **end == step) {
            *seen = model.observe(&simulated);
        }
    }
    seen
}

fn truth_at(plant: &LeftOut, start: usize, minutes: f64, view: View) -> State {
    plant.truth(start + steps_of(minutes, plant.observed.period_min), view).expect(AT_STARTS)
}

/// By how much the mean of `members` misses the truth, and how many of its coordinates, of the first `axes`, lie within their
/// 90 % interval. The first `known` points do not count for the interval: the base of a stem stays where it is.
fn miss<const N: usize>(
    members: &[[SpacePoint; N]],
    truth: &[SpacePoint; N],
    known: usize,
    axes: usize,
) -> Miss {
    let mean_of = |point: usize, axis: usize| mean(members.iter().map(|member| member[point][axis]));
    let expected: [SpacePoint; N] =
        core::array::from_fn(|point| core::array::from_fn(|axis| mean_of(point, axis)));
    let is_within = |point: usize, axis: usize| {
        let mut values: Vec<f64> = members.iter().map(|member| member[point][axis]).collect();
        values.sort_by(f64::total_cmp);
        let truth = truth[point][axis];
        f64::from(u8::from(values[END] <= truth && truth <= values[values.len() - 1 - END]))
    };
    let is_within = &is_within;
    let within = (known..N).flat_map(|point| (0..axes).map(move |axis| is_within(point, axis)));
    Miss { distance_cm: mean_distance(&expected, truth), within_90: Some(mean(within)) }
}

fn mean_distance<const N: usize>(one: &[SpacePoint; N], other: &[SpacePoint; N]) -> f64 {
    mean(one.iter().zip(other).map(|(&one, &other)| distance(one, other)))
}

#[cfg(test)]
mod tests {
    use tropism::geometry::STEM_POINTS;

    use super::*;

    #[test]
    fn the_interval_holds_nine_truths_in_ten() {
        let draw = |number: u32| {
            let noise = NoiseStream::new(1, Purpose::Trial, [number, 0, 0]);
            [noise.normal(0), noise.normal(1), noise.normal(2)]
        };
        let trials = 2000;
        let within = (0..trials).map(|trial| {
            let members: Vec<[SpacePoint; 1]> =
                (1..=MEMBERS).map(|member| [draw(trial * 60 + member)]).collect();
            miss(&members, &[draw(trial * 60)], 0, 3).within_90.unwrap()
        });
        let within = mean(within);
        // The standard error of 6000 coordinates is 0.4 %.
        assert!((within - 0.9).abs() < 0.02, "{within}");
    }

    #[test]
    fn the_distance_is_that_of_the_mean_forecast() {
        let members = [[[-1.0, 4.0, 0.0]], [[3.0, 4.0, 0.0]]].repeat(30);
        let found = miss(&members, &[[1.0, 7.0, 0.0]], 0, 2);
        assert_eq!((found.distance_cm, found.within_90), (3.0, Some(0.5)));
        let found = miss(&members, &[[1.0, 7.0, 4.0]], 0, 3);
        assert_eq!((found.distance_cm, found.within_90), (5.0, Some(1.0 / 3.0)));
        let far: [SpacePoint; STEM_POINTS] = core::array::from_fn(|at| [at as f64, 0.0, 0.0]);
        assert_eq!(mean_distance(&[SpacePoint::default(); STEM_POINTS], &far), 4.5);
    }
}
