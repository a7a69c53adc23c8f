//! Controllers on the same unseen plants: the same bits for any number of threads and after an interruption.

#[path = "common/tent.rs"]
mod small_tent;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use small_tent::small_tent;
use tropism::geometry::Point;
use tropism::observation::Quality;
use tropism::obstacle::Obstacle;
use tropism::task::Task;
use tropism::track::{Sample, Track};
use tropism::vision::VisionConfig;
use tropism_bean::Trial;
use tropism_bean::tent::Greenhouse;
use tropism_lab::fit::FitPlan;
use tropism_lab::report::ReportPlan;
use tropism_lab::score::ScorePlan;
use tropism_lab::status::{StatusPlan, StatusResults};
use tropism_lab::transfer::{ControllerSource, TransferPlan, read_controllers};
use tropism_lab::{ControllerSpec, Error, Monitor, RunConfig, RunPlan, Silent, Work, Workflow, files};
use tropism_rig::file::RigFile;

fn task(steps: u32) -> Task {
    Task { max_steps: steps, ..Task::default() }
}

/// Two controllers, three plants, 60 steps.
fn plan(out: PathBuf) -> TransferPlan {
    TransferPlan { plants: 3, task: task(60), greenhouse: small_tent(), out, ..TransferPlan::default() }
}

/// All files of a folder but its lock.
fn content(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if !path.ends_with("run.lock") {
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

fn on_threads<T: Send>(count: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap().install(work)
}

/// Asks for an end after `limit` units.
struct Until {
    limit: u64,
    done: AtomicU64,
    skipped: AtomicU64,
}

impl Until {
    fn new(limit: u64) -> Self {
        Self { limit, done: AtomicU64::new(0), skipped: AtomicU64::new(0) }
    }
}

impl Monitor for Until {
    fn advance(&self, count: u64) {
        self.done.fetch_add(count, Ordering::SeqCst);
    }

    fn skip(&self, count: u64) {
        self.skipped.fetch_add(count, Ordering::SeqCst);
    }

    fn may_go_on(&self) -> bool {
        self.done.load(Ordering::SeqCst) < self.limit
    }
}

#[test]
fn threads_and_interruptions_change_no_bit() {
    let folder = tempfile::tempdir().unwrap();
    let plan = |name: &str| TransferPlan { optimum: true, ..plan(folder.path().join(name)) };
    let (one, two, mut broken_off) = (plan("one"), plan("two"), plan("broken-off"));
    let results = on_threads(1, || one.execute(&Silent)).unwrap();
    assert_eq!(on_threads(2, || two.execute(&Silent)).unwrap(), results);
    let wanted = content(&one.out);
    assert!(wanted == content(&two.out));
    let names =
        ["plants.csv", "transfer.json", "report.html", "transfer.toml", "tracks/greedy/plant-0003.csv"];
    for name in names.into_iter().chain(["optima/plant-0001.csv"]) {
        assert!(wanted.contains_key(Path::new(name)), "{name}");
    }
    // Once among the tracks, and once among the optima.
    for (limit, skipped) in [(4, 0), (3, 4)] {
        let monitor = Until::new(limit);
        let error = on_threads(1, || broken_off.execute(&monitor)).unwrap_err();
        assert!(matches!(error, Error::Interrupted { folder } if folder == broken_off.out));
        assert_eq!(monitor.skipped.into_inner(), skipped);
        let status = StatusPlan { folder: broken_off.out.clone(), model: None }.execute(&Silent).unwrap();
        let StatusResults::Work(status) = status else { panic!("{status:?}") };
        let (steered, found) = if skipped == 0 { (4, 0) } else { (6, 1) };
        let parts: Vec<(u64, u64)> = status.parts.iter().map(|part| (part.done, part.total)).collect();
        assert_eq!((parts[0].0 + parts[1].0, parts[1].1, parts[2]), (steered, 3, (found, 3)));
        assert!(!status.is_over && status.process.is_none());
        let refusal = TransferPlan { resume: false, ..broken_off.clone() }.execute(&Silent).unwrap_err();
        assert!(refusal.to_string().contains("a comparison is here already"), "{refusal}");
        broken_off.resume = true;
    }
    let rest = Until::new(u64::MAX);
    assert_eq!(broken_off.execute(&rest).unwrap(), results);
    // Two units, and three plants to judge.
    assert_eq!((rest.skipped.into_inner(), rest.done.into_inner()), (7, 5));
    assert!(wanted == content(&broken_off.out));
    assert_eq!(TransferPlan::of_folder(&broken_off.out).unwrap(), broken_off);
    broken_off.seed = 2;
    broken_off.task = task(61);
    let refusal = broken_off.execute(&Silent).unwrap_err().to_string();
    assert!(refusal.contains("transfer.toml: a comparison with other settings is here: "), "{refusal}");
    assert!(refusal.contains("`seed` = 1, wanted 2; `task.max_steps` = 60, wanted 61:"), "{refusal}");
}

#[test]
fn a_report_compares_the_controllers_of_transfers() {
    let folder = tempfile::tempdir().unwrap();
    let plans = ["one", "other"].map(|name| plan(folder.path().join(name)));
    let report = |sources: &[&TransferPlan]| {
        let sources = sources.iter().map(|plan| plan.out.clone()).collect();
        let figures = Some(folder.path().join("figures"));
        ReportPlan { sources, out: folder.path().join("report.html"), figures }.execute(&Silent)
    };
    fs::create_dir_all(&plans[1].out).unwrap();
    fs::write(plans[1].out.join("transfer.toml"), "").unwrap();
    let error = report(&[&plans[1]]).unwrap_err().to_string();
    assert!(error.contains("other: there is no transfer.json yet"), "{error}");
    fs::remove_dir_all(&plans[1].out).unwrap();
    let results = plans.each_ref().map(|plan| plan.execute(&Silent).unwrap());
    let alone = report(&[&plans[0]]).unwrap();
    let [comparison] = &alone.comparisons[..] else { panic!("{alone:?}") };
    let [one, other] = &results[0].controllers[..] else { panic!("two controllers") };
    assert_eq!((&comparison.pairs[0].one, &comparison.pairs[0].other), (&one.name, &other.name));
    assert_eq!(comparison.pairs[0].sizes, [3, 3]);
    let both = report(&[&plans[0], &plans[1]]).unwrap();
    assert_eq!(both.comparisons[0].pairs.len(), 6);
    assert_eq!(both.comparisons[0].pairs[0].one, format!("{} of one", one.name));
    let svg = fs::read_dir(folder.path().join("figures")).unwrap().flatten();
    assert!(svg.into_iter().any(|file| file.file_name().to_string_lossy().ends_with(".svg")));
}

#[test]
fn a_score_is_that_of_the_plant_grown_alone_and_no_optimum_lies_below_it() {
    let folder = tempfile::tempdir().unwrap();
    let plan = TransferPlan { optimum: true, plant_seeds: Some(40..42), ..plan(folder.path().join("out")) };
    let results = plan.execute(&Silent).unwrap();
    let track = files::read_track(&plan.out.join("tracks/greedy/plant-0002.csv")).unwrap();
    let Greenhouse { bean, layout, .. } = &plan.greenhouse;
    let mut greedy = ControllerSpec::Greedy.build(&plan.task, layout, plan.period_min);
    let grown = Trial::new(bean).grow(41, &mut *greedy, &plan.task, &mut tropism::environment::unwatched);
    assert!((plan.task.fitness(&track) - plan.task.fitness(&grown)).abs() < 1e-3);
    assert_eq!(track.samples.len(), grown.samples.len());
    assert!(results.controllers.iter().all(|one| one.share_of_optimum.unwrap() <= 1.0), "{results:?}");
    // The task reads eq. (9) by approach; to the letter it charges for crossing a target.
    for one in &results.controllers {
        let [letter, approach] = one.both_readings.as_ref().unwrap();
        assert!((&approach.values, approach.mean) == (&one.fitness, one.mean), "{one:?}");
        assert!(letter.mean < approach.mean + 1e-9, "{one:?}");
    }
    let json = fs::read_to_string(plan.out.join("transfer.json")).unwrap();
    assert!(json.contains("\"schema\": \"tropism.transfer/1\"") && json.contains("\"is_virtual\": true"));
    let html = fs::read_to_string(plan.out.join("report.html")).unwrap();
    assert!(html.contains("Virtual plants") && html.contains("Under 9") && html.contains("By approach"));
}

#[test]
fn a_optimum_says_on_how_many_plants_a_schedule_does_the_whole_task() {
    let folder = tempfile::tempdir().unwrap();
    // A target before the tip, and a disc beside it, or one in which it lies: nothing can avoid that one.
    let task = |centre: [f64; 2]| Task {
        targets: vec![[0.0, 4.6].into()],
        obstacles: vec![Obstacle::Disc { centre: centre.into(), radius_cm: 0.5 }],
        end_height_cm: 4.6,
        max_steps: 60,
        ..Task::obstacles()
    };
    let share = |name: &str, centre| {
        let plan = plan(folder.path().join(name));
        TransferPlan { optimum: true, task: task(centre), ..plan }.execute(&Silent).unwrap().optimum_done
    };
    assert_eq!(share("far", [3.0, 4.0]).unwrap().share, 1.0);
    assert_eq!(share("through", [0.0, 4.75]).unwrap().share, 0.0);
    assert_eq!(plan(folder.path().join("none")).execute(&Silent).unwrap().optimum_done, None);
}

#[test]
fn each_plant_has_a_sequence_of_its_own_that_neither_threads_nor_resuming_change() {
    let folder = tempfile::tempdir().unwrap();
    let low =
        Task { targets: vec![[1.0, 4.3].into(), [0.0, 4.6].into()], end_height_cm: 4.7, ..Task::default() };
    let plan = |out: &str, resume| TransferPlan {
        task: low.clone(),
        random_targets: true,
        resume,
        ..plan(folder.path().join(out))
    };
    let one = on_threads(1, || plan("one", false).execute(&Silent)).unwrap();
    let two = on_threads(2, || plan("two", false).execute(&Silent)).unwrap();
    assert_eq!(one, two);
    assert_eq!(plan("one", true).execute(&Silent).unwrap(), one);
    // A task whose targets are to be drawn says the same.
    let drawn = low.to_draw().unwrap();
    let drawn = TransferPlan { task: drawn, random_targets: false, ..plan("drawn", false) };
    assert_eq!(drawn.execute(&Silent).unwrap(), one);
    assert!(one.random_targets && one.controllers[0].targets.iter().all(|target| target.target.is_none()));
    let table = fs::read_to_string(folder.path().join("one/plants.csv")).unwrap();
    let column = table.lines().next().unwrap().split(',').position(|name| name == "target_1_x_cm").unwrap();
    let place = |row: &str| row.split(',').nth(column).map(str::to_owned);
    let places: Vec<_> = table.lines().map(place).collect();
    // The heading, three plants under greedy, and the same three under the periodic rule.
    assert_eq!(places[1..4], places[4..7]);
    assert!(places[1] != places[2] && places[2] != places[3], "{places:?}");
}

#[test]
fn a_run_keeps_the_targets_that_were_drawn_for_it() {
    let folder = tempfile::tempdir().unwrap();
    let low =
        Task { count: 2, highest_cm: 4.2, end_height_cm: 4.25, max_steps: 60, ..Task::random_targets() };
    let run = |seed, out: &str| {
        let rig = RigFile::greenhouse(small_tent(), VisionConfig::default());
        let config = RunConfig::new(rig, ControllerSpec::Greedy, low.clone(), seed);
        let plan = RunPlan { out: folder.path().join(out), config, ..RunPlan::default() };
        let track = plan.execute(&Silent).unwrap().track;
        (RunConfig::read(&plan.out).unwrap().task, track)
    };
    let (task, track) = run(7, "seven");
    assert!(task.targets.len() == 2 && !task.is_to_draw(), "{task:?}");
    assert_ne!(run(8, "eight").0, task, "another seed, other targets");
    let again = RunPlan::of_folder(&folder.path().join("seven"), false).unwrap();
    let again = RunPlan { out: folder.path().join("again"), ..again };
    assert_eq!(again.execute(&Silent).unwrap().track, track);
    let scored = ScorePlan { task: Some(low), tracks: vec![folder.path().join("seven")] };
    let error = scored.execute(&Silent).unwrap_err().to_string();
    assert!(error.contains("still to be drawn"), "{error}");
}

#[test]
fn photographs_show_the_plant_of_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let plan = TransferPlan {
        photographs: true,
        plant_seeds: Some(40..41),
        task: task(12),
        ..plan(folder.path().join("out"))
    };
    plan.execute(&Silent).unwrap();
    let path = plan.out.join("tracks/greedy/plant-0001.csv");
    let track = files::read_track(&path).unwrap();
    let fit = FitPlan { tracks: vec![path], out: folder.path().join("model.json"), ..FitPlan::default() };
    assert!(fit.execute(&Silent).unwrap().is_virtual, "measured tips of a virtual plant stay virtual");
    let rig = RigFile::greenhouse(small_tent(), VisionConfig::default());
    let config = RunConfig::new(rig, ControllerSpec::Greedy, plan.task.clone(), 40);
    let run = RunPlan { out: folder.path().join("run"), config, ..RunPlan::default() };
    run.execute(&Silent).unwrap();
    let photographed = files::read_track(&run.out.join("track.csv")).unwrap();
    // The file of a run for targets has no stems.
    let seen = |track: &Track| -> Vec<_> {
        track.samples.iter().map(|sample| Sample { stem: None, ..sample.clone() }).collect()
    };
    assert_eq!(seen(&track), seen(&photographed));
    assert!(track.samples.iter().all(|sample| sample.quality == Quality::Measured));
    let top_y = track.numbers("top_y_cm").unwrap();
    let off = track.samples.iter().zip(&top_y).map(|(sample, y)| (sample.tip.y - y).abs());
    assert!(off.fold(0.0, f64::max) < 0.3, "the tip is measured where it is");
}

#[track_caller]
fn is_refused(plan: &TransferPlan, wanted: &str) {
    let error = plan.execute(&Silent).unwrap_err().to_string();
    assert!(error.contains(wanted), "{error}");
    assert!(!plan.out.exists(), "a refused plan leaves nothing");
}

#[test]
fn bad_plans_are_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let plan = || plan(folder.path().join("out"));
    is_refused(&TransferPlan { plants: 0, ..plan() }, "found plants = 0, wanted 1 to");
    is_refused(&TransferPlan { plant_seeds: Some(7..7), ..plan() }, "found `plant_seeds` 7..7, wanted");
    is_refused(&TransferPlan { controllers: Vec::new(), ..plan() }, "`controllers` is empty");
    let mut twice = plan();
    twice.controllers.push(twice.controllers[0].clone());
    is_refused(&twice, "greedy stands twice");
    is_refused(
        &TransferPlan { reference: Some("rule".to_owned()), ..plan() },
        "wanted one of greedy, periodic",
    );
    is_refused(&TransferPlan { task: Task::open_loop(1000), ..plan() }, "it has no targets");
    is_refused(&TransferPlan { model: Some("absent.json".into()), ..plan() }, "absent.json: cannot read");
    let absent = read_controllers(&[ControllerSource::Path("absent.json".into())]).unwrap_err().to_string();
    assert!(absent.contains("absent.json: cannot read"), "{absent}");
}

/// Obstacles in the way of a tip that goes straight up: a low bar which it meets within hours.
fn behind_a_bar() -> Task {
    let bar = Obstacle::Line { ends: [Point::new(-8.0, 5.0), Point::new(8.0, 5.0)] };
    let task = Task { targets: vec![Point::new(0.0, 5.5)], obstacles: vec![bar], ..Task::obstacles() };
    Task { end_height_cm: 5.5, max_steps: 60, ..task }
}

#[test]
fn a_task_with_obstacles_is_judged_by_the_seen_stems_with_and_without_photographs() {
    let folder = tempfile::tempdir().unwrap();
    for photographs in [false, true] {
        let out = folder.path().join(format!("photographs-{photographs}"));
        let plan =
            TransferPlan { plants: 1, task: behind_a_bar(), photographs, out, ..TransferPlan::default() };
        let results = plan.execute(&Silent).unwrap();
        for controller in &results.controllers {
            // Nobody comes through the bar without touching it.
            assert_eq!(controller.done.unwrap().share, 0.0, "{controller:?}");
            assert!(controller.mean < 0.0 && controller.both_readings.is_none(), "{controller:?}");
        }
        // The same from the written tracks.
        let again = TransferPlan { resume: true, ..plan }.execute(&Silent).unwrap();
        assert_eq!(again, results);
    }
}

#[test]
fn a_run_among_obstacles_is_scored_from_its_folder_as_it_was_steered() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let rig = RigFile::greenhouse(small_tent(), VisionConfig::default());
    let config = RunConfig::new(rig, ControllerSpec::Greedy, behind_a_bar(), 3);
    let run = RunPlan { config, out: out.clone(), ..RunPlan::default() }.execute(&Silent).unwrap();
    let scores = ScorePlan { tracks: vec![out.clone()], task: None }.execute(&Silent).unwrap();
    assert!((scores[0].fitness - run.fitness.unwrap()).abs() < 1e-3, "{scores:?} {:?}", run.fitness);
    assert_eq!(scores[0].is_done, Some(false));
    // A track without stems cannot be scored so.
    let tips = folder.path().join("tips.csv");
    fs::write(&tips, "tip_x_cm,tip_y_cm,light\n0,4,left\n0,6,dark\n").unwrap();
    let plan = ScorePlan { tracks: vec![tips], task: Some(behind_a_bar()) };
    let error = plan.execute(&Silent).unwrap_err().to_string();
    assert!(
        error.contains(
            "tips.csv: the task is scored by the stem, and this track has none (columns stem_1_x_cm"
        ),
        "{error}"
    );
}
