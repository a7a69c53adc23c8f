//! Evolution of controllers with NEAT on a tip-motion model (section 2.3.2), in a folder that can be resumed.
//!
//! In: the file of a model, a task, NEAT's parameters and a seed. Out: champions, history and summary in a folder. Runs
//! are independent and work in parallel; each saves a checkpoint regularly. Neither the number of threads nor an
//! interruption changes a result.

mod config;
mod history;
mod record;
mod progress;
mod runs;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::evolve::{self, Champion, Choice, Evolution, EvolutionConfig, EvolutionRun, Start, Trial};
use tropism::math::statistics::median;
use tropism::parallel;
use tropism::task::Task;
use tropism_neat::Genome;

pub use self::config::EvolveConfig;
pub use self::history::EvolutionHistory;
pub use self::record::EvolutionRecord;
pub(crate) use self::record::champion_path;
use self::record::checkpoint_path;
pub use self::runs::Evolving;
use crate::model::Model;
use crate::sequences;
use crate::stopwatch::timed;
use crate::task::check_goal;
use crate::work::{self, PartStatus, Work, WorkStatus};
use crate::{Error, Monitor, Workflow, champion, files, model};

/// Default of [`EvolvePlan::trial_plants`]: the standard error of a mean over 200 plants is 0.07 standard deviations.
pub const TRIAL_PLANTS: u32 = 200;

/// The most plants whose own models a champion is tried on. Of more tracks these are taken evenly: the standard error of a mean
/// over 40 plants is 0.16 standard deviations, and all champions are tried on the same plants.
const TRANSFER_PLANTS: usize = 40;

/// The largest [`EvolvePlan::trial_plants`]; chosen by hand, against mistyped numbers.
const MAX_TRIAL_PLANTS: u64 = 1_000_000;

/// Default of [`EvolvePlan::checkpoint_s`]: a kill costs a minute of work at most.
pub const CHECKPOINT_S: u64 = 60;

/// The model in the folder of an evolution: it needs no other file to go on.
const MODEL: &str = "model.json";

/// Evolves controllers with NEAT on a tip-motion model, and chooses the one to use on real plants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EvolvePlan {
    /// File of the tip-motion model.
    pub model: PathBuf,
    /// Folder for checkpoints and results.
    pub out: PathBuf,
    /// Task of the controllers.
    pub task: Task,
    /// Number of runs, generations and episodes, and NEAT's parameters.
    pub evolution: EvolutionConfig,
    /// Unseen simulated plants of each model on which champions are compared, 1 to 1000000.
    pub trial_plants: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Whether to continue an evolution in `out`.
    pub resume: bool,
    /// Longest time between two checkpoints of a run, in s; 0 saves each generation.
    pub checkpoint_s: u64,
}

impl Default for EvolvePlan {
    fn default() -> Self {
        Self {
            model: "model.json".into(),
            out: "evolution".into(),
            task: Task::default(),
            evolution: EvolutionConfig::default(),
            trial_plants: TRIAL_PLANTS,
            seed: 1,
            resume: false,
            checkpoint_s: CHECKPOINT_S,
        }
    }
}

/// The result of one evolutionary run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvolutionRunSummary {
    /// Seed of the run.
    pub seed: u64,
    /// Fitness of the champion when it was evaluated, in cm.
    pub best_fitness: f64,
    /// Number of generations.
    pub generations: u32,
    /// Number of evaluated genomes.
    pub evaluations: u64,
    /// The champion on unseen plants of the model.
    pub trial: Trial,
    /// The champion on models of single plants, 40 of them at most: its expected fitness on an unseen plant.
    pub transfer: Trial,
    /// Whether the champion is what evolution started from: nothing better was found on models of single plants.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_start: bool,
    /// Number of links of the champion.
    pub links: usize,
    /// Share of its steps on an unseen plant of the model at which the model has no data, 0 to 1.
    pub without_data: f64,
    /// Why `transfer` is no expectation for unseen plants; `None` where it is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub withheld: Option<String>,
}

impl EvolutionRunSummary {
    /// The expected fitness on an unseen plant; `None` where it would rest on one plant or on mostly empty windows.
    #[must_use]
    pub fn expected(&self) -> Option<Trial> {
        self.withheld.is_none().then_some(self.transfer)
    }
}

/// The results of an evolution: the content of `summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvolveResults {
    /// One summary a run.
    pub runs: Vec<EvolutionRunSummary>,
    /// Number of evaluated genomes of all runs.
    pub evaluations: u64,
    /// Run whose champion is `champion.json`, from 0.
    pub champion: usize,
    /// Processor time of the runs and of the trials of their champions, in s; of an evolution that was resumed, since then.
    pub cpu_seconds: f64,
    /// Wall-clock time, in s.
    pub wall_seconds: f64,
}

impl EvolveResults {
    /// The run with the chosen champion.
    #[must_use]
    pub fn chosen(&self) -> &EvolutionRunSummary {
        &self.runs[self.champion]
    }

    /// The least, median and greatest best fitness of the runs, in cm.
    #[must_use]
    pub fn best_fitness_range(&self) -> [f64; 3] {
        let mut best: Vec<f64> = self.runs.iter().map(|run| run.best_fitness).collect();
        best.sort_by(f64::total_cmp);
        [best[0], median(&best), best[best.len() - 1]]
    }
}

impl Workflow for EvolvePlan {
    type Results = EvolveResults;

    const SCHEMA: &'static str = "tropism.evolve/1";

    fn check(&self) -> Result<(), Error> {
        self.task.check().map_err(Error::in_plan("task"))?;
        check_goal(&self.task)?;
        self.evolution.check().map_err(Error::in_plan("evolution"))?;
        Error::check_range("trial_plants", self.trial_plants, MAX_TRIAL_PLANTS)?;
        files::check_outputs(&self.outputs(), std::slice::from_ref(&self.model))
    }

    fn prepare(&mut self) -> Result<(), Error> {
        sequences::draw_for(&mut self.task, &self.model, self.seed)
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<EvolveResults, Error> {
        work::perform(self, monitor)
    }
}

impl Work for EvolvePlan {
    const WORKFLOW: &'static str = "evolve";
    const NAME: &'static str = "an evolution";
    const RECORD: &'static str = "evolution.toml";
    const RESULTS: &'static [&'static str] = &["summary.json", "champion.json"];

    type Begun<'p> = Evolving<'p>;

    fn out(&self) -> &Path {
        &self.out
    }

    fn resume_mut(&mut self) -> &mut bool {
        &mut self.resume
    }

    fn paths_mut(&mut self) -> Vec<&mut PathBuf> {
        vec![&mut self.out, &mut self.model]
    }

    fn of_folder(out: &Path) -> Result<Self, Error> {
        let EvolutionRecord { seed, trial_plants, task, evolution, .. } = EvolutionRecord::read(out)?;
        let model = out.join(MODEL);
        if !model.exists() {
            return Err(Error::Plan(format!("{}: there is no such file: name the `model`", model.display())));
        }
        let (out, resume) = (out.to_owned(), true);
        Ok(Self { model, out, task, evolution, trial_plants, seed, resume, ..Self::default() })
    }

    /// A part is a run, as it was saved last.
    fn status(folder: &Path) -> Result<WorkStatus, Error> {
        let record = EvolutionRecord::read(folder)?;
        // A summary is small, and checkpoints are not.
        let summary = files::read_as(&folder.join("summary.json"), |text| serde_json::from_str(text));
        let results: Option<EvolveResults> = summary.ok();
        let part = |index: u32| {
            let (done, best) = match &results {
                Some(results) => {
                    let run = results.runs.get(index as usize);
                    (run.map_or(0, |run| run.generations), run.map(|run| run.best_fitness))
                }
                None => {
                    let run = record.checkpoint(folder, index);
                    let best = run.as_ref().and_then(|run| run.champion()).map(|(_, fitness)| fitness);
                    (run.map_or(0, |run| run.search.generation()), best)
                }
            };
            let (total, best_unit) = (record.generations().into(), Some(record.task.kind.unit()));
            let part = PartStatus::new(format!("run {index}"), done.into(), total, "generations");
            PartStatus { best, best_unit, ..part }
        };
        let parts = (0..record.runs()).map(part).collect();
        let saved = (0..record.runs()).filter_map(|index| files::age_s(&checkpoint_path(folder, index)));
        let status = WorkStatus::of::<Self>(folder, parts)?;
        let saved_ago_s = saved.reduce(f64::min).filter(|_| !status.is_over);
        Ok(WorkStatus { is_virtual: Some(record.is_virtual), saved_ago_s, ..status })
    }

    fn begin(&self, monitor: &dyn Monitor) -> Result<Evolving<'_>, Error> {
        Evolving::new(self, model::read_for(&self.model, &self.task, monitor)?)
    }

    fn collect(&self, evolving: &Evolving<'_>, monitor: &dyn Monitor) -> Result<EvolveResults, Error> {
        let (runs, model, evolution) = (evolving.runs(monitor)?, &evolving.model, evolving.evolution()?);
        let (champions, trying_s) = self.summarize(&runs, &evolution, model, monitor)?;
        let champion = Choice::of(champions.iter().map(|(_, run)| run.transfer).collect()).run;
        let json = model.to_json();
        files::make_folder(&self.out.join("champions"))?;
        for (index, (genome, summary)) in champions.iter().enumerate() {
            let one = Champion { expected: summary.expected(), ..self.champion(genome, model, &json) };
            champion::write(&champion_path(&self.out, index), &one)?;
            if index == champion {
                champion::write(&self.out.join("champion.json"), &one)?;
            }
        }
        files::write(&self.out.join("history.csv"), history::csv_of(&runs).as_bytes())?;
        let summaries: Vec<EvolutionRunSummary> = champions.into_iter().map(|(_, summary)| summary).collect();
        let results = EvolveResults {
            evaluations: summaries.iter().map(|run| run.evaluations).sum(),
            runs: summaries,
            champion,
            cpu_seconds: evolving.cpu_seconds() + trying_s,
            wall_seconds: evolving.wall_seconds(),
        };
        files::write_unterminated_json(&self.out.join("summary.json"), &results)?;
        if model.is_virtual() {
            monitor.note("the model was made from virtual plants");
        }
        Ok(results)
    }
}

/// The champion of a run and its summary.
type Summarized<'r> = (&'r Genome, EvolutionRunSummary);

impl EvolvePlan {
    /// Starts evolution from the champion in `path`: from its network, with its sensors and its way to light lamps.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be read or holds no champion.
    pub fn start_from(&mut self, path: &Path) -> Result<(), Error> {
        let Champion { genome, sensors, dimming, .. } = champion::read(path)?;
        self.evolution.start = Start::Network(genome.into());
        (self.evolution.sensors, self.evolution.dimming) = (sensors, dimming);
        Ok(())
    }

    /// The files that are written to [`out`](Self::out), but for those of single runs.
    #[must_use]
    pub fn outputs(&self) -> Vec<PathBuf> {
        [Self::RECORD, "champion.json", "history.csv", "summary.json"].map(|name| self.out.join(name)).into()
    }

    /// What a run that was asked to end says.
    pub(super) fn interrupted(&self) -> Error {
        Error::Interrupted { folder: self.out.clone() }
    }

    /// The champion `genome` with all that it was evolved for. `json` is the model's file.
    fn champion(&self, genome: &Genome, model: &Model, json: &str) -> Champion {
        Champion {
            task: Some(self.task.clone()),
            is_virtual: Some(model.is_virtual()),
            ..Champion::of_model(genome.clone(), self.evolution.interface(), model, json)
        }
    }

    /// The champion of each run and its summary: candidates are tried on a model of each plant, and champions on unseen plants of
    /// `model`, too. With the processor time of that, in s.
    fn summarize<'r>(
        &self,
        runs: &'r [EvolutionRun],
        evolution: &'r Evolution<'_, Model>,
        model: &Model,
        monitor: &dyn Monitor,
    ) -> Result<(Vec<Summarized<'r>>, f64), Error> {
        let plants = model.of_each_plant(TRANSFER_PLANTS)?;
        let summarize = |run: &'r EvolutionRun| -> Result<_, Error> {
            let judges = plants.iter().take_while(|_| monitor.may_go_on());
            let (genome, transfer) = evolution.champion_of(run, judges, self.trial_plants);
            let unseen = [model].into_iter().take_while(|_| monitor.may_go_on());
            let interface = self.evolution.interface();
            let trial =
                evolve::trial_of_genome(unseen, &self.task, interface, genome, self.seed, self.trial_plants);
            let champion = self.champion(genome, model, "");
            let track =
                champion::simulate(&champion, model, &self.task, self.seed).map_err(Error::at("champion"))?;
            let without_data = model.share_without_data(&track.samples);
            let summary = EvolutionRunSummary {
                seed: run.seed,
                best_fitness: run.champion().map_or(0.0, |(_, fitness)| fitness),
                generations: run.search.generation(),
                evaluations: run.search.evaluations(),
                trial,
                transfer,
                is_start: evolution.start() == Some(genome),
                links: genome.links().len(),
                without_data,
                withheld: model::reason_to_withhold(plants.len(), without_data),
            };
            Ok((genome, summary))
        };
        let try_out = |run: usize| {
            let (summary, seconds) = timed(|| summarize(&runs[run]));
            Ok::<_, Error>((summary?, seconds))
        };
        let summaries: Vec<(Summarized<'_>, f64)> = parallel::try_map(runs.len(), try_out)?;
        if !monitor.may_go_on() {
            return Err(self.interrupted());
        }
        let seconds = summaries.iter().map(|(_, seconds)| seconds).sum();
        Ok((summaries.into_iter().map(|(summary, _)| summary).collect(), seconds))
    }
}
