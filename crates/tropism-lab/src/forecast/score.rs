//! The forecasts of one model for one plant, judged.

use tropism::geometry::Point;
use tropism::math::statistics::mean;
use tropism::observation::Observation;
use tropism::plant::PlantModel;
use tropism::random::{NoiseStream, Purpose};

use super::left_out::{LeftOut, Points, TrueState, steps_of};

/// Simulated plants of each forecast. Of 59 draws, 54 of 60 further ones lie between the third from below and the third from
/// above: 90 %.
const MEMBERS: u32 = 59;

/// The place of the ends of the 90 % interval among the sorted members, from either end.
const END: usize = 2;

/// How much forecasts miss at one horizon: means over the starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Miss {
    /// Distance from the mean of the members to the truth, in cm.
    pub(super) distance_cm: f64,
    /// Share of true coordinates within the 90 % interval of the members; `None` without members.
    pub(super) within_90: Option<f64>,
}

/// The forecasts of one model for one plant: misses at each horizon.
#[derive(Clone, Debug, PartialEq)]
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
pub(super) fn score_still(plant: &LeftOut, starts: &[usize], horizons_min: &[f64]) -> PlantScore {
    let still = |&start: &usize| -> Vec<(Miss, Option<Miss>)> {
        let seen = plant.observed.samples[start].observation();
        let at = |minutes: &f64| {
            let truth = truth_at(plant, start, *minutes);
            let miss = |distance_cm| Miss { distance_cm, within_90: None };
            let stem =
                seen.ten_points().zip(truth.stem).map(|(stem, truth)| miss(mean_distance(&stem, &truth)));
            (miss(seen.tip.distance(truth.tip)), stem)
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
    seed: u64,
    number: u32,
) -> PlantScore {
    let of_start = |&start: &usize| -> Vec<(Miss, Option<Miss>)> {
        let members: Vec<Vec<Observation>> = (0..MEMBERS)
            .map(|member| {
                let noise = NoiseStream::new(seed, Purpose::Forecast, [number, start as u32, member]);
                forecast(model, plant, start, horizons_min, noise)
            })
            .collect();
        let at = |(horizon, minutes): (usize, &f64)| {
            let truth = truth_at(plant, start, *minutes);
            let tips: Vec<[Point; 1]> = members.iter().map(|member| [member[horizon].tip]).collect();
            let stems: Option<Vec<Points>> =
                members.iter().map(|member| member[horizon].ten_points()).collect();
            let stem = stems.zip(truth.stem).map(|(stems, truth)| miss(&stems, &truth, 1));
            (miss(&tips, &[truth.tip], 0), stem)
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

fn truth_at(plant: &LeftOut, start: usize, minutes: f64) -> TrueState {
    plant.truth[start + steps_of(minutes, plant.observed.period_min)].expect("starts are followed by truths")
}

/// By how much the mean of `members` misses the truth, and how many of its coordinates lie within their 90 % interval. The
/// first `known` points do not count for the interval: the base of a stem stays where it is.
fn miss<const N: usize>(members: &[[Point; N]], truth: &[Point; N], known: usize) -> Miss {
    let mean_of =
        |point: usize, axis: fn(Point) -> f64| mean(members.iter().map(|member| axis(member[point])));
    let expected: [Point; N] =
        core::array::from_fn(|point| Point::new(mean_of(point, |at| at.x), mean_of(point, |at| at.y)));
    let is_within = |point: usize, axis: fn(Point) -> f64| {
        let mut values: Vec<f64> = members.iter().map(|member| axis(member[point])).collect();
        values.sort_by(f64::total_cmp);
        let truth = axis(truth[point]);
        f64::from(u8::from(values[END] <= truth && truth <= values[values.len() - 1 - END]))
    };
    let within = (known..N).flat_map(|point| [is_within(point, |at| at.x), is_within(point, |at| at.y)]);
    Miss { distance_cm: mean_distance(&expected, truth), within_90: Some(mean(within)) }
}

fn mean_distance<const N: usize>(one: &[Point; N], other: &[Point; N]) -> f64 {
    mean(one.iter().zip(other).map(|(one, other)| one.distance(*other)))
}

#[cfg(test)]
mod tests {
    use tropism::geometry::STEM_POINTS;

    use super::*;

    #[test]
    fn the_interval_holds_nine_truths_in_ten() {
        let draw = |number: u32| {
            let noise = NoiseStream::new(1, Purpose::Trial, [number, 0, 0]);
            Point::new(noise.normal(0), noise.normal(1))
        };
        let trials = 2000;
        let within = (0..trials).map(|trial| {
            let members: Vec<[Point; 1]> = (1..=MEMBERS).map(|member| [draw(trial * 60 + member)]).collect();
            miss(&members, &[draw(trial * 60)], 0).within_90.unwrap()
        });
        let within = mean(within);
        // The standard error of 4000 coordinates is 0.5 %.
        assert!((within - 0.9).abs() < 0.02, "{within}");
    }

    #[test]
    fn the_distance_is_that_of_the_mean_forecast() {
        let members = [[Point::new(-1.0, 4.0)], [Point::new(3.0, 4.0)]].repeat(30);
        let found = miss(&members, &[Point::new(1.0, 7.0)], 0);
        assert_eq!((found.distance_cm, found.within_90), (3.0, Some(0.5)));
        let far: [Point; STEM_POINTS] = core::array::from_fn(|at| Point::new(at as f64, 0.0));
        assert_eq!(mean_distance(&[Point::default(); STEM_POINTS], &far), 4.5);
    }
}
