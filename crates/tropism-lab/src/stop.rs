//! The workflow `stop`: ends the run or evolution in a folder in order.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::lock::holder;
use crate::monitor::Monitor;
use crate::workflow::Workflow;

/// The run or evolution to end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StopPlan {
    /// Run folder, or the folder of an evolution.
    pub folder: PathBuf,
    /// Minutes that it may take to end. Default: 2.
    #[serde(default = "two")]
    pub wait_min: f64,
}

const fn two() -> f64 {
    2.0
}

/// What was ended.
#[derive(Clone, Debug, Serialize)]
pub struct StopResults {
    /// The folder.
    pub folder: PathBuf,
    /// Number of the process that worked in it.
    pub process: Option<u32>,
    /// Whether a process worked in it.
    pub was_running: bool,
    /// Seconds until the process had ended.
    pub seconds: f64,
}

/// How often the lock is read while the process ends.
const POLL: Duration = Duration::from_millis(50);

impl Workflow for StopPlan {
    type Results = StopResults;
    const SCHEMA: &'static str = "tropism.stop/1";

    fn check(&self) -> Result<(), Error> {
        if Duration::try_from_secs_f64(60.0 * self.wait_min).is_err() {
            return Err(Error::Plan(format!("`wait_min` {}: wanted a number of minutes", self.wait_min)));
        }
        let is_folder =
            ["run.toml", "evolution.toml", "run.lock"].iter().any(|name| self.folder.join(name).exists());
        if is_folder {
            return Ok(());
        }
        let folder = self.folder.display();
        if !self.folder.exists() {
            return Err(Error::Plan(format!("{folder}: there is no such folder")));
        }
        Err(Error::Plan(format!("{folder}: this is no run folder: it has no run.toml and no evolution.toml")))
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<StopResults, Error> {
        let began = Instant::now();
        let results = |process: Option<u32>| StopResults {
            folder: self.folder.clone(),
            process,
            was_running: process.is_some(),
            seconds: process.map_or(0.0, |_| began.elapsed().as_secs_f64()),
        };
        let Some(process) = holder(&self.folder)? else { return Ok(results(None)) };
        let folder = self.folder.display();
        let is_holder = || holder(&self.folder).is_ok_and(|now| now == Some(process));
        terminate(process, is_holder).map_err(Error::at(format!("{folder}: process {process}")))?;
        monitor.note(&format!("process {process} was asked to end"));
        let wait = Duration::from_secs_f64(60.0 * self.wait_min);
        // It releases the lock when all is written. Another process may have taken the lock since.
        while holder(&self.folder)? == Some(process) {
            if !monitor.may_go_on() {
                return Err(Error::Cancelled(format!("process {process} was asked to end all the same")));
            }
            if began.elapsed() >= wait {
                return Err(Error::Failed(format!(
                    "{folder}: found process {process} still at work after {wait:?}, wanted it ended; kill -9 {process}, \
                     then tropism safe-state {folder}"
                )));
            }
            std::thread::sleep(POLL);
        }
        Ok(results(Some(process)))
    }
}

/// Sends a process SIGTERM if it still is the one that is meant.
#[cfg(unix)]
fn terminate(process: u32, is_meant: impl Fn() -> bool) -> std::io::Result<()> {
    use rustix::process::{Pid, Signal, kill_process};

    let id = i32::try_from(process).ok().and_then(Pid::from_raw);
    let id = id.ok_or_else(|| std::io::Error::other("found no number of a process"))?;
    // A descriptor is of this process for good, while its number may be another one's by the time it is used.
    #[cfg(target_os = "linux")]
    if let Ok(descriptor) = rustix::process::pidfd_open(id, rustix::process::PidfdFlags::empty()) {
        if is_meant() {
            match rustix::process::pidfd_send_signal(&descriptor, Signal::TERM) {
                Err(rustix::io::Errno::SRCH) => {}
                done => done?,
            }
        }
        return Ok(());
    }
    if !is_meant() {
        return Ok(());
    }
    match kill_process(id, Signal::TERM) {
        // It ended by itself in between.
        Err(rustix::io::Errno::SRCH) => Ok(()),
        done => Ok(done?),
    }
}

/// Fails: there are no signals.
#[cfg(not(unix))]
fn terminate(_process: u32, _is_meant: impl Fn() -> bool) -> std::io::Result<()> {
    Err(std::io::Error::other("wanted a system with signals; press Ctrl-C where it runs"))
}
