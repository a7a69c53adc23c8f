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

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::simulation::ModelKind;
use tropism::task::{Reading, Task};
use tropism::track::PAPER_PERIOD_MIN;
use tropism_bean::tent::Greenhouse;

pub use self::config::StudyConfig;
use self::config::{CONTROLLERS, PHOTOGRAPHED};
pub(crate) use self::page::page;
pub(crate) use self::results::SATURATION_SHARE;
pub use self::results::{ManyNumbers, RealityNumbers, StudyResults};
use self::results::{StudyFolder, read_seconds};
use crate::baseline::BaselinePlan;
use crate::controller::ControllerSpec;
use crate::evolve::EvolvePlan;
use crate::files;
use crate::finished_run::make_small;
use crate::fit::FitPlan;
use crate::monitor::Part;
use crate::run::{RunConfig, RunPlan};
use crate::sequences;
use crate::transfer::{NamedController, TransferPlan};
use crate::tune::TunePlan;
use crate::work::{self, Milestone, Pace, PartStatus, Place, Record, Stage, Unit, Units, Work, WorkStatus};
use crate::{Error, Monitor, Workflow};

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

const OPEN_LOOP: usize = 0;
const MODEL: usize = 1;
const EVOLUTION: usize = 2;
const RANDOM: usize = 3;
const RULE: usize = 4;
const REALITY: usize = 5;
const TEST: usize = 6;
const REPORT: usize = 7;

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
        work::perform(self, monitor)
    }
}

impl Work for StudyPlan {
    const WORKFLOW: &'static str = "study";
    const NAME: &'static str = "a study";
    const RECORD: &'static str = "study.toml";
    const RESULTS: &'static [&'static str] = &["numbers.json"];

    type Begun<'p> = AtWork<'p>;

    fn out(&self) -> &Path {
        &self.out
    }

    fn resume_mut(&mut self) -> &mut bool {
        &mut self.resume
    }

    fn paths_mut(&mut self) -> Vec<&mut PathBuf> {
        vec![&mut self.out]
    }

    fn of_folder(out: &Path) -> Result<Self, Error> {
        let config = files::read_toml(&out.join(Self::RECORD))?;
        Ok(Self { out: out.to_owned(), resume: true, config, ..Self::default() })
    }

    /// A part is a stage.
    fn status(folder: &Path) -> Result<WorkStatus, Error> {
        let plan = Self::of_folder(folder)?;
        let (study, seconds) = (AtWork { plan: &plan }, read_seconds(folder));
        let evolution = folder.join("evolution");
        let part = |(stage, name): (usize, &str)| {
            let units = match stage {
                OPEN_LOOP | REALITY => study.experiments(stage).len(),
                _ => 1,
            };
            let is_done = |&unit: &usize| study.is_done(Place { stage, unit }).unwrap_or(false);
            let (done, total) = ((0..units).filter(is_done).count() as u64, units as u64);
            let part = match stage {
                OPEN_LOOP | REALITY => PartStatus::new(name, done, total, "experiments"),
                EVOLUTION if evolution.join(EvolvePlan::RECORD).exists() => {
                    let status = EvolvePlan::status(&evolution)?;
                    let (done, total, unit) = status.progress();
                    let best_unit = status.parts.first().and_then(|run| run.best_unit);
                    PartStatus { best: status.best(), best_unit, ..PartStatus::new(name, done, total, unit) }
                }
                EVOLUTION => {
                    let evolution = &plan.config.evolution;
                    let total = u64::from(evolution.runs) * u64::from(evolution.generations);
                    PartStatus::new(name, 0, total, "generations")
                }
                MODEL => PartStatus::new(name, done, total, "models"),
                RANDOM => PartStatus::new(name, done, total, "baselines"),
                RULE => PartStatus::new(name, done, total, "rules"),
                TEST => PartStatus::new(name, done, total, "comparisons"),
                _ => PartStatus::new(name, done, total, "reports"),
            };
            Ok::<_, Error>(PartStatus { seconds: seconds.get(name).copied(), ..part })
        };
        let parts = STAGES.into_iter().enumerate().map(part).collect::<Result<_, _>>()?;
        WorkStatus::of::<Self>(folder, parts)
    }

    fn begin(&self, _monitor: &dyn Monitor) -> Result<AtWork<'_>, Error> {
        Ok(AtWork { plan: self })
    }

    fn collect(&self, study: &AtWork<'_>, _monitor: &dyn Monitor) -> Result<StudyResults, Error> {
        files::read_as(&study.file("numbers.json"), |text| serde_json::from_str(text)).map_err(Error::from)
    }
}

/// An experiment with one plant.
struct Experiment {
    folder: PathBuf,
    /// Name of its controller, among [`CONTROLLERS`].
    controller: &'static str,
    task: Task,
    seed: u64,
    /// Whether figures show its photographs.
    has_figures: bool,
}

/// A study at work.
pub struct AtWork<'p> {
    plan: &'p StudyPlan,
}

impl Units for AtWork<'_> {
    fn record(&self) -> Result<Record, Error> {
        Record::of(self.plan, &self.plan.config)
    }

    fn stages(&self) -> Vec<Stage> {
        let experiments = |experiments: &[Experiment]| {
            let unit = |experiment: &Experiment| {
                let name = experiment.folder.strip_prefix(&self.plan.out).unwrap_or(&experiment.folder);
                let (name, size) = (name.display().to_string(), experiment.task.max_steps.into());
                Unit { size, ..Unit::new(name.clone(), name) }
            };
            experiments.iter().map(unit).collect()
        };
        let stage = |(number, name): (usize, &str)| {
            let name = name.to_owned();
            match number {
                OPEN_LOOP | REALITY => Stage {
                    name: if number == OPEN_LOOP { "photographing beans" } else { "steering unseen beans" }
                        .to_owned(),
                    pace: Pace::Parallel,
                    units: experiments(&self.experiments(number)),
                },
                _ => Stage { pace: Pace::Nested, units: vec![Unit::new(name.clone(), name.clone())], name },
            }
        };
        STAGES.into_iter().enumerate().map(stage).collect()
    }

    fn is_done(&self, Place { stage, unit }: Place) -> Result<bool, Error> {
        let file = match stage {
            MODEL => "model.json",
            EVOLUTION => "evolution/summary.json",
            RANDOM => "random/baseline.json",
            RULE => "rule.json",
            TEST => "many-plants/transfer.json",
            REPORT => "numbers.json",
            _ => {
                return Ok(self.experiments(stage)[unit].folder.join("track.csv").exists());
            }
        };
        Ok(self.file(file).exists())
    }

    fn execute(&self, Place { stage, unit }: Place, monitor: &dyn Monitor) -> Result<(), Error> {
        match stage {
            MODEL => self.fit(monitor),
            EVOLUTION => self.evolve(monitor),
            RANDOM => self.random(monitor),
            RULE => self.tune(monitor),
            TEST => self.test(monitor),
            REPORT => self.report(monitor),
            _ => self.run(&self.experiments(stage)[unit], monitor),
        }
    }

    fn reached(&self, milestone: &Milestone, monitor: &dyn Monitor) -> Result<(), Error> {
        let is_over = self.file("numbers.json").exists();
        match *milestone {
            Milestone::Begun => {
                monitor.note("a study on virtual plants: nothing here is a measurement of a living plant");
                if is_over {
                    return Ok(());
                }
                growing::write(self.plan, 0)?;
                let first = self.file("open-loop/1/photographs/000000.jpg");
                let report = self.file("report.html");
                let (first, report) = (first.display(), report.display());
                monitor.note(&format!("first photograph: {first}; the report grows: {report}"));
                Ok(())
            }
            Milestone::StageEnded { stage, seconds, is_done } => {
                let mut spent = read_seconds(&self.plan.out);
                *spent.entry(STAGES[stage].to_owned()).or_default() += seconds;
                files::write_unterminated_json(&self.file("seconds.json"), &spent)?;
                match stage {
                    OPEN_LOOP | EVOLUTION if is_done && !is_over => growing::write(self.plan, stage + 1),
                    _ => Ok(()),
                }
            }
        }
    }
}

impl AtWork<'_> {
    fn file(&self, name: &str) -> PathBuf {
        self.plan.out.join(name)
    }

    /// The experiments of a stage that consists of such.
    fn experiments(&self, stage: usize) -> Vec<Experiment> {
        if stage == REALITY { self.in_reality() } else { self.open_loop() }
    }

    fn open_loop(&self) -> Vec<Experiment> {
        let config = &self.plan.config;
        let experiment = |number: u32| Experiment {
            folder: self.open_loop_folder(number),
            controller: CONTROLLERS[2],
            task: Task::open_loop(config.steps),
            seed: config.plant_seed(number),
            has_figures: true,
        };
        (0..config.experiments).map(experiment).collect()
    }

    fn open_loop_folder(&self, number: u32) -> PathBuf {
        self.file("open-loop").join((number + 1).to_string())
    }

    /// Runs an experiment in its run folder.
    fn run(&self, experiment: &Experiment, monitor: &dyn Monitor) -> Result<(), Error> {
        let Experiment { folder, controller, task, seed, has_figures } = experiment;
        let controller = self.controller(controller)?;
        let config = RunConfig::new(self.plan.config.rig(), controller, task.clone(), *seed);
        let plan = RunPlan { out: folder.clone(), resume: true, config, ..RunPlan::default() };
        plan.execute(&Part(monitor))?;
        if self.plan.keep_photographs { Ok(()) } else { make_small(folder, *has_figures) }
    }

    fn fit(&self, monitor: &dyn Monitor) -> Result<(), Error> {
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

    fn evolve(&self, monitor: &dyn Monitor) -> Result<(), Error> {
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

    fn random(&self, monitor: &dyn Monitor) -> Result<(), Error> {
        let config = &self.plan.config;
        let plan = BaselinePlan {
            model: self.file("model.json"),
            task: config.task.clone(),
            neat: config.evolution.neat.clone(),
            count: config.random_controllers,
            seed: config.seed,
            resume: true,
            out: Some(self.file("random")),
        };
        plan.execute(monitor).map(drop)
    }

    /// Tunes a rule for arrival on a model of the stems in the same tracks.
    fn tune(&self, monitor: &dyn Monitor) -> Result<(), Error> {
        let (model, out) = (self.file("stem.json"), self.file("rule.json"));
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

    /// A controller that steers unseen plants, by its name.
    fn controller(&self, name: &str) -> Result<ControllerSpec, Error> {
        let [champion, random, periodic, greedy, _] = CONTROLLERS;
        let read = |file: &str| ControllerSpec::read(&self.file(file));
        match name {
            _ if name == champion => read("evolution/champion.json"),
            _ if name == random => read("random/champion.json"),
            _ if name == periodic => Ok(self.plan.config.periodic()),
            _ if name == greedy => Ok(ControllerSpec::Greedy),
            _ => read("rule.json"),
        }
    }

    /// All controllers steer many more plants, without photographs.
    fn test(&self, monitor: &dyn Monitor) -> Result<(), Error> {
        let config = &self.plan.config;
        let named =
            |name: &str| Ok(NamedController { name: name.to_owned(), controller: self.controller(name)? });
        let plan = TransferPlan {
            controllers: CONTROLLERS.into_iter().map(named).collect::<Result<_, Error>>()?,
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
    fn in_reality(&self) -> Vec<Experiment> {
        let config = &self.plan.config;
        let of_controller = |name: &'static str| {
            (0..config.reality_plants).map(move |plant| Experiment {
                folder: self.file("reality").join(name).join((plant + 1).to_string()),
                controller: name,
                task: config.task.clone(),
                seed: config.plant_seed(config.experiments + plant),
                has_figures: name == CONTROLLERS[0],
            })
        };
        PHOTOGRAPHED.into_iter().flat_map(of_controller).collect()
    }

    fn report(&self, monitor: &dyn Monitor) -> Result<(), Error> {
        monitor.stage("report", 1);
        let folder = StudyFolder::read(&self.plan.out)?;
        let results = folder.results()?;
        files::write(&results.report, folder.page(&results)?.html().as_bytes())?;
        files::write_unterminated_json(&self.file("numbers.json"), &results)?;
        monitor.advance(1);
        Ok(())
    }
}
