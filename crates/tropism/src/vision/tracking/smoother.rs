//! Where a tip was all along.

use crate::geometry::Point;
use crate::vision::tracking::kalman::{Motion, STEADY};

/// Tips that lie together between two jumps are believed if they are as many.
const ISLAND: usize = 3;

/// Periods after which it counts no more how long ago the tip was seen.
const FORGETS: f64 = 3.0;

/// How far from where it was a tip that was doubted is believed after all, in cm.
const NEAR: f64 = 0.3;

/// What one photograph says of the tip.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Glance {
    /// When, in periods since whenever; each later than the one before.
    pub at: f64,
    /// Where the tip is in it, in cm; `None` where none is found.
    pub tip: Option<Point>,
    /// Whether it was believed when it was taken.
    pub is_believed: bool,
}

/// Where a tip was, as all photographs together say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothed {
    /// In cm.
    pub tip: Point,
    /// One deviation of each coordinate, in cm.
    pub deviation: f64,
}

/// Where the tip was at each glance, in hindsight; `None` before the first tip that can be believed and after the last,
/// and across a jump.
///
/// A few tips on their own between two jumps are left out: past and future both speak against them. A tip that was doubted
/// counts where it turns out to have been right.
///
/// # Panics
/// If the times do not rise.
#[must_use]
pub fn smooth(glances: &[Glance]) -> Vec<Option<Smoothed>> {
    assert!(glances.windows(2).all(|pair| pair[0].at < pair[1].at), "times must rise");
    let tips = steady(glances);
    let first = along(glances, &tips);
    let is_right = |glance: &Glance, first: &Option<Smoothed>| {
        glance.tip.zip(*first).is_some_and(|(tip, first)| tip.distance(first.tip) <= NEAR)
    };
    let found: Vec<Option<(Point, usize)>> = glances
        .iter()
        .zip(&tips)
        .zip(&first)
        .scan(0, |run, ((glance, tip), first)| {
            *run = tip.map_or(*run, |(_, run)| run);
            let late = glance.tip.filter(|_| is_right(glance, first) && !glance.is_believed);
            Some(tip.or(late.map(|tip| (tip, *run))))
        })
        .collect();
    along(glances, &found)
}

/// The tips that were believed and still are, and the number of the run between two jumps that each belongs to.
fn steady(glances: &[Glance]) -> Vec<Option<(Point, usize)>> {
    let mut runs: Vec<Vec<usize>> = Vec::new();
    let believed = (0..glances.len()).filter(|&i| glances[i].is_believed);
    for (i, tip) in believed.filter_map(|i| Some((i, glances[i].tip?))) {
        let goes_on = |run: &Vec<usize>| {
            let last = &glances[run[run.len() - 1]];
            let periods = (glances[i].at - last.at).clamp(1.0, FORGETS);
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
    let mut tips = vec![None; glances.len()];
    let most = runs.iter().map(Vec::len).max().unwrap_or(0);
    for (number, run) in runs.iter().enumerate().filter(|(_, run)| run.len() >= ISLAND.min(most)) {
        run.iter().for_each(|&i| tips[i] = glances[i].tip.map(|tip| (tip, number)));
    }
    tips
}

/// Each run of tips smoothed both ways by itself.
fn along(glances: &[Glance], tips: &[Option<(Point, usize)>]) -> Vec<Option<Smoothed>> {
    let mut smoothed = vec![None; glances.len()];
    let mut start = 0;
    while let Some(first) = (start..tips.len()).find(|&i| tips[i].is_some()) {
        let number = tips[first].map(|(_, number)| number);
        let is_same = |&i: &usize| tips[i].map(|(_, number)| number) == number;
        let end = (first..tips.len()).find(|&i| tips[i].is_some() && !is_same(&i)).unwrap_or(tips.len());
        let last = (first..end).rev().find(is_same).unwrap_or(first);
        let states = both_ways(&glances[first..=last], &tips[first..=last]);
        for (i, state) in (first..=last).zip(states) {
            smoothed[i] = Some(Smoothed { tip: state.tip, deviation: state.spread[0].max(0.0).sqrt() });
        }
        start = last + 1;
    }
    smoothed
}

/// The states of one run, which begins and ends with a tip.
fn both_ways(glances: &[Glance], tips: &[Option<(Point, usize)>]) -> Vec<Motion> {
    let mut states: Vec<Motion> = Vec::with_capacity(glances.len());
    for (i, tip) in tips.iter().enumerate() {
        let seen = tip.map(|(tip, _)| tip);
        let state = match (states.last(), seen) {
            (None, seen) => Motion::begin(seen.unwrap_or_default()),
            (Some(before), Some(tip)) => before.measured(tip, glances[i].at - glances[i - 1].at),
            (Some(before), None) => before.ahead(glances[i].at - glances[i - 1].at),
        };
        states.push(state);
    }
    for i in (0..states.len().saturating_sub(1)).rev() {
        let periods = glances[i + 1].at - glances[i].at;
        let expected = states[i].ahead(periods);
        states[i] = states[i].hindsight(periods, &expected, &states[i + 1]);
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

    fn seen(seed: u64) -> Vec<Glance> {
        let mut rng = random::stream(seed, Purpose::Trial, 0);
        let mut noise = || 0.12 * (random::uniform(&mut rng) - 0.5);
        let glance = |step: usize| {
            let at = truth(step);
            let tip = Some(Point::new(at.x + noise(), at.y + noise()));
            Glance { at: step as f64, tip, is_believed: true }
        };
        (0..80).map(glance).collect()
    }

    fn error(found: &[Option<Smoothed>]) -> f64 {
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
            let glances = seen(seed);
            let sight: Vec<Option<Smoothed>> =
                glances.iter().map(|glance| Some(Smoothed { tip: glance.tip?, deviation: 0.0 })).collect();
            let found = smooth(&glances);
            prop_assert!(error(&found) < 0.9 * error(&sight), "{} {}", error(&found), error(&sight));
            prop_assert!(found.iter().flatten().all(|one| one.deviation > 0.0 && one.deviation < 0.05));
        }

        #[test]
        fn a_gap_is_bridged_and_less_sure(seed in any::<u64>(), from in 10..60_usize, long in 1..8_usize) {
            let mut glances = seen(seed);
            glances[from..from + long].iter_mut().for_each(|glance| glance.tip = None);
            let found = smooth(&glances);
            let middle = found[from + long / 2].unwrap();
            prop_assert!(middle.tip.distance(truth(from + long / 2)) < 0.3, "{middle:?}");
            prop_assert!(middle.deviation > found[from - 6].unwrap().deviation);
        }
    }

    #[test]
    fn an_island_is_left_out_and_a_doubted_tip_that_was_right_counts() {
        let mut glances = seen(1);
        for glance in &mut glances[30..32] {
            glance.tip = glance.tip.map(|tip| Point::new(tip.x, tip.y - 3.0));
        }
        let found = smooth(&glances);
        assert!(found[30].unwrap().tip.distance(truth(30)) < 0.3, "{:?}", found[30]);
        glances[31] = Glance { tip: Some(truth(31)), is_believed: false, ..glances[31] };
        let better = smooth(&glances);
        assert!(better[31].unwrap().deviation < found[31].unwrap().deviation);
        glances[31].tip = Some(Point::new(9.0, 9.0));
        assert!(smooth(&glances)[31].unwrap().tip.distance(truth(31)) < 0.3);
    }

    #[test]
    fn nothing_is_said_across_a_jump_and_outside_of_what_was_seen() {
        let mut glances = seen(2);
        glances[..3].iter_mut().for_each(|glance| glance.is_believed = false);
        glances[78..].iter_mut().for_each(|glance| glance.tip = None);
        glances[40].tip = None;
        for glance in &mut glances[41..] {
            glance.tip = glance.tip.map(|tip| Point::new(tip.x - 6.0, tip.y));
        }
        let found = smooth(&glances);
        let unknown: Vec<usize> = (0..80).filter(|&i| found[i].is_none()).collect();
        assert_eq!(unknown, [0, 1, 2, 40, 78, 79]);
        assert_eq!(smooth(&[]), []);
        assert_eq!(smooth(&[Glance::default()]), [None]);
    }
}
