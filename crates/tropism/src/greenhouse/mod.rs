//! The virtual tent: a stand-in for reality, for those who have no plant at hand.
//!
//! A mechanistic bean grows and bends in 3-D under two lamps and is photographed. It shares no code and no data with the
//! tip-motion model: what passes between them is photographs. Every result from it is virtual and must be labelled so.

pub mod view;
pub mod pose;
pub mod detector;
pub mod bean;
pub mod scene;
pub mod render;
pub mod fault;
pub mod tent;
