//! What pages ask and show, without a disk: the studio answers from it over HTTP, and `tropism-wasm` within a browser.
//!
//! In: drawings, controllers and histories. Out: tasks, and what the scripts of the pages show, as JSON. All functions are pure.

mod drawing;
mod trial;
mod commands;
mod evolution;
mod champion;
mod wall;

pub use champion::{ShownChampion, ShownFigure, ShownPath, champion, figure};
pub use commands::{MODELS, Method, TRACKS, commands, model_of, rule_file};
pub use drawing::{Drawing, Form};
pub use evolution::{Curves, ShownGeneration, curves};
pub use trial::{Frame, MOST_STEPS, TriedBean, schedule_of, thinned, try_out};
pub use wall::{
    GrownBeforeWall, NodeState, ShownNode, ShownWall, WallPicture, WallRule, grow_before_wall, shown,
};

/// What a page asked for cannot be done: a sentence for people.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct PageError(String);

impl PageError {
    /// With its sentence.
    pub fn new(text: impl Into<String>) -> Self {
        Self(text.into())
    }
}

/// A number as it is sent to a page.
fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10.0_f64.powi(decimals);
    (scale * value).round() / scale
}
