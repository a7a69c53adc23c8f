//! The plant of a plan that names neither region nor base: looked for by its motion, or taken from an earlier track.

use serde::Deserialize;
use tropism::geometry::{Pixel, Region};
use tropism::vision::location::{Location, locate};
use tropism::vision::{Calibration, Direction};

use super::plan::TrackPlan;
use super::plants::{PlantPlan, TrackScale};
use super::series::Frame;
use crate::{Monitor, files};

impl TrackPlan {
    /// The plant where it moves. It is looked for if the plan gives a single one neither region nor base, and no
    /// calibration; a plan that is resumed takes what was found before.
    pub(super) fn located(&self, frames: &[Frame], monitor: &dyn Monitor) -> Option<PlantPlan> {
        let [PlantPlan { name, region: None, base: None }] = self.plants.as_slice() else { return None };
        let is_calibrated = matches!(self.scale, TrackScale::Calibration(_));
        if is_calibrated || self.each || self.vision.up != Direction::Up || frames.len() < 2 {
            return None;
        }
        let plant = |region, base| PlantPlan { name: name.clone(), region: Some(region), base: Some(base) };
        if let Some(before) = self.resume.then(|| self.tracked_before()).flatten() {
            let region = before.region.filter(|_| before.is_located)?;
            return Some(plant(region, before.base));
        }
        let read = |index: usize| {
            let frame = &frames[index];
            files::read_photo(&frame.path, frame.time_s).ok()?.decode().ok()
        };
        match locate(frames.len(), read, &self.vision) {
            Location::Plant { region, base } => Some(plant(region, base)),
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
        })
    }
}

/// Where a plant was, and whether that was found by its motion.
struct LocatedBefore {
    is_located: bool,
    region: Option<Region>,
    base: Pixel,
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
    plants: Vec<PlantBefore>,
}

#[derive(Deserialize)]
struct PlantBefore {
    region: Option<Region>,
    calibration: Calibration,
}
