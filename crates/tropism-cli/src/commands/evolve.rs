//! `tropism evolve`: controllers for a model.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use anyhow::Result;
use clap::{Args, ValueEnum};
use serde::Serialize;
use tropism::evolve::{Method, Start};
use tropism_lab::evolve::{CHECKPOINT_S, EvolutionRunSummary, EvolveConfig, EvolvePlan, EvolveResults};
use tropism_lab::files::shell_word;
use tropism_lab::units::plural;
use tropism_lab::{Monitor, Work};
use tropism_neat::{Config, Generation};

use crate::options::TaskOption;
use crate::progress::{ProgressMonitor, check_outputs, execute_with, for_user};
use crate::shell::Shell;
use crate::units::UnitsOption;

/// Evolve controllers on a model with NEAT, eqs. (4)-(9), Table 1
///
/// Each run ends with a champion. The best of them, champion.json, has the highest expected fitness on an unseen plant:
/// the mean over models that are each made of a single plant. Each run is saved every minute and at Ctrl-C or SIGTERM.
/// --resume continues with the same results as without an interruption, also after a kill.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism evolve --model model.json --out evolution --runs 4 --generations 500\n  \
    tropism evolve --model model.json --out evolution --config studies/evolution.toml\n  \
    tropism evolve --out evolution --resume\n  \
    tropism evolve --model model.json --out evolution --json-lines | jq '[.run, .generation, .best]'")]
pub(crate) struct Evolve {
    /// Model, from `tropism fit`; with --resume that of the evolution in DIR
    #[arg(long, value_name = "model.json", required_unless_present = "resume")]
    model: Option<PathBuf>,

    /// Folder to write to
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Settings: seed, task, runs, generations and all parameters of NEAT, as in studies/evolution.toml; options override them
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,

    #[command(flatten)]
    task: TaskOption,

    /// Number of independent runs; 20 by default
    #[arg(long, value_name = "N")]
    runs: Option<u32>,

    /// Generations of each run; 2000 by default
    #[arg(long, value_name = "N")]
    generations: Option<u32>,

    /// Population size; that of the preset (50) by default
    #[arg(long, value_name = "N")]
    population: Option<usize>,

    /// Parameters of NEAT: Table 1 with MultiNEAT's defaults (the default), or its ball-keeper's
    #[arg(long, value_enum, conflicts_with = "config")]
    preset: Option<Preset>,

    /// Simulated plants whose mean is a genome's fitness; 1 by default
    #[arg(long, value_name = "N")]
    episodes: Option<u32>,

    /// First population: random networks (the default), or the greedy network and its mutants, which needs the sensor
    /// to_target
    #[arg(long, value_enum)]
    start: Option<StartOption>,

    /// First population: the network in champion.json and mutants of it; its sensors count. By CMA-ES its weights are searched
    #[arg(long, value_name = "champion.json", conflicts_with_all = ["start", "resume"])]
    from: Option<PathBuf>,

    /// Search: NEAT (the default), which grows networks, or CMA-ES on the weights of one network; by default one without hidden
    /// neurons
    #[arg(long, value_enum)]
    method: Option<MethodOption>,

    /// Continue the evolution in DIR, also with more generations
    #[arg(long)]
    resume: bool,

    /// Longest time between two checkpoints of a run; 0 saves each generation
    #[arg(long, default_value_t = CHECKPOINT_S, value_name = "SECONDS")]
    checkpoint: u64,

    /// Print one JSON object for each generation as it comes, and the one of --json at the end
    #[arg(long, conflicts_with_all = ["unit", "list", "engine"])]
    json_lines: bool,

    /// Seed of all random numbers, 1 by default: the same seed gives the same results
    // TOML, in which it is kept, has no larger numbers.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    seed: Option<u64>,

    #[command(flatten)]
    units: UnitsOption,
}

#[derive(Clone, Copy, ValueEnum)]
enum Preset {
    Paper,
    BallKeeper,
}

#[derive(Clone, Copy, ValueEnum)]
enum StartOption {
    Random,
    Greedy,
}

#[derive(Clone, Copy, ValueEnum)]
enum MethodOption {
    Neat,
    CmaEs,
}

impl Evolve {
    fn plan(&self) -> Result<EvolvePlan> {
        let has_settings = || self.config.is_none() && self.out.join("evolution.toml").exists();
        let is_read = self.resume && (self.model.is_none() || has_settings());
        let found = is_read.then(|| EvolvePlan::of_folder(&self.out)).transpose().map_err(for_user)?;
        let settings = match (&self.config, &found) {
            (Some(path), _) => EvolveConfig::read(path).map_err(for_user)?.plan(),
            (None, Some(found)) => found.clone(),
            (None, None) => EvolvePlan::default(),
        };
        let model = self.model.clone().or(found.map(|found| found.model));
        let mut plan = EvolvePlan {
            model: model.unwrap_or_else(|| settings.model.clone()),
            out: self.out.clone(),
            resume: self.resume,
            checkpoint_s: self.checkpoint,
            ..settings
        };
        if self.task.task.is_some() {
            plan.task = self.task.load()?;
        }
        if let Some(champion) = &self.from {
            plan.start_from(champion).map_err(for_user)?;
        }
        let evolution = &mut plan.evolution;
        match self.preset {
            Some(Preset::Paper) => evolution.neat = Config::wahby2016(),
            Some(Preset::BallKeeper) => evolution.neat = Config::ball_keeper(),
            None => {}
        }
        match self.start {
            Some(StartOption::Random) => evolution.start = Start::Random,
            Some(StartOption::Greedy) => evolution.start = Start::Greedy,
            None => {}
        }
        match self.method {
            Some(MethodOption::Neat) => evolution.method = Method::Neat,
            Some(MethodOption::CmaEs) => evolution.method = Method::CmaEs,
            None => {}
        }
        evolution.runs = self.runs.unwrap_or(evolution.runs);
        evolution.generations = self.generations.unwrap_or(evolution.generations);
        evolution.episodes = self.episodes.unwrap_or(evolution.episodes);
        evolution.neat.population = self.population.unwrap_or(evolution.neat.population);
        plan.seed = self.seed.unwrap_or(plan.seed);
        Ok(plan)
    }

    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let plan = self.plan()?;
        check_outputs(&plan.outputs(), [self.task.task.as_ref(), self.config.as_ref(), self.from.as_ref()])?;
        if !self.json_lines {
            return self.units.execute(&plan, shell, |results| text(&plan, results));
        }
        let progress = ProgressMonitor::new(shell);
        let monitor = GenerationPrinter { shell, progress, error: Mutex::new(None) };
        let results = execute_with(&plan, &monitor);
        match monitor.error.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(error) => Err(error),
            None => shell.line(&results?),
        }
    }
}

fn text(plan: &EvolvePlan, results: &EvolveResults) -> String {
    let [least, median, greatest] = results.best_fitness_range();
    let (chosen, unit) = (results.chosen(), plan.task.kind.unit());
    let expected = match &chosen.withheld {
        None => format!("{:.2} {unit} (sd {:.2})", chosen.transfer.mean, chosen.transfer.sd),
        Some(reason) => format!("withheld, for {reason}"),
    };
    let possible = plan.task.best_fitness().map_or_else(String::new, |best| {
        let above = if greatest > best { "; a tip that leans away below the start scores more" } else { "" };
        format!(" (best possible {best:.2}{above})")
    });
    format!(
        "{}, {}, {:.1} s ({:.1} s of processor time)\n\
         best fitness of a run: {least:.2} to {greatest:.2} {unit}, median {median:.2}{possible}\n\
         champion: run {}{}, {} links, {:.2} {unit} on unseen plants of the model; expected on unseen plants: {expected}{}\n\
         wrote {champion}\nnext: tropism run --rig greenhouse --controller {word} --out steered",
        plural(results.runs.len(), "run"),
        plural(results.evaluations, "evaluation"),
        results.wall_seconds,
        results.cpu_seconds,
        results.champion,
        if chosen.is_start { ", the controller that it started from" } else { "" },
        chosen.links,
        chosen.trial.mean,
        warning(chosen),
        champion = plan.out.join("champion.json").display(),
        word = shell_word(&plan.out.join("champion.json")),
    )
}

/// Share of steps without data from which the fitness in the model is uncertain; chosen by hand.
const DOUBTFUL_SHARE: f64 = 0.1;

/// A line of warning if the champion steers plants to where the model has no data.
fn warning(chosen: &EvolutionRunSummary) -> String {
    if chosen.without_data <= DOUBTFUL_SHARE {
        return String::new();
    }
    let percent = 100.0 * chosen.without_data;
    format!("\nbut in {percent:.0} % of its steps the model has no data: these fitness values are uncertain")
}

/// Prints each generation as a line of JSON, beside the progress.
struct GenerationPrinter<'s> {
    shell: &'s Shell,
    progress: ProgressMonitor<'s>,
    /// Why a line could not be printed: the evolution is asked to stop.
    error: Mutex<Option<anyhow::Error>>,
}

/// A generation as `--json-lines` prints it.
#[derive(Serialize)]
struct GenerationLine<'g> {
    run: u32,
    #[serde(flatten)]
    generation: &'g Generation,
}

impl Monitor for GenerationPrinter<'_> {
    fn next(&self) -> Option<&dyn Monitor> {
        Some(&self.progress)
    }

    fn generation(&self, run: u32, generation: &Generation) {
        if let Err(error) = self.shell.line(&GenerationLine { run, generation }) {
            self.error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        }
    }

    fn may_go_on(&self) -> bool {
        let has_error = self.error.lock().unwrap_or_else(PoisonError::into_inner).is_some();
        !has_error && self.progress.may_go_on()
    }
}
