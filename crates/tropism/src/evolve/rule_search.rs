//! The search for the numbers of a predictive rule on a model.
//!
//! CMA-ES moves nine parameters; a point is worth the mean [utility](crate::task::Score::utility) of its fitness over simulated plants. All
//! points of some generations steer the same plants (common random numbers), so that differences between points are not
//! differences between plants; then other plants come, so that a rule is not tuned to a few. The best of each period are tried
//! on plants that none of them has steered, and the best of these is chosen. In a task with obstacles each step at which a plant
//! is [beyond all data](crate::plant::PlantModel::is_beyond_data) of the model costs: a search must not live on guesses.
//!
//! # References
//! Glasserman and Yao 1992, doi:10.1287/mnsc.38.6.884 (common random numbers). Milano, Carvalho and Nolfi 2018,
//! doi:10.1162/ARTL_a_00274 (plants that change every few generations). Yu et al. 2020, arXiv:2005.13239 (steps of which a model
//! is not sure cost).

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use super::champion::{Choice, Trial};
use crate::CmaEs;
use crate::check::{OutOfRange, within};
use crate::control::{Avoidance, PredictiveRule};
use crate::math::statistics;
use crate::parallel;
use crate::random::{NoiseStream, Purpose, derive};
use crate::simulation::{BatchModel, Episode};
use crate::task::Task;

/// Numbers of a rule that are searched, and those of one that avoids obstacles.
const NUMBERS: usize = 9;
const AVOIDING_NUMBERS: usize = 15;

/// Generations that steer the same plants. This number, the defaults of [`RuleSearch`] and the units below stood in the first
/// version of the search; a search of 200 generations was no better.
pub(super) const GENERATIONS_OF_PLANTS: u32 = 6;

/// Simulated plants on which the candidates are compared, as a multiple of the plants of an evaluation. Chosen: the standard
/// error of the difference is half of that of the search.
const CHOICE_FACTOR: u32 = 4;

/// Simulated plants on which the fitness of the chosen rule is predicted. Chosen: the standard error is 0.1 cm at a standard
/// deviation of 3 cm.
const PREDICTION_PLANTS: u32 = 1000;

/// Trials that a thread takes at once. Chosen: some milliseconds of work, in which vector lanes are rarely without a plant.
const TRIALS_AT_ONCE: usize = 64;

/// What a step beyond all data of a model costs in a search among obstacles, in cm: about as much as a tip moves in a step, so
/// that nothing is gained there. Chosen by hand.
///
/// Without obstacles nothing costs: eq. (9) itself charges for each move away from a target, while among obstacles a target that
/// is never passed costs nothing. A slow plant has to grow beyond its data to reach its targets: with the cost rules for the
/// sunflower of `studies/robust.toml` were 1.5 cm worse.
const BEYOND_COST_CM: f64 = 0.1;

/// Least look-ahead, in cm. Chosen: twice the way of a tip in a step, below which the next target changes at random.
const MIN_LOOK_AHEAD_CM: f64 = 0.2;

/// The rule of a point: each number has a unit of its own, so that steps of size 1 are sensible in each dimension. The origin
/// is the greedy rule; a point of fifteen numbers is a rule that also avoids obstacles.
fn rule_at(point: &[f64]) -> PredictiveRule {
    let avoidance = point.get(NUMBERS..AVOIDING_NUMBERS).map(|point| Avoidance {
        way_x_cm: point[0],
        way_y_cm: point[1],
        clearance_cm: 1.0 + 0.5 * point[2],
        push: 2.0 * point[3].abs(),
        clearance_steps: 5.0 * point[4],
        bend: point[5],
    });
    PredictiveRule {
        avoidance,
        look_ahead_cm: MIN_LOOK_AHEAD_CM + point[0].abs(),
        overshoot: 0.3 * point[1],
        next_target: 0.3 * point[2],
        offset_cm: 0.5 * point[3],
        velocity_steps: 10.0 * point[4],
        light_memory_cm: point[5],
        lean: 0.1 * point[6],
        shift_steps: 3.0 * point[7],
        persistence_cm: 0.2 * point[8],
    }
}

/// One rule on one plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RuleTrial {
    /// The rule.
    pub rule: PredictiveRule,
    /// Number of a set of plants. All rules that are compared with each other steer the plants of one set.
    pub set: u32,
    /// Number of the plant in its set, from 0.
    pub plant: u32,
}

/// How long the numbers of a rule are searched.
///
/// ```
/// use std::ops::ControlFlow;
/// use tropism::evolve::RuleSearch;
/// use tropism::prelude::*;
/// # let measured = "tip_x_cm,tip_y_cm,light\n0,4,left\n-0.1,4.03,right\n0,4.06,right\n0.1,4.1,dark\n";
/// # let model = TipModel::fit([&Track::read_csv(measured.as_bytes())?], TipModelConfig::default())?;
/// let task = Task { max_steps: 20, ..Task::default() };
/// let search = RuleSearch { generations: 3, population: 6, episodes: 4, ..RuleSearch::default() };
/// let found = search.tune(&model, &task, 1, &mut |_| ControlFlow::Continue(())).expect("never broken off");
/// println!("{:?}: {:.2} cm, greedy {:.2} cm", found.rule, found.expected.mean, found.greedy.mean);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct RuleSearch {
    /// Generations, 1 to 100000.
    pub generations: u32,
    /// Rules of a generation, 4 to 10000.
    pub population: u32,
    /// Simulated plants that each rule steers, 1 to 100000; its fitness is the mean.
    pub episodes: u32,
    /// Searches that begin side by side, 1 to 1000, and share the generations: after each round the better half goes on
    /// (successive halving, Karnin, Koren, Somekh 2013). A search among obstacles may end in a poor part of the space, which the
    /// model knows; one beside it may not.
    pub starts: u32,
}

impl Default for RuleSearch {
    /// 60 generations of 24 rules, 96 plants each: some seconds.
    fn default() -> Self {
        Self { generations: 60, population: 24, episodes: 96, starts: 1 }
    }
}

/// Those of the searches that are worth more than the others: half of them, one more of an odd number.
fn better_half<S>(mut searches: Vec<(f64, S)>) -> Vec<S> {
    let half = searches.len().div_ceil(2);
    searches.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    searches.into_iter().take(half).map(|(_, search)| search).collect()
}

/// The part `number` of `count` nearly equal parts of a `whole`.
fn part(whole: u32, count: u32, number: u32) -> u32 {
    let until = |parts: u32| (u64::from(whole) * u64::from(parts) / u64::from(count)) as u32;
    until(number + 1) - until(number)
}

/// A generation of a [`RuleSearch`]. Values of different plants differ: see [`RuleSearch::tune`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RuleGeneration {
    /// Number of the generation, from 0.
    pub generation: u32,
    /// Mean [utility](crate::task::Score::utility) of its best rule.
    pub best: f64,
    /// Mean utility of all its rules.
    pub mean: f64,
}

/// What a search found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RuleSearchResult {
    /// The chosen rule.
    pub rule: PredictiveRule,
    /// Its fitness on simulated plants that had no part in the search.
    pub expected: Trial,
    /// Fitness of the greedy rule on the same plants.
    pub greedy: Trial,
}

impl RuleSearch {
    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and its range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        within("generations", self.generations, 1..=100_000)?;
        within("population", self.population, 4..=10_000)?;
        within("episodes", self.episodes, 1..=100_000)?;
        within("starts", self.starts, 1..=1000)
    }

    /// Rounds until one search of all that began is left.
    fn rounds(&self) -> u32 {
        self.starts.next_power_of_two().ilog2() + 1
    }

    /// The lists of trials of which [`tune_by`](Self::tune_by) asks the scores, in order: whether each is a generation. Others
    /// compare searches or candidates.
    pub fn lists(&self) -> impl Iterator<Item = bool> {
        let rounds = self.rounds();
        let generations = self.generations;
        let of_round = move |round| std::iter::repeat_n(true, part(generations, rounds, round) as usize);
        // After each round comes a comparison, and at the end the prediction.
        (0..rounds).flat_map(move |round| of_round(round).chain([false])).chain([false])
    }

    /// Searches the rule with the highest mean [utility](crate::task::Score::utility) for `task` on `model`, on all threads. `watch` sees each
    /// generation; `None` if it broke off.
    ///
    /// # Panics
    /// If [`Self::check`] refuses the numbers.
    pub fn tune<M: BatchModel>(
        &self,
        model: &M,
        task: &Task,
        seed: u64,
        watch: &mut dyn FnMut(&RuleGeneration) -> ControlFlow<()>,
    ) -> Option<RuleSearchResult> {
        self.tune_by(Self::scores_on(model, task, seed), task, seed, watch)
    }

    /// The fitness of trials on simulated plants of `model`, on all threads, less a cost in cm for each step beyond all data:
    /// [`tune`](Self::tune) searches by it.
    pub fn scores_on<M: BatchModel>(
        model: &M,
        task: &Task,
        seed: u64,
    ) -> impl Fn(&[RuleTrial], f64) -> Vec<f64> {
        let episode = move |trial: &RuleTrial| Episode {
            controller: trial.rule,
            noise: NoiseStream::new(seed, Purpose::Trial, [trial.plant, trial.set, 0]),
        };
        move |trials: &[RuleTrial], beyond_cost_cm: f64| {
            let parts: Vec<&[RuleTrial]> = trials.chunks(TRIALS_AT_ONCE).collect();
            let some = parallel::map(parts.len(), |part| {
                model.score_rules(task, beyond_cost_cm, parts[part].iter().map(episode))
            });
            some.into_iter().flatten().collect()
        }
    }

    /// Searches the rule with the highest mean utility of `scores`: the fitness of each of some trials in `task`, in order, less
    /// a cost in cm for each step beyond all data, which is 0 for the predicted fitness of the chosen rule. Plants that `scores` knows
    /// need no model: a search on virtual beans themselves finds what a rule can reach at best. In a task with obstacles the
    /// rule also avoids them.
    ///
    /// # Panics
    /// If [`Self::check`] refuses the numbers.
    pub fn tune_by(
        &self,
        scores: impl Fn(&[RuleTrial], f64) -> Vec<f64>,
        task: &Task,
        seed: u64,
        watch: &mut dyn FnMut(&RuleGeneration) -> ControlFlow<()>,
    ) -> Option<RuleSearchResult> {
        let utility = |fitness| task.kind.utility(fitness);
        let beyond_cost_cm = if task.obstacles.is_empty() { 0.0 } else { BEYOND_COST_CM };
        let objective = Objective { scores: &scores, utility: &utility, beyond_cost_cm };
        if task.obstacles.is_empty() {
            self.search(NUMBERS, &objective, seed, watch)
        } else {
            self.search(AVOIDING_NUMBERS, &objective, seed, watch)
        }
    }

    fn search(
        &self,
        numbers: usize,
        objective: &Objective<'_>,
        seed: u64,
        watch: &mut dyn FnMut(&RuleGeneration) -> ControlFlow<()>,
    ) -> Option<RuleSearchResult> {
        let origin = vec![0.0; numbers];
        let begin = |start: u32| {
            let seed = if start == 0 { seed } else { derive(seed, Purpose::Start, start.into()) };
            CmaEs::new(&origin, 1.0, self.population as usize, seed)
        };
        let mut searches: Vec<CmaEs> = (0..self.starts).map(begin).collect();
        // Sets of plants that the search itself does not steer.
        let fresh = self.generations / GENERATIONS_OF_PLANTS + 1;
        let choice_plants = CHOICE_FACTOR * self.episodes;
        let rounds = self.rounds();
        let mut candidates = Vec::new();
        let mut generation = 0;
        for round in 0..rounds {
            if round > 0 {
                let means: Vec<Vec<f64>> = searches.iter().map(|search| search.mean().to_vec()).collect();
                let trials = objective.utility(&means, fresh + 1 + round, choice_plants);
                searches = better_half(trials.iter().map(|trial| trial.mean).zip(searches).collect());
            }
            // Those of the last round count. The greedy rule is a candidate: what is chosen is not worse on the same plants.
            candidates.clear();
            candidates.push(origin.clone());
            let generations = part(self.generations, rounds, round);
            let count = searches.len() as u32;
            for (search, number) in searches.iter_mut().zip(0..) {
                for _ in 0..part(generations, count, number) {
                    let (best, heard) = self.generation(search, generation, objective);
                    let is_last_on_plants = (generation + 1).is_multiple_of(GENERATIONS_OF_PLANTS);
                    if is_last_on_plants || generation + 1 == self.generations || search.is_over() {
                        candidates.extend([best, search.mean().to_vec()]);
                    }
                    if search.is_over() {
                        *search = search.restarted();
                    }
                    if watch(&heard).is_break() {
                        return None;
                    }
                    generation += 1;
                }
            }
        }
        // Plants on which no candidate was tried before, and then further ones for the prediction.
        let choice = Choice::of(objective.utility(&candidates, fresh, choice_plants));
        let chosen = candidates.swap_remove(choice.run);
        let rule = rule_at(&chosen);
        let trials = objective.fitness(&[chosen, origin], fresh + 1, PREDICTION_PLANTS);
        Some(RuleSearchResult { rule, expected: trials[0], greedy: trials[1] })
    }

    /// Takes a search a generation further: the best point of the generation, and its report.
    fn generation(
        &self,
        search: &mut CmaEs,
        generation: u32,
        objective: &Objective<'_>,
    ) -> (Vec<f64>, RuleGeneration) {
        let mut points = search.ask();
        let trials = objective.utility(&points, generation / GENERATIONS_OF_PLANTS, self.episodes);
        let utility: Vec<f64> = trials.iter().map(|trial| trial.mean).collect();
        let best = statistics::index_of_greatest(&utility);
        search.tell(&points, &utility.iter().map(|utility| -utility).collect::<Vec<f64>>());
        let mean = statistics::mean(utility.iter().copied());
        (points.swap_remove(best), RuleGeneration { generation, best: utility[best], mean })
    }
}

/// The objective of the search. It hides model and task: the search is compiled once for all of them.
struct Objective<'a> {
    /// The fitness of trials, less a cost in cm for each step beyond all data.
    scores: &'a dyn Fn(&[RuleTrial], f64) -> Vec<f64>,
    /// What a fitness is worth.
    utility: &'a dyn Fn(f64) -> f64,
    /// Cost in cm of a step beyond all data.
    beyond_cost_cm: f64,
}

impl Objective<'_> {
    /// The fitness of each point on the first `plants` plants of a set; nothing costs.
    fn fitness(&self, points: &[Vec<f64>], set: u32, plants: u32) -> Vec<Trial> {
        self.worth(points, set, plants, 0.0, &|fitness| fitness)
    }

    /// The utility of each point on the first `plants` plants of a set; steps beyond all data cost.
    fn utility(&self, points: &[Vec<f64>], set: u32, plants: u32) -> Vec<Trial> {
        self.worth(points, set, plants, self.beyond_cost_cm, self.utility)
    }

    fn worth(
        &self,
        points: &[Vec<f64>],
        set: u32,
        plants: u32,
        beyond_cost_cm: f64,
        of: &dyn Fn(f64) -> f64,
    ) -> Vec<Trial> {
        let trial = |point, plant| RuleTrial { rule: rule_at(point), set, plant };
        let trials: Vec<RuleTrial> =
            points.iter().flat_map(|point| (0..plants).map(move |plant| trial(point, plant))).collect();
        let worths: Vec<f64> = (self.scores)(&trials, beyond_cost_cm).into_iter().map(of).collect();
        worths.chunks(plants as usize).map(Trial::of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_origin_is_greedy() {
        let neutral = PredictiveRule { look_ahead_cm: MIN_LOOK_AHEAD_CM, ..PredictiveRule::default() };
        assert_eq!(rule_at(&[0.0; NUMBERS]), neutral);
    }

    #[test]
    fn the_better_half_goes_on_and_generations_are_shared() {
        assert_eq!(better_half(vec![(1.0, 'a'), (f64::NEG_INFINITY, 'b'), (2.0, 'c')]), ['c', 'a']);
        assert_eq!([0, 1, 2].map(|number| part(10, 3, number)), [3, 3, 4]);
    }

    #[test]
    fn numbers_out_of_range_are_named() {
        RuleSearch::default().check().unwrap();
        let error = RuleSearch { population: 3, ..RuleSearch::default() }.check().unwrap_err().to_string();
        assert_eq!(error, "found population = 3, wanted 4 to 10000");
    }
}
