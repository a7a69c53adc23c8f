//! What to track: photographs, scale, plants, times, and where the results go.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::track::PAPER_PERIOD_MIN;
use tropism::vision::VisionConfig;

use super::light::LightSource;
use super::plants::{Plant, PlantPlan, TrackScale};
use super::series::TimeSource;
use crate::{Error, files};

/// Name and version of the JSON of plan and results.
pub(super) const SCHEMA: &str = "tropism.track/1";

/// Photographs to track, and how.
///
/// The default tracks one plant in the whole picture of the paper's camera, with photographs five minutes apart where no
/// times are known (section 2.2.1).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackPlan {
    /// Photographs (JPEG, PNG or TIFF), films, or folders of them.
    pub photographs: Vec<PathBuf>,
    /// CSV file of the track; with several plants `track.csv` becomes `track-NAME.csv`. Beside it are written the same name
    /// with `.json` and, one for all plants, with `.frames.jsonl`.
    pub out: PathBuf,
    /// How pixels become centimetres.
    pub scale: TrackScale,
    /// The plants to track.
    pub plants: Vec<PlantPlan>,
    /// What says which lamp is lit.
    pub light: LightSource,
    /// What says when a photograph was taken.
    pub time: TimeSource,
    /// Minutes from one step to the next; `None` takes the median interval of the photographs.
    pub period_min: Option<f64>,
    /// Minutes from one step to the next where `period_min` is `None` and no times are known.
    pub default_period_min: f64,
    /// How plants are detected. The crop of a plant is its region.
    pub vision: VisionConfig,
    /// Whether the direction in which the only plant grows is found, where `vision` says up: by its motion, or by its stem in
    /// the first photographs if its region or its root is given.
    pub find_up: bool,
    /// Whether the photographs have nothing to do with each other, such as a folder of many plants: none is compared with
    /// another, and each plant that is detected is accepted. So is the only photograph of a series.
    pub each: bool,
    /// Folder for a copy of each photograph with the detections drawn in.
    pub overlay: Option<PathBuf>,
    /// JPEG file for a contact sheet of up to 24 photographs with the detections drawn in.
    pub sheet: Option<PathBuf>,
    /// Whether to continue from the journal of the same plan, and take new photographs in.
    pub resume: bool,
    /// Whether to replace existing results.
    pub replace: bool,
}

impl Default for TrackPlan {
    fn default() -> Self {
        Self {
            photographs: Vec::new(),
            out: PathBuf::from("track.csv"),
            scale: TrackScale::default(),
            plants: vec![PlantPlan::default()],
            light: LightSource::default(),
            time: TimeSource::default(),
            period_min: None,
            default_period_min: PAPER_PERIOD_MIN,
            vision: VisionConfig::default(),
            find_up: false,
            each: false,
            overlay: None,
            sheet: None,
            resume: false,
            replace: false,
        }
    }
}

impl TrackPlan {
    /// The file of a plant's track: `track.csv`, or `track-NAME.csv` where there are several plants.
    pub(super) fn track_file(&self, plant: &Plant) -> PathBuf {
        self.track_file_of(plant.name.as_deref())
    }

    /// The journal of the photographs, one for all plants.
    pub(super) fn journal_file(&self) -> PathBuf {
        self.out.with_extension("frames.jsonl")
    }

    fn track_file_of(&self, name: Option<&str>) -> PathBuf {
        let Some(name) = name else { return self.out.clone() };
        let stem = self.out.file_stem().unwrap_or_default().to_string_lossy();
        let file = format!("{stem}-{name}");
        match self.out.extension() {
            Some(extension) => self.out.with_file_name(format!("{file}.{}", extension.to_string_lossy())),
            None => self.out.with_file_name(file),
        }
    }

    /// The files that are written, but for the overlays.
    #[must_use]
    pub fn outputs(&self) -> Vec<PathBuf> {
        let is_alone = self.plants.len() == 1;
        let names = self.plants.iter().map(|plant| Some(plant.name.as_str()).filter(|_| !is_alone));
        let tracks = names.map(|name| self.track_file_of(name));
        let tracks = tracks.flat_map(|track| [track.with_extension("json"), track]);
        tracks.chain([self.journal_file()]).chain(self.sheet.clone()).collect()
    }

    /// Checks that no photograph and no table of lights would be overwritten.
    pub(super) fn check_inputs(&self) -> Result<(), Error> {
        let overlays = self
            .overlay
            .iter()
            .flat_map(|folder| files::photographs(std::slice::from_ref(folder)).unwrap_or_default());
        let outputs: Vec<PathBuf> = self.outputs().into_iter().chain(overlays).collect();
        let light = match &self.light {
            LightSource::File(path) => Some(path.clone()),
            LightSource::Auto | LightSource::None => None,
        };
        // A folder that cannot be read is an error when it is read.
        let photographs = || files::photographs(&self.photographs).unwrap_or_default();
        files::check_outputs_with(&outputs, || photographs().into_iter().chain(light).collect())
    }

    /// Checks that no earlier results would be overwritten.
    pub(super) fn check_free(&self) -> Result<(), Error> {
        if self.resume || self.replace {
            return Ok(());
        }
        let results = self.outputs().into_iter();
        let overlays = self.overlay.iter().filter(|folder| files::photographs(&[(*folder).clone()]).is_ok());
        let Some(taken) = results.filter(|path| path.exists()).chain(overlays.cloned()).next() else {
            return Ok(());
        };
        Err(Error::Plan(format!(
            "{}: results are here already: choose a new name, go on with them by `resume`, or replace them by `replace`",
            taken.display()
        )))
    }
}

/// Checks that a period is one.
pub(super) fn check_minutes(key: &str, minutes: Option<f64>) -> Result<(), Error> {
    match minutes {
        Some(found) if !(found.is_finite() && found > 0.0) => {
            Err(Error::Plan(format!("found `{key}` {found}, wanted more than 0 minutes")))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_of_several_plants_has_a_file() {
        let plan = TrackPlan { out: "a/track.csv".into(), ..TrackPlan::default() };
        assert_eq!(plan.track_file_of(None), PathBuf::from("a/track.csv"));
        assert_eq!(plan.track_file_of(Some("left")), PathBuf::from("a/track-left.csv"));
    }
}
