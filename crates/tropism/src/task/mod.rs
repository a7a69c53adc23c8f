//! What a plant is to do, and how well it did.
//!
//! Observations go in; a fitness comes out. A [`Task`] says where a seedling starts, when an experiment is over, and what
//! each step is worth. [`Targets`] is the paper's task with eq. (9); [`Obstacles`] has targets behind things that the stem
//! must not touch; [`Shape`] wants a form of the whole stem; [`Space`] has targets in three coordinates; [`Spiral`] counts the
//! turns of the stem round a pole; [`RandomTargets`] are still to be drawn; [`OpenLoop`] has nothing to reach and only ends. A task of one's own implements the trait;
//! it sees whole observations, stems included.

mod reach;
mod obstacles;
mod open_loop;
mod shape;
mod space;
mod spiral;
mod random_targets;
mod spec;
mod targets;

use crate::geometry::Point;
use crate::geometry::space::SpacePoint;
use crate::observation::Observation;
use crate::obstacle::{Obstacle, Pole, Solid};
use crate::track::Track;

pub use obstacles::Obstacles;
pub use open_loop::OpenLoop;
pub use random_targets::RandomTargets;
pub use reach::Reach;
pub use shape::Shape;
pub use space::Space;
pub use spec::TaskSpec;
pub use spiral::Spiral;
pub use targets::{Crossing, Targets};

/// A task for a plant.
///
/// ```
/// use tropism::prelude::*;
///
/// /// Grow upright: each step costs the distance of the tip from the vertical, in cm.
/// struct Upright;
///
/// impl Task for Upright {
///     fn is_over(&self, step: u32, seen: &Observation) -> bool {
///         step >= 500 || seen.tip.y >= 12.0
///     }
///     fn step_fitness(&self, _first: &Observation, _before: &Observation, after: &Observation) -> f64 {
///         -after.tip.x.abs()
///     }
/// }
/// ```
pub trait Task: Sync {
    /// Whether an experiment is over when the plant is `seen` at `step` (from 0).
    fn is_over(&self, step: u32, seen: &Observation) -> bool;

    /// What the step from `before` to `after` is worth; larger is better. `first` is the first observation of the
    /// experiment. The fitness of an experiment is the sum over its steps.
    fn step_fitness(&self, first: &Observation, before: &Observation, after: &Observation) -> f64;

    /// Tip of the seedling at the start of a simulated experiment, in cm. Paper: (0, 4), section 2.3.
    fn start(&self) -> Point {
        Point::new(0.0, 4.0)
    }

    /// Points that the tip is to visit, in order, as the front camera sees them.
    fn targets(&self) -> Vec<Point> {
        Vec::new()
    }

    /// Whether there is anything to reach, so that fitness means something.
    fn has_goal(&self) -> bool {
        !self.targets().is_empty()
    }

    /// Points towards which controllers steer, in ascending height, in cm: the targets, and what points a task has on the way.
    fn way(&self) -> Vec<Point> {
        self.targets()
    }

    /// The way of a task in space, in ascending height, in cm; `None` for a task in the plane of the front camera.
    fn way_in_space(&self) -> Option<Vec<SpacePoint>> {
        None
    }

    /// Whether the whole stem counts, so that a track needs it.
    fn is_about_stem(&self) -> bool {
        !self.obstacles().is_empty() || self.pole().is_some()
    }

    /// The task as the front camera sees it, for a task with targets in space.
    fn in_front(&self) -> Option<Targets> {
        None
    }

    /// Whether the task takes a plant that is seen in space.
    fn is_in_space(&self) -> bool {
        self.way_in_space().is_some() || self.pole().is_some()
    }

    /// What the stem must not touch.
    fn obstacles(&self) -> &[Obstacle] {
        &[]
    }

    /// Line on which the stem is to lie, from the root upwards, in cm; empty for a task without one.
    fn shape(&self) -> &[Point] {
        &[]
    }

    /// The pole round which the stem is to wind.
    fn pole(&self) -> Option<Pole> {
        None
    }

    /// Solids of this task in the virtual tent: its obstacles, and what it wants beside them.
    fn solids(&self) -> Vec<Solid> {
        self.obstacles().iter().copied().map(Solid::from).chain(self.pole().map(Solid::from)).collect()
    }

    /// For each target, where the tip was when it first reached the target's height; `None` if it never did.
    fn crossings(&self, track: &Track) -> Vec<Option<Crossing>> {
        let crossing = |target: &Point| {
            let sample = track.samples.iter().find(|sample| sample.tip.y >= target.y)?;
            Some(Crossing { step: sample.step, distance_cm: sample.tip.distance(*target) })
        };
        self.targets().iter().map(crossing).collect()
    }

    /// Whether the plant of a track did all that the task wants; `None` for a task that only has a fitness.
    fn is_done(&self, track: &Track) -> Option<bool> {
        let _ = track;
        None
    }

    /// What an experiment of this fitness is worth to a search that compares [rules](crate::evolve::RuleSearch) by a mean: never
    /// less for a greater fitness. By default the fitness itself.
    fn utility(&self, fitness: f64) -> f64 {
        fitness
    }

    /// Each target that plants of `reach` do not get to, or the farthest such point of a form, with the reason.
    fn out_of_reach(&self, reach: &Reach) -> Vec<String> {
        let over = |point: &&Point| point.x.abs();
        let missed = self.shape().iter().filter(|point| reach.misses_stem(**point).is_some());
        let farthest = missed.max_by(|one, other| over(one).total_cmp(&over(other)));
        let of_form = farthest.and_then(|point| {
            let why = reach.misses_stem(*point)?;
            Some(format!("the point ({}, {}) of the form: {why}", point.x, point.y))
        });
        let of_tip = |target: Point| {
            let why = reach.misses_tip(target)?;
            Some(format!("the target ({}, {}): {why}", target.x, target.y))
        };
        self.targets().into_iter().filter_map(of_tip).chain(of_form).collect()
    }

    /// The best fitness there can be, where it is known.
    fn best_fitness(&self) -> Option<f64> {
        None
    }

    /// This task as the paper's, if it is one: vectorised simulation exists for few tasks.
    fn as_targets(&self) -> Option<&Targets> {
        None
    }

    /// This task as one of targets behind obstacles, if it is one: as [`as_targets`](Self::as_targets).
    fn as_obstacles(&self) -> Option<&Obstacles> {
        None
    }

    /// The fitness of a whole track: the sum over its steps, gaps included.
    fn fitness(&self, track: &Track) -> f64 {
        let mut seen = track.samples.iter().map(crate::track::Sample::observation);
        let Some(first) = seen.next() else { return 0.0 };
        let mut before = first.clone();
        let mut fitness = 0.0;
        for after in seen {
            fitness += self.step_fitness(&first, &before, &after);
            before = after;
        }
        fitness
    }
}
