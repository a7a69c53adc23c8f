//! Simulations of a model: evolution evaluates thousands of controllers here.
//!
//! [`Simulation`] is an [`Environment`] like a tent, so [`run`] writes its track; [`fitness_of`] is the same loop without
//! the track. [`BatchModel`] scores many episodes at once: one by one for any model, side by side in vectors for the tip
//! model, and for predictive rules on the model of the stem, to the same bits.

mod batch;
mod score;
mod any;

use std::convert::Infallible;

use crate::control::Controller;
use crate::environment::{Environment, run, unwatched};
use crate::lamps::{Layout, Light};
use crate::lighting::Lighting;
use crate::observation::Observation;
use crate::plant::PlantModel;
use crate::random::{NoiseStream, Purpose};
use crate::task::{Past, Task};
use crate::track::{Sample, Track};

pub use any::{AnyModel, ModelKind};
pub use score::{BatchModel, Episode};

/// One simulated plant.
#[derive(Clone, Debug)]
pub struct Simulation<'m, M: PlantModel> {
    model: &'m M,
    plant: M::Plant,
    noise: NoiseStream,
    step: u32,
}

impl<'m, M: PlantModel> Simulation<'m, M> {
    /// A seedling of `model` where `task` starts, with its growth noise.
    pub fn new(model: &'m M, task: &Task, noise: NoiseStream) -> Self {
        let mut plant = model.seedling(task.start, &mut noise.of_seedling());
        model.among(&mut plant, &task.solids());
        Self { model, plant, noise, step: 0 }
    }
}

impl<M: PlantModel> Environment for Simulation<'_, M> {
    type Error = Infallible;

    fn observe(&mut self) -> Result<Observation, Infallible> {
        Ok(self.model.observe(&self.plant))
    }

    fn step(&mut self, light: Light) -> Result<(), Infallible> {
        self.shine(light.into())
    }

    fn shine(&mut self, lighting: Lighting) -> Result<(), Infallible> {
        self.model.shine(&mut self.plant, lighting, &mut self.noise.at(self.step));
        self.step += 1;
        Ok(())
    }

    fn period_min(&self) -> f64 {
        self.model.period_min()
    }

    fn layout(&self) -> &Layout {
        self.model.layout()
    }
}

/// The track of `controller` on `model`, with the growth noise of `seed`.
///
/// ```
/// use tropism::prelude::*;
/// let measured = "tip_x_cm,tip_y_cm,light\n0,4,left\n-0.1,4.03,right\n0,4.06,right\n0.1,4.1,dark\n";
/// let model = TipModel::fit([&Track::read_csv(measured.as_bytes())?], TipModelConfig::default())?;
/// let task = Task { max_steps: 20, ..Task::default() };
/// let track = simulate(&model, &mut Greedy::new(&task, &Layout::default()), &task, 1);
/// assert_eq!(track.samples.len(), 21);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn simulate<M: PlantModel>(
    model: &M,
    controller: &mut (impl Controller + ?Sized),
    task: &Task,
    seed: u64,
) -> Track {
    simulate_with(model, controller, task, NoiseStream::new(seed, Purpose::Trial, [0; 3]))
}

/// [`simulate`] with a noise stream of one's own.
fn simulate_with<M: PlantModel>(
    model: &M,
    controller: &mut (impl Controller + ?Sized),
    task: &Task,
    noise: NoiseStream,
) -> Track {
    let Ok(track) = run(&mut Simulation::new(model, task, noise), controller, task, &mut unwatched);
    track
}

/// The track of `controller` on a `plant` of `model` that was observed as `now`: until `task` is over, or `most_steps` steps later.
///
/// Its first sample is `now`, and its steps count on from there. Where the light of `now` is known, it acts, whatever the
/// controller decides.
pub fn go_on<M: PlantModel>(
    model: &M,
    mut plant: M::Plant,
    controller: &mut (impl Controller + ?Sized),
    task: &Task,
    now: &Sample,
    noise: NoiseStream,
    most_steps: u32,
) -> Track {
    model.among(&mut plant, &task.solids());
    let is_known = now.light.is_some() || model.knows_levels() && !now.is_dark();
    let known = is_known.then(|| now.lighting());
    let (mut step, mut seen, mut samples) = (now.step, now.observation(), Vec::new());
    loop {
        let is_over = task.is_over(step, &seen) || step - now.step >= most_steps;
        let decided = (!is_over).then(|| controller.lighting(&seen));
        let lighting = decided.map(|decided| known.filter(|_| step == now.step).unwrap_or(decided));
        let time_s = f64::from(step) * model.period_min() * 60.0;
        samples.push(Sample::of(seen, step, time_s, lighting.unwrap_or_default()));
        let Some(lighting) = lighting else { break };
        model.shine(&mut plant, lighting, &mut noise.at(step));
        (seen, step) = (model.observe(&plant), step + 1);
    }
    Track { layout: model.layout().clone(), period_min: model.period_min(), ..Track::of(samples) }
}

/// The fitness of `controller` on `model`: what [`Task::fitness`] says of its track, without the track.
pub fn fitness_of<M: PlantModel>(
    model: &M,
    controller: &mut (impl Controller + ?Sized),
    task: &Task,
    noise: NoiseStream,
) -> f64 {
    cautious_fitness_of(model, controller, task, noise, 0.0)
}

/// [`fitness_of`], less `beyond_cost_cm` for each step after which the plant is [beyond all data](PlantModel::is_beyond_data) of
/// the model.
pub fn cautious_fitness_of<M: PlantModel>(
    model: &M,
    controller: &mut (impl Controller + ?Sized),
    task: &Task,
    noise: NoiseStream,
    beyond_cost_cm: f64,
) -> f64 {
    let mut plant = model.seedling(task.start, &mut noise.of_seedling());
    model.among(&mut plant, &task.solids());
    let mut past = Past::new(model.observe(&plant));
    let mut fitness = 0.0;
    let mut step = 0;
    while !task.is_over(step, &past.latest) {
        let lighting = controller.lighting(&past.latest);
        model.shine(&mut plant, lighting, &mut noise.at(step));
        let after = model.observe(&plant);
        fitness += task.step_fitness(&past, &after);
        fitness -= if model.is_beyond_data(&plant) { beyond_cost_cm } else { 0.0 };
        past.push(after);
        step += 1;
    }
    fitness
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Greedy, Periodic};
    use crate::plant::shifts::Window;
    use crate::plant::tip::{TipModel, TipModelConfig};

    /// A plant that leans 0.2 cm a step towards the light wherever it is.
    fn follower() -> TipModel {
        let text = "tip_x_cm,tip_y_cm,light\n0,9,right\n0.2,9.03,left\n0,9.06,dark\n";
        let config = TipModelConfig { window: Window { wx: 20.0, wy: 20.0 }, ..TipModelConfig::default() };
        TipModel::fit([&Track::read_csv(text.as_bytes()).unwrap()], config).unwrap()
    }

    #[test]
    fn fitness_is_that_of_the_track() {
        let (model, task) = (follower(), Task::default());
        for episode in 0..20 {
            let noise = NoiseStream::new(1, Purpose::Trial, [0, episode, 0]);
            let track = simulate_with(&model, &mut Periodic::new(20, &Layout::default()), &task, noise);
            let fitness = fitness_of(&model, &mut Periodic::new(20, &Layout::default()), &task, noise);
            assert!((task.fitness(&track) - fitness).abs() < 1e-12);
        }
    }

    #[test]
    fn a_track_of_n_lights_has_one_more_observation() {
        let task = Task { max_steps: 10, ..Task::default() };
        let track = simulate_with(
            &follower(),
            &mut Greedy::new(&task, &Layout::default()),
            &task,
            NoiseStream::new(1, Purpose::Trial, [0; 3]),
        );
        assert_eq!(track.samples.len(), 11);
        assert_eq!(track.samples.iter().filter(|sample| sample.light.is_some()).count(), 10);
        assert_eq!(track.samples[10].light, None);
        assert_eq!(track.samples[0].tip, task.start);
    }

    #[test]
    fn an_experiment_ends_at_its_height() {
        let task = Task::default();
        let track = simulate_with(
            &follower(),
            &mut Greedy::new(&task, &Layout::default()),
            &task,
            NoiseStream::new(1, Purpose::Trial, [0; 3]),
        );
        let last = track.samples.last().unwrap();
        assert!(last.tip.y >= 13.8 && track.samples[track.samples.len() - 2].tip.y < 13.8);
    }
}
