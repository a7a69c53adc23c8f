//! Where a champion is chosen, and what it carries: network, sensors, task and the digest of its model.

use serde::{Deserialize, Serialize};
use tropism_neat::{Genome, GenomeError};

use crate::control::{Controller, Dimming, Interface, NetworkController, Sensors, ShapeError};
use crate::file::{sha256, without_schema};
use crate::lamps::Layout;
use crate::math::statistics;
use crate::plant::PlantModel;
use crate::random::{NoiseStream, Purpose};
use crate::simulation::{BatchModel, Episode, fitness_of};
use crate::task::Task;
use crate::track::PAPER_PERIOD_MIN;

/// Fitness of a controller on simulated plants on which it did not evolve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Mean fitness, in cm.
    pub mean: f64,
    /// Standard deviation of the fitness, in cm.
    pub sd: f64,
    /// Plants.
    pub plants: u32,
}

impl Trial {
    /// Mean and standard deviation of the fitness of each plant; NaN of none.
    #[must_use]
    pub fn of(scores: &[f64]) -> Self {
        Self {
            mean: statistics::mean(scores.iter().copied()),
            sd: statistics::standard_deviation(scores),
            plants: scores.len() as u32,
        }
    }
}

/// Which of several champions goes on to a real plant, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Number of the run whose champion is chosen, from 0.
    pub run: usize,
    /// The trial of each run's champion, in order.
    pub trials: Vec<Trial>,
}

impl Choice {
    /// Chooses the highest mean; of equals the first.
    ///
    /// # Panics
    /// Without trials.
    #[must_use]
    pub fn of(trials: Vec<Trial>) -> Self {
        assert!(!trials.is_empty(), "at least one champion");
        let means: Vec<f64> = trials.iter().map(|trial| trial.mean).collect();
        let run = statistics::index_of_greatest(&means);
        Self { run, trials }
    }
}

/// Share of steps without data from which on no fitness is expected; chosen by hand.
const MOST_WITHOUT_DATA: f64 = 0.5;

/// Why fitness on models of so many single plants, in which a controller meets so large a share of steps without data (0 to 1), is no
/// expectation for unseen plants; `None` where it is one.
#[must_use]
pub fn reason_to_withhold(plants: usize, without_data: f64) -> Option<String> {
    if plants < 2 {
        return Some("the model is of one plant, which does not tell how plants differ".to_owned());
    }
    (without_data > MOST_WITHOUT_DATA)
        .then(|| format!("the model has no data in {:.0} % of the steps", 100.0 * without_data))
}

/// Tries a controller on `plants` fresh plants of each of `models`, the same plants for every controller under one `seed`.
/// `build` makes the controller anew, at rest, for each plant.
///
/// On the model of its evolution this averages over growth noise, of which the best fitness of a single evaluation is a
/// lucky draw. On [models of single plants](crate::plant::FittedModel::of_each_plant) it estimates transfer: the pooled
/// model moves like an average plant, more regularly than any single one.
///
/// Without models or plants, mean and standard deviation are NaN.
#[must_use]
pub fn trial<'m, M: PlantModel + 'm, C: Controller>(
    models: impl IntoIterator<Item = &'m M>,
    task: &Task,
    build: impl Fn() -> C,
    seed: u64,
    plants: u32,
) -> Trial {
    trial_by(models, seed, plants, |model, noises| {
        noises.map(|noise| fitness_of(model, &mut build(), task, noise)).collect()
    })
}

/// [`trial`] of the controller that `genome` describes, by the models' batched path: the same figures, to the bit.
///
/// # Panics
/// If the genome has not the shape of the sensors and the models' lamps.
#[must_use]
pub fn trial_of_genome<'m, M: BatchModel + 'm>(
    models: impl IntoIterator<Item = &'m M>,
    task: &Task,
    interface: Interface<'_>,
    genome: &Genome,
    seed: u64,
    plants: u32,
) -> Trial {
    trial_by(models, seed, plants, |model, noises| {
        model.score(task, interface, noises.map(|noise| Episode { controller: genome, noise }))
    })
}

/// [`trial`] by `score`, the fitness of a plant of a model for each stream of noise.
fn trial_by<'m, M: 'm>(
    models: impl IntoIterator<Item = &'m M>,
    seed: u64,
    plants: u32,
    score: impl Fn(&M, &mut dyn Iterator<Item = NoiseStream>) -> Vec<f64>,
) -> Trial {
    let scores: Vec<f64> = (0..)
        .zip(models)
        .flat_map(|(number, model)| {
            let noise = |plant| NoiseStream::new(seed, Purpose::Trial, [plant, number, 0]);
            score(model, &mut (0..plants).map(noise))
        })
        .collect();
    Trial::of(&scores)
}

/// What a champion file calls itself.
const SCHEMA: &str = "tropism.champion/1";

/// An evolved controller with all that it was evolved for: it steers as it did in evolution wherever the file goes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Champion {
    /// What the network sees.
    #[serde(default)]
    pub sensors: Sensors,
    /// How it lights the lamps.
    #[serde(default, skip_serializing_if = "Dimming::is_switch")]
    pub dimming: Dimming,
    /// The lamps that it lights.
    #[serde(default)]
    pub layout: Layout,
    /// Minutes of a step.
    #[serde(default = "paper_period")]
    pub period_min: f64,
    /// The task that it was evolved for; `None` in files that do not say, and for tasks outside this library.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub task: Option<Task>,
    /// SHA-256 of the model's JSON, in hexadecimal; `None` where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_sha256: Option<String>,
    /// Whether the model was made of virtual plants; `None` where it is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub is_virtual: Option<bool>,
    /// Expected fitness on unseen plants, in cm, as it was predicted when the champion was chosen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<Trial>,
    /// The network.
    pub genome: Genome,
}

const fn paper_period() -> f64 {
    PAPER_PERIOD_MIN
}

/// Why bytes are not a champion.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ChampionError {
    /// Not JSON, or not of a champion's form.
    #[error("found no champion: {0}")]
    Json(#[from] serde_json::Error),
    /// Another schema.
    #[error("found schema {0:?}, wanted {SCHEMA:?}, or \"tropism.genome/1\" for a network alone")]
    Schema(String),
    /// A broken network.
    #[error(transparent)]
    Genome(#[from] GenomeError),
    /// A network that does not fit its sensors and lamps.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// A task that cannot be done.
    #[error("task: {0}")]
    Task(#[from] crate::check::OutOfRange),
}

impl Champion {
    /// A network alone, with the paper's sensors, lamps and period and no task.
    #[must_use]
    pub fn of_genome(genome: Genome) -> Self {
        Self {
            genome,
            sensors: Sensors::default(),
            dimming: Dimming::Switch,
            layout: Layout::default(),
            period_min: PAPER_PERIOD_MIN,
            task: None,
            model_sha256: None,
            is_virtual: None,
            expected: None,
        }
    }

    /// A network that was evolved on `model` with `interface`. `model_json` is the model's file, of which the digest is kept.
    #[must_use]
    pub fn of_model<M: PlantModel>(
        genome: Genome,
        Interface { sensors, dimming }: Interface<'_>,
        model: &M,
        model_json: &str,
    ) -> Self {
        Self {
            sensors: sensors.clone(),
            dimming,
            layout: model.layout().clone(),
            period_min: model.period_min(),
            model_sha256: Some(sha256(model_json)),
            ..Self::of_genome(genome)
        }
    }

    /// The controller, at rest. `task` gives the targets that its sensors refer to.
    ///
    /// # Errors
    /// [`ShapeError`] if the network does not fit sensors and lamps.
    pub fn controller(&self, task: &Task) -> Result<NetworkController, ShapeError> {
        let interface = Interface { sensors: &self.sensors, dimming: self.dimming };
        NetworkController::new(&self.genome, interface, task, &self.layout)
    }

    /// Checks that the network fits sensors and lamps, and that the task can be done.
    ///
    /// # Errors
    /// [`ChampionError::Shape`] or [`ChampionError::Task`].
    pub fn check(&self) -> Result<(), ChampionError> {
        ShapeError::check(&self.genome, &self.sensors, &self.layout)?;
        Ok(self.task.as_ref().map_or(Ok(()), Task::check)?)
    }

    /// JSON, schema `tropism.champion/1`; see `docs/reference/controllers.md`.
    #[must_use]
    pub fn to_json(&self) -> String {
        let mut file = serde_json::to_value(self).expect("numbers and text are JSON");
        file["schema"] = SCHEMA.into();
        serde_json::to_string_pretty(&file).expect("numbers and text are JSON") + "\n"
    }

    /// Reads [`Self::to_json`], or a network alone (schema `tropism.genome/1`). Whether
    /// the network fits its sensors and lamps is for [`check`](Self::check).
    ///
    /// # Errors
    /// [`ChampionError`] says what was found instead.
    pub fn from_json(text: &str) -> Result<Self, ChampionError> {
        #[derive(Deserialize)]
        struct Head {
            schema: Option<String>,
        }
        let head: Result<Head, _> = serde_json::from_str(text);
        match head.map(|head| head.schema) {
            Ok(Some(schema)) if schema == SCHEMA => Ok(without_schema(text)?),
            Ok(Some(schema)) if schema.starts_with("tropism.") && !schema.starts_with("tropism.genome/") => {
                Err(ChampionError::Schema(schema))
            }
            _ => Ok(Self::of_genome(Genome::from_json(text)?)),
        }
    }
}
