//! Errors on real photographs against marks made by hand, in pixels.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use tropism::geometry::{Pixel, Region};
use tropism::lamps;
use tropism::math::statistics::quantile_nearest;
use tropism::photo::Photo;
use tropism::vision::{Calibration, Frame, Mode, TipTracker, VisionConfig, detect_from_base, lamp_state};

use crate::marks::rows;
use crate::published::{self, Shoot, WRONG, open};

/// Makes the row of a folder of photographs.
type Sum = fn(&Path, Mode) -> String;

pub(crate) fn print(folder: &Path, mode: Mode, has: impl Fn(&str) -> bool) {
    println!("\nreal photographs, pixels");
    let rows: [(&str, Sum); 4] = [
        ("real/flora-robotica", flora),
        ("real/sunflower-timelapse", timelapse),
        ("real/sunflower-centerlines", centerlines),
        ("real/bean-silhouettes", silhouettes),
    ];
    for (name, row) in rows.into_iter().filter(|(name, _)| has(name)) {
        println!("{name:28} {}", row(folder, mode));
    }
}

fn within(values: &[f64], most: f64) -> String {
    let near = values.iter().filter(|&&value| value <= most).count();
    format!(
        "median {:.2}, worst {:.2}, within {most} px {near} of {}",
        quantile_nearest(values, 0.5),
        quantile_nearest(values, 1.0),
        values.len()
    )
}

fn flora(folder: &Path, mode: Mode) -> String {
    let marks = rows(&folder.join("annotations/flora-robotica.csv"));
    let crop = Region { x: 290, y: 150, width: 150, height: 186 };
    let config = VisionConfig { mode, crop: Some(crop), ..VisionConfig::default() };
    let lights = rows(&folder.join("flora-robotica/light.csv"));
    let (mut lost, mut lamps) = (0, 0);
    let (mut tops, mut ends) = (Vec::new(), Vec::new());
    for row in &lights {
        let file = format!("{}.jpg", row.text("frame"));
        let image = open(&folder.join("flora-robotica").join(&file));
        lamps += usize::from(lamps::name(lamp_state(&image, None)) == row.text("light"));
        let Some(seen) = detect_from_base(&image, Some(Pixel::new(362.0, 336.0)), &config) else {
            lost += 1;
            continue;
        };
        if let Some(mark) = marks.iter().find(|mark| mark.text("file") == file) {
            tops.push(mark.miss(seen.tip));
            ends.extend(seen.apex.map(|apex| apex.distance(mark.place("apex_"))));
        }
    }
    let files =
        lights.iter().map(|row| folder.join("flora-robotica").join(format!("{}.jpg", row.text("frame"))));
    let calibration = Calibration::from_scale(Pixel::new(362.0, 336.0), 11.0, 720, 480);
    format!(
        "{} frames, lost {lost}, lit lamp right {lamps}, in order: {} | top: {} | apex: {}",
        lights.len(),
        followed(files, calibration, config),
        within(&tops, 4.0),
        within(&ends, 6.0)
    )
}

/// Counts of the classes that a tracker gives photographs in order.
fn followed(files: impl Iterator<Item = PathBuf>, calibration: Calibration, config: VisionConfig) -> String {
    let mut tracker = TipTracker::new(calibration, config).expect("a region inside the picture");
    let mut classes = BTreeMap::new();
    for (index, file) in files.enumerate() {
        let bytes = std::fs::read(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let photo = Photo { name: String::new(), bytes, time_s: 300.0 * index as f64 };
        let seen = tracker.observe(&Frame::new(photo));
        *classes.entry(seen.status.name()).or_insert(0) += 1;
    }
    classes.into_iter().map(|(class, count)| format!("{class} {count}")).collect::<Vec<_>>().join(", ")
}

/// Region and base of each seedling.
const SUNFLOWERS: [(Region, Pixel); 3] = [
    (Region { x: 130, y: 40, width: 250, height: 258 }, Pixel::new(273.0, 309.0)),
    (Region { x: 430, y: 20, width: 240, height: 275 }, Pixel::new(557.0, 306.0)),
    (Region { x: 730, y: 40, width: 250, height: 255 }, Pixel::new(799.0, 304.0)),
];

fn timelapse(folder: &Path, mode: Mode) -> String {
    let marks = rows(&folder.join("annotations/sunflower-timelapse.csv"));
    let (mut lost, mut tops, mut ends) = (0, Vec::new(), Vec::new());
    for mark in &marks {
        let image = open(&folder.join("sunflower-timelapse").join(mark.text("file")));
        let (crop, base) = SUNFLOWERS[mark.number("plant") as usize - 1];
        let config = VisionConfig { mode, crop: Some(crop), ..VisionConfig::default() };
        let Some(seen) = detect_from_base(&image, Some(base), &config) else {
            lost += 1;
            continue;
        };
        tops.push(mark.miss(seen.tip));
        if mark.number("node_hidden") == 0.0 {
            ends.extend(seen.apex.map(|apex| apex.distance(mark.place("node_"))));
        }
    }
    let frames = rows(&folder.join("sunflower-timelapse/frames.csv"));
    let order = SUNFLOWERS.map(|(crop, base)| {
        let calibration = Calibration::from_scale(base, 50.0, 1000, 700);
        let files = frames.iter().map(|row| folder.join("sunflower-timelapse").join(row.text("file")));
        followed(files, calibration, VisionConfig { mode, crop: Some(crop), ..VisionConfig::default() })
    });
    let order = order.join("; ");
    format!(
        "{} marks, lost {lost}, in order: {order} | top: {} | stem end: {}",
        marks.len(),
        within(&tops, 5.0),
        within(&ends, 8.0)
    )
}

/// Result of one seedling.
struct Answer {
    /// Whether its leaves are closed.
    is_young: bool,
    /// Whether the number of its picture is odd: thresholds were chosen on these.
    is_odd: bool,
    /// Error of the stem in % of its length, where one is detected.
    off: Option<f64>,
}

/// Errors of stems detected from their marked bases.
fn centerlines(folder: &Path, mode: Mode) -> String {
    let folder = folder.join("sunflower-centerlines");
    let marks = rows(&folder.join("centerlines.csv"));
    let scored: Vec<Answer> = marks
        .par_iter()
        .map(|row| {
            let is_odd = row.text("file").trim_end_matches(".jpg").ends_with(['1', '3', '5', '7', '9']);
            Answer { is_young: published::is_young(row), is_odd, off: published::stem(&folder, row, mode) }
        })
        .collect();
    let share = |of: fn(&Answer) -> bool| {
        let off: Vec<f64> = scored.iter().filter(|one| of(one)).filter_map(|one| one.off).collect();
        let all = scored.iter().filter(|one| of(one)).count();
        let wrong = off.iter().filter(|&&off| off > WRONG).count();
        format!(
            "{all}, answered {}, mean distance median {:.2} % of length, wrong (> {WRONG} %) {wrong}",
            off.len(),
            quantile_nearest(&off, 0.5)
        )
    };
    format!(
        "Hook and Closed: {} | of these, odd numbers (used to tune): {} | even: {} | all: {}",
        share(|one| one.is_young),
        share(|one| one.is_young && one.is_odd),
        share(|one| one.is_young && !one.is_odd),
        share(|_| true)
    )
}

fn silhouettes(folder: &Path, _: Mode) -> String {
    let folder = folder.join("bean-silhouettes");
    let numbers = published::shoots(&folder);
    let found: Vec<Option<[Shoot; 2]>> =
        numbers.par_iter().map(|number| published::midline(&folder, number)).collect();
    let known: Vec<[Shoot; 2]> = found.into_iter().flatten().collect();
    let off = |which: usize| {
        let of = |value: fn(&Shoot) -> f64| known.iter().map(|one| value(&one[which])).collect::<Vec<_>>();
        let (lengths, distances) = (of(|one| one.length), of(|one| one.distance));
        let sizes: Vec<f64> = lengths.iter().map(|length| length.abs()).collect();
        let parts = of(|one| one.between.abs());
        format!(
            "length, end to end, off by median {:.2} % (mean {:+.2} %), worst {:.2} %, between the published line's ends median {:.2} %, worst {:.2} %, mean distance median {:.2} % of length, worst {:.2} %",
            quantile_nearest(&sizes, 0.5),
            lengths.iter().sum::<f64>() / known.len().max(1) as f64,
            quantile_nearest(&sizes, 1.0),
            quantile_nearest(&parts, 0.5),
            quantile_nearest(&parts, 1.0),
            quantile_nearest(&distances, 0.5),
            quantile_nearest(&distances, 1.0)
        )
    };
    format!(
        "{} shoots, answered {} | {} | smoothed as the published line is: {}",
        numbers.len(),
        known.len(),
        off(0),
        off(1)
    )
}
