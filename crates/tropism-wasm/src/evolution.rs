//! An evolution in slices: `tropism evolve`, to the bit, whoever does which of its runs.

use serde_json::{Value, json};
use tropism::environment;
use tropism::evolve::{Champion, Evolution, EvolutionConfig, EvolutionRun, reason_to_withhold};
use tropism::random::{NoiseStream, Purpose};
use tropism::simulation::{AnyModel, Simulation};
use tropism::task::Task;
use tropism::track::Track;

use crate::SessionError;

/// Unseen simulated plants of each model on which champions are compared: the default of `tropism evolve`.
const TRIAL_PLANTS: u32 = 200;

/// Models of single plants on which champions are tried, at most: as `tropism evolve`.
const TRANSFER_PLANTS: usize = 40;

/// The own runs of an evolution.
pub(crate) struct Job {
    model: AnyModel,
    task: Task,
    config: EvolutionConfig,
    seed: u64,
    runs: Vec<(u32, EvolutionRun)>,
}

impl Job {
    /// Its runs `own` at their beginning.
    pub(crate) fn begin(
        model: &AnyModel,
        task: Task,
        config: EvolutionConfig,
        seed: u64,
        own: &[u32],
    ) -> Result<Self, SessionError> {
        task.check()?;
        let evolution = Evolution::new(model, &task, config.clone(), seed)?;
        let runs = own.iter().map(|&index| Ok((index, evolution.begin(index)?)));
        let runs = runs.collect::<Result<_, SessionError>>()?;
        Ok(Self { model: model.clone(), task, config, seed, runs })
    }

    fn evolution(&self) -> Result<Evolution<'_, AnyModel>, SessionError> {
        Ok(Evolution::new(&self.model, &self.task, self.config.clone(), self.seed)?)
    }

    /// Advances each run by `generations` at most: the new generations, and whether all are done.
    pub(crate) fn advance(&mut self, generations: u32) -> Result<Value, SessionError> {
        let mut runs = std::mem::take(&mut self.runs);
        let evolution = self.evolution()?;
        let mut news = Vec::new();
        for (index, run) in &mut runs {
            let done = run.history.len();
            for _ in 0..generations.min(self.config.generations - done as u32) {
                evolution.advance(run);
            }
            news.push(json!({ "run": index, "generations": &run.history[done..] }));
        }
        let is_done = runs.iter().all(|(_, run)| run.history.len() as u32 == self.config.generations);
        self.runs = runs;
        Ok(json!({ "runs": news, "is_done": is_done }))
    }

    /// The best network so far, as a champion without expectation.
    pub(crate) fn best(&self) -> Result<Value, SessionError> {
        let found = self.runs.iter().filter_map(|(_, run)| run.champion());
        let best = found.max_by(|(_, one), (_, other)| one.total_cmp(other));
        let (genome, fitness) = best.ok_or_else(|| SessionError::Refused("no generation yet".to_owned()))?;
        let champion = self.champion(genome, &self.model.to_json());
        Ok(json!({ "champion": champion.to_json(), "fitness": fitness }))
    }

    fn champion(&self, genome: &tropism_neat::Genome, model_json: &str) -> Champion {
        Champion {
            task: Some(self.task.clone()),
            is_virtual: Some(self.model.is_virtual()),
            ..Champion::of_model(genome.clone(), self.config.interface(), &self.model, model_json)
        }
    }

    /// The champion of each own run, as its file, with its trial on models of single plants.
    pub(crate) fn finish(&self) -> Result<Value, SessionError> {
        let evolution = self.evolution()?;
        let plants = self.model.of_each_plant(TRANSFER_PLANTS)?;
        let json = self.model.to_json();
        let mut champions = Vec::new();
        for (index, run) in &self.runs {
            let (genome, transfer) = evolution.champion_of(run, &plants, TRIAL_PLANTS);
            let champion = self.champion(genome, &json);
            let track = simulate(&champion, &self.model, &self.task, self.seed, 0)?;
            let without_data = self.model.share_without_data(&track.samples);
            let withheld = reason_to_withhold(plants.len(), without_data);
            let expected = withheld.is_none().then_some(transfer);
            champions.push(json!({
                "run": index,
                "best": run.champion().map(|(_, fitness)| fitness),
                "trial": transfer,
                "withheld": withheld,
                "links": genome.links().len(),
                "file": Champion { expected, ..champion }.to_json(),
            }));
        }
        Ok(champions.into())
    }
}

/// Simulated plant number `episode` of the trials under `seed`, steered by `champion`.
pub(crate) fn simulate(
    champion: &Champion,
    model: &AnyModel,
    task: &Task,
    seed: u64,
    episode: u32,
) -> Result<Track, SessionError> {
    champion.dimming.check(model).map_err(tropism::evolve::EvolutionError::from)?;
    let noise = NoiseStream::new(seed, Purpose::Trial, [episode, 0, 0]);
    let mut plant = Simulation::new(model, task, noise);
    let Ok(track) =
        environment::run(&mut plant, &mut champion.controller(task)?, task, &mut environment::unwatched);
    Ok(track)
}
