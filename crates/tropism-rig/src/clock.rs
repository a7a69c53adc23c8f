//! The clock of a tent: monotonic time since the start of the experiment, and wall time as a label.

use std::ops::ControlFlow;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use jiff::Timestamp;
use jiff::tz::TimeZone;
use tropism::programme::TimeOfDay;
use tropism::rig::{Boot, Clock, Moment};

/// Longest sleep before the caller is asked whether to continue: chosen, below half a second.
const MAX_SLEEP: Duration = Duration::from_millis(400);

/// A source of time.
pub trait Time {
    /// Seconds since the boot of the computer, including suspend. Cannot be set.
    fn boot_s(&self) -> f64;

    /// Identifies the current boot of the computer.
    fn boot_id(&self) -> String;

    /// Wall time, in seconds since 1970.
    fn unix_s(&self) -> f64;

    /// Whether wall time is known to be synchronised.
    fn is_wall_set(&self) -> bool;

    /// Sleeps for `time`.
    fn sleep(&self, time: Duration);
}

/// The computer's clocks.
#[derive(Clone, Copy, Debug, Default)]
pub struct SystemTimes;

impl Time for SystemTimes {
    #[cfg(target_os = "linux")]
    fn boot_s(&self) -> f64 {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::Boottime);
        time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
    }

    /// Since the first call of this process: a clock since boot is read on Linux only.
    #[cfg(not(target_os = "linux"))]
    fn boot_s(&self) -> f64 {
        static FIRST: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
        FIRST.get_or_init(std::time::Instant::now).elapsed().as_secs_f64()
    }

    fn boot_id(&self) -> String {
        let id = std::fs::read_to_string("/proc/sys/kernel/random/boot_id");
        id.map_or_else(|_| format!("process {}", std::process::id()), |id| id.trim().to_owned())
    }

    fn unix_s(&self) -> f64 {
        SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64()
    }

    /// As systemd reports it; `false` without systemd.
    fn is_wall_set(&self) -> bool {
        Path::new("/run/systemd/timesync/synchronized").exists()
            || Command::new("timedatectl")
                .args(["show", "--property=NTPSynchronized", "--value"])
                .output()
                .is_ok_and(|answer| answer.stdout.trim_ascii() == b"yes")
    }

    fn sleep(&self, time: Duration) {
        std::thread::sleep(time);
    }
}

/// Time since the start of an experiment. Changes of wall time do not affect it.
#[derive(Clone, Debug)]
pub struct TentClock<T = SystemTimes> {
    time: T,
    boot: Boot,
    zone: TimeZone,
}

impl TentClock {
    /// The clock of an experiment that began `since_start` ago.
    #[must_use]
    pub fn new(since_start: Duration) -> Self {
        Self::of(SystemTimes, since_start)
    }
}

impl<T: Time> TentClock<T> {
    /// The clock of an experiment that began `since_start` ago, read from `time`.
    #[must_use]
    pub fn of(time: T, since_start: Duration) -> Self {
        let boot = Boot {
            id: time.boot_id(),
            start_s: time.boot_s() - since_start.as_secs_f64(),
            is_wall_set: time.is_wall_set(),
        };
        Self { time, boot, zone: TimeZone::UTC }
    }

    /// The same clock with the local time of `zone`; without it, of UTC.
    #[must_use]
    pub fn in_zone(self, zone: TimeZone) -> Self {
        Self { zone, ..self }
    }

    /// The name of its time zone; `local` for one without a name.
    #[must_use]
    pub fn zone(&self) -> &str {
        self.zone.iana_name().unwrap_or("local")
    }

    fn since_start(&self) -> Duration {
        Duration::try_from_secs_f64((self.time.boot_s() - self.boot.start_s).max(0.0)).unwrap_or_default()
    }
}

impl<T: Time> Clock for TentClock<T> {
    fn wait_until(
        &mut self,
        since_start: Duration,
        meanwhile: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        while let Some(left) = since_start.checked_sub(self.since_start()).filter(|left| !left.is_zero()) {
            self.time.sleep(left.min(MAX_SLEEP));
            meanwhile()?;
        }
        ControlFlow::Continue(())
    }

    fn now(&self) -> Option<Moment> {
        Some(Moment { since_start: self.since_start(), unix_s: self.time.unix_s() })
    }

    fn boot(&self) -> Option<Boot> {
        Some(self.boot.clone())
    }

    fn time_of_day(&self) -> TimeOfDay {
        time_of_day(self.time.unix_s(), &self.zone)
    }
}

/// The time zone of an IANA name such as `Europe/Berlin`, or that of the computer.
///
/// # Errors
/// A line that says what was found and what was wanted.
pub fn time_zone(name: Option<&str>) -> Result<TimeZone, String> {
    let Some(name) = name else {
        return TimeZone::try_system().map_err(|error| {
            format!(
                "found no time zone of this computer ({error}), wanted time_zone, such as \"Europe/Berlin\""
            )
        });
    };
    TimeZone::get(name).map_err(|_| {
        format!("found time_zone = {name:?}, wanted a name of the IANA time zone database, such as \"Europe/Berlin\"")
    })
}

/// The local time of day in `zone` at so many seconds after 1970; midnight of a time beyond the year 9999.
fn time_of_day(unix_s: f64, zone: &TimeZone) -> TimeOfDay {
    let time = Timestamp::from_second(unix_s as i64).map(|at| at.to_zoned(zone.clone()).time());
    time.map_or(TimeOfDay::MIDNIGHT, |time| TimeOfDay::new(time.hour() as u16, time.minute() as u16))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::rc::Rc;

    use super::*;

    /// Time that passes only while somebody sleeps, and a wall clock that is set by hours with every sleep.
    #[derive(Clone, Default)]
    struct Jumpy {
        boot_s: Rc<Cell<f64>>,
        sleeps: Rc<Cell<u32>>,
    }

    impl Time for Jumpy {
        fn boot_s(&self) -> f64 {
            self.boot_s.get()
        }
        fn boot_id(&self) -> String {
            "this one".to_owned()
        }
        fn unix_s(&self) -> f64 {
            1e9 + f64::from(self.sleeps.get() % 5) * 7200.0 - f64::from(self.sleeps.get() % 3) * 86_400.0
        }
        fn is_wall_set(&self) -> bool {
            false
        }
        fn sleep(&self, time: Duration) {
            self.boot_s.set(self.boot_s.get() + time.as_secs_f64());
            self.sleeps.set(self.sleeps.get() + 1);
        }
    }

    #[test]
    fn a_step_comes_when_it_is_due_whatever_is_done_to_the_clock_on_the_wall() {
        let time = Jumpy::default();
        let mut clock = TentClock::of(time.clone(), Duration::ZERO);
        for step in 0..50_u32 {
            let due = Duration::from_secs(300) * step;
            assert!(clock.wait_until(due, &mut || ControlFlow::Continue(())).is_continue());
            assert!(clock.since_start().abs_diff(due) < Duration::from_millis(1), "step {step}");
        }
        // One that has passed is not waited for.
        let before = time.sleeps.get();
        assert!(clock.wait_until(Duration::from_secs(3), &mut || ControlFlow::Break(())).is_continue());
        assert_eq!(time.sleeps.get(), before);
    }

    #[test]
    fn an_experiment_that_is_gone_on_with_keeps_its_times() {
        let time = Jumpy::default();
        time.boot_s.set(50.0);
        let clock = TentClock::of(time, Duration::from_secs(3600));
        assert_eq!(clock.boot().unwrap().start_s, -3550.0);
        assert_eq!(clock.now().unwrap().since_start, Duration::from_secs(3600));
    }

    #[test]
    fn whoever_asks_for_an_end_is_heard_within_half_a_second_of_a_wait_of_hours() {
        let time = Jumpy::default();
        let mut clock = TentClock::of(time.clone(), Duration::ZERO);
        let mut meanwhile =
            || if time.sleeps.get() > 9 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        assert!(clock.wait_until(Duration::from_secs(36_000), &mut meanwhile).is_break());
        assert!(time.boot_s.get() <= 10.0 * 0.5);
    }

    #[test]
    fn local_time_follows_the_clock_on_the_wall_over_both_changes_of_a_year() {
        let berlin = time_zone(Some("Europe/Berlin")).unwrap();
        // Unix seconds of midnight UTC; clocks change at 01:00 UTC.
        let (spring, autumn) = (1_774_742_400.0, 1_792_886_400.0);
        let local = |midnight: f64, minutes: f64| time_of_day(midnight + 60.0 * minutes, &berlin).to_string();
        let at = [0.0, 59.0, 60.0, 120.0];
        assert_eq!(at.map(|minutes| local(spring, minutes)), ["01:00", "01:59", "03:00", "04:00"]);
        assert_eq!(at.map(|minutes| local(autumn, minutes)), ["02:00", "02:59", "02:00", "03:00"]);
        let error = time_zone(Some("Europe/Berln")).unwrap_err();
        assert!(
            error.starts_with("found time_zone = \"Europe/Berln\", wanted a name of the IANA"),
            "{error}"
        );
    }

    #[test]
    fn the_computers_own_clock_goes_on() {
        let mut clock = TentClock::new(Duration::from_secs(60));
        let due = clock.since_start() + Duration::from_millis(30);
        assert!(clock.wait_until(due, &mut || ControlFlow::Continue(())).is_continue());
        assert!(clock.since_start() >= due && !clock.boot().unwrap().id.is_empty());
    }
}
