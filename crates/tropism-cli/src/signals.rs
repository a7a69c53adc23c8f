//! Signals: requests to end, and file size limits.

/// Calls `handler` on a thread of its own at each request to end: Ctrl-C (SIGINT), SIGTERM, and SIGHUP of a terminal that is
/// closed. A signal that is ignored when the program starts stays ignored, as `nohup` and `&` in scripts want.
///
/// From now on a file that would outgrow the limit of `ulimit -f` is an error of its write. By default SIGXFSZ kills the program
/// before any lamp is dark.
#[cfg(unix)]
pub(crate) fn handle(handler: impl Fn() + Send + 'static) {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    use signal_hook::iterator::Signals;

    let ignored = ignored();
    let is_heard = |signal: &i32| ignored & (1 << (signal - 1)) == 0;
    // If no handler can be installed, a signal ends the program at once, and the files on the disk can still be resumed.
    if let Ok(mut signals) = Signals::new([SIGHUP, SIGINT, SIGTERM].iter().filter(|signal| is_heard(signal)))
    {
        std::thread::spawn(move || signals.forever().for_each(|_| handler()));
    }
    // Any handler will do: with one, the write returns the error EFBIG. Programs of a rig start with the default again.
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
}

/// The signals that are ignored, as bits from that of signal 1 up. None where the system does not say it in `/proc`.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

/// Calls `handler` on a thread of its own at each request to end: Ctrl-C, or the end of the console.
#[cfg(not(unix))]
pub(crate) fn handle(handler: impl Fn() + Send + 'static) {
    // As above.
    let _ = ctrlc::set_handler(handler);
}
