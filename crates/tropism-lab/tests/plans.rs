//! Plans and settings are data: they come back from JSON or TOML, refuse keys that they do not know, and name the key of a bad
//! value.

#[path = "plans/calibrate_camera.rs"]
mod calibrate_camera;
#[path = "plans/controller.rs"]
mod controller;
#[path = "plans/going_on.rs"]
mod going_on;
#[path = "plans/rig_file.rs"]
mod rig_file;
#[path = "plans/run.rs"]
mod run;
#[path = "plans/schemas.rs"]
mod schemas;
#[path = "plans/settings.rs"]
mod settings;
#[path = "plans/shutdown.rs"]
mod shutdown;
#[path = "plans/species.rs"]
mod species;
#[path = "plans/study.rs"]
mod study;
#[path = "plans/sweep.rs"]
mod sweep;
#[path = "plans/task.rs"]
mod task;
#[path = "plans/track.rs"]
mod track;

use tropism_lab::baseline::BaselinePlan;
use tropism_lab::calibrate::{CalibratePlan, RecoveryPlan};
use tropism_lab::evolve::EvolvePlan;
use tropism_lab::fit::{FitPlan, ModelKind};
use tropism_lab::grow::{AcceptancePlan, GrowPlan, KinematicsPlan};
use tropism_lab::measure::MeasurePlan;
use tropism_lab::replicates::ReplicatesPlan;
use tropism_lab::report::ReportPlan;
use tropism_lab::score::ScorePlan;
use tropism_lab::show::ShowPlan;
use tropism_lab::simulate::SimulatePlan;
use tropism_lab::study::StudyPlan;
use tropism_lab::transfer::TransferPlan;
use tropism_lab::tune::TunePlan;
use tropism_lab::wall::{WallPlan, WallStudyPlan};
use tropism_lab::{Error, Workflow};

/// A plan comes back from its JSON, and an empty one is the default.
#[track_caller]
fn comes_back_from_json<P: Workflow + Default + PartialEq + std::fmt::Debug>(plan: &P) {
    let json = serde_json::to_string(plan).unwrap();
    assert_eq!(serde_json::from_str::<P>(&json).unwrap(), *plan, "{json}");
    assert_eq!(serde_json::from_str::<P>("{}").unwrap(), P::default(), "what is left out is the default");
}

#[track_caller]
fn comes_back<P: Workflow + Default + PartialEq + std::fmt::Debug>() {
    let plan = P::default();
    let toml = toml::to_string(&plan).unwrap();
    assert_eq!(toml::from_str::<P>(&toml).unwrap(), plan, "{toml}");
    comes_back_from_json(&plan);
    let error = serde_json::from_str::<P>("{\"sed\": 1}").unwrap_err().to_string();
    assert!(error.contains("unknown field `sed`"), "{error}");
    let (name, version) = P::SCHEMA.split_once('/').unwrap();
    assert!(name.starts_with("tropism.") && version.parse::<u32>().is_ok(), "{}", P::SCHEMA);
}

#[test]
fn plans_come_back_and_refuse_unknown_keys() {
    comes_back::<FitPlan>();
    comes_back::<EvolvePlan>();
    comes_back::<BaselinePlan>();
    comes_back::<SimulatePlan>();
    comes_back::<ScorePlan>();
    comes_back::<ShowPlan>();
    comes_back::<GrowPlan>();
    comes_back::<AcceptancePlan>();
    comes_back::<KinematicsPlan>();
    comes_back::<CalibratePlan>();
    comes_back::<RecoveryPlan>();
    comes_back::<MeasurePlan>();
    comes_back::<ReportPlan>();
    comes_back::<ReplicatesPlan>();
    comes_back::<StudyPlan>();
    comes_back::<TransferPlan>();
    comes_back::<TunePlan>();
    comes_back::<WallPlan>();
    comes_back::<WallStudyPlan>();
}

#[track_caller]
fn is_refused(plan: &impl Workflow, wanted: &str) {
    match plan.check().unwrap_err() {
        Error::Plan(text) => assert!(text.contains(wanted), "{text}"),
        other => panic!("{other}"),
    }
}

#[test]
fn a_value_out_of_range_is_named() {
    EvolvePlan::default().check().unwrap();
    GrowPlan::default().check().unwrap();
    StudyPlan::default().check().unwrap();
    is_refused(
        &EvolvePlan { trial_plants: 0, ..EvolvePlan::default() },
        "found trial_plants = 0, wanted 1 to",
    );
    is_refused(&BaselinePlan { count: 0, ..BaselinePlan::default() }, "found count = 0");
    is_refused(&SimulatePlan { episodes: 0, ..SimulatePlan::default() }, "found episodes = 0");
    is_refused(&RecoveryPlan { plants: 1, ..RecoveryPlan::default() }, "found plants = 1, wanted 2 to");
    is_refused(&FitPlan::default(), "`tracks` is empty");
    let mut stem = FitPlan { tracks: vec!["track.csv".into()], kind: ModelKind::STEM, ..FitPlan::default() };
    stem.model.window.wx = 1.0;
    is_refused(&stem, "`kind` stem has none");
    let mut tune = TunePlan::default();
    tune.search.episodes = 0;
    is_refused(&tune, "search: found episodes = 0");
    let tracks = vec!["track.csv".into()];
    let minutes = CalibratePlan { tracks, interval_min: Some(f64::NAN), ..CalibratePlan::default() };
    is_refused(&minutes, "found `interval_min` NaN");
    let picture = ShowPlan { out: Some("a.png".into()), ..ShowPlan::default() };
    is_refused(&picture, "a.png: wanted .html, .svg, .dot or .txt");
    let mut study = StudyPlan::default();
    study.config.evolution.runs = 0;
    is_refused(&study, "evolution: found runs = 0");
    let mut grow = GrowPlan::default();
    grow.greenhouse.scene.width = 800;
    is_refused(&grow, "wanted `photographs` with them");
}
