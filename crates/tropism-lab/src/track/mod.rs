//! Tracks from photographs: tip and stem of one or several plants, in centimetres.
//!
//! In: photographs in any folder, and how pixels become centimetres ([`TrackPlan`]). Out: a track a plant as CSV, beside it
//! a JSON file with calibration, settings and counts, and a journal with the detections of each photograph.
//!
//! The one idea: detection needs one photograph, gating needs them in order. Detection runs on all threads and goes into
//! the [`journal`]; gating reads the detections in order. A resumed plan reads the journal and gates again, so it ends
//! with the same bytes.

mod columns;
mod series;
mod plants;
mod overlays;
mod light;
mod journal;
mod table;
mod provenance;
mod results;
mod plan;
mod pipeline;
mod guide;

pub use columns::{point_at, stem_at};
pub use guide::{GuidePlan, GuideResults};
pub use light::LightSource;
pub use plan::TrackPlan;
pub use plants::{PlantPlan, TrackScale, numbered_plants, read_plants};
pub use provenance::is_virtual;
pub use results::{PlantTrack, TrackResults, TrackSettings};
pub use series::{SeriesSummary, TimeSource};
pub use table::{CameraMotion, TrackCounts};
