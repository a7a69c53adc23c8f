//! The rig file: the devices of a tent, their settings, and the policy of a run.

mod lamps;

use std::path::Path;
use std::time::Duration;

use jiff::tz::TimeZone;
use serde::{Deserialize, Serialize};
use tropism::check;
use tropism::lamps::{Layout, Light};
use tropism::lighting::{Allowed, Lighting};
use tropism::programme::{Part, Programme};
use tropism::rig::{Camera, Clock, Flash, Lamps, NoFlash, Rig, RigError, SideView};
use tropism::rig::{Durability, FaultPolicy, LampsInView};
use tropism::track::PAPER_PERIOD_MIN;
use tropism::vision::camera::stereo::{CameraPose, Side, StereoPair};
use tropism::vision::tracking::clicks::{self, Click};
use tropism::vision::{Calibration, TipTracker, VisionConfig};
use tropism_bean::tent::{Greenhouse, TentHandle};

use crate::alert::{Alerts, Origin, check_page};
use crate::broker::Broker;
use crate::clock::{TentClock, time_zone};
use crate::device::{self, DeviceLock};
use crate::driver::{AlertDriver, CameraDriver, FlashDriver};

pub(crate) use lamps::device_name;
pub use lamps::{LampControl, LampsTable, MOST_UMOL, NamedLamp};

/// A rig whose drivers are chosen by a file.
pub type AnyRig = Rig<Box<dyn Camera>, Box<dyn Lamps>, Box<dyn Flash>, Box<dyn Clock>>;

/// A rig file. Either `greenhouse`, or `camera`, `lamps` and `calibration`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct RigFile {
    /// What a power cut may cost: `full` loses no step, `fast` does not wait for the disk. If it is left out: `full` for a
    /// real tent, `fast` for the virtual one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub durability: Option<Durability>,
    /// Minutes between photographs. Paper: 5.
    #[serde(default = "five")]
    pub period_min: f64,
    /// Time zone of the programme, such as `"Europe/Berlin"`. That of the computer if it is left out; the virtual tent has a
    /// time of its own, `greenhouse.begins`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_zone: Option<String>,
    /// Which faults a run tolerates before it pauses. If it is left out, a virtual tent tolerates all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault_policy: Option<FaultPolicy>,
    /// When the controller steers in the course of a day, and a base light; outside of all parts it is night, and all lamps
    /// are dark. If it is left out, the controller steers day and night.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub programme: Vec<Part>,
    /// Regions of the photograph that show the lamps. If it is left out, the lit lamp is not checked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lamps_in_view: Option<LampsInView>,
    /// The virtual tent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub greenhouse: Option<Greenhouse>,
    /// A real camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraDriver>,
    /// Real lamps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lamps: Option<LampsTable>,
    /// A real flash; none if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flash: Option<FlashDriver>,
    /// The MQTT broker of plugs, relays and alerts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mqtt: Option<Broker>,
    /// Alert channels. Not written into run folders: they do not affect the results, may change while a run is interrupted,
    /// and hold private addresses.
    #[serde(default, skip_serializing)]
    pub alert: Vec<AlertDriver>,
    /// Address of the studio, such as `"http://greenhouse.local:8217"`: alerts link to the page of the run there. Not written into
    /// run folders, as the alerts are not.
    #[serde(default, skip_serializing)]
    pub page: Option<String>,
    /// How the real camera's photographs map to centimetres. The virtual camera knows its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<Calibration>,
    /// A second real camera at the side of the plant; tip and stem are then known in space. A virtual tent has it by
    /// `scene.cameras = 2`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side: Option<SideTable>,
    /// How the plant is detected in the photographs.
    #[serde(default)]
    pub vision: VisionConfig,
    /// Where the plant's tip was clicked in the first photographs of the run: it is followed from there. If it is left out, the
    /// tip is detected alone.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clicks: Vec<Click>,
}

/// A camera at the side of the plant, at a right angle to the one in front.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SideTable {
    /// From the lens of each camera to the plane through the root that it faces, in cm, the front camera's first. Default:
    /// that of the paper's (section 2.1).
    #[serde(default = "paper_distances")]
    pub distance_cm: [f64; 2],
    /// Where it stands, as the front camera sees it.
    #[serde(default)]
    pub from: Side,
    /// The camera.
    pub camera: CameraDriver,
    /// How its photographs map to centimetres.
    pub calibration: Calibration,
    /// How the plant is detected in its photographs.
    #[serde(default)]
    pub vision: VisionConfig,
    /// Where the plant's tip was clicked in its first photographs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clicks: Vec<Click>,
}

const fn paper_distances() -> [f64; 2] {
    [74.0; 2]
}

impl SideTable {
    /// What is wrong with it.
    fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        if !self.distance_cm.iter().all(|distance| *distance > 0.0 && distance.is_finite()) {
            faults.push(format!(
                "side: found distance_cm = {:?}, wanted two distances above 0 cm",
                self.distance_cm
            ));
        }
        let Calibration { width, height, .. } = self.calibration;
        let checks = [
            self.camera.settings().check().map_err(|problem| format!("side.camera: {problem}")),
            self.calibration.check().map_err(|problem| format!("side: {problem}")),
            self.vision.check(width, height).map_err(|problem| format!("side: {problem}")),
            clicks::check(&self.clicks, (width, height)).map_err(|problem| format!("side: {problem}")),
        ];
        faults.extend(checks.into_iter().filter_map(Result::err));
        faults
    }

    /// Opens the camera. `front` is the calibration of the one in front.
    fn open(&self, front: &Calibration, period_min: f64) -> Result<SideView, RigFileError> {
        let found = |problem: String| RigFileError(format!("side: {problem}"));
        let tracker = TipTracker::new(self.calibration, self.vision.clone())
            .and_then(|tracker| tracker.with_clicks(&self.clicks));
        let tracker = tracker.map_err(|problem| found(problem.to_string()))?.with_period(period_min);
        let camera = self.camera.settings().open().map_err(|problem| found(problem.to_string()))?;
        let views = StereoPair {
            front: CameraPose::new(front, self.distance_cm[0]),
            side: CameraPose::new(&self.calibration, self.distance_cm[1]),
            side_from: self.from,
        };
        Ok(SideView::new(camera, tracker, views))
    }
}

const fn five() -> f64 {
    PAPER_PERIOD_MIN
}

/// An invalid rig file: which key, what was found and what was wanted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RigFileError(String);

/// An opened rig.
pub struct OpenRig {
    /// The rig.
    pub rig: AnyRig,
    /// The ground truth of a virtual tent.
    pub truth: Option<TentHandle>,
}

/// The shortest time between two photographs: chosen, some milliseconds, shorter than any camera's.
const LEAST_PERIOD_MIN: f64 = 1e-4;

impl RigFile {
    /// A rig file of the virtual tent.
    #[must_use]
    pub fn greenhouse(greenhouse: Greenhouse, vision: VisionConfig) -> Self {
        Self {
            durability: None,
            period_min: PAPER_PERIOD_MIN,
            fault_policy: None,
            programme: Vec::new(),
            time_zone: None,
            lamps_in_view: None,
            greenhouse: Some(greenhouse),
            camera: None,
            lamps: None,
            flash: None,
            mqtt: None,
            alert: Vec::new(),
            page: None,
            calibration: None,
            side: None,
            vision,
            clicks: Vec::new(),
        }
    }

    /// Whether the plant is virtual.
    #[must_use]
    pub const fn is_virtual(&self) -> bool {
        self.greenhouse.is_some()
    }

    /// What a power cut may cost.
    #[must_use]
    pub fn durability(&self) -> Durability {
        self.durability.unwrap_or(if self.is_virtual() { Durability::Fast } else { Durability::Full })
    }

    /// Which faults a run tolerates before it pauses.
    #[must_use]
    pub fn fault_policy(&self) -> FaultPolicy {
        let usual = if self.is_virtual() { FaultPolicy::unlimited } else { FaultPolicy::default };
        self.fault_policy.clone().unwrap_or_else(usual)
    }

    /// Names and places of the lamps.
    ///
    /// # Errors
    /// [`RigFileError`] names the lamp that has no place, or the count, name or place that cannot be.
    pub fn layout(&self) -> Result<Layout, RigFileError> {
        let of_tent = || self.greenhouse.as_ref().map_or_else(Layout::default, |tent| tent.layout.clone());
        self.lamps.as_ref().map_or_else(|| Ok(of_tent()), LampsTable::layout).map_err(RigFileError)
    }

    /// The lightings that it allows.
    #[must_use]
    pub fn allowed(&self) -> Allowed {
        let of_lamps = self.lamps.as_ref().map(|lamps| lamps.allowed);
        of_lamps.or(self.greenhouse.as_ref().map(|tent| tent.allowed)).unwrap_or(Allowed::One)
    }

    /// Its programme; `None` where the controller steers day and night.
    ///
    /// # Errors
    /// [`RigFileError`] names the part, what was found and what was wanted.
    pub fn programme(&self) -> Result<Option<Programme>, RigFileError> {
        if self.programme.is_empty() {
            return Ok(None);
        }
        let programme = Programme::new(&self.programme, &self.layout()?, self.allowed());
        programme.map(Some).map_err(|problem| RigFileError(problem.to_string()))
    }

    /// The clock of a real tent, in which an experiment began `since_start` ago, with the local time of the programme.
    ///
    /// # Errors
    /// [`RigFileError`] if there is a programme or a time zone, and no such zone.
    pub fn clock(&self, since_start: Duration) -> Result<TentClock, RigFileError> {
        Ok(TentClock::new(since_start).in_zone(self.zone().map_err(RigFileError)?))
    }

    /// The time zone of the programme; UTC where there is none.
    fn zone(&self) -> Result<TimeZone, String> {
        if self.programme.is_empty() && self.time_zone.is_none() {
            return Ok(TimeZone::UTC);
        }
        time_zone(self.time_zone.as_deref())
    }

    /// How photographs of this rig map to centimetres; `None` until a real camera is calibrated.
    #[must_use]
    pub fn calibration(&self) -> Option<Calibration> {
        self.greenhouse.as_ref().map(Greenhouse::calibration).or(self.calibration)
    }

    /// The [calibration](Self::calibration), without which a rig can be tried but no plant measured.
    ///
    /// # Errors
    /// [`RigFileError`] says how it is made.
    pub fn calibrated(&self) -> Result<Calibration, RigFileError> {
        self.calibration().ok_or_else(|| {
            let how = "`tropism photo` takes a photograph, `tropism calibrate-camera` measures in it";
            RigFileError(format!(
                "found no [calibration], which says where the root is and what a cm is: {how}"
            ))
        })
    }

    /// Opens all alert channels; `run` is the run's name, and `folder` its folder, if it is of one run.
    ///
    /// # Errors
    /// [`RigError::Device`] if a secret cannot be read or a channel wants a broker that the file does not name. A network
    /// that is down is not an error.
    pub fn open_alerts(&self, run: &str, folder: Option<&Path>) -> Result<Alerts, RigError> {
        let origin = Origin::new(run, self.page.as_deref(), folder);
        Alerts::open(self.alert.iter().map(AlertDriver::settings), self.mqtt.as_ref(), &origin)
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`RigFileError`] names the key, what was found and what was wanted: the first of [`faults`](Self::faults).
    pub fn check(&self) -> Result<(), RigFileError> {
        self.faults().into_iter().next().map_or(Ok(()), Err)
    }

    /// Everything that a file may have got wrong: each names the key, what was found and what was wanted.
    #[must_use]
    pub fn faults(&self) -> Vec<RigFileError> {
        let mut faults = Vec::new();
        let mut add = |result: Result<(), String>| faults.extend(result.err());
        let periods = LEAST_PERIOD_MIN..=24.0 * 60.0;
        add(check::within("period_min", self.period_min, periods).map_err(|problem| problem.to_string()));
        self.fault_policy.iter().for_each(|policy| add(policy.check()));
        if let (Some(lamps), Some(Calibration { width, height, .. })) =
            (&self.lamps_in_view, self.calibration())
        {
            let layout = self.layout().map_err(|problem| problem.to_string());
            add(layout.and_then(|layout| lamps.check(width, height, &layout)));
        }
        if let Some(Calibration { width, height, .. }) = self.calibration() {
            add(clicks::check(&self.clicks, (width, height)).map_err(|problem| problem.to_string()));
        }
        // Lamps that cannot be have a fault of their own.
        if self.layout().is_ok() {
            self.programme_faults(&mut add);
        }
        for (number, alert) in (1..).zip(&self.alert) {
            add(alert.check().map_err(|problem| format!("alert {number}: {problem}")));
        }
        self.page.iter().for_each(|page| add(check_page(page)));
        match &self.greenhouse {
            Some(_) if self.has_devices() => {
                add(Err("a rig has either [greenhouse] or real devices, not both".to_owned()));
            }
            Some(greenhouse) => add(greenhouse.check().map_err(|problem| problem.to_string())),
            None => self.device_faults(&mut add),
        }
        faults.into_iter().map(RigFileError).collect()
    }

    /// What is wrong with its programme.
    fn programme_faults(&self, add: &mut impl FnMut(Result<(), String>)) {
        match self.programme() {
            Err(fault) => add(Err(fault.to_string())),
            Ok(Some(programme)) => {
                let dimmed = programme.dimmed();
                let lamps = self.lamps.iter().flat_map(LampsTable::drivers).zip((0..).map_while(Light::new));
                for ((name, driver), light) in lamps {
                    if dimmed.level(light) > 0 && !driver.settings().dims() {
                        add(Err(format!(
                            "programme: found a base light of {name} with levels, wanted a driver that dims, or full power \
                             without a ramp: this one only switches on and off"
                        )));
                    }
                }
            }
            Ok(None) => {}
        }
        match &self.time_zone {
            Some(zone) if self.is_virtual() => add(Err(format!(
                "found time_zone = {zone:?} beside greenhouse, wanted greenhouse.begins: a virtual tent has a time of its own"
            ))),
            None if self.is_virtual() => {}
            _ => add(self.zone().map(|_| ())),
        }
    }

    const fn has_devices(&self) -> bool {
        self.camera.is_some()
            || self.lamps.is_some()
            || self.flash.is_some()
            || self.mqtt.is_some()
            || self.calibration.is_some()
            || self.side.is_some()
    }

    /// What is wrong with the settings of real devices.
    fn device_faults(&self, add: &mut impl FnMut(Result<(), String>)) {
        let missing = [("camera", self.camera.is_none()), ("lamps", self.lamps.is_none())];
        let missing: Vec<String> =
            missing.iter().filter(|(_, is_missing)| *is_missing).map(|(key, _)| format!("[{key}]")).collect();
        if !missing.is_empty() {
            add(Err(format!("there is no {}: a rig has both, or [greenhouse]", missing.join(" and no "))));
        }
        if let Some(broker) = &self.mqtt {
            add(broker.check());
        }
        if let Some(camera) = &self.camera {
            add(camera.settings().check().map_err(|problem| format!("camera: {problem}")));
        }
        if let Some(lamps) = &self.lamps {
            lamps.faults(self.period_min).into_iter().for_each(|fault| add(Err(fault)));
        }
        if let Some(flash) = &self.flash {
            add(flash.settings().check().map_err(|problem| format!("flash: {problem}")));
            let mut drivers = self.lamps.iter().flat_map(LampsTable::drivers);
            if let Some((name, _)) =
                drivers.find(|(_, lamp)| flash.settings().outlet().overlaps(&lamp.settings().outlet()))
            {
                add(Err(format!("flash: it is on the line, plug or programs of {name}")));
            }
        }
        self.side.iter().flat_map(SideTable::faults).for_each(|fault| add(Err(fault)));
        if let Some(calibration) = &self.calibration {
            add(calibration.check().map_err(|problem| problem.to_string()));
            let vision = self.vision.check(calibration.width, calibration.height);
            add(vision.map_err(|problem| problem.to_string()));
        }
    }

    /// Opens the rig. `seed` is the seed of a virtual plant; the experiment with a real plant began `since_start` ago.
    ///
    /// # Errors
    /// [`RigFileError`], as [`Self::check`], or if a device cannot be found.
    pub fn open(&self, seed: u64, since_start: Duration) -> Result<OpenRig, RigFileError> {
        let locks = self.lock_devices().map_err(|error| RigFileError(error.to_string()))?;
        self.open_locked(locks, seed, since_start)
    }

    /// [`open`](Self::open) with devices that are [locked](Self::lock_devices) already.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_locked(
        &self,
        locks: Vec<DeviceLock>,
        seed: u64,
        since_start: Duration,
    ) -> Result<OpenRig, RigFileError> {
        self.check()?;
        let found = |problem: tropism::vision::VisionError| RigFileError(problem.to_string());
        let period = Duration::from_secs_f64(self.period_min * 60.0);
        if let Some(greenhouse) = &self.greenhouse {
            let (device, tracker) = greenhouse.open(seed, self.period_min, &self.vision).map_err(found)?;
            let tracker = tracker.with_clicks(&self.clicks).map_err(found)?;
            let hand = || device.clone();
            let side = greenhouse.open_side(&device, self.period_min, &self.vision).map_err(found)?;
            let rig = Rig::new(
                Box::new(hand()) as Box<dyn Camera>,
                Box::new(hand()) as Box<dyn Lamps>,
                Box::new(hand()) as Box<dyn Flash>,
                Box::new(hand()) as Box<dyn Clock>,
                tracker,
                period,
            )
            .with_layout(greenhouse.layout.clone())
            .with_side(side);
            return Ok(OpenRig { rig, truth: Some(device) });
        }
        let calibration = self.calibrated()?;
        let (Some(camera), Some(lamps)) = (&self.camera, &self.lamps) else {
            return Err(RigFileError("there are no camera and lamps".to_owned()));
        };
        let layout = self.layout()?;
        let tracker = TipTracker::new(calibration, self.vision.clone()).map_err(found)?;
        let tracker = tracker.with_period(self.period_min).with_clicks(&self.clicks).map_err(found)?;
        let device = |error: RigError| RigFileError(error.to_string());
        let flash = match &self.flash {
            Some(flash) => flash.open(self.mqtt.as_ref()).map_err(device)?,
            None => Box::new(NoFlash),
        };
        let (clock, on_exit) = (Box::new(self.clock(since_start)?) as Box<dyn Clock>, lamps.on_exit);
        let (camera, lamps) =
            (camera.settings().open().map_err(device)?, lamps.open(self.mqtt.as_ref()).map_err(device)?);
        let lamps = Box::new(LockedLamps { lamps, _locks: locks }) as Box<dyn Lamps>;
        let side = self.side.as_ref().map(|side| side.open(&calibration, self.period_min)).transpose()?;
        let rig = Rig::new(camera, lamps, flash, clock, tracker, period)
            .with_layout(layout)
            .with_on_exit(on_exit)
            .with_side(side);
        Ok(OpenRig { rig, truth: None })
    }
}

impl RigFile {
    /// Locks the lamps and the flash, so that no other run drives them until the locks are dropped. A watchdog that switches
    /// one of them off is waited for.
    ///
    /// # Errors
    /// [`RigError::Device`] if another run drives one of them.
    pub fn lock_devices(&self) -> Result<Vec<DeviceLock>, RigError> {
        let broker = self.mqtt.as_ref();
        let mut identities = self.lamps.iter().flat_map(|lamps| lamps.identities(broker)).collect::<Vec<_>>();
        identities.extend(
            self.flash.iter().map(|flash| ("flash".to_owned(), flash.settings().outlet().identity(broker))),
        );
        device::lock_all(identities)
    }
}

/// Lamps that no other run drives as long as these are open.
struct LockedLamps {
    lamps: Box<dyn Lamps>,
    _locks: Vec<DeviceLock>,
}

impl Lamps for LockedLamps {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        self.lamps.light(light)
    }

    fn shine(&mut self, lighting: Lighting) -> Result<(), RigError> {
        self.lamps.shine(lighting)
    }
}
