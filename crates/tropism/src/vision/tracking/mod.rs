//! A plant from one photograph to the next.

pub mod hold;
mod kalman;
pub mod smoother;
pub(super) mod gating;
pub(super) mod background;
