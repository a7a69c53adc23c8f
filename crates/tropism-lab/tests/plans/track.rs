//! Plans of tracking.

use super::comes_back_from_json;
use tropism_lab::Workflow;
use tropism_lab::track::{LightSource, TrackPlan, TrackScale};

#[test]
fn a_plan_goes_through_json_and_an_empty_one_is_the_default() {
    let plan = TrackPlan {
        light: LightSource::File("light.csv".into()),
        scale: TrackScale::PxPerCm(11.0),
        ..TrackPlan::default()
    };
    comes_back_from_json(&plan);
}

#[test]
fn impossible_plans_are_refused_by_key() {
    let refused = |plan: TrackPlan| plan.check().unwrap_err().to_string();
    assert!(refused(TrackPlan { period_min: Some(0.0), ..TrackPlan::default() }).contains("`period_min` 0"));
    let out = TrackPlan { out: "track.json".into(), ..TrackPlan::default() };
    assert!(refused(out).contains("choose one that ends in .csv"));
    let scale = TrackScale::PxPerCm(-1.0);
    assert!(refused(TrackPlan { scale, ..TrackPlan::default() }).contains("`px_per_cm` -1"));
    assert!(refused(TrackPlan { plants: Vec::new(), ..TrackPlan::default() }).contains("`plants`"));
}
