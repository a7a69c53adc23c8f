//! The plant of a plan that names neither region nor base: looked for by its motion, or taken from an earlier track.

use serde::Deserialize;
use tropism::geometry::{Pixel, Region};
use tropism::vision::location::{Location, locate};
use tropism::vision::{Calibration, Direction, VisionConfig};

use super::plan::TrackPlan;
use super::plants::{PlantPlan, TrackScale};
use super::series::Frame;
use crate::{Monitor, files};

/// Where the plant of a plan is.
pub(super) enum Located {
    /// The plan with region and base of its plant.
    Plant(Box<TrackPlan>),
    /// As the plan says, or anywhere in the picture.
    Nowhere {
        /// The things that move, where several do.
        movers: Vec<Region>,
    },
}

const NOWHERE: Located = Located::Nowhere { movers: Vec::new() };

impl TrackPlan {
    /// The plan with its plant where that moves, and in the direction in which it grows. It is looked for if the plan gives
    /// a single one neither region nor base, and no calibration; a plan that is resumed takes what was found before.
    pub(super) fn located(&self, frames: &[Frame], monitor: &dyn Monitor) -> Located {
        let [PlantPlan { name, region: None, base: None, clicks }] = self.plants.as_slice() else {
            return NOWHERE;
        };
        let is_calibrated = matches!(self.scale, TrackScale::Calibration(_));
        if is_calibrated || self.each || !clicks.is_empty() || frames.len() < 2 {
            return NOWHERE;
        }
        let plan = |region, base, up| {
            let plant = PlantPlan {
                name: name.clone(),
                region: Some(region),
                base: Some(base),
                clicks: clicks.clone(),
            };
            let vision = VisionConfig { up, ..self.vision.clone() };
            Located::Plant(Box::new(Self { plants: vec![plant], vision, ..self.clone() }))
        };
        let before = self.resume.then(|| self.tracked_before()).flatten();
        if let Some(LocatedBefore { is_located: true, region: Some(region), base, up }) = before {
            return plan(region, base, up);
        }
        let read = |index: usize| {
            let frame = &frames[index];
            files::read_photo(&frame.path, frame.time_s).ok()?.decode().ok()
        };
        let known = [self.vision.up];
        let poses = if self.finds_up() { &Direction::ALL[..] } else { &known };
        let (reason, movers) = match locate(frames.len(), read, &self.vision, poses) {
            Location::Plant { region, base, up } if before.is_none() => return plan(region, base, up),
            Location::Plant { .. } => return NOWHERE,
            Location::Several(movers) => {
                let places: Vec<String> = movers.iter().map(Region::to_string).collect();
                let (count, places) = (movers.len(), places.join(" and "));
                let reason = format!(
                    "{count} things in them move, at {places}: one plant is wanted, or a `region` for each"
                );
                (reason, movers)
            }
            Location::Unsure(reason) => (reason, Vec::new()),
        };
        monitor.note(&format!(
            "no `region` is given and no plant is found by its motion: {reason}. The whole picture is searched; \
             `guide` writes a page to click root and region on"
        ));
        Located::Nowhere { movers }
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
