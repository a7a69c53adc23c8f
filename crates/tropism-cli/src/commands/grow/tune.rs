//! A controller that is good on a model, in seconds: the greedy rule, with its aims moved until they suit the model.
//!
//! Evolution finds better ones, and takes minutes. This is what a patient person would do by hand: chase, but aim beyond
//! a target that is overshot late and turn to the next one early.

use rayon::prelude::*;
use tropism::control::Greedy;
use tropism::evolve;
use tropism::geometry::Point;
use tropism::lamps::Layout;
use tropism::plant::tip::TipModel;
use tropism::random::{self, Purpose};
use tropism::task::Targets;

/// Searches, each from another start.
const SEARCHES: u64 = 8;
/// Changes that a search tries.
const CHANGES: u64 = 800;
/// Simulated plants on which a change is judged, and on which the best of all searches is.
const PLANTS: [u32; 2] = [10, 200];
/// Aims for each target.
const AIMS: usize = 2;
/// Share of the coordinates that a change moves.
const MOVED: f64 = 0.3;
/// A change moves further after one that helped, and less far after one that did not (Rechenberg 1973), in cm.
const WIDEN: f64 = 1.3;
const NARROW: f64 = 0.985;
const LEAST_MOVE: f64 = 0.05;

/// Calls of `tick` in one tuning.
pub(super) const WORK: u64 = SEARCHES;

/// The best rule on `model`, and its mean fitness on plants of the model that it was not tuned on.
pub(super) fn tuned(model: &TipModel, task: &Targets, seed: u64, tick: impl Fn() + Sync) -> (f64, Greedy) {
    let found: Vec<(f64, Greedy)> = (0..SEARCHES)
        .into_par_iter()
        .map(|search| {
            let aims = search_from(model, task, random::derive(seed, Purpose::Trial, search));
            tick();
            (score(model, task, &aims, !seed, PLANTS[1]), chase(&aims))
        })
        .collect();
    found.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).expect("there are searches")
}

/// One search: a change that does no harm stays.
fn search_from(model: &TipModel, task: &Targets, seed: u64) -> Vec<f64> {
    let mut rng = random::stream(seed, Purpose::Trial, 0);
    let mut below = task.start.y;
    let mut aims: Vec<f64> = Vec::new();
    for target in &task.targets {
        for aim in 0..AIMS {
            let share = (aim + 1) as f64 / AIMS as f64;
            aims.extend([target.x + 2.0 * random::normal(&mut rng), below + share * (target.y - below)]);
        }
        below = target.y;
    }
    let mut best = score(model, task, &aims, seed, PLANTS[0]);
    let mut reach = 1.0;
    for _ in 0..CHANGES {
        let mut changed = aims.clone();
        for value in &mut changed {
            if random::uniform(&mut rng) < MOVED {
                *value += reach * random::normal(&mut rng);
            }
        }
        let fitness = score(model, task, &changed, seed, PLANTS[0]);
        if fitness >= best {
            (aims, best) = (changed, fitness);
            reach *= WIDEN;
        } else {
            reach = f64::max(NARROW * reach, LEAST_MOVE);
        }
    }
    aims
}

fn score(model: &TipModel, task: &Targets, aims: &[f64], seed: u64, plants: u32) -> f64 {
    let rule = chase(aims);
    evolve::trial(std::slice::from_ref(model), task, || rule.clone(), seed, plants).mean
}

/// The rule that chases `aims`, x and y of each, whatever order they have come into.
fn chase(aims: &[f64]) -> Greedy {
    let mut points: Vec<Point> = aims.chunks_exact(2).map(|aim| Point::new(aim[0], aim[1])).collect();
    points.sort_by(|a, b| a.y.total_cmp(&b.y));
    Greedy::towards(points, &Layout::default())
}

#[cfg(test)]
mod tests {
    use tropism::control::Periodic;
    use tropism::environment::unwatched;
    use tropism::greenhouse::bean::{Species, grow};
    use tropism::lamps::Light;
    use tropism::plant::tip::TipModelConfig;

    use super::*;

    #[test]
    fn a_search_betters_the_greedy_rule() {
        let species = Species::default();
        let open_loop = |seed| {
            let mut controller = Periodic::new(72, &Layout::default()).starting_with(Light::RIGHT);
            grow(&species, seed, 1.0, &mut controller, &Targets::open_loop(400), &mut unwatched)
        };
        let tracks: Vec<_> = (0..3).map(open_loop).collect();
        let model = TipModel::fit(&tracks, TipModelConfig::default()).unwrap();
        let task = Targets::default();
        let aims = search_from(&model, &task, 1);
        assert_eq!(aims, search_from(&model, &task, 1));
        let greedy: Vec<f64> = task.targets.iter().flat_map(|target| [target.x, target.y]).collect();
        let (tuned, greedy) = (score(&model, &task, &aims, 2, 50), score(&model, &task, &greedy, 2, 50));
        assert!(tuned > greedy, "{tuned} against {greedy}");
    }
}
