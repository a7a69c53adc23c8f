//! Evolution of controllers on a model (section 2.3.2), the paper's random baseline (section 3.1), and the choice of the
//! controller that meets reality.
//!
//! A model and a task go in, champions come out. Runs share nothing, and every evaluation's luck is named by run,
//! generation, individual and episode: neither threads nor interruptions change a result.

mod saved;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use tropism_neat::{
    Activation, Config, Generation, Genome, LinearThreshold, Neat, NeatError, random_genome, random_weights,
};

use crate::control::Controller;
use crate::control::network::{INPUTS, OUTPUTS};
use crate::plant::PlantModel;
use crate::plant::tip::TipModel;
use crate::random::{self, Draws, Purpose};
use crate::simulation::fitness_of;
use crate::simulation::lanes::{Episode, fitness_of_all, fitness_of_seeds};
use crate::simulation::seeds::Seed;
use crate::task::Task;

pub use saved::SavedRunError;

/// How controllers are evolved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EvolutionConfig {
    /// Independent runs. Paper: 20 (section 3.1).
    pub runs: u32,
    /// Generations of a run. Paper: 2000.
    pub generations: u32,
    /// Simulated plants that each genome steers; its fitness is their mean. Paper: 1, as far as it says.
    pub episodes: u32,
    /// NEAT's parameters. Paper: Table 1.
    pub neat: Config,
}

impl Default for EvolutionConfig {
    fn default() -> Self {
        Self { runs: 20, generations: 2000, episodes: 1, neat: Config::wahby2016() }
    }
}

/// An evolution that cannot be.
#[derive(Debug, thiserror::Error)]
pub enum EvolutionError {
    /// A number out of its range.
    #[error("found {key} = {found}, wanted {wanted}")]
    Setting {
        /// Which.
        key: &'static str,
        /// Its value.
        found: u32,
        /// Its range.
        wanted: &'static str,
    },
    /// NEAT's own.
    #[error(transparent)]
    Neat(#[from] NeatError),
}

impl EvolutionConfig {
    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`EvolutionError`] names the key, its value and its range.
    pub fn check(&self) -> Result<(), EvolutionError> {
        let within = |key, found, most, wanted| {
            if (1..=most).contains(&found) {
                Ok(())
            } else {
                Err(EvolutionError::Setting { key, found, wanted })
            }
        };
        within("runs", self.runs, 10_000, "1 to 10000")?;
        within("generations", self.generations, 10_000_000, "1 to 10000000")?;
        within("episodes", self.episodes, 10_000, "1 to 10000")?;
        self.neat.check().map_err(NeatError::from)?;
        Ok(())
    }
}

/// One evolutionary run: all that is needed to go on with it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Seed of this run.
    pub seed: u64,
    /// Episodes of each evaluation.
    pub episodes: u32,
    /// The state of NEAT.
    pub neat: Neat,
    /// What came out of each generation so far.
    pub history: Vec<Generation>,
}

impl Run {
    /// Run number `index` of an evolution with `seed`.
    ///
    /// # Errors
    /// [`NeatError`] if NEAT's parameters are out of range.
    pub fn new(config: &EvolutionConfig, seed: u64, index: u32) -> Result<Self, NeatError> {
        let seed = random::derive(seed, Purpose::Run, u64::from(index));
        let neat = Neat::new(config.neat.clone(), INPUTS, OUTPUTS, seed)?;
        Ok(Self { seed, episodes: config.episodes, neat, history: Vec::new() })
    }

    /// Evaluates the present population on `model` and breeds the next.
    pub fn advance(&mut self, model: &TipModel, task: &Task) -> &Generation {
        let generation = self.neat.generation();
        let seed = self.seed;
        let draws = move |individual: usize, episode| {
            Draws::new(seed, Purpose::Growth, [generation, individual as u32, episode])
        };
        let individuals = self.neat.ask().iter().enumerate();
        let episodes = individuals.flat_map(|(individual, genome)| {
            (0..self.episodes)
                .map(move |episode| Episode { controller: genome, draws: draws(individual, episode) })
        });
        let fitness = fitness_of_all(model, task, episodes);
        let count = self.episodes as usize;
        let scores: Vec<f64> =
            fitness.chunks_exact(count).map(|own| own.iter().sum::<f64>() / count as f64).collect();
        self.history.push(self.neat.tell(&scores).expect("as many finite scores as genomes"));
        &self.history[self.history.len() - 1]
    }

    /// The best genome so far and its fitness; `None` before the first generation.
    #[must_use]
    pub fn champion(&self) -> Option<(&Genome, f64)> {
        self.neat.champion().map(|champion| (&champion.genome, champion.fitness))
    }
}

/// What random controllers achieve (section 3.1).
#[derive(Clone, Debug, Serialize)]
pub struct Baseline {
    /// How many were tried.
    pub count: u64,
    /// Best fitness, in cm.
    pub best: f64,
    /// Median fitness, in cm.
    pub median: f64,
    /// The best one.
    #[serde(skip)]
    pub champion: Genome,
}

/// Tries `count` networks as NEAT's initial population makes them, on all threads.
///
/// `tick` is told how many more were tried; it returns `false` to break off, and then there is no result.
///
/// # Panics
/// If `count` is 0.
pub fn baseline(
    model: &TipModel,
    task: &Task,
    neat: &Config,
    seed: u64,
    count: u64,
    tick: impl Fn(u64) -> bool + Sync,
) -> Option<Baseline> {
    const CHUNK: u64 = 50_000;
    assert!(count > 0, "at least one controller");
    let chunks: Option<Vec<Vec<f64>>> = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let indices = chunk * CHUNK..count.min((chunk + 1) * CHUNK);
            let draws =
                |index: u64| Draws::new(seed, Purpose::Growth, [(index >> 32) as u32, index as u32, 0]);
            let scores = if neat.output_activation == Activation::UnsignedStep {
                let threshold = 0.5 + neat.activation_b;
                let mut weights = random_weights(neat, INPUTS, OUTPUTS, seed, indices.start);
                let episodes = indices.map(|index| {
                    let mut next = || weights.next().expect("weights without end");
                    let output = LinearThreshold { weights: [next(), next()], threshold };
                    Episode { controller: Seed { output, bias: next() }, draws: draws(index) }
                });
                fitness_of_seeds(model, task, episodes)
            } else {
                let genomes: Vec<Genome> =
                    indices.clone().map(|index| random_genome(neat, INPUTS, OUTPUTS, seed, index)).collect();
                let episodes = genomes
                    .iter()
                    .zip(indices)
                    .map(|(genome, index)| Episode { controller: genome, draws: draws(index) });
                fitness_of_all(model, task, episodes)
            };
            tick(scores.len() as u64).then_some(scores)
        })
        .collect();
    let mut scores = chunks?.concat();
    let best =
        (0..scores.len()).fold(0, |best, index| if scores[index] > scores[best] { index } else { best });
    let (index, fitness) = (best as u64, scores[best]);
    let half = scores.len() / 2;
    let (lower, &mut upper_middle, _) = scores.select_nth_unstable_by(half, f64::total_cmp);
    let lower_middle = lower.iter().copied().max_by(f64::total_cmp).filter(|_| count.is_multiple_of(2));
    let median = 0.5 * (lower_middle.unwrap_or(upper_middle) + upper_middle);
    Some(Baseline {
        count,
        best: fitness,
        median,
        champion: random_genome(neat, INPUTS, OUTPUTS, seed, index),
    })
}

/// How a controller does on simulated plants that it did not evolve on.
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
        let count = scores.len() as f64;
        let mean = scores.iter().sum::<f64>() / count;
        let variance =
            scores.iter().map(|score| (score - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        Self { mean, sd: variance.sqrt(), plants: scores.len() as u32 }
    }
}

/// Tries a controller on `plants` fresh plants of each of `models`, the same ones for every controller under one `seed`.
/// `build` makes the controller anew, at rest, for each of them.
///
/// On the model that it evolved on, this averages out the luck in growth for which the best fitness of a single
/// evaluation selects. On [a model of each plant](crate::plant::tip::TipModel::of_each_plant) it is the transfer to
/// expect: the pooled model is an average plant that moves more regularly than any of those it was made of, and a
/// controller that only suits the average is found out, before it meets a plant.
///
/// # Panics
/// If there are no models or no plants.
#[must_use]
pub fn trial<M: PlantModel, C: Controller>(
    models: &[M],
    task: &Task,
    build: impl Fn() -> C,
    seed: u64,
    plants: u32,
) -> Trial {
    assert!(plants > 0 && !models.is_empty(), "at least one plant of one model");
    let scores: Vec<f64> = (0..)
        .zip(models)
        .flat_map(|(number, model)| (0..plants).map(move |plant| (number, model, plant)))
        .map(|(number, model, plant)| {
            fitness_of(model, &mut build(), task, Draws::new(seed, Purpose::Trial, [plant, number, 0]))
        })
        .collect();
    Trial::of(&scores)
}

/// [`trial`] of the controller that `genome` describes, many plants at once: the same figures, to the bit.
///
/// # Panics
/// If there are no models or no plants, or the genome has not two inputs and one output.
#[must_use]
pub fn trial_of_genome(models: &[TipModel], task: &Task, genome: &Genome, seed: u64, plants: u32) -> Trial {
    assert!(plants > 0 && !models.is_empty(), "at least one plant of one model");
    let scores: Vec<f64> = (0..)
        .zip(models)
        .flat_map(|(number, model)| {
            let episodes = (0..plants).map(|plant| Episode {
                controller: genome,
                draws: Draws::new(seed, Purpose::Trial, [plant, number, 0]),
            });
            fitness_of_all(model, task, episodes)
        })
        .collect();
    Trial::of(&scores)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::network::NetworkController;
    use crate::plant::tip::TipModelConfig;
    use crate::track::Track;

    /// A plant that leans towards the light, from 4 to 24 cm.
    fn model() -> TipModel {
        let mut text = "tip_x_cm,tip_y_cm,light\n".to_owned();
        for step in 0..700_u32 {
            let phase = step % 80;
            let (x, light) = if phase < 40 { (phase, "right") } else { (80 - phase, "left") };
            text += &format!("{},{},{light}\n", f64::from(x) * 0.2 - 4.0, 4.0 + 0.03 * f64::from(step));
        }
        TipModel::fit([&Track::read_csv(text.as_bytes()).unwrap()], TipModelConfig::default()).unwrap()
    }

    #[test]
    fn a_baseline_is_what_each_of_its_genomes_does_by_itself() {
        let (model, task) = (model(), Task::default());
        for output_activation in [Activation::UnsignedStep, Activation::SignedStep] {
            let neat = Config { output_activation, ..Config::wahby2016() };
            let scores: Vec<f64> = (0..1100)
                .map(|index| {
                    let genome = random_genome(&neat, INPUTS, OUTPUTS, 5, index);
                    let mut controller = NetworkController::new(&genome).unwrap();
                    let draws = Draws::new(5, Purpose::Growth, [0, index as u32, 0]);
                    fitness_of(&model, &mut controller, &task, draws)
                })
                .collect();
            let found = baseline(&model, &task, &neat, 5, 1100, |_| true).unwrap();
            let best = scores.iter().copied().fold(f64::MIN, f64::max);
            assert_eq!(found.best.to_bits(), best.to_bits());
            let mut sorted = scores.clone();
            sorted.sort_by(f64::total_cmp);
            assert_eq!(found.median, 0.5 * (sorted[549] + sorted[550]));
            let place = scores.iter().position(|&score| score == best).unwrap();
            assert_eq!(found.champion, random_genome(&neat, INPUTS, OUTPUTS, 5, place as u64));
        }
    }

    #[test]
    fn a_genome_is_tried_as_its_controller_is() {
        let (model, task) = (model(), Task::default());
        let mut run = Run::new(&EvolutionConfig::default(), 3, 0).unwrap();
        for _ in 0..60 {
            run.advance(&model, &task);
        }
        let (genome, _) = run.champion().unwrap();
        let models = [model.clone(), model];
        let controller = NetworkController::new(genome).unwrap();
        let plain = trial(&models, &task, || controller.clone(), 4, 50);
        assert_eq!(trial_of_genome(&models, &task, genome, 4, 50), plain);
    }
}
