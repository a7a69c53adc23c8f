//! One job: commands of `tropism`, one after the other.

use std::path::Path;

use serde::{Deserialize, Serialize};
use tropism_lab::files::shell_word;

/// What became of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub(crate) enum JobState {
    Waiting,
    Running,
    Done,
    /// Ended before it was done, in order: it can go on.
    Stopped,
    Failed,
}

/// A command of `tropism` in the queue.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Job {
    pub(crate) number: u64,
    /// The folder that it writes to, below that of the studio.
    pub(crate) at: String,
    /// Commands of `tropism`, one after the other, each without the program's name.
    pub(crate) commands: Vec<Vec<String>>,
    /// The command that goes on.
    pub(crate) now: usize,
    pub(crate) state: JobState,
    /// Why it failed.
    #[serde(default)]
    pub(crate) problem: String,
}

/// A job as pages show it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct ShownJob {
    number: u64,
    at: String,
    state: JobState,
    /// Why it failed.
    problem: String,
    /// As a person types them.
    commands: Vec<String>,
}

impl From<&Job> for ShownJob {
    fn from(job: &Job) -> Self {
        let Job { number, at, state, problem, .. } = job.clone();
        Self { number, at, state, problem, commands: job.lines() }
    }
}

impl Job {
    /// Whether it waits or runs.
    pub(super) fn is_open(&self) -> bool {
        matches!(self.state, JobState::Waiting | JobState::Running)
    }

    /// The commands as a person types them.
    pub(crate) fn lines(&self) -> Vec<String> {
        self.commands.iter().map(|words| line(words)).collect()
    }
}

/// A command as a person types it.
pub(crate) fn line(words: &[String]) -> String {
    let is_option = |word: &str| {
        let name = word.strip_prefix("--").unwrap_or_default();
        !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'-')
    };
    let words =
        words.iter().map(|word| if is_option(word) { word.clone() } else { shell_word(Path::new(word)) });
    std::iter::once("tropism".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

/// Whether the command of a job continues where it was, or may be done anew.
pub(super) fn goes_on(job: &Job) -> bool {
    let command = job.commands[job.now].first();
    command
        .is_some_and(|command| matches!(&**command, "evolve" | "tune" | "grow" | "fit" | "study" | "sweep"))
}

/// Whether a command that makes what later ones need has been done: what it writes is there.
pub(super) fn is_made(root: &Path, words: &[String]) -> bool {
    let is_before = words.first().is_some_and(|word| word == "grow" || word == "fit");
    let out = words.iter().skip_while(|word| *word != "--out").nth(1);
    is_before && out.is_some_and(|out| root.join(out).exists())
}
