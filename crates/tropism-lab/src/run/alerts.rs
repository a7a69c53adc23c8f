//! Who hears of a run: the channels of its rig, and the monitor of the workflow.

use std::ops::ControlFlow;
use std::path::Path;
use std::rc::Rc;

use tropism::lamps::Layout;
use tropism::rig::{Event, EventKind, HealthProblem, RunMonitor, photo_name};
use tropism::track::Sample;
use tropism_rig::alert::{self, AlertEvent, Kind, Seen};
use tropism_rig::file::RigFile;
use tropism_rig::host::Host;

use crate::error::Error;
use crate::monitor::Monitor;
use crate::run::watchdog::Watchdog;

/// The open alert channels of a run. Telling them never delays a step.
pub(super) struct Alerts(alert::Alerts);

impl Alerts {
    /// Opens the channels of `rig` for the run in the folder `out`.
    pub(super) fn open(rig: &RigFile, out: &Path) -> Result<Self, Error> {
        let name =
            out.file_name().map_or_else(|| out.display().to_string(), |name| name.to_string_lossy().into());
        rig.open_alerts(&name, Some(out)).map(Self).map_err(Error::at("alerts"))
    }

    /// Reports a step of the run in the folder `out`, for heartbeats and the status at a broker.
    pub(super) fn step(&self, sample: &Sample, layout: &Layout, period_min: f64, out: &Path) {
        let text = format!("tip at {:.1}, {:.1} cm", sample.tip.x, sample.tip.y);
        let mut event = AlertEvent::now(Kind::Step, Some(sample.step), &*text);
        event.seen = Some(Seen {
            tip_x_cm: sample.tip.x,
            tip_y_cm: sample.tip.y,
            lamp: sample.lighting().word(layout),
            next_unix_s: event.unix_s + 60.0 * period_min,
            photograph: out.join("photographs").join(photo_name(sample.step)),
        });
        self.0.send(&event);
    }

    /// Reports an error that ends the run.
    pub(super) fn fault(&self, error: &Error) {
        self.0.send(&AlertEvent::now(Kind::Event(EventKind::Fault), None, error.with_causes()));
    }

    /// Waits until everything is delivered, half a minute at most, and notes what could not be.
    pub(super) fn close(self, monitor: &dyn Monitor) {
        for (name, problem) in self.0.close() {
            monitor.note(&format!("alert ({name}): not delivered: {problem}"));
        }
    }
}

/// Passes the events of a run to its alert channels.
pub(super) struct AlertMonitor<'a>(pub(super) &'a Alerts);

impl RunMonitor for AlertMonitor<'_> {
    fn event(&mut self, event: &Event) {
        self.0.0.send(&AlertEvent::now(event.kind, Some(event.step), &*event.text));
    }

    fn heartbeat(&mut self) -> ControlFlow<()> {
        if self.0.0.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Passes the events of a run to the monitor of the workflow, which may ask for an end.
pub(super) struct WorkflowMonitor<'a>(pub(super) &'a dyn Monitor);

impl RunMonitor for WorkflowMonitor<'_> {
    fn event(&mut self, event: &Event) {
        self.0.event(event);
    }

    fn heartbeat(&mut self) -> ControlFlow<()> {
        self.0.heartbeat();
        self.0.answer()
    }
}

/// Gives the watchdog of a run its signs of life, and reports a watchdog that ended.
pub(super) struct WatchdogMonitor(pub(super) Rc<Watchdog>);

impl RunMonitor for WatchdogMonitor {
    fn event(&mut self, _event: &Event) {
        self.0.beat();
    }

    fn health(&mut self) -> Vec<HealthProblem> {
        self.0.health()
    }

    fn heartbeat(&mut self) -> ControlFlow<()> {
        self.0.beat();
        ControlFlow::Continue(())
    }
}

/// Reports a host computer that is too hot or whose supply is too weak.
pub(super) struct HostMonitor {
    host: Host,
    hot_c: f64,
}

impl HostMonitor {
    /// Watches this computer; above `hot_c` degrees Celsius it is too hot.
    pub(super) fn new(hot_c: f64) -> Self {
        Self { host: Host::here(), hot_c }
    }
}

impl RunMonitor for HostMonitor {
    fn event(&mut self, _event: &Event) {}

    fn health(&mut self) -> Vec<HealthProblem> {
        self.host.health(self.hot_c)
    }
}
