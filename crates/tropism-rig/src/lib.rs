//! Rig files and the drivers of a real tent.
//!
//! A rig file (TOML) says what stands in a tent: the virtual one, or cameras, lamps and a flash with their drivers. This
//! crate reads it ([`mod@file`]), finds the driver of each table ([`driver`]), and opens it as a
//! [`Rig`](tropism::rig::Rig). Two lamps of any drivers stand behind one interlock, and any flash behind a bound on its
//! time ([`switch`]). Cameras are [`rpicam`], [`v4l2`], [`http`], [`mod@folder`] and [`replay`]; lamps [`leds`], [`ws2812`],
//! [`wled`], [`mqtt`] and [`gpio`], of which the last two drive the flash as well; [`command`] runs programs of yours,
//! which reaches any hardware that a shell reaches. [`clock`] keeps the five minutes.
//!
//! None of this was checked on a physical camera, lamp or relay.

pub mod clock;
pub mod seconds;
mod picture;
pub mod http;
pub mod switch;
pub mod mqtt;
mod child;
pub mod alert;
pub mod command;
pub mod computer;
pub mod folder;
pub mod gpio;
pub mod strip;
mod pixels;
pub mod leds;
pub mod replay;
pub mod rpicam;
pub mod v4l2;
pub mod wled;
pub mod ws2812;
pub mod driver;
pub mod file;
pub mod probe;
pub mod safe;

#[cfg(test)]
mod testing;
mod tries;

use tropism::rig::RigError;

/// The error of a device.
fn failed(device: impl Into<String>, problem: impl Into<String>) -> RigError {
    RigError::Device { device: device.into(), problem: problem.into() }
}
