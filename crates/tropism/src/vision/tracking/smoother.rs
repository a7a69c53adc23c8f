//! Where a tip was all along.

use crate::geometry::Point;
use crate::vision::tracking::kalman::{KalmanState, STEADY};

/// Tips that lie together between two jumps are believed if they are as many.
const ISLAND: usize = 3;

/// Periods after which it counts no more how long ago the tip was seen.
const FORGETS: f64 = 3.0;

/// How far from where it was a tip that was doubted is believed after all, in cm.
const NEAR: f64 = 0.3;

/// What one photograph says of the tip.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TipMeasurement {
    /// When, in periods since whenever; each later than the one before.
    pub time: f64,
    /// Where the tip is in it, in cm; `None` where none is found.
    pub tip: Option<Point>,
    /// Whether it was believed when it was taken.
    pub is_accepted: bool,
}

/// Where a tip was, as all photographs together say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothedTip {
    /// In cm.
    pub tip: Point,
    /// One deviation of each coordinate, in cm.
    pub deviation: f64,
}

/// Where the tip was at each measurement, in rts_smooth; `None` before the first tip that can be believed and after the last,
/// and across a jump.
///
/// A few tips on their own between two jumps are left out: past and future both speak against them. A tip that was doubted
/// counts where it turns out to have been right.
///
/// # Panics
/// If the times do not rise.
#[must_use]
pub fn smooth(measurements: &[TipMeasurement]) -> Vec<Option<SmoothedTip>> {
    assert!(measurements.windows(2).all(|pair| pair[0].time < pair[1].time), "times must rise");
    let tips = consistent_runs(measurements);
    let first = smooth_runs(measurements, &tips);
    let is_right = |measurement: &TipMeasurement, first: &Option<SmoothedTip>| {
        measurement.tip.zip(*first).is_some_and(|(tip, first)| tip.distance(first.tip) <= NEAR)
    };
    let found: Vec<Option<(Point, usize)>> = measurements
        .iter()
        .zip(&tips)
        .zip(&first)
        .scan(0, |run, ((measurement, tip), first)| {
            *run = tip.map_or(*run, |(_, run)| run);
            let late = measurement.tip.filter(|_| is_right(measurement, first) && !measurement.is_accepted);
            Some(tip.or(late.map(|tip| (tip, *run))))
        })
        .collect();
    smooth_runs(measurements, &found)
}

/// The tips that were believed and still are, and the number of the run between two jumps that each belongs to.
fn consistent_runs(measurements: &[TipMeasurement]) -> Vec<Option<(Point, usize)>> {
    let mut runs: Vec<Vec<usize>> = Vec::new();
    let believed = (0..measurements.len()).filter(|&i| measurements[i].is_accepted);
    for (i, tip) in believed.filter_map(|i| Some((i, measurements[i].tip?))) {
        let goes_on = |run: &Vec<usize>| {
            let last = &measurements[run[run.len() - 1]];
            let periods = (measurements[i].time - last.time).clamp(1.0, FORGETS);
            last.tip.is_some_and(|before| tip.distance(before) <= STEADY * periods)
        };
        // Back from an island, what went on before it goes on; the run with the latest tip stands last.
        match (0..runs.len()).rev().take(2).find(|&run| goes_on(&runs[run])) {
            Some(run) => {
                runs[run].push(i);
                let last = runs.len() - 1;
                runs.swap(run, last);
            }
            None => runs.push(vec![i]),
        }
    }
    let mut tips = vec![None; measurements.len()];
    let most = runs.iter().map(Vec::len).max().unwrap_or(0);
    for (number, run) in runs.iter().enumerate().filter(|(_, run)| run.len() >= ISLAND.min(most)) {
        run.iter().for_each(|&i| tips[i] = measurements[i].tip.map(|tip| (tip, number)));
    }
    tips
}

/// Each run of tips smoothed both ways by itself.
fn smooth_runs(measurements: &[TipMeasurement], tips: &[Option<(Point, usize)>]) -> Vec<Option<SmoothedTip>> {
    let mut smoothed = vec![None; measurements.len()];
    let mut start = 0;
    while let Some(first) = (start..tips.len()).find(|&i| tips[i].is_some()) {
        let number = tips[first].map(|(_, number)| number);
        let is_same = |&i: &usize| tips[i].map(|(_, number)| number) == number;
        let end = (first..tips.len()).find(|&i| tips[i].is_some() && !is_same(&i)).unwrap_or(tips.len());
        let last = (first..end).rev().find(is_same).unwrap_or(first);
        let states = filter_and_smooth(&measurements[first..=last], &tips[first..=last]);
        for (i, state) in (first..=last).zip(states) {
            smoothed[i] =
                Some(SmoothedTip { tip: state.tip, deviation: state.covariance[0].max(0.0).sqrt() });
        }
        start = last + 1;
    }
    smoothed
}

/// The states of one run, which begins and ends with a tip.
fn filter_and_smooth(measurements: &[TipMeasurement], tips: &[Option<(Point, usize)>]) -> Vec<KalmanState> {
    let mut states: Vec<KalmanState> = Vec::with_capacity(measurements.len());
    for (i, tip) in tips.iter().enumerate() {
        let seen = tip.map(|(tip, _)| tip);
        let state = match (states.last(), seen) {
            (None, seen) => KalmanState::initial(seen.unwrap_or_default()),
            (Some(before), Some(tip)) => {
                before.predict_and_update(tip, measurements[i].time - measurements[i - 1].time)
            }
            (Some(before), None) => before.predict(measurements[i].time - measurements[i - 1].time),
        };
        states.push(state);
    }
    for i in (0..states.len().saturating_sub(1)).rev() {
        let periods = measurements[i + 1].time - measurements[i].time;
        let expected = states[i].predict(periods);
        states[i] = states[i].rts_smooth(periods, &expected, &states[i + 1]);
    }
    states
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::math;
    use crate::random::{self, Purpose};

    /// A tip that circles, seen with noise.
    fn truth(step: usize) -> Point {
        let turn = step as f64 / 12.0;
        Point::new(2.0 * math::sin(turn), 10.0 + 0.05 * step as f64 + 0.5 * math::cos(turn))
    }

    fn seen(seed: u64) -> Vec<TipMeasurement> {
        let mut rng = random::stream(seed, Purpose::Trial, 0);
        let mut noise = || 0.12 * (random::uniform(&mut rng) - 0.5);
        let measurement = |step: usize| {
            let at = truth(step);
            let tip = Some(Point::new(at.x + noise(), at.y + noise()));
            TipMeasurement { time: step as f64, tip, is_accepted: true }
        };
        (0..80).map(measurement).collect()
    }

    fn error(found: &[Option<SmoothedTip>]) -> f64 {
        let squares = found.iter().enumerate().filter_map(|(step, found)| {
            let away = found.as_ref()?.tip.distance(truth(step));
            Some(away * away)
        });
        (squares.sum::<f64>() / found.iter().flatten().count() as f64).sqrt()
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn hindsight_is_better_than_sight(seed in any::<u64>()) {
            let measurements = seen(seed);
            let sight: Vec<Option<SmoothedTip>> =
                measurements.iter().map(|measurement| Some(SmoothedTip { tip: measurement.tip?, deviation: 0.0 })).collect();
            let found = smooth(&measurements);
            prop_assert!(error(&found) < 0.9 * error(&sight), "{} {}", error(&found), error(&sight));
            prop_assert!(found.iter().flatten().all(|one| one.deviation > 0.0 && one.deviation < 0.05));
        }

        #[test]
        fn a_gap_is_bridged_and_less_sure(seed in any::<u64>(), from in 10..60_usize, long in 1..8_usize) {
            let mut measurements = seen(seed);
            measurements[from..from + long].iter_mut().for_each(|measurement| measurement.tip = None);
            let found = smooth(&measurements);
            let middle = found[from + long / 2].unwrap();
            prop_assert!(middle.tip.distance(truth(from + long / 2)) < 0.3, "{middle:?}");
            prop_assert!(middle.deviation > found[from - 6].unwrap().deviation);
        }
    }

    #[test]
    fn an_island_is_left_out_and_a_doubted_tip_that_was_right_counts() {
        let mut measurements = seen(1);
        for measurement in &mut measurements[30..32] {
            measurement.tip = measurement.tip.map(|tip| Point::new(tip.x, tip.y - 3.0));
        }
        let found = smooth(&measurements);
        assert!(found[30].unwrap().tip.distance(truth(30)) < 0.3, "{:?}", found[30]);
        measurements[31] = TipMeasurement { tip: Some(truth(31)), is_accepted: false, ..measurements[31] };
        let better = smooth(&measurements);
        assert!(better[31].unwrap().deviation < found[31].unwrap().deviation);
        measurements[31].tip = Some(Point::new(9.0, 9.0));
        assert!(smooth(&measurements)[31].unwrap().tip.distance(truth(31)) < 0.3);
    }

    #[test]
    fn nothing_is_said_across_a_jump_and_outside_of_what_was_seen() {
        let mut measurements = seen(2);
        measurements[..3].iter_mut().for_each(|measurement| measurement.is_accepted = false);
        measurements[78..].iter_mut().for_each(|measurement| measurement.tip = None);
        measurements[40].tip = None;
        for measurement in &mut measurements[41..] {
            measurement.tip = measurement.tip.map(|tip| Point::new(tip.x - 6.0, tip.y));
        }
        let found = smooth(&measurements);
        let unknown: Vec<usize> = (0..80).filter(|&i| found[i].is_none()).collect();
        assert_eq!(unknown, [0, 1, 2, 40, 78, 79]);
        assert_eq!(smooth(&[]), []);
        assert_eq!(smooth(&[TipMeasurement::default()]), [None]);
    }
}
