//! One loop for three worlds: a model, the virtual tent and a real tent.
//!
//! A world can be observed and stepped; [`run`] closes the loop of observation and light and writes down a [`Track`].
//! Simulated and measured plants both become a track, scored by one fitness: the paper's reality gap as a type.

use std::ops::ControlFlow;

use crate::control::Controller;
use crate::lamps::{Layout, Light};
use crate::lighting::Lighting;
use crate::observation::Observation;
use crate::task::Task;
use crate::track::{Sample, Track};

/// A world with one plant and its lamps.
pub trait Environment {
    /// Why the world cannot be observed or stepped.
    type Error;

    /// What is seen of the plant now.
    ///
    /// # Errors
    /// If the plant was never seen, or the world is broken.
    fn observe(&mut self) -> Result<Observation, Self::Error>;

    /// Lights one lamp for one step. In a tent this returns when the lamp is lit; the step's time passes before the next
    /// observation.
    ///
    /// # Errors
    /// If the lamp cannot be lit.
    fn step(&mut self, light: Light) -> Result<(), Self::Error>;

    /// Sets the levels of all lamps for one step, as [`Self::step`].
    ///
    /// # Errors
    /// If the lamps cannot be set so.
    ///
    /// # Panics
    /// By default for all but one lamp at full power: models are of one lamp.
    fn shine(&mut self, lighting: Lighting) -> Result<(), Self::Error> {
        self.step(lighting.one_lamp())
    }

    /// How many steps have passed so far without an observation, because of a fault. They count for the task, and are gaps
    /// in the track.
    fn missed(&self) -> u32 {
        0
    }

    /// Minutes between observations.
    fn period_min(&self) -> f64;

    /// The lamps.
    fn layout(&self) -> &Layout;
}

/// Runs `controller` in `world` until `task` is over, or `watch` breaks off.
///
/// `watch` sees each sample as it is complete: what was seen and the light decided for it. The track of N steps has N + 1
/// samples, the last one dark, fewer if the world missed some. A broken-off track ends with the sample at which `watch`
/// broke off.
///
/// # Errors
/// Those of the world.
pub fn run<W: Environment>(
    world: &mut W,
    controller: &mut (impl Controller + ?Sized),
    task: &Task,
    watch: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
) -> Result<Track, W::Error> {
    let mut recording = Recording::new(world.layout().clone(), world.period_min());
    loop {
        let seen = world.observe()?;
        match recording.decide(seen, world.missed(), controller, task, watch) {
            Some(lighting) => world.shine(lighting)?,
            None => return Ok(recording.track),
        }
    }
}

/// A run in progress: everything that [`run`] does but observing and stepping the world.
pub struct Recording {
    /// The track so far.
    pub track: Track,
    /// Steps taken.
    taken: u32,
    /// Missed steps that were reported to the controller.
    missed: u32,
}

impl Recording {
    /// A run that begins: no sample yet.
    #[must_use]
    pub fn new(layout: Layout, period_min: f64) -> Self {
        Self { track: Track { layout, period_min, ..Track::default() }, taken: 0, missed: 0 }
    }

    /// Records what is `seen` and the lighting decided for it; `None` if the task is over or `watch` breaks off.
    pub fn decide(
        &mut self,
        seen: Observation,
        missed: u32,
        controller: &mut (impl Controller + ?Sized),
        task: &Task,
        watch: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
    ) -> Option<Lighting> {
        let step = self.taken + missed;
        if missed > self.missed {
            controller.miss(missed - std::mem::replace(&mut self.missed, missed));
        }
        let is_over = task.is_over(step, &seen);
        let lighting = (!is_over).then(|| controller.lighting(&seen));
        let time_s = f64::from(step) * self.track.period_min * 60.0;
        let sample = Sample::of(seen, step, time_s, lighting.unwrap_or_default());
        let flow = watch(&sample);
        self.track.samples.push(sample);
        self.taken += 1;
        lighting.filter(|_| flow.is_continue())
    }
}

/// A `watch` for [`run`] that never breaks off.
pub fn unwatched(_sample: &Sample) -> ControlFlow<()> {
    ControlFlow::Continue(())
}
