//! Tracks from photographs: tip and stem of one or several plants, in centimetres.
//!
//! In: photographs in any folder, and how pixels become centimetres ([`TrackPlan`]). Out: a track a plant as CSV, beside it
//! a JSON file with calibration, settings and counts, and a journal with the detections of each photograph.
//!
//! The one idea: detection needs one photograph, gating needs them in order. Detection runs on all threads and goes into
//! the `journal`; gating reads the detections in order. A resumed plan reads the journal and gates again, so it ends
//! with the same bytes.

mod columns;
mod series;
mod clicks;
mod plants;
mod overlays;
mod light;
mod journal;
mod table;
mod follow;
mod warning;
mod phantom;
mod provenance;
mod plan;
mod locate;
mod direction;
mod pipeline;
mod results;
mod guide;

pub use clicks::{PlantClick, PlantClicks};
pub use columns::point_at;
pub use guide::{GuidePlan, GuideResults};
pub use light::LightSource;
pub use plan::TrackPlan;
pub use plants::{PlantPlan, TrackScale, numbered_plants, read_plants};
pub use provenance::is_virtual;
pub use results::{PlantTrack, TrackResults, TrackSettings};
pub use series::{SeriesSummary, TimeSource};
pub use table::{CameraMotion, TrackCounts};
pub use warning::{TrackWarning, WarningKind, warnings_of};

use tropism::geometry::Region;

use self::locate::Located;
use self::pipeline::Pipeline;
use self::plan::check_minutes;
use self::plants::{check_plants, place};
use self::series::Series;
use crate::{Error, Monitor, Workflow, files};

impl Workflow for TrackPlan {
    type Results = TrackResults;

    const SCHEMA: &'static str = plan::SCHEMA;

    fn check(&self) -> Result<(), Error> {
        check_plants(&self.plants)?;
        self.scale.check()?;
        check_minutes("period_min", self.period_min)?;
        check_minutes("default_period_min", Some(self.default_period_min))?;
        if self.out.extension().is_some_and(|extension| extension == "json" || extension == "jsonl") {
            return Err(Error::Plan(format!(
                "`out` {}: this is the name of the file beside the track: choose one that ends in .csv",
                self.out.display()
            )));
        }
        self.check_free()?;
        self.check_inputs()
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<TrackResults, Error> {
        let found = files::list_photographs(&self.photographs)?;
        found.notes.iter().for_each(|note| monitor.note(note));
        let series = Series::read(&found.files, self.time, self.period_min, self.default_period_min)?;
        series.notes.iter().for_each(|note| monitor.note(note));
        match self.located(&series.frames, monitor) {
            Located::Plant(plan) => plan.track(&series, true, Vec::new(), monitor),
            Located::Nowhere { movers } => {
                self.turned(&series.frames, monitor).track(&series, false, movers, monitor)
            }
        }
    }
}

impl TrackPlan {
    /// Tracks the photographs of a series. `is_located` says whether region and root were found by the plant's motion, and
    /// `movers` where several things move of which one may be the plant.
    fn track(
        &self,
        series: &Series,
        is_located: bool,
        movers: Vec<Region>,
        monitor: &dyn Monitor,
    ) -> Result<TrackResults, Error> {
        let mut plants = place(&self.plants, &self.scale, &self.vision, &series.frames)?;
        for plant in &mut plants {
            (plant.is_located, plant.movers) = (is_located, movers.clone());
        }
        let lights = self.light.read(&series.frames)?;
        if let Some(sheet) = &self.sheet {
            files::make_folder_of(sheet)?;
        }
        if let Some(folder) = &self.overlay {
            files::make_folder(folder)?;
        }
        let settings = TrackSettings::new(self, &plants);
        let clicked = follow::follow(&self.plants, &plants, series, monitor)?;
        let mut pipeline = Pipeline::new(self, series, &plants, clicked, lights, &settings)?;
        pipeline.run(monitor)?;
        pipeline.finish(settings)
    }
}
