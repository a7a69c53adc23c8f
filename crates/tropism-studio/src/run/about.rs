//! What does not change in a run.

use std::path::Path;

use serde::Serialize;
use tropism::geometry::{Pixel, Point};
use tropism::obstacle::Obstacle;
use tropism_lab::RunConfig;
use tropism_lab::files::shell_word;

use super::resume_words;
use crate::error::Refusal;

/// What does not change in a run.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct AboutRun {
    name: String,
    is_virtual: bool,
    /// In words.
    controller: String,
    period_min: f64,
    max_steps: u32,
    targets: Vec<ShownPoint>,
    obstacles: Vec<Obstacle>,
    /// The line that the stem is to follow.
    line: Vec<ShownPoint>,
    /// Difference from a form at which it is reached, in cm.
    within: Option<f64>,
    end_height: Option<f64>,
    /// The best fitness that there can be.
    best: Option<f64>,
    /// Unit of the fitness.
    unit: &'static str,
    lamps: Vec<ShownLamp>,
    /// Columns of a photograph.
    width: Option<usize>,
    /// Rows of a photograph.
    height: Option<usize>,
    px_per_cm: Option<f64>,
    /// Where the stem leaves the soil, in pixels.
    base: Option<[f64; 2]>,
    /// Column, row, columns and rows of what vision looks at.
    crop: Option<[usize; 4]>,
    commands: RunCommands,
    seed: u64,
}

/// A point in cm, and in the photograph.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct ShownPoint {
    x: f64,
    y: f64,
    px: Option<[f64; 2]>,
}

/// A lamp of a run.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct ShownLamp {
    name: String,
    /// -1 on the left, 1 on the right, else 0.
    side: f64,
}

/// What a person types to do with a run what the page does.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct RunCommands {
    status: String,
    stop: String,
    safe_state: String,
    resume: String,
}

/// What does not change in the run `name` in `folder`, which lies `at` below the folder of the studio.
pub(crate) fn about(folder: &Path, at: &str, name: String) -> Result<AboutRun, Refusal> {
    let config = RunConfig::follow(folder)?;
    let calibration = config.calibration();
    let pair = |pixel: Pixel| [pixel.x, pixel.y];
    let pixel = |point: &Point| calibration.map(|calibration| pair(calibration.pixel(*point)));
    let shown = |point: &Point| ShownPoint { x: point.x, y: point.y, px: pixel(point) };
    let crop = config.rig.vision.crop.or_else(|| config.rig.greenhouse.as_ref().map(|tent| tent.crop()));
    let word = shell_word(Path::new(if at.is_empty() { "." } else { at }));
    let lamps = config.rig.layout().map_or_else(
        |_| Vec::new(),
        |layout| {
            let lamp =
                |light| ShownLamp { name: layout.name(Some(light)).to_owned(), side: layout.side(light) };
            layout.lights().map(lamp).collect()
        },
    );
    Ok(AboutRun {
        name,
        is_virtual: config.is_virtual(),
        controller: config.controller_description(),
        period_min: config.rig.period_min,
        max_steps: config.task.max_steps,
        targets: config.task.targets.iter().map(shown).collect(),
        line: config.task.line.iter().map(shown).collect(),
        within: config.task.has_form().then_some(config.task.within_cm),
        end_height: Some(config.task.end_height_cm).filter(|height| height.is_finite()),
        best: config.task.best_fitness().filter(|_| config.task.has_goal()),
        unit: config.task.kind.unit(),
        obstacles: config.task.obstacles,
        lamps,
        width: calibration.map(|calibration| calibration.width),
        height: calibration.map(|calibration| calibration.height),
        px_per_cm: calibration.map(|calibration| calibration.px_per_cm),
        base: calibration.map(|calibration| pair(calibration.base)),
        crop: crop.map(|crop| [crop.x, crop.y, crop.width, crop.height]),
        commands: RunCommands {
            status: format!("tropism status {word}"),
            stop: format!("tropism stop {word}"),
            safe_state: format!("tropism safe-state {word}"),
            resume: crate::jobs::line(&resume_words(folder, at)),
        },
        seed: config.seed,
    })
}
