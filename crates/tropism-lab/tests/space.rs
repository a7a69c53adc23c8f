//! A run with two cameras: tip and stem in space, a side camera that fails, and a resume.

#[path = "common/tent.rs"]
mod small_tent;

use std::path::Path;

use small_tent::small_tent;
use tropism::math::vector::distance;
use tropism::observation::Quality;
use tropism::task::Task;
use tropism::track::{Sample, Track};
use tropism::vision::{FrameStatus, VisionConfig};
use tropism_bean::fault::Faults;
use tropism_bean::tent::{Greenhouse, GroundTruth};
use tropism_bean::view::{STEREO, View};
use tropism_lab::controller::ControllerSpec;
use tropism_lab::report::ReportPlan;
use tropism_lab::run::{RunConfig, RunPlan};
use tropism_lab::transfer::{NamedController, TransferPlan};
use tropism_lab::{Error, Monitor, Silent, Workflow, read_journal};
use tropism_rig::file::RigFile;

const STEPS: u32 = 24;

fn tent_faults() -> Faults {
    Faults { dropped: 0.15, ..Faults::default() }
}

/// A tent for a task, with small photographs.
fn tent(task: &Task) -> Greenhouse {
    small_tent().for_task(task)
}

/// A tent whose camera at the side drops photographs now and then.
fn config() -> RunConfig {
    let task: Task = Task { max_steps: STEPS, ..Task::space() };
    let mut tent = tent(&task);
    tent.faults = tent_faults();
    let rig = RigFile { period_min: 20.0, ..RigFile::greenhouse(tent, VisionConfig::default()) };
    // A plant whose first photographs are there.
    let is_whole = |seed: &u64| {
        View::BOTH
            .iter()
            .all(|view| (0..2).all(|frame| tent_faults().events_for(*view, *seed, frame).is_empty()))
    };
    let seed = (5..100).find(is_whole).unwrap();
    RunConfig::new(rig, ControllerSpec::Greedy, task, seed)
}

/// Asks for an end after some steps.
struct EndsAt(std::sync::atomic::AtomicU32, u32);

impl Monitor for EndsAt {
    fn advance(&self, by: u64) {
        self.0.fetch_add(by as u32, std::sync::atomic::Ordering::Relaxed);
    }

    fn may_go_on(&self) -> bool {
        self.0.load(std::sync::atomic::Ordering::Relaxed) < self.1
    }
}

fn run(out: &Path, resume: bool, monitor: &dyn Monitor) -> Result<Track, Error> {
    let plan = RunPlan { out: out.to_owned(), resume, config: config(), ..RunPlan::default() };
    plan.execute(monitor).map(|results| results.track)
}

#[test]
fn a_run_in_space_survives_gaps_of_one_camera_and_interruptions() {
    let folder = tempfile::tempdir().unwrap();
    let whole_at = folder.path().join("whole");
    let whole = run(&whole_at, false, &Silent).unwrap();
    assert_eq!(whole.samples.len() as u32, STEPS + 1);
    let (steps, _) = read_journal(&whole_at).unwrap();
    let missing = |step: &&tropism_lab::StepRecord| step.side.as_ref().unwrap().photo_bytes == 0;
    let gaps = steps.iter().filter(missing).count();
    assert!(gaps > 0 && gaps < steps.len() / 2, "{gaps} photographs from the side are missing");
    // The depth is carried forward over gaps.
    let known = whole.samples.iter().skip_while(|sample| sample.depth.is_none());
    assert!(known.clone().count() > 20 && known.clone().all(|sample| sample.depth.is_some()));
    assert!(whole.samples.iter().any(|sample| sample.observation().stem_in_space().is_some()));

    tips_are_in_space(&whole, &whole_at);
    its_report_shows_it_in_space(&whole_at);

    let out = folder.path().join("broken");
    assert!(matches!(run(&out, false, &EndsAt(0.into(), 7)), Err(Error::Interrupted { .. })));
    assert_eq!(run(&out, true, &Silent).unwrap(), whole);
    let same =
        |name: &str| std::fs::read(out.join(name)).unwrap() == std::fs::read(whole_at.join(name)).unwrap();
    assert!(same("track.csv") && same("truth.jsonl"));
    // The file tells the task as much as the run did.
    let file = Track::read_csv(std::fs::File::open(whole_at.join("track.csv")).unwrap()).unwrap();
    let task = config().task;
    assert!((task.fitness(&file) - task.fitness(&whole)).abs() < 1e-3);
}

/// The report draws the run in space as Figure 8: in the page one that is turned, in files the views from three sides.
fn its_report_shows_it_in_space(run: &Path) {
    let folder = tempfile::tempdir().unwrap();
    let figures = folder.path().join("figures");
    let out = folder.path().join("report.html");
    let sources = vec![run.to_owned(), run.join("track.csv")];
    let plan = ReportPlan { sources, out: out.clone(), figures: Some(figures.clone()) };
    let results = plan.execute(&Silent).unwrap();
    assert!(results.figures.contains(&"8".to_owned()) && results.figures.contains(&"space".to_owned()));
    let html = std::fs::read_to_string(out).unwrap();
    assert_eq!(html.matches("class=\"turnable\"").count(), 2);
    for name in ["figure-8", "figure-space"] {
        let file = |ending: &str| std::fs::read_to_string(figures.join(format!("{name}.{ending}"))).unwrap();
        let svg = file("svg");
        assert!(["from the front", "from the side", "from above"].iter().all(|view| svg.contains(view)));
        let csv = file("csv");
        assert!(csv.starts_with("step,time_h,tip_x_cm,tip_y_cm,tip_z_cm,light\n"));
        assert_eq!(csv.lines().count() as u32, STEPS + 2);
    }
}

/// Distances of the measured tips from the true tops in `truth.jsonl`, as both cameras see them, in ascending order.
fn errors(track: &Track, out: &Path) -> Vec<f64> {
    let truth = std::fs::read_to_string(out.join("truth.jsonl")).unwrap();
    let truths = truth.lines().map(|line| serde_json::from_str::<GroundTruth>(line).unwrap());
    let measured = |(sample, _): &(&Sample, GroundTruth)| sample.quality == Quality::Measured;
    let error = |(sample, truth): (&Sample, GroundTruth)| match (&truth.side, &sample.depth) {
        (Some(side), Some(depth)) => {
            let top = STEREO.triangulate(truth.front.top, side.top).point;
            distance([sample.tip.x, sample.tip.y, depth.tip_cm], top)
        }
        _ => sample.tip.distance(truth.front.top),
    };
    let mut errors: Vec<f64> = track.samples.iter().zip(truths).filter(measured).map(error).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// A run through photographs in the virtual tent, in steps of 20 minutes.
fn run_task(task: Task, seed: u64, out: &Path) -> Track {
    let rig = RigFile { period_min: 20.0, ..RigFile::greenhouse(tent(&task), VisionConfig::default()) };
    let config = RunConfig::new(rig, ControllerSpec::Greedy, task, seed);
    let plan = RunPlan { out: out.to_owned(), config, ..RunPlan::default() };
    plan.execute(&Silent).unwrap().track
}

#[test]
fn tips_among_obstacles_are_those_of_the_plant() {
    let folder = tempfile::tempdir().unwrap();
    let task = Task { max_steps: 40, ..Task::obstacles() };
    let track = run_task(task, 3, folder.path());
    assert_eq!(track.samples.len(), 41);
    let errors = errors(&track, folder.path());
    assert!(errors.len() > 33 && errors[errors.len() * 95 / 100] < 0.2, "{errors:?}");
}

#[test]
fn a_plant_is_followed_round_a_pole() {
    let folder = tempfile::tempdir().unwrap();
    let task: Task = Task { max_steps: 64, ..Task::spiral() };
    let track = run_task(task.clone(), 73, folder.path());
    assert_eq!(track.samples.len(), 65);
    // From the first depth on each sample has one: measured, or carried forward while the pole hides the tip.
    let known = track.samples.iter().skip_while(|sample| sample.depth.is_none());
    assert!(known.clone().count() > 50 && known.clone().all(|sample| sample.depth.is_some()));
    let errors = errors(&track, folder.path());
    assert!(errors.len() > 25 && errors[errors.len() / 2] < 0.3, "{errors:?}");
    let (steps, _) = read_journal(folder.path()).unwrap();
    let hidden = |step: &&tropism_lab::StepRecord| step.seen.status == FrameStatus::Hidden;
    assert!(steps.iter().any(|step| hidden(&step)), "the pole never hid the tip");
}

#[test]
fn turns_through_photographs_are_judged_by_the_true_stem() {
    let folder = tempfile::tempdir().unwrap();
    let task: Task = Task { max_steps: 30, ..Task::spiral() };
    let plan = TransferPlan {
        controllers: vec![NamedController { name: "greedy".to_owned(), controller: ControllerSpec::Greedy }],
        plants: 1,
        greenhouse: tent(&task),
        task,
        period_min: 20.0,
        photographs: true,
        out: folder.path().to_owned(),
        ..TransferPlan::default()
    };
    let results = plan.execute(&Silent).unwrap();
    let html = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(html.contains("Median plant of greedy") && html.contains("class=\"turnable\""));
    assert!(!html.contains("Under 9") && !html.contains("plants under 9"));
    let path = folder.path().join("tracks/greedy/plant-0001.csv");
    let track = Track::read_csv(std::fs::File::open(path).unwrap()).unwrap();
    let turns = track.numbers("true_turns").unwrap();
    let true_turns = turns.last().unwrap().abs() - turns[0].abs();
    let greedy = &results.controllers[0];
    assert!((greedy.mean - true_turns).abs() < 1e-9, "{} and {true_turns}", greedy.mean);
    let seen = greedy.by_photographs.as_ref().unwrap();
    assert!((seen.mean - plan.task.fitness(&track)).abs() < 1e-9, "{seen:?}");
    assert!((seen.mean - true_turns).abs() < 0.5, "{seen:?} and {true_turns}");
}

/// Both cameras place the tip where `truth.jsonl` says it is.
fn tips_are_in_space(track: &Track, out: &Path) {
    let truth = std::fs::read_to_string(out.join("truth.jsonl")).unwrap();
    let tops = truth.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    let mut errors: Vec<f64> = track
        .samples
        .iter()
        .zip(tops)
        .filter(|(sample, _)| sample.quality == Quality::Measured)
        .filter_map(|(sample, truth)| {
            // Near the plane of the side camera its x is minus the depth.
            let side = truth["side"]["top"][0].as_f64().unwrap();
            Some((sample.depth.as_ref()?.tip_cm + side).abs())
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    assert!(errors.len() > 12 && errors[errors.len() / 2] < 0.2, "{errors:?}");
}
