//! Executes a whole work on the threads of this program.

use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

use tropism::parallel;

use super::claim::claim;
use super::{Milestone, Pace, Place, Stage, Units, Work};
use crate::monitor::{NotedOnce, Titled};
use crate::{Error, Monitor};

/// Executes `work`: all units that are not done, and the collection of the results.
pub(crate) fn perform<W: Work>(work: &W, monitor: &dyn Monitor) -> Result<W::Results, Error> {
    let begun = work.begin(monitor)?;
    let _lock = claim(work, &begun)?;
    let of_work = |error: Error| error.of_part(work.out());
    execute_all(&begun, work.out(), monitor).map_err(of_work)?;
    work.collect(&begun, monitor).map_err(of_work)
}

/// [`perform`] in the folder `out`; without one in a folder that is gone afterwards, so that nothing is kept.
pub(crate) fn perform_in<W: Work>(
    out: Option<&Path>,
    work_in: impl FnOnce(PathBuf) -> W,
    monitor: &dyn Monitor,
) -> Result<W::Results, Error> {
    if let Some(out) = out {
        return perform(&work_in(out.to_owned()), monitor);
    }
    let folder = tempfile::tempdir().map_err(Error::at("a folder for a while"))?;
    perform(&work_in(folder.path().join("work")), monitor).map_err(|error| match error {
        Error::Interrupted { .. } => Error::cancelled(),
        error => error,
    })
}

fn execute_all(begun: &impl Units, folder: &Path, monitor: &dyn Monitor) -> Result<(), Error> {
    begun.reached(&Milestone::Begun, monitor)?;
    let stages = begun.stages();
    for (number, stage) in stages.iter().enumerate() {
        let started = Instant::now();
        let done = titled(monitor, number, stages.len(), |monitor| {
            execute_stage(begun, number, stage, folder, monitor)
        });
        let seconds = started.elapsed().as_secs_f64();
        begun.reached(&Milestone::StageEnded { stage: number, seconds, is_done: done.is_ok() }, monitor)?;
        done?;
    }
    Ok(())
}

/// Does the part of number `place`, from 0, of `count` under a monitor that shows which part it is, where there are several.
fn titled<T>(monitor: &dyn Monitor, place: usize, count: usize, part: impl FnOnce(&dyn Monitor) -> T) -> T {
    if count == 1 {
        return part(monitor);
    }
    part(&Titled { monitor, title: format!("{}/{count}", place + 1) })
}

fn execute_stage(
    begun: &impl Units,
    number: usize,
    stage: &Stage,
    folder: &Path,
    monitor: &dyn Monitor,
) -> Result<(), Error> {
    let count = stage.units.len();
    let monitor: &dyn Monitor = &NotedOnce::new(monitor);
    let unit = |unit: usize, monitor: &dyn Monitor| {
        let place = Place { stage: number, unit };
        if begun.is_done(place)? {
            if stage.pace != Pace::Nested {
                monitor.skip(stage.units[unit].size);
            }
            return Ok(());
        }
        if !monitor.may_go_on() {
            return Err(Error::Interrupted { folder: folder.to_owned() });
        }
        begun.execute(place, monitor)
    };
    if stage.pace == Pace::Nested {
        return (0..count).try_for_each(|one| titled(monitor, one, count, |monitor| unit(one, monitor)));
    }
    monitor.stage(&stage.name, stage.units.iter().map(|unit| unit.size).sum());
    match stage.pace {
        Pace::Parallel => return parallel::try_map(count, |one| unit(one, monitor)).map(drop),
        Pace::Sequential => return (0..count).try_for_each(|one| unit(one, monitor)),
        Pace::Nested | Pace::SideBySide => {}
    }
    let together = Together { monitor, has_failed: AtomicBool::new(false) };
    let finished = AtomicUsize::new(0);
    side_by_side(count, |one| {
        unit(one, &together).inspect_err(|_| together.has_failed.store(true, Ordering::Relaxed))?;
        let finished = finished.fetch_add(1, Ordering::Relaxed) + 1;
        monitor.status(&format!("{finished} of {count}"));
        Ok(())
    })
}

/// The monitor of units side by side: where one fails the others are asked to end, and save what they have.
struct Together<'m> {
    monitor: &'m dyn Monitor,
    has_failed: AtomicBool,
}

impl Monitor for Together<'_> {
    fn next(&self) -> Option<&dyn Monitor> {
        Some(self.monitor)
    }

    fn may_go_on(&self) -> bool {
        !self.has_failed.load(Ordering::Relaxed) && self.monitor.may_go_on()
    }
}

/// Does the `work` of all numbers below `count`, as many at once as the pool has threads.
///
/// The threads that wait for a unit are none of the pool: one of the pool that waits would take up another unit meanwhile, and
/// in it another.
fn side_by_side(count: usize, work: impl Fn(usize) -> Result<(), Error> + Sync) -> Result<(), Error> {
    let next = AtomicUsize::new(0);
    let worker = || {
        let mut failures = Vec::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= count {
                return failures;
            }
            failures.extend(work(number).err().map(|error| (number, error)));
        }
    };
    let workers = rayon::current_num_threads().min(count);
    let mut failures: Vec<(usize, Error)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..workers).map(|_| scope.spawn(worker)).collect();
        let joined =
            workers.into_iter().map(|worker| worker.join().unwrap_or_else(|panic| resume_unwind(panic)));
        joined.flatten().collect()
    });
    // What failed comes before what was asked to end for it.
    failures.sort_by_key(|(number, error)| (matches!(error, Error::Interrupted { .. }), *number));
    failures.into_iter().next().map_or(Ok(()), |(_, error)| Err(error))
}
