//! The list of drivers: a table of a rig file names one of them with `driver`.
//!
//! A new driver of a camera, lamp or flash is a module of its own and, here, its word in `drivers!`.

use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use tropism::rig::{Flash, RigError};

use crate::alert::{CommandAlert, Heartbeat, MqttAlert, Post, Settings};
use crate::broker::Broker;
use crate::command::{CommandCamera, CommandFlash, CommandLamp};
use crate::folder::FolderCamera;
use crate::gpio::{GpioFlash, GpioLamp};
use crate::http::HttpCamera;
use crate::leds::LedsLamp;
use crate::mqtt::{MqttFlash, MqttLamp};
use crate::replay::ReplayCamera;
use crate::rpicam::RpicamCamera;
use crate::seconds::Seconds;
use crate::settings::{CameraSettings, FlashSettings, LampSettings};
use crate::switch::BoundedFlash;
use crate::v4l2::V4l2Camera;
use crate::wled::WledLamp;
use crate::ws2812::Ws2812Lamp;

/// Declares an enum of settings, each of which is a table with the key `driver`.
///
/// What serde derives for a tagged enum buffers the table first, and an error then has no line. Here, a `driver` that
/// comes first selects the type before the rest is read. With a trait after its name the enum gives the settings as that.
macro_rules! drivers {
    (
        $(#[$about:meta])*
        $name:ident: $settings_of:ident { $($(#[$doc:meta])* $word:literal => $variant:ident($settings:ty),)+ }
    ) => {
        drivers! { $(#[$about])* $name { $($(#[$doc])* $word => $variant($settings),)+ } }

        impl $name {
            /// The settings of whichever driver it is.
            #[must_use]
            pub fn settings(&self) -> &dyn $settings_of {
                match self { $(Self::$variant(settings) => settings,)+ }
            }

            /// The settings, to change them.
            pub fn settings_mut(&mut self) -> &mut dyn $settings_of {
                match self { $(Self::$variant(settings) => settings,)+ }
            }
        }
    };
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
    CameraDriver: CameraSettings {
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
    /// Seconds that one try may take, and the largest number of tries.
    #[must_use]
    pub fn longest_s(&self) -> (f64, u32) {
        let retries = self.clone().settings_mut().retries().map_or(0, |retries| *retries);
        (self.settings().timeout_s(), 1 + retries)
    }

    /// The same camera that gives up after one try.
    #[must_use]
    pub fn without_retries(&self) -> Self {
        let mut camera = self.clone();
        if let Some(retries) = camera.settings_mut().retries() {
            *retries = 0;
        }
        camera
    }
}

drivers! {
    /// Driver of one lamp.
    LampDriver: LampSettings {
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

drivers! {
    /// Driver of the flash.
    FlashDriver: FlashSettings {
        /// Two programs.
        "command" => Command(CommandFlash),
        /// A plug or relay behind a broker.
        "mqtt" => Mqtt(MqttFlash),
        /// A relay on a GPIO line.
        "gpio" => Gpio(GpioFlash),
    }
}

impl FlashDriver {
    /// Seconds that one command may take, and for which it settles.
    #[must_use]
    pub fn longest_s(&self) -> f64 {
        let [settle_s, _] = self.settings().times();
        self.settings().timeout_s() + f64::from(settle_s)
    }

    /// Longest time for which it is lit, in seconds.
    #[must_use]
    pub fn max_on_s(&self) -> f64 {
        self.settings().times()[1].into()
    }

    /// Opens the flash and switches it off. `broker` is the rig's, if it has one.
    ///
    /// # Errors
    /// [`RigError::Device`] if it cannot be found or switched off.
    pub fn open(&self, broker: Option<&Broker>) -> Result<Box<dyn Flash>, RigError> {
        let [settle, max_on] = self.settings().times().map(Seconds::duration);
        Ok(Box::new(BoundedFlash::new(self.settings().open(broker)?, settle, max_on)?))
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
