//! What a track plan comes to: the tracks, and the JSON file beside each.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Serialize, Serializer};
use tropism::geometry::Region;
use tropism::text::plural;
use tropism::vision::{Calibration, Direction, VisionConfig};

use super::clicks::PlantClicks;
use super::light::LightSource;
use super::phantom::never_moves;
use super::pipeline::Pipeline;
use super::plan::{SCHEMA, TrackPlan};
use super::plants::{Plant, TrackScale};
use super::provenance::are_virtual;
use super::series::{SeriesSummary, TimeSource};
use super::table::TrackCounts;
use super::warning::{Evidence, TrackWarning};
use crate::{Error, files};

/// The tracks of a series of photographs.
///
/// As JSON it is the object of the only track, or an array of several.
#[derive(Clone, Debug)]
pub struct TrackResults {
    /// One entry a plant that was detected.
    pub tracks: Vec<PlantTrack>,
    /// Plants that were not detected in any photograph, each with what was found instead.
    pub undetected: Vec<String>,
    /// Order and times of the photographs.
    pub series: SeriesSummary,
}

/// The track of one plant: the JSON file beside it.
#[derive(Clone, Debug, Serialize)]
pub struct PlantTrack {
    schema: &'static str,
    /// The file of the track.
    pub track: PathBuf,
    /// Name of the plant; `None` if it is the only one.
    pub plant: Option<String>,
    /// Whether the photographs are of a virtual plant.
    pub is_virtual: bool,
    /// Photographs by what they show.
    #[serde(flatten)]
    pub counts: TrackCounts,
    /// What the times are from.
    pub time_from: TimeSource,
    /// Minutes from one step to the next.
    pub period_min: f64,
    /// Steps without a photograph.
    pub missing_steps: u32,
    /// How pixels became centimetres.
    pub calibration: Calibration,
    /// Whether the scale is that of the paper's camera, because the plan gives none.
    pub calibration_is_assumed: bool,
    /// Whether region and root were found by the plant's motion, because the plan gives neither.
    pub is_located: bool,
    /// What was clicked on the plant.
    pub clicks: PlantClicks,
    /// The photograph in which another click on the tip would help most; `None` where all have a tip.
    pub next_click: Option<String>,
    /// Whether the photographs were taken to have nothing to do with each other.
    pub is_each: bool,
    /// What speaks against the track; a model is fitted to it only if the plan says so.
    pub warnings: Vec<TrackWarning>,
    /// SHA-256 of the digests of all photographs, one after the other.
    pub photographs_sha256: String,
    /// What is wrong with which file.
    pub problems: BTreeMap<String, String>,
    /// What decides the detections.
    pub settings: TrackSettings,
    /// SHA-256 of the settings as JSON.
    pub settings_sha256: String,
}

/// What decides the detections, and so whether a journal can be resumed.
#[derive(Clone, Debug, Serialize)]
pub struct TrackSettings {
    version: &'static str,
    vision: VisionConfig,
    plants: Vec<Plant>,
    time: TimeSource,
    period_min: Option<f64>,
    #[serde(serialize_with = "as_text")]
    light: LightSource,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    each: bool,
}

fn as_text<S: Serializer>(light: &LightSource, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(light)
}

impl Serialize for TrackResults {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.tracks.as_slice() {
            [only] => only.serialize(serializer),
            several => several.serialize(serializer),
        }
    }
}

impl PlantTrack {
    /// The plant without pot and lamps; `None` is the whole picture.
    #[must_use]
    pub fn region(&self) -> Option<Region> {
        self.settings.plants.iter().find(|plant| plant.name == self.plant)?.region
    }

    /// The direction in which it grows.
    #[must_use]
    pub fn up(&self) -> Direction {
        self.settings.vision.up
    }
}

impl TrackSettings {
    pub(super) fn new(plan: &TrackPlan, plants: &[Plant]) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            vision: plan.vision.clone(),
            plants: plants.to_vec(),
            time: plan.time,
            period_min: plan.period_min,
            light: plan.light.clone(),
            each: plan.each,
        }
    }

    fn sha256(&self) -> Result<String, Error> {
        let json = serde_json::to_vec(self).map_err(Error::at("the settings"))?;
        Ok(files::sha256(&json))
    }
}

impl Pipeline<'_> {
    /// Writes the tracks and the files beside them.
    ///
    /// If no plant was detected, it writes nothing, removes the journal and fails.
    pub(super) fn finish(self, settings: TrackSettings) -> Result<TrackResults, Error> {
        let is_virtual = are_virtual(&self.series.frames);
        let settings_sha256 = settings.sha256()?;
        let photographs_sha256 = files::sha256(self.sha256.as_bytes());
        let (mut tracks, mut undetected) = (Vec::new(), Vec::new());
        for ((plan, plant), table) in self.plan.plants.iter().zip(self.plants).zip(&self.tables) {
            let Some(track) = table.track(self.plan.light == LightSource::Auto) else {
                undetected.push(not_detected(plant, &table.counts));
                continue;
            };
            let never_moves = plan.clicks.is_empty() && !self.plan.each && {
                let tips = (0..).zip(&table.tips).filter_map(|(index, tip)| Some((index, (*tip)?)));
                never_moves(&self.series.frames, &tips.collect::<Vec<_>>())
            };
            let is_given = plan.region.is_some() || plan.base.is_some() || self.plan.scale.base().is_some();
            if never_moves && (plant.is_located || !is_given) {
                undetected.push(
                    "what was found never moves, so it is no plant: `guide` writes a page to click the plant on, or give \
                     its `region` and `base`"
                        .to_owned(),
                );
                continue;
            }
            let calibration_is_assumed = self.plan.scale == TrackScale::PaperCamera;
            let evidence = Evidence {
                plant,
                counts: &table.counts,
                feet: &table.feet,
                // The camera of the virtual tent is the paper's.
                is_scale_assumed: calibration_is_assumed && !is_virtual,
                is_unrelated: self.plan.each,
                times: &self.series.warnings,
                never_moves,
                tips: &table.tips,
                up: self.plan.vision.up,
            };
            let results = PlantTrack {
                schema: SCHEMA,
                track: self.plan.track_file(plant),
                plant: plant.name.clone(),
                is_virtual,
                counts: table.counts.clone(),
                time_from: self.series.time_from,
                period_min: self.series.period_min,
                missing_steps: self.series.missing(),
                calibration: plant.calibration,
                calibration_is_assumed,
                is_located: plant.is_located,
                clicks: plan.clicks.clone(),
                next_click: table.next_click().map(|index| self.series.frames[index].name.clone()),
                is_each: self.plan.each,
                warnings: evidence.warnings(),
                photographs_sha256: photographs_sha256.clone(),
                problems: self.problems.clone(),
                settings: settings.clone(),
                settings_sha256: settings_sha256.clone(),
            };
            files::write_track(&results.track, &track)?;
            files::write_json(&results.track.with_extension("json"), &results)?;
            tracks.push(results);
        }
        if tracks.is_empty() {
            self.journal.remove()?;
            return Err(Error::Plan(undetected.join("; ")));
        }
        Ok(TrackResults { tracks, undetected, series: self.series.summary() })
    }
}

fn not_detected(plant: &Plant, counts: &TrackCounts) -> String {
    let which = plant.name.as_ref().map_or_else(String::new, |name| format!("plant {name}: "));
    let classes: Vec<String> = counts.classes.iter().map(|(name, count)| format!("{name} {count}")).collect();
    format!(
        "{which}found no plant in any of {} ({}), wanted one in the region of interest, with its foot near \
         `base`: `guide` writes a page to click both on",
        plural(counts.frames, "photograph"),
        classes.join(", ")
    )
}
