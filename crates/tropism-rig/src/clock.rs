//! The clock on the wall.

use std::time::{Duration, SystemTime};

use tropism::rig::Clock;

/// Sleeps until a step is due.
#[derive(Clone, Copy, Debug)]
pub struct WallClock {
    start: SystemTime,
}

impl WallClock {
    /// A clock whose experiment began at `start`: before now, if the run is resumed.
    #[must_use]
    pub const fn new(start: SystemTime) -> Self {
        Self { start }
    }
}

impl Clock for WallClock {
    /// Sleeps in short stretches, so that a clock which was set meanwhile is noticed.
    fn wait_until(&mut self, since_start: Duration) {
        while let Some(left) =
            (self.start + since_start).duration_since(SystemTime::now()).ok().filter(|left| !left.is_zero())
        {
            std::thread::sleep(left.min(Duration::from_secs(1)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_until_the_step_is_due_and_no_longer_for_one_that_has_passed() {
        let start = SystemTime::now();
        let mut clock = WallClock::new(start);
        clock.wait_until(Duration::from_millis(60));
        assert!(start.elapsed().unwrap() >= Duration::from_millis(60));
        let mut late = WallClock::new(start - Duration::from_secs(3600));
        late.wait_until(Duration::from_secs(3000));
    }
}
