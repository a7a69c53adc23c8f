//! How far to the side virtual beans of a species get: which places of a task are out of reach is known before plants grow.
//!
//! In: a task and a species. Out: for each place that no such plant gets to, why. The idea: plants that lean to one side, early
//! or late, mark out the reach of all; what a low plant reaches to one side, a higher one reaches too, and both sides are alike.

use core::ops::ControlFlow;
use std::collections::BTreeMap;
use std::sync::OnceLock;

use serde::Serialize;
use tropism::control::Controller;
use tropism::geometry::Point;
use tropism::lamps::Light;
use tropism::math::atan2;
use tropism::observation::Observation;
use tropism::task::Task;
use tropism::track::Sample;

use super::{Species, Trial};

/// Plants that lean to the side after each delay. Chosen by hand.
const BEANS: u64 = 4;

/// Steps of an experiment: two days. Chosen by hand.
const STEPS: u32 = 600;

/// Steps between two delays, three hours, and steps that a plant has to lean at least. Chosen by hand.
const DELAY: u32 = 36;
const LEANING: u32 = 60;

/// Height from which on a plant has a form to speak of, in cm. Chosen: twice that of a seedling.
const GROWN_CM: f64 = 8.0;

/// The highest tip whose stem is looked at, in cm. Chosen by hand: higher ones hang.
const HIGHEST_CM: f64 = 17.0;

/// A controller that keeps the plant upright and then leans it to the right for good.
struct Lean {
    upright: u32,
    step: u32,
}

impl Controller for Lean {
    fn decide(&mut self, seen: &Observation) -> Light {
        self.step += 1;
        if self.step > self.upright || seen.tip.x < 0.0 { Light::RIGHT } else { Light::LEFT }
    }
}

/// Farthest distances by height, in half centimetres.
#[derive(Default)]
struct Farthest(BTreeMap<i32, f64>);

impl Farthest {
    fn add(&mut self, point: &Point) {
        let at = self.0.entry((2.0 * point.y).floor() as i32).or_insert(0.0);
        *at = at.max(point.x);
    }

    /// What a low plant reaches, a high one reaches too: between the delays that were tried there are others.
    fn rows(self) -> Vec<[f64; 2]> {
        let mut so_far = 0.0_f64;
        let row = |(half, x): (i32, f64)| {
            so_far = so_far.max(x);
            [f64::from(half) / 2.0, (10.0 * so_far).round() / 10.0]
        };
        self.0.into_iter().map(row).collect()
    }
}

/// How far plants of one kind get, by height. Places are pairs of height and distance from the root to either side, in cm, in
/// ascending height and distance.
///
/// ```
/// use tropism_bean::Reach;
/// use tropism::prelude::*;
/// let reach = Reach { tips: vec![[4.0, 1.0], [12.0, 5.0]], ..Reach::default() };
/// assert_eq!(reach.misses_tip(Point::new(-4.5, 12.0)), None);
/// assert_eq!(reach.misses_tip(Point::new(-3.0, 8.0)).unwrap(), "2.0 cm out of reach on the left");
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Reach {
    /// The farthest place at which a tip arrives at a height for the first time.
    pub tips: Vec<[f64; 2]>,
    /// The farthest place at which a stem is whose tip has just become higher than ever.
    pub stems: Vec<[f64; 2]>,
    /// The steepest lean to the vertical of the upper third of such a stem, in degrees.
    pub lean_deg: f64,
}

impl Reach {
    /// What the paper's plants reached (section 2.3.1, Fig. 8): the line from the start of their tips to each target in turn,
    /// every half centimetre of height.
    fn of_wahby2016() -> Self {
        let Task { start: mut below, targets, .. } = Task::default();
        let mut tips = vec![[below.y, below.x.abs()]];
        for target in targets {
            let above = Point::new(target.x.abs().max(below.x), target.y);
            let parts = (2.0 * (above.y - below.y)).floor();
            let part = |half: u32| {
                let place = below.lerp(above, 0.5 * f64::from(half) / (above.y - below.y));
                [place.y, place.x]
            };
            tips.extend((1..=parts as u32).map(part));
            below = above;
        }
        Self { tips, ..Self::default() }
    }

    /// Why no tip gets to `target`; `None` within reach, and where nothing is known.
    #[must_use]
    pub fn misses_tip(&self, target: Point) -> Option<String> {
        misses(&self.tips, target)
    }

    /// Each target of `task` that is out of reach, and the farthest such point of a form, with the reason.
    #[must_use]
    pub fn out_of_reach(&self, task: &Task) -> Vec<String> {
        let of_tip = |target: &Point| {
            let why = self.misses_tip(*target)?;
            Some(format!("the target ({}, {}): {why}", target.x, target.y))
        };
        let missed = task.line.iter().filter_map(|point| Some((point, misses(&self.stems, *point)?)));
        let farthest = missed.max_by(|(one, _), (other, _)| one.x.abs().total_cmp(&other.x.abs()));
        let of_form = farthest.map(|(at, why)| format!("the point ({}, {}) of the form: {why}", at.x, at.y));
        task.targets.iter().filter_map(of_tip).chain(of_form).collect()
    }
}

/// Why `place` is not reached by what got as far as `rows`.
fn misses(rows: &[[f64; 2]], place: Point) -> Option<String> {
    let [top, _] = rows.last()?;
    if place.y > *top {
        return Some(format!("higher than these plants grow, {top:.1} cm"));
    }
    let farthest = rows.iter().rev().find(|[height, _]| *height <= place.y).map_or(0.0, |[_, side]| *side);
    let over = place.x.abs() - farthest;
    let side = if place.x < 0.0 { "left" } else { "right" };
    (over > 0.0).then(|| format!("{over:.1} cm out of reach on the {side}"))
}

impl Species {
    /// What of `task` plants of this species do not get to, as [`Reach::out_of_reach`]. Plants grow only to judge places where the
    /// paper's plants were not.
    #[must_use]
    pub fn out_of_reach(&self, task: &Task) -> Vec<String> {
        if task.line.is_empty() && Reach::of_wahby2016().out_of_reach(task).is_empty() {
            Vec::new()
        } else if *self == Self::default() {
            Self::common_reach().out_of_reach(task)
        } else {
            self.reach().out_of_reach(task)
        }
    }

    /// [`Self::reach`] of the common bean, which is computed once.
    #[must_use]
    pub fn common_reach() -> &'static Reach {
        static COMMON: OnceLock<Reach> = OnceLock::new();
        COMMON.get_or_init(|| Self::default().reach())
    }

    /// What four virtual beans of this species reach between the paper's lamps: each leans to the side early or late, 15 times.
    /// Distances are rounded to mm.
    #[must_use]
    pub fn reach(&self) -> Reach {
        let delays: Vec<u32> = (0..STEPS - LEANING).step_by(DELAY as usize).collect();
        let plants: Vec<(u64, u32)> =
            delays.iter().flat_map(|&delay| (1..=BEANS).map(move |seed| (seed, delay))).collect();
        let seeds: Vec<u64> = plants.iter().map(|(seed, _)| *seed).collect();
        let task = Task::open_loop(STEPS);
        let (mut tips, mut stems) = (Farthest::default(), Farthest::default());
        let mut highest = vec![f64::NEG_INFINITY; seeds.len()];
        let mut lean_deg = 0.0_f64;
        let mut watch = |place: usize, sample: &Sample| {
            if sample.tip.y <= highest[place] {
                return ControlFlow::Continue(());
            }
            highest[place] = sample.tip.y;
            tips.add(&sample.tip);
            if let Some(stem) = sample.stem.as_ref().filter(|_| sample.tip.y <= HIGHEST_CM) {
                stem.0.iter().filter(|point| point.y >= 0.0).for_each(|point| stems.add(point));
                if sample.tip.y >= GROWN_CM {
                    lean_deg = lean_deg.max(lean_of(&stem.0));
                }
            }
            ControlFlow::Continue(())
        };
        let lean = |place: usize| Lean { upright: plants[place].1, step: 0 };
        Trial::new(self).grow_all(&seeds, lean, &task, &mut watch);
        Reach { tips: tips.rows(), stems: stems.rows(), lean_deg: lean_deg.round() }
    }
}

/// The angle of the upper third of a stem to the vertical, in degrees; 0 of no stem.
fn lean_of(stem: &[Point]) -> f64 {
    let Some((tip, rest)) = stem.split_last() else { return 0.0 };
    let from = rest[2 * rest.len() / 3..].first().copied().unwrap_or_default();
    atan2((tip.x - from.x).abs(), tip.y - from.y).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reach() -> Reach {
        Reach {
            tips: vec![[4.0, 1.0], [8.0, 3.0], [12.0, 5.0]],
            stems: vec![[0.0, 0.5], [8.0, 3.0]],
            lean_deg: 60.0,
        }
    }

    #[test]
    fn what_is_out_of_reach_has_its_reason() {
        let targets = [[2.5, 6.0], [-3.0, 9.0], [0.0, 20.0]].map(Point::from).to_vec();
        let task = Task { targets, ..Task::default() };
        assert_eq!(
            reach().out_of_reach(&task),
            [
                "the target (2.5, 6): 1.5 cm out of reach on the right",
                "the target (0, 20): higher than these plants grow, 12.0 cm"
            ]
        );
        let line = [[0.0, 0.0], [-2.0, 4.0], [0.0, 7.0]].map(Point::from).to_vec();
        let task = Task { line, ..Task::shape() };
        assert_eq!(
            reach().out_of_reach(&task),
            ["the point (-2, 4) of the form: 1.5 cm out of reach on the left"]
        );
        assert!(Reach::default().out_of_reach(&task).is_empty(), "nothing is known of these plants");
    }

    #[test]
    fn virtual_beans_get_to_where_real_plants_were() {
        let reached = Reach::of_wahby2016().tips;
        let corners = [[4.0, 0.0], [6.0, 3.0], [9.0, 5.0], [13.5, 5.0]];
        assert!(corners.iter().all(|corner| reached.contains(corner)), "{reached:?}");
        for [height, side] in reached {
            for x in [-side, side] {
                assert_eq!(
                    Species::common_reach().misses_tip(Point::new(x, height)),
                    None,
                    "({x}, {height})"
                );
            }
        }
        let far = Task { targets: vec![Point::new(-9.0, 5.0), Point::new(1.0, 9.0)], ..Task::default() };
        let found = Species::default().out_of_reach(&far);
        assert!(found.len() == 1 && found[0].starts_with("the target (-9, 5)"), "{found:?}");
    }
}
