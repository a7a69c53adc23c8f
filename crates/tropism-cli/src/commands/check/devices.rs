//! Camera, flash and lamps, tried one after the other and judged by photographs.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Result;
use tropism::lamps::{Layout, Light};
use tropism::observation::Quality;
use tropism::photo::{Image, Photo};
use tropism::rig::{Camera, Clock, Flash, Lamps};
use tropism::vision::{Calibration, Frame, FrameStatus, TipTracker, VisionConfig};
use tropism_lab::files;
use tropism_rig::driver::CameraDriver;
use tropism_rig::file::RigFile;
use tropism_rig::switch::NoFlash;

use super::{Findings, Group};
use crate::shell::{Interrupted, Shell};

/// Photographs with the flash.
const SHOTS: usize = 5;

/// Grey levels of 255 by which two photographs of the same light differ at most, on the mean.
const NOISE: f64 = 2.0;

/// The devices of a rig, opened. Dark when dropped.
pub(super) struct Devices {
    camera: Box<dyn Camera>,
    flash: Box<dyn Flash>,
    has_flash: bool,
    lamps: Box<dyn Lamps>,
    layout: Layout,
    tracker: TipTracker,
    calibration: Calibration,
    /// The clock of a virtual tent, whose photographs repeat unless time passes, and the period.
    clock: Option<(Box<dyn Clock>, Duration)>,
    /// How frames that the camera kept are thrown away.
    discards: Option<&'static str>,
    kept: Option<PathBuf>,
    shots: u32,
    bytes: Vec<usize>,
}

impl Drop for Devices {
    fn drop(&mut self) {
        // Each was asked before, and said so if it did not obey.
        let _ = self.flash.flash(false);
        let _ = self.lamps.light(None);
    }
}

/// A photograph and how bright it is, in grey levels of 255.
struct Shot {
    photo: Photo,
    image: Image,
    took: Duration,
    mean: f64,
    /// Of the left and the right half.
    halves: [f64; 2],
}

impl Shot {
    fn new(photo: Photo, took: Duration) -> Result<Self, String> {
        let image = photo.decode().map_err(|error| error.to_string())?;
        let middle = 3 * image.width / 2 / 3 * 3;
        let (mut sums, mut counts) = ([0.0; 2], [0.0; 2]);
        for row in image.rgb.chunks_exact(3 * image.width) {
            for (side, half) in [&row[..middle], &row[middle..]].into_iter().enumerate() {
                sums[side] += half.iter().map(|&level| f64::from(level)).sum::<f64>();
                counts[side] += half.len() as f64;
            }
        }
        let mean = (sums[0] + sums[1]) / (counts[0] + counts[1]);
        let halves = [0, 1].map(|side| sums[side] / f64::max(counts[side], 1.0));
        Ok(Self { photo, image, took, mean, halves })
    }

    /// How sharp it is: the mean difference of neighbours in a row, in grey levels.
    fn sharpness(&self) -> f64 {
        let differences = self.image.rgb.chunks_exact(3 * self.image.width).flat_map(|row| {
            row.chunks_exact(3).zip(row.chunks_exact(3).skip(1)).map(|(a, b)| f64::from(a[1].abs_diff(b[1])))
        });
        let (sum, count) = differences.fold((0.0, 0.0), |(sum, count), found| (sum + found, count + 1.0));
        sum / f64::max(count, 1.0)
    }
}

impl Devices {
    /// The devices of `rig`; `None`, and a line, if one cannot be opened.
    pub(super) fn open(rig: &RigFile, kept: Option<PathBuf>, findings: &mut Findings) -> Option<Self> {
        let calibration = rig.calibration()?;
        let layout = rig.layout().ok()?;
        if let Some(greenhouse) = &rig.greenhouse {
            let (device, tracker) = greenhouse
                .open(1, rig.period_min, &rig.vision)
                .map_err(|error| findings.fail(Group::Camera, error.to_string(), "correct the rig file"))
                .ok()?;
            let period = Duration::from_secs_f64(60.0 * rig.period_min);
            return Some(Self {
                camera: Box::new(device.clone()),
                flash: Box::new(device.clone()),
                has_flash: true,
                lamps: Box::new(device.clone()),
                layout,
                tracker,
                calibration,
                clock: Some((Box::new(device), period)),
                discards: None,
                kept,
                shots: 0,
                bytes: Vec::new(),
            });
        }
        let broker = rig.mqtt.as_ref();
        let mut problem = |group, error: String| {
            findings.fail(group, error, "see that it is plugged in, free, and named as the rig file says");
        };
        let tracker = TipTracker::new(calibration, VisionConfig { ..rig.vision.clone() })
            .map_err(|error| problem(Group::Plant, error.to_string()));
        let flash: Result<Box<dyn Flash>, ()> = match &rig.flash {
            None => Ok(Box::new(NoFlash)),
            Some(flash) => flash.open(broker).map_err(|error| problem(Group::Flash, error.to_string())),
        };
        let lamps =
            rig.lamps.as_ref()?.open(broker).map_err(|error| problem(Group::Lamps, error.to_string()));
        let camera = rig.camera.as_ref()?;
        let opened = camera.open().map_err(|error| problem(Group::Camera, error.to_string()));
        let discards = match camera {
            CameraDriver::Http(_) | CameraDriver::V4l2(_) => Some("camera.discard_frames"),
            _ => None,
        };
        Some(Self {
            camera: opened.ok()?,
            flash: flash.ok()?,
            has_flash: rig.flash.is_some(),
            lamps: lamps.ok()?,
            layout,
            tracker: tracker.ok()?,
            calibration,
            clock: None,
            discards,
            kept,
            shots: 0,
            bytes: Vec::new(),
        })
    }

    /// The mean size of the photographs with the flash.
    pub(super) fn photograph_bytes(&self) -> Option<u64> {
        let count = self.bytes.len();
        (count > 0).then(|| (self.bytes.iter().sum::<usize>() / count) as u64)
    }

    /// A photograph, with the flash or without; `None`, and a line, if there is none.
    fn shot(&mut self, name: &str, has_flash: bool, findings: &mut Findings) -> Result<Option<Shot>> {
        if Shell::is_interrupted() {
            return Err(Interrupted("all light is off".to_owned()).into());
        }
        if let Some((clock, period)) = &mut self.clock {
            let flow = clock.wait_until(*period * self.shots, &mut || {
                if Shell::is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            if flow.is_break() {
                return Err(Interrupted("all light is off".to_owned()).into());
            }
        }
        self.shots += 1;
        let lit = if has_flash { self.flash.flash(true) } else { Ok(()) };
        let began = Instant::now();
        let photo = self.camera.photograph();
        let took = began.elapsed();
        for done in [lit, if has_flash { self.flash.flash(false) } else { Ok(()) }] {
            if let Err(error) = done {
                findings.fail(Group::Flash, error.to_string(), "see that it is plugged in and obeys by hand");
                return Ok(None);
            }
        }
        let shot = photo.map_err(|error| error.to_string()).and_then(|photo| {
            if let Some(folder) = &self.kept {
                let path = folder.join(format!("{:02}-{name}.jpg", self.shots));
                files::write(&path, &photo.bytes).map_err(|error| error.to_string())?;
            }
            Shot::new(photo, took)
        });
        match shot {
            Ok(shot) => Ok(Some(shot)),
            Err(error) => {
                findings.fail(
                    Group::Camera,
                    format!("photograph {} ({name}): {error}", self.shots),
                    "take one by hand with the same settings; docs/rig.md has the camera's keys",
                );
                Ok(None)
            }
        }
    }

    /// Lights a lamp, or none; `false`, and a line, if a lamp does not obey.
    fn light(&mut self, light: Option<Light>, findings: &mut Findings) -> bool {
        let done = self.lamps.light(light);
        if let Err(error) = &done {
            let remedy = "see that it is plugged in and obeys by hand; tropism safe-state puts all light off";
            findings.fail(Group::Lamps, error.to_string(), remedy);
        }
        done.is_ok()
    }

    /// Tries all of them. Stops at the first that does not work at all: the rest is judged by it.
    pub(super) fn examine(&mut self, findings: &mut Findings) -> Result<()> {
        if !self.light(None, findings) {
            return Ok(());
        }
        // More than one, for a camera may have kept frames from before.
        let mut dark = None;
        for _ in 0..3 {
            dark = self.shot("dark", false, findings)?;
            if dark.is_none() {
                return Ok(());
            }
        }
        let Some(dark) = dark else { return Ok(()) };
        let mut shots = Vec::new();
        for _ in 0..SHOTS {
            let Some(shot) = self.shot("flash", true, findings)? else { return Ok(()) };
            self.bytes.push(shot.photo.bytes.len());
            shots.push(shot);
        }
        let Some(after) = self.shot("dark", false, findings)? else { return Ok(()) };
        self.judge_camera(&shots, findings);
        if self.has_flash {
            self.judge_flash(&dark, &shots, &after, findings);
        }
        self.judge_plant(&shots, findings);
        self.examine_lamps(&after, findings)
    }

    fn judge_camera(&self, shots: &[Shot], findings: &mut Findings) {
        let Calibration { width, height, .. } = self.calibration;
        let (found_width, found_height) = (shots[0].image.width, shots[0].image.height);
        let longest = shots.iter().map(|shot| shot.took).max().unwrap_or_default().as_secs_f64();
        if (found_width, found_height) == (width, height) {
            let found = format!("{SHOTS} photographs of {width} x {height} pixels, {longest:.1} s at most");
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
        if most - least > NOISE + 0.03 * most {
            findings.warn(
                Group::Camera,
                format!("the same light gives {levels}: exposure, gain or white balance is not fixed"),
                "fix all three in the camera's table, or in the camera",
            );
        } else {
            findings.pass(Group::Camera, format!("the same light gives {levels}"));
        }
        if most < 8.0 || least > 247.0 {
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

    fn judge_flash(&self, dark: &Shot, shots: &[Shot], after: &Shot, findings: &mut Findings) {
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
        let discards = |count: usize| match self.discards {
            Some(key) => format!("raise {key} by {count} or more, or flash.settle_s"),
            None => "raise flash.settle_s; or the camera gives frames that it kept".to_owned(),
        };
        if late > 0 {
            findings.fail(
                Group::Flash,
                format!(
                    "it shows {late} photographs late: the camera gives old frames, or the flash is slow"
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

    fn judge_plant(&mut self, shots: &[Shot], findings: &mut Findings) {
        let frames = shots.iter().map(|shot| Frame::new(shot.photo.clone()));
        let seen: Vec<_> = frames.map(|frame| self.tracker.observe(&frame)).collect();
        let is_measured =
            |quality: Option<Quality>| quality.is_some_and(|quality| quality == Quality::Measured);
        let tips: Vec<_> = seen
            .iter()
            .filter(|seen| is_measured(seen.observation.as_ref().map(|observation| observation.quality)))
            .filter_map(|seen| Some((seen.tip_px?, seen.observation.as_ref()?.tip)))
            .collect();
        if tips.len() < shots.len() {
            let class = seen.iter().map(|seen| seen.status).find(|&class| class != FrameStatus::Ok);
            let class = class.map_or_else(String::new, |class| format!(" ({class})"));
            findings.fail(
                Group::Plant,
                format!("seen in {} of {} photographs{class}", tips.len(), shots.len()),
                "tropism track PHOTOGRAPHS --guide shows crop and base; --photographs DIR keeps these",
            );
            return;
        }
        let (left, right) = range(tips.iter().map(|(pixel, _)| pixel.x));
        let (top, bottom) = range(tips.iter().map(|(pixel, _)| pixel.y));
        let spread = f64::max(right - left, bottom - top);
        let tip = tips[tips.len() - 1].1;
        let place = format!("its tip is at {:.1}, {:.1} cm, within {spread:.1} pixels", tip.x, tip.y);
        if spread >= 2.0 {
            findings.warn(
                Group::Plant,
                place,
                "less noise (gain), sharper focus, a calmer background; or the plant swings: no fan on it",
            );
        } else if !(0.2..=60.0).contains(&tip.y) || tip.x.abs() > 40.0 {
            findings.warn(Group::Plant, place, "a bean is not there: px_per_cm and base of the calibration");
        } else {
            findings.pass(Group::Plant, place);
        }
    }

    /// Each lamp alone, without the flash, and darkness after each.
    fn examine_lamps(&mut self, dark: &Shot, findings: &mut Findings) -> Result<()> {
        let mut towards_left = vec![0.0; self.layout.len()];
        let mut is_visible = true;
        for light in self.layout.lights() {
            let word = self.layout.name(Some(light)).to_owned();
            let name = format!("{word} lamp");
            if !self.light(Some(light), findings) {
                return Ok(());
            }
            let shot = self.shot(&word, false, findings)?;
            if !self.light(None, findings) {
                return Ok(());
            }
            let (Some(lit), Some(after)) = (shot, self.shot("dark", false, findings)?) else { return Ok(()) };
            let gain = lit.mean - dark.mean;
            let halves = [0, 1].map(|half| lit.halves[half] - dark.halves[half]);
            towards_left[light.index()] = halves[0] - halves[1];
            if gain < NOISE {
                is_visible = false;
                findings.warn(
                    Group::Lamps,
                    format!("{name}: did what it was told, and the photograph does not show it ({gain:+.1} levels)"),
                    "look whether it lights; if it does, these photographs are too short to show it",
                );
                continue;
            }
            let found = format!(
                "{name}: brighter by {:.0} levels at the left, {:.0} at the right",
                halves[0], halves[1]
            );
            findings.pass(Group::Lamps, found);
            if after.mean > dark.mean + f64::max(NOISE, gain / 2.0) {
                findings.fail(
                    Group::Lamps,
                    format!("{name}: the photograph after it shows it still"),
                    "it does not go dark, or the camera gives old frames",
                );
            }
        }
        let [left, right] = [false, true].map(|is_right| self.layout.towards(is_right));
        if is_visible && self.layout.side(left) < 0.0 && self.layout.side(right) > 0.0 {
            let [left_name, right_name] = [left, right].map(|light| self.layout.name(Some(light)));
            if towards_left[left.index()] > towards_left[right.index()] {
                findings.pass(Group::Lamps, format!("{left_name} is left, and {right_name} is right"));
            } else {
                findings.fail(
                    Group::Lamps,
                    format!(
                        "{left_name} and {right_name} are the wrong way round, or both lamps are the same"
                    ),
                    format!(
                        "exchange [lamps.{left_name}] and [lamps.{right_name}]: the sides are the camera's"
                    ),
                );
            }
        }
        Ok(())
    }
}

fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| (least.min(value), most.max(value)))
}
