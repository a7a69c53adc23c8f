//! The watchdog of a real run: a process of its own that puts the light off when the run dies or hangs.
//!
//! In comes a [`WatchdogPlan`], and then a byte a second as long as the run lives. The pipe closes when the run dies, whatever
//! ends it; a run that hangs falls silent. In both cases the watchdog puts the flash and the lamps off, again and again until
//! each device confirms. A run that ends in order says so and has put its own light off: then the watchdog just ends. A
//! device that did not confirm that to the run is left to the watchdog, too.
//!
//! Each byte is answered, so that the run notices a watchdog that hangs. After its start the watchdog needs no file: the disk
//! of the run may fail, and its folder may be moved or deleted. Time is counted in waits of its own: a computer or container
//! that was frozen, run and watchdog alike, has not been silent.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tropism::rig::OnExit;
use tropism_rig::file::RigFile;
use tropism_rig::secret::shown;
use tropism_rig::shutdown::{LightSource, light_sources};

use crate::error::Error;

/// A sign of life of a run.
pub(crate) const ALIVE: u8 = b'.';

/// What a run says that has ended in order.
pub(crate) const ENDED: u8 = b'!';

/// What a run says that has ended in order, but has a device that does not confirm that it is off.
pub(crate) const LIT: u8 = b'?';

/// Pause between two attempts on devices that do not confirm; chosen, far below the time in which a plant bends.
const RETRY_PAUSE: Duration = Duration::from_secs(2);

/// How long devices are tried that do not confirm: chosen, so that a night without a network does not leave them lit.
const MAX_RETRY: Duration = Duration::from_secs(24 * 3600);

/// One wait for the run.
const TICK: Duration = Duration::from_secs(1);

/// How long a killed run is waited for, which frees its devices; chosen. One that waits for a broken disk may never end.
const KILL_WAIT: Duration = Duration::from_secs(5);

/// How long the log is waited for at the end; chosen. Its disk may hang.
const LOG_WAIT: Duration = Duration::from_secs(1);

/// The last line of the log once all light is off.
pub(crate) const ALL_OFF: &str = "all light is off";

/// What a watchdog must know of its run. It is sent as TOML with a NUL at its end, before the first byte of life.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WatchdogPlan {
    /// Process of the run, which is killed if it hangs.
    pub process: u32,
    /// Seconds for which the run may be silent.
    pub silence_s: u64,
    /// Its devices.
    pub rig: RigFile,
}

impl WatchdogPlan {
    fn read(input: &mut impl BufRead) -> Result<Self, Error> {
        let mut text = Vec::new();
        // What follows is for the thread that listens.
        input.read_until(0, &mut text).map_err(Error::at("plan of the watchdog"))?;
        text.pop_if(|last| *last == 0);
        toml::from_slice(&text).map_err(Error::at("plan of the watchdog"))
    }
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RunEnd {
    /// It said that it ended in order.
    Ended,
    /// It said that it ended in order, but that a device did not confirm that it is off.
    Lit,
    /// It died.
    Died,
    /// It was silent for too long.
    Silent,
}

/// Watches the run that writes to `input` until it ends, and puts its light off if it did not. Bytes of life are answered on
/// `answers`; what is done stands in `log`.
///
/// # Errors
/// [`Error::At`] if the plan cannot be read.
pub fn watch(
    input: impl Read + Send + 'static,
    answers: impl Write,
    log: impl Write + Send + 'static,
) -> Result<(), Error> {
    let mut input = BufReader::new(input);
    let mut plan = WatchdogPlan::read(&mut input)?;
    let log = Log::start(log);
    if let Some(broker) = &mut plan.rig.mqtt {
        match broker.opened() {
            Ok(opened) => *broker = opened,
            Err(error) => log.say(error.to_string()),
        }
    }
    protect_from_low_memory();
    match listen(input, answers, plan.silence_s, TICK) {
        RunEnd::Ended => return Ok(()),
        RunEnd::Lit => log.say("the run has ended, and a light is not confirmed to be off".to_owned()),
        RunEnd::Died => log.say("the run has died".to_owned()),
        RunEnd::Silent => {
            log.say(format!("the run was silent for {} s, and is killed", plan.silence_s));
            kill(plan.process);
        }
    }
    put_off(&plan, &log);
    log.close();
    Ok(())
}

/// Asks the kernel to kill other processes first when memory runs out; it refuses that to a watchdog without the right, whose
/// few megabytes it hardly chooses.
fn protect_from_low_memory() {
    let _ = std::fs::write("/proc/self/oom_score_adj", "-1000");
}

/// Listens to a run until it ends, or gives no sign of life for `ticks` waits in a row.
fn listen(
    mut input: impl Read + Send + 'static,
    mut answers: impl Write,
    ticks: u64,
    tick: Duration,
) -> RunEnd {
    let (heard, hear) = mpsc::channel();
    thread::spawn(move || {
        let mut words = [0; 64];
        while let Ok(count @ 1..) = input.read(&mut words) {
            if heard.send(words[count - 1]).is_err() {
                return;
            }
        }
    });
    let mut silent = 0;
    while silent < ticks {
        match hear.recv_timeout(tick) {
            Ok(word) => {
                silent = 0;
                // A run that is gone reads no answer.
                let _ = answers.write_all(&[word]).and_then(|()| answers.flush());
                match word {
                    ENDED => return RunEnd::Ended,
                    LIT => return RunEnd::Lit,
                    _ => {}
                }
            }
            Err(RecvTimeoutError::Timeout) => silent += 1,
            Err(RecvTimeoutError::Disconnected) => return RunEnd::Died,
        }
    }
    RunEnd::Silent
}

/// Puts the devices off until each has confirmed, or another run drives it.
fn put_off(plan: &WatchdogPlan, log: &Log) {
    let mut lit: Vec<(LightSource<'_>, String)> =
        light_sources(&plan.rig, false).into_iter().map(|source| (source, String::new())).collect();
    let began = Instant::now();
    let mut is_all_off = !plan.rig.lamps.as_ref().is_some_and(|lamps| lamps.on_exit == OnExit::Keep);
    loop {
        lit.retain_mut(|(source, last)| {
            let (is_done, text) = match source.switch_off_after(plan.process) {
                Ok(None) => (true, "off".to_owned()),
                Ok(Some(owner)) => {
                    is_all_off = false;
                    (true, format!("left to another run, process {}", owner.process))
                }
                Err(error) => (false, error.to_string()),
            };
            if text != *last {
                log.say(format!("{}: {text}", source.device));
                *last = text;
            }
            !is_done
        });
        if lit.is_empty() {
            break;
        }
        if began.elapsed() > MAX_RETRY {
            return log.say("NOT ALL LIGHT IS KNOWN TO BE OFF".to_owned());
        }
        thread::sleep(RETRY_PAUSE);
    }
    if is_all_off {
        log.say(ALL_OFF.to_owned());
    }
}

/// Kills a process that no longer answers, so that the system frees its devices, and waits until it is gone.
#[cfg(unix)]
fn kill(process: u32) {
    use rustix::process::{Pid, Signal, kill_process, test_kill_process};

    let Some(id) = i32::try_from(process).ok().and_then(Pid::from_raw) else { return };
    let _ = kill_process(id, Signal::KILL);
    let began = Instant::now();
    while test_kill_process(id).is_ok() && began.elapsed() < KILL_WAIT {
        thread::sleep(Duration::from_millis(20));
    }
}

/// Does nothing: there are no signals.
#[cfg(not(unix))]
fn kill(_process: u32) {}

/// A log that a thread of its own writes: a disk that hangs must not keep a lamp lit.
struct Log {
    lines: Sender<String>,
    closed: Receiver<()>,
}

impl Log {
    fn start(mut log: impl Write + Send + 'static) -> Self {
        let (lines, written) = mpsc::channel::<String>();
        let (closing, closed) = mpsc::channel();
        thread::spawn(move || {
            for line in written {
                // A line that cannot be written is lost.
                let _ = writeln!(log, "{}", shown(&line)).and_then(|()| log.flush());
            }
            let _: Result<(), io::Error> = log.flush();
            let _ = closing.send(());
        });
        Self { lines, closed }
    }

    fn say(&self, line: String) {
        let _ = self.lines.send(line);
    }

    /// Waits until all is written, if the disk does not hang.
    fn close(self) {
        drop(self.lines);
        let _ = self.closed.recv_timeout(LOG_WAIT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a run says: words, and then silence or its end.
    struct Pipe(Vec<u8>, bool);

    impl Read for Pipe {
        fn read(&mut self, words: &mut [u8]) -> io::Result<usize> {
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
    fn a_run_that_dies_or_falls_silent_is_distinguished_from_one_that_ends() {
        let heard = |words: &[u8], is_silent| {
            let mut answers = Vec::new();
            let end = listen(Pipe(words.to_vec(), is_silent), &mut answers, 10, Duration::from_millis(20));
            assert_eq!(answers, words, "each word is answered");
            end
        };
        assert_eq!(heard(b"...!", false), RunEnd::Ended);
        assert_eq!(heard(b"...?", false), RunEnd::Lit);
        assert_eq!(heard(b"...", false), RunEnd::Died);
        assert_eq!(heard(b"", false), RunEnd::Died);
        assert_eq!(heard(b"..", true), RunEnd::Silent);
    }

    #[test]
    fn a_plan_ends_at_its_nul() {
        let mut input = &b"process = 7\nsilence_s = 60\n[rig]\n[rig.greenhouse]\n\0..!"[..];
        let plan = WatchdogPlan::read(&mut input).unwrap();
        assert_eq!((plan.process, plan.silence_s, input), (7, 60, &b"..!"[..]));
        assert!(WatchdogPlan::read(&mut &b"proc"[..]).is_err());
    }
}
