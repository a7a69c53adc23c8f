//! Tip, apex and stem in space, from the tracks of two cameras at a right angle.
//!
//! In: the track of a camera in front and of one at the side, with the calibrations in the JSON files beside them. Out: one
//! track in space. Steps that either camera has no measured tip of are left out.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tropism::geometry::path::length;
use tropism::geometry::space::SpacePoint;
use tropism::geometry::{Point, Polyline};
use tropism::observation::{Depth, Quality};
use tropism::track::{Sample, Track};
use tropism::vision::Calibration;
use tropism::vision::camera::stereo::{CameraPose, MAX_RAY_GAP_CM, Side, StereoPair, Triangulation};

use crate::track::point_at;
use crate::{Error, Monitor, Workflow, files};

/// Two tracks to triangulate. The default has both cameras at the distance of the paper's (section 2.1).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DepthPlan {
    /// Track of the camera in front.
    pub front: PathBuf,
    /// Track of the camera at the side.
    pub side: PathBuf,
    /// From the lens of each camera to the plane through the root, in cm, the front camera's first.
    pub distance_cm: [f64; 2],
    /// Where the second camera stands, as the first sees it.
    pub from: Side,
    /// CSV file of the track in space; a JSON file of the same name is written beside it.
    pub out: PathBuf,
    /// Whether to replace a file at `out`.
    pub replace: bool,
}

/// A track in space, in numbers: the JSON file beside it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DepthResults {
    /// The file of the track.
    pub track: PathBuf,
    /// Whether the plant is virtual.
    pub is_virtual: bool,
    /// Steps with a tip in space.
    pub steps: usize,
    /// Steps with a whole stem in space, from the base to an apex that both cameras see.
    pub stems: usize,
    /// Distance between the two rays to the tip: median and maximum, in cm.
    pub tip_gap_cm: [f64; 2],
}

impl Default for DepthPlan {
    fn default() -> Self {
        Self {
            front: PathBuf::from("front.csv"),
            side: PathBuf::from("side.csv"),
            distance_cm: [74.0; 2],
            from: Side::default(),
            out: PathBuf::from("space.csv"),
            replace: false,
        }
    }
}

impl Workflow for DepthPlan {
    type Results = DepthResults;

    const SCHEMA: &'static str = "tropism.depth/1";

    fn check(&self) -> Result<(), Error> {
        let beside = self.out.with_extension("json");
        if beside == self.out {
            return Err(Error::Plan(format!(
                "`out` {}: this is the name of the file beside the track: choose one that ends in .csv",
                self.out.display()
            )));
        }
        let inputs = [&self.front, &self.side].map(|track| [track.clone(), track.with_extension("json")]);
        let outputs = [self.out.clone(), beside];
        outputs.iter().try_for_each(|file| files::check_free(file, self.replace))?;
        files::check_outputs(&outputs, inputs.as_flattened())?;
        let [front_cm, side_cm] = self.distance_cm;
        if front_cm > 0.0 && side_cm > 0.0 {
            return Ok(());
        }
        Err(Error::Plan(format!(
            "found `distance_cm` {front_cm},{side_cm}, wanted two distances of more than 0 cm"
        )))
    }

    fn perform(&self, _monitor: &dyn Monitor) -> Result<DepthResults, Error> {
        let (front, beside_front) = read(&self.front)?;
        let (side, beside_side) = read(&self.side)?;
        let views = StereoPair {
            front: CameraPose::new(&beside_front.calibration, self.distance_cm[0]),
            side: CameraPose::new(&beside_side.calibration, self.distance_cm[1]),
            side_from: self.from,
        };
        if let Some((step, apart_s)) = apart(&front, &side) {
            return Err(Error::Plan(format!(
                "{}, {}: at step {step} they are {apart_s} s apart: photographs must be taken at the same times",
                self.front.display(),
                self.side.display()
            )));
        }
        let rows = triangulate(&views, &front, &side);
        if rows.is_empty() {
            return Err(Error::Plan(format!(
                "{}, {}: no step has a measured tip in both: photographs must be taken at the same steps",
                self.front.display(),
                self.side.display()
            )));
        }
        files::write_track(&self.out, &table(&rows))?;
        let mut gaps: Vec<f64> = rows.iter().map(|row| row.tip.gap_cm).collect();
        gaps.sort_by(f64::total_cmp);
        let results = DepthResults {
            track: self.out.clone(),
            is_virtual: beside_front.is_virtual || beside_side.is_virtual,
            steps: rows.len(),
            stems: rows.iter().filter(|row| row.has_whole_stem()).count(),
            tip_gap_cm: [gaps[gaps.len() / 2], gaps[gaps.len() - 1]],
        };
        // The commands that read the track find there that the plant is virtual.
        files::write_json(&self.out.with_extension("json"), &results)?;
        Ok(results)
    }
}

/// The part of the JSON file beside a track that is needed here.
#[derive(Deserialize)]
struct Sidecar {
    calibration: Calibration,
    is_virtual: bool,
}

/// Reads a track and the JSON file beside it.
fn read(path: &Path) -> Result<(Track, Sidecar), Error> {
    let track = files::read_track(path)?;
    let beside = path.with_extension("json");
    let text = files::read_text(&beside)?;
    let place = format!("{}: wanted the file that tropism track writes", beside.display());
    let sidecar: Sidecar = serde_json::from_str(&text).map_err(Error::at(place))?;
    sidecar.calibration.check().map_err(Error::at(beside.display()))?;
    Ok((track, sidecar))
}

/// One step in space.
struct Row {
    /// With the tip's x and y in space.
    sample: Sample,
    tip: Triangulation,
    /// `None` if the cameras see different ends of the stem.
    apex: Option<Triangulation>,
    /// From the base up, as far as both cameras see it.
    stem: Vec<SpacePoint>,
}

impl Row {
    /// The sample with its tip in space, and its stem where it is whole.
    fn in_space(&self) -> Sample {
        let stem = if self.has_whole_stem() { self.stem.as_slice() } else { &[] };
        let plane = Polyline(stem.iter().map(|&[x, y, _]| Point::new(x, y)).collect());
        let depth = Depth { tip_cm: self.tip.point[2], stem_cm: stem.iter().map(|point| point[2]).collect() };
        let stem = (!stem.is_empty()).then_some(plane);
        Sample { stem, depth: Some(depth), ..self.sample.clone() }
    }

    /// Whether the stem reaches from base to apex.
    const fn has_whole_stem(&self) -> bool {
        self.apex.is_some() && self.stem.len() > 1
    }
}

/// The first step at which the times of two tracks are apart by more than half an interval, and by how many seconds.
fn apart(front: &Track, side: &Track) -> Option<(u32, f64)> {
    front.samples.iter().find_map(|sample| {
        let other = side.samples.binary_search_by_key(&sample.step, |sample| sample.step).ok()?;
        let apart_s = (side.samples[other].time_s - sample.time_s).abs();
        (apart_s > 30.0 * front.period_min).then_some((sample.step, apart_s))
    })
}

/// The steps at which both tracks have a measured tip.
fn triangulate(views: &StereoPair, front: &Track, side: &Track) -> Vec<Row> {
    let mut rows = Vec::new();
    let is_measured = |sample: &Sample| sample.quality == Quality::Measured;
    for (row, sample) in front.samples.iter().enumerate().filter(|(_, sample)| is_measured(sample)) {
        let Ok(other) = side.samples.binary_search_by_key(&sample.step, |sample| sample.step) else {
            continue;
        };
        if !is_measured(&side.samples[other]) {
            continue;
        }
        let tip = views.triangulate(sample.tip, side.samples[other].tip);
        let apex = point_at(front, "apex", row).zip(point_at(side, "apex", other));
        let apex = apex.map(|(front, side)| views.triangulate(front, side));
        let stems = sample.stem.as_ref().zip(side.samples[other].stem.as_ref());
        rows.push(Row {
            sample: Sample { tip: Point::new(tip.point[0], tip.point[1]), ..sample.clone() },
            tip,
            apex: apex.filter(|apex| apex.gap_cm <= MAX_RAY_GAP_CM),
            stem: stems.map_or_else(Vec::new, |(front, side)| views.triangulate_midline(front, side)),
        });
    }
    rows
}

fn table(rows: &[Row]) -> Track {
    let mut track = Track::of(rows.iter().map(Row::in_space).collect());
    track.add_stem_columns();
    let mut column = |name: &str, value: &dyn Fn(&Row) -> Option<f64>| {
        track.add_numbers(name, 4, rows.iter().map(|row| value(row).unwrap_or(f64::NAN)));
    };
    column("tip_gap_cm", &|row| Some(row.tip.gap_cm));
    for (index, axis) in ["x", "y", "z"].iter().enumerate() {
        column(&format!("apex_{axis}_cm"), &|row| Some(row.apex?.point[index]));
    }
    column("apex_gap_cm", &|row| Some(row.apex?.gap_cm));
    column("length_cm", &|row| Some(length(&row.stem)).filter(|_| row.has_whole_stem()));
    track
}
