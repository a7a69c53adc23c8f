//! Recipes over laboratories: the whole chain at small scale, and after an interruption.

use std::sync::atomic::{AtomicU32, Ordering};

use tropism::control::PlannerConfig;
use tropism::evolve::{self, EvolutionConfig, RuleSearch};
use tropism::task::Task;
use tropism_lab::fit::ModelKind;
use tropism_lab::laboratories::{
    LaboratoriesConfig, LaboratoriesPlan, LaboratoriesStatus, Method, Recipe, World,
};
use tropism_lab::report::ReportPlan;
use tropism_lab::status::{StatusPlan, StatusResults};
use tropism_lab::{Error, Monitor, Silent, Workflow};
use tropism_neat::Config;

/// Asks for an end after some questions.
struct PatientFor(AtomicU32);

impl Monitor for PatientFor {
    fn may_go_on(&self) -> bool {
        self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_ok()
    }
}

fn status(plan: &LaboratoriesPlan) -> LaboratoriesStatus {
    match (StatusPlan { folder: plan.out.clone() }).execute(&Silent).unwrap() {
        StatusResults::Laboratories(status) => status,
        other => panic!("{other:?}"),
    }
}

fn plan(out: std::path::PathBuf) -> LaboratoriesPlan {
    let search = RuleSearch { generations: 2, population: 4, episodes: 2, starts: 1 };
    let evolution = Box::new(EvolutionConfig { runs: 1, generations: 2, ..EvolutionConfig::default() });
    let neat = Config { population: 4, ..Config::wahby2016() };
    let weights = Box::new(EvolutionConfig { method: evolve::Method::CmaEs, neat, ..(*evolution).clone() });
    let planner = PlannerConfig { plants: 2, replan_min: 120.0, ..PlannerConfig::default() };
    let recipe = |name: &str, method| Recipe { name: name.to_owned(), method };
    let world = |name: &str, scale| World { scale, ..World::named(name) };
    let config = LaboratoriesConfig {
        laboratories: 2,
        plants: 2,
        steps: 150,
        judging_plants: 3,
        task: Task { max_steps: 20, ..Task::default() },
        bound: Some(search),
        recipes: vec![
            recipe(
                "paper",
                Method::Evolve { model: ModelKind::TIP, from: None, evolution: evolution.clone() },
            ),
            recipe(
                "weights",
                Method::Evolve { model: ModelKind::TIP, from: Some("paper".to_owned()), evolution: weights },
            ),
            recipe("rule", Method::Tune { model: ModelKind::STEM, search }),
            recipe("planner", Method::Plan { model: ModelKind::STEM, planner: Box::new(planner) }),
        ],
        worlds: vec![
            World { steps: Some(160), ..world("alike", 0.5) },
            world("varied", 1.5),
            World {
                controllers_of: Some("alike".to_owned()),
                judging_plants: Some(1),
                ..world("borrowed", 1.0)
            },
        ],
        ..LaboratoriesConfig::default()
    };
    LaboratoriesPlan { out, resume: false, config }
}

#[test]
fn laboratories_make_controllers_that_steer_the_same_plants() {
    let folder = tempfile::tempdir().unwrap();
    let whole = plan(folder.path().join("whole"));
    let results = whole.execute(&Silent).unwrap();
    assert_eq!(results.worlds.len(), 3);
    let made = |world: &str| whole.out.join(world).join("laboratory-1/rule.json").exists();
    assert_eq!(["alike", "varied", "borrowed"].map(made), [true, true, false]);
    for world in &results.worlds {
        let [paper, weights, rule, planner] = &world.recipes[..] else { panic!("four recipes") };
        for recipe in [paper, weights, rule, planner] {
            assert_eq!(recipe.laboratories.len(), 2);
        }
        assert!(planner.worst_prediction.is_none(), "a planner expects nothing: {planner:?}");
        let [low, high] = rule.fitness.interval;
        assert!(low <= rule.fitness.mean && rule.fitness.mean <= high, "{rule:?}");
        let difference = rule.fitness.mean - world.chase.fitness.mean;
        assert!((rule.over_chase.mean - difference).abs() < 1e-9, "{rule:?}");
        let over_paper = rule.over_first.expect("paper comes before it");
        assert!((over_paper.mean - rule.fitness.mean + paper.fitness.mean).abs() < 1e-9, "{rule:?}");
        assert!(paper.over_first.is_none() && rule.over_bound.is_some() && rule.worst_prediction.is_some());
    }

    // A report compares the recipes of each world by their laboratories.
    let out = folder.path().join("report.html");
    let report = ReportPlan { sources: vec![whole.out.clone()], out, figures: None };
    let compared = report.execute(&Silent).unwrap().comparisons;
    let titles: Vec<&str> = compared.iter().map(|comparison| comparison.title.as_str()).collect();
    assert_eq!(titles, ["Recipes compared: alike", "Recipes compared: varied", "Recipes compared: borrowed"]);
    assert!(
        compared.iter().all(|comparison| comparison.pairs.len() == 6 && comparison.pairs[0].sizes == [2, 2])
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
        assert!(!status.is_over && status.worlds[0].controllers == 8, "{status:?}");
    };
    assert!(interruptions > 0);
    let LaboratoriesStatus { is_over, worlds, .. } = status(&again);
    let judged: Vec<_> = worlds.iter().map(|world| world.judged.as_ref().unwrap().done()).collect();
    // A lamp that stays lit, chase, the bound and eight controllers on three plants.
    assert_eq!(
        (is_over, worlds[1].has_bound, worlds[1].controllers_done, judged),
        (true, Some(true), 8, vec![33, 33, 11])
    );
    let borrowed = &worlds[2];
    assert_eq!((borrowed.controllers_of.as_deref(), borrowed.has_bound), (Some("alike"), None));
    assert_eq!((borrowed.controllers_done, borrowed.controllers), (0, 0), "none is made for this world");
    for (one, other) in results.worlds.iter().zip(&resumed.worlds) {
        for (one, other) in one.recipes.iter().zip(&other.recipes) {
            assert_eq!(one.fitness, other.fitness);
            assert_eq!(one.laboratories, other.laboratories);
        }
    }
}

#[test]
fn without_recipes_the_rules_by_hand_are_judged_alone() {
    let folder = tempfile::tempdir().unwrap();
    let few = World { judging_plants: Some(2), ..World::named("few") };
    let config = LaboratoriesConfig {
        judging_plants: 3,
        task: Task { max_steps: 40, ..Task::spiral() },
        recipes: Vec::new(),
        worlds: vec![World::named("many"), few],
        ..LaboratoriesConfig::default()
    };
    let plan = LaboratoriesPlan { out: folder.path().join("spiral"), resume: false, config };
    let results = plan.execute(&Silent).unwrap();
    assert_eq!(results.laboratories, 0);
    let told: Vec<_> = results.worlds.iter().map(|world| (world.judging_plants, world.photographs)).collect();
    assert_eq!(told, [(3, false), (2, false)]);
    assert!(results.worlds.iter().all(|world| world.recipes.is_empty() && world.chase.done.is_some()));
    let LaboratoriesStatus { is_over, worlds, .. } = status(&plan);
    assert!(is_over && worlds.iter().all(|world| world.controllers == 0), "{worlds:?}");
    let page = std::fs::read_to_string(plan.out.join("many/judged/report.html")).unwrap();
    assert!(page.contains("in turns") && !page.contains("Arrival at the targets"));

    let out = folder.path().join("report.html");
    let report = ReportPlan { sources: vec![plan.out], out, figures: None };
    let compared = report.execute(&Silent).unwrap().comparisons;
    let titles: Vec<&str> = compared.iter().map(|comparison| comparison.title.as_str()).collect();
    assert_eq!(titles, ["Rules by hand compared: many", "Rules by hand compared: few"]);

    std::fs::remove_file(report.sources[0].join("laboratories.json")).unwrap();
    let error = report.execute(&Silent).unwrap_err().to_string();
    assert!(error.contains("go on with it by `tropism study --out "), "{error}");
}

#[test]
fn names_and_settings_that_cannot_be_are_named() {
    let error = |config: LaboratoriesConfig| config.check().unwrap_err().to_string();
    let base = || plan("nowhere".into()).config;
    let mut twice = base();
    twice.recipes[1].name = "paper".to_owned();
    assert!(error(twice).contains("\"paper\" twice"));
    let mut path = base();
    path.worlds[0].name = "../up".to_owned();
    assert!(error(path).contains("`worlds`: found the name \"../up\""));
    let mut later = base();
    later.recipes.swap(0, 1);
    assert!(error(later).contains("weights: found from = \"paper\", wanted the name of a recipe"));
    let mut wild = base();
    wild.worlds[1].scale = 7.0;
    assert!(error(wild).contains("world varied: found scale = 7"));
    assert!(error(LaboratoriesConfig { worlds: Vec::new(), ..base() }).contains("`worlds`: found none"));
    let mut nobody = base();
    nobody.worlds[0].judging_plants = Some(0);
    assert!(error(nobody).contains("world alike: found judging_plants = 0"));
    let mut still = base();
    still.worlds[1].steps = Some(0);
    assert!(error(still).contains("world varied: found steps = 0"));
    assert!(error(LaboratoriesConfig { laboratories: 0, ..base() }).contains("laboratories"));
    let mut borrowed = base();
    borrowed.worlds[0].controllers_of = Some("varied".to_owned());
    assert!(
        error(borrowed)
            .contains("world alike: found controllers_of = \"varied\", wanted the name of a world before")
    );
    let mut growing = base();
    growing.worlds[2].steps = Some(160);
    assert!(error(growing).contains(
        "world borrowed: found steps = 160 beside controllers_of = \"alike\", wanted one of the two"
    ));
}
