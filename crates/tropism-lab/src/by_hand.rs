//! Devices by hand: the workflows `lamp` and `photo`, and the rig that they open.
//!
//! The same drivers, interlock, time limit of the flash, locks and watchdog as in a run: at most one lamp is lit, all light is
//! off when the rig is dropped or its process dies, and a rig that a run drives is refused.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tropism::geometry::{Pixel, Point};
use tropism::lamps::{Layout, Light};
use tropism::photo::Photo;
use tropism::rig::{Camera, Clock, Flash, Lamps, NoFlash, OnExit};
use tropism::vision::{Frame, FrameStatus, TipTracker};
use tropism_bean::tent::TentHandle;
use tropism_rig::DeviceLock;
use tropism_rig::driver::FlashDriver;
use tropism_rig::file::RigFile;

use crate::error::Error;
use crate::files;
use crate::monitor::Monitor;
use crate::run::read_rig;
use crate::run::watchdog::Watchdog;
use crate::workflow::Workflow;

/// What stands for the flash where a lamp is named.
pub const FLASH: &str = "flash";

/// The longest time for which a lamp is lit by hand, in seconds: chosen, a lamp that is forgotten bends a plant.
pub const MAX_LIT_S: f64 = 3600.0;

/// Pause between two looks at the monitor and the time.
const TICK: Duration = Duration::from_millis(50);

/// A lamp, or the flash, for a stated time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LampPlan {
    /// Rig file.
    pub rig: PathBuf,
    /// Name of a lamp, or `flash`.
    pub lamp: String,
    /// Seconds for which it is lit, above 0 and at most 3600. A flash goes off before where its rig file says so.
    pub seconds: f64,
    /// The program `tropism`, which is started as the [watchdog](crate::watchdog); without one there is none.
    #[serde(skip)]
    pub watchdog: Option<PathBuf>,
}

/// What was lit.
#[derive(Clone, Debug, Serialize)]
pub struct LampResults {
    /// Rig file.
    pub rig: PathBuf,
    /// Whether the tent is virtual.
    pub is_virtual: bool,
    /// What was lit, and is off again.
    pub lamp: String,
    /// Seconds for which it was lit.
    pub seconds: f64,
}

/// A photograph now.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhotoPlan {
    /// Rig file.
    pub rig: PathBuf,
    /// File of the photograph.
    pub out: PathBuf,
    /// What is lit meanwhile: a lamp, `flash`, or `dark`. The flash if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<String>,
    /// Whether a file that is there is replaced.
    #[serde(default)]
    pub replace: bool,
    /// The program `tropism`, which is started as the [watchdog](crate::watchdog); without one there is none.
    #[serde(skip)]
    pub watchdog: Option<PathBuf>,
}

/// A photograph that was taken.
#[derive(Clone, Debug, Serialize)]
pub struct PhotoResults {
    /// Rig file.
    pub rig: PathBuf,
    /// Whether the tent is virtual.
    pub is_virtual: bool,
    /// File of the photograph.
    pub photograph: PathBuf,
    /// What is seen in it; `None` as long as the rig file has no calibration.
    pub seen: Option<Seen>,
}

/// What is seen in a photograph by itself, without those before it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Seen {
    /// Name of the [`FrameStatus`]: `ok`, or why no plant is seen.
    pub status: &'static str,
    /// Tip in pixels, if it was found.
    pub tip_px: Option<Pixel>,
    /// Tip in cm, if it was found.
    pub tip: Option<Point>,
    /// 0 to 1.
    pub confidence: f64,
}

/// A photograph and what is seen in it.
#[derive(Clone, Debug)]
pub struct Taken {
    /// The photograph.
    pub photo: Photo,
    /// What is seen in it; `None` as long as the rig file has no calibration.
    pub seen: Option<Seen>,
}

/// A rig that is switched by hand. Its light goes off when it is dropped, and when the process dies, by a watchdog.
pub struct RigByHand {
    rig: RigFile,
    /// Its file, for errors and those who list processes.
    path: PathBuf,
    layout: Layout,
    /// What finds the tip; `None` without a calibration.
    tracker: Option<TipTracker>,
    tent: Option<TentHandle>,
    camera: Option<Box<dyn Camera>>,
    lamps: Option<Box<dyn Lamps>>,
    flash: Option<Box<dyn Flash>>,
    lit: Option<Light>,
    /// Photographs so far.
    taken: u32,
    program: Option<PathBuf>,
    watchdog: Option<Watchdog>,
    // Last: another run may have the devices when their light is off.
    _locks: Vec<DeviceLock>,
}

impl RigByHand {
    /// Takes the devices of `rig`, which was read from `path`, for this process. Each is opened when it is first used, so
    /// that one that is missing does not keep the others from being tried.
    ///
    /// # Errors
    /// [`Error::At`] if a run drives one of the devices, or the settings of vision cannot be used.
    pub fn open(mut rig: RigFile, path: &Path, watchdog: Option<&Path>) -> Result<Self, Error> {
        rig.check().map_err(Error::at(path.display()))?;
        if let Some(lamps) = &mut rig.lamps {
            lamps.on_exit = OnExit::Dark;
        }
        let locks = rig.lock_devices().map_err(Error::at(path.display()))?;
        let (tent, tracker) = match (&rig.greenhouse, rig.calibration()) {
            (Some(tent), _) => {
                let (device, tracker) =
                    tent.open(1, rig.period_min, &rig.vision).map_err(Error::at(path.display()))?;
                (Some(device), Some(tracker))
            }
            (None, Some(calibration)) => {
                let tracker =
                    TipTracker::new(calibration, rig.vision.clone()).map_err(Error::at(path.display()))?;
                (None, Some(tracker.with_period(rig.period_min)))
            }
            (None, None) => (None, None),
        };
        Ok(Self {
            layout: rig.layout().map_err(Error::at(path.display()))?,
            path: path.to_owned(),
            tracker,
            tent,
            camera: None,
            lamps: None,
            flash: None,
            lit: None,
            taken: 0,
            program: watchdog.map(Path::to_owned),
            watchdog: None,
            _locks: locks,
            rig,
        })
    }

    /// Its lamps.
    #[must_use]
    pub const fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Whether there is a flash.
    #[must_use]
    pub const fn has_flash(&self) -> bool {
        self.tent.is_some() || self.rig.flash.is_some()
    }

    /// The lamp that is lit.
    #[must_use]
    pub const fn lit(&self) -> Option<Light> {
        self.lit
    }

    /// Switches the lamp `name`, or the [flash](FLASH); a lamp that is lit darkens the others, one that is switched off leaves all
    /// dark.
    ///
    /// # Errors
    /// [`Error::Plan`] lists the names that there are; [`Error::At`] names the device that does not obey.
    pub fn switch(&mut self, name: &str, is_on: bool) -> Result<(), Error> {
        if name == FLASH && self.has_flash() {
            return self.flash(is_on);
        }
        let light = self.layout.parse(name).ok().flatten().ok_or_else(|| {
            let names: Vec<&str> = self.layout.lamps().iter().map(|lamp| &*lamp.name).collect();
            let flash = if self.has_flash() { " or flash" } else { "" };
            Error::Plan(format!("`lamp` {name:?}: wanted one of {}{flash}", names.join(", ")))
        })?;
        self.light(Some(light).filter(|_| is_on))
    }

    /// Lights one lamp and darkens the others; `None` darkens all.
    ///
    /// # Errors
    /// [`Error::At`] names the lamp that does not obey.
    pub fn light(&mut self, light: Option<Light>) -> Result<(), Error> {
        self.watch(light.is_some())?;
        if self.lamps.is_none() {
            self.lamps = Some(match (&self.tent, &self.rig.lamps) {
                (Some(tent), _) => Box::new(tent.clone()),
                (None, Some(lamps)) => lamps.open(self.rig.mqtt.as_ref()).map_err(self.at())?,
                (None, None) => return Ok(()),
            });
        }
        let done = self.lamps.as_mut().map_or(Ok(()), |lamps| lamps.light(light));
        self.lit = light.filter(|_| done.is_ok());
        done.map_err(self.at())
    }

    /// Switches the flash.
    ///
    /// # Errors
    /// [`Error::At`] if it does not obey.
    pub fn flash(&mut self, is_on: bool) -> Result<(), Error> {
        self.watch(is_on)?;
        if self.flash.is_none() {
            self.flash = Some(match (&self.tent, &self.rig.flash) {
                (Some(tent), _) => Box::new(tent.clone()),
                (None, Some(flash)) => flash.open(self.rig.mqtt.as_ref()).map_err(self.at())?,
                (None, None) => Box::new(NoFlash),
            });
        }
        self.flash.as_mut().map_or(Ok(()), |flash| flash.flash(is_on)).map_err(self.at())
    }

    /// Takes a photograph, with or without the flash; the lamps stay as they are. In a virtual tent a period passes before
    /// each but the first.
    ///
    /// # Errors
    /// [`Error::At`] if camera or flash fail; the flash is switched off all the same.
    pub fn photograph(&mut self, has_flash: bool) -> Result<Taken, Error> {
        let time = Duration::from_secs_f64(60.0 * self.rig.period_min) * self.taken;
        if self.camera.is_none() {
            self.camera = Some(match (&self.tent, &self.rig.camera) {
                (Some(tent), _) => Box::new(tent.clone()),
                (None, Some(camera)) => camera.settings().open().map_err(self.at())?,
                (None, None) => return Err(Error::Plan(format!("{}: found no camera", self.path.display()))),
            });
        }
        if let Some(tent) = &mut self.tent {
            // A virtual clock jumps.
            let _ = tent.wait_until(time, &mut || ControlFlow::Continue(()));
        }
        let lit = if has_flash { self.flash(true) } else { Ok(()) };
        let photo = match (&lit, &mut self.camera) {
            (Ok(()), Some(camera)) => Some(camera.photograph()),
            _ => None,
        };
        let off = if has_flash { self.flash(false) } else { Ok(()) };
        lit?;
        off?;
        let Some(photo) = photo else { return Err(Error::Plan("found no camera".to_owned())) };
        let photo = Photo { time_s: time.as_secs_f64(), ..photo.map_err(self.at())? };
        self.taken += 1;
        // By itself: who moves the camera or the plant does not want what was before.
        let seen = self.tracker.clone().map(|mut tracker| {
            let seen = tracker.observe(&Frame::new(photo.clone()));
            let is_found = seen.status == FrameStatus::Ok;
            Seen {
                status: seen.status.name(),
                tip_px: seen.tip_px.filter(|_| is_found),
                tip: seen.observation.filter(|_| is_found).map(|observation| observation.tip),
                confidence: seen.confidence,
            }
        });
        Ok(Taken { photo, seen })
    }

    /// Gives the watchdog a sign of life. To be called every second while light is on.
    pub fn beat(&self) {
        self.watchdog.iter().for_each(Watchdog::beat);
    }

    /// Starts the watchdog before the first light of real devices.
    fn watch(&mut self, is_lit: bool) -> Result<(), Error> {
        if let Some(program) = self.program.as_deref().filter(|_| is_lit && self.tent.is_none())
            && self.watchdog.is_none()
        {
            self.watchdog = Some(Watchdog::start(program, &self.path, &self.rig)?);
        }
        Ok(())
    }

    fn at<E: Into<Box<dyn std::error::Error + Send + Sync>>>(&self) -> impl FnOnce(E) -> Error + use<E> {
        Error::at(self.path.display().to_string())
    }
}

impl Drop for RigByHand {
    fn drop(&mut self) {
        let flash = self.flash.as_mut().map_or(Ok(()), |flash| flash.flash(false));
        let lamps = self.lamps.as_mut().map_or(Ok(()), |lamps| lamps.light(None));
        if let Some(watchdog) = &self.watchdog {
            // A light that is not confirmed to be off is left to it.
            watchdog.end(flash.and(lamps).is_ok());
        }
    }
}

impl Workflow for LampPlan {
    type Results = LampResults;
    const SCHEMA: &'static str = "tropism.lamp/1";

    fn check(&self) -> Result<(), Error> {
        time_by_hand(self.seconds).map(drop)
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<LampResults, Error> {
        let rig = read_rig(&self.rig)?;
        let is_virtual = rig.is_virtual();
        let max_on_s = rig.flash.as_ref().filter(|_| self.lamp == FLASH).map(FlashDriver::max_on_s);
        if let Some(most) = max_on_s.filter(|most| *most < self.seconds) {
            return Err(Error::Plan(format!(
                "`seconds` {}: the flash has `max_on_s` = {most}",
                self.seconds
            )));
        }
        let mut rig = RigByHand::open(rig, &self.rig, self.watchdog.as_deref())?;
        let time = time_by_hand(self.seconds)?;
        rig.switch(&self.lamp, true)?;
        let began = Instant::now();
        while began.elapsed() < time && monitor.may_go_on() {
            rig.beat();
            thread::sleep(TICK.min(time.saturating_sub(began.elapsed())));
        }
        let seconds = began.elapsed().as_secs_f64();
        let is_over = seconds >= self.seconds;
        // Here, so that a lamp that does not obey is an error.
        rig.switch(&self.lamp, false)?;
        if !is_over {
            return Err(Error::Cancelled("all light is off".to_owned()));
        }
        Ok(LampResults { rig: self.rig.clone(), is_virtual, lamp: self.lamp.clone(), seconds })
    }
}

/// The time for which something may be lit by hand.
///
/// # Errors
/// [`Error::Plan`] if `seconds` are not above 0, or more than [`MAX_LIT_S`].
pub fn time_by_hand(seconds: f64) -> Result<Duration, Error> {
    if seconds > 0.0 && seconds <= MAX_LIT_S {
        return Ok(Duration::from_secs_f64(seconds));
    }
    Err(Error::Plan(format!("`seconds` {seconds}: wanted above 0 and at most {MAX_LIT_S}")))
}

impl Workflow for PhotoPlan {
    type Results = PhotoResults;
    const SCHEMA: &'static str = "tropism.photo/1";

    fn check(&self) -> Result<(), Error> {
        files::check_outputs(std::slice::from_ref(&self.out), std::slice::from_ref(&self.rig))?;
        files::check_free(&self.out, self.replace)
    }

    fn perform(&self, _monitor: &dyn Monitor) -> Result<PhotoResults, Error> {
        let rig = read_rig(&self.rig)?;
        let is_virtual = rig.is_virtual();
        let mut rig = RigByHand::open(rig, &self.rig, self.watchdog.as_deref())?;
        let has_flash = match self.light.as_deref() {
            None | Some(FLASH) => true,
            Some("dark") => {
                rig.light(None)?;
                false
            }
            Some(lamp) => {
                rig.switch(lamp, true)?;
                false
            }
        };
        let Taken { photo, seen } = rig.photograph(has_flash)?;
        files::write(&self.out, &photo.bytes)?;
        Ok(PhotoResults { rig: self.rig.clone(), is_virtual, photograph: self.out.clone(), seen })
    }
}

#[cfg(test)]
mod tests {
    use tropism::vision::VisionConfig;
    use tropism_bean::tent::Greenhouse;

    use super::*;
    use crate::monitor::Silent;

    fn tent() -> RigFile {
        RigFile::greenhouse(Greenhouse::default(), VisionConfig::default())
    }

    #[test]
    fn the_tip_is_seen_by_flash_and_not_in_the_dark() {
        let mut rig = RigByHand::open(tent(), Path::new("greenhouse"), None).unwrap();
        let Taken { photo, seen } = rig.photograph(true).unwrap();
        let seen = seen.unwrap();
        assert_eq!((seen.status, photo.time_s), ("ok", 0.0));
        assert!(seen.tip.is_some_and(|tip| tip.y > 2.0) && seen.tip_px.is_some(), "{seen:?}");
        // Each photograph is judged by itself: the tip before is not carried forward.
        let Taken { photo, seen } = rig.photograph(false).unwrap();
        assert_eq!((seen.unwrap().tip, photo.time_s), (None, 300.0));
        rig.light(Some(Light::LEFT)).unwrap();
        assert_eq!(rig.lit(), Some(Light::LEFT));
        rig.light(None).unwrap();
        assert_eq!(rig.lit(), None);
    }

    #[test]
    fn a_lamp_that_is_not_there_and_a_time_without_end_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let rig = folder.path().join("rig.toml");
        std::fs::write(&rig, toml::to_string(&tent()).unwrap()).unwrap();
        let lamp = |lamp: &str, seconds: f64| {
            LampPlan { rig: rig.clone(), lamp: lamp.to_owned(), seconds, watchdog: None }.execute(&Silent)
        };
        assert!(lamp("left", 0.01).unwrap().is_virtual);
        assert!(lamp(FLASH, 0.01).is_ok());
        let refused =
            [("front", 1.0, "left, right or flash"), ("left", 3601.0, "3600"), ("left", f64::NAN, "3600")];
        for (name, seconds, wanted) in refused {
            let error = lamp(name, seconds).unwrap_err().to_string();
            assert!(error.contains(wanted), "{error}");
        }
    }

    #[test]
    fn a_photograph_replaces_none_that_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let (rig, out) = (folder.path().join("rig.toml"), folder.path().join("now.jpg"));
        std::fs::write(&rig, toml::to_string(&tent()).unwrap()).unwrap();
        std::fs::write(&out, "mine").unwrap();
        let photo =
            |replace| PhotoPlan { rig: rig.clone(), out: out.clone(), light: None, replace, watchdog: None };
        assert!(photo(false).execute(&Silent).is_err());
        assert_eq!(std::fs::read(&out).unwrap(), b"mine");
        assert!(photo(true).execute(&Silent).is_ok());
        assert!(std::fs::read(&out).unwrap().starts_with(b"\xff\xd8"));
    }
}
