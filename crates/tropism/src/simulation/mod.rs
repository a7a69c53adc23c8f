//! A world that is a model: a controller meets simulated plants here, by the thousand while it evolves.
//!
//! [`Simulation`] is an [`Environment`] like a tent, so [`run`] writes its track; [`fitness_of`] is the same loop without
//! the track, and [`lanes`] is that for many plants at once, for evolution.

pub mod lanes;
mod networks;
mod plants;
pub mod seeds;

use std::convert::Infallible;

use crate::control::Controller;
use crate::environment::{Environment, run, unwatched};
use crate::light::Light;
use crate::observation::Observation;
use crate::plant::PlantModel;
use crate::random::Draws;
use crate::task::Task;
use crate::track::Track;

/// One simulated plant.
#[derive(Clone, Debug)]
pub struct Simulation<'m, M: PlantModel> {
    model: &'m M,
    plant: M::Plant,
    draws: Draws,
    step: u32,
}

impl<'m, M: PlantModel> Simulation<'m, M> {
    /// A seedling of `model` where `task` starts, whose luck in growth is `draws`.
    pub fn new(model: &'m M, task: &Task, draws: Draws) -> Self {
        Self { model, plant: model.seedling(task.start), draws, step: 0 }
    }
}

impl<M: PlantModel> Environment for Simulation<'_, M> {
    type Error = Infallible;

    fn observe(&mut self) -> Result<Observation, Infallible> {
        Ok(self.model.observe(&self.plant))
    }

    fn step(&mut self, light: Light) -> Result<(), Infallible> {
        self.plant = self.model.step(&self.plant, light, self.draws.normal(self.step));
        self.step += 1;
        Ok(())
    }
}

/// The track of `controller` on `model`.
pub fn simulate<M: PlantModel>(
    model: &M,
    controller: &mut (impl Controller + ?Sized),
    task: &Task,
    draws: Draws,
) -> Track {
    let Ok(track) = run(&mut Simulation::new(model, task, draws), controller, task, &mut unwatched);
    track
}

/// The fitness of `controller` on `model`, eq. (9): what [`Task::fitness`] says of [`simulate`], without the track.
pub fn fitness_of<M: PlantModel>(
    model: &M,
    controller: &mut (impl Controller + ?Sized),
    task: &Task,
    draws: Draws,
) -> f64 {
    let mut plant = model.seedling(task.start);
    let mut seen = model.observe(&plant);
    let floor = seen.tip.y;
    let mut fitness = 0.0;
    let mut step = 0;
    while !task.is_over(step, seen.tip) {
        let light = controller.decide(&seen);
        plant = model.step(&plant, light, draws.normal(step));
        let after = model.observe(&plant);
        fitness += task.step_fitness(floor, seen.tip, after.tip);
        seen = after;
        step += 1;
    }
    fitness
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::chase::Chase;
    use crate::control::periodic::Periodic;
    use crate::geometry::Point;
    use crate::plant::shifts::{Shift, Window};
    use crate::plant::tip::Growth;
    use crate::plant::window::WindowModel;
    use crate::random::Purpose;

    /// A plant that leans 0.2 cm a step towards the light wherever it is.
    fn follower() -> WindowModel {
        let shifts = Light::BOTH.map(|light| Shift {
            tip: Point::new(0.0, 9.0),
            dx: 0.2 * light.sign(),
            dy: 0.03,
            light,
        });
        WindowModel {
            shifts: shifts.to_vec(),
            window: Window { wx: 50.0, wy: 50.0 },
            growth: Growth::default(),
        }
    }

    #[test]
    fn fitness_is_that_of_the_track() {
        let (model, task) = (follower(), Task::default());
        for episode in 0..20 {
            let draws = Draws::new(1, Purpose::Trial, [0, episode, 0]);
            let track = simulate(&model, &mut Periodic::new(20, Light::Left), &task, draws);
            let fitness = fitness_of(&model, &mut Periodic::new(20, Light::Left), &task, draws);
            assert!((task.fitness(&track) - fitness).abs() < 1e-12);
        }
    }

    #[test]
    fn a_track_of_n_lights_has_one_more_observation() {
        let task = Task { max_steps: 10, ..Task::default() };
        let track = simulate(
            &follower(),
            &mut Chase::new(task.targets.clone()),
            &task,
            Draws::new(1, Purpose::Trial, [0; 3]),
        );
        assert_eq!(track.samples.len(), 11);
        assert_eq!(track.samples.iter().filter(|sample| sample.light.is_some()).count(), 10);
        assert_eq!(track.samples[10].light, None);
        assert_eq!(track.samples[0].tip, task.start);
    }

    #[test]
    fn an_experiment_ends_at_its_height() {
        let task = Task::default();
        let track = simulate(
            &follower(),
            &mut Chase::new(task.targets.clone()),
            &task,
            Draws::new(1, Purpose::Trial, [0; 3]),
        );
        let last = track.samples.last().unwrap();
        assert!(last.tip.y >= 13.8 && track.samples[track.samples.len() - 2].tip.y < 13.8);
    }
}
