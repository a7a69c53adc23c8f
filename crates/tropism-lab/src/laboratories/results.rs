//! What a comparison of recipes found: the content of `laboratories.json`.

use serde::{Deserialize, Serialize};
use tropism::math::statistics::mean;
use tropism::task::Task;
use tropism_bean::tent::Greenhouse;

use super::{BOUND, CHASE, CONSTANT, LaboratoriesConfig, LaboratoriesPlan, World, controller_name};
use crate::Workflow;
use crate::statistics::interval_over_laboratories;
use crate::transfer::{ControllerResults, SeenTurns, Share, TransferResults};

/// A mean with its 95 % interval, by bootstrap over laboratories and plants.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeanAndInterval {
    /// Mean, in cm.
    pub mean: f64,
    /// Ends of the interval, in cm.
    pub interval: [f64; 2],
}

impl MeanAndInterval {
    /// Of the values of each laboratory on each plant.
    fn of(values: &[Vec<f64>], seed: u64) -> Self {
        Self {
            mean: mean(values.iter().map(|values| mean(values.iter().copied()))),
            interval: interval_over_laboratories(values, seed),
        }
    }
}

/// The comparison of recipes. Fitness is in cm; in turns where a stem is to wind round a pole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LaboratoriesResults {
    /// `tropism.laboratories/1`.
    pub schema: String,
    /// Version of the software.
    pub version: String,
    /// Always true.
    pub is_virtual: bool,
    /// Number of laboratories; 0 where the study has no recipes.
    pub laboratories: u32,
    /// Plants that judge the controllers of a world which names no other number.
    pub judging_plants: u32,
    /// One entry a world.
    pub worlds: Vec<WorldResults>,
}

/// All controllers of one world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorldResults {
    /// Its name.
    pub name: String,
    /// Species of the plants.
    pub species: String,
    /// Individual variation of the plants as a multiple of that of the species.
    pub scale: f64,
    /// Its task in a few words.
    #[serde(default)]
    pub task: String,
    /// Plants that judge the controllers.
    #[serde(default)]
    pub judging_plants: u32,
    /// Whether the judged tip is measured in photographs.
    #[serde(default)]
    pub photographs: bool,
    /// Greatest possible fitness.
    pub best_possible: Option<f64>,
    /// The dormant control: the left lamp stays lit.
    pub constant: BaselineResults,
    /// The greedy rule.
    pub chase: BaselineResults,
    /// The rule that was tuned on virtual plants themselves.
    pub bound: Option<BaselineResults>,
    /// One entry a recipe; none where the rules by hand alone are judged.
    pub recipes: Vec<RecipeResults>,
}

/// A controller that no laboratory makes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BaselineResults {
    /// Fitness over the plants.
    #[serde(flatten)]
    pub fitness: MeanAndInterval,
    /// Share of plants with a fitness under 6 cm.
    pub under_6: f64,
    /// Share of plants on which the whole task was done, where it says what that is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub done: Option<Share>,
    /// What the photographs alone say, where the truth of the tent is judged instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_photographs: Option<SeenTurns>,
    /// Median distance at the crossings of all targets, in cm; `None` if none was reached.
    pub median_cm: Option<f64>,
}

impl BaselineResults {
    fn of(one: &ControllerResults) -> Self {
        Self {
            fitness: MeanAndInterval { mean: one.mean, interval: one.interval },
            under_6: one.under_6,
            done: one.done,
            by_photographs: one.by_photographs.clone(),
            median_cm: one.median_cm,
        }
    }
}

/// A recipe in one world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecipeResults {
    /// Its name.
    pub name: String,
    /// Fitness over laboratories and plants.
    pub fitness: MeanAndInterval,
    /// Fitness minus that of the greedy rule on the same plants.
    pub over_chase: MeanAndInterval,
    /// Fitness minus that of the bound on the same plants.
    pub over_bound: Option<MeanAndInterval>,
    /// Fitness minus that of the first recipe of the same laboratory on the same plants; `None` for the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over_first: Option<MeanAndInterval>,
    /// Share of plants with a fitness under 6 cm.
    pub under_6: f64,
    /// Share of plants on which the whole task was done, as a mean over laboratories.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub done: Option<f64>,
    /// Median distance at the crossing of each target's height, in cm, as a mean over laboratories; `None` if no plant of one
    /// reached it.
    pub target_medians_cm: Vec<Option<f64>>,
    /// Fitness minus what the laboratory predicted, as a mean over laboratories; `None` where none is predicted.
    pub over_expected: Option<f64>,
    /// The greatest error of a prediction.
    pub worst_prediction: Option<f64>,
    /// Processor time of a laboratory after its tracks, in s, as a mean.
    pub cpu_seconds: f64,
    /// One entry a laboratory.
    pub laboratories: Vec<LaboratoryResults>,
}

/// The controller of one laboratory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LaboratoryResults {
    /// Fitness that the laboratory predicted.
    pub expected: Option<f64>,
    /// Mean fitness on the judging plants.
    pub mean: f64,
    /// 95 % interval of the mean, by bootstrap over the plants.
    pub interval: [f64; 2],
    /// Share of plants with a fitness under 6 cm.
    pub under_6: f64,
    /// Share of plants on which the whole task was done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub done: Option<Share>,
}

impl LaboratoriesResults {
    pub(super) fn new(config: &LaboratoriesConfig, worlds: Vec<WorldResults>) -> Self {
        Self {
            schema: LaboratoriesPlan::SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            is_virtual: true,
            laboratories: config.laboratories_at_work(),
            judging_plants: config.judging_plants,
            worlds,
        }
    }
}

impl WorldResults {
    /// `costs`: processor time of each recipe in each laboratory, recipes within laboratories.
    pub(super) fn new(
        config: &LaboratoriesConfig,
        world: &World,
        greenhouse: &Greenhouse,
        judged: &TransferResults,
        costs: &[f64],
        task: &Task,
    ) -> Self {
        let find = |name: &str| judged.controllers.iter().find(|one| one.name == name);
        let chase = find(CHASE).expect("the greedy rule is judged");
        let constant = find(CONSTANT).expect("the dormant control is judged");
        let bound = find(BOUND);
        let of_laboratories = |recipe| -> Vec<&ControllerResults> {
            let names = (0..config.laboratories).map(|laboratory| controller_name(recipe, laboratory));
            names.map(|name| find(&name).expect("each controller is judged")).collect()
        };
        let recipes = config.recipes.iter().enumerate().map(|(number, recipe)| {
            let own = of_laboratories(recipe);
            let first = (number > 0).then(|| of_laboratories(&config.recipes[0]));
            let costs = costs.iter().skip(number).step_by(config.recipes.len()).copied();
            RecipeResults::new(&recipe.name, &own, chase, bound, first.as_deref(), mean(costs), config.seed)
        });
        Self {
            name: world.name.clone(),
            species: greenhouse.bean.name.clone(),
            scale: world.scale,
            judging_plants: config.judging_plants_of(world),
            photographs: config.photographs_of(world),
            task: task.title(),
            best_possible: task.best_fitness(),
            constant: BaselineResults::of(constant),
            chase: BaselineResults::of(chase),
            bound: bound.map(BaselineResults::of),
            recipes: recipes.collect(),
        }
    }
}

impl RecipeResults {
    fn new(
        name: &str,
        of_laboratories: &[&ControllerResults],
        chase: &ControllerResults,
        bound: Option<&ControllerResults>,
        first: Option<&[&ControllerResults]>,
        cpu_seconds: f64,
        seed: u64,
    ) -> Self {
        let fitness: Vec<Vec<f64>> = of_laboratories.iter().map(|one| one.fitness.clone()).collect();
        // `others`: what each laboratory is compared with.
        let over = |others: &[&ControllerResults]| {
            let minus = |(own, other): (&Vec<f64>, &&ControllerResults)| {
                own.iter().zip(&other.fitness).map(|(own, other)| own - other).collect()
            };
            MeanAndInterval::of(&fitness.iter().zip(others).map(minus).collect::<Vec<_>>(), seed)
        };
        let over_one = |other| over(&vec![other; fitness.len()]);
        let errors: Option<Vec<f64>> =
            of_laboratories.iter().map(|one| Some(one.mean - one.expected?)).collect();
        let targets = chase.targets.len();
        let median = |target: usize| {
            let medians: Option<Vec<f64>> =
                of_laboratories.iter().map(|one| one.targets[target].median_cm).collect();
            medians.map(mean)
        };
        let laboratory = |one: &&ControllerResults| LaboratoryResults {
            expected: one.expected,
            mean: one.mean,
            interval: one.interval,
            under_6: one.under_6,
            done: one.done,
        };
        let done: Option<Vec<f64>> = of_laboratories.iter().map(|one| Some(one.done?.share)).collect();
        Self {
            name: name.to_owned(),
            done: done.map(mean),
            fitness: MeanAndInterval::of(&fitness, seed),
            over_chase: over_one(chase),
            over_bound: bound.map(over_one),
            over_first: first.map(over),
            under_6: mean(of_laboratories.iter().map(|one| one.under_6)),
            target_medians_cm: (0..targets).map(median).collect(),
            over_expected: errors.as_ref().map(|errors| mean(errors.iter().copied())),
            worst_prediction: errors
                .map(|errors| errors.iter().fold(0.0, |worst, error| f64::max(worst, error.abs()))),
            cpu_seconds,
            laboratories: of_laboratories.iter().map(laboratory).collect(),
        }
    }
}
