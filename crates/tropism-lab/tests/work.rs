//! Long work in its folder: each of its units alone, and any interruption, come to the same bits as the whole.

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use tropism::evolve::{EvolutionConfig, RuleSearch};
use tropism::task::Task;
use tropism_bean::tent::Greenhouse;
use tropism_lab::baseline::BaselinePlan;
use tropism_lab::calibrate::CalibratePlan;
use tropism_lab::evolve::EvolvePlan;
use tropism_lab::fit::{FitPlan, ModelKind};
use tropism_lab::forecast::ForecastPlan;
use tropism_lab::grow::GrowPlan;
use tropism_lab::replicates::{Method, MethodKind, ReplicatesConfig, ReplicatesPlan, Scenario};
use tropism_lab::study::{StudyConfig, StudyPlan};
use tropism_lab::sweep::{SweepConfig, SweepPlan};
use tropism_lab::transfer::TransferPlan;
use tropism_lab::work::{UnitPlan, units_of};
use tropism_lab::{Error, Monitor, Silent, Work, Workflow};

/// Every file of `folder` that the plan decides, by its name, without the name of the folder. Times, journals and checkpoints
/// before the last are of chance.
fn decided(folder: &Path) -> BTreeMap<PathBuf, String> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let is_of_chance = [
                "seconds.json",
                "summary.json",
                "sweep.csv",
                "sweep.json",
                "replicates.json",
                "run.lock",
                "report.html",
            ]
            .contains(&&*name)
                || name.contains(".previous.")
                || [".seconds", ".sqlite", ".jsonl", ".sqlite-wal", ".sqlite-shm"]
                    .iter()
                    .any(|end| name.ends_with(end));
            if !is_of_chance {
                let content = String::from_utf8_lossy(&fs::read(&path).unwrap())
                    .replace(&*folder.to_string_lossy(), "FOLDER");
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), content);
            }
        }
    }
    found
}

/// Asks for an end after so many questions.
struct Until(AtomicU64);

impl Monitor for Until {
    fn may_go_on(&self) -> bool {
        self.0.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |left| left.checked_sub(1)).is_ok()
    }
}

/// Executes the work that `plan` makes for a folder as a whole, unit by unit from the last of each stage to its first, and
/// with interruptions; returns the number of its units.
#[track_caller]
fn comes_to_the_same<W: Work>(plan: impl Fn(PathBuf) -> W) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let [whole, by_unit, broken_off] =
        ["whole", "by-unit", "broken-off"].map(|name| folder.path().join(name));
    plan(whole.clone()).execute(&Silent).unwrap();
    let wanted = decided(&whole);

    let work = plan(by_unit.clone());
    let mut units = units_of(&work).unwrap();
    assert!(units.iter().all(|unit| !unit.is_done));
    let execute = |unit: usize| UnitPlan { work: work.clone(), unit }.execute(&Silent);
    if units.iter().any(|unit| unit.stage > 1) {
        let refused = execute(units.len()).unwrap_err().to_string();
        assert!(refused.contains("wanted all done"), "{refused}");
    }
    assert!(execute(units.len() + 1).unwrap_err().to_string().contains("found unit"));
    units.sort_by_key(|unit| (unit.stage, std::cmp::Reverse(unit.number)));
    for (done, unit) in (1..).zip(&units) {
        let results = execute(unit.number).unwrap();
        assert_eq!((results.number, results.total), (unit.number, units.len()));
        let is_done = units_of(&work).unwrap().iter().filter(|unit| unit.is_done).count();
        assert_eq!(is_done, done);
    }
    W::of_folder(&by_unit).unwrap().execute(&Silent).unwrap();
    assert!(decided(&by_unit) == wanted, "{:?}", differing(&decided(&by_unit), &wanted));

    let mut work = plan(broken_off.clone());
    for times in 0.. {
        // Each time three times as many, as a unit may take more than one that was interrupted.
        match work.execute(&Until(AtomicU64::new(50 * 3_u64.pow(times)))) {
            Ok(_) => break,
            Err(Error::Interrupted { folder }) => {
                assert_eq!(folder, broken_off);
                work = W::of_folder(&broken_off).unwrap();
            }
            Err(Error::Cancelled(_)) => {}
            Err(error) => panic!("{error}"),
        }
    }
    assert!(decided(&broken_off) == wanted, "{:?}", differing(&decided(&broken_off), &wanted));
    units.len()
}

/// The names of files that only one has, or that differ.
fn differing(one: &BTreeMap<PathBuf, String>, other: &BTreeMap<PathBuf, String>) -> Vec<PathBuf> {
    one.keys().chain(other.keys()).filter(|name| one.get(*name) != other.get(*name)).cloned().collect()
}

fn task() -> Task {
    Task { max_steps: 60, ..Task::default() }
}

/// A model of one plant that leans after a lamp, in a folder of its own.
fn model() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    common::leaning_plant(folder.path());
    let out = folder.path().join("model.json");
    let fit =
        FitPlan { tracks: vec![folder.path().join("track.csv")], out: out.clone(), ..FitPlan::default() };
    fit.execute(&Silent).unwrap();
    (folder, out)
}

#[test]
fn evolutions() {
    let (_folder, model) = model();
    let evolution = EvolutionConfig { runs: 3, generations: 5, ..EvolutionConfig::default() };
    let plan = |out| EvolvePlan {
        model: model.clone(),
        out,
        task: task(),
        evolution: evolution.clone(),
        trial_plants: 5,
        ..EvolvePlan::default()
    };
    assert_eq!(comes_to_the_same(plan), 3);
}

#[test]
fn baselines() {
    let (_folder, model) = model();
    let task = Task { max_steps: 2, ..task() };
    let plan = |out| BaselinePlan {
        model: model.clone(),
        task: task.clone(),
        count: 1_020_000,
        out: Some(out),
        ..BaselinePlan::default()
    };
    assert_eq!(comes_to_the_same(plan), 2);
}

#[test]
fn comparisons_of_controllers() {
    let plan = |out| TransferPlan { plants: 2, task: task(), out, ..TransferPlan::default() };
    assert_eq!(comes_to_the_same(plan), 4);
}

#[test]
fn forecasts_and_calibrations() {
    let folder = tempfile::tempdir().unwrap();
    let grow = GrowPlan {
        plants: 2,
        task: Task::open_loop(200),
        out: folder.path().join("grown"),
        ..GrowPlan::default()
    };
    let tracks = grow.execute(&Silent).unwrap().tracks;
    let models = [ModelKind::TIP, ModelKind::STEM].map(|kind| {
        let out = folder.path().join(format!("{}.json", kind.name()));
        let tracks = tracks.clone();
        FitPlan { tracks, kind, out: out.clone(), anyway: true, ..FitPlan::default() }
            .execute(&Silent)
            .unwrap();
        out
    });
    let plan = |out| ForecastPlan {
        models: models.to_vec(),
        plants: 2,
        horizons_min: vec![5.0, 60.0],
        interval_min: 300.0,
        out: Some(out),
        ..ForecastPlan::default()
    };
    assert_eq!(comes_to_the_same(plan), 4);
    let plan = |out| CalibratePlan { tracks: tracks.clone(), out: Some(out), ..CalibratePlan::default() };
    assert_eq!(comes_to_the_same(plan), 2);
}

#[test]
fn photographs_of_virtual_plants() {
    let mut greenhouse = Greenhouse::default();
    (greenhouse.scene.width, greenhouse.scene.height) = (216, 162);
    let plan = |out| GrowPlan {
        plants: 2,
        task: Task::open_loop(5),
        greenhouse: greenhouse.clone(),
        photographs: true,
        out,
        ..GrowPlan::default()
    };
    assert_eq!(comes_to_the_same(plan), 2);
}

#[test]
fn sweeps() {
    let (folder, _) = model();
    let file = folder.path().join("sweep.toml");
    let text = "model = \"model.json\"\nseeds = [3, 8]\n[grid]\nevolution.generations = [1, 3]\n[evolve]\n\
                trial_plants = 5\nevolution.runs = 2\ntask = { max_steps = 60 }\n";
    fs::write(&file, text).unwrap();
    let config = SweepConfig::read(&file).unwrap();
    let folder = folder.path().to_owned();
    let plan = |out| SweepPlan { out, resume: false, folder: folder.clone(), config: config.clone() };
    assert_eq!(comes_to_the_same(plan), 4);
}

#[test]
fn comparisons_of_methods() {
    let search = RuleSearch { generations: 1, population: 4, episodes: 2, starts: 1 };
    let rule = MethodKind::Tune { model: ModelKind::STEM, score: None, search };
    let config = ReplicatesConfig {
        replicates: 2,
        plants: 2,
        steps: 150,
        test_plants: 2,
        task: task(),
        reference: Some(search),
        methods: vec![Method { name: "rule".to_owned(), kind: rule }],
        scenarios: vec![
            Scenario::named("one"),
            Scenario { controllers_of: Some("one".to_owned()), ..Scenario::named("other") },
        ],
        ..ReplicatesConfig::default()
    };
    let plan = |out| ReplicatesPlan { out, resume: false, config: config.clone() };
    assert_eq!(comes_to_the_same(plan), 5);
}

#[test]
fn studies() {
    let quick = StudyConfig::quick();
    let config = StudyConfig {
        experiments: 2,
        steps: 40,
        random_controllers: 200,
        trial_plants: 5,
        reality_plants: 1,
        test_plants: 2,
        task: Task { max_steps: 15, ..task() },
        evolution: EvolutionConfig { runs: 2, generations: 3, ..quick.evolution.clone() },
        rule: RuleSearch { generations: 1, population: 4, episodes: 2, starts: 1 },
        ..quick
    };
    let plan = |out| StudyPlan { out, config: config.clone(), ..StudyPlan::default() };
    assert_eq!(comes_to_the_same(plan), 2 + 4 + 3 + 2);
    // The report of a study that is over stays when somebody goes on with it.
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(folder.path().join("study"));
    plan.execute(&Silent).unwrap();
    let report = || fs::read_to_string(plan.out.join("report.html")).unwrap();
    let written = report();
    StudyPlan::of_folder(&plan.out).unwrap().execute(&Silent).unwrap();
    assert!(report() == written && !written.contains("A study at work"));
}
