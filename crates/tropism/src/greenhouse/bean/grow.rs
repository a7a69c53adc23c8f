//! A virtual bean without photographs: a world for statistics, where thousands of plants are wanted.

use std::convert::Infallible;
use std::ops::ControlFlow;

use rand_chacha::ChaCha8Rng;

use super::{Bean, Species};
use crate::control::Controller;
use crate::environment::{Environment, run, unwatched};
use crate::greenhouse::detector;
use crate::lamps::{Layout, Light};
use crate::observation::Observation;
use crate::random::{self, Purpose};
use crate::task::Task;
use crate::track::{PAPER_PERIOD_MIN, Sample, Track};

/// The lamps' power for a light: one of them full, or both dark.
#[must_use]
pub fn lamps(light: Option<Light>) -> [f64; 2] {
    Light::BOTH.map(|lamp| if light == Some(lamp) { 1.0 } else { 0.0 })
}

/// Whoever watches a bean without photographs: places its tip as the paper's detector would place it in one (projected,
/// leaves included, on its grid and with its noise), and notes beside that what is true.
#[derive(Default)]
pub(in crate::greenhouse) struct Watcher {
    /// The detector's noise; without it the place is exact, but for the grid.
    noise: Option<ChaCha8Rng>,
    /// What is true at each observation, in the order of [`TRUTH`].
    truth: [Vec<f64>; 5],
}

impl Watcher {
    /// The watcher of the plant of `seed`.
    pub(in crate::greenhouse) fn of(seed: u64) -> Self {
        Self { noise: Some(random::stream(seed, Purpose::Camera, 0)), ..Self::default() }
    }

    pub(in crate::greenhouse) fn observe(&mut self, bean: &Bean) -> Observation {
        let [x, y, z] = bean.apex();
        let truth = [x, y, z, bean.length(), bean.peak_curvature()];
        for (column, value) in self.truth.iter_mut().zip(truth) {
            column.push(value);
        }
        let pose = bean.pose();
        Observation::simulated(match &mut self.noise {
            Some(noise) => detector::detect(&pose, noise),
            None => detector::highest(&pose),
        })
    }

    /// `track` with what was true at each of its samples, in further columns.
    pub(in crate::greenhouse) fn complete(self, mut track: Track) -> Track {
        for (name, values) in TRUTH.into_iter().zip(self.truth) {
            track.add_numbers(name, 5, values);
        }
        track
    }
}

/// A bean by itself, and its watcher.
struct Specimen {
    layout: Layout,
    bean: Bean,
    watcher: Watcher,
}

impl Environment for Specimen {
    type Error = Infallible;

    fn observe(&mut self) -> Result<Observation, Infallible> {
        Ok(self.watcher.observe(&self.bean))
    }

    fn step(&mut self, light: Light) -> Result<(), Infallible> {
        self.bean.advance(lamps(Some(light)), PAPER_PERIOD_MIN);
        Ok(())
    }

    fn period_min(&self) -> f64 {
        PAPER_PERIOD_MIN
    }

    fn layout(&self) -> &Layout {
        &self.layout
    }
}

/// Grows the plant of `seed`, with `scale` times the variation between real plants, under `controller` until `task` is
/// over or `watch` breaks off.
///
/// The track has the columns `apex_x_cm`, `apex_y_cm`, `apex_z_cm` (the true shoot apex), `length_cm` (along the stem) and
/// `curvature_per_cm` (the largest along the stem).
///
/// ```
/// use tropism::control::Greedy;
/// use tropism::environment::unwatched;
/// use tropism::greenhouse::bean::{Species, grow};
/// use tropism::lamps::Layout;
/// use tropism::task::Targets;
/// let task = Targets { max_steps: 24, ..Targets::default() };
/// let mut controller = Greedy::new(&task, &Layout::default());
/// let track = grow(&Species::default(), 1, 1.0, &mut controller, &task, &mut unwatched);
/// assert_eq!(track.samples.len(), 25);
/// ```
pub fn grow(
    species: &Species,
    seed: u64,
    scale: f64,
    controller: &mut (impl Controller + ?Sized),
    task: &(impl Task + ?Sized),
    watch: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
) -> Track {
    let bean = Bean::new(species.draw(seed, scale), seed);
    Specimen { layout: Layout::default(), bean, watcher: Watcher::of(seed) }.live(controller, task, watch)
}

/// [`grow`] of the species' average plant, with nothing left to chance: no noise, no events, no difference between plants
/// but `phase`, in rad, that of nutation at the start.
#[must_use]
pub fn grow_quiet(
    species: &Species,
    phase: f64,
    controller: &mut (impl Controller + ?Sized),
    task: &(impl Task + ?Sized),
) -> Track {
    let bean = Bean { phase, ..Bean::quiet(species.average()) };
    Specimen { layout: Layout::default(), bean, watcher: Watcher::default() }.live(
        controller,
        task,
        &mut unwatched,
    )
}

impl Specimen {
    fn live(
        mut self,
        controller: &mut (impl Controller + ?Sized),
        task: &(impl Task + ?Sized),
        watch: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
    ) -> Track {
        let Ok(track) = run(&mut self, controller, task, watch);
        self.watcher.complete(track)
    }
}

/// The columns of a grown track beside the required ones.
pub(super) const TRUTH: [&str; 5] = ["apex_x_cm", "apex_y_cm", "apex_z_cm", "length_cm", "curvature_per_cm"];
