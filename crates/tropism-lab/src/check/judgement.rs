//! What the photographs of a check tell of camera, flash, plant and lamps.

use tropism::text::plural;
use tropism::vision::{Calibration, Frame, FrameStatus, TipTracker};

use super::shot::Shot;
use super::{Findings, Group};

// All bounds are chosen by hand, for the virtual tent and for tents of programs such as those of the tests: no rig of real
// devices has been checked yet.

/// Levels of 255, of the mean, by which photographs by the same light differ at most.
const NOISE: f64 = 2.0;

/// The same as a share of the mean, which is added.
const RELATIVE_NOISE: f64 = 0.03;

/// Means of photographs that are neither black nor white, in levels of 255.
const EXPOSED: std::ops::RangeInclusive<f64> = 8.0..=247.0;

/// Pixels over which the detected tip of a plant at rest spreads at most.
const MAX_SPREAD_PX: f64 = 2.0;

/// Heights of a bean's tip, in cm.
const TIP_HEIGHTS_CM: std::ops::RangeInclusive<f64> = 0.2..=60.0;

/// Distance of a bean's tip from its root to either side, in cm, at most.
const MAX_LEAN_CM: f64 = 40.0;

/// Judges size, freshness, exposure and sharpness of photographs by the same light.
pub(super) fn judge_camera(calibration: Option<&Calibration>, shots: &[Shot], findings: &mut Findings) {
    let count = shots.len();
    let (found_width, found_height) = (shots[0].image.width, shots[0].image.height);
    let longest = shots.iter().map(|shot| shot.took).max().unwrap_or_default().as_secs_f64();
    let (width, height) =
        calibration.map_or((found_width, found_height), |&Calibration { width, height, .. }| (width, height));
    if (found_width, found_height) == (width, height) {
        let found =
            format!("{} of {width} x {height} pixels, {longest:.1} s at most", plural(count, "photograph"));
        findings.pass(Group::Camera, found);
    } else {
        findings.fail(
            Group::Camera,
            format!(
                "photographs of {found_width} x {found_height} pixels, calibrated for {width} x {height}"
            ),
            "the camera's width and height, or a new calibration: tropism calibrate-camera",
        );
    }
    if shots.windows(2).any(|pair| pair[0].photo.bytes == pair[1].photo.bytes) {
        findings.fail(
            Group::Camera,
            "two photographs are the same to the byte: the camera hangs, or gives a picture that it kept",
            "restart the camera; the noise of a sensor never repeats",
        );
    } else {
        findings.pass(Group::Camera, "no photograph repeats the one before");
    }
    let (least, most) = range(shots.iter().map(|shot| shot.mean));
    let levels = format!("{least:.0} to {most:.0} of 255 on the mean");
    if most - least > NOISE + RELATIVE_NOISE * most {
        findings.warn(
            Group::Camera,
            format!("the same light gives {levels}: exposure, gain or white balance is not fixed"),
            "fix all three in the camera's table, or in the camera",
        );
    } else {
        findings.pass(Group::Camera, format!("the same light gives {levels}"));
    }
    if most < *EXPOSED.start() || least > *EXPOSED.end() {
        findings.fail(
            Group::Camera,
            format!("photographs with the flash are black or white: {levels}"),
            "a lens cap, a flash that is dead, or exposure and gain",
        );
    }
    findings.pass(
        Group::Camera,
        format!("neighbouring pixels differ by {:.1} levels; focus for the most", shots[0].sharpness()),
    );
}

/// Judges whether photographs with the flash are brighter than one before and one after, and from the first on.
/// `discard_key` is the setting by which old frames of the camera are discarded.
pub(super) fn judge_flash(
    dark: &Shot,
    shots: &[Shot],
    after: &Shot,
    discard_key: Option<&str>,
    findings: &mut Findings,
) {
    let (_, bright) = range(shots.iter().map(|shot| shot.mean));
    let gain = bright - dark.mean;
    if gain < NOISE {
        findings.fail(
            Group::Flash,
            format!("no photograph is brighter by it: {:.0} without, {bright:.0} with", dark.mean),
            "see that it lights; a longer settle_s; its driver only knows that it gave the order",
        );
        return;
    }
    let is_lit = |shot: &Shot| shot.mean > dark.mean + gain / 2.0;
    let late = shots.iter().take_while(|shot| !is_lit(shot)).count();
    let discards = |count: usize| match discard_key {
        Some(key) => format!("raise {key} by {count} or more, or flash.settle_s"),
        None => "raise flash.settle_s; or the camera gives frames that it kept".to_owned(),
    };
    if late > 0 {
        findings.fail(
            Group::Flash,
            format!(
                "it shows {} late: the camera gives old frames, or the flash is slow",
                plural(late, "photograph")
            ),
            discards(late),
        );
    } else {
        findings.pass(
            Group::Flash,
            format!("photographs are fresh: {:.0} levels without it, {bright:.0} with it", dark.mean),
        );
    }
    if is_lit(after) {
        findings.fail(
            Group::Flash,
            "the photograph after it shows it still",
            format!("see that it goes off; {}", discards(1)),
        );
    } else {
        findings.pass(Group::Flash, "it goes off again");
    }
}

/// Judges whether the plant is detected in all photographs, and at the same place.
pub(super) fn judge_plant(tracker: &mut TipTracker, shots: &[Shot], findings: &mut Findings) {
    let frames = shots.iter().map(|shot| Frame::new(shot.photo.clone()));
    let seen: Vec<_> = frames.map(|frame| tracker.observe(&frame)).collect();
    let tips: Vec<_> = seen
        .iter()
        .filter(|seen| seen.is_measured())
        .filter_map(|seen| Some((seen.tip_px?, seen.observation.as_ref()?.tip)))
        .collect();
    if tips.len() < shots.len() {
        let class = seen.iter().map(|seen| seen.status).find(|&class| class != FrameStatus::Ok);
        let class = class.map_or_else(String::new, |class| format!(" ({class})"));
        findings.fail(
            Group::Plant,
            format!("seen in {} of {}{class}", tips.len(), plural(shots.len(), "photograph")),
            "tropism track PHOTOGRAPHS --guide shows crop and base; tropism check --out DIR keeps these",
        );
        return;
    }
    let (left, right) = range(tips.iter().map(|(pixel, _)| pixel.x));
    let (top, bottom) = range(tips.iter().map(|(pixel, _)| pixel.y));
    let spread = f64::max(right - left, bottom - top);
    let tip = tips[tips.len() - 1].1;
    let place = format!("its tip is at {:.1}, {:.1} cm, within {spread:.1} pixels", tip.x, tip.y);
    if spread >= MAX_SPREAD_PX {
        findings.warn(
            Group::Plant,
            place,
            "less noise (gain), sharper focus, a calmer background; or the plant swings: no fan on it",
        );
    } else if !TIP_HEIGHTS_CM.contains(&tip.y) || tip.x.abs() > MAX_LEAN_CM {
        findings.warn(Group::Plant, place, "a bean is not there: px_per_cm and base of the calibration");
    } else {
        findings.pass(Group::Plant, place);
    }
}

/// Judges a lamp by photographs before, while and after it was lit, without the flash. Returns how much brighter the left
/// and the right half are by it; `None`, and a finding, if that cannot be seen.
pub(super) fn judge_lamp(
    name: &str,
    dark: &Shot,
    lit: &Shot,
    after: &Shot,
    findings: &mut Findings,
) -> Option<[f64; 2]> {
    let name = format!("{name} lamp");
    let gain = lit.mean - dark.mean;
    let halves = [0, 1].map(|half| lit.halves[half] - dark.halves[half]);
    if gain < NOISE {
        findings.warn(
            Group::Lamps,
            format!("{name}: obeyed, and the photograph does not show it ({gain:+.1} levels)"),
            "look whether it lights; if it does, these photographs are too short to show it",
        );
        return None;
    }
    findings.pass(
        Group::Lamps,
        format!("{name}: brighter by {:.0} levels at the left, {:.0} at the right", halves[0], halves[1]),
    );
    if after.mean > dark.mean + f64::max(NOISE, gain / 2.0) {
        findings.fail(
            Group::Lamps,
            format!("{name}: the photograph after it shows it still"),
            "it does not go dark, or the camera gives old frames",
        );
    }
    Some(halves)
}

/// Judges whether the left one of two lamps lights the left half of the picture more than the right one does. `gains` are
/// how much brighter the left and the right half are by each.
pub(super) fn judge_sides([left, right]: [&str; 2], gains: [[f64; 2]; 2], findings: &mut Findings) {
    let [by_left, by_right] = gains.map(|halves| halves[0] - halves[1]);
    if by_left > by_right {
        findings.pass(Group::Lamps, format!("{left} is left, and {right} is right"));
    } else {
        findings.fail(
            Group::Lamps,
            format!("{left} and {right} are the wrong way round, or both lamps are the same"),
            format!("exchange [lamps.{left}] and [lamps.{right}]: the sides are the camera's"),
        );
    }
}

/// The least and the greatest of `values`.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| (least.min(value), most.max(value)))
}
