//! The plant of a plan that names neither region nor base: looked for by its motion, or taken from an earlier track.

use serde::Deserialize;
use tropism::geometry::{Pixel, Region};
use tropism::vision::location::{Location, locate};
use tropism::vision::{Calibration, Direction, VisionConfig};

use super::plan::TrackPlan;
use super::plants::{PlantPlan, TrackScale};
use super::series::Frame;
use crate::{Monitor, files};

impl TrackPlan {
    /// The plan with its plant where that moves, and in the direction in which it grows. It is looked for if the plan gives
    /// a single one neither region nor base, and no calibration; a plan that is resumed takes what was found before.
    pub(super) fn located(&self, frames: &[Frame], monitor: &dyn Monitor) -> Option<Self> {
        let [PlantPlan { name, region: None, base: None, clicks }] = self.plants.as_slice() else {
            return None;
        };
        let is_calibrated = matches!(self.scale, TrackScale::Calibration(_));
        if is_calibrated || self.each || !clicks.is_empty() || frames.len() < 2 {
            return None;
        }
        let plan = |region, base, up| {
            let plant = PlantPlan {
                name: name.clone(),
                region: Some(region),
                base: Some(base),
                clicks: clicks.clone(),
            };
            let vision = VisionConfig { up, ..self.vision.clone() };
            Self { plants: vec![plant], vision, ..self.clone() }
        };
        if let Some(before) = self.resume.then(|| self.tracked_before()).flatten() {
            let region = before.region.filter(|_| before.is_located)?;
            return Some(plan(region, before.base, before.up));
        }
        let read = |index: usize| {
            let frame = &frames[index];
            files::read_photo(&frame.path, frame.time_s).ok()?.decode().ok()
        };
        let known = [self.vision.up];
        let poses = if self.finds_up() { &Direction::ALL[..] } else { &known };
        match locate(frames.len(), read, &self.vision, poses) {
            Location::Plant { region, base, up } => Some(plan(region, base, up)),
            Location::Unsure(reason) => {
                monitor.note(&format!(
                    "no `region` is given and no plant is found by its motion: {reason}. The whole picture is searched; \
                     `guide` writes a page to click root and region on"
                ));
                None
            }
        }
    }

    /// Where the plant was when the plan was last carried out.
    fn tracked_before(&self) -> Option<LocatedBefore> {
        let text = files::read_text(&self.out.with_extension("json")).ok()?;
        let before: TrackedBefore = serde_json::from_str(&text).ok()?;
        let [plant] = <[_; 1]>::try_from(before.settings.plants).ok()?;
        Some(LocatedBefore {
            is_located: before.is_located,
            region: plant.region,
            base: plant.calibration.base,
            up: before.settings.vision.up,
        })
    }
}

/// Where a plant was, and whether that was found by its motion.
struct LocatedBefore {
    is_located: bool,
    region: Option<Region>,
    base: Pixel,
    up: Direction,
}

/// What is read of the JSON file beside a track.
#[derive(Deserialize)]
struct TrackedBefore {
    #[serde(default)]
    is_located: bool,
    settings: SettingsBefore,
}

#[derive(Deserialize)]
struct SettingsBefore {
    vision: VisionConfig,
    plants: Vec<PlantBefore>,
}

#[derive(Deserialize)]
struct PlantBefore {
    region: Option<Region>,
    calibration: Calibration,
}
