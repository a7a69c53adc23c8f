//! A virtual bean in a virtual tent: a mechanistic plant under lamps before a camera, as a stand-in for a real one.
//!
//! The bean grows and bends in three dimensions ([`Bean`], many at once in [`Population`]) and is photographed
//! ([`render`], [`tent`]). It shares no code and no data with the models of plants, which see its photographs only. Results
//! from it are virtual and must be labelled so.
//!
//! Modules stand in the order of the data and use only those above them: a species draws an individual, the rod is its stem, noise
//! and age drive the rod, its pose is measured or drawn, faults spoil the photograph, and the tent is all of it as a rig.

pub mod view;
mod solid;
pub mod pose;
mod individual;
mod species;
mod internodal;
mod check;
mod rod;
mod noise;
mod bean;
mod population;
pub mod detector;
mod grow;
pub mod experiments;
pub mod acceptance;
pub mod calibrate;
mod reach;
pub mod scene;
pub mod render;
pub mod wall;
pub mod fault;
pub mod tent;

pub use bean::{Bean, EARLY_GROWTH};
pub use grow::{Specimen, Trial, grow, grow_noise_free, lamp_powers};
pub use individual::{
    Colours, Fluctuation, Growth, Individual, Leaves, Motility, Nutation, Pauses, Stem, Tropism,
};
pub use internodal::Internodal;
pub use noise::{Pause, ResponseState, response_history};
pub use population::Population;
pub use reach::Reach;
pub use solid::ContactPoint;
pub use species::{Species, Spread};
