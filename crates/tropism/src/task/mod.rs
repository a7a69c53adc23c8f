//! What a plant is to do, and how well it did.
//!
//! Observations go in; a fitness comes out. A [`Task`] is data (where a seedling starts, its targets, what stands in the way,
//! when an experiment is over) and a kind, a [`Score`]: what each step is worth. [`Targets`] is the paper's, eq. (9), which
//! can be read in more than one way ([`Reading`]); [`Obstacles`] has targets behind things that the stem must not touch; [`Shape`] wants a
//! form of the whole stem; [`Space`] has targets with a depth; [`Spiral`] counts the turns of the stem round a pole; the
//! targets of [`RandomTargets`] are still to be drawn; [`OpenLoop`] has nothing to reach and only ends. A score of one's own
//! implements the trait.

mod keys;
mod obstacles;
mod open_loop;
mod outlook;
mod random_targets;
mod shape;
mod space;
mod spiral;
pub(crate) mod targets;

use core::any::Any;
use core::fmt::Debug;

use serde::Serialize;

use crate::check::OutOfRange;
use crate::geometry::Point;
use crate::geometry::space::SpacePoint;
use crate::math::vector::distance;
use crate::observation::Observation;
use crate::obstacle::Solid;
use crate::track::{Sample, Track};

pub use keys::Task;
pub use obstacles::Obstacles;
pub use open_loop::OpenLoop;
pub use outlook::{TargetOutlook, outlook};
pub use random_targets::RandomTargets;
pub use shape::Shape;
pub use space::Space;
pub use spiral::Spiral;
pub use targets::{ARRIVAL_CM, Reading, Targets};

/// The kinds of tasks that files name, each with its defaults. A new kind is its file and a line here.
fn kinds() -> [Task; 7] {
    [
        Task::default(),
        Task::obstacles(),
        Task::shape(),
        Task::space(),
        Task::spiral(),
        Task::random_targets(),
        Task::open_loop(1000),
    ]
}

/// What the steps of a task are worth.
///
/// ```
/// use tropism::prelude::*;
///
/// /// Grow upright: each step costs the distance of the tip from the vertical, in cm.
/// #[derive(Debug)]
/// struct Upright;
///
/// impl Score for Upright {
///     fn step_fitness(&self, _task: &Task, _past: &Past, after: &Observation) -> f64 {
///         -after.tip.x.abs()
///     }
/// }
///
/// let task = Task { end_height_cm: 12.0, max_steps: 500, ..Task::new(Upright) };
/// ```
pub trait Score: Any + Debug + Send + Sync {
    /// What the step after `past` that ends with `after` is worth; larger is better. The fitness of an experiment is the sum
    /// over its steps.
    fn step_fitness(&self, task: &Task, past: &Past, after: &Observation) -> f64;

    /// Whether an experiment is over when the plant is `seen` at `step` (from 0).
    fn is_over(&self, task: &Task, step: u32, seen: &Observation) -> bool {
        seen.tip.y >= task.end_height_cm || step >= task.max_steps
    }

    /// The best fitness there can be of an experiment that begins with `first`, where it is known. No fitness exceeds it.
    fn best(&self, task: &Task, first: &Observation) -> Option<f64> {
        let _ = (task, first);
        None
    }

    /// Whether the plant of a track did all that the task wants; `None` for a task that only has a fitness.
    fn is_done(&self, task: &Task, track: &Track) -> Option<bool> {
        let _ = (task, track);
        None
    }

    /// For each target, where the tip was when it first reached the target's height; `None` if it never did.
    fn crossings(&self, task: &Task, track: &Track) -> Vec<Option<Crossing>> {
        let crossing = |(index, target): (usize, &Point)| {
            let sample = track.samples.iter().find(|sample| sample.tip.y >= target.y)?;
            let distance_cm = match task.depths_cm.get(index) {
                None => sample.tip.distance(*target),
                Some(depth) => distance(tip_in_space(&sample.observation()), [target.x, target.y, *depth]),
            };
            Some(Crossing { step: sample.step, distance_cm })
        };
        task.targets.iter().enumerate().map(crossing).collect()
    }

    /// What an experiment of this fitness is worth to a search that compares [rules](crate::evolve::RuleSearch) by a mean: never
    /// less for a greater fitness. By default the fitness itself.
    fn utility(&self, fitness: f64) -> f64 {
        fitness
    }

    /// What the fitness is measured in.
    fn unit(&self) -> &'static str {
        "cm"
    }

    /// The task in a few words: `the targets (3, 6), (-5, 9), (-1, 13.5)`.
    fn title(&self, task: &Task) -> String {
        let place = |(index, target): (usize, &Point)| match task.depths_cm.get(index) {
            None => format!("({}, {})", target.x, target.y),
            Some(depth) => format!("({}, {}, {depth})", target.x, target.y),
        };
        let places: Vec<String> = task.targets.iter().enumerate().map(place).collect();
        match &places[..] {
            [] => "no targets".to_owned(),
            [place] => format!("the target {place}"),
            _ => format!("the targets {}", places.join(", ")),
        }
    }

    /// The word for it in files.
    fn name(&self) -> &'static str {
        "own"
    }

    /// The keys of a task of this kind.
    fn keys(&self) -> &'static [&'static str] {
        keys::ALL
    }

    /// Checks what no key says alone.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    fn check(&self, task: &Task) -> Result<(), OutOfRange> {
        let _ = task;
        Ok(())
    }
}

/// What an experiment has come to: what the worth of its next step depends on.
#[derive(Clone, Debug)]
pub struct Past {
    /// The first observation.
    pub first: Observation,
    /// The latest observation.
    pub latest: Observation,
    /// The greatest height of the tip so far, in cm.
    pub highest_cm: f64,
}

impl Past {
    /// Of an experiment that begins with `first`.
    #[must_use]
    pub fn new(first: Observation) -> Self {
        Self { highest_cm: first.tip.y, latest: first.clone(), first }
    }

    /// Adds an observation.
    pub fn push(&mut self, seen: Observation) {
        self.highest_cm = self.highest_cm.max(seen.tip.y);
        self.latest = seen;
    }
}

/// Where the tip was when it first reached a target's height.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Crossing {
    /// Step of the observation.
    pub step: u32,
    /// Distance between tip and target, in cm.
    pub distance_cm: f64,
}

/// Distance at its height from which a target counts as missed, in cm. Chosen: about three times the median of the greedy
/// controller on virtual beans (0.4 cm), and the width of a stem with its leaves.
pub const MISS_CM: f64 = 1.0;

impl Crossing {
    /// Whether a target was visited there; one whose height was never reached was not.
    #[must_use]
    pub fn is_visit(crossing: Option<Self>) -> bool {
        crossing.is_some_and(|crossing| crossing.distance_cm <= MISS_CM)
    }
}

/// The tip in space; in the plane of the front camera if its depth is not known.
fn tip_in_space(seen: &Observation) -> SpacePoint {
    seen.tip_in_space().unwrap_or([seen.tip.x, seen.tip.y, 0.0])
}

impl Task {
    /// Whether it is judged by this type of score.
    #[must_use]
    pub fn has_score<S: Score>(&self) -> bool {
        (&*self.kind as &dyn Any).is::<S>()
    }

    /// [`Score::is_over`].
    #[must_use]
    pub fn is_over(&self, step: u32, seen: &Observation) -> bool {
        self.kind.is_over(self, step, seen)
    }

    /// [`Score::step_fitness`].
    #[must_use]
    pub fn step_fitness(&self, past: &Past, after: &Observation) -> f64 {
        self.kind.step_fitness(self, past, after)
    }

    /// Why a track cannot be scored: it has not what the task is about; `None` if it can.
    #[must_use]
    pub fn unscorable(&self, track: &Track) -> Option<&'static str> {
        let none = |has: fn(&Sample) -> bool| !track.samples.iter().any(has);
        if self.is_about_stem() && none(|sample| sample.stem.is_some()) {
            return Some(
                "the task is scored by the stem, and this track has none (columns stem_1_x_cm to stem_10_y_cm)",
            );
        }
        (self.is_in_space() && none(|sample| sample.depth.is_some()))
            .then_some("the task is in space, and this track has no depth (column tip_z_cm)")
    }

    /// A track until the experiment is over: what the plant did later is no part of it.
    #[must_use]
    pub fn experiment(&self, track: &Track) -> Track {
        let first = track.samples.first().map_or(0, |sample| sample.step);
        let is_over = |sample: &Sample| self.is_over(sample.step - first, &sample.observation());
        let end = track.samples.iter().position(is_over).map_or(track.samples.len(), |last| last + 1);
        let Track { layout, period_min, .. } = track;
        Track {
            samples: track.samples[..end].to_vec(),
            layout: layout.clone(),
            period_min: *period_min,
            columns: Vec::new(),
        }
    }

    /// The fitness of a whole track: the sum over its steps, gaps included.
    #[must_use]
    pub fn fitness(&self, track: &Track) -> f64 {
        self.fitness_so_far(track).last().copied().unwrap_or(0.0)
    }

    /// The fitness up to each observation of a track: 0 for the first one, and no more once the experiment is over. A stem that
    /// is not seen is held as it was.
    #[must_use]
    pub fn fitness_so_far(&self, track: &Track) -> Vec<f64> {
        let Some((first, later)) = track.samples.split_first() else { return Vec::new() };
        let (mut past, mut fitness) = (Past::new(first.observation()), 0.0);
        let mut is_over = self.is_over(0, &past.latest);
        let steps = later.iter().map(|sample| {
            let after = sample.observation().holding_stem(&past.latest);
            if !is_over {
                fitness += self.step_fitness(&past, &after);
                is_over = self.is_over(sample.step - first.step, &after);
            }
            past.push(after);
            fitness
        });
        core::iter::once(0.0).chain(steps).collect()
    }

    /// The best fitness there can be of a seedling at the start, where it is known.
    #[must_use]
    pub fn best_fitness(&self) -> Option<f64> {
        self.kind.best(self, &Observation::simulated(self.start))
    }

    /// The best fitness there can be from where `track` begins, where it is known.
    ///
    /// A seedling that stands farther from a target than the start of the task has a longer way to it.
    #[must_use]
    pub fn best_fitness_of(&self, track: &Track) -> Option<f64> {
        self.kind.best(self, &track.samples.first()?.observation())
    }

    /// [`Score::is_done`].
    #[must_use]
    pub fn is_done(&self, track: &Track) -> Option<bool> {
        self.kind.is_done(self, track)
    }

    /// [`Score::crossings`].
    #[must_use]
    pub fn crossings(&self, track: &Track) -> Vec<Option<Crossing>> {
        self.kind.crossings(self, track)
    }

    /// Whether there is anything to reach, so that fitness means something.
    #[must_use]
    pub fn has_goal(&self) -> bool {
        !self.targets.is_empty() || self.has_form() || self.pole.is_some() || self.is_to_draw()
    }

    /// Whether the whole stem counts, so that a track needs it.
    #[must_use]
    pub fn is_about_stem(&self) -> bool {
        !self.obstacles.is_empty() || self.has_form() || self.pole.is_some()
    }

    /// Whether the task takes a plant that is seen in space.
    #[must_use]
    pub fn is_in_space(&self) -> bool {
        !self.depths_cm.is_empty() || self.pole.is_some()
    }

    /// Points towards which controllers steer, as the front camera sees them, in ascending height, in cm: the targets, points on
    /// the way to them, and the line of a form.
    #[must_use]
    pub fn way(&self) -> Vec<Point> {
        let mut way = [self.way_points.clone(), self.targets.clone(), self.upper_line()].concat();
        way.sort_by(|one, other| one.y.total_cmp(&other.y));
        way
    }

    /// The targets of a task in space, in ascending height, in cm; `None` for a task in the plane of the front camera.
    #[must_use]
    pub fn way_in_space(&self) -> Option<Vec<SpacePoint>> {
        let places = self.targets.iter().zip(&self.depths_cm).map(|(target, z)| [target.x, target.y, *z]);
        (!self.depths_cm.is_empty()).then(|| places.collect())
    }

    /// Solids of this task in the virtual tent: its obstacles and its pole.
    #[must_use]
    pub fn solids(&self) -> Vec<Solid> {
        self.obstacles.iter().copied().map(Solid::from).chain(self.pole.map(Solid::from)).collect()
    }

    /// [`Score::title`].
    #[must_use]
    pub fn title(&self) -> String {
        self.kind.title(self)
    }

    /// A fitness with its unit, and the best there can be where it is known: `9.50 cm of at most 11.14`.
    #[must_use]
    pub fn fitness_in_words(&self, fitness: f64) -> String {
        self.fitness_of_most(fitness, self.best_fitness())
    }

    /// A fitness of at most `best` as text, such as `8.71 cm of at most 14.60`.
    #[must_use]
    pub fn fitness_of_most(&self, fitness: f64, best: Option<f64>) -> String {
        let most = best.map_or_else(String::new, |best| format!(" of at most {best:.2}"));
        format!("{fitness:.2} {}{most}", self.kind.unit())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::Polyline;
    use crate::observation::Depth;
    use crate::obstacle::{Obstacle, Pole};

    /// A track of tips, in the dark.
    pub(super) fn track(tips: &[(f64, f64)]) -> Track {
        let samples = tips.iter().enumerate().map(|(step, &(x, y))| {
            let seen = Observation::simulated(Point::new(x, y));
            Sample::of(seen, step as u32, 0.0, None)
        });
        Track::of(samples.collect())
    }

    fn refusal(task: &Task) -> String {
        task.check().unwrap_err().to_string()
    }

    #[test]
    fn every_kind_is_known_by_its_name_and_has_keys_that_there_are() {
        for task in kinds() {
            let (kind, keys) = (task.kind.name(), task.kind.keys());
            assert!(keys.iter().all(|key| keys::ALL.contains(key)), "{kind}: {keys:?}");
            assert_eq!(kinds().iter().filter(|other| other.kind.name() == kind).count(), 1, "{kind}");
            assert!(task.check().is_ok() || kind == "shape", "{kind}: {}", refusal(&task));
        }
    }

    #[test]
    fn values_that_are_not_allowed_are_named() {
        let points = |points: &[[f64; 2]]| points.iter().copied().map(Point::from).collect::<Vec<_>>();
        let swapped = Task { targets: points(&[[1.0, 9.0], [1.0, 6.0]]), ..Task::default() };
        let flat = Obstacle::Disc { centre: Point::new(0.0, 8.0), radius_cm: -1.0 };
        let on_seedling = Obstacle::Disc { centre: Point::new(0.6, 3.0), radius_cm: 1.0 };
        let on_root = Pole { at: [0.5, 0.0], radius_cm: 1.0, height_cm: 40.0 };
        let cases = [
            (swapped, "targets[1] = [1.0, 6.0]"),
            (Task { end_height_cm: 10.0, ..Task::default() }, "end_height_cm = 10"),
            (Task { start: Point::new(0.0, -1.0), ..Task::default() }, "start = [0.0, -1.0]"),
            (Task { turns: 2.0, ..Task::default() }, "this key only beside kind = \"spiral\""),
            (Task { targets: Vec::new(), ..Task::obstacles() }, "targets = []"),
            (Task { obstacles: vec![flat], ..Task::obstacles() }, "obstacles[0].radius_cm = -1"),
            (
                Task { obstacles: vec![on_seedling], ..Task::obstacles() },
                "obstacles[0] = -0.40 cm from the line",
            ),
            (
                Task { way_points: points(&[[1.0, 9.0], [1.0, 8.0]]), ..Task::obstacles() },
                "way_points[1] = [1.0, 8.0]",
            ),
            (Task::shape(), "line = []"),
            (Task { radius_cm: Some(0.0), ..Task::shape() }, "radius_cm = 0"),
            (Task { lean_deg: Some(120.0), ..Task::shape() }, "lean_deg = 120"),
            (Task { line: points(&[[0.0, 0.0]]), ..Task::shape() }, "one point"),
            (Task { within_cm: 0.0, ..Task::shape() }, "within_cm = 0"),
            (Task { depths_cm: vec![1.0], ..Task::space() }, "depths_cm = [1.0]"),
            (Task { depths_cm: vec![1.0, f64::NAN, 0.0], ..Task::space() }, "depths_cm = [1.0, NaN, 0.0]"),
            (Task { pole: Some(on_root), ..Task::spiral() }, "pole.at"),
            (Task { count: 0, ..Task::random_targets() }, "count = 0"),
            (Task { highest_cm: 3.0, ..Task::random_targets() }, "highest_cm = 3"),
            (Task { end_height_cm: 9.0, ..Task::random_targets() }, "end_height_cm = 9"),
            (Task { max_steps: 0, ..Task::open_loop(1) }, "max_steps = 0"),
        ];
        for (task, words) in cases {
            assert!(refusal(&task).contains(words), "{words}: {}", refusal(&task));
        }
    }

    /// One observation: the tip, the depth of the tip, and how far the middle of the stem bows in x and z, in cm.
    fn seen() -> impl Strategy<Value = Observation> {
        let numbers = (-10.0..10.0, 0.5..40.0, -10.0..10.0, -5.0..5.0, -5.0..5.0);
        numbers.prop_map(|(x, y, z, bow_x, bow_z)| {
            let middle = Point::new(x / 2.0 + bow_x, y / 2.0);
            let stem = Polyline(vec![Point::default(), middle, Point::new(x, y)]);
            let depth = Depth { tip_cm: z, stem_cm: vec![0.0, z / 2.0 + bow_z, z] };
            Observation { stem: Some(stem), depth: Some(depth), ..Observation::simulated(Point::new(x, y)) }
        })
    }

    proptest! {
        #[test]
        fn no_track_beats_the_best(all in prop::collection::vec(seen(), 2..60), is_stem_seen: bool) {
            let samples = all.into_iter().enumerate().map(|(step, seen)| {
                let stem = seen.stem.clone().filter(|_| is_stem_seen);
                Sample::of(Observation { stem, ..seen }, step as u32, 0.0, None)
            });
            let track = Track::of(samples.collect());
            let apex = Some(Point::new(2.0, 5.0));
            let kinds = kinds().into_iter().chain([Task { apex, lean_deg: Some(20.0), ..Task::shape() }]);
            // Few of these tracks stay below the height at which the experiment ends.
            for task in kinds.flat_map(|task| [Task { end_height_cm: 50.0, ..task.clone() }, task]) {
                prop_assert_eq!(task.fitness(&track), task.fitness(&task.experiment(&track)));
                if let Some(best) = task.best_fitness_of(&track) {
                    let fitness = task.fitness(&track);
                    prop_assert!(fitness <= best + 1e-9, "{}: {fitness} of at most {best}", task.title());
                }
            }
        }
    }
}
