//! Tasks, read from whatever carries them.

use tropism::control::Periodic;
use tropism::environment::unwatched;
use tropism::evolve::Champion;
use tropism::plant::FittedModel;
use tropism::plant::tip::{TipModel, TipModelConfig};
use tropism::task::Task;
use tropism_bean::{Species, Trial};
use tropism_lab::evolve::EvolvePlan;
use tropism_lab::simulate::SimulatePlan;
use tropism_lab::task::{is_same_but_for_steps, of_track, read};
use tropism_lab::tune::TunePlan;
use tropism_lab::{ControllerSpec, RunConfig, Silent, Workflow, files};

#[test]
fn a_task_is_read_from_whatever_carries_it() {
    let folder = tempfile::tempdir().unwrap();
    let task: Task = Task { max_steps: 77, ..Task::default() };
    let genome = tropism_neat::random_genome(&tropism_neat::Config::wahby2016(), 2, 1, 1, 0);
    let alone = Champion::of_genome(genome);
    let champion = Champion { task: Some(task.clone()), ..alone.clone() };
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        files::write(&path, text.as_bytes()).unwrap();
        path
    };
    let config = RunConfig::new(RunConfig::default().rig, ControllerSpec::Greedy, task.clone(), 1);
    write("run.toml", &config.to_toml().unwrap());
    let task_file = write("task.toml", &toml::to_string(&task).unwrap());
    for path in [task_file, write("champion.json", &champion.to_json()), folder.path().to_owned()] {
        assert_eq!(read(&path).unwrap(), task, "{}", path.display());
    }
    assert_eq!(of_track(&folder.path().join("track.csv")).unwrap(), Some(task));
    let error = read(&write("alone.json", &alone.to_json())).unwrap_err().to_string();
    assert!(error.contains("alone.json: this network does not say its task"), "{error}");
}

#[test]
fn a_task_is_told_in_words() {
    assert_eq!(Task::default().title(), "the targets (3, 6), (-5, 9), (-1, 13.5)");
    assert_eq!(Task::obstacles().title(), "the target (0, 13) behind 1 obstacle");
    assert_eq!(Task::random_targets().title(), "3 random targets up to 13.5 cm");
    assert_eq!(Task::space().fitness_in_words(9.5), "9.50 cm of at most 11.14");
    assert_eq!(Task::spiral().fitness_in_words(-1.314), "-1.31 turns");
    let shorter = Task { max_steps: 9, ..Task::default() };
    assert!(is_same_but_for_steps(&Task::default(), &shorter));
}

#[test]
fn a_model_that_does_not_know_what_a_task_needs_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (model, out) = (folder.path().join("model.json"), folder.path().join("out"));
    let species = Species::default();
    let trial = Trial::new(&species);
    let mut periodic = Periodic::new(18, &trial.layout);
    let track = trial.grow(1, &mut periodic, &Task::open_loop(60), &mut unwatched);
    let tips = TipModel::fit(&[track], TipModelConfig::default()).unwrap();
    files::write(&model, tips.to_json().as_bytes()).unwrap();
    for (task, need) in
        [(Task::obstacles(), "the whole stem"), (Task::space(), "depth"), (Task::spiral(), "depth")]
    {
        let evolve = EvolvePlan {
            model: model.clone(),
            task: task.clone(),
            out: out.clone(),
            ..EvolvePlan::default()
        };
        let tune =
            TunePlan { model: model.clone(), task: task.clone(), out: out.clone(), ..TunePlan::default() };
        let simulate = SimulatePlan {
            model: model.clone(),
            task: task.clone(),
            out: out.clone(),
            ..SimulatePlan::default()
        };
        let mut errors = vec![evolve.execute(&Silent).unwrap_err(), simulate.execute(&Silent).unwrap_err()];
        // A rule for targets in space may be tuned in the plane.
        if task != Task::space() {
            errors.push(tune.execute(&Silent).unwrap_err());
        }
        for error in errors {
            let error = error.to_string();
            assert!(
                error.contains(&format!("needs {need}")) && error.contains("tropism fit --kind"),
                "{error}"
            );
        }
        assert!(!out.exists());
    }
}
