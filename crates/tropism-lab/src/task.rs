//! Tasks from files: a task file, a champion or a rule, which carry the task that they were made for, or a run folder.

use std::path::Path;

use tropism::task::{Task, TaskSpec};

use crate::controller::ControllerSpec;
use crate::run::RunConfig;
use crate::units::plural;
use crate::{Error, files};

/// Reads the task of a task file, of a champion or a rule, or of a run folder.
///
/// # Errors
/// [`Error`] names the file and what is wrong with it; a champion that carries no task is one.
pub fn read(path: &Path) -> Result<TaskSpec, Error> {
    if path.is_dir() {
        return Ok(RunConfig::read(path)?.task);
    }
    if files::read_text(path)?.trim_start().starts_with('{') {
        let controller = ControllerSpec::read(path)?;
        return controller.own_task().cloned().ok_or_else(|| {
            Error::Plan(format!("{}: found a network without its task, wanted a task", path.display()))
        });
    }
    let task: TaskSpec = files::read_toml(path)?;
    task.check().map_err(Error::at(path.display()))?;
    Ok(task)
}

/// The task with targets of the run whose track is the file `track`; `None` if it lies in no run folder, or its run had none.
///
/// # Errors
/// Those of [`RunConfig::read`].
pub fn of_track(track: &Path) -> Result<Option<TaskSpec>, Error> {
    let folder = track.parent().filter(|folder| folder.join("run.toml").exists());
    let task = folder.map(RunConfig::read).transpose()?.map(|run| run.task);
    Ok(task.filter(|task| task.has_goal()))
}

/// Whether two tasks are the same but for the most steps that they may take.
#[must_use]
pub fn is_same_but_for_steps(one: &TaskSpec, other: &TaskSpec) -> bool {
    one.clone().with_max_steps(other.max_steps()) == *other
}

/// A task in a few words: `the targets (3, 6), (-5, 9), (-1, 13.5)`.
#[must_use]
pub fn in_words(task: &TaskSpec) -> String {
    if let Some(pole) = task.pole() {
        return format!("winding round a pole of {} cm", 2.0 * pole.radius_cm);
    }
    if let TaskSpec::RandomTargets(task) = task {
        return format!("{} up to {} cm", plural(task.count as usize, "random target"), task.highest_cm);
    }
    if task.targets().is_empty() && task.has_goal() {
        return "a form of the stem".to_owned();
    }
    let targets: Vec<String> = match task.way_in_space() {
        Some(way) => way.iter().map(|[x, y, z]| format!("({x}, {y}, {z})")).collect(),
        None => task.targets().iter().map(|target| format!("({}, {})", target.x, target.y)).collect(),
    };
    let targets = match targets.len() {
        0 => "no targets".to_owned(),
        1 => format!("the target {}", targets[0]),
        _ => format!("the targets {}", targets.join(", ")),
    };
    match task.obstacles().len() {
        0 => targets,
        count => format!("{targets} behind {}", plural(count, "obstacle")),
    }
}

/// What the fitness of a task is measured in.
pub(crate) fn unit(task: &TaskSpec) -> &'static str {
    if task.pole().is_some() { "turns" } else { "cm" }
}

/// The fitness of a plant with its unit, and the best there can be where it is known: `9.50 cm of at most 11.14`, or
/// `1.31 turns` round a pole.
#[must_use]
pub fn score_in_words(task: &TaskSpec, fitness: f64) -> String {
    let most = task.best_fitness().map_or_else(String::new, |best| format!(" of at most {best:.2}"));
    format!("{fitness:.2} {}{most}", unit(task))
}

#[cfg(test)]
mod tests {
    use tropism::evolve::Champion;
    use tropism::task::{Obstacles, RandomTargets, Space, Spiral, Targets};

    use super::*;

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
}
