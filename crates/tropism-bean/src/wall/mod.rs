//! A virtual bean before a wall of nodes: it grows free-standing, and the nodes steer it along the drawn path.
//!
//! In: a wall, sensors, faults, the controller of the nodes, and seeds of plants. Out: what became of each plant
//! ([`WallRun`]), judged by its true apex and never by the sensors. A decision is on which side the apex first reaches the
//! height of a node of the path. [`WallTrial::grow`] grows many plants to their ends, [`WallEnvironment`] one plant step by step
//! under decisions from outside; both go through the same [`WallEpisode`].

mod episode;
mod environment;

use tropism::lamps::{Light, MAX_LAMPS};
use tropism::lighting::Lighting;
use tropism::math::vector::{Vec3, between, cross, distance, dot, normalize_or};
use tropism::nodes::{NodeController, NodeFaults, NodeRow, NodeWall, Patch, Proximity};
use tropism::random::{NoiseStream, Purpose};
use tropism::track::{PAPER_PERIOD_MIN, Sample, Track};

use super::grow::Observer;
use super::pose::{Leaf, Pose};
use super::render::NodeCamera;
use super::{Bean, Population, Species};

pub use environment::WallEnvironment;
pub use episode::WallEpisode;

/// Patches along the blade of a leaf. Chosen: each is shorter than the least distance to a node.
const LEAF_PATCHES: u32 = 6;

/// An experiment on virtual plants before a wall.
#[derive(Clone, Debug)]
pub struct WallTrial {
    /// The wall.
    pub wall: NodeWall,
    /// The proximity sensors of its nodes.
    pub sensor: Proximity,
    /// A camera in each node instead.
    pub camera: Option<NodeCamera>,
    /// Faults.
    pub faults: NodeFaults,
    /// The species of the plants.
    pub species: Species,
    /// Individual variation as a multiple of that of the species.
    pub scale: f64,
    /// Minutes from one step to the next.
    pub period_min: f64,
    /// For how long the nodes learn the empty scene before the plant is there, in h.
    pub learning_h: f64,
    /// Largest number of steps with the plant.
    pub max_steps: u32,
}

/// On which side a plant reached the height of a node of the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decision {
    /// Number of the node.
    pub node: usize,
    /// Number of the step, from 0 when the plant was put there.
    pub step: u32,
    /// The true apex at this step, in cm.
    pub apex: Vec3,
    /// Whether the node of the path was the nearest one of its level.
    pub is_right: bool,
}

/// What became of one plant.
#[derive(Clone, Debug, PartialEq)]
pub struct WallRun {
    /// Seed of the plant.
    pub seed: u64,
    /// Numbers of the nodes on the drawn path, lowest first.
    pub path: Vec<usize>,
    /// Decisions taken, lowest first; fewer than nodes of the path if the plant did not get there.
    pub decisions: Vec<Decision>,
    /// Least distance of the true apex to each node of the path in the plane of x and y, in cm.
    pub nearest_cm: Vec<f64>,
    /// Steps with the plant.
    pub steps: u32,
    /// Hours of lamp light at level 255, summed over all lamps.
    pub lit_h: f64,
    /// Numbers of the nodes whose lamp was dead.
    pub dead_lamps: Vec<usize>,
    /// The true apex at each step, in cm.
    pub apex: Vec<Vec3>,
    /// What each node said at each step with the plant; empty unless asked for.
    pub rows: Vec<NodeRow>,
}

impl WallRun {
    /// Whether the plant took all decisions of the path, and all rightly.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.decisions.len() == self.path.len() && self.decisions.iter().all(|decision| decision.is_right)
    }
}

impl WallTrial {
    /// The wall of [`NodeWall::three_levels`] without faults, at the paper's period.
    #[must_use]
    pub fn new(species: Species) -> Self {
        Self {
            wall: NodeWall::three_levels(),
            sensor: Proximity::default(),
            camera: None,
            faults: NodeFaults::default(),
            species,
            scale: 1.0,
            period_min: PAPER_PERIOD_MIN,
            learning_h: 24.0,
            max_steps: 1000,
        }
    }

    /// Grows the plants of `seeds` side by side before a wall of their own each. `controller` makes the controller of each
    /// node. With `keeps_rows` the runs hold what each node said.
    ///
    /// ```
    /// use tropism::nodes::{NodeController, StateMachine, StateMachineSettings};
    /// use tropism_bean::{Species, wall::WallTrial};
    /// let machine = || Box::new(StateMachine::new(StateMachineSettings::default())) as Box<dyn NodeController>;
    /// let runs = WallTrial::new(Species::default()).grow(&[1, 2], &machine, false);
    /// assert!(runs.iter().all(|run| run.is_whole()));
    /// ```
    ///
    /// # Panics
    /// Unless wall, sensor and faults are checked.
    pub fn grow(
        &self,
        seeds: &[u64],
        controller: &dyn Fn() -> Box<dyn NodeController>,
        keeps_rows: bool,
    ) -> Vec<WallRun> {
        let mut runs: Vec<Option<WallRun>> = vec![None; seeds.len()];
        let mut population = Population::new(Vec::new());
        let mut growing: Vec<(usize, WallEpisode)> = Vec::new();
        for (place, &seed) in seeds.iter().enumerate() {
            population.beans.push(self.seedling(seed));
            growing.push((place, WallEpisode::new(self, seed, controller, keeps_rows)));
        }
        while !growing.is_empty() {
            let mut powers = Vec::with_capacity(growing.len());
            let mut number = 0;
            while number < growing.len() {
                let pose = population.beans[number].pose();
                if growing[number].1.judge(self, &pose) {
                    let (place, ended) = growing.remove(number);
                    population.beans.remove(number);
                    runs[place] = Some(ended.into_run());
                } else {
                    powers.push(self.powers(growing[number].1.step(self, &pose)));
                    number += 1;
                }
            }
            population.advance(&powers, self.period_min);
        }
        runs.into_iter().flatten().collect()
    }

    /// Grows the plant of `seed` alone, as [`grow`](Self::grow) does, and shows `see` at each step its pose, what the nodes say and
    /// how their lamps are lit.
    ///
    /// # Panics
    /// Unless wall, sensor and faults are checked.
    pub fn watch(
        &self,
        seed: u64,
        controller: &dyn Fn() -> Box<dyn NodeController>,
        mut see: impl FnMut(&Pose, &[NodeRow], Lighting),
    ) -> WallRun {
        let (mut bean, mut episode) = (self.seedling(seed), WallEpisode::new(self, seed, controller, true));
        loop {
            let pose = bean.pose();
            if episode.judge(self, &pose) {
                return episode.into_run();
            }
            let said = episode.run().rows.len();
            let lighting = episode.step(self, &pose);
            see(&pose, &episode.run().rows[said..], lighting);
            bean.advance(&self.powers(lighting), self.period_min);
        }
    }

    /// Powers of the lamps of the wall, as [`Bean::advance`] takes them.
    fn powers(&self, lighting: Lighting) -> [f64; MAX_LAMPS] {
        lighting.powers().map(|share| share * self.wall.power)
    }

    /// Grows the plant of `seed` open loop for `steps` steps, seen in space: one lamp is lit, or none, another one every
    /// `change_h` hours.
    ///
    /// # Panics
    /// Unless the wall is checked.
    #[must_use]
    pub fn open_loop(&self, seed: u64, steps: u32, change_h: f64) -> Track {
        let layout = self.wall.layout().expect("a checked wall");
        let mut track = Track { layout, period_min: self.period_min, ..Track::default() };
        let (mut bean, mut observer) = (self.seedling(seed), Observer::of(seed, true));
        let draws = NoiseStream::new(seed, Purpose::Schedule, [0; 3]);
        let choices = self.wall.nodes.len() + 1;
        for step in 0..=steps {
            let time_s = 60.0 * self.period_min * f64::from(step);
            let lamp = (draws.at((time_s / 3600.0 / change_h) as u32).uniform() * choices as f64) as usize;
            let light = Light::new(lamp).filter(|_| lamp < self.wall.nodes.len() && step < steps);
            track.samples.push(Sample::of(observer.observe(&bean), step, time_s, light));
            bean.advance_under(light.into(), self.wall.power, self.period_min);
        }
        track
    }

    fn seedling(&self, seed: u64) -> Bean {
        let layout = self.wall.layout().expect("a checked wall");
        Bean::new(self.species.draw(seed, self.scale), seed).under(&layout).with_beams(&self.wall.beams())
    }
}

/// The surfaces of a plant that echo, as seen along z: segments of the stem, and pieces of the leaves.
#[must_use]
pub fn patches(pose: &Pose) -> Vec<Patch> {
    let segments = pose.stem.windows(2).map(|pair| Patch {
        at: between(pair[0].at, pair[1].at, 0.5),
        area: (pair[0].radius + pair[1].radius) * distance(pair[0].at, pair[1].at),
    });
    segments.chain(pose.leaves.iter().flat_map(pieces)).collect()
}

/// Pieces of the blade of a leaf, with the area that they show along z (Lambert's cosine law).
fn pieces(leaf: &Leaf) -> impl Iterator<Item = Patch> {
    let blade = leaf.length * (1.0 - Leaf::PETIOLE);
    // About half of the square around the blade is blade.
    let area = 0.5 * blade * blade * Leaf::WIDTH;
    let normal = normalize_or(cross(leaf.along, leaf.across), [0.0, 1.0, 0.0]);
    let shown = area * dot(normal, [0.0, 0.0, 1.0]).abs() / f64::from(LEAF_PATCHES);
    let leaf = *leaf;
    (0..LEAF_PATCHES).map(move |piece| {
        let share = (f64::from(piece) + 0.5) / f64::from(LEAF_PATCHES);
        Patch { at: leaf.place(Leaf::PETIOLE + share * (1.0 - Leaf::PETIOLE), 0.0), area: shown }
    })
}

#[cfg(test)]
mod tests {
    use tropism::nodes::{Baseline, StateMachine, StateMachineSettings};

    use super::*;

    fn machine() -> Box<dyn NodeController> {
        Box::new(StateMachine::new(StateMachineSettings::default()))
    }

    #[test]
    fn the_state_machine_leads_plants_along_the_path_and_darkness_does_not() {
        let trial = WallTrial::new(Species::default());
        let seeds: Vec<u64> = (0..8).collect();
        let whole = |runs: &[WallRun]| runs.iter().filter(|run| run.is_whole()).count();
        let steered = trial.grow(&seeds, &machine, true);
        assert!(whole(&steered) >= 7, "{}", whole(&steered));
        assert!(steered.iter().all(|run| run.lit_h > 5.0 && !run.rows.is_empty()));
        let dormant = trial.grow(&seeds, &|| Box::new(Baseline::Dormant), false);
        // One in eight by chance: four or more have a probability of 1.1 % .
        assert!(whole(&dormant) <= 3 && dormant.iter().all(|run| run.lit_h == 0.0));
    }

    #[test]
    fn nodes_with_cameras_lead_plants_along_the_path() {
        let camera = Some(NodeCamera::default());
        let trial = WallTrial { camera, ..WallTrial::new(Species::default()) };
        let steered = trial.grow(&(0..8).collect::<Vec<u64>>(), &machine, false);
        assert!(steered.iter().filter(|run| run.is_whole()).count() >= 7);
        // A camera that sees nothing hands over after hours.
        let blind = WallTrial { faults: NodeFaults { blind: 3, ..NodeFaults::default() }, ..trial };
        let slow = blind.grow(&[0], &machine, false);
        assert!(slow[0].lit_h > steered[0].lit_h + 5.0);
    }

    #[test]
    fn plants_side_by_side_are_those_that_grow_alone() {
        let mut trial = WallTrial { max_steps: 120, ..WallTrial::new(Species::default()) };
        // Only the left lamps have a cone: limited and unlimited lamps stand in one group of lanes.
        for node in trial.wall.nodes.iter_mut().step_by(2) {
            node.half_angle_deg = Some(60.0);
        }
        let together = trial.grow(&[5, 6, 7], &machine, true);
        for run in together {
            let mut lit_h = 0.0;
            let watched = trial.watch(run.seed, &machine, |pose, rows, lighting| {
                assert!(rows.len() == 6 && pose.stem.len() > 1);
                lit_h += lighting.total() * trial.period_min / 60.0;
            });
            assert_eq!((&watched, lit_h), (&run, run.lit_h));
            assert_eq!(trial.grow(&[run.seed], &machine, true), [run]);
        }
    }

    #[test]
    fn patches_have_the_area_of_the_stem() {
        let mut bean = Bean::new(Species::default().draw(1, 1.0), 1);
        bean.advance(&[], 24.0 * 60.0);
        let pose = bean.pose();
        let area: f64 = patches(&pose)[..pose.stem.len() - 1].iter().map(|patch| patch.area).sum();
        let length = bean.length();
        assert!((2.0 * 0.1 * length..2.0 * 0.2 * length).contains(&area), "{area} for {length} cm");
        assert!(pose.apex()[1] > 8.0);
    }
}
