//! Predictive rules on many plants of the stem model at once.

#![allow(clippy::needless_range_loop, reason = "a lane is an index into many arrays at once")]

use crate::control::rule::lanes::Rules;
use crate::control::{PredictiveGreedy, PredictiveRule};
use crate::geometry::{Point, STEM_POINTS};
use crate::math::lanes::{LANES, Row};
use crate::math::{Lanes, Mask};
use crate::obstacle::lanes::{ClearanceRow, PointRow, are_known, clearance_of};
use crate::plant::PlantModel;
use crate::plant::stem::{PlaneModel, Stems};
use crate::random::{NoiseStream, Purpose};
use crate::simd::{Kernel, dispatch};
use crate::simulation::{Episode, cautious_fitness_of};
use crate::task::{Obstacles, Targets, Task};

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
    let is_eq_9 = task.has_score::<Targets>();
    let has_lanes =
        is_eq_9 && task.obstacles.is_empty() || task.has_score::<Obstacles>() && are_known(&task.obstacles);
    has_lanes.then(|| fitness_in_lanes(model, LaneTask { task, is_eq_9 }, beyond_cost_cm, episodes))
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
        rules: Rules::new(task.way().len(), layout),
        highest: [start.y; LANES],
        nearest: None,
        beyond_cost_cm,
        fitness: [0.0; LANES],
        steps: [0; LANES],
        numbers: [None; LANES],
    };
    let mut fitness = Vec::with_capacity(episodes.size_hint().0);
    loop {
        let mut is_any_running = false;
        for lane in 0..LANES {
            while batch.is_over(task, lane) {
                if let Some(number) = batch.numbers[lane].take() {
                    fitness[number] = batch.fitness[lane];
                }
                let Some(Episode { controller, noise }) = episodes.next() else { break };
                if batch.rules.refill(lane, controller, task, layout) {
                    batch.stems.refill(lane, start, noise);
                    (batch.fitness[lane], batch.steps[lane], batch.highest[lane]) = (0.0, 0, start.y);
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
        dispatch(UntilOneIsOver { batch: &mut batch, task: of_lanes });
    }
}

/// A task that has a form in lanes.
#[derive(Clone, Copy)]
struct LaneTask<'t> {
    task: &'t Task,
    /// Whether it is scored by eq. (9); else as targets behind obstacles.
    is_eq_9: bool,
}

/// Plants, each with its rule. A plant without a number is done and grows on.
struct Batch<'m> {
    stems: Stems<'m, 1, Lanes<LANES>>,
    rules: Rules,
    /// Greatest height of each tip so far, in cm.
    highest: Row,
    /// Where each stem is nearest to an obstacle.
    nearest: Option<ClearanceRow>,
    /// What each step beyond the data of the model costs, in cm.
    beyond_cost_cm: f64,
    fitness: Row,
    steps: [u32; LANES],
    /// Number of the episode in each lane.
    numbers: [Option<usize>; LANES],
}

impl Batch<'_> {
    /// The tip of each plant, in cm.
    #[inline(always)]
    fn tips(&self) -> PointRow {
        let tip = &self.stems.body.tip;
        [tip.aside[0].0, tip.up.0]
    }

    /// Ten points of the stem of each plant, from the base up, in cm.
    #[inline(always)]
    fn points(&self) -> [PointRow; STEM_POINTS] {
        let mut points = [[[0.0; LANES]; 2]; STEM_POINTS];
        for point in 0..STEM_POINTS {
            let place = &self.stems.body.stem[point];
            points[point] = [place.aside[0].0, place.up.0];
        }
        points
    }

    /// Whether the experiment of a lane is over, or there is none.
    fn is_over(&self, task: &Task, lane: usize) -> bool {
        let is_high = self.tips()[1][lane] >= task.end_height_cm;
        let is_over = is_high || self.steps[lane] >= task.max_steps;
        is_over || self.numbers[lane].is_none()
    }

    /// One step of every plant.
    #[inline(always)]
    fn step(&mut self, LaneTask { task, is_eq_9 }: LaneTask<'_>) {
        let sides = self.rules.decide(&self.tips(), &self.points(), self.nearest.as_ref());
        let before = self.tips();
        self.stems.step([[Lanes(sides)]]);
        let heights = self.tips()[1];
        let was_highest = self.highest;
        for lane in 0..LANES {
            self.highest[lane] =
                if heights[lane] > was_highest[lane] { heights[lane] } else { was_highest[lane] };
        }
        if is_eq_9 {
            self.count_targets(task, &before);
        } else {
            self.count_obstacles(task, &was_highest);
        }
        let beyond = self.stems.is_beyond_data();
        for lane in 0..LANES {
            self.fitness[lane] -= if beyond.lane(lane) { self.beyond_cost_cm } else { 0.0 };
        }
    }

    /// Eq. (9).
    #[inline(always)]
    fn count_targets(&mut self, task: &Task, [before, _]: &PointRow) {
        let [x, _] = self.tips();
        let (mut target, mut counts) = ([0.0; LANES], [0.0; LANES]);
        for next in task.targets.iter().rev() {
            for lane in 0..LANES {
                let is_below = self.highest[lane] < next.y;
                target[lane] = if is_below { next.x } else { target[lane] };
                counts[lane] = if is_below { 1.0 } else { counts[lane] };
            }
        }
        for lane in 0..LANES {
            let shift = x[lane] - before[lane];
            let beyond = if x[lane] > target[lane] { -shift } else { shift.abs() };
            let worth = if x[lane] < target[lane] { shift } else { beyond };
            self.fitness[lane] += if counts[lane] > 0.0 { worth } else { 0.0 };
        }
    }

    /// What the tip reached, and what the stem touched.
    #[inline(always)]
    fn count_obstacles(&mut self, task: &Task, was_highest: &Row) {
        let was = self.nearest.take();
        if !task.obstacles.is_empty() {
            self.nearest = Some(clearance_of(&task.obstacles, &self.points()));
        }
        let mut worth = [0.0; LANES];
        let [x, y] = self.tips();
        for target in &task.targets {
            let mut is_any_there = false;
            for lane in 0..LANES {
                is_any_there |= (was_highest[lane] < target.y) & (y[lane] >= target.y);
            }
            if is_any_there {
                for lane in 0..LANES {
                    let at = Point::new(x[lane], y[lane]);
                    worth[lane] = task.add_target(worth[lane], *target, was_highest[lane], at);
                }
            }
        }
        if let Some((was, now)) = was.zip(self.nearest.as_ref()) {
            for lane in 0..LANES {
                worth[lane] -= task.cost_of_distances(was.distance_cm[lane], now.distance_cm[lane]);
            }
        }
        for lane in 0..LANES {
            self.fitness[lane] += worth[lane];
        }
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
        let Task { obstacles, end_height_cm, max_steps, .. } = of_lanes.task;
        // New seedlings stand where the last step left other plants.
        if !obstacles.is_empty() {
            batch.nearest = Some(clearance_of(obstacles, &batch.points()));
        }
        loop {
            batch.step(of_lanes);
            let mut is_any_over = false;
            for lane in 0..LANES {
                batch.steps[lane] = batch.steps[lane].wrapping_add(1);
                let is_high = batch.tips()[1][lane] >= *end_height_cm;
                let is_over = is_high | (batch.steps[lane] >= *max_steps);
                is_any_over |= is_over & batch.numbers[lane].is_some();
            }
            if is_any_over {
                return;
            }
        }
    }
}
