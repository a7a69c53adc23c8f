//! A tent as the loop sees it: camera, lamps, flash and clock.
//!
//! Drivers implement four small traits; [`Rig`] makes an [`Environment`] of them and an [`Eye`]. The virtual tent
//! ([`crate::greenhouse`]) is a rig like any other, so it exercises all of this.

use std::time::Duration;

use crate::environment::Environment;
use crate::light::Light;
use crate::observation::Observation;
use crate::photo::Photo;
use crate::vision::{Eye, Seen};

/// Takes photographs.
pub trait Camera {
    /// A fresh photograph.
    ///
    /// # Errors
    /// If the camera gives none.
    fn photograph(&mut self) -> Result<Photo, RigError>;

    /// Passes over a photograph that was taken before an interruption.
    ///
    /// Nothing in front of a real plant, which has grown by itself; a recording goes on by one.
    fn skip(&mut self) {}
}

/// The two lamps, of which at most one is lit.
pub trait Lamps {
    /// Lights one lamp and darkens the other; `None` darkens both, the safe state.
    ///
    /// # Errors
    /// If a lamp does not obey.
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError>;
}

/// The flash that makes the plant bright in a photograph.
pub trait Flash {
    /// Switches the flash.
    ///
    /// # Errors
    /// If the flash does not obey.
    fn flash(&mut self, is_on: bool) -> Result<(), RigError>;
}

/// Time since the start of an experiment: sleeps in a tent, jumps in the virtual one.
pub trait Clock {
    /// Returns when `since_start` has come. Returns at once if it has passed.
    fn wait_until(&mut self, since_start: Duration);

    /// Lives again through a step that was recorded before an interruption: `light` is lit until `until`.
    ///
    /// In a real tent that time has passed by itself.
    fn relive(&mut self, _light: Light, _until: Duration) {}
}

impl<T: Camera + ?Sized> Camera for Box<T> {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        (**self).photograph()
    }

    fn skip(&mut self) {
        (**self).skip();
    }
}

impl<T: Lamps + ?Sized> Lamps for Box<T> {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        (**self).light(light)
    }
}

impl<T: Flash + ?Sized> Flash for Box<T> {
    fn flash(&mut self, is_on: bool) -> Result<(), RigError> {
        (**self).flash(is_on)
    }
}

impl<T: Clock + ?Sized> Clock for Box<T> {
    fn wait_until(&mut self, since_start: Duration) {
        (**self).wait_until(since_start);
    }

    fn relive(&mut self, light: Light, until: Duration) {
        (**self).relive(light, until);
    }
}

/// Why a rig cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// A device failed.
    #[error("{device}: {problem}")]
    Device {
        /// Which device, with enough of its address to find it.
        device: String,
        /// What was found, and what was wanted.
        problem: String,
    },
    /// The first photograph shows no plant: there is nothing to hold.
    #[error(
        "{photo}: found no plant ({class}) in the first photograph, wanted one inside the region of interest"
    )]
    NeverSeen {
        /// Name of the photograph.
        photo: String,
        /// Class of the photograph.
        class: String,
    },
}

/// The latest photograph and what was seen in it.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The photograph.
    pub photo: Photo,
    /// What was seen.
    pub seen: Seen,
}

/// A tent: its devices and the eye that reads its photographs.
///
/// Dropping a rig darkens its lamps.
#[derive(Debug)]
pub struct Rig<C, L: Lamps, F, K> {
    camera: C,
    lamps: L,
    flash: F,
    clock: K,
    eye: Eye,
    period: Duration,
    step: u32,
    shot: Option<Shot>,
}

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Rig<C, L, F, K> {
    /// A tent that is observed every `period`, beginning at the clock's start.
    pub const fn new(camera: C, lamps: L, flash: F, clock: K, eye: Eye, period: Duration) -> Self {
        Self { camera, lamps, flash, clock, eye, period, step: 0, shot: None }
    }

    /// The latest photograph, once there is one.
    pub const fn shot(&self) -> Option<&Shot> {
        self.shot.as_ref()
    }

    /// Lives again through a recorded step: what was seen at its beginning, and the light that was lit until its end.
    pub fn relive(&mut self, shot: &Shot, light: Light) {
        self.recall(shot);
        self.clock.relive(light, self.period * self.step);
    }

    /// Takes up what was seen at the latest step, which is not over: its photograph need not be taken again.
    pub fn recall(&mut self, shot: &Shot) {
        self.eye.resume(&shot.photo, &shot.seen);
        self.camera.skip();
        self.step += 1;
    }
}

impl<C: Camera, L: Lamps, F: Flash, K: Clock> Environment for Rig<C, L, F, K> {
    type Error = RigError;

    fn observe(&mut self) -> Result<Observation, RigError> {
        self.clock.wait_until(self.period * self.step);
        self.flash.flash(true)?;
        let photo = self.camera.photograph();
        // Off again whether or not the camera obeyed.
        self.flash.flash(false)?;
        let mut photo = photo?;
        photo.name = format!("{:06}.jpg", self.step);
        photo.time_s = (self.period * self.step).as_secs_f64();
        self.step += 1;
        let seen = self.eye.observe(&photo);
        let Some(observation) = seen.observation.clone() else {
            return Err(RigError::NeverSeen { photo: photo.name, class: seen.class.to_string() });
        };
        self.shot = Some(Shot { photo, seen });
        Ok(observation)
    }

    fn step(&mut self, light: Light) -> Result<(), RigError> {
        self.lamps.light(Some(light))
    }

    fn period_min(&self) -> f64 {
        self.period.as_secs_f64() / 60.0
    }
}

impl<C, L: Lamps, F, K> Drop for Rig<C, L, F, K> {
    fn drop(&mut self) {
        // Nobody is left to be told of a failure here; drivers keep their own last resort.
        let _ = self.lamps.light(None);
    }
}
