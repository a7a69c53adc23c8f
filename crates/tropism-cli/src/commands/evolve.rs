//! `tropism evolve`: controllers for a model.

mod live;

use std::fmt::Write;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use tropism::control::NetworkController;
use tropism::control::{OUTPUTS, Sensors};
use tropism::evolve::{self, Evolution, EvolutionConfig, EvolutionRun, Trial};
use tropism::math::statistics;
use tropism::plant::PlantModel;
use tropism::plant::tip::TipModel;
use tropism::random::{NoiseStream, Purpose};
use tropism::simulation::simulate_with;
use tropism::task::Targets;
use tropism_lab::{Checkpoint, files, lock};
use tropism_neat::{Config, Generation, Genome};

use self::live::Live;
use crate::options::{SeedOption, TaskOption, load_model_for};
use crate::shell::{Interrupted, Progress, Shell, cpu_seconds};

/// Simulated plants on which the champions of all runs are compared.
pub(crate) const TRIAL_PLANTS: u32 = 200;

/// How much work a kill may cost.
pub(crate) const CHECKPOINT: Duration = Duration::from_secs(60);

/// Evolve controllers on a model with NEAT, eqs. (4)-(9), Table 1
///
/// Each run ends with a champion. The one that goes on to reality, champion.json, is the one with the highest fitness to
/// expect on a fresh plant: its mean over models that were each made of a single plant. Each run is saved every minute and
/// at Ctrl-C or SIGTERM; --resume goes on to the same bits, also after a kill.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism evolve --model model.json --out evolution --runs 4 --generations 500\n  \
    tropism evolve --model model.json --out evolution --json-lines | jq '[.run, .generation, .best]'")]
pub(crate) struct Evolve {
    /// Tip-motion model, from `tropism fit`
    #[arg(long, value_name = "model.json")]
    model: PathBuf,

    /// Folder to make
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    #[command(flatten)]
    task: TaskOption,

    /// Independent runs
    #[arg(long, default_value_t = 20, value_name = "N")]
    runs: u32,

    /// Generations of a run
    #[arg(long, default_value_t = 2000, value_name = "N")]
    generations: u32,

    /// Population; that of the preset (50) by default
    #[arg(long, value_name = "N")]
    population: Option<usize>,

    /// Parameters of NEAT: Table 1 with MultiNEAT's defaults, or with those of its ball-keeper example
    #[arg(long, value_enum, default_value = "paper")]
    preset: Preset,

    /// Simulated plants that each genome steers for its fitness
    #[arg(long, default_value_t = 1, value_name = "N")]
    episodes: u32,

    /// Go on with the evolution in DIR where it stopped
    #[arg(long)]
    resume: bool,

    /// Save each run at least so often; 0: after each generation
    #[arg(long, default_value_t = CHECKPOINT.as_secs(), value_name = "SECONDS")]
    checkpoint: u64,

    /// One JSON object a run and generation on stdout as they come, and last the one of --json
    #[arg(long)]
    json_lines: bool,

    #[command(flatten)]
    seed: SeedOption,
}

#[derive(Clone, Copy, ValueEnum)]
enum Preset {
    Paper,
    BallKeeper,
}

/// All that decides an evolution's outcome: the text of `evolution.toml`.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct EvolutionPlan {
    schema: String,
    version: String,
    pub(crate) seed: u64,
    /// Whether the model is one of virtual plants.
    pub(crate) is_virtual: bool,
    /// The model, by its check sum.
    model_sha256: String,
    trial_plants: u32,
    task: Targets,
    evolution: EvolutionConfig,
}

/// How one run ended.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct RunOutcome {
    pub(crate) seed: u64,
    pub(crate) best_fitness: f64,
    pub(crate) generations: u32,
    pub(crate) evaluations: u64,
    /// Its champion on fresh plants of the model.
    pub(crate) trial: Trial,
    /// Its champion on models of single plants: what to expect on a plant that nobody met.
    pub(crate) transfer: Trial,
    pub(crate) links: usize,
    /// Share of its steps on a fresh plant where the model has no data.
    pub(crate) without_data: f64,
}

/// How an evolution ended: `summary.json`.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct Outcome {
    pub(crate) runs: Vec<RunOutcome>,
    pub(crate) evaluations: u64,
    /// EvolutionRun whose champion is `champion.json`, from 0.
    pub(crate) champion: usize,
    pub(crate) cpu_seconds: f64,
    pub(crate) wall_seconds: f64,
}

/// How an evolution at work is looked after.
pub(crate) struct Care<'c> {
    /// How much work a kill may cost.
    pub(crate) checkpoint: Duration,
    /// Where it says how far it is.
    pub(crate) progress: &'c Progress,
    /// Sees the generations of every run, by the run's number.
    pub(crate) watch: &'c (dyn Fn(u32, &Generation) -> Result<()> + Sync),
}

/// A generation as `--json-lines` writes it.
#[derive(Serialize)]
struct Line<'g> {
    run: u32,
    #[serde(flatten)]
    generation: &'g Generation,
}

impl EvolutionPlan {
    pub(crate) fn new(
        model: &TipModel,
        task: &Targets,
        config: EvolutionConfig,
        trial_plants: u32,
        seed: u64,
    ) -> Self {
        Self {
            schema: "tropism.evolution/1".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed,
            is_virtual: model.is_virtual(),
            model_sha256: files::sha256(model.to_json().as_bytes()),
            trial_plants,
            task: task.clone(),
            evolution: config,
        }
    }

    /// The task that controllers are evolved for.
    pub(crate) const fn task(&self) -> &Targets {
        &self.task
    }

    /// Whether `model` is the one that they evolve on.
    pub(crate) fn is_on(&self, model: &TipModel) -> bool {
        self.model_sha256 == files::sha256(model.to_json().as_bytes())
    }

    /// The run whose champion is best so far, by the checkpoints in the folder of an evolution that is not over, and its
    /// number; `None` if there is none that can be read. Nothing in the folder is touched: it may be at work.
    pub(crate) fn best_so_far(&self, out: &Path) -> Option<(u32, EvolutionRun)> {
        let read = |index| {
            let file = out.join(format!("run-{index:02}.json"));
            let parse =
                |text: &str| EvolutionRun::from_json(text, &self.evolution, OUTPUTS, self.seed, index);
            Some((index, files::read_as(&file, parse).ok()?))
        };
        let fitness = |run: &EvolutionRun| run.champion().map_or(f64::NEG_INFINITY, |(_, fitness)| fitness);
        let begun = (0..self.evolution.runs).filter_map(read).filter(|(_, run)| run.champion().is_some());
        begun.max_by(|(_, a), (_, b)| fitness(a).total_cmp(&fitness(b)))
    }

    /// Evolves in `out`, on all threads, and writes champions, history and summary there; `None` if it was interrupted.
    pub(crate) fn execute(
        &self,
        model: &TipModel,
        out: &Path,
        is_resumed: bool,
        care: &Care<'_>,
    ) -> Result<Option<Outcome>> {
        let (started, cpu) = (Instant::now(), cpu_seconds());
        self.evolution.check()?;
        let _lock = self.claim(out, is_resumed)?;
        let live = Mutex::new(Live::new(self.evolution.runs as usize));
        let runs: Vec<Option<EvolutionRun>> = (0..self.evolution.runs)
            .into_par_iter()
            .map(|index| self.advance(index, model, out, care, &live))
            .collect::<Result<_>>()?;
        let Some(runs) = runs.into_iter().collect::<Option<Vec<EvolutionRun>>>() else { return Ok(None) };
        let plants = model.of_each_plant()?;
        let outcomes: Vec<RunOutcome> =
            runs.par_iter().map(|run| self.outcome(run, model, &plants)).collect::<Result<_>>()?;
        let best = (0..runs.len()).fold(0, |best, index| {
            if outcomes[index].transfer.mean > outcomes[best].transfer.mean { index } else { best }
        });
        for (index, run) in runs.iter().enumerate() {
            let name = format!("run-{index:02}.json");
            files::write(&out.join("champions").join(name), champion(run)?.to_json().as_bytes())?;
        }
        files::write(&out.join("champion.json"), champion(&runs[best])?.to_json().as_bytes())?;
        files::write(&out.join("history.csv"), history(&runs).as_bytes())?;
        let outcome = Outcome {
            evaluations: outcomes.iter().map(|run| run.evaluations).sum(),
            runs: outcomes,
            champion: best,
            cpu_seconds: cpu_seconds() - cpu,
            wall_seconds: started.elapsed().as_secs_f64(),
        };
        files::write(&out.join("summary.json"), serde_json::to_string_pretty(&outcome)?.as_bytes())?;
        Ok(Some(outcome))
    }

    /// Makes the folder or finds it to be this evolution's, and keeps others out of it.
    fn claim(&self, out: &Path, is_resumed: bool) -> Result<File> {
        let (file, text) = (out.join("evolution.toml"), toml::to_string(self)?);
        let is_there = file.exists();
        ensure!(
            is_resumed || !is_there,
            "{}: found an evolution here already, wanted a new folder (or --resume)",
            out.display()
        );
        if is_there {
            let there = files::read_text(&file)?;
            ensure!(
                there == text,
                "{}: found an evolution of other settings or another model, wanted the same; use another folder",
                file.display()
            );
        }
        files::make_folder(&out.join("champions"))?;
        let lock = lock(out)?;
        files::write(&file, text.as_bytes())?;
        Ok(lock)
    }

    /// Advances run `index` to its last generation, from its checkpoint if there is one. `None` if it was interrupted.
    fn advance(
        &self,
        index: u32,
        model: &TipModel,
        out: &Path,
        care: &Care<'_>,
        live: &Mutex<Live>,
    ) -> Result<Option<EvolutionRun>> {
        let checkpoint = Checkpoint::new(out.join(format!("run-{index:02}.json")));
        let evolution = Evolution::new(model, &self.task, self.evolution.clone(), self.seed)?;
        let mut run = self.begin(&evolution, index, &checkpoint, care.progress)?;
        if let Some(last) = run.history.last() {
            care.progress.skip(run.history.len() as u64);
            if let Ok(mut live) = live.lock() {
                live.know(index, last);
            }
        }
        let mut saved = Instant::now();
        let mut saved_generations = run.history.len();
        while (run.history.len() as u32) < self.evolution.generations && !Shell::is_interrupted() {
            let generation = evolution.advance(&mut run);
            (care.watch)(index, generation)?;
            care.progress.add(1);
            if let Ok(mut live) = live.lock() {
                live.see(index, generation, care.progress);
            }
            if saved.elapsed() >= care.checkpoint {
                checkpoint.save(run.to_json().as_bytes())?;
                (saved, saved_generations) = (Instant::now(), run.history.len());
            }
        }
        if run.history.len() > saved_generations {
            checkpoint.save(run.to_json().as_bytes())?;
        }
        Ok((run.history.len() as u32 == self.evolution.generations).then_some(run))
    }

    /// EvolutionRun `index` as its checkpoint has it, or at its beginning.
    fn begin(
        &self,
        evolution: &Evolution<'_, TipModel, Targets>,
        index: u32,
        checkpoint: &Checkpoint,
        progress: &Progress,
    ) -> Result<EvolutionRun> {
        let parse = |text: &str| EvolutionRun::from_json(text, &self.evolution, OUTPUTS, self.seed, index);
        let Some(loaded) = checkpoint.load(parse)? else {
            return Ok(evolution.begin(index)?);
        };
        if let Some(refused) = loaded.refused {
            progress.note(&format!(
                "{refused}; run {index} goes on from {}, generation {}",
                checkpoint.previous().display(),
                loaded.value.neat.generation()
            ));
        }
        Ok(loaded.value)
    }

    fn outcome(&self, run: &EvolutionRun, model: &TipModel, plants: &[TipModel]) -> Result<RunOutcome> {
        let genome = champion(run)?;
        let mut controller =
            NetworkController::new(genome, &self.evolution.sensors, &self.task, model.layout())?;
        Ok(RunOutcome {
            seed: run.seed,
            best_fitness: run.champion().map_or(0.0, |(_, fitness)| fitness),
            generations: run.neat.generation(),
            evaluations: run.neat.evaluations(),
            trial: self.trial(std::slice::from_ref(model), genome),
            transfer: self.trial(plants, genome),
            links: genome.links().len(),
            without_data: {
                let draws = NoiseStream::new(self.seed, Purpose::Trial, [0; 3]);
                model.share_without_data(&simulate_with(model, &mut controller, &self.task, draws))
            },
        })
    }
}

impl EvolutionPlan {
    fn trial(&self, models: &[TipModel], genome: &Genome) -> Trial {
        evolve::trial_of_genome(models, &self.task, &Sensors::default(), genome, self.seed, self.trial_plants)
    }
}

fn champion(run: &EvolutionRun) -> Result<&Genome> {
    Ok(run.champion().context("a run of at least one generation has a champion")?.0)
}

/// One row a generation and run.
fn history(runs: &[EvolutionRun]) -> String {
    let mut text =
        "run,generation,best,mean,median,best_ever,species,population,links_mean,threshold\n".to_owned();
    for (index, run) in runs.iter().enumerate() {
        for generation in &run.history {
            let _ = writeln!(
                text,
                "{index},{},{},{},{},{},{},{},{},{}",
                generation.generation,
                generation.best,
                generation.mean,
                generation.median,
                generation.best_ever,
                generation.species,
                generation.population,
                generation.links_mean,
                generation.threshold
            );
        }
    }
    text
}

/// A line of doubt where the model is asked about what it never saw.
fn doubt(chosen: &RunOutcome) -> String {
    if chosen.without_data <= 0.1 {
        return String::new();
    }
    let share = 100.0 * chosen.without_data;
    format!(
        "\nbut in {share:.0} % of its steps the model has no data: there the figures rest on nothing that was seen"
    )
}

impl Evolve {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let task = self.task.load()?;
        let model = load_model_for(&self.model, &task, shell)?;
        let mut neat = match self.preset {
            Preset::Paper => Config::wahby2016(),
            Preset::BallKeeper => Config::ball_keeper(),
        };
        neat.population = self.population.unwrap_or(neat.population);
        let config = EvolutionConfig {
            runs: self.runs,
            generations: self.generations,
            episodes: self.episodes,
            neat,
            ..EvolutionConfig::default()
        };
        let plan = EvolutionPlan::new(&model, &task, config, TRIAL_PLANTS, self.seed.seed);
        let progress = shell.progress("evolve", u64::from(self.runs) * u64::from(self.generations));
        let watch = |run, generation: &Generation| match self.json_lines {
            true => shell.line(&Line { run, generation }),
            false => Ok(()),
        };
        let checkpoint = Duration::from_secs(self.checkpoint);
        let care = Care { checkpoint, progress: &progress, watch: &watch };
        let outcome = plan.execute(&model, &self.out, self.resume, &care)?;
        drop(progress);
        let Some(outcome) = outcome else {
            return Err(Interrupted::resumable(&self.out));
        };
        if model.is_virtual() {
            shell.note("a model of virtual plants");
        }
        match self.json_lines {
            true => shell.line(&outcome),
            false => shell.result(&self.text(&outcome, &task), &outcome),
        }
    }

    fn text(&self, outcome: &Outcome, task: &Targets) -> String {
        let mut best: Vec<f64> = outcome.runs.iter().map(|run| run.best_fitness).collect();
        best.sort_by(f64::total_cmp);
        let chosen = &outcome.runs[outcome.champion];
        let champion = self.out.join("champion.json");
        format!(
            "{} runs, {} evaluations, {:.1} s ({:.1} s of processor time)\n\
             best fitness of a run: {:.2} to {:.2} cm, median {:.2} (best possible {:.2})\n\
             champion: run {}, {} links, {:.2} cm over fresh plants of the model; to expect on a plant that nobody met: {:.2} cm (sd {:.2}){}\n\
             wrote {}\nnext: tropism run --rig greenhouse --controller {} --out steered",
            outcome.runs.len(),
            outcome.evaluations,
            outcome.wall_seconds,
            outcome.cpu_seconds,
            best[0],
            best[best.len() - 1],
            statistics::median(&best),
            task.best(),
            outcome.champion,
            chosen.links,
            chosen.trial.mean,
            chosen.transfer.mean,
            chosen.transfer.sd,
            doubt(chosen),
            champion.display(),
            champion.display(),
        )
    }
}
