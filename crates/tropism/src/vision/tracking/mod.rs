//! Tracking of one plant from photograph to photograph.
//!
//! In: detections in the order of their times. Out: which of them are accepted, what is carried forward in place of the others,
//! and the smoothed path of the tip. The one idea: a plant moves steadily and little, so what a leaf, a fly or glare
//! does to a picture is implausible as soon as the pictures before it are known.

pub mod flow;
pub mod clicks;
pub mod hold;
mod kalman;
pub mod smoother;
pub(super) mod gating;
pub(super) mod background;
