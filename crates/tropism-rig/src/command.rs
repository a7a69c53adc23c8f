//! Drivers that run a program: the way to any hardware that a command line reaches.
//!
//! Programs are given as a list of words and run without a shell. Each has a deadline, after which it is killed.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use tropism::lamps::Light;
use tropism::photo::Photo;
use tropism::rig::{Camera, Lamps, RigError};

use crate::child::run;
use crate::seconds::{Seconds, one, ten, twenty};
use crate::switch::Switch;
use crate::tries;

/// A camera behind a program that writes a photograph to stdout, such as
/// `rpicam-still --immediate --nopreview --output -`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandCamera {
    /// Program and arguments.
    pub command: Vec<String>,
    /// Seconds until it is given up.
    #[serde(default = "twenty")]
    pub timeout_s: Seconds,
    /// Further tries if a photograph fails.
    #[serde(default = "tries::two")]
    pub retries: u32,
}

impl Camera for CommandCamera {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        tries::again(self.retries, || {
            let bytes = run("camera", &self.command, self.timeout_s.duration())?;
            Ok(Photo { name: String::new(), bytes, time_s: 0.0 })
        })
    }
}

/// Lamps behind three programs, one for each state in which the pair may be. Each must darken the other lamp first.
#[derive(Clone, Debug)]
pub struct CommandLamps {
    /// Lights the left lamp and darkens the right one.
    pub left: Vec<String>,
    /// Lights the right lamp and darkens the left one.
    pub right: Vec<String>,
    /// Darkens both: the safe state.
    pub dark: Vec<String>,
    /// Until it is given up.
    pub timeout: Duration,
}

impl Lamps for CommandLamps {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        let words = match light {
            Some(Light::LEFT) => &self.left,
            Some(_) => &self.right,
            None => &self.dark,
        };
        run("lamps", words, self.timeout).map(drop)
    }
}

/// A lamp behind two programs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandLamp {
    /// Lights it.
    pub on: Vec<String>,
    /// Darkens it.
    pub off: Vec<String>,
    /// Seconds until it is given up.
    #[serde(default = "twenty")]
    pub timeout_s: Seconds,
}

/// A flash behind two programs, with time to reach its brightness.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandFlash {
    /// Switches it on.
    pub on: Vec<String>,
    /// Switches it off.
    pub off: Vec<String>,
    /// Seconds between switching it on and the photograph.
    #[serde(default = "one")]
    pub settle_s: Seconds,
    /// Seconds after which it is put off whatever happens.
    #[serde(default = "ten")]
    pub max_on_s: Seconds,
    /// Seconds until it is given up.
    #[serde(default = "twenty")]
    pub timeout_s: Seconds,
}

/// A device behind two programs.
#[derive(Clone, Debug)]
pub struct CommandSwitch {
    /// What it is, for errors.
    pub device: String,
    /// Switches it on.
    pub on: Vec<String>,
    /// Switches it off.
    pub off: Vec<String>,
    /// Until it is given up.
    pub timeout: Duration,
}

impl Switch for CommandSwitch {
    fn switch(&mut self, is_on: bool) -> Result<(), RigError> {
        run(&self.device, if is_on { &self.on } else { &self.off }, self.timeout).map(drop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &[&str]) -> Vec<String> {
        text.iter().map(|&word| word.to_owned()).collect()
    }

    #[test]
    fn gives_what_the_program_prints() {
        let mut camera = CommandCamera {
            command: words(&["sh", "-c", "printf '\\377\\330x'"]),
            timeout_s: Seconds::new(5.0),
            retries: 0,
        };
        assert_eq!(camera.photograph().unwrap().bytes, [0xff, 0xd8, b'x']);
    }

    #[test]
    fn a_camera_that_fails_twice_is_asked_again() {
        let folder = tempfile::tempdir().unwrap();
        let count = folder.path().join("count");
        let script = format!("echo x >> {0}; test $(wc -l < {0}) -ge 3 && echo photo", count.display());
        let mut camera = CommandCamera {
            command: words(&["sh", "-c", &script]),
            timeout_s: Seconds::new(5.0),
            retries: 2,
        };
        assert_eq!(camera.photograph().unwrap().bytes, b"photo\n");
    }

    #[test]
    fn each_state_of_the_lamps_is_a_program() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log");
        let say = |word: &str| words(&["sh", "-c", &format!("echo {word} >> {}", log.display())]);
        let mut lamps = CommandLamps {
            left: say("left"),
            right: say("right"),
            dark: say("dark"),
            timeout: Duration::from_secs(5),
        };
        for light in [Some(Light::RIGHT), None, Some(Light::LEFT)] {
            lamps.light(light).unwrap();
        }
        assert_eq!(std::fs::read_to_string(log).unwrap(), "right\ndark\nleft\n");
    }
}
