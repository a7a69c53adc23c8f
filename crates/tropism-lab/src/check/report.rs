//! What a maintainer needs to know of a rig in trouble, as one text: version, system, findings, rig file, last events.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism_rig::secret::hosts_alone;

use super::{CheckResults, Finding};
use crate::error::Error;
use crate::files;
use crate::folder::{has_journal, read_journal};

/// How many events of a run are listed. Chosen: a day of a run in trouble, and short enough to be read.
const EVENTS: usize = 50;

/// What a maintainer needs to know, in a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProblemReport {
    /// New file.
    pub path: PathBuf,
    /// The version of the program, with the commit that was built.
    pub version: String,
    /// Folder of a run whose last events are listed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub run: Option<PathBuf>,
}

impl ProblemReport {
    /// Checks that the report can be written, before devices are tried.
    pub(super) fn check(&self) -> Result<(), Error> {
        let Self { path, run, .. } = self;
        if path.exists() {
            return Err(Error::Plan(format!(
                "{}: a file is here already: choose a new one (`report`)",
                path.display()
            )));
        }
        match run {
            Some(run) if !has_journal(run) => Err(Error::Plan(format!(
                "{}: this is not the folder of a run: it has no journal",
                run.display()
            ))),
            _ => Ok(()),
        }
    }

    /// Writes the report of what a check found.
    pub(super) fn write(&self, results: &CheckResults) -> Result<(), Error> {
        let mut text = format!(
            "Look through this text before you send it: addresses are shown by their hosts alone, words of programs as they \
             are.\n\n## Version and system\n\n- tropism {}\n",
            self.version
        );
        for line in system() {
            let _ = writeln!(text, "- {line}");
        }
        let (dry, rig) = (if results.is_dry { ", dry" } else { "" }, results.rig.display());
        let _ = writeln!(text, "\n## Check of {rig}{dry}\n");
        for Finding { group, verdict, found, remedy } in &results.findings {
            let remedy = remedy.as_ref().map_or(String::new(), |remedy| format!(" -> {remedy}"));
            let _ = writeln!(text, "- {}, {}: {found}{remedy}", verdict.name(), group.name());
        }
        let rig = std::fs::read_to_string(&results.rig).unwrap_or_else(|error| format!("# {error}"));
        let _ = writeln!(text, "\n## Rig file\n\n```toml\n{}\n```", hosts_alone(rig.trim_end()));
        if let Some(run) = &self.run {
            let _ = write!(text, "\n## Run {}\n\n{}", run.display(), events(run)?);
        }
        Ok(files::write(&self.path, text.as_bytes())?)
    }
}

/// The last events of a run, a line each.
fn events(run: &Path) -> Result<String, Error> {
    let (steps, events) = read_journal(run)?;
    let mut text = format!("{} steps, {} events\n\n", steps.len(), events.len());
    for event in &events[events.len().saturating_sub(EVENTS)..] {
        let _ = writeln!(text, "- step {}, {}: {}", event.step, event.kind.name(), hosts_alone(&event.text));
    }
    Ok(text)
}

/// The computer, a line each: what it does not tell is left out.
fn system() -> Vec<String> {
    let of_file = |path: &str, key: &str| {
        let text = std::fs::read_to_string(path).ok()?;
        let line = text.lines().find_map(|line| line.strip_prefix(key))?;
        Some(line.trim_matches(|letter: char| letter.is_whitespace() || letter == '"').to_owned())
    };
    let model = std::fs::read_to_string("/proc/device-tree/model").ok();
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let found = [
        Some(format!("{} on {}, {cores} cores", std::env::consts::OS, std::env::consts::ARCH)),
        of_file("/etc/os-release", "PRETTY_NAME="),
        std::fs::read_to_string("/proc/sys/kernel/osrelease")
            .ok()
            .map(|text| format!("kernel {}", text.trim())),
        model.map(|text| text.trim_end_matches('\0').to_owned()),
        of_file("/proc/meminfo", "MemTotal:").map(|size| format!("memory {size}")),
    ];
    found.into_iter().flatten().collect()
}
