//! Tuning a rule: it ends when it is asked to, and goes on to the same rule.

use std::fs;
use std::sync::atomic::{AtomicU64, Ordering};

use tropism::control::Periodic;
use tropism::environment::unwatched;
use tropism::evolve::RuleSearch;
use tropism::lamps::Layout;
use tropism::task::Task;
use tropism_bean::{Species, Trial};
use tropism_lab::fit::{FitPlan, ModelKind};
use tropism_lab::tune::TunePlan;
use tropism_lab::{Error, Monitor, Silent, Workflow, files};

/// Asks for an end after so many generations.
struct Until(u64, AtomicU64);

impl Monitor for Until {
    fn advance(&self, count: u64) {
        self.1.fetch_add(count, Ordering::SeqCst);
    }

    fn may_go_on(&self) -> bool {
        self.1.load(Ordering::SeqCst) < self.0
    }
}

#[test]
fn an_interrupted_search_goes_on_to_the_same_rule() {
    let folder = tempfile::tempdir().unwrap();
    let (track, model, out) = ("track.csv", "stem.json", "rule.json");
    let [track, model, out] = [track, model, out].map(|name| folder.path().join(name));
    let species = Species::default();
    let task = Task::open_loop(300);
    let mut periodic = Periodic::new(72, &Layout::default());
    let grown = Trial::new(&species).grow(5_000_000, &mut periodic, &task, &mut unwatched);
    files::write_track(&track, &grown).unwrap();
    let fit =
        FitPlan { tracks: vec![track], kind: ModelKind::STEM, out: model.clone(), ..FitPlan::default() };
    let fitted = fit.execute(&Silent).unwrap();
    assert_eq!((fitted.shifts, fitted.is_virtual), (300, true));
    let search = RuleSearch { generations: 6, population: 4, episodes: 2, starts: 2 };
    let plan = TunePlan { model, out: out.clone(), search, ..TunePlan::default() };
    let whole = plan.execute(&Silent).unwrap();
    let rule = fs::read(&out).unwrap();
    // The model is of one plant: its fitness there is known, and none is expected.
    assert!(whole.is_virtual && whole.expected.is_none() && whole.in_model.plants > 0, "{whole:?}");
    assert!(whole.outlook.is_empty() && whole.withheld.unwrap().contains("the model is of one plant"));
    let saved = folder.path().join("rule.search.jsonl");
    assert!(!saved.exists(), "the search is over");

    for taken in [plan.clone(), TunePlan { resume: true, ..plan.clone() }] {
        let refused = taken.execute(&Silent).unwrap_err().to_string();
        assert!(refused.contains("rule.json: a file is here already"), "{refused}");
    }
    // A search that replaces the rule goes on without asking again.
    let plan = TunePlan { replace: true, ..plan };
    for (generations, lines) in [(0, 1), (3, 3), (2, 4)] {
        let part = TunePlan { replace: generations == 0, resume: true, ..plan.clone() };
        match part.execute(&Until(generations, AtomicU64::new(0))) {
            Err(Error::Interrupted { folder }) => assert_eq!(folder, saved),
            other => panic!("{other:?}"),
        }
        assert!(fs::read_to_string(&saved).unwrap().lines().count() <= 1 + lines, "{generations}");
    }
    // Killed in the middle of a line.
    let mut text = fs::read_to_string(&saved).unwrap();
    assert!(text.lines().count() > 2, "{text}");
    text.truncate(text.len() - 3);
    fs::write(&saved, text).unwrap();
    let other = TunePlan { seed: 2, resume: true, ..plan };
    let refused = other.execute(&Silent).unwrap_err().to_string();
    assert!(
        refused.contains("rule.search.jsonl: a search with other settings is here: `seed` = 1, wanted 2:"),
        "{refused}"
    );
    let resumed = TunePlan::of_search(&out).unwrap().execute(&Silent).unwrap();
    assert_eq!((resumed.rule, resumed.in_model, resumed.greedy), (whole.rule, whole.in_model, whole.greedy));
    assert!(fs::read(&out).unwrap() == rule && !saved.exists());
    let error = TunePlan::of_search(&out).unwrap_err().to_string();
    assert!(error.contains("rule.json: the search of this rule is over"), "{error}");
}

#[test]
fn a_model_in_space_says_beforehand_what_a_rule_reaches_there() {
    let folder = tempfile::tempdir().unwrap();
    let [model, out] = ["space.json", "rule.json"].map(|name| folder.path().join(name));
    let species = Species::default();
    let trial = Trial { layout: Layout::four_sides(), in_space: true, ..Trial::new(&species) };
    let task = Task::open_loop(60);
    let track = |seed| {
        let path = folder.path().join(format!("{seed}.csv"));
        let grown = trial.grow(seed, &mut Periodic::new(12, &trial.layout), &task, &mut unwatched);
        files::write_track(&path, &grown).unwrap();
        path
    };
    let tracks = vec![track(1), track(2)];
    let fit = FitPlan { tracks, kind: ModelKind::SPACE, out: model.clone(), ..FitPlan::default() };
    assert_eq!(fit.execute(&Silent).unwrap().shifts, 120);
    let search = RuleSearch { generations: 1, population: 4, episodes: 2, starts: 1 };
    let plan = TunePlan {
        model: model.clone(),
        out,
        search,
        task: Task { max_steps: 3, ..Task::space() },
        ..TunePlan::default()
    };
    let tuned = plan.execute(&Silent).unwrap();
    assert!(tuned.withheld.is_none() && tuned.expected == Some(tuned.in_model), "{tuned:?}");
    // None gets up to a target in three steps, whatever the plant.
    let outlook: Vec<_> = tuned.outlook.iter().map(|one| (one.probability, one.interval)).collect();
    assert_eq!(outlook, [(0.0, Some([0.0; 2])); 3]);
    // Round a pole, too: the model knows contact.
    let task = Task { max_steps: 3, ..Task::spiral() };
    let wound = TunePlan { task, out: folder.path().join("spiral.json"), ..plan.clone() };
    let wound = wound.execute(&Silent).unwrap();
    assert!(wound.outlook.is_empty());
    assert!(wound.withheld.is_none() && wound.expected == Some(wound.in_model), "{wound:?}");
    let plane = FitPlan { kind: ModelKind::STEM, out: folder.path().join("stem.json"), ..fit };
    let error = plane.execute(&Silent).unwrap_err().to_string();
    assert!(error.contains("wanted two at mirrored places"), "{error}");
}
