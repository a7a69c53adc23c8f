//! A greedy controller that is tuned on a model by an evolution strategy.
//!
//! In: a tip-motion model and a task. Out: a rule that steers towards waypoints instead of the targets: beyond a target
//! that would be passed too late, and early towards the next one. It is as good on the model as an evolved network
//! (`docs/virtual-bean.md`), and made in seconds.
//!
//! # References
//! A (1+1) evolution strategy with success-based step size: Rechenberg 1973, *Evolutionsstrategie*.

use tropism::control::Greedy;
use tropism::evolve;
use tropism::geometry::Point;
use tropism::lamps::Layout;
use tropism::parallel;
use tropism::plant::tip::TipModel;
use tropism::random::{self, Purpose};
use tropism::task::Task;

/// Number of searches, each from another start. This and the following constants were chosen by hand; row 22 of
/// `docs/virtual-bean.md` shows what they reach.
pub(super) const SEARCHES: u64 = 8;
/// Number of mutations that a search tries.
const MUTATIONS: u64 = 800;
/// Simulated plants on which a mutation is evaluated.
const SEARCH_PLANTS: u32 = 10;
/// Simulated plants on which the results of all searches are compared.
const FINAL_PLANTS: u32 = 200;
/// Waypoints for each target.
const WAYPOINTS: usize = 2;
/// Standard deviation of the first waypoints in x around their target, in cm.
const START_SD_CM: f64 = 2.0;
/// Share of the coordinates that a mutation changes.
const MUTATED_SHARE: f64 = 0.3;
/// Factors of the step size after a success and after a failure: in balance at one success in some 18 mutations.
const STEP_GROWTH: f64 = 1.3;
const STEP_DECAY: f64 = 0.985;
/// The least step size, in cm.
const MIN_STEP_CM: f64 = 0.05;

/// A controller, and its mean fitness on simulated plants on which it was not tuned, in cm.
pub(super) type TunedController = (f64, Greedy);

/// The best controller of [`SEARCHES`] searches on `model`. Each search calls `tick` when it ends, and goes on as long as
/// `may_go_on` says.
pub(super) fn tune(
    model: &TipModel,
    task: &Task,
    seed: u64,
    tick: impl Fn() + Sync,
    may_go_on: impl Fn() -> bool + Sync,
) -> TunedController {
    let tuned: Vec<TunedController> = parallel::map(SEARCHES as usize, |search| {
        let seed_of_search = random::derive(seed, Purpose::Trial, search as u64);
        let waypoints = search_from(model, task, seed_of_search, &may_go_on);
        tick();
        (mean_fitness(model, task, &waypoints, !seed, FINAL_PLANTS), controller(&waypoints))
    });
    tuned.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).expect("at least one search")
}

/// One search: a mutation that is not worse replaces its parent. Returns x and y of each waypoint in turn, in cm.
fn search_from(model: &TipModel, task: &Task, seed: u64, may_go_on: &dyn Fn() -> bool) -> Vec<f64> {
    let mut rng = random::stream(seed, Purpose::Trial, 0);
    let mut waypoints = first_waypoints(task, || random::normal(&mut rng));
    let mut best = mean_fitness(model, task, &waypoints, seed, SEARCH_PLANTS);
    let mut step_cm = 1.0;
    for _ in 0..MUTATIONS {
        if !may_go_on() {
            break;
        }
        let mut mutant = waypoints.clone();
        for value in &mut mutant {
            if random::uniform(&mut rng) < MUTATED_SHARE {
                *value += step_cm * random::normal(&mut rng);
            }
        }
        let fitness = mean_fitness(model, task, &mutant, seed, SEARCH_PLANTS);
        if fitness >= best {
            (waypoints, best) = (mutant, fitness);
            step_cm *= STEP_GROWTH;
        } else {
            step_cm = f64::max(STEP_DECAY * step_cm, MIN_STEP_CM);
        }
    }
    waypoints
}

/// Waypoints around each target, at equal distances in height from the target below; `normal` draws from the standard
/// normal distribution.
fn first_waypoints(task: &Task, mut normal: impl FnMut() -> f64) -> Vec<f64> {
    let mut below = task.start.y;
    let mut waypoints: Vec<f64> = Vec::new();
    for target in &task.targets {
        for waypoint in 0..WAYPOINTS {
            let share = (waypoint + 1) as f64 / WAYPOINTS as f64;
            let x = target.x + START_SD_CM * normal();
            waypoints.extend([x, below + share * (target.y - below)]);
        }
        below = target.y;
    }
    waypoints
}

fn mean_fitness(model: &TipModel, task: &Task, waypoints: &[f64], seed: u64, plants: u32) -> f64 {
    let rule = controller(waypoints);
    evolve::trial(std::slice::from_ref(model), task, || rule.clone(), seed, plants).mean
}

/// The greedy controller towards `waypoints`, in the order of their heights.
fn controller(waypoints: &[f64]) -> Greedy {
    let mut points: Vec<Point> = waypoints.chunks_exact(2).map(|at| Point::new(at[0], at[1])).collect();
    points.sort_by(|a, b| a.y.total_cmp(&b.y));
    Greedy::towards(points, &Layout::default())
}

#[cfg(test)]
mod tests {
    use tropism::task::Task;

    use tropism::control::Periodic;
    use tropism::environment::unwatched;
    use tropism::lamps::Light;
    use tropism::plant::tip::TipModelConfig;
    use tropism_bean::{Species, grow};

    use super::*;

    #[test]
    fn a_search_improves_the_greedy_controller() {
        let species = Species::default();
        let open_loop = |seed| {
            let mut controller = Periodic::new(72, &Layout::default()).starting_with(Light::RIGHT);
            grow(&species, seed, 1.0, &mut controller, &Task::open_loop(400), &mut unwatched)
        };
        let tracks: Vec<_> = (0..3).map(open_loop).collect();
        let model = TipModel::fit(&tracks, TipModelConfig::default()).unwrap();
        let task = Task::default();
        let waypoints = search_from(&model, &task, 1, &|| true);
        assert_eq!(waypoints, search_from(&model, &task, 1, &|| true));
        let greedy: Vec<f64> = task.targets.iter().flat_map(|target| [target.x, target.y]).collect();
        let (tuned, greedy) =
            (mean_fitness(&model, &task, &waypoints, 2, 50), mean_fitness(&model, &task, &greedy, 2, 50));
        assert!(tuned > greedy, "{tuned} against {greedy}");
    }
}
