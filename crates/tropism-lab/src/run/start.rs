//! Whether a run in a real tent may begin or resume, and how old its experiment is.

use std::time::Duration;

use tropism::rig::{Event, EventKind, Moment, OnDowntime, RunMonitor};
use tropism_rig::clock::{SystemTimes, Time};
use tropism_rig::file::RigFile;

use crate::error::Error;
use crate::folder::RunFolder;
use crate::journal::Downtime;

/// How long ago the experiment in `folder` began: zero for a new one.
///
/// # Errors
/// [`Error::Paused`] if its user must decide first and does not ask to resume; [`Error::Plan`] if the disk is too full for a
/// new run.
pub(super) fn since_start(
    rig: &RigFile,
    folder: &RunFolder,
    is_resumed: bool,
    monitors: &mut Vec<Box<dyn RunMonitor + '_>>,
) -> Result<Duration, Error> {
    let (policy, journal, times) = (rig.fault_policy(), folder.journal(), SystemTimes);
    let paused = |reason: String| Error::Paused { folder: folder.path().to_owned(), reason };
    if let Some(Event { kind: EventKind::Paused, text, .. }) = journal.state()?.filter(|_| !is_resumed) {
        return Err(paused(text));
    }
    let downtime =
        Downtime::of(journal, &times.boot_id(), times.boot_s(), times.unix_s(), times.is_wall_set())?;
    let goes_on = is_resumed || policy.on_gap == OnDowntime::Resume;
    let reason = match downtime {
        // A run without a step has lost none.
        _ if journal.step_count()? == 0 => {
            check_free_disk(folder, policy.free_mb)?;
            return Ok(Duration::ZERO);
        }
        Downtime::NotBegun => return Ok(Duration::ZERO),
        Downtime::Known { length, since_start }
            if goes_on || length.as_secs_f64() <= 60.0 * policy.gap_min =>
        {
            return Ok(since_start);
        }
        Downtime::Unknown { last } if goes_on => {
            // As if no time had passed: the next step is due now.
            let period_s = 60.0 * rig.period_min;
            return Ok(Duration::from_secs_f64(period_s * ((last.as_secs_f64() / period_s).floor() + 1.0)));
        }
        Downtime::Known { length, .. } => format!(
            "the run was down for {:.0} minutes, more than fault_policy.gap_min = {}",
            length.as_secs_f64() / 60.0,
            policy.gap_min
        ),
        Downtime::Unknown { .. } => {
            "the computer was started again, and its clock was not known to be right then or is not now: \
                                nobody knows for how long"
                .to_owned()
        }
    };
    let at = journal.latest_moment()?.map(|last| Moment { unix_s: times.unix_s(), ..last });
    let step = journal.steps()?.last().map_or(0, |step| step.step);
    // No device has a say in this text.
    let event = Event { step, kind: EventKind::Paused, text: reason.clone(), at };
    journal.record_event(&event)?;
    monitors.event(&event);
    Err(paused(reason))
}

/// Checks that the disk of `folder` has `wanted_mb` megabytes free, where the system reports it.
fn check_free_disk(folder: &RunFolder, wanted_mb: u32) -> Result<(), Error> {
    match folder.free_bytes() {
        Some(free) if free < u64::from(wanted_mb) << 20 => Err(Error::Plan(format!(
            "{}: found {} MB of disk free, wanted {wanted_mb}: make room, or change fault_policy.free_mb",
            folder.path().display(),
            free >> 20,
        ))),
        _ => Ok(()),
    }
}
