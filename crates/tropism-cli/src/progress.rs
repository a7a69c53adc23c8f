//! Executes a workflow of the lab on the terminal: arguments become a plan, progress goes to stderr, results to stdout.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

use anyhow::{Result, anyhow};
use tropism_lab::{Error, Monitor, Workflow, files};

use crate::options::option_of_key;
use crate::shell::{Interrupted, Paused, Progress, Shell};

/// Longest status that is shown beside the progress bar, in bytes: a terminal of 120 columns holds it.
const MAX_STATUS: usize = 30;

/// Draws the stages of a workflow as progress lines, and asks it to stop after Ctrl-C.
pub(crate) struct ProgressMonitor<'s> {
    shell: &'s Shell,
    stage: Mutex<Option<Progress>>,
}

impl<'s> ProgressMonitor<'s> {
    /// A monitor that draws nothing until the first stage begins.
    pub(crate) const fn new(shell: &'s Shell) -> Self {
        Self { shell, stage: Mutex::new(None) }
    }

    fn stage(&self) -> MutexGuard<'_, Option<Progress>> {
        // A thread that panicked while it drew leaves a progress line that can still be drawn.
        self.stage.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Monitor for ProgressMonitor<'_> {
    fn stage(&self, name: &str, total: u64) {
        let mut stage = self.stage();
        // The line of the last stage ends before the next begins.
        *stage = None;
        *stage = Some(self.shell.progress(name, total));
    }

    fn advance(&self, count: u64) {
        self.stage().iter().for_each(|stage| stage.add(count));
    }

    fn skip(&self, count: u64) {
        self.stage().iter().for_each(|stage| stage.skip(count));
    }

    fn status(&self, text: &str) {
        // Longer texts do not fit beside the progress bar.
        let shown = if text.len() > MAX_STATUS { format!("\n  {text}") } else { text.to_owned() };
        self.stage().iter().for_each(|stage| stage.say(shown.clone()));
    }

    fn note(&self, line: &str) {
        let line = &with_options(line);
        match &*self.stage() {
            Some(stage) => stage.note(line),
            None => self.shell.note(line),
        }
    }

    fn closing(&self) {
        *self.stage() = None;
    }

    fn may_go_on(&self) -> bool {
        !Shell::is_interrupted()
    }
}

/// Checks and executes `plan`, with its progress on stderr.
pub(crate) fn execute<P: Workflow>(plan: &P, shell: &Shell) -> Result<P::Results> {
    execute_with(plan, &ProgressMonitor::new(shell))
}

/// Checks and executes `plan` under a monitor of its own.
pub(crate) fn execute_with<P: Workflow>(plan: &P, monitor: &dyn Monitor) -> Result<P::Results> {
    plan.execute(monitor).map_err(for_user)
}

/// Checks that the files `outputs` of a plan overwrite none of the files `inputs` that its options were read from.
pub(crate) fn check_outputs<'a>(
    outputs: &[PathBuf],
    inputs: impl IntoIterator<Item = Option<&'a PathBuf>>,
) -> Result<()> {
    let inputs: Vec<PathBuf> = inputs.into_iter().flatten().cloned().collect();
    files::check_outputs(outputs, &inputs).map_err(for_user)
}

/// Executes `plan` and prints its results: as `text_of_results` says, or with --json as JSON.
pub(crate) fn execute_and_print<P: Workflow>(
    plan: &P,
    shell: &Shell,
    text_of_results: impl FnOnce(&P::Results) -> String,
) -> Result<()> {
    let results = execute(plan, shell)?;
    shell.result(&text_of_results(&results), &results)
}

/// The error of a workflow in the words of the command line: options instead of keys, and what to do next.
pub(crate) fn for_user(error: Error) -> anyhow::Error {
    match error {
        Error::Interrupted { folder } => Interrupted::resumable(&folder),
        Error::Cancelled(left) => Interrupted(left).into(),
        Error::Paused { folder, reason } => Paused::at(&folder, &reason),
        Error::Plan(text) | Error::Failed(text) => anyhow!(with_options(&text)),
        Error::At { place, source } => Error::At { place: with_options(&place), source }.into(),
        other => other.into(),
    }
}

/// `text` with the command-line option in place of each key of a plan that stands in backticks.
pub(crate) fn with_options(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for (index, part) in text.split('`').enumerate() {
        match option_of_key(part) {
            Some(option) if index % 2 == 1 => shown += option,
            _ if index % 2 == 1 => shown += &format!("`{part}`"),
            _ => shown += part,
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_a_plan_are_shown_as_options() {
        let text =
            "a.toml: results are here already: choose a new name, `resume` or `replace`; not `unknown`";
        let wanted =
            "a.toml: results are here already: choose a new name, --resume or --force; not `unknown`";
        assert_eq!(for_user(Error::Plan(text.to_owned())).to_string(), wanted);
    }

    #[test]
    fn ends_have_the_types_that_decide_the_exit_code() {
        let interrupted = for_user(Error::Interrupted { folder: "out".into() });
        assert!(interrupted.is::<Interrupted>());
        let line = "interrupted: out is saved; the same command with --resume goes on";
        assert_eq!(interrupted.to_string(), line);
        assert!(for_user(Error::Cancelled("nothing was written".to_owned())).is::<Interrupted>());
        let paused = Error::Paused { folder: "out".into(), reason: "no plant".to_owned() };
        assert!(for_user(paused).is::<Paused>());
    }
}
