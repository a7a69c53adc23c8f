//! Tasks, read from whatever carries them.

use tropism::evolve::Champion;
use tropism::task::{Obstacles, RandomTargets, Space, Spiral, Targets, TaskSpec};
use tropism_lab::task::{in_words, is_same_but_for_steps, of_track, read, score_in_words};
use tropism_lab::{ControllerSpec, RunConfig, files};

#[test]
fn a_task_is_read_from_whatever_carries_it() {
    let folder = tempfile::tempdir().unwrap();
    let task: TaskSpec = Targets { max_steps: 77, ..Targets::default() }.into();
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
    assert!(error.contains("alone.json: found a network without its task"), "{error}");
}

#[test]
fn a_task_is_told_in_words() {
    assert_eq!(in_words(&TaskSpec::default()), "the targets (3, 6), (-5, 9), (-1, 13.5)");
    assert_eq!(in_words(&Obstacles::default().into()), "the target (0, 13) behind 1 obstacle");
    assert_eq!(in_words(&RandomTargets::default().into()), "3 random targets up to 13.5 cm");
    assert_eq!(score_in_words(&Space::default().into(), 9.5), "9.50 cm of at most 11.14");
    assert_eq!(score_in_words(&Spiral::default().into(), -1.314), "-1.31 turns");
    let shorter = TaskSpec::default().with_max_steps(9);
    assert!(is_same_but_for_steps(&TaskSpec::default(), &shorter));
}
