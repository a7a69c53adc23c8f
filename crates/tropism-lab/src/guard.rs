//! The guard of a real run: a process of its own that puts the light off when the run no longer says that it lives.
//!
//! The run writes a byte into a pipe about once a second. The pipe closes when the run dies, whatever ends it; a run that
//! hangs falls silent. In both cases the guard puts the flash and the lamps off as [`shut_down`] does, again and again
//! until each device confirms. A run that ends in order says so and has put its own light off: then the guard just ends. A
//! device that did not confirm that to the run is left to the guard, too.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tropism::rig::OnExit;
use tropism_rig::file::RigFile;
use tropism_rig::shutdown::{DeviceShutdown, shut_down};

use crate::error::Error;
use crate::lock::{LockError, holder, lock_as_guard};
use crate::monitor::Monitor;
use crate::run::guard::{BEAT, ENDED, LIT};
use crate::run::read_rig;
use crate::workflow::Workflow;

/// Pause between two attempts on devices that do not confirm.
const RETRY_PAUSE: Duration = Duration::from_secs(5);

/// How long devices are tried that do not confirm: chosen, longer than a broker or an access point takes to come back.
const PATIENCE: Duration = Duration::from_secs(3600);

/// The last line of `guard.log` once all light is off.
pub(crate) const ALL_OFF: &str = "all light is off";

/// The run to guard. The program that executes the plan is its guard: it reads what the run says from stdin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GuardPlan {
    /// Run folder.
    pub run: PathBuf,
    /// Seconds for which the run may be silent.
    pub silence_s: f64,
}

/// What a guard did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GuardResults {
    /// How the run ended: `ended` in order, `lit`, `died`, or `silent`, after which it was killed.
    pub run: RunEnd,
    /// Whether each device of the rig confirmed that it is off; true without an attempt if the run ended in order.
    pub is_dark: bool,
}

/// How a guarded run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RunEnd {
    /// It said that it ended in order.
    Ended,
    /// It said that it ended in order, but that a device did not confirm that it is off.
    Lit,
    /// It died.
    Died,
    /// It was silent for too long, and was killed.
    Silent,
}

impl Workflow for GuardPlan {
    type Results = GuardResults;
    const SCHEMA: &'static str = "tropism.guard/1";

    fn check(&self) -> Result<(), Error> {
        match Duration::try_from_secs_f64(self.silence_s) {
            Ok(silence) if silence >= BEAT => Ok(()),
            _ => Err(Error::Plan(format!("`silence_s` {}: wanted 1 second or more", self.silence_s))),
        }
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<GuardResults, Error> {
        let rig = read_rig(&self.run)?;
        let run = listen(std::io::stdin(), Duration::from_secs_f64(self.silence_s));
        match run {
            RunEnd::Ended => return Ok(GuardResults { run, is_dark: true }),
            RunEnd::Lit => monitor.note("the run has ended, and a light is not confirmed to be off"),
            RunEnd::Died => monitor.note("the run has died"),
            RunEnd::Silent => {
                monitor.note(&format!("the run was silent for {} s, and is killed", self.silence_s));
                // Only a run that still has the folder is the one that fell silent.
                if let Ok(Some(process)) = holder(&self.run) {
                    kill(process);
                }
            }
        }
        Ok(GuardResults { run, is_dark: put_off(&rig, &self.run, monitor) })
    }
}

/// Hears what a run says until it ends.
fn listen(mut pipe: impl Read + Send + 'static, silence: Duration) -> RunEnd {
    let (heard, hear) = mpsc::channel();
    thread::spawn(move || {
        let mut words = [0; 64];
        while let Ok(count @ 1..) = pipe.read(&mut words) {
            if heard.send(words[count - 1]).is_err() {
                return;
            }
        }
    });
    loop {
        match hear.recv_timeout(silence) {
            Ok(ENDED) => return RunEnd::Ended,
            Ok(LIT) => return RunEnd::Lit,
            Ok(_) => {}
            Err(RecvTimeoutError::Timeout) => return RunEnd::Silent,
            Err(RecvTimeoutError::Disconnected) => return RunEnd::Died,
        }
    }
}

/// Puts the devices off until each has confirmed, or a program that resumed the run looks after them.
fn put_off(rig: &RigFile, run: &Path, monitor: &dyn Monitor) -> bool {
    let began = Instant::now();
    loop {
        // A program that resumes the run waits for the lock, and then sets the lamps itself.
        let lock = match lock_as_guard(run) {
            Ok(lock) => lock,
            Err(LockError::InUse { .. }) => {
                monitor.note("another program has resumed the run");
                return true;
            }
            Err(LockError::File(error)) => {
                monitor.note(&error.to_string());
                return false;
            }
        };
        // A run in another folder that drives the same devices now wants its light.
        let is_dark = match rig.lock_devices() {
            Ok(_locks) => {
                let mut is_dark = true;
                for shutdown in shut_down(rig, false) {
                    is_dark &= tell(shutdown, monitor);
                }
                is_dark
            }
            Err(error) => {
                monitor.note(&error.to_string());
                false
            }
        };
        if is_dark || began.elapsed() > PATIENCE {
            let is_kept = rig.lamps.as_ref().is_some_and(|lamps| lamps.on_exit == OnExit::Keep);
            if is_dark && !is_kept {
                monitor.note(ALL_OFF);
            }
            return is_dark;
        }
        drop(lock);
        thread::sleep(RETRY_PAUSE);
    }
}

/// Tells how the shutdown of a device went: whether it is off.
fn tell(DeviceShutdown { device, result }: DeviceShutdown, monitor: &dyn Monitor) -> bool {
    match &result {
        Ok(()) => monitor.note(&format!("{device}: off")),
        Err(error) => monitor.note(&format!("{device}: {error}")),
    }
    result.is_ok()
}

/// Kills a process that no longer answers, so that the system frees its devices, and waits until it is gone.
#[cfg(unix)]
fn kill(process: u32) {
    use rustix::process::{Pid, Signal, kill_process, test_kill_process};

    let Some(id) = i32::try_from(process).ok().and_then(Pid::from_raw) else { return };
    let _ = kill_process(id, Signal::KILL);
    let began = Instant::now();
    while test_kill_process(id).is_ok() && began.elapsed() < RETRY_PAUSE {
        thread::sleep(Duration::from_millis(20));
    }
}

/// Does nothing: there are no signals.
#[cfg(not(unix))]
fn kill(_process: u32) {}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a run says: words, and then silence or its end.
    struct Pipe(Vec<u8>, bool);

    impl Read for Pipe {
        fn read(&mut self, words: &mut [u8]) -> std::io::Result<usize> {
            match (self.0.is_empty(), self.1) {
                (true, true) => loop {
                    thread::park();
                },
                (true, false) => Ok(0),
                (false, _) => {
                    words[0] = self.0.remove(0);
                    Ok(1)
                }
            }
        }
    }

    #[test]
    fn a_run_that_dies_or_falls_silent_is_told_from_one_that_ends() {
        let silence = Duration::from_millis(200);
        assert_eq!(listen(Pipe(b"...!".to_vec(), false), silence), RunEnd::Ended);
        assert_eq!(listen(Pipe(b"...?".to_vec(), false), silence), RunEnd::Lit);
        assert_eq!(listen(Pipe(b"...".to_vec(), false), silence), RunEnd::Died);
        assert_eq!(listen(Pipe(b"".to_vec(), false), silence), RunEnd::Died);
        assert_eq!(listen(Pipe(b"..".to_vec(), true), silence), RunEnd::Silent);
    }
}
