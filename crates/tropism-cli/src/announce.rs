//! What the terminal and systemd hear of a run.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use tropism::rig::Event;
use tropism::track::Sample;
use tropism_lab::Monitor;
use tropism_rig::secret::shown;

use crate::progress::ProgressMonitor;
use crate::shell::Shell;

/// Draws a run as a progress line and reports it to systemd.
pub(crate) struct RunMonitor<'s> {
    terminal: ProgressMonitor<'s>,
    /// Whether events are printed: not those of a virtual tent.
    has_notes: bool,
    systemd: Systemd,
}

impl<'s> RunMonitor<'s> {
    /// A monitor that prints the events of the run only if `has_notes`.
    pub(crate) const fn new(shell: &'s Shell, has_notes: bool) -> Self {
        Self { terminal: ProgressMonitor::new(shell), has_notes, systemd: Systemd::new() }
    }
}

impl Monitor for RunMonitor<'_> {
    fn next(&self) -> Option<&dyn Monitor> {
        Some(&self.terminal)
    }

    fn status(&self, text: &str) {
        Systemd::status(text);
        self.terminal.status(text);
    }

    fn event(&self, Event { step, kind, text, .. }: &Event) {
        Systemd::status(&format!("{kind}: {text}"));
        if self.has_notes {
            self.terminal.note(&format!("step {step}: {kind}: {text}"));
        }
    }

    fn sample(&self, sample: &Sample) {
        let place = format!("tip at {:.1}, {:.1} cm", sample.tip.x, sample.tip.y);
        Systemd::status(&format!("step {}: {place}", sample.step));
        self.systemd.ready();
        self.systemd.watchdog();
        self.terminal.status(&place);
    }

    fn heartbeat(&self) {
        self.systemd.watchdog();
    }

    fn closing(&self) {
        self.terminal.closing();
        notify(&State::Stopping);
    }
}

/// The service manager that started the program, if it is a service of `Type=notify`.
struct Systemd {
    is_ready: AtomicBool,
    last_watchdog: Mutex<Option<Instant>>,
}

impl Systemd {
    /// Shortest time between two reports that the run is alive: half of the shortest sensible `WatchdogSec=`.
    const WATCHDOG: Duration = Duration::from_secs(1);

    const fn new() -> Self {
        Self { is_ready: AtomicBool::new(false), last_watchdog: Mutex::new(None) }
    }

    /// Reports the state of the run in one line.
    fn status(text: &str) {
        notify(&State::Status(&shown(&text.replace('\n', " "))));
    }

    /// Reports once that the run works: its first photograph was taken.
    fn ready(&self) {
        if !self.is_ready.swap(true, Ordering::SeqCst) {
            notify(&State::Ready);
        }
    }

    /// Reports that the run is alive.
    fn watchdog(&self) {
        let mut last = self.last_watchdog.lock().unwrap_or_else(PoisonError::into_inner);
        if last.is_none_or(|last| last.elapsed() >= Self::WATCHDOG) {
            *last = Some(Instant::now());
            notify(&State::Watchdog);
        }
    }
}

// Elsewhere there is no systemd, and nothing reads a state.
#[cfg_attr(not(unix), allow(dead_code))]
enum State<'a> {
    Ready,
    Watchdog,
    Stopping,
    Status(&'a str),
}

/// Sends `state` to systemd.
#[cfg(unix)]
fn notify(state: &State<'_>) {
    use sd_notify::NotifyState;

    let state = match *state {
        State::Ready => NotifyState::Ready,
        State::Watchdog => NotifyState::Watchdog,
        State::Stopping => NotifyState::Stopping,
        State::Status(text) => NotifyState::Status(text),
    };
    // The run does not depend on the service manager.
    let _ = sd_notify::notify(&[state]);
}

#[cfg(not(unix))]
fn notify(_state: &State<'_>) {}
