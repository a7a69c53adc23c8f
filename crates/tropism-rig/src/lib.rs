//! Rig files and the drivers of a real tent.
//!
//! A rig file (TOML) says what stands in a tent: the virtual one, or cameras, lamps and a flash with their drivers. This
//! crate reads it ([`mod@file`]) and opens it as a [`Rig`](tropism::rig::Rig). Drivers: [`command`] runs programs of yours,
//! which reaches any hardware that a shell reaches; [`clock`] keeps the five minutes.
//!
//! None of this was checked on a physical camera, lamp or relay.

pub mod clock;
pub mod command;
pub mod file;
