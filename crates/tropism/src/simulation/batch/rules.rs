//! Predictive rules on many plants of the stem model at once.

use crate::control::rule::{END, LOWER, Rules};
use crate::control::{PredictiveGreedy, PredictiveRule};
use crate::math::{Lanes, Mask, Real};
use crate::obstacle::{Clearance, clearance_of};
use crate::plant::PlantModel;
use crate::plant::stem::{PlaneModel, Stems};
use crate::random::{NoiseStream, Purpose};
use crate::simd::{Kernel, dispatch};
use crate::simulation::{Episode, cautious_fitness_of};
use crate::task::Reading;
use crate::task::{Obstacles, Task};

/// Plants side by side. Chosen: two vectors of AVX2.
const LANES: usize = 8;

/// One number for each plant.
type Wide = Lanes<LANES>;

/// The fitness of each episode's rule on `model`, in order: what [`cautious_fitness_of`] gives, to the bit. `None` for a task that
/// has no form in lanes.
#[must_use]
pub(in crate::simulation) fn fitness_of_rules(
    model: &PlaneModel,
    task: &Task,
    beyond_cost_cm: f64,
    episodes: &mut dyn Iterator<Item = Episode<PredictiveRule>>,
) -> Option<Vec<f64>> {
    // The hot loop is not generic: so it is compiled here, and not in each crate that searches.
    let reading = task.reading();
    let has_lanes = reading.is_some() && task.obstacles.is_empty() || task.has_score::<Obstacles>();
    has_lanes.then(|| fitness_in_lanes(model, LaneTask { task, reading }, beyond_cost_cm, episodes))
}

fn fitness_in_lanes(
    model: &PlaneModel,
    of_lanes: LaneTask<'_>,
    beyond_cost_cm: f64,
    episodes: &mut dyn Iterator<Item = Episode<PredictiveRule>>,
) -> Vec<f64> {
    let task = of_lanes.task;
    let (start, layout) = (task.start, model.layout());
    let mut batch = Batch {
        stems: Stems::new(model, start, NoiseStream::new(0, Purpose::Trial, [0; 3])),
        rules: Rules::new(task, !task.obstacles.is_empty()),
        sides: [false, true].map(|is_right| layout.side(layout.towards(is_right))),
        highest_cm: Wide::splat(start.y),
        nearest: None,
        beyond_cost_cm,
        fitness: Wide::splat(0.0),
        steps: [0; LANES],
        numbers: [None; LANES],
    };
    let mut fitness = Vec::with_capacity(episodes.size_hint().0);
    loop {
        let mut is_any_running = false;
        for lane in 0..LANES {
            while batch.is_over(task, lane) {
                if let Some(number) = batch.numbers[lane].take() {
                    fitness[number] = batch.fitness.lane(lane);
                }
                let Some(Episode { controller, noise }) = episodes.next() else { break };
                if batch.rules.refill(lane, &controller, task) {
                    batch.stems.refill(lane, start, noise);
                    batch.fitness.set_lane(lane, 0.0);
                    batch.highest_cm.set_lane(lane, start.y);
                    batch.steps[lane] = 0;
                    batch.numbers[lane] = Some(fitness.len());
                    fitness.push(0.0);
                } else {
                    let mut plain = PredictiveGreedy::new(controller, task, layout);
                    fitness.push(cautious_fitness_of(model, &mut plain, task, noise, beyond_cost_cm));
                }
            }
            is_any_running |= batch.numbers[lane].is_some();
        }
        if !is_any_running {
            return fitness;
        }
        // New seedlings stand where the last step left other plants.
        batch.look_at_obstacles(task);
        dispatch(UntilOneIsOver { batch: &mut batch, task: of_lanes });
    }
}

/// A task that has a form in lanes.
#[derive(Clone, Copy)]
struct LaneTask<'t> {
    task: &'t Task,
    /// How it is scored by eq. (9); else as targets behind obstacles.
    reading: Option<Reading>,
}

/// Plants, each with its rule. A plant without a number is done and grows on.
struct Batch<'m> {
    stems: Stems<'m, 1, Wide>,
    rules: Rules<Wide>,
    /// The side of the left and of the right lamp, as the model knows it.
    sides: [f64; 2],
    /// Greatest height of each tip so far, in cm.
    highest_cm: Wide,
    /// Where each stem is nearest to an obstacle.
    nearest: Option<Clearance<Wide>>,
    /// What each step beyond the data of the model costs, in cm.
    beyond_cost_cm: f64,
    fitness: Wide,
    steps: [u32; LANES],
    /// Number of the episode in each lane.
    numbers: [Option<usize>; LANES],
}

impl Batch<'_> {
    /// x and y of the tip of each plant, in cm.
    #[inline(always)]
    fn tips(&self) -> [Wide; 2] {
        let tip = &self.stems.body.tip;
        [tip.aside[0], tip.up]
    }

    /// Whether the experiment of a lane is over, or there is none.
    fn is_over(&self, task: &Task, lane: usize) -> bool {
        let is_high = self.tips()[1].lane(lane) >= task.end_height_cm;
        let is_over = is_high || self.steps[lane] >= task.max_steps;
        is_over || self.numbers[lane].is_none()
    }

    /// Finds where each stem is nearest to an obstacle.
    #[inline(always)]
    fn look_at_obstacles(&mut self, task: &Task) {
        if !task.obstacles.is_empty() {
            let points = self.stems.body.stem.iter().map(|point| [point.aside[0], point.up]);
            self.nearest = Some(clearance_of(f64::INFINITY, &task.obstacles, points));
        }
    }

    /// One step of every plant.
    #[inline(always)]
    fn step(&mut self, LaneTask { task, reading }: LaneTask<'_>) {
        let (before, stem) = (self.tips(), &self.stems.body.stem);
        let lean = stem[END].aside[0] - stem[LOWER].aside[0];
        let aim = self.rules.aim(before[1]);
        let is_right = self.rules.way_x(aim, before[0], self.nearest.as_ref(), lean).gt(Wide::splat(0.0));
        // Where the rule remembers a lamp, right is 1 and left -1, wherever the lamps stand.
        self.rules.lit([Wide::select(is_right, Wide::splat(1.0), Wide::splat(-1.0)), Wide::splat(0.0)]);
        let [left, right] = self.sides.map(Wide::splat);
        self.stems.step([[Wide::select(is_right, right, left)]]);

        let (after, was_highest) = (self.tips(), self.highest_cm);
        self.highest_cm = was_highest.max(after[1]);
        let was_nearest = self.nearest;
        self.look_at_obstacles(task);
        let worth = if let Some(reading) = reading {
            reading.step_fitness(&task.targets, [was_highest, self.highest_cm], before[0], after[0])
        } else {
            let worth = task.worth_of_targets(was_highest, after);
            match (was_nearest, self.nearest) {
                (Some(was), Some(now)) => worth - task.contact_cost(was.distance_cm, now.distance_cm),
                _ => worth,
            }
        };
        let (beyond, nothing) = (Wide::splat(self.beyond_cost_cm), Wide::splat(0.0));
        self.fitness += worth;
        self.fitness -= Wide::select(self.stems.is_beyond_data(), beyond, nothing);
    }
}

/// Steps of every plant until the experiment of one is over.
struct UntilOneIsOver<'b, 'm> {
    batch: &'b mut Batch<'m>,
    task: LaneTask<'b>,
}

impl Kernel for UntilOneIsOver<'_, '_> {
    type Result = ();

    #[inline(always)]
    fn run(self) {
        let Self { batch, task: of_lanes } = self;
        let task = of_lanes.task;
        loop {
            batch.step(of_lanes);
            let is_high = batch.tips()[1].ge(Wide::splat(task.end_height_cm));
            let mut is_any_over = false;
            for lane in 0..LANES {
                batch.steps[lane] = batch.steps[lane].wrapping_add(1);
                let is_over = is_high.lane(lane) | (batch.steps[lane] >= task.max_steps);
                is_any_over |= is_over & batch.numbers[lane].is_some();
            }
            if is_any_over {
                return;
            }
        }
    }
}
