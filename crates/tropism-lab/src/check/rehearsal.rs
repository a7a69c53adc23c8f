//! A short run of a rig, killed in the middle and resumed.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use tropism::rig::{FaultPolicy, OnExit};
use tropism::task::Task;
use tropism::text::plural;
use tropism_rig::file::RigFile;

use super::{Findings, Group, Rehearsal};
use crate::controller::ControllerSpec;
use crate::error::Error;
use crate::files;
use crate::journal::{Journal, StepRecord};
use crate::monitor::Monitor;
use crate::run::RunConfig;

/// Minutes between the steps of a real rig: each begins as soon as the one before is over.
const PERIOD_MIN: f64 = 1e-3;

/// How many times as fast as a real plant a virtual one grows: so slow that there is something to kill.
const VIRTUAL_SPEED: &str = "300";

/// Longest time of a rehearsal for each of its steps; chosen by hand.
const TIMEOUT_PER_STEP: Duration = Duration::from_secs(120);

/// Pause between two looks at the journal or the process.
const POLL: Duration = Duration::from_millis(5);

/// Rehearses a run of `rig` in a scratch folder in `data`, and reports whether anything was lost. The folder stays only if
/// the rehearsal failed.
pub(super) fn hold(
    rig: &RigFile,
    data: &Path,
    rehearsal: &Rehearsal,
    findings: &mut Findings,
    monitor: &dyn Monitor,
) -> Result<(), Error> {
    let folder = data.join(format!("tropism-rehearsal-{}", std::process::id()));
    fs::create_dir(&folder).map_err(Error::at(folder.display()))?;
    let scratch = Scratch { folder: &folder, rehearsal, monitor };
    let result = scratch.rehearse(rig);
    match &result {
        Ok(Outcome::Resumed { steps_before, photographs, seconds_per_step }) => findings.pass(
            Group::Rehearsal,
            format!(
                "killed after {steps_before} of {} and gone on: no step lost, {} whole, {seconds_per_step:.1} s a step",
                plural(rehearsal.steps, "step"),
                plural(*photographs, "photograph")
            ),
        ),
        Ok(Outcome::OverBeforeKill) => {
            let found = "the run was over before it could be killed";
            findings.warn(Group::Rehearsal, found, "more steps: --rehearse 10");
        }
        Ok(Outcome::Failed(problem)) => {
            let found = format!("{problem}: {}", scratch.last_error());
            findings.fail(Group::Rehearsal, found, "correct that, then rehearse again");
        }
        Err(_) => {}
    }
    if matches!(result, Ok(Outcome::Resumed { .. } | Outcome::OverBeforeKill)) {
        return fs::remove_dir_all(&folder).map_err(Error::at(folder.display()));
    }
    findings.warn(
        Group::Rehearsal,
        format!("its folder stays: {}", folder.display()),
        "tropism status shows it; remove it when you have looked",
    );
    result.map(drop)
}

/// How a rehearsal ended.
enum Outcome {
    /// The run was killed, resumed, and is whole.
    Resumed { steps_before: usize, photographs: usize, seconds_per_step: f64 },
    /// The run is whole, but was over before the kill.
    OverBeforeKill,
    /// Something was lost, or the run did not go on.
    Failed(String),
}

/// The scratch folder of a rehearsal.
struct Scratch<'a> {
    folder: &'a Path,
    rehearsal: &'a Rehearsal,
    monitor: &'a dyn Monitor,
}

/// A run in a process of its own, which is killed when it is dropped.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Scratch<'_> {
    fn rehearse(&self, rig: &RigFile) -> Result<Outcome, Error> {
        self.write_config(rig)?;
        let timeout = TIMEOUT_PER_STEP * self.rehearsal.steps;
        let at = || Error::at(self.rehearsal.program.display());
        let began = Instant::now();
        let mut first = self.start(rig, false).map_err(at())?;
        let before = loop {
            let steps = self.steps();
            if steps.len() as u32 > self.rehearsal.steps / 2 {
                break steps;
            }
            if first.0.try_wait().map_err(at())?.is_some() || began.elapsed() > timeout {
                return Ok(Outcome::Failed("the run ended or hung before it was killed".to_owned()));
            }
            self.pause()?;
        };
        first.0.kill().map_err(at())?;
        // A process that a signal ended has no exit code.
        let is_killed = first.0.wait().map_err(at())?.code().is_none();
        drop(first);
        let mut second = self.start(rig, true).map_err(at())?;
        let resumed = Instant::now();
        let status = loop {
            if let Some(status) = second.0.try_wait().map_err(at())? {
                break status;
            }
            if resumed.elapsed() > timeout {
                return Ok(Outcome::Failed("the run hung after it was killed and went on".to_owned()));
            }
            self.pause()?;
        };
        if !status.success() {
            return Ok(Outcome::Failed("the run did not go on after it was killed".to_owned()));
        }
        let after = self.steps();
        if let Some(loss) = self.loss(&before, &after)? {
            return Ok(Outcome::Failed(loss));
        }
        if !is_killed {
            return Ok(Outcome::OverBeforeKill);
        }
        let seconds_per_step = began.elapsed().as_secs_f64() / f64::from(self.rehearsal.steps);
        Ok(Outcome::Resumed { steps_before: before.len(), photographs: after.len(), seconds_per_step })
    }

    /// Writes the `run.toml` of a run that lights both lamps in turn, each for a step.
    fn write_config(&self, rig: &RigFile) -> Result<(), Error> {
        let mut rig = rig.clone();
        // A virtual plant grows by steps of five minutes, however fast they pass.
        if !rig.is_virtual() {
            rig.period_min = PERIOD_MIN;
            // Each step begins when the one before is over: none is too late.
            rig.fault_policy = Some(FaultPolicy { late_s: f64::INFINITY, ..rig.fault_policy() });
        }
        // A rehearsal leaves no lamp lit.
        rig.lamps.iter_mut().for_each(|lamps| lamps.on_exit = OnExit::Dark);
        let controller = ControllerSpec::periodic(rig.period_min);
        let config = RunConfig::new(rig, controller, Task::open_loop(self.rehearsal.steps), 1);
        let run = self.folder.join("run");
        files::make_folder(&run)?;
        Ok(files::write_settings(&run.join("run.toml"), &config.to_toml()?, false)?)
    }

    /// Starts the run in a process, which reads all of its plan from the run folder.
    fn start(&self, rig: &RigFile, is_resumed: bool) -> std::io::Result<Process> {
        let said = fs::File::options().create(true).append(true).open(self.folder.join("said.txt"))?;
        let mut command = Command::new(&self.rehearsal.program);
        command.arg("run").arg("--out").arg(self.folder.join("run"));
        if rig.is_virtual() {
            command.args(["--speed", VIRTUAL_SPEED]);
        }
        if is_resumed {
            command.arg("--resume");
        }
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(said).spawn().map(Process)
    }

    fn pause(&self) -> Result<(), Error> {
        if !self.monitor.may_go_on() {
            return Err(Error::Cancelled("the rehearsal was given up".to_owned()));
        }
        std::thread::sleep(POLL);
        Ok(())
    }

    /// The steps that are recorded by now.
    fn steps(&self) -> Vec<StepRecord> {
        let journal = Journal::open_to_read(&self.folder.join("run/journal.sqlite"));
        journal.and_then(|journal| journal.steps()).unwrap_or_default()
    }

    /// What was recorded before the kill and is not there after it.
    fn loss(&self, before: &[StepRecord], after: &[StepRecord]) -> Result<Option<String>, Error> {
        // The latest step was not over when it was killed: it is decided and confirmed after the kill.
        let complete = before.len() - 1;
        if after.len() as u32 != self.rehearsal.steps + 1 || after[..complete] != before[..complete] {
            let loss = "steps that were written down before the kill are not there after it";
            return Ok(Some(loss.to_owned()));
        }
        for step in after {
            let path = self.folder.join("run/photographs").join(&step.photo);
            if files::sha256(&files::read(&path)?) != step.photo_sha256 {
                return Ok(Some(format!("{} is not what it was", step.photo)));
            }
        }
        Ok(None)
    }

    /// The last error that the run printed.
    fn last_error(&self) -> String {
        let said = fs::read_to_string(self.folder.join("said.txt")).unwrap_or_default();
        let error = said.lines().rev().find(|line| line.starts_with("error: "));
        error.unwrap_or("it said nothing").to_owned()
    }
}
