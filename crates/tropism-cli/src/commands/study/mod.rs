//! `tropism study`: the paper, end to end. Here the work is done; [`found`] tells what came of it.

mod found;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Args;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use tropism::evolve::{self, EvolutionConfig};
use tropism::greenhouse::tent::Greenhouse;
use tropism::plant::tip::{TipModel, TipModelConfig};
use tropism::random::{self, Purpose};
use tropism::task::Task;
use tropism::vision::VisionConfig;
use tropism_lab::{ControllerSpec, Error, FinishedRun, Monitor, RunConfig, RunPlan, Workflow, files};
use tropism_neat::Genome;
use tropism_rig::file::RigFile;

use super::evolve::{CHECKPOINT, Care, EvolutionPlan, TRIAL_PLANTS};
use crate::options::{BeanOption, load_model, load_model_for};
use crate::shell::{Interrupted, Progress, Shell};
use found::{Found, RandomFound, read_seconds};

pub(crate) use found::page;

/// Do the whole paper: beans, photographs, model, evolution, and back to beans that nobody met
///
/// Six virtual beans are photographed under lamps that change every six hours; their photographs give tracks, the tracks
/// a model, evolution on the model controllers, and the best of them steers six fresh virtual beans through photographs
/// alone. A report sets figures and numbers beside the paper's. Ctrl-C saves; --resume goes on to the same bits.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism study --quick\n  \
    tropism study studies/paper.toml --out mine --seed 7")]
pub(crate) struct Study {
    /// Study file; the paper by default
    #[arg(value_name = "STUDY.toml")]
    file: Option<PathBuf>,

    /// A small study that ends in about a minute
    #[arg(long, conflicts_with = "file")]
    quick: bool,

    /// Folder to make
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Go on with the study in DIR where it stopped
    #[arg(long)]
    resume: bool,

    /// Seed of all chance, instead of the file's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    #[command(flatten)]
    bean: BeanOption,
}

/// A study: everything that decides its outcome.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct StudyPlan {
    /// Seed of all chance.
    seed: u64,
    /// Open-loop experiments. Paper: 6 (section 2.2.1).
    experiments: u32,
    /// Steps of each. Paper: 1000 (83.3 hours).
    steps: u32,
    /// Steps for which each lamp is lit in them. Paper: 72 (six hours).
    switch_steps: u32,
    /// Random controllers. Paper: two million (section 3.1).
    random_controllers: u64,
    /// Simulated plants on which champions are compared.
    trial_plants: u32,
    /// Fresh plants that the chosen champion steers. Paper: 6 (section 3.2).
    reality_plants: u32,
    /// Targets.
    task: Task,
    /// How tracks become a model.
    model: TipModelConfig,
    /// How controllers are evolved.
    evolution: EvolutionConfig,
    /// How the plant is found in photographs.
    vision: VisionConfig,
    /// The virtual tent.
    greenhouse: Greenhouse,
}

impl Default for StudyPlan {
    fn default() -> Self {
        Self {
            seed: 1,
            experiments: 6,
            steps: 1000,
            switch_steps: 72,
            random_controllers: 2_000_000,
            trial_plants: TRIAL_PLANTS,
            reality_plants: 6,
            task: Task::default(),
            model: TipModelConfig::default(),
            evolution: EvolutionConfig::default(),
            vision: VisionConfig::default(),
            greenhouse: Greenhouse::default(),
        }
    }
}

/// The study that ends in about a minute.
const QUICK: &str = include_str!("../../../../../studies/quick.toml");

/// A controller that meets reality, by the name of its folder.
const IN_REALITY: [&str; 4] = ["champion", "random", "periodic", "chase"];

/// Advances one progress line for many runs at a time.
struct Runs<'p>(&'p Progress);

impl Monitor for Runs<'_> {
    fn advance(&self, count: u64) {
        self.0.add(count);
    }

    fn may_go_on(&self) -> bool {
        !Shell::is_interrupted()
    }
}

/// A study at work in its folder.
struct Work<'s> {
    plan: StudyPlan,
    out: PathBuf,
    shell: &'s Shell,
    seconds: BTreeMap<String, f64>,
}

impl Study {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let mut plan: StudyPlan = match (&self.file, self.quick) {
            (Some(path), _) => files::read_toml(path)?,
            (None, true) => toml::from_str(QUICK).context("studies/quick.toml")?,
            (None, false) => StudyPlan::default(),
        };
        plan.seed = self.seed.unwrap_or(plan.seed);
        if let Some(bean) = self.bean.load()? {
            plan.greenhouse.bean = bean;
        }
        let name = self.file.as_ref().map_or_else(String::new, |path| format!("{}: ", path.display()));
        plan.check().map_err(|error| anyhow::anyhow!("{name}{error:#}"))?;
        let default = if self.quick { "tropism-study-quick" } else { "tropism-study" };
        let out = self.out.unwrap_or_else(|| default.into());
        claim(&out, &plan, self.resume)?;
        let seconds = read_seconds(&out);
        Work { plan, out, shell, seconds }.execute()
    }
}

fn claim(out: &Path, plan: &StudyPlan, is_resumed: bool) -> Result<()> {
    let (file, text) = (out.join("study.toml"), toml::to_string(plan)?);
    if file.exists() {
        let shown = out.display();
        ensure!(is_resumed, "{shown}: found a study here already, wanted a new folder (--out) or --resume");
        ensure!(
            files::read_text(&file)? == text,
            "{}: found a study with other settings, wanted the same; use another folder",
            file.display()
        );
        return Ok(());
    }
    files::make_folder(out)?;
    Ok(files::write(&file, text.as_bytes())?)
}

impl StudyPlan {
    fn check(&self) -> Result<()> {
        let within = |key: &str, found: u64, most: u64| {
            ensure!((1..=most).contains(&found), "found {key} = {found}, wanted 1 to {most}");
            Ok(())
        };
        within("experiments", self.experiments.into(), 1000)?;
        within("steps", self.steps.into(), 100_000)?;
        within("switch_steps", self.switch_steps.into(), 100_000)?;
        within("random_controllers", self.random_controllers, 1_000_000_000)?;
        within("trial_plants", self.trial_plants.into(), 1_000_000)?;
        within("reality_plants", self.reality_plants.into(), 10_000)?;
        self.task.check().context("task")?;
        self.evolution.check().context("evolution")?;
        self.rig().check()?;
        Ok(())
    }

    /// The controller of the open-loop experiments.
    fn periodic(&self) -> ControllerSpec {
        ControllerSpec::periodic(f64::from(self.switch_steps) * self.rig().period_min)
    }

    fn rig(&self) -> RigFile {
        RigFile::greenhouse(self.greenhouse.clone(), self.vision.clone())
    }

    /// The seed of a plant: those of the open-loop experiments come first, those of reality after all of them.
    fn plant_seed(&self, number: u32) -> u64 {
        random::derive(self.seed, Purpose::Plant, number.into())
    }
}

impl Work<'_> {
    fn execute(mut self) -> Result<()> {
        self.shell.note("a study on virtual plants: nothing here is a measurement of a living plant");
        self.stage("open-loop experiments", Self::open_loop)?;
        self.stage("model", Self::fit)?;
        self.stage("evolution", Self::evolve)?;
        self.stage("random controllers", Self::random)?;
        self.stage("reality", Self::reality)?;
        self.stage("report", Self::report)
    }

    /// Does one stage and adds its time to the book.
    fn stage(&mut self, name: &str, work: impl FnOnce(&Self) -> Result<()>) -> Result<()> {
        let started = Instant::now();
        let result = work(self);
        *self.seconds.entry(name.to_owned()).or_default() += started.elapsed().as_secs_f64();
        files::write(
            &self.out.join("seconds.json"),
            serde_json::to_string_pretty(&self.seconds)?.as_bytes(),
        )?;
        result
    }

    fn interrupted(&self) -> anyhow::Error {
        Interrupted::resumable(&self.out)
    }

    /// Runs many experiments on all threads: folder, controller, task and seed of each.
    fn run_all(&self, what: &str, runs: Vec<(PathBuf, ControllerSpec, Task, u64)>) -> Result<()> {
        let steps: u64 = runs.iter().map(|(_, _, task, _)| u64::from(task.max_steps)).sum();
        let progress = self.shell.progress(what, steps);
        let finished: Vec<bool> = runs
            .into_par_iter()
            .with_max_len(1)
            .map(|(out, controller, task, seed)| {
                let config = RunConfig::new(self.plan.rig(), controller, task, seed);
                let plan = RunPlan { out, resume: true, speed: None, config };
                match plan.execute(&Runs(&progress)) {
                    Err(Error::Interrupted { .. }) => Ok(false),
                    done => Ok(done.map(|_| true)?),
                }
            })
            .collect::<Result<_>>()?;
        if finished.iter().all(|&is_finished| is_finished) { Ok(()) } else { Err(self.interrupted()) }
    }

    fn open_loop(&self) -> Result<()> {
        let run = |number: u32| {
            let folder = self.out.join("open-loop").join((number + 1).to_string());
            let controller = self.plan.periodic();
            (folder, controller, Task::open_loop(self.plan.steps), self.plan.plant_seed(number))
        };
        let runs: Vec<_> = (0..self.plan.experiments).map(run).collect();
        self.run_all("photographing beans", runs)
    }

    fn fit(&self) -> Result<()> {
        let runs = FinishedRun::read_numbered(&self.out.join("open-loop"))?;
        let model = TipModel::fit(runs.iter().map(|run| &run.track), self.plan.model.clone())?
            .of_virtual_plants(true);
        Ok(files::write(&self.model_file(), model.to_json().as_bytes())?)
    }

    fn model_file(&self) -> PathBuf {
        self.out.join("model.json")
    }

    fn evolve(&self) -> Result<()> {
        let model = load_model_for(&self.model_file(), &self.plan.task, self.shell)?;
        let config = self.plan.evolution.clone();
        let total = u64::from(config.runs) * u64::from(config.generations);
        let progress = self.shell.progress("evolving controllers", total);
        let plan =
            EvolutionPlan::new(&model, &self.plan.task, config, self.plan.trial_plants, self.plan.seed);
        let care = Care { checkpoint: CHECKPOINT, progress: &progress, watch: &|_, _| Ok(()) };
        let outcome = plan.execute(&model, &self.out.join("evolution"), true, &care)?;
        if outcome.is_some() { Ok(()) } else { Err(self.interrupted()) }
    }

    fn random(&self) -> Result<()> {
        let file = self.out.join("random.json");
        if file.exists() {
            return Ok(());
        }
        let model = load_model(&self.model_file())?;
        let progress = self.shell.progress("random controllers", self.plan.random_controllers);
        let tick = |count| {
            progress.add(count);
            !Shell::is_interrupted()
        };
        let (plan, neat) = (&self.plan, &self.plan.evolution.neat);
        let found = evolve::baseline(&model, &plan.task, neat, plan.seed, plan.random_controllers, tick);
        let found = found.ok_or_else(|| self.interrupted())?;
        files::write(&self.out.join("random-champion.json"), found.champion.to_json().as_bytes())?;
        let found = RandomFound { count: found.count, best: found.best, median: found.median };
        Ok(files::write(&file, serde_json::to_string_pretty(&found)?.as_bytes())?)
    }

    fn controllers(&self) -> Result<[(&'static str, ControllerSpec); 4]> {
        let network = |file: &Path| -> Result<_> {
            let genome = files::read_as(file, Genome::from_json)?;
            Ok(ControllerSpec::network(genome)?)
        };
        let [champion, random, periodic, chase] = IN_REALITY;
        Ok([
            (champion, network(&self.out.join("evolution/champion.json"))?),
            (random, network(&self.out.join("random-champion.json"))?),
            (periodic, self.plan.periodic()),
            (chase, ControllerSpec::Greedy),
        ])
    }

    /// The champion and three others steer the same fresh beans.
    fn reality(&self) -> Result<()> {
        let mut runs = Vec::new();
        for (name, controller) in self.controllers()? {
            for plant in 0..self.plan.reality_plants {
                let folder = self.out.join("reality").join(name).join((plant + 1).to_string());
                let seed = self.plan.plant_seed(self.plan.experiments + plant);
                runs.push((folder, controller.clone(), self.plan.task.clone(), seed));
            }
        }
        self.run_all("steering fresh beans", runs)
    }

    fn report(&self) -> Result<()> {
        let progress = self.shell.progress("report", 1);
        let found = Found::read(&self.out)?;
        let numbers = found.numbers(self.out.join("report.html"));
        files::write(&numbers.report, found.page()?.html().as_bytes())?;
        files::write(&self.out.join("numbers.json"), serde_json::to_string_pretty(&numbers)?.as_bytes())?;
        drop(progress);
        self.shell.result(&numbers.text(), &numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_written_out_is_the_default() {
        let written: StudyPlan = toml::from_str(include_str!("../../../../../studies/paper.toml")).unwrap();
        assert_eq!(written, StudyPlan::default());
        written.check().unwrap();
    }

    #[test]
    fn the_quick_study_is_a_small_paper() {
        let quick: StudyPlan = toml::from_str(QUICK).unwrap();
        quick.check().unwrap();
        assert_eq!((&quick.task, &quick.model), (&StudyPlan::default().task, &StudyPlan::default().model));
    }

    #[test]
    fn a_resolved_study_reads_back() {
        let text = toml::to_string(&StudyPlan::default()).unwrap();
        assert_eq!(toml::from_str::<StudyPlan>(&text).unwrap(), StudyPlan::default());
    }
}
