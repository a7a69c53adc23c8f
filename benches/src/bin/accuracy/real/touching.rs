//! The bean with a second bean beside it that touches it or crosses it: the same plant of another photograph, drawn over
//! the picture.

use std::path::Path;

use rayon::prelude::*;
use tropism::geometry::{Pixel, Region};
use tropism::photo::{Image, Photo};
use tropism::vision::{Detection, Frame, Mode, VisionConfig, detect_from_base};

use super::bean::{NARROW, README, ROOT, SIZE};
use super::{Answer, assumed_scale, track_frames};
use crate::marks::rows;
use crate::published::open;
use crate::reliability::Reliability;
use crate::share::Share;

/// Distance from the tip of the bean alone from which on a tip is wrong, in pixels.
const WRONG: f64 = 6.0;

/// Least confidence that is high.
const HIGH: f64 = 0.9;

/// In the second row, photographs from one with a second plant to the next.
const EVERY: usize = 6;

/// Where the second bean stands: pixels to the right and down, whether it is mirrored, and from how many photographs later.
type Place = (i32, i32, bool, usize);

/// The places on which the test for a second plant was chosen, on the first half, and others for the second half.
const CHOSEN_ON: [Place; 12] = [
    (16, 0, false, 0),
    (22, -2, false, 6),
    (28, -6, false, 12),
    (-16, 0, false, 0),
    (-22, -2, false, 6),
    (-28, -6, false, 12),
    (-12, 0, true, 0),
    (-24, -4, true, 6),
    (-36, -2, true, 0),
    (-48, -6, true, 6),
    (14, -8, false, 18),
    (-30, -8, true, 18),
];
const KEPT_APART: [Place; 10] = [
    (18, -3, false, 3),
    (26, -5, false, 8),
    (-19, -1, false, 4),
    (-33, -4, false, 9),
    (-8, -2, true, 2),
    (8, -3, true, 5),
    (-30, -4, true, 3),
    (35, -5, false, 0),
    (-50, -3, true, 7),
    (40, 0, false, 2),
];

pub(super) fn print(folder: &Path, suffix: &str, mode: Mode, _: &mut Reliability) {
    let series = folder.join(format!("flora-robotica{suffix}"));
    let lights = rows(&series.join("light.csv"));
    let file = |name: &str| series.join(format!("{name}.jpg"));
    let images: Vec<Image> = lights.iter().map(|row| open(&file(row.text("frame")))).collect();
    let config = VisionConfig { mode, crop: Some(README), ..VisionConfig::default() };
    // This region reaches down to the soil.
    let whole = VisionConfig { crop: Some(NARROW), ..config.clone() };
    let plants: Vec<Option<Detection>> =
        images.par_iter().map(|image| detect_from_base(image, Some(ROOT), &whole)).collect();
    // Another lamp would light the second plant from the other side.
    let later = |i: usize, lag: usize| {
        let is_alike = |j: &usize| lights[*j].text("light") == lights[i].text("light");
        (i..lights.len()).take(lag + 1).take_while(is_alike).last().unwrap_or(i)
    };
    let answers = |place: Option<Place>, every: usize| {
        let picture = |i: usize| {
            // Where it is not in all, a track begins with four photographs of the bean alone.
            let drawn = place.filter(|_| (i + 2).is_multiple_of(every)).map(|place| {
                let j = later(i, place.3);
                draw(&images[i], &images[j], plants[j].as_ref(), place)
            });
            let bytes = drawn.as_ref().unwrap_or(&images[i]).to_jpeg(95).expect("pixels");
            Frame::new(Photo { name: String::new(), bytes, time_s: 300.0 * i as f64 })
        };
        let frames: Vec<Frame> = (0..images.len()).map(picture).collect();
        track_frames(&frames, assumed_scale(ROOT, SIZE), config.clone())
    };
    let alone = answers(None, 1);
    println!("  {:18} seen as two {}", "alone", seen_as_two(&alone));
    let places = if suffix.is_empty() { &CHOSEN_ON[..] } else { &KEPT_APART };
    for (name, every) in [("in all", 1), ("in every sixth", EVERY)] {
        let touched: Vec<Answer> = places.iter().flat_map(|&place| answers(Some(place), every)).collect();
        let is_wrong = |(answer, alone): (&Answer, &Answer)| {
            let (Some(seen), Some(truth)) = (answer.measured(), alone.measured()) else { return None };
            Some((answer.confidence >= HIGH, seen.tip.distance(truth.tip) > WRONG))
        };
        let judged: Vec<(bool, bool)> =
            touched.iter().zip(alone.iter().cycle()).filter_map(is_wrong).collect();
        let high = judged.iter().filter(|(is_high, _)| *is_high);
        println!(
            "  {name:18} answered {} | of these wrong (> {WRONG} px) {}, of a confidence from {HIGH} on {} | seen as two {}",
            Share::of(touched.iter().map(|answer| answer.is_measured)),
            Share::of(judged.iter().map(|&(_, is_wrong)| is_wrong)),
            Share::of(high.map(|&(_, is_wrong)| is_wrong)),
            seen_as_two(&touched)
        );
    }
}

/// In how many photographs two plants are seen where one is looked for.
fn seen_as_two(answers: &[Answer]) -> Share {
    Share::of(answers.iter().filter_map(|answer| Some(answer.detection.as_ref()?.has_second_foot)))
}

/// A picture with the plant of another at a place.
fn draw(
    image: &Image,
    other: &Image,
    plant: Option<&Detection>,
    (right, down, is_mirrored, _): Place,
) -> Image {
    let mut drawn = image.clone();
    let Region { x: left, y: top, width, height } = NARROW;
    for (x, y) in (top..top + height).flat_map(|y| (left..left + width).map(move |x| (x, y))) {
        let is_plant = plant.is_some_and(|plant| plant.tissue.is_near(Pixel::new(x as f64, y as f64)));
        let column = if is_mirrored { 2 * ROOT.x as i32 - 1 - x as i32 } else { x as i32 };
        let (column, row) = (column + right, y as i32 + down);
        let is_inside = (0..image.width as i32).contains(&column) && (0..image.height as i32).contains(&row);
        if is_plant && is_inside {
            let at = 3 * (row as usize * image.width + column as usize);
            for (level, other) in drawn.rgb[at..at + 3].iter_mut().zip(other.at(x, y)) {
                *level = (*level).max(other);
            }
        }
    }
    drawn
}
