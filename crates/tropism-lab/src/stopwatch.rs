//! Wall-clock and processor time of a workflow: for people to read, never used in a computation.

use std::time::Instant;

/// Measures the time since it was started.
pub(crate) struct Stopwatch {
    started: Instant,
    cpu_seconds: f64,
}

impl Stopwatch {
    /// Starts now.
    pub(crate) fn start() -> Self {
        Self { started: Instant::now(), cpu_seconds: cpu_seconds() }
    }

    /// Seconds since the start.
    pub(crate) fn wall_seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// Processor seconds since the start, summed over all threads of the program.
    pub(crate) fn cpu_seconds(&self) -> f64 {
        cpu_seconds() - self.cpu_seconds
    }
}

fn cpu_seconds() -> f64 {
    // On a system without this clock the processor time is shown as 0.
    cpu_time::ProcessTime::try_now().map_or(0.0, |now| now.as_duration().as_secs_f64())
}

/// What `work` makes, and the processor seconds that this thread spends on it.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let now = || cpu_time::ThreadTime::try_now().map_or(0.0, |now| now.as_duration().as_secs_f64());
    let started = now();
    let made = work();
    (made, now() - started)
}
