//! `tropism study`: the paper, end to end.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Args;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use tropism::control::network::NetworkController;
use tropism::evolve::{self, EvolutionConfig, Trial};
use tropism::experiment::files;
use tropism::greenhouse::tent::Greenhouse;
use tropism::plant::tip::{TipModel, TipModelConfig};
use tropism::random::{self, Draws, Purpose};
use tropism::report::{self, Figure, NumberRow, Page, Plants, Table};
use tropism::simulation::simulate;
use tropism::task::Task;
use tropism::track::PERIOD_MIN;
use tropism::vision::VisionConfig;
use tropism_neat::Genome;
use tropism_rig::file::RigFile;

use super::evolve::{EvolutionPlan, Outcome as Evolved, TRIAL_PLANTS};
use super::report::scores;
use super::run::RunPlan;
use crate::controller::{LoadedController, SIX_HOURS};
use crate::findings::{self, History, RunFound};
use crate::options::{load_model, load_model_for};
use crate::shell::{Interrupted, Shell};

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
            switch_steps: SIX_HOURS,
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
const QUICK: &str = include_str!("../../../../studies/quick.toml");

/// What a study found: the numbers beside the paper's.
#[derive(Serialize)]
struct Numbers {
    seed: u64,
    is_virtual: bool,
    best_possible: f64,
    best_evolved: f64,
    champion_mean_in_model: f64,
    champion_expected_in_reality: f64,
    saturation_generation: Option<usize>,
    best_random: f64,
    median_random: f64,
    random_mean_in_model: f64,
    periodic_mean_in_model: f64,
    chase_mean_in_model: f64,
    reality_champion: Reality,
    reality_random: Reality,
    reality_periodic: Reality,
    reality_chase: Reality,
    share_kept: f64,
    hours_to_end: f64,
    report: PathBuf,
}

/// How a controller did on plants that nobody met.
#[derive(Clone, Copy, Serialize)]
struct Reality {
    mean: f64,
    sd: f64,
    best: f64,
    worst: f64,
    plants: usize,
}

/// A controller that meets reality, by the name of its folder.
const IN_REALITY: [&str; 4] = ["champion", "random", "periodic", "chase"];

#[derive(Serialize, Deserialize)]
struct RandomFound {
    count: u64,
    best: f64,
    median: f64,
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
        let out = self.out.display();
        Interrupted(format!("{out} is saved; the same command with --resume goes on")).into()
    }

    /// Runs many experiments on all threads: folder, controller, task and seed of each.
    fn run_all(&self, what: &str, runs: &[(PathBuf, LoadedController, Task, u64)]) -> Result<()> {
        let steps: u64 = runs.iter().map(|(_, _, task, _)| u64::from(task.max_steps)).sum();
        let progress = self.shell.progress(what, steps);
        let finished: Vec<bool> = runs
            .par_iter()
            .with_max_len(1)
            .map(|(folder, controller, task, seed)| {
                let mut taken = 0;
                let mut watch = |_: &_| {
                    progress.add(1);
                    taken += 1;
                    if Shell::is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                };
                let plan = RunPlan::new(self.plan.rig(), controller, task.clone(), *seed);
                let track = plan.execute(controller, folder, true, &mut watch)?;
                progress.add(u64::from(task.max_steps).saturating_sub(taken));
                Ok(track.is_some())
            })
            .collect::<Result<_>>()?;
        if finished.iter().all(|&is_finished| is_finished) { Ok(()) } else { Err(self.interrupted()) }
    }

    fn open_loop(&self) -> Result<()> {
        let run = |number: u32| {
            let folder = self.out.join("open-loop").join((number + 1).to_string());
            let controller = LoadedController::Periodic(self.plan.switch_steps);
            (folder, controller, Task::open_loop(self.plan.steps), self.plan.plant_seed(number))
        };
        let runs: Vec<_> = (0..self.plan.experiments).map(run).collect();
        self.run_all("photographing beans", &runs)
    }

    fn fit(&self) -> Result<()> {
        let runs = RunFound::read_numbered(&self.out.join("open-loop"))?;
        let model = TipModel::fit(runs.iter().map(|run| &run.track), self.plan.model.clone())?;
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
        let outcome = plan.execute(&model, &self.out.join("evolution"), true, &progress)?;
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

    fn controllers(&self) -> Result<[(&'static str, LoadedController); 4]> {
        let network = |file: &Path| -> Result<_> {
            let genome = files::read_as(file, Genome::from_json)?;
            Ok(LoadedController::Network(Box::new(genome)))
        };
        let [champion, random, periodic, chase] = IN_REALITY;
        Ok([
            (champion, network(&self.out.join("evolution/champion.json"))?),
            (random, network(&self.out.join("random-champion.json"))?),
            (periodic, LoadedController::Periodic(self.plan.switch_steps)),
            (chase, LoadedController::Chase),
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
        self.run_all("steering fresh beans", &runs)
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

fn read_seconds(out: &Path) -> BTreeMap<String, f64> {
    // Times are for people to read; a study without them is whole.
    files::read_as(&out.join("seconds.json"), |text| serde_json::from_str(text)).unwrap_or_default()
}

/// The report of the study in `folder`.
pub(crate) fn page(folder: &Path) -> Result<Page> {
    Found::read(folder)?.page()
}

/// All that lies in the folder of a study.
struct Found {
    out: PathBuf,
    plan: StudyPlan,
    model: TipModel,
    open_loop: Vec<RunFound>,
    history: History,
    evolved: Evolved,
    champions: Vec<Genome>,
    random: RandomFound,
    random_champion: Genome,
    reality: BTreeMap<&'static str, Vec<RunFound>>,
}

impl Found {
    fn read(out: &Path) -> Result<Self> {
        let evolution = out.join("evolution");
        let evolved: Evolved =
            files::read_as(&evolution.join("summary.json"), |text| serde_json::from_str::<Evolved>(text))?;
        let champion = |index| {
            let file = evolution.join("champions").join(format!("run-{index:02}.json"));
            files::read_as(&file, Genome::from_json)
        };
        let mut reality = BTreeMap::new();
        for name in IN_REALITY {
            let runs = RunFound::read_numbered(&out.join("reality").join(name))?;
            ensure!(!runs.is_empty(), "{}: found no reality/{name}, wanted a finished study", out.display());
            reality.insert(name, runs);
        }
        Ok(Self {
            out: out.to_owned(),
            plan: files::read_toml(&out.join("study.toml"))?,
            model: load_model(&out.join("model.json"))?,
            open_loop: RunFound::read_numbered(&out.join("open-loop"))?,
            history: History::read(&evolution.join("history.csv"))?,
            champions: (0..evolved.runs.len()).map(champion).collect::<Result<_, _>>()?,
            evolved,
            random: files::read_as(&out.join("random.json"), |text| serde_json::from_str(text))?,
            random_champion: files::read_as(&out.join("random-champion.json"), Genome::from_json)?,
            reality,
        })
    }

    fn trial(&self, controller: &LoadedController) -> Trial {
        let task = &self.plan.task;
        let build = || controller.build(task);
        evolve::trial(std::slice::from_ref(&self.model), task, build, self.plan.seed, self.plan.trial_plants)
    }

    fn numbers(&self, report: PathBuf) -> Numbers {
        let best_evolved =
            self.evolved.runs.iter().map(|run| run.best_fitness).fold(f64::NEG_INFINITY, f64::max);
        let champion = &self.evolved.runs[self.evolved.champion];
        let reality = IN_REALITY.map(|name| self.in_reality(name));
        Numbers {
            seed: self.plan.seed,
            is_virtual: true,
            best_possible: self.plan.task.best(),
            best_evolved,
            champion_mean_in_model: champion.trial.mean,
            champion_expected_in_reality: champion.transfer.mean,
            saturation_generation: self.history.saturation(0.98),
            best_random: self.random.best,
            median_random: self.random.median,
            random_mean_in_model: self
                .trial(&LoadedController::Network(Box::new(self.random_champion.clone())))
                .mean,
            periodic_mean_in_model: self.trial(&LoadedController::Periodic(self.plan.switch_steps)).mean,
            chase_mean_in_model: self.trial(&LoadedController::Chase).mean,
            share_kept: reality[0].mean / champion.trial.mean,
            hours_to_end: self.hours_to_end(),
            reality_champion: reality[0],
            reality_random: reality[1],
            reality_periodic: reality[2],
            reality_chase: reality[3],
            report,
        }
    }

    fn in_reality(&self, name: &str) -> Reality {
        let runs = &self.reality[name];
        let scores: Vec<f64> = runs.iter().map(|run| self.plan.task.fitness(&run.track)).collect();
        let count = scores.len() as f64;
        let mean = scores.iter().sum::<f64>() / count;
        let variance =
            scores.iter().map(|score| (score - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        Reality {
            mean,
            sd: variance.sqrt(),
            best: scores.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            worst: scores.iter().copied().fold(f64::INFINITY, f64::min),
            plants: scores.len(),
        }
    }

    /// Mean time of the champion's plants until the end of their experiments, in hours.
    fn hours_to_end(&self) -> f64 {
        let runs = &self.reality["champion"];
        let steps: usize = runs.iter().map(|run| run.track.samples.len() - 1).sum();
        steps as f64 / runs.len() as f64 * PERIOD_MIN / 60.0
    }

    /// The simulated track of a network, and its fitness.
    fn simulated(&self, number: &'static str, title: &str, genome: &Genome) -> Result<Figure> {
        let task = &self.plan.task;
        let draws = Draws::new(self.plan.seed, Purpose::Trial, [0; 3]);
        let track = simulate(&self.model, &mut NetworkController::new(genome)?, task, draws);
        let fitness = task.fitness(&track);
        Ok(report::steering(number, title, &track, &task.targets, fitness, Plants::ModelOfVirtual))
    }

    fn figures(&self) -> Result<Vec<Figure>> {
        let mut figures = findings::open_loop_figures(&self.open_loop)?;
        figures.extend(findings::evolution_figures(&self.history, Plants::ModelOfVirtual));
        let mut order: Vec<usize> = (0..self.champions.len()).collect();
        order.sort_by(|&a, &b| self.evolved.runs[b].trial.mean.total_cmp(&self.evolved.runs[a].trial.mean));
        let (best, worst) = (self.evolved.champion, order[order.len() - 1]);
        let second = order.iter().copied().find(|&run| run != best).unwrap_or(best);
        for (number, title, run) in [
            ("7a", "In simulation: the chosen champion", best),
            ("7b", "In simulation: the champion of another run", second),
            ("7c", "In simulation: the poorest champion", worst),
        ] {
            figures.push(self.simulated(number, title, &self.champions[run])?);
        }
        figures.push(self.simulated(
            "7d",
            "In simulation: the best random network",
            &self.random_champion,
        )?);
        // As in the paper, one experiment is shown: the one whose fitness is nearest to the mean.
        let runs = &self.reality["champion"];
        let mean = self.in_reality("champion").mean;
        let distance = |run: &RunFound| (self.plan.task.fitness(&run.track) - mean).abs();
        if let Some(typical) = runs.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))) {
            figures.push(findings::steered_figure(typical));
        }
        Ok(figures)
    }

    fn page(&self) -> Result<Page> {
        let numbers = self.numbers(self.out.join("report.html"));
        let seconds = read_seconds(&self.out);
        let stages =
            ["open-loop experiments", "model", "evolution", "random controllers", "reality", "report"];
        let stages = stages.iter().filter_map(|&name| Some((name.to_owned(), *seconds.get(name)?)));
        let plants = (1..)
            .zip(&self.open_loop)
            .map(|(number, run)| (format!("open-loop bean {number}"), run.plan.seed));
        let fresh = (1..)
            .zip(&self.reality["champion"])
            .map(|(number, run)| (format!("fresh bean {number}"), run.plan.seed));
        Ok(Page {
            title: "Steering beans with light".to_owned(),
            intro: self.intro(&numbers),
            plants: Plants::Virtual,
            numbers: numbers.rows(),
            tables: self.tables(&numbers),
            figures: self.figures()?,
            command: format!("tropism study {}/study.toml", self.out.display()),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seeds: std::iter::once(("study".to_owned(), self.plan.seed)).chain(plants).chain(fresh).collect(),
            stages: stages.collect(),
            config: toml::to_string(&self.plan)?,
        })
    }

    fn intro(&self, numbers: &Numbers) -> String {
        format!(
            "{} virtual beans were photographed every five minutes while lamps to their left and right changed every \
             {:.1} hours. The photographs gave the paths of their tips, the paths a model of how a tip moves, and \
             evolution on that model networks that decide which lamp is lit. The champion was chosen before it met a \
             bean: by its mean fitness over models that were each made of a single plant, which is also what was to be \
             expected of it. It then steered {} beans that neither the model nor evolution had met, through photographs \
             alone.\n\nIn the model it scores {:.2} cm of {:.2} possible; on the fresh beans {:.2} cm were expected and \
             {:.2} cm were reached.",
            self.open_loop.len(),
            f64::from(self.plan.switch_steps) * PERIOD_MIN / 60.0,
            numbers.reality_champion.plants,
            numbers.champion_mean_in_model,
            numbers.best_possible,
            numbers.champion_expected_in_reality,
            numbers.reality_champion.mean
        )
    }

    fn tables(&self, numbers: &Numbers) -> Vec<Table> {
        let row = |name: &str, model: f64, reality: Reality| {
            let Reality { mean, sd, worst, best, .. } = reality;
            vec![
                name.to_owned(),
                format!("{model:.2}"),
                format!("{mean:.2}"),
                format!("{sd:.2}"),
                format!("{worst:.2} to {best:.2}"),
            ]
        };
        let head = ["Controller", "Mean in the model", "Mean on fresh beans", "sd", "Range"];
        let controllers = Table {
            title: "Controllers in the model and on fresh beans".to_owned(),
            caption: format!(
                "Fitness after eq. (9), in cm: over {} simulated plants, and over the same {} virtual beans for each \
                 controller. Chase lights the lamp on the side of the next target.",
                self.plan.trial_plants, numbers.reality_champion.plants
            ),
            head: head.map(str::to_owned).to_vec(),
            rows: vec![
                row("evolved champion", numbers.champion_mean_in_model, numbers.reality_champion),
                row("best random network", numbers.random_mean_in_model, numbers.reality_random),
                row("periodic", numbers.periodic_mean_in_model, numbers.reality_periodic),
                row("chase (by hand)", numbers.chase_mean_in_model, numbers.reality_chase),
            ],
        };
        vec![controllers, scores(&self.reality["champion"])]
    }
}

impl Numbers {
    /// What stands beside what the paper prints.
    fn rows(&self) -> Vec<NumberRow> {
        let row = |what: &str, paper: &str, ours: String, note: &str| NumberRow {
            what: what.to_owned(),
            paper: paper.to_owned(),
            ours,
            note: note.to_owned(),
        };
        let reality = &self.reality_champion;
        let saturation =
            self.saturation_generation.map_or("-".to_owned(), |generation| generation.to_string());
        vec![
            row(
                "Best possible fitness (cm)",
                "15",
                format!("{:.2}", self.best_possible),
                "The way in x to all targets.",
            ),
            row(
                "Best evolved fitness (cm)",
                "14.97",
                format!("{:.2}", self.best_evolved),
                "Best single evaluation.",
            ),
            row(
                "The champion's mean in the model (cm)",
                "",
                format!("{:.2}", self.champion_mean_in_model),
                "Over fresh simulated plants.",
            ),
            row(
                "Expected in reality, said before (cm)",
                "",
                format!("{:.2}", self.champion_expected_in_reality),
                "Mean over models of single plants; the champion is chosen by it.",
            ),
            row(
                "Generation at which the median saturates",
                "1000",
                saturation,
                "Within 2 % of its last value.",
            ),
            row(
                "Best random controller (cm)",
                "8.72",
                format!("{:.2}", self.best_random),
                "Best single evaluation.",
            ),
            row(
                "Mean in reality (cm)",
                "9.96",
                format!("{:.2} (sd {:.2})", reality.mean, reality.sd),
                "Reality is six real plants there, virtual beans here.",
            ),
            row(
                "Share kept in reality",
                "67 %",
                format!("{:.0} %", 100.0 * self.share_kept),
                "Mean in reality over fitness in the model.",
            ),
            row(
                "Hours to the end of an experiment",
                "about 25",
                format!("{:.1}", self.hours_to_end),
                "Until the tip is 13.8 cm high.",
            ),
        ]
    }

    fn text(&self) -> String {
        let mut text = format!("{:<42}  {:>8}  ours (virtual plants)\n", "", "paper");
        for row in self.rows() {
            text += &format!("{:<42}  {:>8}  {}\n", row.what, row.paper, row.ours);
        }
        let others = [
            ("random", &self.reality_random),
            ("periodic", &self.reality_periodic),
            ("chase", &self.reality_chase),
        ];
        let others: Vec<String> =
            others.iter().map(|(name, reality)| format!("{name} {:.2}", reality.mean)).collect();
        text += &format!("on the same fresh beans: {}\n", others.join(", "));
        text + &format!("\nreport: {}", self.report.display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_written_out_is_the_default() {
        let written: StudyPlan = toml::from_str(include_str!("../../../../studies/paper.toml")).unwrap();
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
