//! Threads of a process: how many there are, and what a fork leaves of them.

use std::sync::atomic::{AtomicU32, Ordering};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::refused;

/// Threads of a pool at most, as on the command line.
const MOST: usize = 1024;

/// The process in which threads were first used; 0 before.
static STARTED_IN: AtomicU32 = AtomicU32::new(0);

/// Refuses to use threads in a process that was forked from one with threads: they exist in the parent alone, and the child
/// would wait for them for ever.
pub(crate) fn check_fork() -> PyResult<()> {
    let here = std::process::id();
    match STARTED_IN.compare_exchange(0, here, Ordering::SeqCst, Ordering::SeqCst) {
        Err(started) if started != here => Err(PyRuntimeError::new_err(
            "found a process that was forked after tropism had started threads, wanted a fresh one: use \
             multiprocessing.get_context(\"spawn\") or \"forkserver\"",
        )),
        _ => Ok(()),
    }
}

/// A pool of `count` threads; `None` is that of the process, with a thread a core.
pub(crate) fn pool(count: Option<usize>) -> PyResult<Option<ThreadPool>> {
    check_fork()?;
    if let Some(count) = count.filter(|count| !(1..=MOST).contains(count)) {
        return Err(refused(format!("threads: found {count}, wanted 1 to {MOST}")));
    }
    let build = |count| ThreadPoolBuilder::new().num_threads(count).build();
    count.map(build).transpose().map_err(|error| PyRuntimeError::new_err(error.to_string()))
}

/// Does `work` in `pool`.
pub(crate) fn within<T: Send>(pool: Option<&ThreadPool>, work: impl FnOnce() -> T + Send) -> T {
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}
