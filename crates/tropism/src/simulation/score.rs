//! Scores of many episodes: what evolution asks of a model.

use tropism_neat::Genome;

use super::batch;
use super::{cautious_fitness_of, fitness_of};
use crate::control::{Interface, NetworkController, PredictiveGreedy, PredictiveRule};
use crate::plant::PlantModel;
use crate::plant::stem::{PlaneModel, SpaceModel};
use crate::plant::tip::TipModel;
use crate::random::NoiseStream;
use crate::task::Task;

/// A controller, and the noise of the plant that it steers.
#[derive(Clone, Debug)]
pub struct Episode<C> {
    /// The controller, at rest.
    pub controller: C,
    /// Growth noise of the plant.
    pub noise: NoiseStream,
}

/// A model on which evolution can score many episodes.
///
/// Every model scores them one by one: `impl BatchModel for MyModel {}` is enough. A model with a faster path overrides
/// [`score`](Self::score); the fitness must be that of [`fitness_of`] to the bit.
pub trait BatchModel: PlantModel + Sized {
    /// The fitness of each episode's network, in order.
    ///
    /// # Panics
    /// If a genome has not the inputs of the sensors and the outputs of the model's lamps, or where it dims lamps of a model that
    /// knows one lamp at full power alone.
    fn score<'g>(
        &self,
        task: &Task,
        interface: Interface<'_>,
        episodes: impl Iterator<Item = Episode<&'g Genome>>,
    ) -> Vec<f64> {
        one_by_one(self, task, interface, episodes)
    }

    /// The fitness of each episode's rule, in order, less `beyond_cost_cm` for each step after which the plant is
    /// [beyond all data](PlantModel::is_beyond_data) of the model.
    fn score_rules(
        &self,
        task: &Task,
        beyond_cost_cm: f64,
        episodes: impl Iterator<Item = Episode<PredictiveRule>>,
    ) -> Vec<f64> {
        rules_one_by_one(self, task, beyond_cost_cm, episodes)
    }
}

fn rules_one_by_one<M: PlantModel>(
    model: &M,
    task: &Task,
    beyond_cost_cm: f64,
    episodes: impl Iterator<Item = Episode<PredictiveRule>>,
) -> Vec<f64> {
    let score = |Episode { controller, noise }| {
        let mut controller = PredictiveGreedy::new(controller, task, model.layout());
        cautious_fitness_of(model, &mut controller, task, noise, beyond_cost_cm)
    };
    episodes.map(score).collect()
}

fn one_by_one<'g, M: PlantModel>(
    model: &M,
    task: &Task,
    interface: Interface<'_>,
    episodes: impl Iterator<Item = Episode<&'g Genome>>,
) -> Vec<f64> {
    let score = |episode: Episode<&Genome>| {
        let mut controller = NetworkController::new(episode.controller, interface, task, model.layout())
            .expect("genomes of the shape of sensors and lamps");
        fitness_of(model, &mut controller, task, episode.noise)
    };
    episodes.map(score).collect()
}

impl BatchModel for TipModel {
    /// Side by side in vectors for the paper's targets (by any reading of eq. (9)), sensors and number of lamps.
    fn score<'g>(
        &self,
        task: &Task,
        interface: Interface<'_>,
        episodes: impl Iterator<Item = Episode<&'g Genome>>,
    ) -> Vec<f64> {
        match task.reading() {
            Some(reading)
                if interface.sensors.is_tip()
                    && interface.dimming.is_switch()
                    && self.layout().len() == 2 =>
            {
                batch::fitness_of_networks(self, task, reading, &mut { episodes })
            }
            _ => one_by_one(self, task, interface, episodes),
        }
    }
}

impl BatchModel for PlaneModel {
    /// Side by side in vectors for targets in the plane, with and without obstacles.
    fn score_rules(
        &self,
        task: &Task,
        beyond_cost_cm: f64,
        episodes: impl Iterator<Item = Episode<PredictiveRule>>,
    ) -> Vec<f64> {
        let mut episodes = episodes;
        batch::fitness_of_rules(self, task, beyond_cost_cm, &mut episodes)
            .unwrap_or_else(|| rules_one_by_one(self, task, beyond_cost_cm, episodes))
    }
}

impl BatchModel for SpaceModel {}
