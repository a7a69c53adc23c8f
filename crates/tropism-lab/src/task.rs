//! Tasks from files: a task file, a champion or a rule, which carry the task that they were made for, or a run folder.

use std::path::Path;

use tropism::task::Task;

use crate::controller::ControllerSpec;
use crate::run::RunConfig;
use crate::{Error, files};

/// Reads the task of a task file, of a champion or a rule, or of a run folder.
///
/// # Errors
/// [`Error`] names the file and what is wrong with it; a champion that carries no task is one.
pub fn read(path: &Path) -> Result<Task, Error> {
    if path.is_dir() {
        return Ok(RunConfig::read(path)?.task);
    }
    if files::read_text(path)?.trim_start().starts_with('{') {
        let controller = ControllerSpec::read(path)?;
        return controller.own_task().cloned().ok_or_else(|| {
            Error::Plan(format!("{}: this network does not say its task: name the `task`", path.display()))
        });
    }
    let task: Task = files::read_toml(path)?;
    task.check().map_err(Error::at(path.display()))?;
    Ok(task)
}

/// The task with targets of the run whose track is the file `track`; `None` if it lies in no run folder, or its run had none.
///
/// # Errors
/// Those of [`RunConfig::read`].
pub fn of_track(track: &Path) -> Result<Option<Task>, Error> {
    let folder = track.parent().filter(|folder| folder.join("run.toml").exists());
    let task = folder.map(RunConfig::read).transpose()?.map(|run| run.task);
    Ok(task.filter(|task| task.has_goal()))
}

/// Checks that a task has something to reach: without, all controllers are worth the same.
pub(crate) fn check_goal(task: &Task) -> Result<(), Error> {
    if task.has_goal() {
        return Ok(());
    }
    Err(Error::Plan("`task`: it has no targets to reach".to_owned()))
}

/// Whether two tasks are the same but for the most steps that they may take.
#[must_use]
pub fn is_same_but_for_steps(one: &Task, other: &Task) -> bool {
    Task { max_steps: other.max_steps, ..one.clone() } == *other
}
