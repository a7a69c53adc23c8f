//! Asking again.

use tropism::rig::RigError;

pub(crate) const fn two() -> u32 {
    2
}

/// The first success of `attempt`, or after `retries` further tries its last error.
pub(crate) fn again<T>(
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
