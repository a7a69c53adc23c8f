//! The virtual tent: a mechanistic bean under lamps before a camera, as a stand-in for a real tent.
//!
//! The bean grows and bends in three dimensions and is photographed. It shares no code and no data with the tip-motion model,
//! which sees its photographs only. Results from it are virtual and must be labelled so.

pub mod view;
mod solid;
pub mod pose;
pub mod detector;
pub mod bean;
pub mod scene;
pub mod render;
pub mod fault;
pub mod tent;
