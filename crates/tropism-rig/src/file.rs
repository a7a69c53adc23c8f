//! The rig file: what stands in a tent.

use std::time::{Duration, SystemTime};

use serde::{Deserialize, Serialize};
use tropism::experiment::Durability;
use tropism::greenhouse::tent::{Device, Greenhouse};
use tropism::rig::{Camera, Clock, Flash, Lamps, Rig};
use tropism::track::PERIOD_MIN;
use tropism::vision::{Calibration, Eye, VisionConfig};

use crate::clock::WallClock;
use crate::command::{CommandCamera, CommandFlash, CommandLamps, NoFlash};

/// A rig whose drivers are chosen by a file.
pub type AnyRig = Rig<Box<dyn Camera>, Box<dyn Lamps>, Box<dyn Flash>, Box<dyn Clock>>;

/// A rig file. Either `greenhouse`, or `camera`, `lamps` and `calibration`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigFile {
    /// What a power cut may cost: `full` durability loses no step, `fast` writes without waiting for the disk. A real
    /// tent is `full` if the file does not say, the virtual one `fast`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub durability: Option<Durability>,
    /// Minutes between photographs. Paper: 5.
    #[serde(default = "five")]
    pub period_min: f64,
    /// The virtual tent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub greenhouse: Option<Greenhouse>,
    /// A real camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CommandCamera>,
    /// Real lamps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lamps: Option<CommandLamps>,
    /// A real flash; none if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flash: Option<CommandFlash>,
    /// How the real camera's photographs map to centimetres. The virtual camera knows its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<Calibration>,
    /// How the plant is found in the photographs.
    #[serde(default)]
    pub vision: VisionConfig,
}

const fn five() -> f64 {
    PERIOD_MIN
}

/// A rig file that cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RigFileError(String);

/// An opened rig.
pub struct OpenRig {
    /// The rig.
    pub rig: AnyRig,
    /// A hand on what is true, if the tent is virtual.
    pub truth: Option<Device>,
}

impl RigFile {
    /// The virtual tent with the paper's geometry and beans that differ as real ones do.
    #[must_use]
    pub fn greenhouse(greenhouse: Greenhouse, vision: VisionConfig) -> Self {
        Self {
            durability: None,
            period_min: PERIOD_MIN,
            greenhouse: Some(greenhouse),
            camera: None,
            lamps: None,
            flash: None,
            calibration: None,
            vision,
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

    /// How photographs of this rig map to centimetres.
    #[must_use]
    pub fn calibration(&self) -> Option<Calibration> {
        self.greenhouse.as_ref().map(Greenhouse::calibration).or(self.calibration)
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`RigFileError`] names the key, what was found and what was wanted.
    pub fn check(&self) -> Result<(), RigFileError> {
        let error = |line: String| Err(RigFileError(line));
        if !(self.period_min > 0.0 && self.period_min <= 24.0 * 60.0) {
            return error(format!("found period_min = {}, wanted above 0 and at most 1440", self.period_min));
        }
        for (key, seconds) in [
            ("camera.timeout_s", self.camera.as_ref().map(|camera| camera.timeout_s)),
            ("lamps.timeout_s", self.lamps.as_ref().map(|lamps| lamps.timeout_s)),
            ("flash.timeout_s", self.flash.as_ref().map(|flash| flash.timeout_s)),
            ("flash.settle_s", self.flash.as_ref().map(|flash| flash.settle_s)),
        ] {
            if seconds.is_some_and(|seconds| !(0.0..=3600.0).contains(&seconds)) {
                return error(format!("found {key} = {}, wanted 0 to 3600", seconds.unwrap_or_default()));
            }
        }
        if let Some(greenhouse) = &self.greenhouse {
            if self.camera.is_some()
                || self.lamps.is_some()
                || self.flash.is_some()
                || self.calibration.is_some()
            {
                return error("found greenhouse beside real devices, wanted one or the other".to_owned());
            }
            return greenhouse.check().map_err(RigFileError);
        }
        let calibration = match (&self.camera, &self.lamps, &self.calibration) {
            (Some(_), Some(_), Some(calibration)) => calibration,
            (camera, lamps, calibration) => {
                let missing = [
                    ("camera", camera.is_none()),
                    ("lamps", lamps.is_none()),
                    ("calibration", calibration.is_none()),
                ];
                let missing: Vec<&str> =
                    missing.iter().filter(|(_, is_missing)| *is_missing).map(|(key, _)| *key).collect();
                return error(format!("found no {}, wanted them, or greenhouse instead", missing.join(", ")));
            }
        };
        let found = |problem: tropism::vision::VisionError| RigFileError(problem.to_string());
        calibration.check().map_err(found)?;
        self.vision.check(calibration.width, calibration.height).map_err(found)
    }

    /// Opens the rig. `seed` is the plant's if it is virtual; `start` is when the experiment began if it is real.
    ///
    /// # Errors
    /// [`RigFileError`], as [`Self::check`].
    pub fn open(&self, seed: u64, start: SystemTime) -> Result<OpenRig, RigFileError> {
        self.check()?;
        let found = |problem: tropism::vision::VisionError| RigFileError(problem.to_string());
        let period = Duration::from_secs_f64(self.period_min * 60.0);
        if let Some(greenhouse) = &self.greenhouse {
            let (device, eye) = greenhouse.open(seed, &self.vision).map_err(found)?;
            let hand = || device.clone();
            let rig = Rig::new(
                Box::new(hand()) as Box<dyn Camera>,
                Box::new(hand()) as Box<dyn Lamps>,
                Box::new(hand()) as Box<dyn Flash>,
                Box::new(hand()) as Box<dyn Clock>,
                eye,
                period,
            );
            return Ok(OpenRig { rig, truth: Some(device) });
        }
        let (Some(camera), Some(lamps), Some(calibration)) = (&self.camera, &self.lamps, self.calibration)
        else {
            return Err(RigFileError("found no devices, wanted camera, lamps and calibration".to_owned()));
        };
        let eye = Eye::new(calibration, self.vision.clone()).map_err(found)?;
        let flash: Box<dyn Flash> = match &self.flash {
            Some(flash) => Box::new(flash.clone()),
            None => Box::new(NoFlash),
        };
        let clock = Box::new(WallClock::new(start)) as Box<dyn Clock>;
        let rig = Rig::new(
            Box::new(camera.clone()) as Box<dyn Camera>,
            Box::new(lamps.clone()) as Box<dyn Lamps>,
            flash,
            clock,
            eye,
            period,
        );
        Ok(OpenRig { rig, truth: None })
    }
}
