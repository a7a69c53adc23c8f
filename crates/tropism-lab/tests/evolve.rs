//! From a track to a champion without a shell: the library alone, and the same results after an interruption.

mod common;

use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

use tropism::control::{Dimming, Periodic};
use tropism::environment::unwatched;
use tropism::evolve::EvolutionConfig;
use tropism::geometry::Point;
use tropism::plant::FittedModel;
use tropism::plant::stem::PlaneModel;
use tropism::simulation::simulate;
use tropism::task::Task;
use tropism_bean::{Species, Trial};
use tropism_lab::baseline::BaselinePlan;
use tropism_lab::evolve::EvolvePlan;
use tropism_lab::fit::FitPlan;
use tropism_lab::score::ScorePlan;
use tropism_lab::show::ShowPlan;
use tropism_lab::simulate::SimulatePlan;
use tropism_lab::{ControllerSpec, Error, Monitor, Silent, Workflow, files};
use tropism_neat::{Activation, Generation};

/// Fits a model to one plant that leans after the lamp, and plans an evolution on it.
fn plan(folder: &Path, out: &str) -> EvolvePlan {
    common::leaning_plant(folder);
    let fit = FitPlan {
        tracks: vec![folder.join("track.csv")],
        out: folder.join("model.json"),
        replace: true,
        ..FitPlan::default()
    };
    let results = fit.execute(&Silent).unwrap();
    assert_eq!((results.tracks, results.shifts, results.is_virtual), (1, 119, false));
    let targets = vec![Point::new(1.0, 5.0), Point::new(3.0, 6.0)];
    EvolvePlan {
        model: folder.join("model.json"),
        out: folder.join(out),
        task: Task { targets, max_steps: 100, ..Task::default() },
        evolution: EvolutionConfig { runs: 2, generations: 30, ..EvolutionConfig::default() },
        trial_plants: 20,
        ..EvolvePlan::default()
    }
}

#[test]
fn lamps_are_dimmed_by_smooth_neurons_on_a_model_of_the_stem_alone() {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = plan(folder.path(), "dimmed");
    plan.evolution.dimming = Dimming::Ratio;
    let error = plan.check().unwrap_err().to_string();
    assert!(error.contains("output_activation") && error.contains("UnsignedSigmoid"), "{error}");
    plan.evolution.neat.output_activation = Activation::UnsignedSigmoid;
    let error = plan.execute(&Silent).unwrap_err().with_causes();
    assert!(error.contains("fit a model of the stem"), "{error}");
    let species = Species::default();
    let trial = Trial::new(&species);
    let mut lamps = Periodic::new(24, &trial.layout);
    let track = trial.grow(1, &mut lamps, &Task::open_loop(200), &mut unwatched);
    let model = PlaneModel::fit([&track]).unwrap();
    fs::write(&plan.model, model.to_json()).unwrap();
    plan.evolution.generations = 3;
    plan.execute(&Silent).unwrap();
    let champion = ControllerSpec::read(&folder.path().join("dimmed/champion.json")).unwrap();
    assert_eq!(champion.champion().unwrap().dimming, Dimming::Ratio);
    let steered =
        simulate(&model, &mut champion.champion().unwrap().controller(&plan.task).unwrap(), &plan.task, 1);
    let totals =
        steered.samples.iter().filter(|sample| !sample.is_dark()).map(|sample| sample.lighting().total());
    assert!(
        totals.clone().count() > 10 && totals.into_iter().all(|total| total == 1.0),
        "both share one lamp"
    );
    let on_tip = SimulatePlan {
        model: self::plan(folder.path(), "unused").model,
        controller: champion,
        out: folder.path().join("on-tip.csv"),
        ..SimulatePlan::default()
    };
    let error = on_tip.execute(&Silent).unwrap_err().to_string();
    assert!(error.contains("fit a model of the stem"), "{error}");
}

/// Counts the monitor's calls, and asks for an end after `limit` generations.
struct Counter {
    limit: u32,
    generations: AtomicU32,
    units: Mutex<(u64, u64)>,
}

impl Counter {
    fn until(limit: u32) -> Self {
        Self { limit, generations: AtomicU32::new(0), units: Mutex::default() }
    }
}

impl Monitor for Counter {
    fn stage(&self, _name: &str, total: u64) {
        self.units.lock().unwrap().0 += total;
    }

    fn advance(&self, count: u64) {
        self.units.lock().unwrap().1 += count;
    }

    fn skip(&self, count: u64) {
        self.advance(count);
    }

    fn generation(&self, _run: u32, _generation: &Generation) {
        self.generations.fetch_add(1, Ordering::SeqCst);
    }

    fn may_go_on(&self) -> bool {
        self.generations.load(Ordering::SeqCst) < self.limit
    }
}

#[test]
fn an_interrupted_evolution_resumes_to_the_same_champion() {
    let folder = tempfile::tempdir().unwrap();
    let whole = plan(folder.path(), "whole");
    let results = whole.execute(&Silent).unwrap();
    assert!(results.runs.len() == 2 && results.evaluations >= 2 * 30 * 50, "{results:?}");
    let [least, median, greatest] = results.best_fitness_range();
    assert!(least <= median && median <= greatest);

    let mut broken_off = plan(folder.path(), "broken-off");
    let error = broken_off.execute(&Counter::until(20)).unwrap_err();
    assert!(matches!(error, Error::Interrupted { folder } if folder == broken_off.out));
    let refusal = broken_off.execute(&Silent).unwrap_err().to_string();
    assert!(refusal.contains("an evolution is here already"), "{refusal}");
    broken_off.resume = true;
    let rest = Counter::until(u32::MAX);
    let resumed = broken_off.execute(&rest).unwrap();
    assert_eq!(resumed.runs, results.runs);
    assert!(rest.generations.into_inner() < 60, "what was done is not repeated");
    assert_eq!(rest.units.into_inner().unwrap(), (60, 60));
    for file in ["champion.json", "history.csv", "champions/run-01.json", "evolution.toml"] {
        assert!(
            fs::read(whole.out.join(file)).unwrap() == fs::read(broken_off.out.join(file)).unwrap(),
            "{file}"
        );
    }
    broken_off.seed = 2;
    let refusal = broken_off.execute(&Silent).unwrap_err().to_string();
    assert!(refusal.contains("an evolution with other settings is here: `seed` = 1, wanted 2:"), "{refusal}");
}

#[test]
fn an_extended_evolution_is_the_longer_one() {
    let folder = tempfile::tempdir().unwrap();
    let whole = plan(folder.path(), "whole");
    let results = whole.execute(&Silent).unwrap();
    let mut extended = plan(folder.path(), "extended");
    extended.evolution.generations = 12;
    extended.execute(&Silent).unwrap();
    (extended.resume, extended.evolution.generations) = (true, 30);
    assert_eq!(extended.execute(&Silent).unwrap().runs, results.runs);
    for file in ["champion.json", "history.csv", "evolution.toml"] {
        assert!(
            fs::read(whole.out.join(file)).unwrap() == fs::read(extended.out.join(file)).unwrap(),
            "{file}"
        );
    }
    extended.evolution.generations = 20;
    let refusal = extended.execute(&Silent).unwrap_err().to_string();
    assert!(refusal.contains("`evolution.generations` = 30, wanted 20:"), "{refusal}");
}

#[test]
fn a_champion_is_simulated_scored_and_shown() {
    let folder = tempfile::tempdir().unwrap();
    let evolve = plan(folder.path(), "evolution");
    evolve.execute(&Silent).unwrap();
    let champion = evolve.out.join("champion.json");
    let simulate = SimulatePlan {
        model: evolve.model.clone(),
        controller: ControllerSpec::read(&champion).unwrap(),
        task: evolve.task.clone(),
        out: folder.path().join("steered.csv"),
        ..SimulatePlan::default()
    };
    let simulated = simulate.execute(&Silent).unwrap();
    let score = ScorePlan { tracks: vec![simulate.out.clone()], task: Some(evolve.task.clone()) };
    let scores = score.execute(&Silent).unwrap();
    // A track keeps five decimals of a cm.
    assert!((scores[0].fitness - simulated.mean_fitness).abs() < 1e-2, "{scores:?}");
    let shown = ShowPlan { source: champion, ..ShowPlan::default() }.execute(&Silent).unwrap();
    assert_eq!((shown.fitness, shown.is_virtual), (Some(simulated.mean_fitness), Some(false)));
    assert!(shown.drawing.starts_with(&shown.summary()), "{}", shown.drawing);

    let baseline = BaselinePlan {
        model: evolve.model,
        task: evolve.task,
        count: 500,
        out: Some(folder.path().join("baseline")),
        ..BaselinePlan::default()
    };
    let random = baseline.execute(&Silent).unwrap();
    assert!(random.median <= random.best);
    let refusal = baseline.execute(&Silent).unwrap_err().to_string();
    assert!(refusal.contains("a baseline is here already"), "{refusal}");
    let other = BaselinePlan { out: Some(folder.path().join("other")), ..baseline };
    let interrupted = other.execute(&Counter::until(0)).unwrap_err();
    assert!(matches!(interrupted, Error::Interrupted { folder } if Some(&folder) == other.out.as_ref()));
}

/// In 40 steps of five minutes no plant grows by 3 cm; in 40 of half an hour it does.
#[test]
fn targets_are_drawn_for_plants_at_the_steps_of_the_model() {
    let folder = tempfile::tempdir().unwrap();
    let slow = |path: &str| {
        let mut track = files::read_track(&folder.path().join("track.csv")).unwrap();
        track.period_min *= 6.0;
        track.samples.iter_mut().for_each(|sample| sample.time_s *= 6.0);
        files::write_track(&folder.path().join(path), &track).unwrap();
    };
    let EvolvePlan { model, .. } = plan(folder.path(), "unused");
    let task =
        Task { count: 2, highest_cm: 7.0, end_height_cm: 7.5, max_steps: 40, ..Task::random_targets() };
    let plan = |model: &Path| BaselinePlan {
        model: model.to_owned(),
        task: task.clone(),
        count: 10,
        ..BaselinePlan::default()
    };
    let error = plan(&model).execute(&Silent).unwrap_err().to_string();
    assert!(error.contains("no typical plant grows as high as 7 cm in 40 steps"), "{error}");
    slow("slow.csv");
    let out = folder.path().join("slow.json");
    let fit =
        FitPlan { tracks: vec![folder.path().join("slow.csv")], out: out.clone(), ..FitPlan::default() };
    fit.execute(&Silent).unwrap();
    assert_eq!(plan(&out).execute(&Silent).unwrap().count, 10);
}
