//! A virtual bean without photographs: an environment for statistics over thousands of plants.

use std::convert::Infallible;
use std::ops::ControlFlow;

use rand_chacha::ChaCha8Rng;
use tropism::control::Controller;
use tropism::environment::{Environment, Recording, run, unwatched};
use tropism::lamps::{Layout, Light, MAX_LAMPS};
use tropism::lighting::Lighting;
use tropism::observation::Observation;
use tropism::obstacle::Solid;
use tropism::random::{self, Purpose};
use tropism::task::Task;
use tropism::track::{PAPER_PERIOD_MIN, Sample, Track};

use super::{Bean, Population, Species};
use crate::detector;

/// The powers of the lamps for a light: one at full power, or all dark.
#[must_use]
pub fn lamp_powers(light: Option<Light>) -> [f64; MAX_LAMPS] {
    Lighting::from(light).powers()
}

/// The powers of the lamps of `layout`; all dark where the plant is in the dark, whatever was decided.
fn powers_in(layout: &Layout, is_dark: bool, lighting: Lighting) -> [f64; MAX_LAMPS] {
    if is_dark { Lighting::DARK } else { lighting.within(layout) }.powers()
}

/// Observes a bean without photographs, and records its ground truth.
///
/// The tip is placed as the paper's detector places it in a photograph: projected, leaves included, on the detector's grid
/// and with its noise. The stem is ten points, as in the paper, with noise of their own.
#[derive(Clone, Default)]
pub(crate) struct Observer {
    /// The detector's noise of the tip and that of the stem; `None` leaves the rounding of the tip to the grid alone.
    noise: Option<[ChaCha8Rng; 2]>,
    /// The noise of a second camera, which sees the plant from the side; `None` without one.
    side: Option<ChaCha8Rng>,
    /// Ground truth at each observation, in the order of [`TRUTH`].
    truth: [Vec<f64>; 5],
}

impl Observer {
    /// An observer with the detector noise of the plant of `seed`; with `in_space` a second camera sees it from the side.
    pub(crate) fn of(seed: u64, in_space: bool) -> Self {
        let stream = |index| random::stream(seed, Purpose::Camera, index);
        Self { noise: Some([stream(0), stream(1)]), side: in_space.then(|| stream(2)), ..Self::default() }
    }

    /// The tip and the stem as the detector places them.
    pub(crate) fn observe(&mut self, bean: &Bean) -> Observation {
        let pose = bean.pose();
        let [x, y, z] = pose.apex();
        let truth = [x, y, z, bean.length(), bean.peak_curvature()];
        for (column, value) in self.truth.iter_mut().zip(truth) {
            column.push(value);
        }
        let (tip, stem) = match &mut self.noise {
            Some([of_tip, of_stem]) => {
                (detector::detect(&pose, of_tip), detector::detect_stem(&pose, of_stem))
            }
            None => (detector::highest_point(&pose), detector::midline(&pose)),
        };
        let seen = Observation { stem: Some(stem), ..Observation::simulated(tip) };
        match &mut self.side {
            Some(noise) => detector::detect_in_space(&pose, seen, noise),
            None => seen,
        }
    }

    /// Adds the ground truth at each sample and the points of the stems to `track`, in further columns.
    pub(crate) fn complete(self, mut track: Track) -> Track {
        for (name, values) in TRUTH.into_iter().zip(self.truth) {
            track.add_numbers(name, 5, values);
        }
        track.add_stem_columns();
        track
    }
}

/// A bean without photographs as an environment: that of [`Trial::specimen`].
///
/// Copies share the past and, under the same lights, the future: all noise is part of the plant. So a search can try what
/// would become of one plant under other lights.
#[derive(Clone)]
pub struct Specimen {
    layout: Layout,
    period_min: f64,
    bean: Bean,
    observer: Observer,
    is_dark: bool,
}

impl Environment for Specimen {
    type Error = Infallible;

    fn observe(&mut self) -> Result<Observation, Infallible> {
        Ok(self.observer.observe(&self.bean))
    }

    fn step(&mut self, light: Light) -> Result<(), Infallible> {
        self.shine(light.into())
    }

    fn shine(&mut self, lighting: Lighting) -> Result<(), Infallible> {
        self.bean.advance(&powers_in(&self.layout, self.is_dark, lighting), self.period_min);
        Ok(())
    }

    fn period_min(&self) -> f64 {
        self.period_min
    }

    fn layout(&self) -> &Layout {
        &self.layout
    }
}

impl Specimen {
    /// The tip and the stem as a detector without noise places them, in space if two cameras see the plant. The tip is on the
    /// detector's grid.
    #[must_use]
    pub fn without_noise(&self) -> Observation {
        match self.observer.side {
            Some(_) => detector::seen_in_space(&self.bean.pose()),
            None => Observer::default().observe(&self.bean),
        }
    }

    /// The plant as it is.
    #[must_use]
    pub fn bean(&self) -> &Bean {
        &self.bean
    }

    fn run(
        mut self,
        controller: &mut (impl Controller + ?Sized),
        task: &Task,
        watch: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
    ) -> Track {
        let Ok(track) = run(&mut self, controller, task, watch);
        finished(self.observer, track, self.is_dark)
    }
}

/// A grown track with its ground truth; of a plant in the dark without the lights that the controller asked for.
fn finished(observer: Observer, mut track: Track, is_dark: bool) -> Track {
    if is_dark {
        track.samples.iter_mut().for_each(|sample| sample.set_lighting(Lighting::DARK));
    }
    observer.complete(track)
}

/// Plants of [`Trial::grow_all`] that grow at once; a place that becomes free is taken by the next seed. Chosen by measurement:
/// enough to find plants of about as many segments, few enough for the processor's cache.
const SIDE_BY_SIDE: usize = 32;

/// A plant of [`Trial::grow_all`].
struct Growing<C> {
    /// Its place among the seeds.
    place: usize,
    controller: C,
    observer: Observer,
    recording: Recording,
}

/// An experiment on virtual plants of one species: their lamps, the period, and how much the plants vary.
///
/// ```
/// use tropism::control::Periodic;
/// use tropism::environment::unwatched;
/// use tropism_bean::{Species, Trial};
/// use tropism::lamps::{Layout, Light};
/// use tropism::task::Task;
/// let species = Species::default();
/// let trial = Trial { layout: Layout::four_sides(), period_min: 10.0, ..Trial::new(&species) };
/// let task = Task::open_loop(36);
/// let mut controller = Periodic::new(18, &trial.layout).starting_with(Light::FRONT);
/// let track = trial.grow(1, &mut controller, &task, &mut unwatched);
/// assert_eq!((track.samples.len(), track.period_min), (37, 10.0));
/// ```
#[derive(Clone, Debug)]
pub struct Trial<'s> {
    /// The species of the plants.
    pub species: &'s Species,
    /// Individual variation as a multiple of that of the species: 0 for its typical plant, 1 for the species.
    pub scale: f64,
    /// The lamps. Default: the paper's two.
    pub layout: Layout,
    /// Minutes between observations. Default: the paper's.
    pub period_min: f64,
    /// Whether a second camera sees the plants from the side, so that tip and stem are known in space. Default: no.
    pub in_space: bool,
    /// Solids through which no stem passes. Default: none.
    pub solids: Vec<Solid>,
    /// Angle by which the pot is tipped towards positive x at the first step, in degrees. Default: 0.
    pub tilt_deg: f64,
    /// Whether all lamps stay dark, whatever the controller lights; the track then says so. Default: no.
    pub is_dark: bool,
}

impl<'s> Trial<'s> {
    /// An experiment with the variation of the species, the paper's lamps and period, and no solids.
    #[must_use]
    pub fn new(species: &'s Species) -> Self {
        Self {
            species,
            scale: 1.0,
            layout: Layout::default(),
            period_min: PAPER_PERIOD_MIN,
            in_space: false,
            solids: Vec::new(),
            tilt_deg: 0.0,
            is_dark: false,
        }
    }

    /// Grows the plant of `seed` under `controller` until `task` is over or `watch` breaks off.
    ///
    /// The track has the columns `apex_x_cm`, `apex_y_cm`, `apex_z_cm` (true shoot apex), `length_cm` (along the stem) and
    /// `curvature_per_cm` (maximum along the stem).
    pub fn grow(
        &self,
        seed: u64,
        controller: &mut (impl Controller + ?Sized),
        task: &Task,
        watch: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
    ) -> Track {
        self.specimen(seed).run(controller, task, watch)
    }

    /// Grows the plants of `seeds` side by side in vector lanes: the tracks of [`Self::grow`], in order and to the bit.
    ///
    /// Each plant has a controller of its own, from `make_controller` of its place among the seeds, and ends when `task` is
    /// over for it. `watch` sees each sample with the place of its plant, and may break off this plant.
    ///
    /// ```
    /// use tropism::control::Greedy;
    /// use tropism::environment::unwatched;
    /// use tropism_bean::{Species, Trial};
    /// use tropism::task::Task;
    /// use std::ops::ControlFlow;
    /// let species = Species::default();
    /// let trial = Trial::new(&species);
    /// let task = Task { max_steps: 24, ..Task::default() };
    /// let greedy = || Greedy::new(&task, &trial.layout);
    /// let seeds: Vec<u64> = (0..20).collect();
    /// let tracks = trial.grow_all(&seeds, |_| greedy(), &task, &mut |_, _| ControlFlow::Continue(()));
    /// assert_eq!(tracks[7], trial.grow(7, &mut greedy(), &task, &mut unwatched));
    /// ```
    pub fn grow_all<C: Controller>(
        &self,
        seeds: &[u64],
        mut make_controller: impl FnMut(usize) -> C,
        task: &Task,
        watch: &mut dyn FnMut(usize, &Sample) -> ControlFlow<()>,
    ) -> Vec<Track> {
        let mut tracks = vec![Track::default(); seeds.len()];
        let mut waiting = seeds.iter().copied().enumerate();
        let mut population = Population::new(Vec::new());
        let (mut growing, mut powers) = (Vec::new(), Vec::new());
        loop {
            let free = SIDE_BY_SIDE - growing.len();
            for (place, seed) in waiting.by_ref().take(free) {
                population.beans.push(self.seedling(seed).under(&self.layout).among(&self.solids));
                growing.push(Growing {
                    place,
                    controller: make_controller(place),
                    observer: Observer::of(seed, self.in_space),
                    recording: Recording::new(self.layout.clone(), self.period_min),
                });
            }
            if growing.is_empty() {
                return tracks;
            }
            powers.clear();
            while let Some(plant) = growing.get_mut(powers.len()) {
                let seen = plant.observer.observe(&population.beans[powers.len()]);
                let watch = &mut |sample: &Sample| watch(plant.place, sample);
                match plant.recording.decide(seen, 0, &mut plant.controller, task, watch) {
                    Some(lighting) => powers.push(powers_in(&self.layout, self.is_dark, lighting)),
                    None => {
                        let plant = growing.swap_remove(powers.len());
                        population.beans.swap_remove(powers.len());
                        tracks[plant.place] = finished(plant.observer, plant.recording.track, self.is_dark);
                    }
                }
            }
            population.advance(&powers, self.period_min);
        }
    }

    /// The seedling of `seed`.
    fn seedling(&self, seed: u64) -> Bean {
        let mut bean = Bean::new(self.species.draw(seed, self.scale), seed);
        if self.tilt_deg != 0.0 {
            bean.tip_over(self.tilt_deg.to_radians());
        }
        bean
    }

    /// The plant of `seed` before its first step, as [`grow`](Self::grow) grows it.
    #[must_use]
    pub fn specimen(&self, seed: u64) -> Specimen {
        self.observed(self.seedling(seed), Observer::of(seed, self.in_space))
    }

    fn observed(&self, bean: Bean, observer: Observer) -> Specimen {
        let bean = bean.under(&self.layout).among(&self.solids);
        Specimen {
            layout: self.layout.clone(),
            period_min: self.period_min,
            bean,
            observer,
            is_dark: self.is_dark,
        }
    }
}

/// Grows the plant of `seed`, with `scale` times the variation between real plants, under the paper's lamps and at its
/// period: [`Trial::grow`].
///
/// ```
/// use tropism::control::Greedy;
/// use tropism::environment::unwatched;
/// use tropism_bean::{Species, grow};
/// use tropism::lamps::Layout;
/// use tropism::task::Task;
/// let task = Task { max_steps: 24, ..Task::default() };
/// let mut controller = Greedy::new(&task, &Layout::default());
/// let track = grow(&Species::default(), 1, 1.0, &mut controller, &task, &mut unwatched);
/// assert_eq!(track.samples.len(), 25);
/// ```
pub fn grow(
    species: &Species,
    seed: u64,
    scale: f64,
    controller: &mut (impl Controller + ?Sized),
    task: &Task,
    watch: &mut dyn FnMut(&Sample) -> ControlFlow<()>,
) -> Track {
    Trial { scale, ..Trial::new(species) }.grow(seed, controller, task, watch)
}

/// [`grow`] of the typical plant of the species without noise and without events; `phase` is that of circumnutation at the
/// start, in rad.
#[must_use]
pub fn grow_noise_free(
    species: &Species,
    phase: f64,
    controller: &mut (impl Controller + ?Sized),
    task: &Task,
) -> Track {
    let bean = Bean::noise_free(species.average()).with_phase(phase);
    Trial::new(species).observed(bean, Observer::default()).run(controller, task, &mut unwatched)
}

/// The columns of a grown track beside the required ones.
pub(super) const TRUTH: [&str; 5] = ["apex_x_cm", "apex_y_cm", "apex_z_cm", "length_cm", "curvature_per_cm"];
