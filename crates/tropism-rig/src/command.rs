//! Drivers that run a program of the user, for any hardware that a command line reaches.
//!
//! A program is a list of words and runs without a shell. It is killed at its deadline.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use tropism::lamps::Light;
use tropism::lighting::FULL;
use tropism::photo::Photo;
use tropism::rig::{Camera, Lamps, RigError};

use crate::broker::Broker;
use crate::child::run;
use crate::failed;
use crate::seconds::{Seconds, one, ten, twenty};
use crate::settings::{CameraSettings, FlashSettings, LampSettings, Outlet};
use crate::switch::{Switch, cannot_dim};
use crate::{picture, retry, whole};

/// A camera whose program writes a photograph to stdout, such as
/// `rpicam-still --immediate --nopreview --output -`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CommandCamera {
    /// Program and arguments.
    pub command: Vec<String>,
    /// Time limit of each program.
    #[serde(default = "twenty")]
    pub timeout_s: Seconds,
    /// Further attempts after a failure.
    #[serde(default = "retry::two", deserialize_with = "whole::retries")]
    pub retries: u32,
}

/// Checks that a program has a name.
fn check_program(key: &str, words: &[String]) -> Result<(), String> {
    match words.first() {
        Some(program) if !program.is_empty() => Ok(()),
        _ => Err(format!("found {key} = {words:?}, wanted a program and its arguments")),
    }
}

impl CameraSettings for CommandCamera {
    fn check(&self) -> Result<(), String> {
        check_program("command", &self.command)
    }

    fn open(&self) -> Result<Box<dyn Camera>, RigError> {
        Ok(Box::new(self.clone()))
    }

    fn timeout_s(&self) -> f64 {
        self.timeout_s.into()
    }

    fn retries(&mut self) -> Option<&mut u32> {
        Some(&mut self.retries)
    }
}

impl Camera for CommandCamera {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        retry::retry(self.retries, || {
            let bytes = run("camera", &self.command, self.timeout_s.duration())?;
            picture::check(&bytes).map_err(|problem| failed("camera", problem))?;
            Ok(Photo { name: String::new(), bytes, time_s: 0.0 })
        })
    }
}

/// Lamps behind one program for each, and one for darkness. The program of a lamp must darken all others first.
#[derive(Clone, Debug)]
pub struct CommandLamps {
    /// For each lamp, in the order of the layout: lights it and darkens all others.
    pub lamps: Vec<Vec<String>>,
    /// Darkens all lamps: the safe state.
    pub dark: Vec<String>,
    /// Time limit of each program.
    pub timeout: Duration,
}

impl Lamps for CommandLamps {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        let words = light.map_or(Some(&self.dark), |light| self.lamps.get(light.index()));
        let Some(words) = words else {
            let number = light.map_or(0, |light| light.index() + 1);
            return Err(failed(
                "lamps",
                format!("found lamp number {number}, wanted 1 to {}", self.lamps.len()),
            ));
        };
        run("lamps", words, self.timeout).map(drop)
    }
}

/// What stands for the level, 0 to 255, in the words of the program that lights a lamp.
const LEVEL: &str = "{level}";

/// A lamp behind two programs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CommandLamp {
    /// Lights it. `{level}` in a word becomes the level, 1 to 255; without it the lamp is only on or off.
    pub on: Vec<String>,
    /// Darkens it.
    pub off: Vec<String>,
    /// Time limit of each program.
    #[serde(default = "twenty")]
    pub timeout_s: Seconds,
}

impl LampSettings for CommandLamp {
    fn check(&self, _period_min: f64) -> Result<(), String> {
        check_program("on", &self.on)?;
        check_program("off", &self.off)
    }

    fn outlet(&self) -> Outlet {
        Outlet::Programs { on: self.on.clone(), off: self.off.clone() }
    }

    /// Whether its program takes a level.
    fn dims(&self) -> bool {
        takes_level(&self.on)
    }

    fn open(&self, device: &str, _broker: Option<&Broker>) -> Result<Box<dyn Switch>, RigError> {
        let Self { on, off, timeout_s } = self.clone();
        let timeout = timeout_s.duration();
        Ok(Box::new(CommandSwitch { device: device.to_owned(), on, off, timeout, on_timeout: timeout }))
    }

    fn timeout_s(&self) -> f64 {
        self.timeout_s.into()
    }
}

fn takes_level(words: &[String]) -> bool {
    words.iter().any(|word| word.contains(LEVEL))
}

/// A flash behind two programs, with time to reach its brightness.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CommandFlash {
    /// Switches it on.
    pub on: Vec<String>,
    /// Switches it off.
    pub off: Vec<String>,
    /// Seconds from switching on to the photograph.
    #[serde(default = "one")]
    pub settle_s: Seconds,
    /// Longest time for which the flash is on.
    #[serde(default = "ten")]
    pub max_on_s: Seconds,
    /// Time limit of each program.
    #[serde(default = "twenty")]
    pub timeout_s: Seconds,
}

impl FlashSettings for CommandFlash {
    fn check(&self) -> Result<(), String> {
        check_program("on", &self.on)?;
        check_program("off", &self.off)
    }

    fn outlet(&self) -> Outlet {
        Outlet::Programs { on: self.on.clone(), off: self.off.clone() }
    }

    fn open(&self, _broker: Option<&Broker>) -> Result<Box<dyn Switch>, RigError> {
        let Self { on, off, max_on_s, timeout_s, .. } = self.clone();
        Ok(Box::new(CommandSwitch {
            device: "flash".to_owned(),
            on,
            off,
            timeout: timeout_s.duration(),
            // A program that hangs while the light is on already is killed, and the light switched off.
            on_timeout: timeout_s.duration().min(max_on_s.duration()),
        }))
    }

    fn timeout_s(&self) -> f64 {
        self.timeout_s.into()
    }

    fn times(&self) -> [Seconds; 2] {
        [self.settle_s, self.max_on_s]
    }
}

/// A device behind two programs.
#[derive(Clone, Debug)]
pub struct CommandSwitch {
    /// Name in errors.
    pub device: String,
    /// Switches it on.
    pub on: Vec<String>,
    /// Switches it off.
    pub off: Vec<String>,
    /// Time limit of the program that switches it off.
    pub timeout: Duration,
    /// Time limit of the program that switches it on.
    pub on_timeout: Duration,
}

impl Switch for CommandSwitch {
    fn switch(&mut self, is_on: bool) -> Result<(), RigError> {
        self.dim(if is_on { FULL } else { 0 })
    }

    fn dim(&mut self, level: u8) -> Result<(), RigError> {
        if level == 0 {
            return run(&self.device, &self.off, self.timeout).map(drop);
        }
        if level < FULL && !takes_level(&self.on) {
            return Err(cannot_dim(&self.device, level));
        }
        let words: Vec<String> = self.on.iter().map(|word| word.replace(LEVEL, &level.to_string())).collect();
        run(&self.device, &words, self.on_timeout).map(drop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::tests::jpeg;

    fn words(text: &[&str]) -> Vec<String> {
        text.iter().map(|&word| word.to_owned()).collect()
    }

    #[test]
    fn a_photograph_that_is_none_is_asked_for_again() {
        let folder = tempfile::tempdir().unwrap();
        let [count, photo] = ["count", "photo"].map(|name| folder.path().join(name).display().to_string());
        std::fs::write(&photo, jpeg(1)).unwrap();
        // It fails, then gives half a photograph, then one.
        let script = format!(
            "echo x >> {count}; n=$(wc -l < {count}); [ $n -gt 1 ] || exit 3; [ $n -gt 2 ] || exec head -c 200 {photo}; cat {photo}"
        );
        let mut camera = CommandCamera {
            command: words(&["sh", "-c", &script]),
            timeout_s: Seconds::new(5.0),
            retries: 2,
        };
        assert_eq!(camera.photograph().unwrap().bytes, jpeg(1));
        camera.command = words(&["echo", "<html>"]);
        assert!(camera.photograph().unwrap_err().to_string().contains("<html>"));
    }

    #[test]
    fn a_flash_whose_program_hangs_while_it_lights_is_off_again_in_time() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log");
        let say = |what: &str| {
            format!("[\"sh\", \"-c\", \"echo {what} $(date +%s%N) >> {}; sleep 0\"]", log.display())
        };
        let hang = say("on").replace("sleep 0", "sleep 60");
        let off = say("off");
        let text =
            format!("driver = \"command\"\non = {hang}\noff = {off}\nmax_on_s = 0.3\ntimeout_s = 20.0");
        let driver: crate::driver::FlashDriver = toml::from_str(&text).unwrap();
        let mut flash = driver.open(None).unwrap();
        assert!(flash.flash(true).unwrap_err().to_string().contains("still runs"));
        drop(flash);
        let text = std::fs::read_to_string(log).unwrap();
        let times = |word: &str| -> Vec<u64> {
            let lines = text.lines().filter_map(|line| line.strip_prefix(word));
            lines.map(|time| time.trim().parse().unwrap()).collect()
        };
        let lit_ns = times("off").last().unwrap() - times("on")[0];
        assert!(lit_ns < 5_000_000_000, "lit for {lit_ns} ns: {text}");
    }

    #[test]
    fn a_program_gets_the_level_where_it_asks_for_it() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log");
        let say = |word: &str| words(&["sh", "-c", &format!("echo {word} >> {}", log.display())]);
        let mut lamp = CommandSwitch {
            device: "left lamp".to_owned(),
            on: say("on-{level}"),
            off: say("off"),
            timeout: Duration::from_secs(5),
            on_timeout: Duration::from_secs(5),
        };
        lamp.dim(7).unwrap();
        lamp.switch(true).unwrap();
        lamp.dim(0).unwrap();
        assert_eq!(std::fs::read_to_string(&log).unwrap(), "on-7\non-255\noff\n");
        lamp.on = say("on");
        let error = lamp.dim(7).unwrap_err().to_string();
        assert!(error.starts_with("left lamp: found level 7 of 255"), "{error}");
    }

    #[test]
    fn each_state_of_the_lamps_is_a_program() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log");
        let say = |word: &str| words(&["sh", "-c", &format!("echo {word} >> {}", log.display())]);
        let mut lamps = CommandLamps {
            lamps: vec![say("left"), say("right"), say("front")],
            dark: say("dark"),
            timeout: Duration::from_secs(5),
        };
        for light in [Some(Light::RIGHT), None, Some(Light::FRONT), Some(Light::LEFT)] {
            lamps.light(light).unwrap();
        }
        assert!(lamps.light(Some(Light::BACK)).unwrap_err().to_string().contains("wanted 1 to 3"));
        assert_eq!(std::fs::read_to_string(log).unwrap(), "right\ndark\nfront\nleft\n");
    }
}
