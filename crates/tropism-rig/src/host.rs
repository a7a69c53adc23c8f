//! The computer that runs the experiment: its temperature and its power supply, as Linux reports them.
//!
//! # References
//! Raspberry Pi documentation, "vcgencmd get_throttled": the bits. Linux, drivers/hwmon/raspberrypi-hwmon.c: the alarm.

use std::fs;
use std::path::{Path, PathBuf};

use tropism::rig::HealthProblem;

/// The computer, as its file system `/sys` shows it.
#[derive(Clone, Debug)]
pub struct Host {
    sys: PathBuf,
}

/// Power supply and throttling, as a Raspberry Pi reports them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Supply {
    /// Whether the voltage is too low now.
    pub is_weak: bool,
    /// Whether the voltage was too low at any time since boot.
    pub was_weak: bool,
    /// Whether the processor is throttled now, by voltage or temperature.
    pub is_throttled: bool,
}

impl Host {
    /// The computer that this program runs on.
    #[must_use]
    pub fn here() -> Self {
        Self::at(Path::new("/sys"))
    }

    fn at(sys: &Path) -> Self {
        Self { sys: sys.to_owned() }
    }

    /// The trimmed content of a file; `None` if it cannot be read.
    fn word(path: &Path) -> Option<String> {
        Some(fs::read_to_string(path).ok()?.trim().to_owned())
    }

    /// The folders in the folder `name` of `/sys`, in no order.
    fn folders(&self, name: &str) -> impl Iterator<Item = PathBuf> {
        fs::read_dir(self.sys.join(name)).into_iter().flatten().flatten().map(|entry| entry.path())
    }

    /// The highest temperature of all sensors, in degrees Celsius; `None` without a sensor.
    #[must_use]
    pub fn temperature_c(&self) -> Option<f64> {
        let zones = self.folders("class/thermal").filter_map(|zone| Self::word(&zone.join("temp")));
        zones
            .filter_map(|text| text.parse::<f64>().ok())
            .map(|millidegrees| millidegrees / 1e3)
            .max_by(f64::total_cmp)
    }

    /// The state of the power supply; `None` where the system does not report it.
    #[must_use]
    pub fn supply(&self) -> Option<Supply> {
        let bits = Self::word(&self.sys.join("devices/platform/soc/soc:firmware/get_throttled"))
            .and_then(|text| u32::from_str_radix(text.trim_start_matches("0x"), 16).ok());
        let alarm = self
            .folders("class/hwmon")
            .find(|monitor| Self::word(&monitor.join("name")).as_deref() == Some("rpi_volt"))
            .and_then(|monitor| Self::word(&monitor.join("in0_lcrit_alarm")));
        if bits.is_none() && alarm.is_none() {
            return None;
        }
        let is_set = |bit: u32| bits.is_some_and(|bits| bits & (1 << bit) != 0);
        let is_weak = is_set(0) || alarm.as_deref() == Some("1");
        Some(Supply { is_weak, was_weak: is_weak || is_set(16), is_throttled: is_set(2) })
    }

    /// The present problems; above `hot_c` degrees Celsius is one.
    #[must_use]
    pub fn health(&self, hot_c: f64) -> Vec<HealthProblem> {
        let mut problems = Vec::new();
        let mut add = |is_present: bool, what, text: &str| {
            if is_present {
                problems.push(HealthProblem { what, text: text.to_owned() });
            }
        };
        let temperature_c = self.temperature_c().unwrap_or(f64::NEG_INFINITY);
        let hot = format!("the computer has {temperature_c:.0} degrees Celsius, more than {hot_c}: cool it");
        add(temperature_c > hot_c, "temperature", &hot);
        let supply = self.supply().unwrap_or_default();
        add(
            supply.is_weak,
            "supply",
            "the computer's supply is too weak: a photograph or the disk may suffer",
        );
        add(supply.is_throttled, "speed", "the computer slows itself down, for heat or a weak supply");
        problems
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn put(sys: &Path, name: &str, text: &str) {
        let path = sys.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, format!("{text}\n")).unwrap();
    }

    fn health(sys: &Path) -> Vec<&'static str> {
        Host::at(sys).health(80.0).iter().map(|problem| problem.what).collect()
    }

    #[test]
    fn a_computer_that_says_nothing_has_no_problems() {
        let sys = tempfile::tempdir().unwrap();
        let host = Host::at(sys.path());
        assert_eq!((host.temperature_c(), host.supply()), (None, None));
        assert!(health(sys.path()).is_empty());
        put(sys.path(), "class/thermal/thermal_zone0/temp", "");
        put(sys.path(), "class/hwmon/hwmon0/name", "nvme");
        assert_eq!((host.temperature_c(), host.supply()), (None, None));
    }

    #[test]
    fn heat_and_a_weak_supply_are_seen_as_long_as_they_last() {
        let sys = tempfile::tempdir().unwrap();
        let sys = sys.path();
        put(sys, "class/thermal/thermal_zone0/temp", "27800");
        put(sys, "class/thermal/thermal_zone1/temp", "80100");
        put(sys, "class/thermal/cooling_device0/type", "fan");
        assert_eq!(health(sys), ["temperature"]);
        put(sys, "class/thermal/thermal_zone1/temp", "79900");
        put(sys, "class/hwmon/hwmon1/name", "rpi_volt");
        put(sys, "class/hwmon/hwmon1/in0_lcrit_alarm", "1");
        assert_eq!(health(sys), ["supply"]);
        put(sys, "class/hwmon/hwmon1/in0_lcrit_alarm", "0");
        put(sys, "devices/platform/soc/soc:firmware/get_throttled", "50005");
        assert_eq!(health(sys), ["supply", "speed"]);
        put(sys, "devices/platform/soc/soc:firmware/get_throttled", "50000");
        let supply = Host::at(sys).supply().unwrap();
        assert_eq!(supply, Supply { is_weak: false, was_weak: true, is_throttled: false });
        assert!(health(sys).is_empty());
    }
}
