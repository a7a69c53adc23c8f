//! A bean seedling in a tent, with a lamp to each side.
//!
//! How the stem's end is found was chosen on photographs of both halves: those whose tens digit is even. Blocks of ten
//! alternate so that each part shows the hook closed and open.

use std::path::Path;

use tropism::geometry::{Pixel, Region};
use tropism::lamps;
use tropism::vision::{Calibration, Mode, VisionConfig, lamp_state};

use super::{assumed_scale, classes, track, within};
use crate::marks::{Row, rows};
use crate::published::open;
use crate::reliability::Reliability;
use crate::share::Share;

/// Greatest error of a top and of an apex, in pixels.
const TOP: f64 = 4.0;
const APEX: f64 = 6.0;

pub(super) const SIZE: (usize, usize) = (720, 480);

/// Regions that a user may choose, with the root: that of the README and its scale, then others without a scale.
const REGIONS: [(&str, Region, Pixel, Option<f64>); 6] = [
    ("README", README, ROOT, Some(11.0)),
    ("README, 5 px/cm", README, ROOT, Some(5.0)),
    ("README, 22 px/cm", README, ROOT, Some(22.0)),
    ("README, no scale", README, ROOT, None),
    ("narrow, no scale", NARROW, Pixel::new(362.0, 336.0), None),
    ("wide, no scale", Region { x: 190, y: 60, width: 340, height: 290 }, Pixel::new(362.0, 336.0), None),
];
pub(super) const README: Region = Region { x: 250, y: 150, width: 230, height: 175 };
pub(super) const NARROW: Region = Region { x: 290, y: 150, width: 150, height: 186 };
pub(super) const ROOT: Pixel = Pixel::new(364.0, 336.0);

pub(super) fn print(folder: &Path, suffix: &str, mode: Mode, reliability: &mut Reliability) {
    let marks = rows(&folder.join(format!("annotations/flora-robotica{suffix}.csv")));
    let series = folder.join(format!("flora-robotica{suffix}"));
    let lights = rows(&series.join("light.csv"));
    let file = |row: &Row| series.join(format!("{}.jpg", row.text("frame")));
    let lamps = lights.iter().map(|row| {
        let light = lamp_state(&open(&file(row)), None);
        lamps::name(light) == row.text("light")
    });
    println!("  {:18} {}", "lamps", Share::of(lamps));
    // The second half is tracked from the first on: the lamp changes where it begins.
    let lead = if suffix.is_empty() { Vec::new() } else { rows(&folder.join("flora-robotica/light.csv")) };
    let before = lead.iter().map(|row| folder.join(format!("flora-robotica/{}.jpg", row.text("frame"))));
    let files: Vec<_> = before
        .chain(lights.iter().map(file))
        .zip(0..)
        .map(|(file, i)| (file, 300.0 * f64::from(i)))
        .collect();
    for (name, crop, base, scale) in REGIONS {
        let calibration = match scale {
            Some(scale) => Calibration::from_scale(base, scale, SIZE.0, SIZE.1),
            None => assumed_scale(base, SIZE),
        };
        let config = VisionConfig { mode, crop: Some(crop), ..VisionConfig::default() };
        let answers = &track(&files, calibration, config)[lead.len()..];
        let (mut tops, mut ends) = (Vec::new(), [Vec::new(), Vec::new()]);
        for (row, answer) in lights.iter().zip(answers) {
            let file = format!("{}.jpg", row.text("frame"));
            let Some(mark) = marks.iter().find(|mark| mark.text("file") == file) else { continue };
            let seen = answer.measured();
            let top = seen.map(|seen| mark.miss(seen.tip));
            let part = mark.number("frame") as usize / 10 % 2;
            ends[part].push(answer.apex().map(|apex| apex.distance(mark.place("apex_"))));
            reliability.extend(top.map(|top| (answer.confidence, top <= TOP)));
            tops.push(top);
        }
        let answered = Share::of(answers.iter().map(|answer| answer.is_measured));
        let [even, odd] = ends
            .each_ref()
            .map(|ends| Share::of(ends.iter().map(|error| error.is_some_and(|error| error <= APEX))));
        println!(
            "  {name:18} answered {answered} | top {} | apex {}, even tens {even}, odd tens {odd} | {}",
            within(&tops, TOP),
            within(&ends.concat(), APEX),
            classes(answers)
        );
    }
}
