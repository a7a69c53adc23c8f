//! Planners as files.

use tropism::control::{Controller, PredictiveRule};
use tropism::environment::unwatched;
use tropism::evolve::TunedRule;
use tropism::geometry::Point;
use tropism::lamps::Layout;
use tropism::observation::Observation;
use tropism::plant::FittedModel;
use tropism::plant::stem::PlaneModel;
use tropism::task::Task;
use tropism_bean::{Species, Trial};
use tropism_lab::{ControllerSpec, files};

/// A folder with `model.json`, the model of a virtual bean's tip.
fn folder_of_model() -> (tempfile::TempDir, PlaneModel) {
    let species = Species::default();
    let trial = Trial::new(&species);
    let task = Task::open_loop(300);
    let mut controller = ControllerSpec::periodic(90.0).build(&task, &trial.layout, 5.0);
    let tracks = [trial.grow(1, &mut controller, &task, &mut unwatched)];
    let model = PlaneModel::fit(&tracks).unwrap();
    let folder = tempfile::tempdir().unwrap();
    files::write(&folder.path().join("model.json"), model.to_json().as_bytes()).unwrap();
    (folder, model)
}

#[test]
fn a_planner_comes_back_with_its_model_and_decides_as_before() {
    let (folder, _) = folder_of_model();
    let spec = ControllerSpec::read(&folder.path().join("model.json")).unwrap();
    assert_eq!((spec.description(), spec.own_period_min()), ("planner".to_owned(), Some(5.0)));
    let again: ControllerSpec = toml::from_str(&toml::to_string(&spec).unwrap()).unwrap();
    assert_eq!(again, spec);
    let task = Task::default();
    let decided = |spec: &ControllerSpec| {
        let mut controller = spec.build(&task, &Layout::default(), 5.0);
        let tips = (0..5).map(|step| Point::new(0.1 * f64::from(step), 5.0 + 0.03 * f64::from(step)));
        tips.map(|tip| controller.decide(&Observation::simulated(tip))).collect::<Vec<_>>()
    };
    assert_eq!(decided(&again), decided(&spec));
    assert!(task.has_goal());
}

#[test]
fn a_planner_file_names_its_model_and_its_rule() {
    let (folder, model) = folder_of_model();
    let path = folder.path().join("planner.toml");
    let rule = PredictiveRule { shift_steps: 4.0, ..PredictiveRule::default() };
    let tuned = TunedRule::of_model(rule, &model, &model.to_json(), true, None);
    files::write(&folder.path().join("rule.json"), tuned.to_json().as_bytes()).unwrap();
    let text = "model = \"model.json\"\nrule = \"rule.json\"\n[planner]\nplants = 7\n";
    files::write(&path, text.as_bytes()).unwrap();
    let ControllerSpec::Plan(spec) = ControllerSpec::read(&path).unwrap() else { panic!("a planner") };
    assert_eq!((spec.planner.plants, spec.planner.rule), (7, rule));

    for (text, words) in [
        ("model = \"absent.json\"", "absent.json"),
        ("model = \"rule.json\"", "rule.json"),
        ("model = \"model.json\"\nrule = \"model.json\"", "wanted \"tropism.rule/1\""),
        ("model = \"model.json\"\n[planner]\nplants = 1", "planner.plants = 1"),
        ("model = \"model.json\"\nplnner = 1", "plnner"),
    ] {
        files::write(&path, text.as_bytes()).unwrap();
        let error = ControllerSpec::read(&path).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn a_planner_is_for_the_lamps_and_the_interval_of_its_model() {
    let (folder, _) = folder_of_model();
    let spec = ControllerSpec::read(&folder.path().join("model.json")).unwrap();
    spec.check(&Layout::default(), 5.0).unwrap();
    for (layout, period_min) in [(Layout::four_sides(), 5.0), (Layout::default(), 10.0)] {
        let error = spec.check(&layout, period_min).unwrap_err().to_string();
        assert!(
            error.contains("found a planner with a model of the lamps left, right and steps of 5"),
            "{error}"
        );
    }
}
