//! Many episodes side by side: what learning environments step through.
//!
//! Plants stand in shards, which work on threads of their own; no number depends on that. An episode that is over begins anew at
//! the next step, whose action is then ignored (Gymnasium's next-step autoreset), or where the caller asks for it.
//!
//! A plant is its seed, its number and the lamps that were lit: from these a saved batch is grown again, to the bit.

use numpy::ndarray::{Array1, Array2};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList, PyTuple};
use rayon::prelude::*;
use tropism::geometry::path::resampled;
use tropism::geometry::space::SpacePoint;
use tropism::geometry::{Point, Polyline, STEM_POINTS};
use tropism::lamps::{Layout, Light};
use tropism::observation::{Depth, Observation};
use tropism::obstacle::{Solid, clearance};
use tropism::plant::{Plant, PlantModel};
use tropism::random::{self, NoiseStream, Purpose};
use tropism::simulation::AnyModel;
use tropism::task::{Past, Task};
use tropism::track::{Sample, Track};
use tropism_bean::detector;
use tropism_bean::pose::Pose;
use tropism_bean::render::Renderer;
use tropism_bean::scene::Scene;
use tropism_bean::tent::Greenhouse;
use tropism_bean::view::{View, project};
use tropism_bean::{Bean, Population, lamp_powers};

use crate::error::refused;
use crate::model::Model;
use crate::parts::check_period;
use crate::tent::{opened_for, task_of};
use crate::threads::check_fork;

/// Most plants of a shard. Chosen by measurement: beans of about as many segments find each other in the vector lanes.
const MOST_IN_SHARD: usize = 128;

/// Most plants of a batch: chosen, what fits into the memory of a large machine.
const MOST_PLANTS: usize = 1_000_000;

/// Arrays of one step of many plants: observations, rewards, terminated, truncated.
type Steps<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<bool>>,
);

/// Of each plant: step, number under its seed, seed, fitness so far.
type States<'py> = (
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<u64>>,
    Bound<'py, PyArray1<f64>>,
);

/// Of each plant: whether its stem touches an obstacle, its gap in cm, the observations so far at which it touched, and the
/// distance of its tip from each target at the target's height, in cm; infinite before.
type Progress<'py> = (
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray2<f64>>,
);

/// Where a stem presses on a solid: the solid's number, the place in cm, and the force on the stem in dyn.
type Contact = (usize, SpacePoint, SpacePoint);

/// The gap that is reported where there is no obstacle, in cm: the bound of all places.
const NO_OBSTACLE_CM: f64 = 100.0;

/// What an observation holds.
#[derive(Clone, Copy, PartialEq)]
enum Sight {
    /// x and y of the tip.
    Tip,
    /// The tip, and ten points of the stem from the base up.
    Stem,
    /// The tip, the stem, and of the obstacle that is nearest to the stem: the gap between their surfaces, the point of the stem,
    /// and the point of the obstacle.
    Obstacles,
    /// x, y and z of the tip.
    Space,
}

impl Sight {
    /// Numbers of an observation.
    const fn width(self) -> usize {
        match self {
            Self::Tip => 2,
            Self::Stem => 2 + 2 * STEM_POINTS,
            Self::Obstacles => 2 + 2 * STEM_POINTS + 5,
            Self::Space => 3,
        }
    }
}

/// Most numbers of an observation.
const MOST_WIDTH: usize = Sight::Obstacles.width();

/// What all episodes of a batch share.
struct Episodes {
    task: Task,
    sight: Sight,
    /// The targets as the front camera sees them: a copy, for quick comparisons.
    targets: Vec<Point>,
}

impl Episodes {
    fn new(task: Task, sight: Sight) -> Self {
        Self { targets: task.targets.clone(), task, sight }
    }

    /// Whether contacts and targets are counted.
    fn has_progress(&self) -> bool {
        matches!(self.sight, Sight::Obstacles | Sight::Space)
    }

    /// The gap between stem and obstacles, in cm, and whether they touch.
    fn gap(&self, seen: &Observation) -> (f64, bool) {
        (self.task.gap_cm(seen).min(NO_OBSTACLE_CM), self.task.touches(seen))
    }

    /// Distance of `seen` from target `number`, as the task measures it where the tip reaches the target's height, in cm.
    fn distance(&self, number: usize, seen: &Observation) -> f64 {
        let Observation { tip, stem, depth, quality } = seen.clone();
        let sample = Sample { step: 0, time_s: 0.0, tip, stem, depth, light: None, levels: None, quality };
        let crossings = self.task.crossings(&Track::of(vec![sample]));
        crossings.get(number).copied().flatten().map_or(f64::INFINITY, |crossing| crossing.distance_cm)
    }

    /// Writes the numbers of an observation.
    fn put(&self, seen: &Observation, row: &mut [f64]) {
        let (tip, rest) = row.split_at_mut(2);
        tip.copy_from_slice(&[seen.tip.x, seen.tip.y]);
        match self.sight {
            Sight::Tip => {}
            Sight::Space => rest[0] = seen.depth.as_ref().map_or(0.0, |depth| depth.tip_cm),
            Sight::Stem | Sight::Obstacles => {
                let (stem, nearest) = rest.split_at_mut(2 * STEM_POINTS);
                let points = seen.stem.as_ref().map_or(&[][..], |Polyline(points)| points);
                for (slot, point) in stem.chunks_exact_mut(2).zip(points) {
                    slot.copy_from_slice(&[point.x, point.y]);
                }
                if self.sight == Sight::Obstacles {
                    let found = seen.stem.as_ref().and_then(|stem| clearance(&self.task.obstacles, stem));
                    let tip = <[f64; 2]>::from(seen.tip);
                    let (stem, obstacle) = found.map_or((tip, tip), |found| (found.stem, found.obstacle));
                    let gap = self.gap(seen).0;
                    nearest.copy_from_slice(&[gap, stem[0], stem[1], obstacle[0], obstacle[1]]);
                }
            }
        }
    }
}

/// A kind of plants that grow side by side.
trait Plants: Send + Sync {
    /// A place holds the plant of episode `episode` under `seed`, before its first step.
    fn begin(&mut self, place: usize, start: Point, seed: u64, episode: u32);
    /// Advances every plant; one without a light need not be, for it begins anew.
    fn advance(&mut self, lights: &[Option<Light>]);
    fn observe(&mut self, place: usize) -> Observation;
    /// What a camera sees, for kinds that have a shape in space.
    fn pose(&self, place: usize) -> Option<Pose>;
    /// Where a plant presses on solids.
    fn contact_points(&self, place: usize) -> Vec<Contact>;
}

/// Plants of a model.
struct Simulated {
    model: AnyModel,
    /// What the task has around each plant.
    solids: Vec<Solid>,
    plants: Vec<(Box<dyn Plant>, NoiseStream, u32)>,
}

impl Simulated {
    fn new(model: &AnyModel, task: &Task, count: usize) -> Self {
        let noise = NoiseStream::new(0, Purpose::Trial, [0; 3]);
        let plant = model.seedling(Point::new(0.0, 4.0), &mut noise.of_seedling());
        Self { plants: vec![(plant, noise, 0); count], solids: task.solids(), model: model.clone() }
    }
}

impl Plants for Simulated {
    fn begin(&mut self, place: usize, start: Point, seed: u64, episode: u32) {
        // The noise of `tropism simulate`, so that the same seed gives the same plants.
        let noise = NoiseStream::new(seed, Purpose::Trial, [episode, 0, 0]);
        let mut plant = self.model.seedling(start, &mut noise.of_seedling());
        plant.among(&self.solids);
        self.plants[place] = (plant, noise, 0);
    }

    fn advance(&mut self, lights: &[Option<Light>]) {
        for ((plant, noise, step), light) in self.plants.iter_mut().zip(lights) {
            if let Some(light) = light {
                plant.step(*light, &mut noise.at(*step));
                *step += 1;
            }
        }
    }

    fn observe(&mut self, place: usize) -> Observation {
        self.plants[place].0.observe()
    }

    fn pose(&self, _place: usize) -> Option<Pose> {
        None
    }

    fn contact_points(&self, _place: usize) -> Vec<Contact> {
        Vec::new()
    }
}

/// The detector's noise of one plant.
type Detector = Box<dyn FnMut(&Pose) -> Observation + Send + Sync>;

/// What is known of virtual beans at each step.
#[derive(Clone, Copy)]
struct Senses {
    /// Whether the tip is that of the paper's detector, with its grid and noise.
    has_detector: bool,
    has_stem: bool,
    in_space: bool,
}

impl Senses {
    /// The plant as it is.
    fn truth(self, bean: &Bean) -> Observation {
        if !self.has_stem && !self.in_space {
            return Observation::simulated(project(bean.apex()));
        }
        let pose = bean.pose();
        if !self.in_space {
            let stem = Some(detector::midline(&pose));
            return Observation { stem, ..Observation::simulated(project(pose.apex())) };
        }
        let nodes: Vec<SpacePoint> = pose.stem.iter().map(|node| node.at).collect();
        let stem = if self.has_stem { resampled(&nodes, STEM_POINTS) } else { Vec::new() };
        let [x, y, z] = pose.apex();
        Observation {
            stem: self.has_stem.then(|| Polyline(stem.iter().map(|&[x, y, _]| Point::new(x, y)).collect())),
            depth: Some(Depth { tip_cm: z, stem_cm: stem.iter().map(|point| point[2]).collect() }),
            ..Observation::simulated(Point::new(x, y))
        }
    }

    /// The detector with the noise of the plant of `seed`, as `tropism grow` has it; `None` where the truth is seen.
    fn detector(self, seed: u64) -> Option<Detector> {
        if !self.has_detector {
            return None;
        }
        let stream = |index| random::stream(seed, Purpose::Camera, index);
        let (mut of_tip, mut of_stem) = (stream(0), stream(1));
        let mut of_side = self.in_space.then(|| stream(2));
        Some(Box::new(move |pose| {
            let tip = detector::detect(pose, &mut of_tip);
            let stem = Some(detector::detect_stem(pose, &mut of_stem));
            let seen = Observation { stem, ..Observation::simulated(tip) };
            match &mut of_side {
                Some(noise) => detector::detect_in_space(pose, seen, noise),
                None => seen,
            }
        }))
    }
}

/// Virtual beans.
struct Beans {
    greenhouse: Greenhouse,
    period_min: f64,
    senses: Senses,
    /// From which of the series under a seed the plants are.
    series: Purpose,
    population: Population,
    /// For each plant; `None` where the plant is seen as it is.
    detectors: Vec<Option<Detector>>,
    powers: Vec<[f64; tropism::lamps::MAX_LAMPS]>,
}

impl Beans {
    fn new(greenhouse: Greenhouse, period_min: f64, count: usize, senses: Senses, series: Purpose) -> Self {
        let seedling = seedling(&greenhouse, 0);
        Self {
            population: Population::new(vec![seedling; count]),
            detectors: (0..count).map(|_| None).collect(),
            powers: Vec::new(),
            greenhouse,
            period_min,
            senses,
            series,
        }
    }
}

fn seedling(greenhouse: &Greenhouse, seed: u64) -> Bean {
    let Greenhouse { bean, variation, layout, solids, .. } = greenhouse;
    Bean::new(bean.draw(seed, *variation), seed).under(layout).among(solids)
}

impl Plants for Beans {
    fn begin(&mut self, place: usize, _start: Point, seed: u64, episode: u32) {
        // The plants of `tropism grow` or `tropism transfer` with this seed, in order.
        let seed = random::derive(seed, self.series, episode.into()) >> 1;
        self.population.beans[place] = seedling(&self.greenhouse, seed);
        self.detectors[place] = self.senses.detector(seed);
    }

    fn advance(&mut self, lights: &[Option<Light>]) {
        self.powers.clear();
        self.powers.extend(lights.iter().map(|light| lamp_powers(*light)));
        self.population.advance(&self.powers, self.period_min);
    }

    fn observe(&mut self, place: usize) -> Observation {
        let bean = &self.population.beans[place];
        match &mut self.detectors[place] {
            Some(detector) => detector(&bean.pose()),
            None => self.senses.truth(bean),
        }
    }

    fn pose(&self, place: usize) -> Option<Pose> {
        Some(self.population.beans[place].pose())
    }

    fn contact_points(&self, place: usize) -> Vec<Contact> {
        let contacts = self.population.beans[place].contacts();
        contacts.into_iter().map(|contact| (contact.solid, contact.at, contact.force)).collect()
    }
}

/// One episode.
#[derive(Clone)]
struct Place {
    seed: u64,
    episode: u32,
    step: u32,
    past: Past,
    light: Option<Light>,
    is_over: bool,
    /// Whether it was ever begun.
    is_begun: bool,
    /// Sum of the rewards.
    fitness: f64,
    /// Numbers of the lamps of all steps.
    lights: Vec<u8>,
    /// Observations at which the stem touched an obstacle.
    contact_steps: u32,
    /// Distance of the tip from each target at the target's height, in cm; infinite before.
    distances: Vec<f64>,
}

impl Place {
    /// Counts what is seen now.
    fn count(&mut self, episodes: &Episodes) {
        self.contact_steps += u32::from(episodes.gap(&self.past.latest).1);
        for (number, target) in episodes.targets.iter().enumerate() {
            if self.distances[number].is_infinite() && self.past.latest.tip.y >= target.y {
                self.distances[number] = episodes.distance(number, &self.past.latest);
            }
        }
    }
}

/// Episodes that work on one thread.
struct Shard {
    plants: Box<dyn Plants>,
    places: Vec<Place>,
    lights: Vec<Option<Light>>,
}

/// Where a shard writes what its plants did.
struct Rows<'a> {
    observations: &'a mut [f64],
    rewards: &'a mut [f64],
    terminated: &'a mut [bool],
    truncated: &'a mut [bool],
}

impl Shard {
    fn begin(&mut self, place: usize, episodes: &Episodes) {
        let own = &mut self.places[place];
        self.plants.begin(place, episodes.task.start, own.seed, own.episode);
        own.past = Past::new(self.plants.observe(place));
        (own.step, own.light, own.is_over, own.contact_steps) = (0, None, false, 0);
        (own.is_begun, own.fitness) = (true, 0.0);
        own.lights.clear();
        if episodes.has_progress() {
            own.distances.clear();
            own.distances.resize(episodes.targets.len(), f64::INFINITY);
            own.count(episodes);
        }
    }

    fn step(&mut self, episodes: &Episodes, actions: &[Light], rows: &mut Rows<'_>) {
        let width = episodes.sight.width();
        self.lights.clear();
        let lit = self.places.iter().zip(actions).map(|(place, light)| (!place.is_over).then_some(*light));
        self.lights.extend(lit);
        self.plants.advance(&self.lights);
        for place in 0..self.places.len() {
            let observation = &mut rows.observations[place * width..(place + 1) * width];
            if self.places[place].is_over {
                self.places[place].episode += 1;
                self.begin(place, episodes);
                episodes.put(&self.places[place].past.latest, observation);
                continue;
            }
            let (reward, terminated, truncated) = self.settle(place, episodes);
            (rows.rewards[place], rows.terminated[place], rows.truncated[place]) =
                (reward, terminated, truncated);
            episodes.put(&self.places[place].past.latest, observation);
        }
    }

    /// What a plant did in the step that was just made: its reward, and whether its episode terminated or was truncated.
    fn settle(&mut self, place: usize, episodes: &Episodes) -> (f64, bool, bool) {
        let task = &episodes.task;
        let after = self.plants.observe(place);
        let own = &mut self.places[place];
        own.step += 1;
        own.light = self.lights[place];
        own.lights.extend(own.light.map(|light| light.index() as u8));
        let reward = task.step_fitness(&own.past, &after);
        own.fitness += reward;
        // A task of this library ends by what is seen, or at its last step.
        let terminated = task.is_over(0, &after);
        let truncated = !terminated && own.step >= task.max_steps;
        own.is_over = terminated || truncated;
        own.past.push(after);
        if episodes.has_progress() {
            own.count(episodes);
        }
        (reward, terminated, truncated)
    }

    /// Grows the saved plants again. They begin at different times, so that all end together.
    fn restore(&mut self, saved: &[Saved], episodes: &Episodes) {
        let steps = |saved: &Saved| saved.lights.len();
        let longest = saved.iter().map(steps).max().unwrap_or(0);
        for time in 0..=longest {
            for (place, own) in saved.iter().enumerate().filter(|(_, own)| longest - steps(own) == time) {
                (self.places[place].seed, self.places[place].episode) = (own.seed, own.episode);
                if own.is_begun {
                    self.begin(place, episodes);
                } else {
                    (self.places[place].is_begun, self.places[place].is_over) = (false, true);
                }
            }
            if time == longest {
                break;
            }
            // The light of this step; none before the plant begins.
            let light = |own: &Saved| {
                let step = time.checked_sub(longest - steps(own))?;
                Light::new(usize::from(own.lights[step]))
            };
            self.lights.clear();
            self.lights.extend(saved.iter().map(light));
            self.plants.advance(&self.lights);
            for place in 0..saved.len() {
                if self.lights[place].is_some() {
                    self.settle(place, episodes);
                }
            }
        }
    }
}

/// What an episode is grown again from.
struct Saved {
    seed: u64,
    episode: u32,
    is_begun: bool,
    /// Numbers of the lamps of its steps.
    lights: Vec<u8>,
}

/// Many episodes of one task side by side.
#[pyclass(module = "tropism._core")]
pub(crate) struct Batch {
    shards: Vec<Shard>,
    episodes: Episodes,
    layout: Layout,
    /// Solids of the virtual tent.
    solids: Vec<Solid>,
    count: usize,
    period_min: f64,
}

impl Batch {
    fn new(
        episodes: Episodes,
        layout: Layout,
        period_min: f64,
        count: usize,
        plants: impl Fn(usize) -> Box<dyn Plants>,
    ) -> PyResult<Self> {
        if !(1..=MOST_PLANTS).contains(&count) {
            return Err(refused(format!("found {count} plants, wanted 1 to {MOST_PLANTS}")));
        }
        let nothing = Observation::simulated(episodes.task.start);
        let place = Place {
            seed: 0,
            episode: 0,
            step: 0,
            past: Past::new(nothing),
            light: None,
            is_over: true,
            is_begun: false,
            fitness: 0.0,
            lights: Vec::new(),
            contact_steps: 0,
            distances: Vec::new(),
        };
        let shards = (0..count.div_ceil(MOST_IN_SHARD)).map(|shard| {
            let size = MOST_IN_SHARD.min(count - shard * MOST_IN_SHARD);
            Shard { plants: plants(size), places: vec![place.clone(); size], lights: Vec::new() }
        });
        Ok(Self { shards: shards.collect(), episodes, layout, solids: Vec::new(), count, period_min })
    }

    fn place(&self, place: usize) -> PyResult<(&Shard, usize)> {
        if place >= self.count {
            return Err(refused(format!("found plant {place}, wanted 0 to {}", self.count - 1)));
        }
        Ok((&self.shards[place / MOST_IN_SHARD], place % MOST_IN_SHARD))
    }

    fn light(&self, number: i64) -> PyResult<Light> {
        let light = usize::try_from(number).ok().and_then(Light::new);
        light.filter(|light| self.layout.contains(*light)).ok_or_else(|| {
            refused(format!("found action {number}, wanted 0 to {}: a lamp", self.layout.len() - 1))
        })
    }

    fn observations(&self) -> Array2<f64> {
        let mut observations = Array2::zeros((self.count, self.episodes.sight.width()));
        for (place, mut row) in self.places().zip(observations.outer_iter_mut()) {
            self.episodes.put(&place.past.latest, row.as_slice_mut().expect("rows of a whole array"));
        }
        observations
    }

    /// Why a plant cannot be stepped.
    fn not_begun(&self, place: usize) -> PyErr {
        let which = if self.count == 1 { String::new() } else { format!("plant {place}: ") };
        let is_begun = self.shards[place / MOST_IN_SHARD].places[place % MOST_IN_SHARD].is_begun;
        let what = if is_begun { "the episode is over" } else { "no episode has begun" };
        refused(format!("{which}{what}: call reset before step"))
    }

    fn places(&self) -> impl Iterator<Item = &Place> {
        self.shards.iter().flat_map(|shard| &shard.places)
    }
}

#[pymethods]
impl Batch {
    /// `count` plants of a model, for a task (JSON). With `has_stem` observations hold the points of the stem.
    #[staticmethod]
    #[pyo3(signature = (model, task, count=1, has_stem=false))]
    fn of_model(model: &Model, task: &str, count: usize, has_stem: bool) -> PyResult<Self> {
        let (layout, period_min) = (model.0.layout().clone(), model.0.period_min());
        if has_stem && !model.0.kind().knows_stem() {
            return Err(refused(
                "found a model of the tip, wanted one of the stem: Model.of_virtual_beans(\"stem\")",
            ));
        }
        let task = task_of(task)?;
        let plants = |size| -> Box<dyn Plants> { Box::new(Simulated::new(&model.0, &task, size)) };
        let sight = if has_stem { Sight::Stem } else { Sight::Tip };
        Self::new(Episodes::new(task.clone(), sight), layout, period_min, count, plants)
    }

    /// `count` virtual beans of a greenhouse (JSON), for a task (JSON). `tip` is true or detector; `sight` is tip, obstacles or
    /// space: what an observation holds; `plants` is grow or transfer: which plants a seed stands for.
    #[staticmethod]
    #[pyo3(signature = (greenhouse, task, count=1, period_min=5.0, tip="true", sight="tip", plants="grow"))]
    fn of_beans(
        greenhouse: &str,
        task: &str,
        count: usize,
        period_min: f64,
        tip: &str,
        sight: &str,
        plants: &str,
    ) -> PyResult<Self> {
        let task = task_of(task)?;
        let greenhouse = opened_for(&task, greenhouse)?;
        let has_detector = one_of("tip", tip, [("true", false), ("detector", true)])?;
        let places = [("tip", Sight::Tip), ("obstacles", Sight::Obstacles), ("space", Sight::Space)];
        let sight = one_of("sight", sight, places)?;
        let series = one_of("plants", plants, [("grow", Purpose::Plant), ("transfer", Purpose::Judge)])?;
        if task.is_in_space() != (sight == Sight::Space) {
            let (found, wanted) = if sight == Sight::Space {
                ("in the plane", "one in space, such as {\"kind\": \"space\"}")
            } else {
                ("in space", "one in the plane of the front camera: tropism/Space-v0 is for tasks in space")
            };
            return Err(refused(format!("task: found a task {found}, wanted {wanted}")));
        }
        check_period(period_min)?;
        let senses = Senses {
            has_detector,
            has_stem: sight == Sight::Obstacles || task.is_about_stem(),
            in_space: task.is_in_space(),
        };
        let (layout, solids) = (greenhouse.layout.clone(), greenhouse.solids.clone());
        let plants = |size| -> Box<dyn Plants> {
            Box::new(Beans::new(greenhouse.clone(), period_min, size, senses, series))
        };
        let batch = Self::new(Episodes::new(task, sight), layout, period_min, count, plants)?;
        Ok(Self { solids, ..batch })
    }

    fn __len__(&self) -> usize {
        self.count
    }

    #[getter]
    fn lamps(&self) -> Vec<String> {
        self.layout.lamps().iter().map(|lamp| lamp.name.clone()).collect()
    }

    #[getter]
    fn width(&self) -> usize {
        self.episodes.sight.width()
    }

    #[getter]
    fn period_min(&self) -> f64 {
        self.period_min
    }

    /// The targets: x, y, z in cm; z is 0 in the plane of the front camera.
    #[getter]
    fn targets(&self) -> Vec<SpacePoint> {
        let in_plane = || self.episodes.targets.iter().map(|target| [target.x, target.y, 0.0]).collect();
        self.episodes.task.way_in_space().unwrap_or_else(in_plane)
    }

    #[getter]
    fn best_fitness(&self) -> Option<f64> {
        self.episodes.task.best_fitness()
    }

    /// The lamps with their places, as JSON.
    #[getter]
    fn layout(&self) -> PyResult<String> {
        serde_json::to_string(&self.layout).map_err(refused)
    }

    /// The task with all its keys, as JSON.
    #[getter]
    fn task(&self) -> PyResult<String> {
        serde_json::to_string(&self.episodes.task).map_err(refused)
    }

    /// Distance from a target within which a task among obstacles wants the tip, in cm; `None` for other tasks.
    #[getter]
    fn reach_cm(&self) -> Option<f64> {
        let task = &self.episodes.task;
        (!task.obstacles.is_empty()).then_some(task.reach_cm)
    }

    /// Begins all episodes: episode 0 under a seed each, or without seeds the next one under each one's seed.
    #[pyo3(signature = (seeds=None))]
    fn reset<'py>(
        &mut self,
        py: Python<'py>,
        seeds: Option<Vec<u64>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        check_fork()?;
        if let Some(seeds) = &seeds
            && seeds.len() != self.count
        {
            return Err(refused(format!("found {} seeds, wanted {}", seeds.len(), self.count)));
        }
        let episodes = &self.episodes;
        py.detach(|| {
            self.shards.par_iter_mut().enumerate().for_each(|(number, shard)| {
                for place in 0..shard.places.len() {
                    let own = &mut shard.places[place];
                    match &seeds {
                        Some(seeds) => (own.seed, own.episode) = (seeds[number * MOST_IN_SHARD + place], 0),
                        None => own.episode += 1,
                    }
                    shard.begin(place, episodes);
                }
            });
        });
        Ok(self.observations().into_pyarray(py))
    }

    /// Begins the next episodes of the plants that `mask` chooses, or episode 0 under seeds of their own; returns all observations.
    #[pyo3(signature = (mask, seeds=None))]
    fn begin<'py>(
        &mut self,
        py: Python<'py>,
        mask: PyReadonlyArray1<'py, bool>,
        seeds: Option<Vec<u64>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        check_fork()?;
        let mask = mask.as_array();
        let found = seeds.as_ref().map_or(self.count, Vec::len);
        if mask.len() != self.count || found != self.count {
            let found = if found == self.count { mask.len() } else { found };
            return Err(refused(format!("found a mask or seeds of {found} plants, wanted {}", self.count)));
        }
        for place in (0..self.count).filter(|&place| mask[place]) {
            let own = &mut self.shards[place / MOST_IN_SHARD].places[place % MOST_IN_SHARD];
            match &seeds {
                Some(seeds) => (own.seed, own.episode) = (seeds[place], 0),
                None => own.episode += 1,
            }
            self.shards[place / MOST_IN_SHARD].begin(place % MOST_IN_SHARD, &self.episodes);
        }
        Ok(self.observations().into_pyarray(py))
    }

    /// Steps, numbers and seeds of all plants, and the fitness so far.
    fn states<'py>(&self, py: Python<'py>) -> States<'py> {
        let array = |value: fn(&Place) -> i64| Array1::from_iter(self.places().map(value)).into_pyarray(py);
        (
            array(|place| place.step.into()),
            array(|place| place.episode.into()),
            Array1::from_iter(self.places().map(|place| place.seed)).into_pyarray(py),
            Array1::from_iter(self.places().map(|place| place.fitness)).into_pyarray(py),
        )
    }

    /// What all episodes are grown again from: seed, number, whether it was begun, and the lamps of its steps.
    fn saved<'py>(&self, py: Python<'py>) -> Vec<(u64, u32, bool, Bound<'py, PyBytes>)> {
        let saved =
            |place: &Place| (place.seed, place.episode, place.is_begun, PyBytes::new(py, &place.lights));
        self.places().map(saved).collect()
    }

    /// Grows the episodes again that [`saved`](Self::saved) gave, with the same bits.
    fn restore(&mut self, py: Python<'_>, saved: Vec<(u64, u32, bool, Vec<u8>)>) -> PyResult<()> {
        check_fork()?;
        if saved.len() != self.count {
            return Err(refused(format!("found {} saved plants, wanted {}", saved.len(), self.count)));
        }
        let lamps = self.layout.len();
        if saved.iter().flat_map(|(_, _, _, lights)| lights).any(|&light| usize::from(light) >= lamps) {
            return Err(refused("found a lamp that the environment lacks among the saved steps"));
        }
        let saved: Vec<Saved> = saved
            .into_iter()
            .map(|(seed, episode, is_begun, lights)| Saved { seed, episode, is_begun, lights })
            .collect();
        let episodes = &self.episodes;
        py.detach(|| {
            let work: Vec<_> = self.shards.iter_mut().zip(saved.chunks(MOST_IN_SHARD)).collect();
            work.into_par_iter().for_each(|(shard, saved)| shard.restore(saved, episodes));
        });
        Ok(())
    }

    /// What is observed now: (plants, width).
    fn seen<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.observations().into_pyarray(py)
    }

    /// Lights a lamp for each plant, for one step. Without `autoreset` a plant whose episode is over is an error.
    #[pyo3(signature = (actions, autoreset=true))]
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        actions: PyReadonlyArray1<'py, i64>,
        autoreset: bool,
    ) -> PyResult<Steps<'py>> {
        check_fork()?;
        let actions = actions.as_array();
        if let Some(place) = self.places().position(|place| !place.is_begun || place.is_over && !autoreset) {
            return Err(self.not_begun(place));
        }
        if actions.len() != self.count {
            return Err(refused(format!("found {} actions, wanted {}", actions.len(), self.count)));
        }
        let lights = actions.iter().map(|number| self.light(*number)).collect::<PyResult<Vec<Light>>>()?;
        let (episodes, width) = (&self.episodes, self.episodes.sight.width());
        let mut observations = vec![0.0; self.count * width];
        let mut rewards = vec![0.0; self.count];
        let (mut terminated, mut truncated) = (vec![false; self.count], vec![false; self.count]);
        py.detach(|| {
            let rows = observations
                .chunks_mut(MOST_IN_SHARD * width)
                .zip(rewards.chunks_mut(MOST_IN_SHARD))
                .zip(terminated.chunks_mut(MOST_IN_SHARD))
                .zip(truncated.chunks_mut(MOST_IN_SHARD))
                .map(|(((observations, rewards), terminated), truncated)| Rows {
                    observations,
                    rewards,
                    terminated,
                    truncated,
                });
            let mut work: Vec<_> =
                self.shards.iter_mut().zip(lights.chunks(MOST_IN_SHARD)).zip(rows).collect();
            let step = |((shard, lights), rows): &mut ((&mut Shard, &[Light]), Rows<'_>)| {
                shard.step(episodes, lights, rows);
            };
            match &mut work[..] {
                [one] => step(one),
                many => many.par_iter_mut().for_each(step),
            }
        });
        let observations = Array2::from_shape_vec((self.count, width), observations).map_err(refused)?;
        Ok((
            observations.into_pyarray(py),
            Array1::from_vec(rewards).into_pyarray(py),
            Array1::from_vec(terminated).into_pyarray(py),
            Array1::from_vec(truncated).into_pyarray(py),
        ))
    }

    /// `step` of a single plant: (observation, reward, terminated, truncated) as plain numbers, for a quick call.
    fn step_one<'py>(&mut self, py: Python<'py>, action: i64) -> PyResult<Bound<'py, PyTuple>> {
        let light = self.light(action)?;
        if self.count != 1 {
            return Err(refused(format!("found {} plants, wanted one", self.count)));
        }
        if self.shards[0].places[0].is_over {
            return Err(self.not_begun(0));
        }
        let (mut observation, width) = ([0.0; MOST_WIDTH], self.episodes.sight.width());
        let (mut reward, mut terminated, mut truncated) = ([0.0], [false], [false]);
        let mut rows = Rows {
            observations: &mut observation[..width],
            rewards: &mut reward,
            terminated: &mut terminated,
            truncated: &mut truncated,
        };
        self.shards[0].step(&self.episodes, &[light], &mut rows);
        let seen = PyList::new(py, &observation[..width])?;
        (seen, reward[0], terminated[0], truncated[0]).into_pyobject(py)
    }

    /// Number of the step, episode and seed of a plant.
    #[pyo3(signature = (place=0))]
    fn state(&self, place: usize) -> PyResult<(u32, u32, u64)> {
        let (shard, place) = self.place(place)?;
        let Place { step, episode, seed, .. } = shard.places[place];
        Ok((step, episode, seed))
    }

    /// Number of the lamp that was lit in a plant's last step; `None` before it.
    #[pyo3(signature = (place=0))]
    fn lit(&self, place: usize) -> PyResult<Option<usize>> {
        let (shard, place) = self.place(place)?;
        Ok(shard.places[place].light.map(Light::index))
    }

    /// How far all plants have come.
    fn progress<'py>(&self, py: Python<'py>) -> PyResult<Progress<'py>> {
        let targets = self.episodes.targets.len();
        if self.places().any(|place| place.distances.len() != targets) {
            return Err(refused("call `reset` first"));
        }
        let (mut touches, mut gaps, mut contacts) = (Vec::new(), Vec::new(), Vec::new());
        let mut distances = Vec::with_capacity(self.count * targets);
        for place in self.places() {
            let (gap, is_touching) = self.episodes.gap(&place.past.latest);
            touches.push(is_touching);
            gaps.push(gap);
            contacts.push(i64::from(place.contact_steps));
            distances.extend_from_slice(&place.distances);
        }
        Ok((
            Array1::from_vec(touches).into_pyarray(py),
            Array1::from_vec(gaps).into_pyarray(py),
            Array1::from_vec(contacts).into_pyarray(py),
            Array2::from_shape_vec((self.count, targets), distances).map_err(refused)?.into_pyarray(py),
        ))
    }

    /// Where a bean presses on solids: (number of the solid, place in cm, force on the stem in dyn).
    #[pyo3(signature = (place=0))]
    fn contact_points(&self, place: usize) -> PyResult<Vec<Contact>> {
        let (shard, place) = self.place(place)?;
        Ok(shard.plants.contact_points(place))
    }

    /// A photograph of a bean, with flash: (height, width, 3). `None` for plants of a model, which have no shape. `view` is front
    /// or side.
    #[pyo3(signature = (place=0, width=432, height=324, view="front"))]
    fn photograph<'py>(
        &self,
        py: Python<'py>,
        place: usize,
        width: u32,
        height: u32,
        view: &str,
    ) -> PyResult<Option<Bound<'py, PyArray3<u8>>>> {
        let view = view_of(view)?;
        let (shard, place) = self.place(place)?;
        let Some(pose) = shard.plants.pose(place) else { return Ok(None) };
        let own = &shard.places[place];
        let scene = Scene { width, height, ..Scene::default() };
        scene.check().map_err(refused)?;
        let (layout, solids) = (&self.layout, &self.solids);
        let image = py.detach(|| {
            let mut renderer = Renderer::at(view, &scene, own.seed).under(layout).among(solids);
            renderer.draw(&pose, own.light, true, u64::from(own.step))
        });
        crate::tent::pixels(py, image).map(Some)
    }
}

/// The value that `word` names.
fn one_of<T: Copy, const N: usize>(key: &str, word: &str, values: [(&str, T); N]) -> PyResult<T> {
    let found = values.iter().find(|(name, _)| *name == word).map(|(_, value)| *value);
    found.ok_or_else(|| {
        let names: Vec<&str> = values.iter().map(|(name, _)| *name).collect();
        refused(format!("{key}: found {word:?}, wanted one of {}", names.join(", ")))
    })
}

fn view_of(word: &str) -> PyResult<View> {
    one_of("view", word, [("front", View::Front), ("side", View::Side)])
}

/// Where a camera of the virtual tent sees a place (x, y, z in cm): x and y in the plane through the root that it faces. `view` is
/// front or side.
#[pyfunction]
#[pyo3(signature = (place, view="front"))]
pub(crate) fn seen_from(place: SpacePoint, view: &str) -> PyResult<(f64, f64)> {
    let Point { x, y } = project(view_of(view)?.to_camera(place));
    Ok((x, y))
}
