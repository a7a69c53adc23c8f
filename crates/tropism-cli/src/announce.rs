//! Telling people and the system what happens to a run: alerts, and systemd.

use std::cell::Cell;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use tropism_rig::alert::{Alerts, Happening, Kind};
use tropism_rig::file::RigFile;

use crate::shell::Shell;

/// How often systemd hears that the run is alive.
const ALIVE: Duration = Duration::from_secs(1);

/// Whoever wants to know of a run. Nothing that is told here delays it.
pub(crate) struct Announcer {
    alerts: Alerts,
    is_ready: Cell<bool>,
    alive: Cell<Option<Instant>>,
}

impl Announcer {
    /// Opens the channels of `rig` for the run in `out`.
    pub(crate) fn open(rig: &RigFile, out: &Path) -> Result<Self> {
        let name =
            out.file_name().map_or_else(|| out.display().to_string(), |name| name.to_string_lossy().into());
        let alerts = rig.open_alerts(&name).context("alerts")?;
        Ok(Self { alerts, is_ready: Cell::new(false), alive: Cell::new(None) })
    }

    /// Something happened.
    pub(crate) fn happened(&self, kind: Kind, step: Option<u32>, text: &str) {
        self.alerts.tell(&Happening::now(kind, step, text));
        notify(&[State::Status(&format!("{}: {}", kind.name(), text.replace('\n', " ")))]);
    }

    /// A step was photographed: for heartbeats, and for systemd, to which the first one means that all is well.
    pub(crate) fn step(&self, step: u32, text: &str) {
        self.alerts.tell(&Happening::now(Kind::Step, Some(step), text));
        notify(&[State::Status(&format!("step {step}: {text}"))]);
        if !self.is_ready.replace(true) {
            notify(&[State::Ready]);
        }
        self.heartbeat();
    }

    /// The loop is alive. To be called as often as it can tell: at least twice in systemd's WatchdogSec.
    pub(crate) fn heartbeat(&self) {
        if self.alive.get().is_none_or(|last| last.elapsed() >= ALIVE) {
            self.alive.set(Some(Instant::now()));
            notify(&[State::Watchdog]);
        }
    }

    /// The run ends: waits until all is told, half a minute at most, and notes what could not be.
    pub(crate) fn close(self, shell: &Shell) {
        notify(&[State::Stopping]);
        for (name, problem) in self.alerts.close() {
            shell.note(&format!("alert ({name}): not delivered: {problem}"));
        }
    }
}

/// What systemd is told.
enum State<'a> {
    Ready,
    Watchdog,
    Stopping,
    Status(&'a str),
}

/// Tells systemd, if it has started us as a service of type notify.
#[cfg(unix)]
fn notify(states: &[State<'_>]) {
    use sd_notify::NotifyState;

    let states: Vec<_> = states
        .iter()
        .map(|state| match *state {
            State::Ready => NotifyState::Ready,
            State::Watchdog => NotifyState::Watchdog,
            State::Stopping => NotifyState::Stopping,
            State::Status(text) => NotifyState::Status(text),
        })
        .collect();
    // A run does not end because nobody listens.
    let _ = sd_notify::notify(&states);
}

#[cfg(not(unix))]
fn notify(_states: &[State<'_>]) {}
