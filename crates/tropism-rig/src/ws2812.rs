//! A WS2812 strip on the data line of an SPI bus: the bus draws the strip's pulses.
//!
//! Four bits of the bus are one of the strip, `1000` for 0 and `1110` for 1. At 3.2 MHz that is high for 312 or 937 ns;
//! every byte ends low, so a gap between bytes only lengthens a low, which the strip does not mind.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::rig::RigError;

use crate::broker::Broker;
#[cfg(any(test, target_os = "linux"))]
use crate::pixels::Pixel;
#[cfg(target_os = "linux")]
use crate::pixels::{PixelLamp, Wire};
use crate::settings::{LampSettings, Outlet};
use crate::strip::Strip;
use crate::switch::Switch;

/// A lamp on an SPI bus.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Ws2812Lamp {
    /// The device file: `/dev/spidev0.0` has its data on GPIO 10.
    #[serde(default = "spidev")]
    pub device: PathBuf,
    /// The lamp's pixels.
    pub strip: Strip,
}

fn spidev() -> PathBuf {
    PathBuf::from("/dev/spidev0.0")
}

/// Clock of the bus, in bits per second: four bits for each bit of a pixel.
#[cfg(target_os = "linux")]
const HZ: u32 = 3_200_000;

/// Zero bytes before and after the pixels: 350 µs low, which latches the frame and separates it from the idle level.
const QUIET: usize = 140;

/// Largest transfer of spidev unless `spidev.bufsiz` of the kernel's command line is larger.
const BUFSIZ: usize = 4096;

/// The bytes of a frame on the bus: green, red, blue, highest bit first.
#[cfg(any(test, target_os = "linux"))]
fn encode(frame: &[Pixel]) -> Vec<u8> {
    let mut bytes = vec![0; QUIET];
    for &[red, green, blue] in frame {
        for channel in [green, red, blue] {
            let channel = channel.round() as u8;
            for pair in (0..4).rev() {
                let nibble = |bit: u8| if channel >> bit & 1 == 1 { 0b1110 } else { 0b1000 };
                bytes.push(nibble(2 * pair + 1) << 4 | nibble(2 * pair));
            }
        }
    }
    bytes.resize(bytes.len() + QUIET, 0);
    bytes
}

impl LampSettings for Ws2812Lamp {
    /// The frame is sent in one transfer: the strip would latch in the pause between two.
    fn check(&self, _period_min: f64) -> Result<(), String> {
        self.strip.check()?;
        let (bytes, most) = (2 * QUIET + 12 * usize::from(self.strip.stop()), bufsiz());
        if bytes > most {
            return Err(format!(
                "found a frame of {bytes} bytes for {} pixels, wanted at most {most}: add spidev.bufsiz=32768 to the \
                 kernel's command line",
                self.strip.stop()
            ));
        }
        Ok(())
    }

    fn outlet(&self) -> Outlet {
        let device = format!("spi {}", self.device.display());
        Outlet::Pixels { device, segment: None, strip: self.strip }
    }

    fn dims(&self) -> bool {
        true
    }

    #[cfg(target_os = "linux")]
    fn open(&self, device: &str, _broker: Option<&Broker>) -> Result<Box<dyn Switch>, RigError> {
        use spidev::{SpiModeFlags, Spidev, SpidevOptions};

        let wire = || {
            let mut bus = Spidev::open(&self.device).map_err(|error| format!("cannot be opened: {error}"))?;
            let options =
                SpidevOptions::new().bits_per_word(8).max_speed_hz(HZ).mode(SpiModeFlags::SPI_MODE_0).build();
            bus.configure(&options).map_err(|error| format!("cannot be set to {HZ} Hz: {error}"))?;
            Ok(Box::new(Bus(bus)) as Box<dyn Wire>)
        };
        Ok(Box::new(PixelLamp::open(device, &self.device, self.strip, wire)?))
    }

    /// SPI exists on Linux only.
    #[cfg(not(target_os = "linux"))]
    fn open(&self, device: &str, _broker: Option<&Broker>) -> Result<Box<dyn Switch>, RigError> {
        Err(crate::failed(device, "SPI needs Linux"))
    }
}

/// Largest transfer of the bus, in bytes.
fn bufsiz() -> usize {
    let said = std::fs::read_to_string("/sys/module/spidev/parameters/bufsiz");
    said.ok().and_then(|said| said.trim().parse().ok()).unwrap_or(BUFSIZ)
}

#[cfg(target_os = "linux")]
struct Bus(spidev::Spidev);

#[cfg(target_os = "linux")]
impl Wire for Bus {
    fn send(&mut self, frame: &[Pixel]) -> Result<(), String> {
        let bytes = encode(frame);
        let mut transfer = spidev::SpidevTransfer::write(&bytes);
        self.0.transfer(&mut transfer).map_err(|error| format!("cannot send {} bytes: {error}", bytes.len()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes() {
        let bytes = encode(&[[255.0, 0.0, 0b1010_0001 as f64]]);
        assert!(bytes[..QUIET].iter().chain(&bytes[QUIET + 12..]).all(|&byte| byte == 0));
        let (green, red, blue) = ([0x88; 4], [0xee; 4], [0xe8, 0xe8, 0x88, 0x8e]);
        assert_eq!(bytes[QUIET..QUIET + 12], [green, red, blue].concat());
    }

    #[test]
    fn the_papers_strips_fit_a_transfer_and_every_byte_ends_low() {
        assert_eq!(encode(&[[255.0; 3]; 144]).len(), 2008);
        assert_eq!(encode(&[[255.0; 3]; 288]).len(), 3736);
        assert!(encode(&[[77.0, 130.0, 255.0]; 9]).iter().all(|byte| byte & 1 == 0));
    }

    #[test]
    fn a_frame_that_does_not_fit_a_transfer_is_refused() {
        let lamp = |pixels: usize| {
            let text = format!("strip = {{ pixels = {pixels}, max_amps = 100 }}");
            toml::from_str::<Ws2812Lamp>(&text).unwrap()
        };
        let most = (bufsiz() - 2 * QUIET) / 12;
        assert_eq!(lamp(most).check(5.0), Ok(()));
        assert!(lamp(most + 1).check(5.0).unwrap_err().contains("spidev.bufsiz"));
    }

    #[test]
    fn a_bus_that_is_not_there_is_named() {
        let lamp: Ws2812Lamp =
            toml::from_str("device = \"/no/such/spidev\"\nstrip = { pixels = 2 }").unwrap();
        assert!(lamp.open("left lamp", None).err().unwrap().to_string().contains("/no/such/spidev"));
    }
}
