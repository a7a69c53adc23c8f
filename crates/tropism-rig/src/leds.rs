//! A strip on the PIO of a Raspberry Pi 5: `dtoverlay=ws2812-pio` makes it the device `/dev/leds0`.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::math;
use tropism::rig::RigError;

use crate::broker::Broker;
use crate::pixels::{Pixel, PixelLamp, Wire};
use crate::settings::{LampSettings, Outlet};
use crate::strip::Strip;
use crate::switch::Switch;

/// A lamp on a LED device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct LedsLamp {
    /// The device file.
    #[serde(default = "leds0")]
    pub device: PathBuf,
    /// The lamp's pixels.
    pub strip: Strip,
}

fn leds0() -> PathBuf {
    PathBuf::from("/dev/leds0")
}

/// Gamma of the kernel's driver, as an exponent that fits its output at 128 of 255 (21 % of full light).
///
/// Its table is not followed exactly; 255 is full light in both.
const GAMMA: f64 = 2.26;

impl LampSettings for LedsLamp {
    fn check(&self, _period_min: f64) -> Result<(), String> {
        self.strip.check()
    }

    fn outlet(&self) -> Outlet {
        let device = format!("leds {}", self.device.display());
        Outlet::Pixels { device, segment: None, strip: self.strip }
    }

    fn dims(&self) -> bool {
        true
    }

    fn open(&self, device: &str, _broker: Option<&Broker>) -> Result<Box<dyn Switch>, RigError> {
        let path = self.device.clone();
        let wire = || {
            // Fail at opening, not at the first command.
            OpenOptions::new()
                .write(true)
                .open(&path)
                .map_err(|error| format!("cannot be opened: {error}"))?;
            Ok(Box::new(Leds { device: path.clone() }) as Box<dyn Wire>)
        };
        Ok(Box::new(PixelLamp::open(device, &self.device, self.strip, wire)?))
    }
}

/// Four bytes for each pixel: red, green, blue, white. The driver reorders them and applies gamma, which is inverted here so
/// that values are linear.
fn encode(frame: &[Pixel]) -> Vec<u8> {
    let bend = |linear: f64| (255.0 * math::pow(linear / 255.0, 1.0 / GAMMA)).round() as u8;
    frame.iter().flat_map(|&[red, green, blue]| [bend(red), bend(green), bend(blue), 0]).collect()
}

struct Leds {
    device: PathBuf,
}

impl Wire for Leds {
    /// One write at offset 0: a second write would be another frame.
    fn send(&mut self, frame: &[Pixel]) -> Result<(), String> {
        let bytes = encode(frame);
        let mut file =
            OpenOptions::new().write(true).open(&self.device).map_err(|error| error.to_string())?;
        match file.write(&bytes) {
            Ok(written) if written == bytes.len() => Ok(()),
            Ok(written) => {
                Err(format!("found {written} bytes taken, wanted {}: num_leds is too small", bytes.len()))
            }
            Err(error) => Err(format!("cannot write {} bytes: {error}", bytes.len())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes() {
        assert_eq!(encode(&[[255.0, 0.0, 255.0], [0.0; 3]]), [255, 0, 255, 0, 0, 0, 0, 0]);
        // A fifth of the light is what the kernel makes of 128, near enough.
        assert_eq!(encode(&[[0.2117 * 255.0, 127.5, 1.0]])[..3], [128, 188, 22]);
    }

    #[test]
    fn a_frame_is_written_whole_from_the_start_of_the_device() {
        let folder = tempfile::tempdir().unwrap();
        let device = folder.path().join("leds0");
        let text = format!("device = {device:?}\nstrip = {{ pixels = 2, duty = 1.0, color = [255, 0, 0] }}");
        let settings: LedsLamp = toml::from_str(&text).unwrap();
        let error = settings.open("lamp", None).err().unwrap().to_string();
        assert!(error.contains("leds0): cannot be opened"), "{error}");
        std::fs::write(&device, [7; 8]).unwrap();
        let mut lamp = settings.open("lamp", None).unwrap();
        for _ in 0..2 {
            lamp.switch(true).unwrap();
            assert_eq!(std::fs::read(&device).unwrap(), [255, 0, 0, 0, 255, 0, 0, 0]);
        }
        lamp.switch(false).unwrap();
        assert_eq!(std::fs::read(&device).unwrap(), [0; 8]);
    }
}
