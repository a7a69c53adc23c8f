//! Repeated attempts.

use tropism::rig::RigError;

/// The default number of retries of cameras, and of devices at shutdown: chosen by hand.
pub(crate) const fn two() -> u32 {
    2
}

/// Calls `attempt` until it succeeds, at most `1 + retries` times, and returns its first success or its last error.
pub(crate) fn retry<T>(
    retries: u32,
    mut attempt: impl FnMut() -> Result<T, RigError>,
) -> Result<T, RigError> {
    let mut left = retries;
    loop {
        match attempt() {
            Err(_) if left > 0 => left -= 1,
            done => return done,
        }
    }
}
