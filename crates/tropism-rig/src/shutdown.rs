//! Shutdown of a tent into its safe state: flash off, lamps as `on_exit` says.
//!
//! For the time after a program was killed, and for users who want all light off now. Each device is opened separately, so
//! that one missing device does not keep the others lit.

use tropism::rig::{Lamps, OnExit, RigError};

use crate::device::{Attempt, DeviceLock, Owner};
use crate::file::{RigFile, device_name};
use crate::retry::{retry, two};
use crate::switch::Switch;

/// How the shutdown of one device went.
#[derive(Debug)]
pub struct DeviceShutdown {
    /// `flash`, `lamps`, or the lamp's name and `lamp`, as in `left lamp`.
    pub device: String,
    /// Whether it confirmed to be off, as far as it can.
    pub result: Result<(), RigError>,
}

/// Switches off the flash and all lamps; lamps with [`OnExit::Keep`] only if `is_all`.
///
/// Each device is tried three times. A virtual tent has none.
#[must_use]
pub fn shut_down(rig: &RigFile, is_all: bool) -> Vec<DeviceShutdown> {
    let shutdown = |source: LightSource<'_>| DeviceShutdown {
        result: retry(two(), || source.switch_off()),
        device: source.device,
    };
    light_sources(rig, is_all).into_iter().map(shutdown).collect()
}

/// A device that gives light, or all lamps where one program darkens them.
pub struct LightSource<'a> {
    /// `flash`, `lamps`, or the lamp's name and `lamp`, as in `left lamp`.
    pub device: String,
    /// What it is, for its locks.
    identities: Vec<String>,
    off: Box<dyn Fn() -> Result<(), RigError> + 'a>,
}

/// The flash and all lamps of `rig`; lamps with [`OnExit::Keep`] only if `is_all`. A virtual tent has none.
#[must_use]
pub fn light_sources(rig: &RigFile, is_all: bool) -> Vec<LightSource<'_>> {
    let broker = rig.mqtt.as_ref();
    let mut sources = Vec::new();
    if let Some(flash) = &rig.flash {
        sources.push(LightSource {
            device: "flash".to_owned(),
            identities: vec![flash.settings().outlet().identity(broker)],
            // Opening a flash switches it off.
            off: Box::new(move || flash.open(broker).map(drop)),
        });
    }
    let Some(lamps) = rig.lamps.as_ref().filter(|lamps| is_all || lamps.on_exit == OnExit::Dark) else {
        return sources;
    };
    let identities = lamps.identities(broker).into_iter().map(|(_, identity)| identity);
    if let Some(programs) = lamps.programs() {
        let off = Box::new(move || programs.clone().light(None));
        sources.push(LightSource { device: "lamps".to_owned(), identities: identities.collect(), off });
        return sources;
    }
    sources.extend(lamps.drivers().zip(identities).map(|((name, driver), identity)| {
        let device = device_name(name);
        let off = {
            let device = device.clone();
            Box::new(move || driver.settings().open(&device, broker)?.switch(false))
        };
        LightSource { device, identities: vec![identity], off }
    }));
    sources
}

impl LightSource<'_> {
    /// Switches it off: one attempt.
    ///
    /// # Errors
    /// [`RigError::Device`] if it does not confirm.
    pub fn switch_off(&self) -> Result<(), RigError> {
        (self.off)()
    }

    /// Switches it off after the end of `run`: one attempt, for which runs that begin wait. Returns the owner of a device that
    /// another run drives by now: it is left alone. Only a process of this user or of root is believed to be a run.
    ///
    /// # Errors
    /// [`RigError::Device`] if it does not confirm.
    pub fn switch_off_after(&self, run: u32) -> Result<Option<Owner>, RigError> {
        let locks: Vec<_> =
            self.identities.iter().map(|identity| DeviceLock::of_watchdog(identity)).collect();
        let owner = locks.iter().find_map(|(watchdog, device)| match (watchdog, device) {
            (Attempt::Locked(_), Attempt::InUse(Some(owner))) if is_other_run(*owner, run) => Some(*owner),
            _ => None,
        });
        if owner.is_none() {
            self.switch_off()?;
        }
        Ok(owner)
    }
}

/// Whether `owner` may drive a device that `run` has left: not a stranger, who would keep its light on, and not `run` itself,
/// which may still be dying.
fn is_other_run(owner: Owner, run: u32) -> bool {
    #[cfg(unix)]
    let is_own = [0, rustix::process::getuid().as_raw()].contains(&owner.user);
    #[cfg(not(unix))]
    let is_own = true;
    is_own && owner.process != run
}
