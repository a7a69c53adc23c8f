//! The list of drivers: a table of a rig file names one of them with `driver`.
//!
//! A new driver is a module of its own and, here, its word in `drivers!` and an arm in each `match`, which the compiler
//! asks for.

use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use tropism::rig::{Camera, Flash, RigError};

use crate::alert::{CommandAlert, Heartbeat, MqttAlert, Post, Settings};
use crate::command::{CommandCamera, CommandFlash, CommandLamp, CommandSwitch};
use crate::device;
use crate::folder::FolderCamera;
use crate::gpio::{GpioFlash, GpioLamp};
use crate::http::HttpCamera;
use crate::leds::LedsLamp;
use crate::mqtt::{Broker, MqttFlash, MqttLamp};
use crate::replay::ReplayCamera;
use crate::rpicam::RpicamCamera;
use crate::switch::{BoundedFlash, Switch};
use crate::v4l2::V4l2Camera;
use crate::wled::WledLamp;
use crate::ws2812::Ws2812Lamp;

/// Declares an enum of settings, each of which is a table with the key `driver`.
///
/// What serde derives for a tagged enum buffers the table first, and an error then has no line. Here, a `driver` that
/// comes first selects the type before the rest is read.
macro_rules! drivers {
    ($(#[$about:meta])* $name:ident { $($(#[$doc:meta])* $word:literal => $variant:ident($settings:ty),)+ }) => {
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq, Serialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[serde(tag = "driver")]
        pub enum $name {
            $($(#[$doc])* #[serde(rename = $word)] $variant($settings),)+
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Table;

                impl<'de> Visitor<'de> for Table {
                    type Value = $name;

                    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                        f.write_str("a table with a driver")
                    }

                    fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<$name, M::Error> {
                        let mut table = toml::Table::new();
                        while let Some(key) = map.next_key::<String>()? {
                            if key == "driver" && table.is_empty() {
                                let word: String = map.next_value()?;
                                let rest = MapAccessDeserializer::new(map);
                                return match word.as_str() {
                                    $($word => <$settings>::deserialize(rest).map($name::$variant),)+
                                    _ => Err(unknown(&word, &[$($word),+])),
                                };
                            }
                            table.insert(key, map.next_value()?);
                        }
                        let word = match table.remove("driver") {
                            Some(word) => word.try_into().map_err(M::Error::custom)?,
                            // The first driver that existed: old files do not name it.
                            None => String::from("command"),
                        };
                        match word.as_str() {
                            $($word => table.try_into().map($name::$variant).map_err(|error| {
                                M::Error::custom(error.to_string().trim().replace('\n', " "))
                            }),)+
                            _ => Err(unknown(&word, &[$($word),+])),
                        }
                    }
                }

                deserializer.deserialize_map(Table)
            }
        }
    };
}

fn unknown<E: Error>(word: &str, words: &[&str]) -> E {
    E::custom(format!("found driver {word:?}, wanted one of {}", words.join(", ")))
}

drivers! {
    /// Driver of the camera.
    CameraDriver {
        /// A program that writes a photograph to stdout.
        "command" => Command(CommandCamera),
        /// A camera that answers over HTTP.
        "http" => Http(HttpCamera),
        /// The camera of a Raspberry Pi.
        "rpicam" => Rpicam(RpicamCamera),
        /// A USB camera.
        "v4l2" => V4l2(V4l2Camera),
        /// A folder that another program fills with photographs.
        "folder" => Folder(FolderCamera),
        /// The photographs of a recorded run.
        "replay" => Replay(ReplayCamera),
    }
}

impl CameraDriver {
    /// Checks the settings.
    ///
    /// # Errors
    /// What was found, and what was wanted.
    pub fn check(&self) -> Result<(), String> {
        match self {
            Self::Command(_) | Self::Folder(_) | Self::Replay(_) => Ok(()),
            Self::Http(camera) => camera.check(),
            Self::Rpicam(camera) => camera.check(),
            Self::V4l2(camera) => camera.check(),
        }
    }

    /// Opens the camera.
    ///
    /// # Errors
    /// [`RigError::Device`] if it cannot be found.
    pub fn open(&self) -> Result<Box<dyn Camera>, RigError> {
        Ok(match self {
            Self::Command(camera) => Box::new(camera.clone()),
            Self::Http(camera) => Box::new(camera.open()?),
            Self::Rpicam(camera) => Box::new(camera.open()?),
            Self::V4l2(camera) => Box::new(camera.clone()),
            Self::Folder(camera) => Box::new(camera.clone()),
            Self::Replay(camera) => Box::new(camera.open()?),
        })
    }

    /// Seconds that one try may take, and the largest number of tries.
    #[must_use]
    pub fn longest_s(&self) -> (f64, u32) {
        match self {
            Self::Command(camera) => (camera.timeout_s.into(), 1 + camera.retries),
            Self::Http(camera) => (camera.timeout_s.into(), 1 + camera.retries),
            Self::Rpicam(camera) => (camera.timeout_s.into(), 1 + camera.retries),
            Self::V4l2(camera) => (camera.timeout_s.into(), 1 + camera.retries),
            Self::Folder(camera) => (camera.timeout_s.into(), 1),
            Self::Replay(_) => (0.0, 1),
        }
    }

    /// The same camera that gives up after one try.
    #[must_use]
    pub fn without_retries(&self) -> Self {
        let mut camera = self.clone();
        match &mut camera {
            Self::Command(camera) => camera.retries = 0,
            Self::Http(camera) => camera.retries = 0,
            Self::Rpicam(camera) => camera.retries = 0,
            Self::V4l2(camera) => camera.retries = 0,
            Self::Folder(_) | Self::Replay(_) => {}
        }
        camera
    }

    /// Whether it can discard old frames, by its key `discard_frames`.
    #[must_use]
    pub const fn discards_frames(&self) -> bool {
        matches!(self, Self::Http(_) | Self::V4l2(_))
    }
}

drivers! {
    /// Driver of one lamp.
    LampDriver {
        /// Two programs.
        "command" => Command(CommandLamp),
        /// A segment of a WLED controller.
        "wled" => Wled(WledLamp),
        /// A plug or relay behind a broker.
        "mqtt" => Mqtt(MqttLamp),
        /// A relay on a GPIO line.
        "gpio" => Gpio(GpioLamp),
        /// A strip on the PIO of a Raspberry Pi 5.
        "leds" => Leds(LedsLamp),
        /// A strip on an SPI bus.
        "ws2812-spi" => Ws2812(Ws2812Lamp),
    }
}

impl LampDriver {
    /// Checks the settings, for `period_min` minutes between commands.
    ///
    /// # Errors
    /// What was found, and what was wanted.
    pub fn check(&self, period_min: f64) -> Result<(), String> {
        match self {
            Self::Command(_) => Ok(()),
            Self::Wled(lamp) => lamp.check(period_min),
            Self::Mqtt(lamp) => lamp.plug.check(),
            Self::Gpio(lamp) => lamp.line.check(),
            Self::Leds(lamp) => lamp.strip.check(),
            Self::Ws2812(lamp) => lamp.check(),
        }
    }

    /// Whether both drive the same pixels, line or plug.
    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Wled(a), Self::Wled(b)) => {
                device::address(&a.url) == device::address(&b.url)
                    && (a.segment == b.segment || a.strip.overlaps(&b.strip))
            }
            (Self::Leds(a), Self::Leds(b)) => a.device == b.device && a.strip.overlaps(&b.strip),
            (Self::Ws2812(a), Self::Ws2812(b)) => a.device == b.device && a.strip.overlaps(&b.strip),
            (Self::Gpio(a), Self::Gpio(b)) => a.line.is_same(&b.line),
            (Self::Mqtt(a), Self::Mqtt(b)) => a.plug.is_same(&b.plug),
            (Self::Command(a), Self::Command(b)) => a.on == b.on && a.off == b.off && !a.on.is_empty(),
            _ => false,
        }
    }

    /// Whether it has levels between dark and full power.
    pub(crate) fn dims(&self) -> bool {
        match self {
            Self::Command(lamp) => lamp.dims(),
            Self::Mqtt(lamp) => lamp.plug.dims,
            Self::Gpio(_) => false,
            Self::Wled(_) | Self::Leds(_) | Self::Ws2812(_) => true,
        }
    }

    /// What it drives, in one spelling, for its lock.
    pub(crate) fn identity(&self, broker: Option<&Broker>) -> String {
        match self {
            Self::Command(lamp) => device::command(&lamp.on),
            Self::Wled(lamp) => format!("wled {} segment {}", device::address(&lamp.url), lamp.segment),
            Self::Mqtt(lamp) => lamp.plug.identity(broker),
            Self::Gpio(lamp) => format!("gpio {}", lamp.line.name),
            Self::Leds(lamp) => format!("leds {} pixel {}", lamp.device.display(), lamp.strip.first),
            Self::Ws2812(lamp) => format!("spi {} pixel {}", lamp.device.display(), lamp.strip.first),
        }
    }

    /// Opens the lamp. `device` is its name in errors, `broker` the rig's, if it has one.
    ///
    /// # Errors
    /// [`RigError::Device`] if it cannot be found.
    pub fn open(&self, device: &str, broker: Option<&Broker>) -> Result<Box<dyn Switch>, RigError> {
        Ok(match self {
            Self::Command(CommandLamp { on, off, timeout_s }) => Box::new(CommandSwitch {
                device: device.to_owned(),
                on: on.clone(),
                off: off.clone(),
                timeout: timeout_s.duration(),
                on_timeout: timeout_s.duration(),
            }),
            Self::Wled(lamp) => Box::new(lamp.open(device)),
            Self::Mqtt(lamp) => Box::new(lamp.plug.open(device, broker)?),
            Self::Gpio(lamp) => lamp.line.open(device)?,
            Self::Leds(lamp) => lamp.open(device)?,
            Self::Ws2812(lamp) => lamp.open(device)?,
        })
    }

    /// Seconds that one command may take; 0 for hardware of this computer.
    #[must_use]
    pub fn longest_s(&self) -> f64 {
        match self {
            Self::Command(lamp) => lamp.timeout_s.into(),
            Self::Wled(lamp) => lamp.timeout_s.into(),
            Self::Mqtt(lamp) => lamp.plug.timeout_s.into(),
            Self::Gpio(_) | Self::Leds(_) | Self::Ws2812(_) => 0.0,
        }
    }
}

drivers! {
    /// Driver of the flash.
    FlashDriver {
        /// Two programs.
        "command" => Command(CommandFlash),
        /// A plug or relay behind a broker.
        "mqtt" => Mqtt(MqttFlash),
        /// A relay on a GPIO line.
        "gpio" => Gpio(GpioFlash),
    }
}

impl FlashDriver {
    /// Whether it drives the line, plug or programs of `lamp`.
    pub(crate) fn overlaps(&self, lamp: &LampDriver) -> bool {
        match (self, lamp) {
            (Self::Gpio(flash), LampDriver::Gpio(lamp)) => flash.line.is_same(&lamp.line),
            (Self::Mqtt(flash), LampDriver::Mqtt(lamp)) => flash.plug.is_same(&lamp.plug),
            (Self::Command(flash), LampDriver::Command(lamp)) => {
                flash.on == lamp.on && flash.off == lamp.off && !flash.on.is_empty()
            }
            _ => false,
        }
    }

    /// What it drives, in one spelling, for its lock.
    pub(crate) fn identity(&self, broker: Option<&Broker>) -> String {
        match self {
            Self::Command(flash) => device::command(&flash.on),
            Self::Mqtt(flash) => flash.plug.identity(broker),
            Self::Gpio(flash) => format!("gpio {}", flash.line.name),
        }
    }

    /// Checks the settings.
    ///
    /// # Errors
    /// What was found, and what was wanted.
    pub fn check(&self) -> Result<(), String> {
        match self {
            Self::Command(_) => Ok(()),
            Self::Mqtt(flash) => flash.plug.check(),
            Self::Gpio(flash) => flash.line.check(),
        }
    }

    /// Seconds that one command may take, and for which it settles.
    #[must_use]
    pub fn longest_s(&self) -> f64 {
        match self {
            Self::Command(flash) => f64::from(flash.timeout_s) + f64::from(flash.settle_s),
            Self::Mqtt(flash) => f64::from(flash.plug.timeout_s) + f64::from(flash.settle_s),
            Self::Gpio(flash) => flash.settle_s.into(),
        }
    }

    /// Opens the flash and switches it off. `broker` is the rig's, if it has one.
    ///
    /// # Errors
    /// [`RigError::Device`] if it cannot be found or switched off.
    pub fn open(&self, broker: Option<&Broker>) -> Result<Box<dyn Flash>, RigError> {
        let (switch, settle_s, max_on_s): (Box<dyn Switch>, _, _) = match self {
            Self::Command(CommandFlash { on, off, settle_s, max_on_s, timeout_s }) => {
                let switch = CommandSwitch {
                    device: "flash".to_owned(),
                    on: on.clone(),
                    off: off.clone(),
                    timeout: timeout_s.duration(),
                    // A program that hangs while the light is on already is killed, and the light switched off.
                    on_timeout: timeout_s.duration().min(max_on_s.duration()),
                };
                (Box::new(switch), settle_s, max_on_s)
            }
            Self::Gpio(GpioFlash { line, settle_s, max_on_s }) => (line.open("flash")?, settle_s, max_on_s),
            Self::Mqtt(MqttFlash { plug, settle_s, max_on_s }) => {
                let switch = plug.open("flash", broker)?.lit_within(max_on_s.duration());
                (Box::new(switch), settle_s, max_on_s)
            }
        };
        Ok(Box::new(BoundedFlash::new(switch, settle_s.duration(), max_on_s.duration())?))
    }
}

drivers! {
    /// Driver of an alert channel.
    AlertDriver {
        /// A program.
        "command" => Command(CommandAlert),
        /// An ntfy server.
        "ntfy" => Ntfy(Post),
        /// A POST of JSON.
        "webhook" => Webhook(Post),
        /// The rig's broker.
        "mqtt" => Mqtt(MqttAlert),
        /// A GET after each step: the receiver alarms when it stays out.
        "heartbeat" => Heartbeat(Heartbeat),
    }
}

impl AlertDriver {
    pub(crate) const fn settings(&self) -> Settings<'_> {
        match self {
            Self::Command(alert) => Settings::Command(alert),
            Self::Ntfy(alert) => Settings::Ntfy(alert),
            Self::Webhook(alert) => Settings::Webhook(alert),
            Self::Mqtt(alert) => Settings::Mqtt(alert),
            Self::Heartbeat(alert) => Settings::Heartbeat(alert),
        }
    }

    /// Checks the settings.
    ///
    /// # Errors
    /// What was found, and what was wanted.
    pub fn check(&self) -> Result<(), String> {
        self.settings().check()
    }

    /// The files that hold its secrets.
    pub fn secrets(&self) -> impl Iterator<Item = &std::path::Path> {
        let files = match self {
            Self::Ntfy(post) | Self::Webhook(post) => {
                [post.url_file.as_deref(), post.authorization_file.as_deref()]
            }
            Self::Heartbeat(alert) => [alert.url_file.as_deref(), None],
            Self::Command(_) | Self::Mqtt(_) => [None, None],
        };
        files.into_iter().flatten()
    }
}
