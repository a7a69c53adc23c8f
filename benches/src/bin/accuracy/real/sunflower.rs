//! Three sunflower seedlings before a dark wall, by day and night.

use std::path::Path;

use tropism::geometry::{Pixel, Region};
use tropism::vision::{Mode, VisionConfig};

use super::{assumed_scale, classes, track, within};
use crate::marks::rows;
use crate::reliability::Reliability;
use crate::share::Share;

/// Greatest error of a top and of a stem's end, in pixels.
const TOP: f64 = 5.0;
const END: f64 = 8.0;

/// Region and base of each seedling.
const PLANTS: [(Region, Pixel); 3] = [
    (Region { x: 90, y: 20, width: 305, height: 278 }, Pixel::new(273.0, 309.0)),
    (Region { x: 396, y: 20, width: 284, height: 275 }, Pixel::new(557.0, 306.0)),
    (Region { x: 700, y: 20, width: 300, height: 275 }, Pixel::new(799.0, 304.0)),
];

pub(super) fn print(folder: &Path, suffix: &str, mode: Mode, reliability: &mut Reliability) {
    let marks = rows(&folder.join(format!("annotations/sunflower-timelapse{suffix}.csv")));
    let series = folder.join(format!("sunflower-timelapse{suffix}"));
    let frames = rows(&series.join("frames.csv"));
    let files: Vec<_> = frames
        .iter()
        .map(|row| (series.join(row.text("file")), 60.0 * row.number("minutes_since_first")))
        .collect();
    let (mut tops, mut ends, mut answered) = (Vec::new(), Vec::new(), Vec::new());
    for (plant, (crop, base)) in (1..).zip(PLANTS) {
        let config = VisionConfig { mode, crop: Some(crop), ..VisionConfig::default() };
        let answers = track(&files, assumed_scale(base, (1000, 700)), config);
        println!("  plant {plant}: {}", classes(&answers));
        for mark in marks.iter().filter(|mark| mark.number("plant") == f64::from(plant)) {
            let at = frames.iter().position(|row| row.text("file") == mark.text("file"));
            let answer = &answers[at.expect("a marked photograph of the series")];
            let seen = answer.measured();
            let top = seen.map(|seen| mark.miss(seen.tip));
            reliability.extend(top.map(|top| (answer.confidence, top <= TOP)));
            tops.push(top);
            if mark.number("node_hidden") == 0.0 {
                ends.push(answer.apex().map(|apex| apex.distance(mark.place("node_"))));
            }
        }
        answered.extend(answers.iter().map(|answer| answer.is_measured));
    }
    println!(
        "  answered {} | top {} | stem's end {}",
        Share::of(answered),
        within(&tops, TOP),
        within(&ends, END)
    );
}
