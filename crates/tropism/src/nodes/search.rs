//! Evolution of the network of all nodes, on a model of the plant.
//!
//! In: a wall, a model that knows its lamps at any levels, such as a [`SpaceModel`](crate::plant::stem::SpaceModel) of plants that
//! grew before it, and a seed. Out: the network that did best on plants of the model which it never met. The
//! idea: one genome is one network, which runs in every node of the wall. Its fitness is the mean over plants of the share of
//! right decisions, plus 1 for a whole path, plus the aim of the light. Each generation has new plants.
//!
//! A node that says "done" gains nothing until the next one waits for it, so many evolutions end where the whole path is lit, and
//! many lose the hand-over again. The aim (reward shaping) pays for light on the node that the plant should reach next, and costs
//! as much for light on any other: it is known to the fitness and to no node. Several populations evolve on their own, and the best
//! network of each generation is kept and tested on fresh plants at the end.
//!
//! # References
//! Ng, Harada and Russell 1999, "Policy invariance under reward transformations" (ICML): reward shaping.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};
use tropism_neat::{Activation, Config, Genome, Neat, NeatError};

use super::controller::NodeController;
use super::detector::DetectorSettings;
use super::faults::NodeFaults;
use super::interface::{NODE_INPUTS, NODE_OUTPUTS};
use super::network::NetworkNode;
use super::proximity::{Patch, Proximity, STEM_RADIUS_CM};
use super::running::WallNodes;
use super::wall::NodeWall;
use crate::check::{self, OutOfRange};
use crate::geometry::space::SpacePoint;
use crate::lamps::Light;
use crate::math::statistics::mean;
use crate::math::vector::{between, distance};
use crate::parallel;
use crate::plant::PlantModel;
use crate::random::{self, NoiseStream, Purpose};
use crate::task::Task;

/// Hours of learning before a plant of the model. Chosen: enough for the spread of the noise.
const LEARNING_H: f64 = 6.0;
/// Most steps with a plant. Chosen: growth from 4 to 18 cm takes some 470.
const MAX_STEPS: u32 = 800;

/// Settings of a [`NodeEvolution`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct NodeEvolutionConfig {
    /// Evolutions, each with a population of its own, 1 to 1000.
    pub runs: u32,
    /// Generations of each, 1 to 100000.
    pub generations: u32,
    /// Plants on which each network of a generation is scored, 1 to 10000.
    pub plants: u32,
    /// Fresh plants on which the best of each generation are tested at the end, 1 to 100000.
    pub test_plants: u32,
    /// Fitness of light that always shines on the next node of the path and on no other, 0 to 10.
    pub aim_weight: f64,
    /// Parameters of NEAT.
    pub neat: Config,
}

impl Default for NodeEvolutionConfig {
    /// The paper's NEAT with smooth neurons of the usual slope 4.9 (Stanley and Miikkulainen 2002, section 4.1) and weights up
    /// to 20.
    fn default() -> Self {
        let neat = Config {
            population: 60,
            output_activation: Activation::UnsignedSigmoid,
            hidden_activation: Activation::UnsignedSigmoid,
            activation_a: 4.9,
            max_weight: 20.0,
            ..Config::wahby2016()
        };
        Self { runs: 4, generations: 50, plants: 20, test_plants: 200, aim_weight: 1.0, neat }
    }
}

impl NodeEvolutionConfig {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key.
    pub fn check(&self) -> Result<(), OutOfRange> {
        check::within("runs", self.runs, 1..=1000)?;
        check::within("generations", self.generations, 1..=100_000)?;
        check::within("plants", self.plants, 1..=10_000)?;
        check::within("test_plants", self.test_plants, 1..=100_000)?;
        check::within("aim_weight", self.aim_weight, 0.0..=10.0)
    }
}

/// What a network did before one plant, or the mean over several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NodeScore {
    /// Fitness.
    pub fitness: f64,
    /// Share of right decisions of all nodes of the path.
    pub right: f64,
    /// Share of plants that went the whole path.
    pub whole: f64,
    /// Mean light on the next node of the path less that on all others, in lamps at full power; at most 1.
    pub aim: f64,
    /// Hours of lamp light.
    pub lit_h: f64,
}

/// The network that an evolution found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvolvedNodes {
    /// The network of each node.
    pub genome: Genome,
    /// How its echo detector is set.
    pub detector: DetectorSettings,
    /// What it did on fresh plants of the model.
    pub test: NodeScore,
    /// Run from which it is.
    pub run: u32,
    /// Generation of this run.
    pub generation: u32,
    /// Networks that were scored.
    pub evaluations: u64,
}

/// Evolution of the network of all nodes of a wall.
pub struct NodeEvolution<'a, M> {
    /// The wall.
    pub wall: &'a NodeWall,
    /// The sensor of each node.
    pub sensor: &'a Proximity,
    /// How the echo detector of each node is set.
    pub detector: DetectorSettings,
    /// The model of the plant, in space, under the lamps of the wall.
    pub model: &'a M,
    /// Settings.
    pub config: &'a NodeEvolutionConfig,
}

impl<M: PlantModel> NodeEvolution<'_, M> {
    /// Evolves from `seed`. `watch` hears of each generation its best fitness, and may break off; then there is no result.
    ///
    /// # Errors
    /// [`NeatError`] if NEAT's parameters are out of range.
    ///
    /// # Panics
    /// If the model has no stems in space, or does not know several lamps at any levels.
    pub fn evolve(
        &self,
        seed: u64,
        watch: &dyn Fn(f64) -> ControlFlow<()>,
    ) -> Result<Option<EvolvedNodes>, NeatError> {
        let mut candidates: Vec<Candidate> = Vec::new();
        let mut evaluations = 0;
        for run in 0..self.config.runs {
            let seed = random::derive(seed, Purpose::Run, run.into());
            let mut neat = Neat::new(self.config.neat.clone(), NODE_INPUTS, NODE_OUTPUTS, seed)?;
            for generation in 0..self.config.generations {
                // New plants in each generation, the same for all its networks.
                let plants = random::derive(seed, Purpose::Plant, generation.into());
                let scores =
                    neat.evaluate(|genome, _| self.score(genome, plants, self.config.plants).fitness);
                let best = (0..scores.len()).max_by(|&one, &other| scores[one].total_cmp(&scores[other]));
                let Some(best) = best else { return Ok(None) };
                candidates.push(Candidate { run, generation, genome: neat.ask()[best].clone() });
                neat.tell(&scores)?;
                if watch(scores[best]).is_break() {
                    return Ok(None);
                }
            }
            evaluations += neat.evaluations();
        }
        let fresh = random::derive(seed, Purpose::Trial, 0);
        let tests = parallel::map(candidates.len(), |number| {
            self.score(&candidates[number].genome, fresh, self.config.test_plants)
        });
        let tested = candidates.into_iter().zip(tests);
        let best = tested.max_by(|(_, one), (_, other)| one.fitness.total_cmp(&other.fitness));
        Ok(best.map(|(Candidate { run, generation, genome }, test)| {
            let detector = self.detector;
            EvolvedNodes { genome, detector, test, run, generation, evaluations }
        }))
    }

    /// The mean score of a network over `plants` plants of the model.
    #[must_use]
    pub fn score(&self, genome: &Genome, seed: u64, plants: u32) -> NodeScore {
        let scores: Vec<NodeScore> = (0..plants).map(|plant| self.episode(genome, seed, plant)).collect();
        let of = |value: fn(&NodeScore) -> f64| mean(scores.iter().map(value));
        NodeScore {
            fitness: of(|score| score.fitness),
            right: of(|score| score.right),
            whole: of(|score| score.whole),
            aim: of(|score| score.aim),
            lit_h: of(|score| score.lit_h),
        }
    }

    fn episode(&self, genome: &Genome, seed: u64, plant: u32) -> NodeScore {
        let controller = || {
            Box::new(NetworkNode::new(genome, self.detector).expect("inputs and outputs of a node"))
                as Box<dyn NodeController>
        };
        let wall_seed = random::derive(seed, Purpose::Nodes, plant.into());
        let period_h = self.model.period_min() / 60.0;
        let faults = NodeFaults::default();
        let mut nodes = WallNodes::new(self.wall, faults, controller, [period_h, LEARNING_H], wall_seed);
        let mut sensors = self.sensor.sensors(self.wall, period_h, wall_seed);
        while nodes.learning_steps_left() > 0 {
            nodes.step(&mut sensors, None);
        }
        let path = nodes.path().to_vec();
        let noise = NoiseStream::new(seed, Purpose::Growth, [plant, 0, 0]);
        let mut grown = self.model.seedling(Task::default().start, &mut noise.of_seedling());
        let (mut right, mut taken, mut steps, mut aim, mut lit) = (0, 0, 0.0, 0.0, 0.0);
        for step in 0..MAX_STEPS {
            let stem = self.model.observe(&grown).stem_in_space().expect("a model of stems in space");
            let [x, y, _] = stem[stem.len() - 1];
            while let Some(&node) = path.get(taken).filter(|&&node| y >= self.wall.nodes[node].at[1]) {
                right += u32::from(self.wall.is_nearest(node, x));
                taken += 1;
            }
            if taken == path.len() {
                break;
            }
            let lighting = nodes.step(&mut sensors, Some(&patches(&stem)[..]));
            let next = Light::new(path[taken]).map_or(0.0, |light| lighting.powers()[light.index()]);
            steps += 1.0;
            lit += lighting.total();
            aim += next - (lighting.total() - next);
            self.model.shine(&mut grown, lighting, &mut noise.at(step));
        }
        let right = f64::from(right) / path.len() as f64;
        let whole = if right >= 1.0 { 1.0 } else { 0.0 };
        // A plant that starts above the path leaves no step.
        let aim = aim / f64::max(steps, 1.0);
        let fitness = right + whole + self.config.aim_weight * aim;
        NodeScore { fitness, right, whole, aim, lit_h: lit * period_h }
    }
}

/// The best network of a generation.
struct Candidate {
    run: u32,
    generation: u32,
    genome: Genome,
}

/// A stem as sensors see it.
fn patches(stem: &[SpacePoint]) -> Vec<Patch> {
    let patch = |pair: &[SpacePoint]| Patch {
        at: between(pair[0], pair[1], 0.5),
        area: 2.0 * STEM_RADIUS_CM * distance(pair[0], pair[1]),
    };
    stem.windows(2).map(patch).collect()
}
