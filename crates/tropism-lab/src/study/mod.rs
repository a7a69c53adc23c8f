//! The whole paper as one workflow, on virtual plants, in a folder that can be resumed.
//!
//! In: a [`StudyConfig`]. Out: its numbers beside the paper's, and a report. Each stage executes the plan of another
//! workflow: open-loop experiments, the model of their tracks, evolution on the model, random controllers as a
//! baseline, experiments with unseen plants, and the report. Beyond the paper, a rule that is tuned for arrival on a model of
//! the stem steers the same plants. A stage that is finished on the disk is not repeated.

mod config;
mod results;
mod growing;
mod page;
mod status;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::{Deserialize, Serialize};
use tropism::parallel;
use tropism::simulation::ModelKind;
use tropism::task::{Reading, Task};
use tropism::track::PAPER_PERIOD_MIN;
use tropism_bean::tent::Greenhouse;

pub use self::config::StudyConfig;
use self::config::{CONTROLLERS, PHOTOGRAPHED};
pub(crate) use self::page::page;
pub(crate) use self::results::SATURATION_SHARE;
pub use self::results::{ManyNumbers, RealityNumbers, StudyResults};
use self::results::{RandomNumbers, StudyFolder, read_seconds};
pub(crate) use self::status::status;
pub use self::status::{StageStatus, StudyStatus};
use crate::baseline::BaselinePlan;
use crate::controller::ControllerSpec;
use crate::evolve::EvolvePlan;
use crate::files;
use crate::finished_run::make_small;
use crate::fit::FitPlan;
use crate::monitor::{Part, Titled};
use crate::run::{RunConfig, RunPlan};
use crate::sequences;
use crate::transfer::{NamedController, TransferPlan};
use crate::tune::TunePlan;
use crate::workflow::check_same;
use crate::{Error, FolderLock, Monitor, Workflow, lock};

/// Repeats the paper on virtual plants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StudyPlan {
    /// Folder of the study.
    pub out: PathBuf,
    /// Whether to continue a study in `out`.
    pub resume: bool,
    /// Whether every photograph and the stems of the ground truth are kept: some 700 MB at the paper's size. Otherwise a
    /// run keeps what figures show of it.
    pub keep_photographs: bool,
    /// Everything that decides the results.
    pub config: StudyConfig,
}

impl Default for StudyPlan {
    fn default() -> Self {
        Self {
            out: "tropism-study".into(),
            resume: false,
            keep_photographs: false,
            config: StudyConfig::default(),
        }
    }
}

/// The stages of a study, in order: the names in `seconds.json`.
const STAGES: [&str; 8] = [
    "open-loop experiments",
    "model",
    "evolution",
    "random controllers",
    "tuned rule",
    "reality",
    "many plants",
    "report",
];

impl Workflow for StudyPlan {
    type Results = StudyResults;

    const SCHEMA: &'static str = "tropism.study/1";

    fn check(&self) -> Result<(), Error> {
        self.config.check()
    }

    fn prepare(&mut self) -> Result<(), Error> {
        let StudyConfig { task, seed, .. } = &mut self.config;
        sequences::draw(task, &Greenhouse::default(), PAPER_PERIOD_MIN, *seed)
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<StudyResults, Error> {
        let _lock = self.claim()?;
        monitor.note("a study on virtual plants: nothing here is a measurement of a living plant");
        growing::write(self, 0)?;
        let (first, report) =
            (self.out.join("open-loop/1/photographs/000000.jpg"), self.out.join("report.html"));
        monitor.note(&format!(
            "first photograph: {}; the report grows: {}",
            first.display(),
            report.display()
        ));
        let mut study = StudyStages { plan: self, monitor, stage: 0, seconds: read_seconds(&self.out) };
        study.time(StudyStages::open_loop)?;
        growing::write(self, 1)?;
        study.time(StudyStages::fit)?;
        study.time(StudyStages::evolve)?;
        growing::write(self, 3)?;
        study.time(StudyStages::random)?;
        study.time(StudyStages::tune)?;
        study.time(StudyStages::reality)?;
        study.time(StudyStages::judge)?;
        study.time(StudyStages::report)
    }
}

impl StudyPlan {
    /// The plan that goes on with the study in the folder `out`, from its `study.toml` alone.
    ///
    /// # Errors
    /// [`Error::File`] if there is none, or it cannot be read.
    pub fn of_folder(out: &Path) -> Result<Self, Error> {
        let config = files::read_toml(&out.join("study.toml"))?;
        Ok(Self { out: out.to_owned(), resume: true, config, ..Self::default() })
    }

    /// Makes the folder, or checks that the study in it is this one, and locks it until the result is dropped.
    fn claim(&self) -> Result<FolderLock, Error> {
        let file = self.out.join("study.toml");
        let text = files::toml_of(&file, &self.config)?;
        check_same(&file, &text, self.resume, "a study")?;
        files::make_folder(&self.out)?;
        let lock = lock(&self.out)?;
        files::write(&file, text.as_bytes())?;
        Ok(lock)
    }
}

/// An experiment with one plant.
struct Experiment {
    folder: PathBuf,
    controller: ControllerSpec,
    task: Task,
    seed: u64,
    /// Whether figures show its photographs.
    has_figures: bool,
}

/// A study at work, and the seconds that it has spent in each stage.
struct StudyStages<'s> {
    plan: &'s StudyPlan,
    monitor: &'s dyn Monitor,
    /// The present stage, from 1.
    stage: usize,
    seconds: BTreeMap<String, f64>,
}

impl StudyStages<'_> {
    /// Executes the next stage and adds its time to `seconds.json`. An interrupted stage is an interrupted study.
    fn time<T>(&mut self, stage: impl FnOnce(&Self, &Titled<'_>) -> Result<T, Error>) -> Result<T, Error> {
        let started = Instant::now();
        let name = STAGES[self.stage];
        self.stage += 1;
        let title = format!("{}/{}", self.stage, STAGES.len());
        let monitor = Titled { monitor: self.monitor, title };
        let result = stage(self, &monitor).map_err(|error| error.of_part(&self.plan.out));
        *self.seconds.entry(name.to_owned()).or_default() += started.elapsed().as_secs_f64();
        files::write_unterminated_json(&self.file("seconds.json"), &self.seconds)?;
        result
    }

    fn file(&self, name: &str) -> PathBuf {
        self.plan.out.join(name)
    }

    fn open_loop(&self, monitor: &Titled<'_>) -> Result<(), Error> {
        let config = &self.plan.config;
        let experiment = |number: u32| Experiment {
            folder: self.open_loop_folder(number),
            controller: config.periodic(),
            task: Task::open_loop(config.steps),
            seed: config.plant_seed(number),
            has_figures: true,
        };
        let experiments: Vec<_> = (0..config.experiments).map(experiment).collect();
        self.run_all("photographing beans", &experiments, monitor)
    }

    fn open_loop_folder(&self, number: u32) -> PathBuf {
        self.file("open-loop").join((number + 1).to_string())
    }

    /// Runs experiments in parallel, each in its run folder. One that is over is not run again: its photographs may be gone.
    fn run_all(&self, stage: &str, experiments: &[Experiment], monitor: &Titled<'_>) -> Result<(), Error> {
        let steps = experiments.iter().map(|experiment| u64::from(experiment.task.max_steps)).sum();
        monitor.stage(stage, steps);
        let run = |experiment: &Experiment| {
            let Experiment { folder, controller, task, seed, has_figures } = experiment;
            let config = RunConfig::new(self.plan.config.rig(), controller.clone(), task.clone(), *seed);
            if folder.join("track.csv").exists() && RunConfig::read(folder)? == config {
                monitor.skip(u64::from(task.max_steps));
            } else {
                let plan = RunPlan { out: folder.clone(), resume: true, config, ..RunPlan::default() };
                plan.execute(&Part(monitor))?;
            }
            if self.plan.keep_photographs { Ok(()) } else { make_small(folder, *has_figures) }
        };
        parallel::try_map(experiments.len(), |number| run(&experiments[number])).map(drop)
    }

    fn fit(&self, monitor: &Titled<'_>) -> Result<(), Error> {
        let model = self.plan.config.model.clone();
        let plan = FitPlan { model, out: self.file("model.json"), ..self.fit_to_tracks() };
        plan.execute(monitor).map(drop)
    }

    /// A fit to the tracks of the open-loop experiments.
    fn fit_to_tracks(&self) -> FitPlan {
        let track = |number| self.open_loop_folder(number).join("track.csv");
        let tracks = (0..self.plan.config.experiments).map(track).collect();
        FitPlan { tracks, anyway: true, replace: true, ..FitPlan::default() }
    }

    fn evolve(&self, monitor: &Titled<'_>) -> Result<(), Error> {
        let config = &self.plan.config;
        let plan = EvolvePlan {
            model: self.file("model.json"),
            out: self.file("evolution"),
            task: config.task.clone(),
            evolution: config.evolution.clone(),
            trial_plants: config.trial_plants,
            seed: config.seed,
            resume: true,
            ..EvolvePlan::default()
        };
        plan.execute(monitor).map(drop)
    }

    fn random(&self, monitor: &Titled<'_>) -> Result<(), Error> {
        let file = self.file("random.json");
        if file.exists() {
            return Ok(());
        }
        let config = &self.plan.config;
        let plan = BaselinePlan {
            model: self.file("model.json"),
            task: config.task.clone(),
            neat: config.evolution.neat.clone(),
            count: config.random_controllers,
            seed: config.seed,
            out: Some(self.file("random-champion.json")),
            // That of an interrupted stage is drawn again.
            replace: true,
        };
        let results = plan.execute(monitor)?;
        let numbers = RandomNumbers { count: results.count, best: results.best, median: results.median };
        Ok(files::write_unterminated_json(&file, &numbers)?)
    }

    /// Tunes a rule for arrival on a model of the stems in the same tracks.
    fn tune(&self, monitor: &Titled<'_>) -> Result<(), Error> {
        let (model, out) = (self.file("stem.json"), self.file("rule.json"));
        if out.exists() {
            return Ok(());
        }
        let config = &self.plan.config;
        let fit = FitPlan { kind: ModelKind::STEM, out: model.clone(), ..self.fit_to_tracks() };
        fit.execute(monitor)?;
        let plan = TunePlan {
            model,
            task: config.task.by(Reading::Arrival),
            search: config.rule,
            seed: config.seed,
            out,
            resume: true,
            ..TunePlan::default()
        };
        plan.execute(monitor).map(drop)
    }

    /// The controllers that steer unseen plants, by name.
    fn controllers(&self) -> Result<[(&'static str, ControllerSpec); 5], Error> {
        let [champion, random, periodic, greedy, rule] = CONTROLLERS;
        Ok([
            (champion, ControllerSpec::read(&self.file("evolution/champion.json"))?),
            (random, ControllerSpec::read(&self.file("random-champion.json"))?),
            (periodic, self.plan.config.periodic()),
            (greedy, ControllerSpec::Greedy),
            (rule, ControllerSpec::read(&self.file("rule.json"))?),
        ])
    }

    /// All controllers steer many more plants, without photographs.
    fn judge(&self, monitor: &Titled<'_>) -> Result<(), Error> {
        let config = &self.plan.config;
        let named = |(name, controller): (&str, _)| NamedController { name: name.to_owned(), controller };
        let plan = TransferPlan {
            controllers: self.controllers()?.map(named).into(),
            plants: config.test_plants,
            task: config.task.clone(),
            greenhouse: Greenhouse {
                bean: config.greenhouse.bean.clone(),
                variation: config.greenhouse.variation,
                layout: config.greenhouse.layout.clone(),
                ..Greenhouse::default()
            },
            seed: config.seed,
            resume: true,
            out: self.file("many-plants"),
            ..TransferPlan::default()
        };
        plan.execute(monitor).map(drop)
    }

    /// The champion, greedy and the rule steer the same unseen plants, which are photographed.
    fn reality(&self, monitor: &Titled<'_>) -> Result<(), Error> {
        let config = &self.plan.config;
        let controllers = self.controllers()?;
        let experiments: Vec<Experiment> = controllers
            .iter()
            .filter(|(name, _)| PHOTOGRAPHED.contains(name))
            .flat_map(|(name, controller)| {
                (0..config.reality_plants).map(move |plant| Experiment {
                    folder: self.file("reality").join(name).join((plant + 1).to_string()),
                    controller: controller.clone(),
                    task: config.task.clone(),
                    seed: config.plant_seed(config.experiments + plant),
                    has_figures: *name == CONTROLLERS[0],
                })
            })
            .collect();
        self.run_all("steering unseen beans", &experiments, monitor)
    }

    fn report(&self, monitor: &Titled<'_>) -> Result<StudyResults, Error> {
        monitor.stage("report", 1);
        let folder = StudyFolder::read(&self.plan.out)?;
        let results = folder.results()?;
        files::write(&results.report, folder.page(&results)?.html().as_bytes())?;
        files::write_unterminated_json(&self.file("numbers.json"), &results)?;
        monitor.advance(1);
        Ok(results)
    }
}
