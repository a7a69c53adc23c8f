//! Many episodes side by side: what learning environments step through.
//!
//! Plants stand in shards, which work on threads of their own; no number depends on that. An episode that is over begins anew at
//! the next step, whose action is then ignored (Gymnasium's next-step autoreset).

use std::sync::Arc;

use numpy::ndarray::{Array1, Array2};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use rayon::prelude::*;
use tropism::geometry::{Point, Polyline, STEM_POINTS};
use tropism::greenhouse::bean::{Bean, Population, lamp_powers};
use tropism::greenhouse::detector;
use tropism::greenhouse::pose::Pose;
use tropism::greenhouse::render::Renderer;
use tropism::greenhouse::scene::Scene;
use tropism::greenhouse::tent::Greenhouse;
use tropism::greenhouse::view::project;
use tropism::lamps::{Layout, Light};
use tropism::observation::Observation;
use tropism::plant::PlantModel;
use tropism::random::{self, NoiseStream, Purpose};
use tropism::task::{Task, TaskSpec};

use crate::error::{parsed, refused};
use crate::model::{AnyModel, Model};
use crate::threads::check_fork;

/// Most plants of a shard. Chosen by measurement: beans of about as many segments find each other in the vector lanes.
const MOST_IN_SHARD: usize = 128;

/// Arrays of one step of many plants: observations, rewards, terminated, truncated.
type Steps<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<bool>>,
);

/// A kind of plants that grow side by side.
trait Plants: Send + Sync {
    /// A place holds the plant of episode `episode` under `seed`, before its first step.
    fn begin(&mut self, place: usize, start: Point, seed: u64, episode: u32);
    /// Advances every plant; one without a light need not be, for it begins anew.
    fn advance(&mut self, lights: &[Option<Light>]);
    fn observe(&mut self, place: usize) -> Observation;
    /// What a camera sees, for kinds that have a shape in space.
    fn pose(&self, place: usize) -> Option<Pose>;
}

/// Plants of a model.
struct Simulated<M: PlantModel> {
    model: Arc<M>,
    plants: Vec<(M::Plant, NoiseStream, u32)>,
}

impl<M: PlantModel> Simulated<M> {
    fn new(model: Arc<M>, count: usize) -> Self {
        let noise = NoiseStream::new(0, Purpose::Trial, [0; 3]);
        let plant = model.seedling(Point::new(0.0, 4.0), &mut noise.of_seedling());
        Self { plants: vec![(plant, noise, 0); count], model }
    }
}

impl<M: PlantModel + Send> Plants for Simulated<M>
where
    M::Plant: Send + Sync,
{
    fn begin(&mut self, place: usize, start: Point, seed: u64, episode: u32) {
        // The noise of `tropism simulate`, so that the same seed gives the same plants.
        let noise = NoiseStream::new(seed, Purpose::Trial, [episode, 0, 0]);
        self.plants[place] = (self.model.seedling(start, &mut noise.of_seedling()), noise, 0);
    }

    fn advance(&mut self, lights: &[Option<Light>]) {
        for ((plant, noise, step), light) in self.plants.iter_mut().zip(lights) {
            if let Some(light) = light {
                self.model.step(plant, *light, &mut noise.at(*step));
                *step += 1;
            }
        }
    }

    fn observe(&mut self, place: usize) -> Observation {
        self.model.observe(&self.plants[place].0)
    }

    fn pose(&self, _place: usize) -> Option<Pose> {
        None
    }
}

/// The detector's noise of one plant.
type Detector = Box<dyn FnMut(&Pose) -> Observation + Send + Sync>;

/// Virtual beans.
struct Beans {
    greenhouse: Greenhouse,
    period_min: f64,
    population: Population,
    /// For each plant; `None` where the true tip is seen.
    detectors: Option<Vec<Detector>>,
    powers: Vec<[f64; tropism::lamps::MAX_LAMPS]>,
}

impl Beans {
    fn new(greenhouse: Greenhouse, period_min: f64, count: usize, has_detector: bool) -> Self {
        let mut beans = Self {
            population: Population::new(Vec::new()),
            detectors: has_detector.then(|| (0..count).map(|_| detector_of(0)).collect()),
            powers: Vec::new(),
            greenhouse,
            period_min,
        };
        beans.population.beans = (0..count).map(|_| beans.seedling(0)).collect();
        beans
    }

    fn seedling(&self, seed: u64) -> Bean {
        let Greenhouse { bean, scale, layout, solids, .. } = &self.greenhouse;
        Bean::new(bean.draw(seed, *scale), seed).under(layout).among(solids)
    }
}

/// The paper's detector with the noise of the plant of `seed`, as `tropism grow` has it.
fn detector_of(seed: u64) -> Detector {
    let mut tip = random::stream(seed, Purpose::Camera, 0);
    let mut stem = random::stream(seed, Purpose::Camera, 1);
    Box::new(move |pose| Observation {
        stem: Some(detector::detect_stem(pose, &mut stem)),
        ..Observation::simulated(detector::detect(pose, &mut tip))
    })
}

impl Plants for Beans {
    fn begin(&mut self, place: usize, _start: Point, seed: u64, episode: u32) {
        // The plants of `tropism grow` with this seed, in order.
        let seed = random::derive(seed, Purpose::Plant, episode.into()) >> 1;
        self.population.beans[place] = self.seedling(seed);
        if let Some(detectors) = &mut self.detectors {
            detectors[place] = detector_of(seed);
        }
    }

    fn advance(&mut self, lights: &[Option<Light>]) {
        self.powers.clear();
        self.powers.extend(lights.iter().map(|light| lamp_powers(*light)));
        self.population.advance(&self.powers, self.period_min);
    }

    fn observe(&mut self, place: usize) -> Observation {
        let bean = &self.population.beans[place];
        match &mut self.detectors {
            Some(detectors) => detectors[place](&bean.pose()),
            None => Observation::simulated(project(bean.apex())),
        }
    }

    fn pose(&self, place: usize) -> Option<Pose> {
        Some(self.population.beans[place].pose())
    }
}

/// One episode.
#[derive(Clone)]
struct Place {
    seed: u64,
    episode: u32,
    step: u32,
    first: Observation,
    seen: Observation,
    light: Option<Light>,
    is_over: bool,
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
    fn begin(&mut self, place: usize, task: &TaskSpec) {
        let Place { seed, episode, .. } = self.places[place];
        self.plants.begin(place, task.start(), seed, episode);
        let seen = self.plants.observe(place);
        self.places[place] =
            Place { seed, episode, step: 0, first: seen.clone(), seen, light: None, is_over: false };
    }

    fn step(&mut self, task: &TaskSpec, actions: &[Light], rows: &mut Rows<'_>, width: usize) {
        self.lights.clear();
        let lit = self.places.iter().zip(actions).map(|(place, light)| (!place.is_over).then_some(*light));
        self.lights.extend(lit);
        self.plants.advance(&self.lights);
        for place in 0..self.places.len() {
            let observation = &mut rows.observations[place * width..(place + 1) * width];
            if self.places[place].is_over {
                self.places[place].episode += 1;
                self.begin(place, task);
                put(&self.places[place].seen, observation);
                continue;
            }
            let after = self.plants.observe(place);
            let own = &mut self.places[place];
            own.step += 1;
            own.light = self.lights[place];
            rows.rewards[place] = task.step_fitness(&own.first, &own.seen, &after);
            // A task of this library ends by what is seen, or at its last step.
            rows.terminated[place] = task.is_over(0, &after);
            rows.truncated[place] = !rows.terminated[place] && own.step >= task.max_steps();
            own.is_over = rows.terminated[place] || rows.truncated[place];
            own.seen = after;
            put(&own.seen, observation);
        }
    }
}

/// The tip, and after it the points of the stem if there is room for them.
fn put(seen: &Observation, row: &mut [f64]) {
    let (tip, stem) = row.split_at_mut(2);
    tip.copy_from_slice(&[seen.tip.x, seen.tip.y]);
    let points = seen.stem.as_ref().map_or(&[][..], |Polyline(points)| points);
    for (slot, point) in stem.chunks_exact_mut(2).zip(points) {
        slot.copy_from_slice(&[point.x, point.y]);
    }
}

/// Many episodes of one task side by side.
#[pyclass(module = "tropism._core")]
pub(crate) struct Batch {
    shards: Vec<Shard>,
    task: TaskSpec,
    layout: Layout,
    count: usize,
    /// Numbers of an observation.
    width: usize,
    period_min: f64,
}

impl Batch {
    fn new(
        task: &str,
        layout: Layout,
        period_min: f64,
        count: usize,
        has_stem: bool,
        plants: impl Fn(usize) -> Box<dyn Plants>,
    ) -> PyResult<Self> {
        let task: TaskSpec = parsed("task", task)?;
        task.check().map_err(refused)?;
        if count == 0 {
            return Err(refused("found 0 plants, wanted at least one"));
        }
        let nothing = Observation::simulated(task.start());
        let place = Place {
            seed: 0,
            episode: 0,
            step: 0,
            first: nothing.clone(),
            seen: nothing,
            light: None,
            is_over: true,
        };
        let shards = (0..count.div_ceil(MOST_IN_SHARD)).map(|shard| {
            let size = MOST_IN_SHARD.min(count - shard * MOST_IN_SHARD);
            Shard { plants: plants(size), places: vec![place.clone(); size], lights: Vec::new() }
        });
        let width = if has_stem { 2 + 2 * STEM_POINTS } else { 2 };
        Ok(Self { shards: shards.collect(), task, layout, count, width, period_min })
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
        let mut observations = Array2::zeros((self.count, self.width));
        let places = self.shards.iter().flat_map(|shard| &shard.places);
        for (place, mut row) in places.zip(observations.outer_iter_mut()) {
            put(&place.seen, row.as_slice_mut().expect("rows of a whole array"));
        }
        observations
    }
}

#[pymethods]
impl Batch {
    /// `count` plants of a model, for a task (JSON). With `has_stem` observations hold the points of the stem.
    #[staticmethod]
    #[pyo3(signature = (model, task, count=1, has_stem=false))]
    fn of_model(model: &Model, task: &str, count: usize, has_stem: bool) -> PyResult<Self> {
        let (layout, period_min) = (model.0.layout().clone(), model.0.period_min());
        if has_stem && !matches!(&*model.0, AnyModel::Stem(_)) {
            return Err(refused(
                "found a model of the tip, wanted one of the stem: Model.of_virtual_beans(\"stem\")",
            ));
        }
        let plants = |size| -> Box<dyn Plants> {
            match &*model.0 {
                AnyModel::Tip(model) => Box::new(Simulated::new(Arc::clone(model), size)),
                AnyModel::Memory(model) => Box::new(Simulated::new(Arc::clone(model), size)),
                AnyModel::Stem(model) => Box::new(Simulated::new(Arc::clone(model), size)),
                AnyModel::Python(_) => unreachable!("models of Python are no `Model`"),
            }
        };
        Self::new(task, layout, period_min, count, has_stem, plants)
    }

    /// `count` virtual beans of a greenhouse (JSON), for a task (JSON). `tip` is true or detector.
    #[staticmethod]
    #[pyo3(signature = (greenhouse, task, count=1, period_min=5.0, tip="true"))]
    fn of_beans(greenhouse: &str, task: &str, count: usize, period_min: f64, tip: &str) -> PyResult<Self> {
        let greenhouse: Greenhouse = parsed("greenhouse", greenhouse)?;
        greenhouse.check().map_err(refused)?;
        if !["true", "detector"].contains(&tip) {
            return Err(refused(format!("found tip {tip:?}, wanted true or detector")));
        }
        if !(0.01..=1440.0).contains(&period_min) {
            return Err(refused(format!("found period_min {period_min}, wanted 0.01 to 1440")));
        }
        let layout = greenhouse.layout.clone();
        let plants = |size| -> Box<dyn Plants> {
            Box::new(Beans::new(greenhouse.clone(), period_min, size, tip == "detector"))
        };
        Self::new(task, layout, period_min, count, false, plants)
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
        self.width
    }

    #[getter]
    fn period_min(&self) -> f64 {
        self.period_min
    }

    #[getter]
    fn targets(&self) -> Vec<(f64, f64)> {
        self.task.targets().iter().map(|target| (target.x, target.y)).collect()
    }

    #[getter]
    fn best_fitness(&self) -> Option<f64> {
        self.task.best_fitness()
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
        let task = &self.task;
        py.detach(|| {
            self.shards.par_iter_mut().enumerate().for_each(|(number, shard)| {
                for place in 0..shard.places.len() {
                    let own = &mut shard.places[place];
                    match &seeds {
                        Some(seeds) => (own.seed, own.episode) = (seeds[number * MOST_IN_SHARD + place], 0),
                        None => own.episode += 1,
                    }
                    shard.begin(place, task);
                }
            });
        });
        Ok(self.observations().into_pyarray(py))
    }

    /// Lights a lamp for each plant, for one step.
    fn step<'py>(&mut self, py: Python<'py>, actions: PyReadonlyArray1<'py, i64>) -> PyResult<Steps<'py>> {
        check_fork()?;
        let actions = actions.as_array();
        if actions.len() != self.count {
            return Err(refused(format!("found {} actions, wanted {}", actions.len(), self.count)));
        }
        let lights = actions.iter().map(|number| self.light(*number)).collect::<PyResult<Vec<Light>>>()?;
        let mut observations = vec![0.0; self.count * self.width];
        let mut rewards = vec![0.0; self.count];
        let (mut terminated, mut truncated) = (vec![false; self.count], vec![false; self.count]);
        let (task, width) = (&self.task, self.width);
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
                shard.step(task, lights, rows, width);
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
        let mut observation = [0.0; 2 + 2 * STEM_POINTS];
        let (mut reward, mut terminated, mut truncated) = ([0.0], [false], [false]);
        let mut rows = Rows {
            observations: &mut observation[..self.width],
            rewards: &mut reward,
            terminated: &mut terminated,
            truncated: &mut truncated,
        };
        self.shards[0].step(&self.task, &[light], &mut rows, self.width);
        let seen = PyList::new(py, &observation[..self.width])?;
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

    /// A photograph of a bean, with flash: (height, width, 3). `None` for plants of a model, which have no shape.
    #[pyo3(signature = (place=0, width=432, height=324))]
    fn photograph<'py>(
        &self,
        py: Python<'py>,
        place: usize,
        width: u32,
        height: u32,
    ) -> PyResult<Option<Bound<'py, PyArray3<u8>>>> {
        let (shard, place) = self.place(place)?;
        let Some(pose) = shard.plants.pose(place) else { return Ok(None) };
        let own = &shard.places[place];
        let scene = Scene { width, height, ..Scene::default() };
        scene.check().map_err(refused)?;
        let layout = &self.layout;
        let image = py.detach(|| {
            Renderer::new(&scene, own.seed).under(layout).draw(&pose, own.light, true, u64::from(own.step))
        });
        crate::tent::pixels(py, image).map(Some)
    }
}
