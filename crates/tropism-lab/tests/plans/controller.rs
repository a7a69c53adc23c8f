//! Controllers as data.

use tropism::control::PredictiveRule;
use tropism::evolve::Trial;
use tropism::evolve::{Champion, TunedRule};
use tropism::geometry::Point;
use tropism::lamps::Lamp;
use tropism::lamps::{Layout, Light};
use tropism::observation::Observation;
use tropism::task::Task;
use tropism_lab::controller::ControllerSpec;

#[test]
fn six_hours_are_72_steps_of_five_minutes() {
    let spec = ControllerSpec::default();
    assert_eq!(spec.description(), "periodic, every 6 h");
    assert_eq!(ControllerSpec::periodic(90.0).description(), "periodic, every 90 min");
    let mut controller = spec.build(&Task::default(), &Layout::default(), 5.0);
    let seen = Observation::simulated(Task::default().start);
    let lights: Vec<Light> = (0..144).map(|_| controller.decide(&seen)).collect();
    assert!(lights[..72].iter().all(|&light| light == Light::LEFT));
    assert!(lights[72..].iter().all(|&light| light == Light::RIGHT));
}

#[test]
fn six_hours_are_six_hours_at_any_interval() {
    let seen = Observation::simulated(Task::default().start);
    for period_min in [1.0 / 6.0, 1.0, 2.0, 5.0, 7.0, 8.0, 10.0, 15.0, 30.0, 360.0] {
        let spec = ControllerSpec::default();
        spec.check(&Layout::default(), period_min).unwrap();
        let mut controller = spec.build(&Task::default(), &Layout::default(), period_min);
        let steps = (3000.0 / period_min) as usize;
        let lights: Vec<Light> = (0..steps).map(|_| controller.decide(&seen)).collect();
        let switches = (1..steps).filter(|&step| lights[step] != lights[step - 1]);
        for (number, step) in (1..).zip(switches) {
            let late = step as f64 * period_min - 360.0 * f64::from(number);
            assert!(late.abs() <= period_min / 2.0, "switch {number} at {period_min} min");
        }
    }
}

#[test]
fn a_switch_takes_at_least_one_step() {
    assert!(ControllerSpec::periodic(5.0).check(&Layout::default(), 5.0).is_ok());
    assert!(ControllerSpec::periodic(0.3).check(&Layout::default(), 0.1).is_ok());
    for (minutes, period_min) in [(4.5, 5.0), (6e6, 5.0), (f64::NAN, 5.0), (-5.0, 5.0)] {
        let error =
            ControllerSpec::periodic(minutes).check(&Layout::default(), period_min).unwrap_err().to_string();
        assert!(error.contains("wanted one to a million steps"), "{error}");
    }
}

#[test]
fn a_controller_comes_back_from_toml_and_json() {
    let genome = tropism_neat::random_genome(&tropism_neat::Config::wahby2016(), 2, 1, 1, 0);
    let network = ControllerSpec::network(Champion::of_genome(genome)).unwrap();
    for spec in [ControllerSpec::default(), ControllerSpec::Greedy, network, rule()] {
        let toml = toml::to_string(&spec).unwrap();
        assert_eq!(toml::from_str::<ControllerSpec>(&toml).unwrap(), spec, "{toml}");
        let json = serde_json::to_string(&spec).unwrap();
        assert_eq!(serde_json::from_str::<ControllerSpec>(&json).unwrap(), spec, "{json}");
    }
    let spec: ControllerSpec = toml::from_str("kind = \"periodic\"\nminutes = 60").unwrap();
    assert_eq!(spec, ControllerSpec::periodic(60.0));
    assert!(toml::from_str::<ControllerSpec>("kind = \"periodic\"\nminuts = 60").is_err());
}

fn rule() -> ControllerSpec {
    let tuned = TunedRule {
        rule: PredictiveRule { overshoot: 0.45, ..PredictiveRule::default() },
        layout: Layout::default(),
        period_min: 5.0,
        task: Some(Task { max_steps: 500, ..Task::default() }),
        model_sha256: Some("00".to_owned()),
        is_virtual: true,
        expected: Some(Trial { mean: 9.0, sd: 2.0, plants: 1000 }),
    };
    ControllerSpec::Rule { tuned: Box::new(tuned) }
}

#[test]
fn a_rule_brings_its_task_and_is_for_its_lamps_and_period() {
    let spec = rule();
    assert_eq!(spec.default_task(), Task { max_steps: 500, ..Task::default() });
    assert!(spec.check(&Layout::default(), 5.0).is_ok());
    // Its lamps stand in this layout, too.
    assert!(spec.check(&Layout::four_sides(), 5.0).is_ok());
    let top = Lamp::new("top", [0.0, 80.0, 0.0]);
    let others = Layout::new(vec![
        top.clone(),
        Lamp { name: "low".to_owned(), ..top.clone() },
        Lamp { name: "mid".to_owned(), ..top },
    ]);
    for (layout, period_min) in [(others.unwrap(), 5.0), (Layout::default(), 10.0)] {
        let error = spec.check(&layout, period_min).unwrap_err().to_string();
        assert!(error.contains("found a rule for 2 lamps and steps of 5 minutes"), "{error}");
    }
    // Beyond the target at 3 cm, towards which the greedy rule would light the left lamp.
    let mut controller = spec.build(&Task::default(), &Layout::default(), 5.0);
    assert_eq!(controller.decide(&Observation::simulated(Point::new(4.0, 5.0))), Light::RIGHT);
}

#[test]
fn a_file_is_read_by_its_schema() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rule.json");
    let ControllerSpec::Rule { tuned } = rule() else { panic!("a rule") };
    std::fs::write(&path, tuned.to_json().as_bytes()).unwrap();
    assert_eq!(ControllerSpec::read(&path).unwrap(), rule());
    std::fs::write(&path, tuned.to_json().replace("rule/1", "rule/7").as_bytes()).unwrap();
    let error = ControllerSpec::read(&path).unwrap_err().to_string();
    assert!(error.contains("rule.json") && error.contains("wanted \"tropism.rule/1\""), "{error}");
}

#[test]
fn a_network_is_for_its_interval() {
    let genome = tropism_neat::random_genome(&tropism_neat::Config::wahby2016(), 2, 1, 1, 0);
    let champion = Champion { period_min: 10.0, ..Champion::of_genome(genome) };
    let spec = ControllerSpec::network(champion).unwrap();
    spec.check(&Layout::default(), 10.1).unwrap();
    let error = spec.check(&Layout::default(), 5.0).unwrap_err().to_string();
    assert!(error.contains("found a network for steps of 10 minutes, wanted one for steps of 5"), "{error}");
}

#[test]
fn a_network_of_another_shape_is_refused() {
    let genome = tropism_neat::random_genome(&tropism_neat::Config::wahby2016(), 3, 2, 1, 0);
    let error = ControllerSpec::network(Champion::of_genome(genome)).unwrap_err().to_string();
    assert!(error.contains("3 inputs and 2 outputs"), "{error}");
}
