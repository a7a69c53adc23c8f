//! A page on which a newcomer clicks base, scale and region, and copies the command that follows from them.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::geometry::Region;
use tropism::photo::Image;
use tropism::text::plural;
use tropism::track::PAPER_PERIOD_MIN;
use tropism::vision::raster::filter;
use tropism::vision::{TipTracker, VisionConfig, lamp_state};
use tropism_report::guide::{self, GuidePage, GuidePhotograph, GuidePlant};

use super::overlays::{Annotation, annotate};
use super::plan::check_minutes;
use super::plants::{Plant, PlantPlan, TrackScale, check_plants, place};
use super::series::{Frame, Series, SeriesSummary, TimeSource};
use crate::{Error, Monitor, Workflow, files};

/// Columns of a picture on the page, at most.
const COLUMNS: usize = 1_600;

/// Of the pictures on the page. Chosen by hand.
const JPEG_QUALITY: u8 = 82;

/// Photographs to make a guide of. Its fields mean the same as those of [`TrackPlan`](super::TrackPlan).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GuidePlan {
    /// Photographs (JPEG, PNG or TIFF), films, or folders of them.
    pub photographs: Vec<PathBuf>,
    /// HTML file of the page. An older guide there is replaced.
    pub page: PathBuf,
    /// How pixels become centimetres, as far as it is known.
    pub scale: TrackScale,
    /// The plants whose place is known: they are detected, and the detections are drawn in.
    pub plants: Vec<PlantPlan>,
    /// What says when a photograph was taken.
    pub time: TimeSource,
    /// Minutes from one step to the next; `None` takes the median interval of the photographs.
    pub period_min: Option<f64>,
    /// Minutes from one step to the next where `period_min` is `None` and no times are known.
    pub default_period_min: f64,
    /// How plants are detected.
    pub vision: VisionConfig,
}

/// A guide, and the photographs on it.
#[derive(Clone, Debug, Serialize)]
pub struct GuideResults {
    /// The file of the page.
    pub guide: PathBuf,
    /// Names of the photographs on the page.
    pub shown: Vec<String>,
    /// Order and times of the photographs.
    #[serde(skip)]
    pub series: SeriesSummary,
}

impl Default for GuidePlan {
    fn default() -> Self {
        Self {
            photographs: Vec::new(),
            page: PathBuf::from("guide.html"),
            scale: TrackScale::default(),
            plants: Vec::new(),
            time: TimeSource::default(),
            period_min: None,
            default_period_min: PAPER_PERIOD_MIN,
            vision: VisionConfig::default(),
        }
    }
}

impl Workflow for GuidePlan {
    type Results = GuideResults;

    const SCHEMA: &'static str = "tropism.guide/1";

    fn check(&self) -> Result<(), Error> {
        if !self.plants.is_empty() {
            check_plants(&self.plants)?;
        }
        self.scale.check()?;
        check_minutes("period_min", self.period_min)?;
        check_minutes("default_period_min", Some(self.default_period_min))?;
        let is_guide = || files::read_text(&self.page).is_ok_and(|text| guide::is_guide(&text));
        if self.page.exists() && !is_guide() {
            return Err(Error::Plan(format!(
                "{}: another file is here already: choose a new name for the page",
                self.page.display()
            )));
        }
        let photographs = || files::photographs(&self.photographs).unwrap_or_default();
        files::check_outputs_with(std::slice::from_ref(&self.page), photographs)
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<GuideResults, Error> {
        let found = files::list_photographs(&self.photographs)?;
        found.notes.iter().for_each(|note| monitor.note(note));
        let series = Series::read(&found.files, self.time, self.period_min, self.default_period_min)?;
        series.notes.iter().chain(&series.warnings).for_each(|note| monitor.note(note));
        let plants = match self.plants.as_slice() {
            [] => Vec::new(),
            plants => place(plants, &self.scale, &self.vision, &series.frames)?,
        };
        let ((width, height), photographs) = self.choose(&series.frames, &plants)?;
        let shown = photographs.iter().map(|photograph| photograph.name.clone()).collect();
        let page = GuidePage {
            paths: self.photographs.iter().map(|path| path.display().to_string()).collect(),
            width,
            height,
            plants: plants
                .iter()
                .map(|plant| GuidePlant { base: plant.calibration.base, region: plant.region })
                .collect(),
            px_per_cm: match self.scale {
                TrackScale::PxPerCm(px_per_cm) => Some(px_per_cm),
                TrackScale::PaperCamera | TrackScale::Calibration(_) => None,
            },
            photographs,
        };
        files::make_folder_of(&self.page)?;
        files::write(&self.page, page.to_html().as_bytes())?;
        Ok(GuideResults { guide: self.page.clone(), shown, series: series.summary() })
    }
}

impl GuidePlan {
    /// The size of the photographs, and the first, the middle and the last of them. In place of a damaged one comes the last
    /// whole one before it.
    fn choose(
        &self,
        frames: &[Frame],
        plants: &[Plant],
    ) -> Result<((usize, usize), Vec<GuidePhotograph>), Error> {
        let decode = |frame: &Frame| files::read_photo(&frame.path, frame.time_s).ok()?.decode().ok();
        let first = frames.iter().enumerate().find_map(|(index, frame)| Some((index, decode(frame)?)));
        let Some((first, image)) = first else {
            return Err(Error::Plan(format!(
                "{}: none of {} photographs is whole",
                frames[0].path.display(),
                plural(frames.len(), "file")
            )));
        };
        let size = (image.width, image.height);
        let mut wanted = vec![first, usize::midpoint(first, frames.len() - 1), frames.len() - 1];
        wanted.dedup();
        let mut photographs = vec![show(&frames[first], &self.draw(image, plants))?];
        for &wanted in &wanted[1..] {
            let whole = (first + 1..=wanted).rev().find_map(|index| Some((index, decode(&frames[index])?)));
            let Some((index, image)) = whole.filter(|(_, image)| (image.width, image.height) == size) else {
                continue;
            };
            if photographs.last().is_none_or(|last| last.name != frames[index].name) {
                photographs.push(show(&frames[index], &self.draw(image, plants))?);
            }
        }
        Ok((size, photographs))
    }

    /// The photograph with the detections of the known plants drawn in.
    fn draw(&self, image: Image, plants: &[Plant]) -> Image {
        let detect = |plant: &Plant| {
            let mut tracker = TipTracker::new(plant.calibration, plant.vision(&self.vision)).ok()?;
            let detected = tracker.detect(Ok(&image));
            Some((detected.clone().ok(), tracker.update_next(detected)))
        };
        let detections: Vec<_> = plants.iter().filter_map(detect).collect();
        let annotations: Vec<Annotation<'_>> = plants
            .iter()
            .zip(&detections)
            .map(|(plant, (detection, seen))| Annotation { plant, detection: detection.as_ref(), seen })
            .collect();
        annotate(&image, &annotations, lamp_state(&image, None))
    }
}

/// A photograph as the page shows it: shrunk by a whole number.
fn show(frame: &Frame, image: &Image) -> Result<GuidePhotograph, Error> {
    let whole = Region { x: 0, y: 0, width: image.width, height: image.height };
    let factor = image.width.div_ceil(COLUMNS).min(image.height);
    let small = filter::downscale(image, whole, factor);
    let jpeg = small.to_jpeg(JPEG_QUALITY).map_err(Error::at(frame.path.display()))?;
    Ok(GuidePhotograph { name: frame.name.clone(), factor, columns: small.width, rows: small.height, jpeg })
}
