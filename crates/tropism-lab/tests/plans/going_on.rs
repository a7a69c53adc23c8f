//! Simulated plants that go on from where a run has come to.

use std::path::{Path, PathBuf};

use tropism::geometry::Point;
use tropism::lamps::Light;
use tropism::lighting::Lighting;
use tropism::task::Task;
use tropism::track::Sample;
use tropism_lab::fit::FitPlan;
use tropism_lab::simulate::continued;
use tropism_lab::status::{StatusPlan, StatusResults};
use tropism_lab::{ControllerSpec, RunConfig, RunPlan, Silent, StepRecord, Workflow};

/// A run of 24 steps whose lamps switch every 25 minutes, and a model of it.
fn run(folder: &Path) -> (RunConfig, Vec<StepRecord>, PathBuf) {
    let out = folder.join("run");
    let mut config = RunConfig::default();
    config.controller = ControllerSpec::periodic(25.0);
    let targets = [4.05, 9.0].map(|height_cm| Point::new(0.0, height_cm)).into();
    config.task = Task { max_steps: 24, targets, ..Task::default() };
    RunPlan { out: out.clone(), config: config.clone(), ..RunPlan::default() }.execute(&Silent).unwrap();
    let model = folder.join("model.json");
    let plan = FitPlan { tracks: vec![out.clone()], out: model.clone(), anyway: true, ..FitPlan::default() };
    plan.execute(&Silent).unwrap();
    (config, tropism_lab::read_journal(&out).unwrap().0, model)
}

fn lights(samples: &[Sample]) -> Vec<Option<Light>> {
    samples.iter().map(|sample| sample.light).collect()
}

#[test]
fn plants_go_on_where_the_run_has_come_to() {
    let folder = tempfile::tempdir().unwrap();
    let (config, steps, model) = run(folder.path());
    let tracks = continued(&model, &config, &steps[..17], 3, 1000).unwrap();
    assert_eq!(tracks.len(), 3);
    let decided: Vec<_> = steps[16..].iter().map(|step| step.decided.and_then(Lighting::brightest)).collect();
    for track in &tracks {
        let first = &track.samples[0];
        assert_eq!((first.step, Some(&first.observation())), (16, steps[16].observation()));
        // The controller goes on in phase, to the end of the task.
        assert_eq!(lights(&track.samples), decided);
    }
    assert_ne!(tracks[0].samples[5].tip, tracks[1].samples[5].tip, "each plant has its own noise");
    assert_eq!(continued(&model, &config, &steps[..17], 1, 4).unwrap()[0].samples.len(), 5);
    // Missed steps count for the controller, too.
    let mut missed = steps[..17].to_vec();
    missed.drain(3..9);
    assert_eq!(lights(&continued(&model, &config, &missed, 1, 1000).unwrap()[0].samples), decided);
}

#[test]
fn a_status_by_a_model_says_what_becomes_of_the_targets() {
    let folder = tempfile::tempdir().unwrap();
    let (mut config, _, model) = run(folder.path());
    let status = |model| match (StatusPlan { folder: folder.path().join("run"), model }).execute(&Silent) {
        Ok(StatusResults::Run(run)) => run.outlook,
        other => panic!("{other:?}"),
    };
    assert!(status(None).is_empty());
    let [low, high] = &status(Some(model.clone()))[..] else { panic!("two targets") };
    assert!(low.passed_cm.is_some_and(|distance| distance < 1.0) && low.probability == 1.0, "{low:?}");
    // The run is over.
    assert!(high.passed_cm.is_none() && high.is_out_of_reach(), "{high:?}");

    config.task = Task::open_loop(2);
    let out = folder.path().join("open");
    RunPlan { out: out.clone(), config, ..RunPlan::default() }.execute(&Silent).unwrap();
    let refused = StatusPlan { folder: out, model: Some(model.clone()) }.execute(&Silent).unwrap_err();
    assert!(refused.to_string().contains("`model`: the task of the run has no targets"), "{refused}");
}

#[test]
fn a_model_for_other_steps_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (mut config, steps, model) = run(folder.path());
    config.rig.period_min = 10.0;
    let error = continued(&model, &config, &steps, 1, 10).unwrap_err().to_string();
    assert!(error.contains("steps of 5 minutes") && error.contains("10 minutes of the run"), "{error}");
    config.rig.period_min = 5.0;
    let error = continued(&model, &config, &[], 1, 10).unwrap_err().to_string();
    assert!(error.contains("no photograph yet"), "{error}");
}
