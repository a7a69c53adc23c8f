//! Methods over replicates: the whole chain at small scale, and after an interruption.

use std::sync::atomic::{AtomicU32, Ordering};

use tropism::evolve::{self, EvolutionConfig, RuleSearch};
use tropism::task::{Reading, Task};
use tropism_lab::controller::ControllerSpec;
use tropism_lab::fit::ModelKind;
use tropism_lab::replicates::{Measures, Method, MethodKind, ReplicatesConfig, ReplicatesPlan, Scenario};
use tropism_lab::report::ReportPlan;
use tropism_lab::status::{StatusPlan, StatusResults};
use tropism_lab::work::WorkStatus;
use tropism_lab::{Error, Monitor, Silent, Workflow};
use tropism_neat::Config;

/// Asks for an end after some questions.
struct PatientFor(AtomicU32);

impl Monitor for PatientFor {
    fn may_go_on(&self) -> bool {
        self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_ok()
    }
}

fn status(plan: &ReplicatesPlan) -> WorkStatus {
    match (StatusPlan { folder: plan.out.clone(), model: None }).execute(&Silent).unwrap() {
        StatusResults::Work(status) => status,
        other => panic!("{other:?}"),
    }
}

fn plan(out: std::path::PathBuf) -> ReplicatesPlan {
    let search = RuleSearch { generations: 2, population: 4, episodes: 2, starts: 1 };
    let evolution = Box::new(EvolutionConfig { runs: 1, generations: 2, ..EvolutionConfig::default() });
    let neat = Config { population: 4, ..Config::wahby2016() };
    let weights = Box::new(EvolutionConfig { method: evolve::Method::CmaEs, neat, ..(*evolution).clone() });
    let method = |name: &str, kind| Method { name: name.to_owned(), kind };
    let scenario = |name: &str, variation| Scenario { variation, ..Scenario::named(name) };
    let config = ReplicatesConfig {
        replicates: 2,
        plants: 2,
        steps: 150,
        test_plants: 3,
        task: Task { max_steps: 20, ..Task::default() },
        reference: Some(search),
        methods: vec![
            method(
                "paper",
                MethodKind::Evolve {
                    model: ModelKind::TIP,
                    from: None,
                    score: None,
                    evolution: evolution.clone(),
                },
            ),
            method(
                "weights",
                MethodKind::Evolve {
                    model: ModelKind::TIP,
                    from: Some("paper".to_owned()),
                    score: Some(Reading::Arrival),
                    evolution: weights,
                },
            ),
            method("rule", MethodKind::Tune { model: ModelKind::STEM, score: None, search }),
        ],
        scenarios: vec![
            Scenario { steps: Some(160), ..scenario("alike", 0.5) },
            scenario("varied", 1.5),
            Scenario {
                controllers_of: Some("alike".to_owned()),
                test_plants: Some(1),
                ..scenario("borrowed", 1.0)
            },
        ],
        ..ReplicatesConfig::default()
    };
    ReplicatesPlan { out, resume: false, config }
}

#[test]
fn replicates_make_controllers_that_steer_the_same_plants() {
    let folder = tempfile::tempdir().unwrap();
    let whole = plan(folder.path().join("whole"));
    let results = whole.execute(&Silent).unwrap();
    assert_eq!(results.scenarios.len(), 3);
    let made = |scenario: &str| whole.out.join(scenario).join("replicate-1/rule.json").exists();
    assert_eq!(["alike", "varied", "borrowed"].map(made), [true, true, false]);
    for scenario in &results.scenarios {
        let [paper, weights, rule] = &scenario.methods[..] else { panic!("three methods") };
        for method in [paper, weights, rule] {
            assert_eq!(method.replicates.len(), 2);
        }
        assert!(weights.worst_prediction.is_none(), "it expects what another score pays: {weights:?}");
        let all = |measures: &Measures| {
            let Measures { fitness, to_the_letter, by_approach, distances, done } = *measures;
            [Some(fitness), to_the_letter, by_approach, distances, done].map(Option::unwrap)
        };
        let [of_rule, of_paper, of_greedy] =
            [&rule.measures, &paper.measures, &scenario.greedy.measures].map(all);
        assert_eq!(of_rule[0], of_rule[2], "the task reads eq. (9) by approach");
        let [over_greedy, over_paper] = [rule.over_greedy, rule.over_first.unwrap()].map(|over| all(&over));
        for (number, own) in of_rule.iter().enumerate() {
            let [low, high] = own.interval;
            assert!(low <= own.mean && own.mean <= high, "{rule:?}");
            for (over, other) in [(over_greedy, of_greedy), (over_paper, of_paper)] {
                let difference = own.mean - other[number].mean;
                assert!((over[number].mean - difference).abs() < 1e-9, "{rule:?}");
            }
        }
        assert!(
            paper.over_first.is_none() && rule.over_reference.is_some() && rule.worst_prediction.is_some()
        );
    }

    let champion = ControllerSpec::read(&whole.out.join("alike/replicate-1/weights.json")).unwrap();
    assert_eq!(champion.own_task().unwrap().score, Reading::Arrival);

    let tasks = ReplicatesPlan::tasks_of_folder(&whole.out).unwrap();
    assert_eq!(tasks.keys().collect::<Vec<_>>(), ["alike", "borrowed", "varied"]);
    assert!(tasks.values().all(|task| task.max_steps == 20));

    let asked = StatusPlan { folder: whole.out.clone(), model: Some("model.json".into()) };
    let refused = asked.execute(&Silent).unwrap_err().to_string();
    assert!(refused.contains("found long work, wanted a run"), "{refused}");

    // A report compares the methods of each scenario by their replicates.
    let out = folder.path().join("report.html");
    let report = ReportPlan { sources: vec![whole.out.clone()], out, figures: None };
    let compared = report.execute(&Silent).unwrap().comparisons;
    let titles: Vec<&str> = compared.iter().map(|comparison| comparison.title.as_str()).collect();
    assert_eq!(titles, ["Methods compared: alike", "Methods compared: varied", "Methods compared: borrowed"]);
    assert!(
        compared.iter().all(|comparison| comparison.pairs.len() == 3 && comparison.pairs[0].sizes == [2, 2])
    );

    // Interrupted again and again, the same results come out.
    let mut again = plan(folder.path().join("again"));
    let mut interruptions = 0;
    let resumed = loop {
        match again.execute(&PatientFor(AtomicU32::new(1500))) {
            Ok(results) => break results,
            Err(Error::Interrupted { .. }) => interruptions += 1,
            Err(other) => panic!("{other}"),
        }
        again.resume = true;
        assert!(interruptions < 100);
        let status = status(&again);
        assert!(!status.is_over && status.parts[1].total == 6, "{status:?}");
    };
    assert!(interruptions > 0);
    let WorkStatus { is_over, parts, .. } = status(&again);
    // A lamp that stays lit, greedy, the reference controller and six controllers on three plants, or on one; with borrowed
    // controllers none is made.
    let parts: Vec<(&str, u64, u64)> =
        parts.iter().map(|part| (part.name.as_str(), part.done, part.total)).collect();
    let wanted = [
        ("alike: reference", 1, 1),
        ("alike: controllers", 6, 6),
        ("alike: test plants", 27, 27),
        ("varied: reference", 1, 1),
        ("varied: controllers", 6, 6),
        ("varied: test plants", 27, 27),
        ("borrowed: test plants", 9, 9),
    ];
    assert!(is_over && parts == wanted, "{parts:?}");
    for (one, other) in results.scenarios.iter().zip(&resumed.scenarios) {
        for (one, other) in one.methods.iter().zip(&other.methods) {
            assert_eq!(one.measures, other.measures);
            assert_eq!(one.replicates, other.replicates);
        }
    }
}

#[test]
fn without_methods_the_rules_by_hand_are_judged_alone() {
    let folder = tempfile::tempdir().unwrap();
    let few = Scenario { test_plants: Some(2), ..Scenario::named("few") };
    let config = ReplicatesConfig {
        test_plants: 3,
        task: Task { max_steps: 40, ..Task::spiral() },
        methods: Vec::new(),
        scenarios: vec![Scenario::named("many"), few],
        ..ReplicatesConfig::default()
    };
    let plan = ReplicatesPlan { out: folder.path().join("spiral"), resume: false, config };
    let results = plan.execute(&Silent).unwrap();
    assert_eq!(results.replicates, 0);
    let printed: Vec<_> =
        results.scenarios.iter().map(|scenario| (scenario.test_plants, scenario.photographs)).collect();
    assert_eq!(printed, [(3, false), (2, false)]);
    assert!(
        results
            .scenarios
            .iter()
            .all(|scenario| scenario.methods.is_empty() && scenario.greedy.measures.done.is_some())
    );
    let WorkStatus { is_over, parts, .. } = status(&plan);
    assert!(
        is_over && parts.iter().filter(|part| part.unit == "controllers").all(|part| part.total == 0),
        "{parts:?}"
    );
    let page = std::fs::read_to_string(plan.out.join("many/judged/report.html")).unwrap();
    assert!(page.contains("in turns") && !page.contains("Arrival at the targets"));

    let out = folder.path().join("report.html");
    let report = ReportPlan { sources: vec![plan.out], out, figures: None };
    let compared = report.execute(&Silent).unwrap().comparisons;
    let titles: Vec<&str> = compared.iter().map(|comparison| comparison.title.as_str()).collect();
    assert_eq!(titles, ["Rules by hand compared: many", "Rules by hand compared: few"]);

    std::fs::remove_file(report.sources[0].join("replicates.json")).unwrap();
    let error = report.execute(&Silent).unwrap_err().to_string();
    assert!(error.contains("finish the comparison by `tropism study --out "), "{error}");
}

#[test]
fn names_and_settings_that_cannot_be_are_named() {
    let error = |config: ReplicatesConfig| config.check().unwrap_err().to_string();
    let base = || plan("nowhere".into()).config;
    let mut twice = base();
    twice.methods[1].name = "paper".to_owned();
    assert!(error(twice).contains("\"paper\" stands twice"));
    let mut path = base();
    path.scenarios[0].name = "../up".to_owned();
    assert!(error(path).contains("`scenarios`: found the name \"../up\""));
    let mut later = base();
    later.methods.swap(0, 1);
    assert!(error(later).contains("weights: found from = \"paper\", wanted the name of a method"));
    let mut wild = base();
    wild.scenarios[1].variation = 7.0;
    assert!(error(wild).contains("scenario varied: found variation = 7"));
    assert!(error(ReplicatesConfig { scenarios: Vec::new(), ..base() }).contains("`scenarios` is empty"));
    let mut nobody = base();
    nobody.scenarios[0].test_plants = Some(0);
    assert!(error(nobody).contains("scenario alike: found test_plants = 0"));
    let mut still = base();
    still.scenarios[1].steps = Some(0);
    assert!(error(still).contains("scenario varied: found steps = 0"));
    assert!(error(ReplicatesConfig { replicates: 0, ..base() }).contains("replicates"));
    let mut borrowed = base();
    borrowed.scenarios[0].controllers_of = Some("varied".to_owned());
    assert!(
        error(borrowed).contains(
            "scenario alike: found controllers_of = \"varied\", wanted the name of a scenario before"
        )
    );
    let folder = tempfile::tempdir().unwrap();
    let winding = ReplicatesConfig { task: Task::spiral(), ..base() };
    let plan = ReplicatesPlan { out: folder.path().join("out"), resume: false, config: winding };
    let error_of_score = plan.execute(&Silent).unwrap_err().to_string();
    assert!(error_of_score.contains("method weights: found a score beside the task"), "{error_of_score}");
    assert!(!plan.out.exists(), "nothing is begun");
    let mut growing = base();
    growing.scenarios[2].steps = Some(160);
    assert!(error(growing).contains(
        "scenario borrowed: found steps = 160 beside controllers_of = \"alike\", wanted one of the two"
    ));
}
