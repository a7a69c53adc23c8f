//! Rig files and the drivers of a real tent.
//!
//! A rig file (TOML) describes a tent: the virtual one, or a camera, 2 to 16 lamps and a flash with their drivers.
//! [`RigFile`](file::RigFile) reads and checks it, and opens it as a [`Rig`](tropism::rig::Rig).
//!
//! # Drivers
//!
//! A driver is a struct of settings, the table of a rig file that names it with `driver`. Opening it gives a device:
//!
//! | table | device | drivers |
//! |---|---|---|
//! | `[camera]` | [`Camera`](tropism::rig::Camera) | [`rpicam`], [`v4l2`], [`http`], [`mod@folder`], [`replay`], [`command`] |
//! | `[lamps.NAME]` | [`Switch`](switch::Switch) | [`wled`], [`leds`], [`ws2812`], [`mqtt`], [`gpio`], [`command`] |
//! | `[flash]` | [`Switch`](switch::Switch) | [`mqtt`], [`gpio`], [`command`] |
//! | `[[alert]]` | channel of [`alert`] | ntfy, webhook, MQTT, command, heartbeat |
//!
//! Lamps with drivers stand behind one [`Interlock`](switch::Interlock), which lights at most one of them. Where a program
//! switches all lamps, that program keeps two from being lit. The flash stands behind a
//! [`BoundedFlash`](switch::BoundedFlash), which limits its time. [`command`] runs programs of the user, which reach any
//! hardware that a command line reaches. [`clock`] keeps the period of the steps, [`host`] watches the computer, [`probe`]
//! checks a broker, and [`shutdown`] switches off what a killed program left lit.
//!
//! # A camera of one's own
//!
//! Without changing this crate: a program that writes a photograph to stdout, with `driver = "command"`. In Rust:
//! implement [`Camera`](tropism::rig::Camera), and build the [`Rig`](tropism::rig::Rig) from it.
//!
//! ```
//! use std::time::Duration;
//!
//! use tropism::photo::Photo;
//! use tropism::rig::{Camera, NoFlash, Rig, RigError};
//! use tropism::vision::{Calibration, TipTracker};
//! use tropism_rig::clock::TentClock;
//! use tropism_rig::file::LampsTable;
//!
//! /// A camera whose latest picture lies in a file.
//! struct FileCamera;
//!
//! impl Camera for FileCamera {
//!     fn photograph(&mut self) -> Result<Photo, RigError> {
//!         let bytes = std::fs::read("/run/camera/latest.jpg").map_err(|error| RigError::Device {
//!             device: "camera (/run/camera/latest.jpg)".to_owned(),
//!             problem: format!("cannot read: {error}"),
//!         })?;
//!         Ok(Photo { name: String::new(), bytes, time_s: 0.0 })
//!     }
//! }
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let lamps: LampsTable = toml::from_str(
//!     r#"left = ["true", "left"]
//!        right = ["true", "right"]
//!        dark = ["true", "dark"]"#,
//! )?;
//! let calibration: Calibration =
//!     toml::from_str("px_per_cm = 35.0\nwidth = 2592\nheight = 1944\nbase = { x = 1296.0, y = 1700.0 }")?;
//! let tracker = TipTracker::new(calibration, Default::default())?;
//! let clock = TentClock::new(Duration::ZERO);
//! let mut rig = Rig::new(FileCamera, lamps.open(None)?, NoFlash, clock, tracker, Duration::from_secs(300))
//!     .with_layout(lamps.layout()?);
//! rig.light(lamps.layout()?.parse("left")?)?;
//! # Ok(())
//! # }
//! ```
//!
//! To name the camera in rig files: a module above [`driver`] with its settings, a table with serde that
//! implements [`CameraSettings`](settings::CameraSettings), and `impl Camera`; then its word in [`driver::CameraDriver`].
//!
//! Not tested on a physical camera, lamp or relay.

pub mod secret;
pub mod clock;
pub mod seconds;
mod whole;
mod picture;
mod retry;
pub mod switch;
mod device;
pub mod strip;
pub mod broker;
pub mod settings;
pub mod http;
pub mod mqtt;
pub mod node;
mod node_camera;
pub mod wall_watch;
mod child;
pub mod alert;
pub mod command;
pub mod folder;
pub mod gpio;
mod pixels;
pub mod leds;
pub mod replay;
pub mod rpicam;
pub mod v4l2;
pub mod wled;
pub mod ws2812;
pub mod driver;
pub mod file;
pub mod host;
pub mod probe;
pub mod shutdown;

#[cfg(test)]
mod testing;

pub use device::DeviceLock;
use tropism::rig::RigError;
use tropism::text::plain;

/// The error `problem` of `device`, without the secrets of addresses and the controls of what programs and devices said.
fn failed(device: impl Into<String>, problem: impl Into<String>) -> RigError {
    let shown = |text: String| plain(&secret::redacted_text(&text)).into_owned();
    RigError::Device { device: shown(device.into()), problem: shown(problem.into()) }
}
