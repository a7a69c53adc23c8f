//! `tropism depth`: the tracks of two cameras into one in space.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};
use tropism::geometry::{Point, Polyline};
use tropism::math::statistics::upper_median;
use tropism::observation::Quality;
use tropism::track::{Column, Sample, Track};
use tropism::vision::Calibration;
use tropism::vision::camera::stereo::{
    CameraPose, MAX_RAY_GAP_CM, Side, SpacePoint, StereoPair, Triangulation, length, resampled,
};
use tropism_lab::files;

use crate::findings::{place_of, stem_of};
use crate::options::parse_pair;
use crate::shell::Shell;

/// Put the tracks of a camera in front and one at the side together: tip, apex and stem in space
///
/// Both tracks are made by `tropism track` of photographs that were taken at the same steps, each with its own
/// calibration in the plane through the root at a right angle to its view. Steps that either camera has no measured tip
/// of are left out. z counts towards the front camera. What is nearer to a camera looks larger to it alone: in space, x and
/// y are free of that.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism depth front.csv side.csv --distance 74,74 --out space.csv\n  \
    tropism depth front.csv left.csv --from left --distance 80,65 --out space.csv")]
pub(crate) struct Depth {
    /// Track of the camera in front
    #[arg(value_name = "FRONT.csv")]
    front: PathBuf,

    /// Track of the camera at the side
    #[arg(value_name = "SIDE.csv")]
    side: PathBuf,

    /// From each camera's lens to the plane through the root, in cm, the front camera's first
    #[arg(long, value_name = "CM,CM", value_parser = parse_pair)]
    distance: Pair,

    /// From where the second camera sees the plant, as the first sees it
    #[arg(long, value_enum, default_value = "right")]
    from: SideName,

    /// Where the track in space goes
    #[arg(long, value_name = "space.csv")]
    out: PathBuf,

    /// Replace a track that is there already
    #[arg(long)]
    force: bool,
}

type Pair = [f64; 2];

#[derive(Clone, Copy, ValueEnum)]
enum SideName {
    Left,
    Right,
}

/// The file beside a track.
#[derive(Deserialize)]
struct Sidecar {
    calibration: Calibration,
    is_virtual: bool,
}

#[derive(Serialize)]
struct Outcome {
    track: PathBuf,
    is_virtual: bool,
    steps: usize,
    /// Steps with a whole stem in space, from the base to an apex that both cameras see.
    stems: usize,
    /// By how far the rays to the tip pass each other by: median and largest, in cm.
    tip_gap_cm: [f64; 2],
}

/// One step in space.
struct Row {
    sample: Sample,
    tip: Triangulation,
    /// `None` where the cameras see different ends.
    apex: Option<Triangulation>,
    /// As far up as both cameras see it.
    stem: Vec<SpacePoint>,
}

impl Row {
    /// Whether the stem reaches from base to apex.
    const fn is_whole(&self) -> bool {
        self.apex.is_some() && self.stem.len() > 1
    }
}

impl Depth {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        ensure!(
            self.force || !self.out.exists(),
            "{}: found a file here already, wanted a new name, or --force to replace it",
            self.out.display()
        );
        let [front_cm, side_cm] = self.distance;
        ensure!(
            front_cm > 0.0 && side_cm > 0.0,
            "found --distance {front_cm},{side_cm}, wanted two distances of more than 0 cm"
        );
        let (front, beside_front) = read(&self.front)?;
        let (side, beside_side) = read(&self.side)?;
        let views = StereoPair {
            front: CameraPose::new(&beside_front.calibration, front_cm),
            side: CameraPose::new(&beside_side.calibration, side_cm),
            side_from: match self.from {
                SideName::Left => Side::Left,
                SideName::Right => Side::Right,
            },
        };
        let rows = rows(&views, &front, &side);
        ensure!(
            !rows.is_empty(),
            "{}, {}: found no step at which both have a measured tip, wanted photographs taken at the same steps",
            self.front.display(),
            self.side.display()
        );
        files::write_track(&self.out, &table(&rows))?;
        let gaps: Vec<f64> = rows.iter().map(|row| row.tip.gap_cm).collect();
        let median_gap = upper_median(&gaps, f64::total_cmp).unwrap_or_default();
        let outcome = Outcome {
            track: self.out.clone(),
            is_virtual: beside_front.is_virtual || beside_side.is_virtual,
            steps: rows.len(),
            stems: rows.iter().filter(|row| row.is_whole()).count(),
            tip_gap_cm: [median_gap, gaps.into_iter().fold(0.0, f64::max)],
        };
        // What is known of the plant goes on with its track.
        let json = serde_json::to_string_pretty(&outcome)? + "\n";
        files::write(&self.out.with_extension("json"), json.as_bytes())?;
        let text = format!(
            "{} steps{} in space, {} with the whole stem; the cameras' rays to the tip pass each other by {:.2} cm (median), {:.2} cm \
             at most\nwrote {}",
            outcome.steps,
            if outcome.is_virtual { " of a virtual plant" } else { "" },
            outcome.stems,
            outcome.tip_gap_cm[0],
            outcome.tip_gap_cm[1],
            self.out.display()
        );
        shell.result(&text, &outcome)
    }
}

/// A track and what stands beside it.
fn read(path: &Path) -> Result<(Track, Sidecar)> {
    let track = files::read_track(path)?;
    let beside = path.with_extension("json");
    let text = files::read_text(&beside)?;
    let sidecar: Sidecar = serde_json::from_str(&text)
        .with_context(|| format!("{}: wanted the file that tropism track writes", beside.display()))?;
    sidecar.calibration.check().with_context(|| beside.display().to_string())?;
    Ok((track, sidecar))
}

/// The steps at which both tracks have a measured tip.
fn rows(views: &StereoPair, front: &Track, side: &Track) -> Vec<Row> {
    let mut rows = Vec::new();
    let is_measured = |sample: &Sample| sample.quality == Quality::Measured;
    for (row, sample) in front.samples.iter().enumerate().filter(|(_, sample)| is_measured(sample)) {
        let Ok(other) = side.samples.binary_search_by_key(&sample.step, |sample| sample.step) else {
            continue;
        };
        if !is_measured(&side.samples[other]) {
            continue;
        }
        let both = |of: fn(&Track, usize) -> Option<Polyline>| Some((of(front, row)?, of(side, other)?));
        let tip = views.triangulate(sample.tip, side.samples[other].tip);
        let apex = both(apex).map(|(front, side)| views.triangulate(front.0[0], side.0[0]));
        let apex = apex.filter(|apex| apex.gap_cm <= MAX_RAY_GAP_CM);
        let stem =
            both(stem_of).map_or_else(Vec::new, |(front, side)| views.triangulate_midline(&front, &side));
        let sample = Sample { tip: Point::new(tip.point[0], tip.point[1]), ..sample.clone() };
        rows.push(Row { sample, tip, apex, stem });
    }
    rows
}

/// The apex, as a line of one point.
fn apex(track: &Track, row: usize) -> Option<Polyline> {
    Some(Polyline(vec![place_of(track, "apex", row)?]))
}

fn table(rows: &[Row]) -> Track {
    let mut track = Track::of(rows.iter().map(|row| row.sample.clone()).collect());
    let mut column = |name: String, value: &dyn Fn(&Row) -> Option<f64>| {
        let text = |row: &Row| value(row).map_or_else(String::new, |value| format!("{value:.4}"));
        track.columns.push(Column::parsed(&name, rows.iter().map(text).collect()));
    };
    column("tip_z_cm".to_owned(), &|row| Some(row.tip.point[2]));
    column("tip_gap_cm".to_owned(), &|row| Some(row.tip.gap_cm));
    let axes = ["x", "y", "z"];
    for (index, axis) in axes.iter().enumerate() {
        column(format!("apex_{axis}_cm"), &|row| Some(row.apex?.point[index]));
    }
    column("apex_gap_cm".to_owned(), &|row| Some(row.apex?.gap_cm));
    column("length_cm".to_owned(), &|row| Some(length(&row.stem)).filter(|_| row.is_whole()));
    let ten = |row: &Row| if row.is_whole() { resampled(&row.stem, 10) } else { Vec::new() };
    let stems: Vec<Vec<SpacePoint>> = rows.iter().map(ten).collect();
    for vertex in 0..10 {
        for (index, axis) in axes.iter().enumerate() {
            let text = |stem: &Vec<SpacePoint>| {
                stem.get(vertex).map_or_else(String::new, |place| format!("{:.4}", place[index]))
            };
            let name = format!("stem_{}_{axis}_cm", vertex + 1);
            track.columns.push(Column::parsed(&name, stems.iter().map(text).collect()));
        }
    }
    track
}
