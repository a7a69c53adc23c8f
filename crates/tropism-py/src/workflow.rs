//! Workflows of the lab: a plan goes in as JSON, results come out as JSON, a Python object listens.
//!
//! The workflow works on a thread of its own. The calling thread waits without the interpreter's lock, and takes it a few
//! times a second to pass on progress and to hear of signals: workers never need the lock.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;
use serde::Serialize;
use tropism::rig::Event;
use tropism::track::Sample;
use tropism_lab::study::{StudyConfig, StudyPlan};
use tropism_lab::sweep::SweepConfig;
use tropism_lab::work::{self, UnitPlan};
use tropism_lab::{Error, Monitor, RunPlan, Work, Workflow};
use tropism_neat::Generation;

use crate::error::{
    Interrupted, MissingFileError, Paused, PlanError, TropismError, is_missing_file, of_file, parsed,
    refused, with_causes,
};
use crate::threads;

/// Time between two looks at signals and progress. Chosen: an interruption is to be heard within a tenth of a second.
const LOOK: Duration = Duration::from_millis(20);

/// What a workflow reports.
enum Message {
    Stage(String, u64),
    Advance(u64),
    Skip(u64),
    Status(String),
    Note(String),
    Generation(u32, Generation),
    Sample(Box<Sample>),
    Event(String),
    End,
}

/// Passes what a workflow reports to the thread that waits for it.
struct Reporter {
    sender: Sender<Message>,
    may_go_on: AtomicBool,
}

impl Reporter {
    fn send(&self, message: Message) {
        // The waiting thread hears all until the end.
        let _ = self.sender.send(message);
    }
}

impl Monitor for Reporter {
    fn stage(&self, name: &str, total: u64) {
        self.send(Message::Stage(name.to_owned(), total));
    }

    fn advance(&self, count: u64) {
        self.send(Message::Advance(count));
    }

    fn skip(&self, count: u64) {
        self.send(Message::Skip(count));
    }

    fn status(&self, text: &str) {
        self.send(Message::Status(text.to_owned()));
    }

    fn note(&self, line: &str) {
        self.send(Message::Note(line.to_owned()));
    }

    fn generation(&self, run: u32, generation: &Generation) {
        self.send(Message::Generation(run, generation.clone()));
    }

    fn sample(&self, sample: &Sample) {
        self.send(Message::Sample(Box::new(sample.clone())));
    }

    fn event(&self, event: &Event) {
        self.send(Message::Event(event.kind.to_string()));
    }

    fn may_go_on(&self) -> bool {
        self.may_go_on.load(Ordering::Relaxed)
    }
}

/// Why there are no results.
enum Failure {
    Lab(Error),
    Json(PyErr),
}

type Execute = fn(&str, &dyn Monitor) -> Result<String, Failure>;

/// What there is to know about a workflow.
struct Entry {
    execute: Execute,
    default: fn(&str) -> PyResult<String>,
    check: fn(&str) -> PyResult<()>,
    schema: &'static str,
}

fn execute<W: Workflow>(plan: &str, monitor: &dyn Monitor) -> Result<String, Failure> {
    let plan: W = parsed("plan", plan).map_err(Failure::Json)?;
    plan.execute(monitor).map(|results| json(&results)).map_err(Failure::Lab)
}

/// The plan with all keys that it leaves out.
fn completed<W: Workflow>(plan: &str) -> PyResult<String> {
    parsed::<W>("plan", plan).map(|plan| json(&plan))
}

fn check<W: Workflow>(plan: &str) -> PyResult<()> {
    parsed::<W>("plan", plan)?.check().map_err(of_lab)
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("plans and results are data")
}

macro_rules! workflows {
    ($($name:literal => $plan:ty,)*) => {
        /// The names of all workflows.
        const NAMES: &[&str] = &[$($name),*];

        fn find(name: &str) -> PyResult<Entry> {
            Ok(match name {
                $($name => Entry {
                    execute: execute::<$plan>,
                    default: completed::<$plan>,
                    check: check::<$plan>,
                    schema: <$plan as Workflow>::SCHEMA,
                },)*
                _ => return Err(refused(format!("found no workflow {name:?}, wanted one of {}", NAMES.join(", ")))),
            })
        }
    };
}

workflows! {
    "acceptance" => tropism_lab::grow::AcceptancePlan,
    "baseline" => tropism_lab::baseline::BaselinePlan,
    "calibrate" => tropism_lab::calibrate::CalibratePlan,
    "calibrate_camera" => tropism_lab::calibrate_camera::CalibrateCameraPlan,
    "check" => tropism_lab::check::CheckPlan,
    "depth" => tropism_lab::depth::DepthPlan,
    "evolve" => tropism_lab::evolve::EvolvePlan,
    "export" => tropism_lab::export::ExportPlan,
    "fit" => tropism_lab::fit::FitPlan,
    "forecast" => tropism_lab::forecast::ForecastPlan,
    "make_rig" => tropism_lab::make_rig::MakeRigPlan,
    "measure" => tropism_lab::measure::MeasurePlan,
    "grow" => tropism_lab::grow::GrowPlan,
    "guide" => tropism_lab::track::GuidePlan,
    "kinematics" => tropism_lab::grow::KinematicsPlan,
    "note" => tropism_lab::note::NotePlan,
    "recovery" => tropism_lab::calibrate::RecoveryPlan,
    "replicates" => tropism_lab::replicates::ReplicatesPlan,
    "report" => tropism_lab::report::ReportPlan,
    "run" => RunPlan,
    "safe_state" => tropism_lab::safe_state::SafeStatePlan,
    "score" => tropism_lab::score::ScorePlan,
    "show" => tropism_lab::show::ShowPlan,
    "simulate" => tropism_lab::simulate::SimulatePlan,
    "status" => tropism_lab::status::StatusPlan,
    "stop" => tropism_lab::stop::StopPlan,
    "study" => StudyPlan,
    "sweep" => tropism_lab::sweep::SweepPlan,
    "timelapse" => tropism_lab::timelapse::TimelapsePlan,
    "track" => tropism_lab::track::TrackPlan,
    "transfer" => tropism_lab::transfer::TransferPlan,
    "tune" => tropism_lab::tune::TunePlan,
    "wall" => tropism_lab::wall::WallPlan,
    "wall_study" => tropism_lab::wall::WallStudyPlan,
}

/// What there is to know about a long work.
struct WorkEntry {
    unit: Execute,
    units: fn(&str) -> PyResult<String>,
    absolute: fn(&str) -> PyResult<String>,
    of_folder: fn(&Path) -> PyResult<String>,
    has_begun: fn(&str) -> PyResult<bool>,
}

fn has_begun<W: Work>(plan: &str) -> PyResult<bool> {
    parsed::<W>("plan", plan).map(|plan| plan.out().join(W::RECORD).exists())
}

fn units<W: Work>(plan: &str) -> PyResult<String> {
    work::units_of(&parsed::<W>("plan", plan)?).map(|units| json(&units)).map_err(of_lab)
}

fn absolute<W: Work>(plan: &str) -> PyResult<String> {
    parsed::<W>("plan", plan)?.with_absolute_paths().map(|plan| json(&plan)).map_err(of_lab)
}

fn of_folder<W: Work>(folder: &Path) -> PyResult<String> {
    W::of_folder(folder).map(|plan| json(&plan)).map_err(of_lab)
}

macro_rules! works {
    ($($plan:ty,)*) => {
        fn find_work(name: &str) -> PyResult<WorkEntry> {
            Ok(match name {
                $(<$plan as Work>::WORKFLOW => WorkEntry {
                    unit: execute::<UnitPlan<$plan>>,
                    units: units::<$plan>,
                    absolute: absolute::<$plan>,
                    of_folder: of_folder::<$plan>,
                    has_begun: has_begun::<$plan>,
                },)*
                _ => {
                    let known = [$(<$plan as Work>::WORKFLOW),*];
                    return Err(refused(format!("found {name:?}, wanted a long work: one of {}", known.join(", "))));
                }
            })
        }
    };
}

works! {
    tropism_lab::baseline::BaselinePlan,
    tropism_lab::calibrate::CalibratePlan,
    tropism_lab::evolve::EvolvePlan,
    tropism_lab::forecast::ForecastPlan,
    tropism_lab::grow::GrowPlan,
    tropism_lab::replicates::ReplicatesPlan,
    StudyPlan,
    tropism_lab::sweep::SweepPlan,
    tropism_lab::transfer::TransferPlan,
    tropism_lab::wall::WallStudyPlan,
}

/// The exception for an error of the lab.
pub(crate) fn of_lab(error: Error) -> PyErr {
    let text = with_causes(&error);
    match error {
        Error::Interrupted { .. } | Error::Cancelled(_) => Interrupted::new_err(text),
        Error::Paused { .. } => Paused::new_err(text),
        Error::Plan(_) => PlanError::new_err(text),
        error if is_missing_file(&error) => MissingFileError::new_err(text),
        _ => TropismError::new_err(text),
    }
}

/// The Python object that listens, and which of its methods exist.
struct Listener<'py> {
    object: Option<Bound<'py, PyAny>>,
}

impl<'py> Listener<'py> {
    fn call<A>(&self, method: &str, arguments: A) -> PyResult<()>
    where
        A: pyo3::call::PyCallArgs<'py>,
    {
        if let Some(object) = &self.object {
            object.call_method1(method, arguments)?;
        }
        Ok(())
    }

    fn hear(&self, message: Message) -> PyResult<()> {
        match message {
            Message::Stage(name, total) => self.call("stage", (name, total)),
            Message::Advance(count) => self.call("advance", (count,)),
            Message::Skip(count) => self.call("skip", (count,)),
            Message::Status(text) => self.call("status", (text,)),
            Message::Note(text) => self.call("note", (text,)),
            Message::Generation(run, generation) => self.call("generation", (run, json(&generation))),
            Message::Sample(sample) => {
                let light = sample.light.map(|light| light.index());
                self.call("sample", (sample.step, sample.tip.x, sample.tip.y, light, sample.quality.name()))
            }
            Message::Event(text) => self.call("event", (text,)),
            Message::End => Ok(()),
        }
    }

    fn may_go_on(&self) -> PyResult<bool> {
        match &self.object {
            Some(object) => object.call_method0("may_go_on")?.is_truthy(),
            None => Ok(true),
        }
    }
}

/// Takes what has been reported within [`LOOK`]; progress that was reported in pieces is one piece. `None` after the end.
fn heard(receiver: &Receiver<Message>) -> Option<Vec<Message>> {
    let mut messages = Vec::new();
    let first = match receiver.recv_timeout(LOOK) {
        Ok(message) => Some(message),
        Err(RecvTimeoutError::Timeout) => None,
        Err(RecvTimeoutError::Disconnected) => return None,
    };
    let mut is_over = false;
    for message in first.into_iter().chain(receiver.try_iter()) {
        match (messages.last_mut(), message) {
            (_, Message::End) => is_over = true,
            (Some(Message::Advance(sum)), Message::Advance(count)) => *sum += count,
            (Some(Message::Status(last)), Message::Status(text)) => *last = text,
            (_, message) => messages.push(message),
        }
    }
    if is_over {
        messages.push(Message::End);
    }
    Some(messages)
}

/// Executes the workflow `name` with `plan` (JSON), on `threads` threads; returns its results (JSON).
///
/// `listener` has the methods of `tropism.Monitor`.
#[pyfunction]
#[pyo3(signature = (name, plan, listener=None, threads=None))]
pub(crate) fn execute_workflow(
    py: Python<'_>,
    name: &str,
    plan: &str,
    listener: Option<Bound<'_, PyAny>>,
    threads: Option<usize>,
) -> PyResult<String> {
    executed(py, name, find(name)?.execute, plan, listener, threads)
}

/// Executes unit `unit`, from 1, of the work of the workflow `name`, as [`execute_workflow`] does a whole.
#[pyfunction]
#[pyo3(signature = (name, plan, unit, listener=None, threads=None))]
pub(crate) fn execute_unit(
    py: Python<'_>,
    name: &str,
    plan: &str,
    unit: usize,
    listener: Option<Bound<'_, PyAny>>,
    threads: Option<usize>,
) -> PyResult<String> {
    let order = format!("{{\"work\": {plan}, \"unit\": {unit}}}");
    executed(py, name, find_work(name)?.unit, &order, listener, threads)
}

fn executed(
    py: Python<'_>,
    name: &str,
    execute: Execute,
    plan: &str,
    listener: Option<Bound<'_, PyAny>>,
    threads: Option<usize>,
) -> PyResult<String> {
    let pool = threads::pool(threads)?;
    let (sender, receiver) = channel();
    let reporter = Reporter { sender, may_go_on: AtomicBool::new(true) };
    let listener = Listener { object: listener };
    let mut stopped_by = None;
    let outcome = std::thread::scope(|scope| {
        let worker = scope.spawn(|| {
            let work = || execute(plan, &reporter);
            let outcome = catch_unwind(AssertUnwindSafe(|| threads::within(pool.as_ref(), work)));
            reporter.send(Message::End);
            outcome
        });
        let receiver = std::sync::Mutex::new(receiver);
        let mut is_over = false;
        while !is_over {
            let heard = py.detach(|| receiver.lock().map_or(None, |receiver| heard(&receiver)));
            let Some(messages) = heard else { break };
            is_over = matches!(messages.last(), Some(Message::End));
            let printed: PyResult<()> = py.check_signals().and_then(|()| {
                messages.into_iter().try_for_each(|message| listener.hear(message))?;
                if !listener.may_go_on()? {
                    return Err(Interrupted::new_err("the monitor asked for an end"));
                }
                Ok(())
            });
            if let Err(error) = printed {
                reporter.may_go_on.store(false, Ordering::Relaxed);
                stopped_by.get_or_insert(error);
            }
        }
        py.detach(|| worker.join())
    });
    let panicked =
        || PyRuntimeError::new_err(format!("{name} panicked: a fault of tropism, whose text stands above"));
    let outcome = outcome.and_then(|outcome| outcome).map_err(|_| panicked())?;
    match (outcome, stopped_by) {
        (Ok(results), None) => Ok(results),
        (Err(Failure::Json(error)), _) => Err(error),
        (Err(Failure::Lab(error)), None) => Err(of_lab(error)),
        // Ctrl-C: the text says what is saved. Other exceptions of the listener are the user's own.
        (Err(Failure::Lab(error)), Some(stop)) if stop.is_instance_of::<PyKeyboardInterrupt>(py) => {
            Err(of_lab(error))
        }
        (_, Some(stop)) => Err(stop),
    }
}

/// The plan of the workflow `name` as JSON, with the defaults of all keys that `plan` leaves out.
#[pyfunction]
#[pyo3(signature = (name, plan="{}"))]
pub(crate) fn complete_plan(name: &str, plan: &str) -> PyResult<String> {
    (find(name)?.default)(plan)
}

/// Checks a plan before any work begins.
#[pyfunction]
pub(crate) fn check_plan(name: &str, plan: &str) -> PyResult<()> {
    (find(name)?.check)(plan)
}

/// Name and version of the JSON of a workflow's plan and results.
#[pyfunction]
pub(crate) fn schema(name: &str) -> PyResult<&'static str> {
    Ok(find(name)?.schema)
}

/// The names of all workflows.
#[pyfunction]
pub(crate) fn workflow_names() -> Vec<&'static str> {
    NAMES.to_vec()
}

/// The plan (JSON) that goes on with the run or the long work in `folder`, from this folder alone.
#[pyfunction]
pub(crate) fn plan_of_folder(name: &str, folder: PathBuf) -> PyResult<String> {
    if name == "run" {
        return RunPlan::of_folder(&folder, true).map(|plan| json(&plan)).map_err(of_lab);
    }
    (find_work(name)?.of_folder)(&folder)
}

/// The units of a long work, as JSON.
#[pyfunction]
pub(crate) fn work_units(name: &str, plan: &str) -> PyResult<String> {
    (find_work(name)?.units)(plan)
}

/// Whether a long work, this one or another, has begun in the folder of the plan.
#[pyfunction]
#[pyo3(name = "has_begun")]
pub(crate) fn work_has_begun(name: &str, plan: &str) -> PyResult<bool> {
    (find_work(name)?.has_begun)(plan)
}

/// The plan (JSON) of a long work with paths that mean the same in each working folder.
#[pyfunction]
pub(crate) fn absolute_plan(name: &str, plan: &str) -> PyResult<String> {
    (find_work(name)?.absolute)(plan)
}

/// The settings of a study of about a minute, as JSON.
#[pyfunction]
pub(crate) fn quick_study() -> String {
    json(&StudyConfig::quick())
}

/// The content of a sweep file, as JSON.
#[pyfunction]
pub(crate) fn read_sweep(path: PathBuf) -> PyResult<String> {
    SweepConfig::read(Path::new(&path)).map(|config| json(&config)).map_err(of_lab)
}

/// The controller in a champion or rule file, as the JSON of a plan.
#[pyfunction]
pub(crate) fn read_controller(path: PathBuf) -> PyResult<String> {
    tropism_lab::ControllerSpec::read(&path).map(|spec| json(&spec)).map_err(of_lab)
}

/// The task for a controller (JSON) where none is named: the one that it was made for, an open-loop experiment, or the paper's.
#[pyfunction]
pub(crate) fn default_task(controller: &str) -> PyResult<String> {
    Ok(json(&parsed::<tropism_lab::ControllerSpec>("controller", controller)?.default_task()))
}

/// The plants of a bean file, such as `beans/sunflower.toml`, as the JSON of a greenhouse's `bean`.
#[pyfunction]
pub(crate) fn read_species(path: PathBuf) -> PyResult<String> {
    let species: tropism_bean::Species =
        tropism_lab::files::read_toml(&path).map_err(|error| of_file(&error))?;
    Ok(json(&species))
}

/// The task of a task file, a champion, a rule or a run folder, as JSON.
#[pyfunction]
pub(crate) fn read_task(path: PathBuf) -> PyResult<String> {
    tropism_lab::task::read(&path).map(|task| json(&task)).map_err(of_lab)
}

/// The settings in a TOML file, such as a study, a rig or a plant file, as JSON.
#[pyfunction]
pub(crate) fn read_settings(path: PathBuf) -> PyResult<String> {
    let settings: serde_json::Value =
        tropism_lab::files::read_toml(&path).map_err(|error| of_file(&error))?;
    Ok(settings.to_string())
}

/// The controller that a network alone makes, as the JSON of a plan: it sees x and y of the tip, as in the paper.
#[pyfunction]
pub(crate) fn champion_of(genome: &crate::neat::Genome) -> PyResult<String> {
    let champion = tropism::evolve::Champion::from_json(&genome.0.to_json()).map_err(refused)?;
    tropism_lab::ControllerSpec::network(champion).map(|spec| json(&spec)).map_err(of_lab)
}

pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(execute_workflow, module)?)?;
    module.add_function(wrap_pyfunction!(complete_plan, module)?)?;
    module.add_function(wrap_pyfunction!(check_plan, module)?)?;
    module.add_function(wrap_pyfunction!(schema, module)?)?;
    module.add_function(wrap_pyfunction!(workflow_names, module)?)?;
    module.add_function(wrap_pyfunction!(plan_of_folder, module)?)?;
    module.add_function(wrap_pyfunction!(quick_study, module)?)?;
    module.add_function(wrap_pyfunction!(read_sweep, module)?)?;
    module.add_function(wrap_pyfunction!(execute_unit, module)?)?;
    module.add_function(wrap_pyfunction!(work_units, module)?)?;
    module.add_function(wrap_pyfunction!(absolute_plan, module)?)?;
    module.add_function(wrap_pyfunction!(work_has_begun, module)?)?;
    module.add_function(wrap_pyfunction!(default_task, module)?)?;
    module.add_function(wrap_pyfunction!(read_controller, module)?)
}
