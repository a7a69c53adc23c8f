//! `tropism stop`: ends a run in order.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use serde::Serialize;
use tropism_lab::holder;

use crate::options::parse_minutes;
use crate::shell::{Interrupted, Shell};

/// End the run or evolution in a folder, and wait until it has ended
///
/// It ends as by Ctrl-C: what was done is saved, the flash is off, the lamps are dark unless the rig file keeps them, and
/// the same command with --resume goes on. Where nothing runs it says so, and that is no error.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism stop bean\n  \
    tropism stop bean --wait 10m && tropism export bean --out bean.tar")]
pub(crate) struct Stop {
    /// Run folder, or the folder of an evolution
    #[arg(value_name = "DIR")]
    folder: PathBuf,

    /// How long it may take to end, such as 2m
    #[arg(long, value_name = "TIME", default_value = "2m", value_parser = parse_minutes)]
    wait: f64,
}

#[derive(Serialize)]
struct Outcome {
    folder: PathBuf,
    /// The process that had the folder.
    process: Option<u32>,
    was_running: bool,
    seconds: f64,
}

impl Stop {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        ensure_run(&self.folder)?;
        let began = Instant::now();
        let Some(process) = holder(&self.folder)? else {
            let text = format!("{}: nothing runs here", self.folder.display());
            let outcome = Outcome { folder: self.folder, process: None, was_running: false, seconds: 0.0 };
            return shell.result(&text, &outcome);
        };
        ask_to_end(process).with_context(|| format!("{}: process {process}", self.folder.display()))?;
        shell.note(&format!("process {process} was asked to end"));
        let wait = Duration::from_secs_f64(60.0 * self.wait);
        // Until it lets go of the folder: then all of it is written. Another one may have taken it since.
        while holder(&self.folder)? == Some(process) {
            if Shell::is_interrupted() {
                return Err(Interrupted(format!("process {process} was asked to end all the same")).into());
            }
            if began.elapsed() >= wait {
                bail!(
                    "{}: found process {process} still at work after {wait:?}, wanted it ended; \
                     kill -9 {process}, then tropism safe-state {}",
                    self.folder.display(),
                    self.folder.display()
                );
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        let seconds = began.elapsed().as_secs_f64();
        let text = format!(
            "{}: process {process} has ended, after {seconds:.1} s; the same command with --resume goes on",
            self.folder.display()
        );
        let outcome = Outcome { folder: self.folder, process: Some(process), was_running: true, seconds };
        shell.result(&text, &outcome)
    }
}

/// An error if `folder` is not one in which something could run.
fn ensure_run(folder: &Path) -> Result<()> {
    let is_one = ["run.toml", "evolution.toml", "run.lock"].iter().any(|name| folder.join(name).exists());
    ensure!(is_one, "{}: found no run.toml and no evolution.toml, wanted a run folder", folder.display());
    Ok(())
}

/// Asks a process to end in order.
#[cfg(unix)]
fn ask_to_end(process: u32) -> Result<()> {
    use rustix::process::{Pid, Signal, kill_process};

    let id = i32::try_from(process).ok().and_then(Pid::from_raw).context("found no number of a process")?;
    match kill_process(id, Signal::TERM) {
        // It ended by itself in between.
        Err(rustix::io::Errno::SRCH) => Ok(()),
        done => Ok(done?),
    }
}

/// Elsewhere nobody can be asked.
#[cfg(not(unix))]
fn ask_to_end(_process: u32) -> Result<()> {
    bail!("wanted a system with signals; press Ctrl-C where it runs")
}
