//! What a driver states about its settings, the table of a rig file that names it.
//!
//! A driver is a module with its settings and one of these traits for them; and its word in [`driver`](crate::driver).

use tropism::rig::{Camera, RigError};

use crate::broker::Broker;
use crate::device;
use crate::seconds::Seconds;
use crate::strip::Strip;
use crate::switch::Switch;

/// Settings of a camera.
pub trait CameraSettings {
    /// Checks the settings.
    ///
    /// # Errors
    /// What was found, and what was wanted.
    fn check(&self) -> Result<(), String> {
        Ok(())
    }

    /// Opens the camera.
    ///
    /// # Errors
    /// [`RigError::Device`] if it cannot be found.
    fn open(&self) -> Result<Box<dyn Camera>, RigError>;

    /// Seconds that one try may take.
    fn timeout_s(&self) -> f64;

    /// The number of further tries after a failure, where it can be set.
    fn retries(&mut self) -> Option<&mut u32> {
        None
    }

    /// Whether it can discard old frames, by its key `discard_frames`.
    fn discards_frames(&self) -> bool {
        false
    }
}

/// Settings of a lamp.
pub trait LampSettings {
    /// Checks the settings, for so many minutes between commands.
    ///
    /// # Errors
    /// What was found, and what was wanted.
    fn check(&self, _period_min: f64) -> Result<(), String> {
        Ok(())
    }

    /// What it drives.
    fn outlet(&self) -> Outlet;

    /// Whether it has levels between dark and full power.
    fn dims(&self) -> bool;

    /// Opens the lamp. `device` is its name in errors, `broker` the rig's, if it has one.
    ///
    /// # Errors
    /// [`RigError::Device`] if it cannot be found.
    fn open(&self, device: &str, broker: Option<&Broker>) -> Result<Box<dyn Switch>, RigError>;

    /// Seconds that one command may take; 0 for hardware of this computer.
    fn timeout_s(&self) -> f64 {
        0.0
    }
}

/// Settings of a flash.
pub trait FlashSettings {
    /// Checks the settings.
    ///
    /// # Errors
    /// What was found, and what was wanted.
    fn check(&self) -> Result<(), String> {
        Ok(())
    }

    /// What it drives.
    fn outlet(&self) -> Outlet;

    /// Opens the switch of the flash. `broker` is the rig's, if it has one.
    ///
    /// # Errors
    /// [`RigError::Device`] if it cannot be found.
    fn open(&self, broker: Option<&Broker>) -> Result<Box<dyn Switch>, RigError>;

    /// Seconds that one command may take; 0 for hardware of this computer.
    fn timeout_s(&self) -> f64 {
        0.0
    }

    /// Time from switching on to the photograph, and the longest time for which it is on.
    fn times(&self) -> [Seconds; 2];
}

/// What a lamp or a flash drives: two of them must not drive the same.
#[derive(Clone, Debug, PartialEq)]
pub enum Outlet {
    /// Pixels.
    Pixels {
        /// Kind and address of the device.
        device: String,
        /// Number of the segment, on devices that have such.
        segment: Option<u8>,
        /// The pixels.
        strip: Strip,
    },
    /// A GPIO line.
    Line {
        /// Label of its chip, if it is given.
        chip: Option<String>,
        /// Its name or number.
        name: String,
    },
    /// A topic of the rig's broker, empty if the settings name none.
    Topic(String),
    /// Two programs.
    Programs {
        /// Switches on.
        on: Vec<String>,
        /// Switches off.
        off: Vec<String>,
    },
}

impl Outlet {
    /// Whether both may be the same pixels, line, topic or programs.
    #[must_use]
    pub fn overlaps(&self, other: &Self) -> bool {
        match (self, other) {
            (
                Self::Pixels { device, segment, strip },
                Self::Pixels { device: other, segment: second, strip: pixels },
            ) => {
                let is_one_segment = segment.is_some() && segment == second;
                device == other && (is_one_segment || strip.overlaps(pixels))
            }
            (Self::Line { chip, name }, Self::Line { chip: second, name: other }) => {
                name == other && chip.as_ref().zip(second.as_ref()).is_none_or(|(one, other)| one == other)
            }
            (Self::Topic(topic), Self::Topic(other)) => topic == other && !topic.is_empty(),
            (Self::Programs { on, .. }, Self::Programs { .. }) => self == other && !on.is_empty(),
            _ => false,
        }
    }

    /// It in one spelling, for its lock.
    pub(crate) fn identity(&self, broker: Option<&Broker>) -> String {
        match self {
            Self::Pixels { device, segment: Some(segment), .. } => format!("{device} segment {segment}"),
            Self::Pixels { device, segment: None, strip } => format!("{device} pixel {}", strip.first),
            Self::Line { name, .. } => format!("gpio {name}"),
            Self::Topic(topic) => {
                let (host, port) = broker.map_or(("", 0), |broker| (&broker.host, broker.port));
                format!("mqtt {}:{port} {topic}", device::host(host))
            }
            Self::Programs { on, .. } => device::command(on),
        }
    }
}
