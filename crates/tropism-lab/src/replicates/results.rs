//! What a comparison of methods found: the content of `replicates.json`.

use serde::{Deserialize, Serialize};
use tropism::math::statistics::mean;
use tropism::task::Task;
use tropism_bean::tent::Greenhouse;

use super::{CONSTANT, GREEDY, REFERENCE, ReplicatesConfig, ReplicatesPlan, Scenario, controller_name};
use crate::Workflow;
use crate::statistics::interval_over_replicates;
use crate::transfer::{ControllerResults, SeenTurns, TransferResults};

/// A mean with its 95 % interval, by bootstrap over replicates and plants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeanAndInterval {
    /// Mean.
    pub mean: f64,
    /// Ends of the interval.
    pub interval: [f64; 2],
}

impl MeanAndInterval {
    /// Of the values of each replicate on each plant.
    fn of(values: &[Vec<f64>], seed: u64) -> Self {
        Self {
            mean: mean(values.iter().map(|values| mean(values.iter().copied()))),
            interval: interval_over_replicates(values, seed),
        }
    }
}

/// What controllers are compared by: means over replicates and plants, or their differences from other controllers, replicate by
/// replicate and plant by plant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// Fitness by the task's own score.
    pub fitness: MeanAndInterval,
    /// Fitness by eq. (9) to the letter, in cm; `None` for a task with another score.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_the_letter: Option<MeanAndInterval>,
    /// Fitness by eq. (9) by approach, in cm; `None` for a task with another score.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_approach: Option<MeanAndInterval>,
    /// Sum of the distances at the crossings of all targets, in cm, 10 for one whose height was never reached; `None` without
    /// targets.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distances: Option<MeanAndInterval>,
    /// Share of plants on which the whole task was done, where it says what that is: with the paper's targets, that the tip
    /// passes all of them within 1 cm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub done: Option<MeanAndInterval>,
}

impl Measures {
    /// Of the controller of each replicate; less those of `others`, if there are any.
    fn of(own: &[&ControllerResults], others: Option<&[&ControllerResults]>, seed: u64) -> Self {
        let measure = |values: fn(&ControllerResults) -> Option<Vec<f64>>| {
            let mut own: Vec<Vec<f64>> = own.iter().map(|one| values(one)).collect::<Option<_>>()?;
            for (own, other) in own.iter_mut().zip(others.into_iter().flatten()) {
                own.iter_mut().zip(values(other)?).for_each(|(own, other)| *own -= other);
            }
            Some(MeanAndInterval::of(&own, seed))
        };
        Self {
            fitness: measure(|one| Some(one.fitness.clone())).expect("each controller has a fitness"),
            to_the_letter: measure(|one| Some(one.both_readings.as_ref()?[0].values.clone())),
            by_approach: measure(|one| Some(one.both_readings.as_ref()?[1].values.clone())),
            distances: measure(|one| Some(one.arrival.as_ref()?.sum.values.clone())),
            done: measure(|one| Some(one.is_done.as_ref()?.iter().map(|&done| f64::from(done)).collect())),
        }
    }
}

/// The comparison of methods. Fitness is in cm; in turns where a stem is to wind round a pole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReplicatesResults {
    /// `tropism.replicates/1`.
    pub schema: String,
    /// Version of the software.
    pub version: String,
    /// Always true.
    pub is_virtual: bool,
    /// Number of replicates; 0 where the study has no methods.
    pub replicates: u32,
    /// Plants that judge the controllers of a scenario which names no other number.
    pub test_plants: u32,
    /// One entry a scenario.
    pub scenarios: Vec<ScenarioResults>,
}

/// All controllers of one scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScenarioResults {
    /// Its name.
    pub name: String,
    /// Species of the plants.
    pub species: String,
    /// Individual variation of the plants as a multiple of that of the species.
    pub variation: f64,
    /// Its task in a few words.
    #[serde(default)]
    pub task: String,
    /// Plants that judge the controllers.
    #[serde(default)]
    pub test_plants: u32,
    /// Whether the judged tip is measured in photographs.
    #[serde(default)]
    pub photographs: bool,
    /// Greatest possible fitness.
    pub best_possible: Option<f64>,
    /// The dormant control: the left lamp stays lit.
    pub constant: BaselineResults,
    /// The greedy rule.
    pub greedy: BaselineResults,
    /// The rule that was tuned on virtual plants themselves.
    pub reference: Option<BaselineResults>,
    /// One entry a method; none where the rules by hand alone are judged.
    pub methods: Vec<MethodResults>,
}

/// A controller that no replicate makes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaselineResults {
    /// Over the plants.
    #[serde(flatten)]
    pub measures: Measures,
    /// What the photographs alone say, where the truth of the tent is judged instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_photographs: Option<SeenTurns>,
    /// Median distance at the crossing of each target's height, in cm; `None` if no plant reached it.
    pub target_medians_cm: Vec<Option<f64>>,
}

impl BaselineResults {
    fn of(one: &ControllerResults, seed: u64) -> Self {
        Self {
            measures: Measures::of(&[one], None, seed),
            by_photographs: one.by_photographs.clone(),
            target_medians_cm: one.targets.iter().map(|target| target.median_cm).collect(),
        }
    }
}

/// A method in one scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodResults {
    /// Its name.
    pub name: String,
    /// Over replicates and plants.
    #[serde(flatten)]
    pub measures: Measures,
    /// Less those of the greedy controller on the same plants.
    pub over_greedy: Measures,
    /// Less those of the reference controller on the same plants.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over_reference: Option<Measures>,
    /// Less those of the first method of the same replicate on the same plants; `None` for the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over_first: Option<Measures>,
    /// Median distance at the crossing of each target's height, in cm, as a mean over replicates; `None` if no plant of one
    /// reached it.
    pub target_medians_cm: Vec<Option<f64>>,
    /// Fitness minus what the replicate predicted, as a mean over replicates; `None` where none is predicted.
    pub over_expected: Option<f64>,
    /// The greatest error of a prediction.
    pub worst_prediction: Option<f64>,
    /// Processor time of a replicate after its tracks, in s, as a mean.
    pub cpu_seconds: f64,
    /// One entry a replicate.
    pub replicates: Vec<ReplicateResults>,
}

/// The controller of one replicate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReplicateResults {
    /// Fitness that the replicate predicted.
    pub expected: Option<f64>,
    /// Over the plants.
    #[serde(flatten)]
    pub measures: Measures,
}

impl ReplicatesResults {
    pub(super) fn new(config: &ReplicatesConfig, scenarios: Vec<ScenarioResults>) -> Self {
        Self {
            schema: ReplicatesPlan::SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            is_virtual: true,
            replicates: config.replicates_at_work(),
            test_plants: config.test_plants,
            scenarios,
        }
    }
}

impl ScenarioResults {
    /// `costs`: processor time of each method in each replicate, methods within replicates.
    pub(super) fn new(
        config: &ReplicatesConfig,
        scenario: &Scenario,
        greenhouse: &Greenhouse,
        judged: &TransferResults,
        costs: &[f64],
        task: &Task,
    ) -> Self {
        let find = |name: &str| judged.controllers.iter().find(|one| one.name == name);
        let greedy = find(GREEDY).expect("the greedy rule is judged");
        let constant = find(CONSTANT).expect("the dormant control is judged");
        let reference = find(REFERENCE);
        let of_replicates = |method| -> Vec<&ControllerResults> {
            let names = (0..config.replicates).map(|replicate| controller_name(method, replicate));
            names.map(|name| find(&name).expect("each controller is judged")).collect()
        };
        let methods = config.methods.iter().enumerate().map(|(number, method)| {
            let own = of_replicates(method);
            let first = (number > 0).then(|| of_replicates(&config.methods[0]));
            let costs = costs.iter().skip(number).step_by(config.methods.len()).copied();
            MethodResults::new(
                &method.name,
                &own,
                greedy,
                reference,
                first.as_deref(),
                mean(costs),
                config.seed,
            )
        });
        Self {
            name: scenario.name.clone(),
            species: greenhouse.bean.name.clone(),
            variation: scenario.variation,
            test_plants: config.test_plants_of(scenario),
            photographs: config.photographs_of(scenario),
            task: task.title(),
            best_possible: task.best_fitness(),
            constant: BaselineResults::of(constant, config.seed),
            greedy: BaselineResults::of(greedy, config.seed),
            reference: reference.map(|one| BaselineResults::of(one, config.seed)),
            methods: methods.collect(),
        }
    }
}

impl MethodResults {
    fn new(
        name: &str,
        of_replicates: &[&ControllerResults],
        greedy: &ControllerResults,
        reference: Option<&ControllerResults>,
        first: Option<&[&ControllerResults]>,
        cpu_seconds: f64,
        seed: u64,
    ) -> Self {
        let over = |others: &[&ControllerResults]| Measures::of(of_replicates, Some(others), seed);
        let over_one = |other| over(&vec![other; of_replicates.len()]);
        let errors: Option<Vec<f64>> =
            of_replicates.iter().map(|one| Some(one.mean - one.expected?)).collect();
        let targets = greedy.targets.len();
        let median = |target: usize| {
            let medians: Option<Vec<f64>> =
                of_replicates.iter().map(|one| one.targets[target].median_cm).collect();
            medians.map(mean)
        };
        let replicate = |one: &&ControllerResults| ReplicateResults {
            expected: one.expected,
            measures: Measures::of(&[one], None, seed),
        };
        Self {
            name: name.to_owned(),
            measures: Measures::of(of_replicates, None, seed),
            over_greedy: over_one(greedy),
            over_reference: reference.map(over_one),
            over_first: first.map(over),
            target_medians_cm: (0..targets).map(median).collect(),
            over_expected: errors.as_ref().map(|errors| mean(errors.iter().copied())),
            worst_prediction: errors
                .map(|errors| errors.iter().fold(0.0, |worst, error| f64::max(worst, error.abs()))),
            cpu_seconds,
            replicates: of_replicates.iter().map(replicate).collect(),
        }
    }
}
