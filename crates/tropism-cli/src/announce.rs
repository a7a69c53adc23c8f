//! What the terminal and systemd hear of a run.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use tropism::rig::Event;
use tropism::track::Sample;
use tropism_lab::Monitor;

use crate::shell::{Progress, Shell};

/// How often systemd hears that the run is alive.
const ALIVE: Duration = Duration::from_secs(1);

/// Draws a run as a progress line, reports it to systemd, and asks it to stop after Ctrl-C.
pub(crate) struct RunMonitor<'s> {
    shell: &'s Shell,
    progress: Mutex<Option<Progress>>,
    /// Whether events are shown: not those of a virtual tent.
    has_notes: bool,
    is_ready: AtomicBool,
    alive: Mutex<Option<Instant>>,
}

impl<'s> RunMonitor<'s> {
    /// A monitor that shows the events of the run only if `has_notes`.
    pub(crate) const fn new(shell: &'s Shell, has_notes: bool) -> Self {
        Self {
            shell,
            progress: Mutex::new(None),
            has_notes,
            is_ready: AtomicBool::new(false),
            alive: Mutex::new(None),
        }
    }

    fn with_progress(&self, show: impl FnOnce(&Progress)) {
        if let Some(progress) = &*self.progress.lock().unwrap_or_else(PoisonError::into_inner) {
            show(progress);
        }
    }
}

impl Monitor for RunMonitor<'_> {
    fn stage(&self, name: &str, total: u64) {
        let progress = self.shell.progress(name, total);
        *self.progress.lock().unwrap_or_else(PoisonError::into_inner) = Some(progress);
    }

    fn advance(&self, count: u64) {
        self.with_progress(|progress| progress.add(count));
    }

    fn status(&self, text: &str) {
        notify(&[State::Status(&text.replace('\n', " "))]);
    }

    fn note(&self, line: &str) {
        self.shell.note(line);
    }

    fn event(&self, Event { step, kind, text, .. }: &Event) {
        notify(&[State::Status(&format!("{kind}: {}", text.replace('\n', " ")))]);
        if self.has_notes {
            self.with_progress(|progress| progress.note(&format!("step {step}: {kind}: {text}")));
        }
    }

    fn sample(&self, sample: &Sample) {
        let place = format!("tip at {:.1}, {:.1} cm", sample.tip.x, sample.tip.y);
        notify(&[State::Status(&format!("step {}: {place}", sample.step))]);
        if !self.is_ready.swap(true, Ordering::SeqCst) {
            notify(&[State::Ready]);
        }
        self.heartbeat();
        self.with_progress(|progress| progress.say(place));
    }

    fn heartbeat(&self) {
        let mut alive = self.alive.lock().unwrap_or_else(PoisonError::into_inner);
        if alive.is_none_or(|last| last.elapsed() >= ALIVE) {
            *alive = Some(Instant::now());
            notify(&[State::Watchdog]);
        }
    }

    fn closing(&self) {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).take();
        notify(&[State::Stopping]);
    }

    fn may_go_on(&self) -> bool {
        !Shell::is_interrupted()
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
