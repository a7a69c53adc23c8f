//! Camera, flash and lamps, opened and tried one after the other.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use tropism::lamps::{Layout, Light};
use tropism::photo::Photo;
use tropism::rig::{Camera, Clock, Flash, Lamps, NoFlash, RigError};
use tropism::vision::{Calibration, TipTracker};
use tropism_bean::tent::Greenhouse;
use tropism_rig::DeviceLock;
use tropism_rig::file::RigFile;

use super::judgement::{judge_camera, judge_flash, judge_lamp, judge_plant, judge_sides};
use super::shot::Shot;
use super::{Findings, Group, Verdict};
use crate::error::Error;
use crate::files;
use crate::monitor::Monitor;

/// Photographs with the flash; chosen by hand.
const SHOTS: usize = 5;

/// Photographs in the dark, of which the last counts: a camera may have kept frames from before. Chosen by hand.
const WARM_UP_SHOTS: usize = 3;

/// The devices of a rig; `None` stands for one that could not be opened, which was reported. Flash and lamps go dark when
/// they are dropped.
pub(super) struct Devices<'m> {
    monitor: &'m dyn Monitor,
    camera: Option<Box<dyn Camera>>,
    /// How often a photograph is tried.
    tries: u32,
    /// Whether a photograph that came at a later try only was reported.
    has_told_retry: bool,
    flash: Option<Box<dyn Flash>>,
    has_flash: bool,
    lamps: Option<Box<dyn Lamps>>,
    layout: Layout,
    /// What finds the tip; `None` without a calibration.
    tracker: Option<TipTracker>,
    calibration: Option<Calibration>,
    /// The clock of a virtual tent, whose photographs repeat unless time passes, and the period.
    clock: Option<(Box<dyn Clock>, Duration)>,
    /// The setting by which old frames of the camera are discarded.
    discard_key: Option<&'static str>,
    /// Where photographs are kept.
    kept: Option<PathBuf>,
    shots: u32,
    /// Sizes of the photographs with the flash.
    bytes: Vec<usize>,
    /// What keeps runs from driving the lamps and the flash meanwhile.
    _locks: Vec<DeviceLock>,
}

impl Drop for Devices<'_> {
    fn drop(&mut self) {
        // A device that does not obey was reported before.
        let _ = self.flash.as_mut().map(|flash| flash.flash(false));
        let _ = self.lamps.as_mut().map(|lamps| lamps.light(None));
    }
}

impl<'m> Devices<'m> {
    /// Opens the devices of `rig`; a finding names each that cannot be opened. `None` if photographs could not be judged.
    pub(super) fn open(
        rig: &RigFile,
        kept: Option<PathBuf>,
        monitor: &'m dyn Monitor,
        findings: &mut Findings,
    ) -> Option<Self> {
        match &rig.greenhouse {
            Some(greenhouse) => Self::open_virtual(rig, greenhouse, kept, monitor, findings),
            None => Self::open_real(rig, kept, monitor, findings),
        }
    }

    fn open_virtual(
        rig: &RigFile,
        greenhouse: &Greenhouse,
        kept: Option<PathBuf>,
        monitor: &'m dyn Monitor,
        findings: &mut Findings,
    ) -> Option<Self> {
        let layout = rig.layout().ok()?;
        let (device, tracker) = greenhouse
            .open(1, rig.period_min, &rig.vision)
            .and_then(|(device, tracker)| Ok((device, tracker.with_clicks(&rig.clicks)?)))
            .map_err(|error| findings.fail(Group::Camera, error.to_string(), "correct the rig file"))
            .ok()?;
        let period = Duration::from_secs_f64(60.0 * rig.period_min);
        Some(Self {
            monitor,
            camera: Some(Box::new(device.clone())),
            tries: 1,
            has_told_retry: false,
            flash: Some(Box::new(device.clone())),
            has_flash: true,
            lamps: Some(Box::new(device.clone())),
            layout,
            tracker: Some(tracker),
            calibration: rig.calibration(),
            clock: Some((Box::new(device), period)),
            discard_key: None,
            kept,
            shots: 0,
            bytes: Vec::new(),
            _locks: Vec::new(),
        })
    }

    fn open_real(
        rig: &RigFile,
        kept: Option<PathBuf>,
        monitor: &'m dyn Monitor,
        findings: &mut Findings,
    ) -> Option<Self> {
        let calibration = rig.calibration();
        let broker = rig.mqtt.as_ref();
        let locks = rig
            .lock_devices()
            .map_err(|error| {
                findings.fail(
                    Group::Lamps,
                    error.to_string(),
                    "wait until the run is over: no device was touched",
                );
            })
            .ok()?;
        let mut fail = |group, error: String| {
            findings.fail(group, error, "see that it is plugged in, free, and named as the rig file says");
        };
        // All are opened before any is given up, so that each problem is found.
        let tracker = calibration.map(|calibration| {
            TipTracker::new(calibration, rig.vision.clone())
                .and_then(|tracker| tracker.with_period(rig.period_min).with_clicks(&rig.clicks))
                .map_err(|error| fail(Group::Plant, error.to_string()))
        });
        let flash: Result<Box<dyn Flash>, ()> = match &rig.flash {
            None => Ok(Box::new(NoFlash)),
            Some(flash) => flash.open(broker).map_err(|error| fail(Group::Flash, error.to_string())),
        };
        let lamps = rig.lamps.as_ref()?.open(broker).map_err(|error| fail(Group::Lamps, error.to_string()));
        let driver = rig.camera.as_ref()?;
        let camera = driver
            .without_retries()
            .settings()
            .open()
            .map_err(|error| fail(Group::Camera, error.to_string()));
        let discard_key = driver.settings().discards_frames().then_some("camera.discard_frames");
        Some(Self {
            monitor,
            camera: camera.ok(),
            tries: driver.longest_s().1,
            has_told_retry: false,
            flash: flash.ok(),
            has_flash: rig.flash.is_some(),
            lamps: lamps.ok(),
            layout: rig.layout().ok()?,
            tracker: tracker.transpose().ok()?,
            calibration,
            clock: None,
            discard_key,
            kept,
            shots: 0,
            bytes: Vec::new(),
            _locks: locks,
        })
    }

    /// Mean size of the photographs with the flash.
    pub(super) fn photograph_bytes(&self) -> Option<u64> {
        let count = self.bytes.len();
        (count > 0).then(|| (self.bytes.iter().sum::<usize>() / count) as u64)
    }

    /// Fails if the monitor asked for an end.
    fn check_end(&self) -> Result<(), Error> {
        if self.monitor.may_go_on() { Ok(()) } else { Err(Error::Cancelled("all light is off".to_owned())) }
    }

    /// Takes a photograph with or without the flash; `None`, and a finding, if that fails.
    fn shot(&mut self, name: &str, has_flash: bool, findings: &mut Findings) -> Result<Option<Shot>, Error> {
        self.check_end()?;
        let monitor = self.monitor;
        if let Some((clock, period)) = &mut self.clock {
            let _ = clock.wait_until(*period * self.shots, &mut || match monitor.may_go_on() {
                true => ControlFlow::Continue(()),
                false => ControlFlow::Break(()),
            });
            self.check_end()?;
        }
        self.shots += 1;
        let Some(mut flash) = self.flash.take() else { return Ok(None) };
        let lit = if has_flash { flash.flash(true) } else { Ok(()) };
        let taken = self.photograph(name, findings);
        let done = [lit, if has_flash { flash.flash(false) } else { Ok(()) }];
        self.flash = Some(flash);
        for done in done {
            if let Err(error) = done {
                findings.fail(Group::Flash, error.to_string(), "see that it is plugged in and obeys by hand");
                return Ok(None);
            }
        }
        let Some((photo, took)) = taken else { return Ok(None) };
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
                    "take one by hand with the same settings; docs/reference/cameras.md has the camera's keys",
                );
                Ok(None)
            }
        }
    }

    /// Photographs, as often as the rig file says, and reports how long the last try took; `None` without a camera.
    fn photograph(
        &mut self,
        name: &str,
        findings: &mut Findings,
    ) -> Option<(Result<Photo, RigError>, Duration)> {
        let camera = self.camera.as_mut()?;
        let mut failed = None;
        for attempt in 1.. {
            let began = Instant::now();
            let photo = camera.photograph();
            let took = began.elapsed();
            match (&photo, failed) {
                (Err(error), _) if attempt < self.tries => failed = Some(error.to_string()),
                (Ok(_), Some(error)) if !self.has_told_retry => {
                    self.has_told_retry = true;
                    findings.warn(
                        Group::Camera,
                        format!(
                            "photograph {} ({name}) came only at try {attempt} of {}; before: {error}",
                            self.shots, self.tries
                        ),
                        "a camera that fails now and then: its power, its cable, its network, and camera.timeout_s",
                    );
                    return Some((photo, took));
                }
                _ => return Some((photo, took)),
            }
        }
        None
    }

    /// Lights a lamp, or none; `false`, and a finding, if a lamp does not obey.
    fn light(&mut self, light: Option<Light>, findings: &mut Findings) -> bool {
        let Some(lamps) = &mut self.lamps else { return false };
        let done = lamps.light(light);
        if let Err(error) = &done {
            let remedy = "see that it is plugged in and obeys by hand; tropism safe-state puts all light off";
            findings.fail(Group::Lamps, error.to_string(), remedy);
        }
        done.is_ok()
    }

    /// Tries all devices. Where one does not work, the others are tried without it.
    pub(super) fn examine(&mut self, findings: &mut Findings) -> Result<(), Error> {
        let is_dark = self.light(None, findings);
        let Some((dark, shots, after)) = self.take_shots(findings)? else {
            return self.examine_unseen(is_dark, findings);
        };
        judge_camera(self.calibration.as_ref(), &shots, findings);
        if self.has_flash {
            judge_flash(&dark, &shots, &after, self.discard_key, findings);
        }
        if let Some(tracker) = &mut self.tracker {
            judge_plant(tracker, &shots, findings);
        }
        if is_dark { self.examine_lamps(&after, findings) } else { Ok(()) }
    }

    /// Photographs in the dark, with the flash, and in the dark again; `None` if the camera or the flash does not work.
    fn take_shots(&mut self, findings: &mut Findings) -> Result<Option<(Shot, Vec<Shot>, Shot)>, Error> {
        for _ in 1..WARM_UP_SHOTS {
            if self.shot("dark", false, findings)?.is_none() {
                return Ok(None);
            }
        }
        let Some(dark) = self.shot("dark", false, findings)? else { return Ok(None) };
        let mut shots = Vec::new();
        for _ in 0..SHOTS {
            let Some(shot) = self.shot("flash", true, findings)? else { return Ok(None) };
            self.bytes.push(shot.photo.bytes.len());
            shots.push(shot);
        }
        Ok(self.shot("dark", false, findings)?.map(|after| (dark, shots, after)))
    }

    /// Tries whether flash and lamps obey, without photographs.
    fn examine_unseen(&mut self, is_dark: bool, findings: &mut Findings) -> Result<(), Error> {
        let has_failed = |group, findings: &Findings| {
            findings.0.iter().any(|finding| finding.group == group && finding.verdict == Verdict::Fail)
        };
        if let Some(flash) = self.flash.as_mut().filter(|_| !has_failed(Group::Flash, findings)) {
            for is_on in [true, false] {
                if let Err(error) = flash.flash(is_on) {
                    findings.fail(
                        Group::Flash,
                        error.to_string(),
                        "see that it is plugged in and obeys by hand",
                    );
                    break;
                }
            }
        }
        for light in self.layout.lights().filter(|_| is_dark) {
            self.check_end()?;
            if !self.light(Some(light), findings) || !self.light(None, findings) {
                break;
            }
        }
        Ok(())
    }

    /// Lights each lamp alone, without the flash, and photographs it and the darkness after it.
    fn examine_lamps(&mut self, dark: &Shot, findings: &mut Findings) -> Result<(), Error> {
        let mut gains = vec![None; self.layout.len()];
        for light in self.layout.lights() {
            let name = self.layout.name(Some(light)).to_owned();
            if !self.light(Some(light), findings) {
                return Ok(());
            }
            let lit = self.shot(&name, false, findings)?;
            if !self.light(None, findings) {
                return Ok(());
            }
            let (Some(lit), Some(after)) = (lit, self.shot("dark", false, findings)?) else { return Ok(()) };
            gains[light.index()] = judge_lamp(&name, dark, &lit, &after, findings);
        }
        let sides = [false, true].map(|is_right| self.layout.towards(is_right));
        let [left, right] = sides.map(|light| gains[light.index()]);
        let is_one_each_side = self.layout.side(sides[0]) < 0.0 && self.layout.side(sides[1]) > 0.0;
        if let (Some(left), Some(right), true) = (left, right, is_one_each_side) {
            let names = sides.map(|light| self.layout.name(Some(light)));
            judge_sides(names, [left, right], findings);
        }
        Ok(())
    }
}
