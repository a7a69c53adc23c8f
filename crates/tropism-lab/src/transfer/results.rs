//! The numbers of a comparison of controllers: per plant, per controller, and between controllers.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tropism::geometry::Point;
use tropism::math::statistics::{mean, quantile_linear, standard_deviation, wilson_interval};
use tropism::observation::Quality;
use tropism::task::{ARRIVAL_CM, Crossing, MISS_CM, Task};
use tropism::text::csv_cell;
use tropism::track::Track;

use super::TransferPlan;
use super::causes::{Approach, Cause, Evidence, Reference, Response};
use super::steer::TURNS_COLUMN;
use crate::Workflow;
use crate::model::Model;
use crate::statistics::{Bootstrap, PairedDifference};

/// The scores below which plants are counted, in cm: the paper's plants scored 9.96 on average, and greedy scores below 6 on
/// one in eight of the common beans.
const LOW_CM: [f64; 2] = [9.0, 6.0];

/// The quantiles of the scores, as shares.
const QUANTILES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// Quantile of the distances to a target beside the median.
const FAR: f64 = 0.9;

/// The comparison of controllers on the same virtual plants: the content of `transfer.json`. Fitness and distances are in cm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TransferResults {
    /// `tropism.transfer/1`.
    pub schema: String,
    /// Version of the software.
    pub version: String,
    /// Always true.
    pub is_virtual: bool,
    /// Species of the plants.
    pub species: String,
    /// Individual variation of the plants as a multiple of that of the species.
    pub variation: f64,
    /// Number of plants.
    pub plants: usize,
    /// Whether the tip was measured in photographs.
    pub photographs: bool,
    /// Seed of the plants, unless their seeds were given, and of the bootstrap.
    pub seed: u64,
    /// Whether each plant had a random sequence of targets of its own.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub random_targets: bool,
    /// Greatest possible fitness; with random targets, its mean over the plants. `None` where it is not known.
    pub best_possible: Option<f64>,
    /// One entry a controller, in the order of the plan.
    pub controllers: Vec<ControllerResults>,
    /// Differences between each two controllers on the same plants.
    pub pairs: Vec<ControllerPair>,
    /// The controller that stands for what a rule without knowledge of the future can reach.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<String>,
    /// Mean over the plants of what the search over schedules found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_optimum: Option<f64>,
    /// Plants on which a schedule was found that did all that the task wants, where it says what that is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub optimum_done: Option<Share>,
}

/// A controller on all plants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ControllerResults {
    /// Its name.
    pub name: String,
    /// A few words on it.
    pub description: String,
    /// Fitness on each plant, in the order of the plants.
    #[serde(default)]
    pub fitness: Vec<f64>,
    /// Mean fitness.
    pub mean: f64,
    /// 95 % interval of the mean, by bootstrap over the plants.
    pub interval: [f64; 2],
    /// Standard deviation over the plants.
    pub sd: f64,
    /// Quantiles over the plants: 5, 25, 50, 75 and 95 %.
    pub quantiles: [f64; 5],
    /// Share of plants with a fitness under 9 cm.
    pub under_9: f64,
    /// Share of plants with a fitness under 6 cm.
    pub under_6: f64,
    /// Fitness by both readings of eq. (9), to the letter and by approach; `None` for a task with another score.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub both_readings: Option<[OverPlants; 2]>,
    /// Fitness that its model predicts for unseen plants; `None` where the champion does not say.
    pub expected: Option<f64>,
    /// Mean over expected fitness.
    pub share_of_expected: Option<f64>,
    /// Mean over that of the reference controller.
    pub share_of_reference: Option<f64>,
    /// Mean over the mean optimum of the plants.
    pub share_of_optimum: Option<f64>,
    /// Median distance at the crossings of all targets that were reached, in cm; `None` if none was.
    #[serde(default)]
    pub median_cm: Option<f64>,
    /// What the photographs alone say, where the truth of the tent is judged instead: the turns of a stem round a pole, which
    /// hides its end from a camera for hours.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_photographs: Option<SeenTurns>,
    /// Plants that did all that the task wants, where it says what that is: for obstacles, to reach the targets and touch
    /// nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub done: Option<Share>,
    /// Whether each plant did so, in the order of the plants.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub is_done: Option<Vec<bool>>,
    /// How near the tip came to all targets together; `None` in a task without targets.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arrival: Option<ArrivalResults>,
    /// How near the tip came to each target.
    pub targets: Vec<TargetResults>,
    /// Likely causes of missed targets: their numbers.
    pub missed: BTreeMap<Cause, u32>,
    /// The same findings before targets that were reached: what is as frequent here is no cause.
    pub reached: BTreeMap<Cause, u32>,
}

/// A quantity on each plant, in cm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverPlants {
    /// Its values, in the order of the plants.
    pub values: Vec<f64>,
    /// Their mean.
    pub mean: f64,
    /// 95 % interval of the mean, by bootstrap over the plants.
    pub interval: [f64; 2],
}

impl OverPlants {
    fn of(values: Vec<f64>, bootstrap: &Bootstrap) -> Self {
        Self { mean: mean(values.iter().copied()), interval: bootstrap.interval_of_mean(&values), values }
    }

    /// `9.74 (9.23 to 10.24)`.
    #[must_use]
    pub fn in_words(&self) -> String {
        let [low, high] = self.interval;
        format!("{:.2} ({low:.2} to {high:.2})", self.mean)
    }
}

/// How near the tip came to all targets together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArrivalResults {
    /// Sum of the distances at the crossings of all targets, each 10 cm at most, and 10 cm for one whose height was never reached.
    pub sum: OverPlants,
    /// Share of plants that pass all targets within 1 cm.
    pub within_1_cm: Share,
    /// Share of plants that pass all targets within 0.5 cm.
    pub within_half_cm: Share,
    /// The sum less that of the first controller, on the same plants; `None` for the first one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over_first: Option<PairedDifference>,
}

/// Turns of stems as the photographs say.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeenTurns {
    /// Turns of each plant, in the order of the plants.
    pub fitness: Vec<f64>,
    /// Mean over the plants.
    pub mean: f64,
    /// Share of plants with all turns that the task wants; `None` where a stem was never seen in space.
    pub done: Option<Share>,
}

/// A share of plants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// The share, 0 to 1.
    pub share: f64,
    /// Its 95 % interval (Wilson).
    pub interval: [f64; 2],
}

impl Share {
    /// The share of those that are true.
    pub(super) fn of(all: &[bool]) -> Self {
        let (count, of) = (all.iter().filter(|is_true| **is_true).count() as f64, all.len() as f64);
        Self { share: count / of, interval: wilson_interval(count, of) }
    }

    /// `39 % (29 to 49)`.
    pub(crate) fn in_words(&self) -> String {
        let [low, high] = self.interval.map(|share| 100.0 * share);
        format!("{:.0} % ({low:.0} to {high:.0})", 100.0 * self.share)
    }
}

/// How near the tips of all plants came to a target at its height.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TargetResults {
    /// The target as the front camera sees it; `None` if each plant had its own, or what is measured is a form.
    pub target: Option<Point>,
    /// Median distance at the crossing of its height, of the plants that reached it; `None` if none did.
    pub median_cm: Option<f64>,
    /// 90 % quantile of the same.
    pub far_cm: Option<f64>,
    /// Plants that missed it: farther than 1 cm at its height, or never so high.
    pub missed: u32,
    /// Plants that never reached its height.
    pub never: u32,
}

/// Two controllers on the same plants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ControllerPair {
    /// The first controller.
    pub one: String,
    /// The second controller.
    pub other: String,
    /// Fitness of the first minus that of the second.
    pub difference: PairedDifference,
}

/// One plant under one controller.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PlantResult {
    pub(super) fitness: f64,
    /// The fitness by both readings of eq. (9), for a task that is scored by it.
    pub(super) both_readings: Option<[f64; 2]>,
    pub(super) steps: u32,
    /// Steps at which the tip was carried forward.
    pub(super) carried_forward: usize,
    pub(super) final_height_cm: f64,
    pub(super) is_done: Option<bool>,
    /// Fitness and whether the task was done as the photographs say, where the truth is judged instead.
    pub(super) by_photographs: Option<(f64, Option<bool>)>,
    /// For each target where the tip crossed its height, and what is found in the steps before.
    pub(super) targets: Vec<(Option<Crossing>, Cause)>,
}

/// What is possible on one plant, all its noise known: a lower reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Optimum {
    pub(super) fitness: f64,
    pub(super) is_done: Option<bool>,
}

impl Optimum {
    /// Counts what a controller reached on the same plant: it is possible, too.
    pub(super) fn raise(&mut self, reached: &PlantResult) {
        self.fitness = self.fitness.max(reached.fitness);
        self.is_done = self.is_done.map(|is_done| is_done || reached.is_done == Some(true));
    }
}

/// With what plants are compared to find causes.
pub(super) struct Judge<'j> {
    pub(super) reference: &'j Reference,
    pub(super) model: Option<&'j Model>,
}

impl Judge<'_> {
    /// Judges the track of a plant that responds as `response`.
    pub(super) fn judge(&self, track: &Track, task: &Task, response: &Response) -> PlantResult {
        let last = track.samples.last();
        let steps = last.map_or(0, |sample| sample.step);
        let mut from = 0;
        let targets = task.crossings(track).into_iter().map(|crossing| {
            let approach = Approach { from, to: crossing.map_or(steps, |crossing| crossing.step) };
            from = crossing.map_or(from, |crossing| crossing.step);
            let evidence = Evidence::of(track, approach, self.model);
            (crossing, self.reference.cause(response, approach, evidence))
        });
        let seen = (task.fitness(track), task.is_done(track));
        let truth = true_turns(track, task);
        let (fitness, is_done) = truth.unwrap_or(seen);
        PlantResult {
            targets: targets.collect(),
            fitness,
            both_readings: task.both_readings(track),
            by_photographs: truth.map(|_| seen),
            steps,
            carried_forward: track
                .samples
                .iter()
                .filter(|sample| sample.quality == Quality::CarriedForward)
                .count(),
            final_height_cm: last.map_or(0.0, |sample| sample.tip.y),
            is_done,
        }
    }
}

/// The best fitness there can be of a virtual bean, which stands upright above its root wherever the task starts.
fn best_of_bean(task: &Task) -> Option<f64> {
    Task { start: Point::new(0.0, task.start.y), ..task.clone() }.best_fitness()
}

/// Turns of the true stem, and whether they are all that the task wants; `None` of a track without the truth.
fn true_turns(track: &Track, task: &Task) -> Option<(f64, Option<bool>)> {
    task.pole?;
    let turns = track.numbers(TURNS_COLUMN)?;
    let known: Vec<f64> = turns.into_iter().filter(|turns| turns.is_finite()).map(f64::abs).collect();
    let (first, last) = (known.first()?, known.last()?);
    Some((last - first, Some(*last >= task.turns)))
}

/// All plants under all controllers: one list a controller, one result a plant; and the task and the optimum of each plant.
pub(super) struct Scores {
    pub(super) tasks: Vec<Task>,
    pub(super) plants: Vec<Vec<PlantResult>>,
    pub(super) optima: Option<Vec<Optimum>>,
}

impl Scores {
    /// The fitness of controller `number` on each plant.
    pub(super) fn fitness(&self, number: usize) -> Vec<f64> {
        self.plants[number].iter().map(|plant| plant.fitness).collect()
    }

    /// The numbers of a plan.
    pub(super) fn results(&self, plan: &TransferPlan) -> TransferResults {
        let seeds = plan.seeds().len();
        let bootstrap = Bootstrap::new(plan.seed, seeds);
        let number_of = |name: &String| plan.controllers.iter().position(|one| one.name == *name);
        let reference = plan.reference.as_ref().and_then(number_of).map(|number| mean(self.fitness(number)));
        let mean_of = |optima: &Vec<Optimum>| mean(optima.iter().map(|optimum| optimum.fitness));
        let mean_optimum = self.optima.as_ref().map(mean_of);
        let done_of = |optima: &Vec<Optimum>| optima.iter().map(|optimum| optimum.is_done).collect();
        let optima_done: Option<Vec<bool>> = self.optima.as_ref().and_then(done_of);
        let controllers = (0..plan.controllers.len()).map(|number| {
            let mut results = self.controller(plan, number, &bootstrap);
            results.share_of_reference = share(results.mean, reference);
            results.share_of_optimum = share(results.mean, mean_optimum);
            results
        });
        TransferResults {
            schema: TransferPlan::SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            is_virtual: true,
            species: plan.greenhouse.bean.name.clone(),
            variation: plan.greenhouse.variation,
            plants: seeds,
            photographs: plan.photographs,
            seed: plan.seed,
            random_targets: plan.random_targets,
            best_possible: self.tasks.iter().map(best_of_bean).collect::<Option<Vec<f64>>>().map(mean),
            controllers: controllers.collect(),
            pairs: self.pairs(plan, &bootstrap),
            reference: plan.reference.clone(),
            mean_optimum,
            optimum_done: optima_done.map(|done| Share::of(&done)),
        }
    }

    fn controller(&self, plan: &TransferPlan, number: usize, bootstrap: &Bootstrap) -> ControllerResults {
        let (named, fitness) = (&plan.controllers[number], self.fitness(number));
        // What a model predicted for one task says nothing about others.
        let is_own = named.controller.own_task().is_none_or(|own| *own == plan.task);
        let expected = named.controller.expected().filter(|_| is_own && !plan.random_targets);
        let expected = expected.map(|trial| trial.mean);
        let under = |limit| mean(fitness.iter().map(|&score| f64::from(u8::from(score < limit))));
        let (mut missed, mut reached) = (BTreeMap::new(), BTreeMap::new());
        for &(crossing, cause) in self.plants[number].iter().flat_map(|plant| &plant.targets) {
            let counts = if Crossing::is_visit(crossing) { &mut reached } else { &mut missed };
            *counts.entry(cause).or_insert(0) += 1;
        }
        let mean = mean(fitness.iter().copied());
        let is_done: Option<Vec<bool>> = self.plants[number].iter().map(|plant| plant.is_done).collect();
        ControllerResults {
            name: named.name.clone(),
            description: named.controller.description(),
            mean,
            interval: bootstrap.interval_of_mean(&fitness),
            sd: standard_deviation(&fitness),
            quantiles: QUANTILES.map(|share| quantile_linear(&fitness, share)),
            under_9: under(LOW_CM[0]),
            under_6: under(LOW_CM[1]),
            both_readings: self.both_readings(number, bootstrap),
            expected,
            share_of_expected: share(mean, expected),
            share_of_reference: None,
            share_of_optimum: None,
            median_cm: {
                let targets = self.plants[number].iter().flat_map(|plant| &plant.targets);
                quantile_of(targets.filter_map(|(crossing, _)| *crossing), 0.5)
            },
            done: is_done.as_deref().map(Share::of),
            is_done,
            by_photographs: self.by_photographs(number),
            arrival: self.arrival(number, bootstrap),
            targets: self.targets(plan, number),
            missed,
            reached,
            fitness,
        }
    }

    fn both_readings(&self, number: usize, bootstrap: &Bootstrap) -> Option<[OverPlants; 2]> {
        let readings: Option<Vec<_>> = self.plants[number].iter().map(|plant| plant.both_readings).collect();
        let readings = readings?;
        Some([0, 1].map(|one| OverPlants::of(readings.iter().map(|both| both[one]).collect(), bootstrap)))
    }

    fn by_photographs(&self, number: usize) -> Option<SeenTurns> {
        let seen: Option<Vec<_>> = self.plants[number].iter().map(|plant| plant.by_photographs).collect();
        let seen = seen?;
        let fitness: Vec<f64> = seen.iter().map(|(fitness, _)| *fitness).collect();
        let done: Option<Vec<bool>> = seen.iter().map(|(_, is_done)| *is_done).collect();
        Some(SeenTurns {
            mean: mean(fitness.iter().copied()),
            fitness,
            done: done.map(|done| Share::of(&done)),
        })
    }

    fn arrival(&self, number: usize, bootstrap: &Bootstrap) -> Option<ArrivalResults> {
        let distances = |number: usize, plant: usize| {
            let targets = self.plants[number][plant].targets.iter();
            targets.map(|(crossing, _)| crossing.map_or(f64::INFINITY, |at| at.distance_cm))
        };
        let plants = self.plants[number].len();
        let sums = |number: usize| {
            let sum = |plant| distances(number, plant).map(|cm| cm.min(ARRIVAL_CM)).sum();
            (0..plants).map(sum).collect::<Vec<f64>>()
        };
        let within = |limit_cm| {
            let all = |plant| distances(number, plant).all(|cm| cm <= limit_cm);
            Share::of(&(0..plants).map(all).collect::<Vec<bool>>())
        };
        let has_targets = self.tasks.first().is_some_and(|task| !task.targets.is_empty());
        has_targets.then(|| ArrivalResults {
            sum: OverPlants::of(sums(number), bootstrap),
            within_1_cm: within(MISS_CM),
            within_half_cm: within(0.5 * MISS_CM),
            over_first: (number > 0).then(|| bootstrap.compare(&sums(number), &sums(0))),
        })
    }

    fn targets(&self, plan: &TransferPlan, number: usize) -> Vec<TargetResults> {
        let points = &plan.task.targets;
        let of_target = |place: usize| {
            let target = points.get(place).copied().filter(|_| !plan.random_targets);
            let crossings: Vec<Option<Crossing>> =
                self.plants[number].iter().map(|plant| plant.targets[place].0).collect();
            let quantile = |share| quantile_of(crossings.iter().flatten().copied(), share);
            TargetResults {
                target,
                median_cm: quantile(0.5),
                far_cm: quantile(FAR),
                missed: crossings.iter().filter(|crossing| !Crossing::is_visit(**crossing)).count() as u32,
                never: crossings.iter().filter(|crossing| crossing.is_none()).count() as u32,
            }
        };
        (0..self.plants[number].first().map_or(0, |plant| plant.targets.len())).map(of_target).collect()
    }

    fn pairs(&self, plan: &TransferPlan, bootstrap: &Bootstrap) -> Vec<ControllerPair> {
        let fitness: Vec<Vec<f64>> = (0..plan.controllers.len()).map(|number| self.fitness(number)).collect();
        let mut pairs = Vec::new();
        for (other, theirs) in fitness.iter().enumerate() {
            for (one, ours) in fitness[..other].iter().enumerate() {
                pairs.push(ControllerPair {
                    one: plan.controllers[one].name.clone(),
                    other: plan.controllers[other].name.clone(),
                    difference: bootstrap.compare(ours, theirs),
                });
            }
        }
        pairs
    }

    /// `plants.csv`: one row a plant and controller.
    pub(super) fn csv(&self, plan: &TransferPlan) -> Result<Vec<u8>, csv::Error> {
        let mut table = csv::Writer::from_writer(Vec::new());
        let count = self.plants.iter().flatten().next().map_or(0, |plant| plant.targets.len());
        let of_targets = (1..=count).flat_map(|target| {
            ["x_cm", "y_cm", "step", "distance_cm", "missed", "cause"]
                .map(|what| format!("target_{target}_{what}"))
        });
        let head = ["controller", "plant", "seed", "fitness_cm", "optimum_cm", "share_of_optimum"];
        let further = ["steps", "carried_forward", "final_height_cm", "is_done", "turns_by_photographs"];
        table.write_record(head.into_iter().chain(further).map(str::to_owned).chain(of_targets))?;
        for (named, plants) in plan.controllers.iter().zip(&self.plants) {
            for (number, (plant, seed)) in plants.iter().zip(plan.seeds()).enumerate() {
                let optimum = self.optima.as_ref().map(|optima| optima[number].fitness);
                let start = [
                    csv_cell(&named.name).into_owned(),
                    (number + 1).to_string(),
                    seed.to_string(),
                    plant.fitness.to_string(),
                    or_empty(optimum),
                    or_empty(share(plant.fitness, optimum)),
                    plant.steps.to_string(),
                    plant.carried_forward.to_string(),
                    plant.final_height_cm.to_string(),
                    plant.is_done.map_or_else(String::new, |is_done| is_done.to_string()),
                    or_empty(plant.by_photographs.map(|(turns, _)| turns)),
                ];
                let places = &self.tasks[number].targets;
                let targets = plant.targets.iter().enumerate().flat_map(|(number, &(crossing, cause))| {
                    let (is_missed, place) = (!Crossing::is_visit(crossing), places.get(number));
                    [
                        or_empty(place.map(|place| place.x)),
                        or_empty(place.map(|place| place.y)),
                        crossing.map_or_else(String::new, |crossing| crossing.step.to_string()),
                        or_empty(crossing.map(|crossing| crossing.distance_cm)),
                        is_missed.to_string(),
                        if is_missed { cause.words().to_owned() } else { String::new() },
                    ]
                });
                table.write_record(start.into_iter().chain(targets))?;
            }
        }
        table.into_inner().map_err(|error| error.into_error().into())
    }
}

/// A quantile of the distances at some crossings, in cm; `None` of none.
fn quantile_of(crossings: impl Iterator<Item = Crossing>, share: f64) -> Option<f64> {
    let distances: Vec<f64> = crossings.map(|crossing| crossing.distance_cm).collect();
    (!distances.is_empty()).then(|| quantile_linear(&distances, share))
}

/// `part` over `whole`; `None` unless the whole is above zero.
fn share(part: f64, whole: Option<f64>) -> Option<f64> {
    whole.filter(|&whole| whole > 0.0).map(|whole| part / whole)
}

/// A number as text, or nothing.
fn or_empty(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_controller_reached_is_possible() {
        let mut optimum = Optimum { fitness: -0.5, is_done: Some(false) };
        optimum.raise(&PlantResult { is_done: Some(true), ..plant(1.9, [None; 3]) });
        optimum.raise(&PlantResult { is_done: Some(false), ..plant(-3.0, [None; 3]) });
        assert_eq!(optimum, Optimum { fitness: 1.9, is_done: Some(true) });
    }

    fn plant(fitness: f64, distances: [Option<f64>; 3]) -> PlantResult {
        let target = |distance: Option<f64>| {
            let crossing = distance.map(|distance_cm| Crossing { step: 9, distance_cm });
            (crossing, Cause::WeakResponse)
        };
        PlantResult {
            fitness,
            both_readings: None,
            steps: 30,
            carried_forward: 0,
            final_height_cm: 14.0,
            is_done: None,
            by_photographs: None,
            targets: distances.map(target).to_vec(),
        }
    }

    #[test]
    fn numbers_follow_from_plants() {
        let plan =
            TransferPlan { plants: 2, reference: Some("greedy".to_owned()), ..TransferPlan::default() };
        let near = [Some(0.2), Some(1.5), None];
        let scores = Scores {
            tasks: vec![plan.task.clone(); plan.seeds().len()],
            plants: vec![vec![plant(10.0, near), plant(8.0, [Some(0.4); 3])], vec![plant(5.0, near); 2]],
            optima: Some(vec![Optimum { fitness: 12.0, is_done: None }; 2]),
        };
        let results = scores.results(&plan);
        let [greedy, periodic] = &results.controllers[..] else { panic!() };
        assert_eq!((greedy.mean, greedy.under_9, greedy.under_6, greedy.quantiles[2]), (9.0, 0.5, 0.0, 9.0));
        assert_eq!((greedy.share_of_reference, greedy.share_of_optimum), (Some(1.0), Some(0.75)));
        assert_eq!((periodic.share_of_reference, periodic.under_6), (Some(5.0 / 9.0), 1.0));
        assert_eq!(
            (greedy.targets[1].missed, greedy.targets[2].never, greedy.targets[2].median_cm),
            (1, 1, Some(0.4))
        );
        assert_eq!((greedy.missed[&Cause::WeakResponse], greedy.reached[&Cause::WeakResponse]), (2, 4));
        let arrivals: Vec<_> = results.controllers.iter().map(|one| one.arrival.as_ref().unwrap()).collect();
        // 0.2, 1.5 and a height that was never reached; 0.4 three times.
        assert!((arrivals[0].sum.mean - (11.7 + 1.2) / 2.0).abs() < 1e-12);
        assert_eq!((arrivals[0].within_1_cm.share, arrivals[1].within_half_cm.share), (0.5, 0.0));
        let over = arrivals[1].over_first.as_ref().unwrap();
        assert!(arrivals[0].over_first.is_none() && (over.mean - 5.25).abs() < 1e-12);
        assert_eq!((results.optimum_done, results.pairs.len()), (None, 1));
        assert_eq!((results.pairs[0].difference.mean, results.pairs[0].difference.share_above), (4.0, 1.0));
        let csv = String::from_utf8(scores.csv(&plan).unwrap()).unwrap();
        let rows: Vec<&str> = csv.lines().collect();
        assert_eq!(rows.len(), 5);
        assert!(
            rows[0]
                .ends_with("target_3_y_cm,target_3_step,target_3_distance_cm,target_3_missed,target_3_cause")
        );
        assert!(rows[1].ends_with(",true,weak response"), "{}", rows[1]);
        assert!(rows[1].contains(",-1,13.5,"), "{}", rows[1]);
        let json = serde_json::to_string(&results).unwrap();
        assert_eq!(serde_json::from_str::<TransferResults>(&json).unwrap(), results);
    }
}
