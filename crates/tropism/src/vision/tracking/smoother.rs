//! Smoothed path of a tip: a Kalman filter forwards and the Rauch-Tung-Striebel smoother backwards.
//!
//! In: the measured tips of a whole series. Out: the tip at each time with its standard deviation, also where it was
//! not measured. The one idea: the future corrects the filter, so short outliers between two jumps are
//! left out, and rejected measurements near the smoothed path are used.

use crate::geometry::Point;
use crate::vision::detect::curve::median;
use crate::vision::tracking::kalman::{KalmanState, MAX_STEADY_MOTION};

/// Least number of measurements between two jumps that are not an outlier. Chosen by hand.
const MIN_RUN: usize = 3;

/// Longest interval over which the allowed distance between two tips grows, in periods, or the median interval where that is
/// longer. Chosen by hand.
const MAX_INTERVAL: f64 = 3.0;

/// Distance from the smoothed tip, in cm, within which a rejected measurement is used after all. Chosen by hand.
const RECOVERY_RADIUS: f64 = 0.3;

/// Measurement of a tip in one photograph.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TipMeasurement {
    /// Time, in periods from any origin; times must rise.
    pub time: f64,
    /// Measured tip, in cm; `None` where none is detected.
    pub tip: Option<Point>,
    /// Whether it passed the gate when it was measured.
    pub is_accepted: bool,
}

/// Smoothed tip at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothedTip {
    /// Position, in cm.
    pub tip: Point,
    /// Standard deviation of each coordinate, in cm.
    pub deviation: f64,
}

/// A tip, and the number of the run between two jumps that it belongs to.
type RunTip = (Point, usize);

/// Smooths the tips of a series; `None` before the first used measurement, after the last, and across a jump.
///
/// # Panics
/// If the times do not rise.
#[must_use]
pub fn smooth(measurements: &[TipMeasurement]) -> Vec<Option<SmoothedTip>> {
    assert!(measurements.windows(2).all(|pair| pair[0].time < pair[1].time), "times must rise");
    let tips = consistent_runs(measurements);
    let first_pass = smooth_runs(measurements, &tips);
    let is_right = |measurement: &TipMeasurement, smoothed: &Option<SmoothedTip>| {
        measurement
            .tip
            .zip(*smoothed)
            .is_some_and(|(tip, smoothed)| tip.distance(smoothed.tip) <= RECOVERY_RADIUS)
    };
    let with_recovered: Vec<Option<RunTip>> = measurements
        .iter()
        .zip(&tips)
        .zip(&first_pass)
        .scan(0, |run, ((measurement, tip), smoothed)| {
            *run = tip.map_or(*run, |(_, run)| run);
            let recovered =
                measurement.tip.filter(|_| is_right(measurement, smoothed) && !measurement.is_accepted);
            Some(tip.or(recovered.map(|tip| (tip, *run))))
        })
        .collect();
    smooth_runs(measurements, &with_recovered)
}

/// The accepted tips in runs of at least [`MIN_RUN`]. A jump begins a new run; a tip that returns to the run before
/// continues that one.
fn consistent_runs(measurements: &[TipMeasurement]) -> Vec<Option<RunTip>> {
    let usual_interval = median(measurements.windows(2).map(|pair| pair[1].time - pair[0].time));
    let max_interval = usual_interval.max(MAX_INTERVAL);
    let mut runs: Vec<Vec<usize>> = Vec::new();
    let accepted = (0..measurements.len()).filter(|&i| measurements[i].is_accepted);
    for (i, tip) in accepted.filter_map(|i| Some((i, measurements[i].tip?))) {
        let continues = |run: &Vec<usize>| {
            let last = &measurements[run[run.len() - 1]];
            let periods = (measurements[i].time - last.time).clamp(1.0, max_interval);
            last.tip.is_some_and(|before| tip.distance(before) <= MAX_STEADY_MOTION * periods)
        };
        // The run with the latest tip stands last.
        match (0..runs.len()).rev().take(2).find(|&run| continues(&runs[run])) {
            Some(run) => {
                runs[run].push(i);
                let last = runs.len() - 1;
                runs.swap(run, last);
            }
            None => runs.push(vec![i]),
        }
    }
    let mut tips = vec![None; measurements.len()];
    let longest = runs.iter().map(Vec::len).max().unwrap_or(0);
    for (number, run) in runs.iter().enumerate().filter(|(_, run)| run.len() >= MIN_RUN.min(longest)) {
        run.iter().for_each(|&i| tips[i] = measurements[i].tip.map(|tip| (tip, number)));
    }
    tips
}

/// Smooths each run by itself.
fn smooth_runs(measurements: &[TipMeasurement], tips: &[Option<RunTip>]) -> Vec<Option<SmoothedTip>> {
    let mut smoothed = vec![None; measurements.len()];
    let mut start = 0;
    while let Some(first) = (start..tips.len()).find(|&i| tips[i].is_some()) {
        let number = tips[first].map(|(_, number)| number);
        let is_same_run = |&i: &usize| tips[i].map(|(_, number)| number) == number;
        let end = (first..tips.len()).find(|&i| tips[i].is_some() && !is_same_run(&i)).unwrap_or(tips.len());
        let last = (first..end).rev().find(is_same_run).unwrap_or(first);
        let states = filter_and_smooth(&measurements[first..=last], &tips[first..=last]);
        for (i, state) in (first..=last).zip(states) {
            smoothed[i] = Some(SmoothedTip { tip: state.tip.into(), deviation: state.deviation() });
        }
        start = last + 1;
    }
    smoothed
}

/// The smoothed states of one run, which begins and ends with a tip.
fn filter_and_smooth(measurements: &[TipMeasurement], tips: &[Option<RunTip>]) -> Vec<KalmanState> {
    let mut states: Vec<KalmanState> = Vec::with_capacity(measurements.len());
    for (i, tip) in tips.iter().enumerate() {
        let tip = tip.map(|(tip, _)| <[f64; 2]>::from(tip));
        let state = match states.last() {
            None => KalmanState::initial(tip.unwrap_or_default()),
            Some(before) => {
                let predicted = before.predict(measurements[i].time - measurements[i - 1].time);
                tip.map_or(predicted, |tip| predicted.update(tip))
            }
        };
        states.push(state);
    }
    for i in (0..states.len().saturating_sub(1)).rev() {
        let periods = measurements[i + 1].time - measurements[i].time;
        let predicted = states[i].predict(periods);
        states[i] = states[i].rts_smooth(periods, &predicted, &states[i + 1]);
    }
    states
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::math;
    use crate::random::{self, Purpose};

    /// A tip that circles.
    fn truth(step: usize) -> Point {
        let turn = step as f64 / 12.0;
        Point::new(2.0 * math::sin(turn), 10.0 + 0.05 * step as f64 + 0.5 * math::cos(turn))
    }

    fn measured(seed: u64) -> Vec<TipMeasurement> {
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
            let error = found.as_ref()?.tip.distance(truth(step));
            Some(error * error)
        });
        (squares.sum::<f64>() / found.iter().flatten().count() as f64).sqrt()
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn smoothing_reduces_the_error(seed in any::<u64>()) {
            let measurements = measured(seed);
            let unsmoothed: Vec<Option<SmoothedTip>> =
                measurements.iter().map(|measurement| Some(SmoothedTip { tip: measurement.tip?, deviation: 0.0 })).collect();
            let found = smooth(&measurements);
            prop_assert!(error(&found) < 0.9 * error(&unsmoothed), "{} {}", error(&found), error(&unsmoothed));
            prop_assert!(found.iter().flatten().all(|one| one.deviation > 0.0 && one.deviation < 0.05));
        }

        #[test]
        fn a_gap_is_bridged_with_a_larger_deviation(seed in any::<u64>(), from in 10..60_usize, long in 1..8_usize) {
            let mut measurements = measured(seed);
            measurements[from..from + long].iter_mut().for_each(|measurement| measurement.tip = None);
            let found = smooth(&measurements);
            let middle = found[from + long / 2].unwrap();
            prop_assert!(middle.tip.distance(truth(from + long / 2)) < 0.3, "{middle:?}");
            prop_assert!(middle.deviation > found[from - 6].unwrap().deviation);
        }
    }

    #[test]
    fn an_outlier_is_left_out_and_a_rejected_tip_that_was_right_is_used() {
        let mut measurements = measured(1);
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
    fn nothing_is_smoothed_across_a_jump_or_outside_the_measurements() {
        let mut measurements = measured(2);
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
