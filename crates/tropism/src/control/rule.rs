//! The greedy rule with foresight: nine parameters say where it aims and what it expects of the plant.

use serde::{Deserialize, Serialize};

use super::Controller;
use super::greedy::{AHEAD_RAD, BESIDE_POLE_CM, round};
use super::steering::Steering;
use crate::check::{OutOfRange, ensure};
use crate::geometry::space::SpacePoint;
use crate::geometry::{Point, STEM_POINTS};
use crate::lamps::{Layout, Light};
use crate::math::Real;
use crate::observation::Observation;
use crate::obstacle::{Clearance, Obstacle, Pole, clearance};
use crate::task::Task;

/// Weight of the last shift in its running mean. This and the next constant stood in the first version of the rule; other
/// values were not tried.
const VELOCITY_WEIGHT: f64 = 0.25;

/// Weight of the last light in its running mean.
const LIGHT_WEIGHT: f64 = 0.15;

/// The numbers of a [`PredictiveGreedy`] controller, for steps of one length. All of them may have any sign; their defaults
/// make it [`Greedy`](super::Greedy).
///
/// The right lamp is lit if the aim lies to the right of where the tip is expected. With the next target at (X, Y), the one
/// after at X', the tip at (x, y), its last shift d, the running mean v of its shifts, the running mean b of the light and
/// the last light u (left -1, right 1), the aim is `X (1 + overshoot) + approach (X' - X) + offset`, where `approach` is
/// `next_target` on the target's height and falls to 0 at `look_ahead_cm` below it; the tip is expected at
/// `x (1 + lean) + velocity_steps v + shift_steps d + light_memory_cm b - persistence_cm u`.
///
/// Round a [pole](Task::pole) it aims from where the tip is expected, along x and z, at the point ahead on a circle about the
/// pole. Then `overshoot` is by how many rad that point is farther ahead than the greedy rule's, and `offset_cm` by how much the
/// circle is wider.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PredictiveRule<R = f64> {
    /// Height below a target from which the target after it is looked at, in cm, above 0.
    pub look_ahead_cm: R,
    /// Aim beyond the target, as a share of the target's x.
    pub overshoot: R,
    /// Aim towards the target after, as a share of the way there, on the next target's height.
    pub next_target: R,
    /// Aim to the right of it all, in cm: a bias. At 0 the rule is the same in a mirror.
    pub offset_cm: R,
    /// How many steps the mean shift of the tip goes on.
    pub velocity_steps: R,
    /// How many steps the last shift of the tip goes on.
    pub shift_steps: R,
    /// Shift yet to come if the same lamp was lit for long, in cm.
    pub light_memory_cm: R,
    /// Shift yet to come for each cm that the tip is aside.
    pub lean: R,
    /// How far the expected tip must pass the aim before the other lamp is lit, in cm.
    pub persistence_cm: R,
    /// How it keeps the stem away from obstacles, in a task that has some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub avoidance: Option<Avoidance<R>>,
}

/// Six more numbers of a [`PredictiveRule`]: they move its aim where the stem comes near an obstacle. At 0 they change
/// nothing.
///
/// With c the [clearance](crate::obstacle::clearance) of the seen stem and w its running mean change a step, the aim moves away
/// from the obstacle by `push (clearance_cm - c - clearance_steps w)` if that is above 0. The tip is expected
/// `bend (a - b)` further right, with a the x of the tenth and b that of the seventh of ten points of the stem.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Avoidance<R = f64> {
    /// Shift of the way points of the task to the right, in cm.
    pub way_x_cm: R,
    /// Shift of the way points of the task upwards, in cm.
    pub way_y_cm: R,
    /// Clearance that is kept without moving the aim, in cm.
    pub clearance_cm: R,
    /// By how much the aim moves for each cm that the clearance is less, in cm.
    pub push: R,
    /// How many steps the mean change of the clearance goes on.
    pub clearance_steps: R,
    /// Shift yet to come for each cm by which the upper third of the stem leans.
    pub bend: R,
}

/// What lists the numbers of a rule, in the order of its fields.
macro_rules! numbers {
    ($rule:ident, $count:literal: $($field:ident)+ $(; $other:ident: $absent:expr)?) => {
        impl $rule {
            /// The numbers by name, in the order of the fields.
            #[must_use]
            pub const fn named(&self) -> [(&'static str, f64); $count] {
                [$((stringify!($field), self.$field)),+]
            }
        }

        impl<R: Copy> $rule<R> {
            /// All numbers are `number`.
            fn of(number: R) -> Self {
                Self { $($field: number,)+ $($other: $absent)? }
            }

            fn numbers_mut(&mut self) -> [&mut R; $count] {
                [$(&mut self.$field),+]
            }
        }
    };
}

numbers!(PredictiveRule, 9: look_ahead_cm overshoot next_target offset_cm velocity_steps shift_steps light_memory_cm lean
    persistence_cm; avoidance: None);
numbers!(Avoidance, 6: way_x_cm way_y_cm clearance_cm push clearance_steps bend);

impl Default for PredictiveRule {
    /// The greedy rule. The look-ahead has no effect then.
    fn default() -> Self {
        Self { look_ahead_cm: 1.0, ..Self::of(0.0) }
    }
}

impl PredictiveRule {
    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        for (key, value) in self.named() {
            ensure(value.is_finite(), key, value, "a finite number")?;
        }
        for (key, value) in self.avoidance.iter().flat_map(Avoidance::named) {
            ensure(value.is_finite(), format!("avoidance.{key}"), value, "a finite number")?;
        }
        ensure(self.look_ahead_cm > 0.0, "look_ahead_cm", self.look_ahead_cm, "cm above 0")
    }
}

/// Steers towards the next target as [`Greedy`](super::Greedy) does, but by where the tip is expected, and with an aim that
/// takes the target after into account.
///
/// ```
/// use tropism::control::{PredictiveGreedy, PredictiveRule};
/// use tropism::prelude::*;
/// let rule = PredictiveRule { shift_steps: 10.0, ..PredictiveRule::default() };
/// let mut controller = PredictiveGreedy::new(rule, &Task::default(), &Layout::default());
/// let mut decide = |x, y| controller.decide(&Observation::simulated(Point::new(x, y)));
/// assert_eq!(decide(2.0, 5.0), Light::RIGHT); // the target is at x = 3
/// assert_eq!(decide(2.2, 5.1), Light::LEFT); // ten more such shifts would pass it
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PredictiveGreedy {
    rules: Rules<f64>,
    obstacles: Vec<Obstacle>,
    pole: Option<Pole>,
    steering: Steering,
}

impl PredictiveGreedy {
    /// Steers along the way of `task`: with the outermost lamps of `layout`, or for a task in space and round a pole with all of
    /// them and the same rule along x and z.
    #[must_use]
    pub fn new(rule: PredictiveRule, task: &Task, layout: &Layout) -> Self {
        let is_in_plane = task.way_in_space().is_none() && task.pole.is_none();
        let steering = if is_in_plane { Steering::in_plane(layout) } else { Steering::in_space(layout) };
        let mut rules = Rules::new(task, rule.avoidance.is_some());
        rules.refill(0, &rule, task);
        Self { rules, obstacles: task.obstacles.clone(), pole: task.pole, steering }
    }

    /// Clearance of the seen stem, and by how much its upper third leans.
    fn stem(&self, seen: &Observation) -> (Option<Clearance>, f64) {
        let Some(stem) = seen.stem.as_ref().filter(|_| self.rules.rule.avoidance.is_some()) else {
            return (None, 0.0);
        };
        let ten = if stem.0.len() == STEM_POINTS { stem } else { &stem.resampled(STEM_POINTS) };
        let lean = if ten.0.len() == STEM_POINTS { ten.0[END].x - ten.0[LOWER].x } else { 0.0 };
        (clearance(&self.obstacles, stem), lean)
    }
}

impl Controller for PredictiveGreedy {
    fn decide(&mut self, seen: &Observation) -> Light {
        let depth_cm = seen.depth.as_ref().map(|depth| depth.tip_cm);
        let way = if let Some(pole) = self.pole {
            self.rules.round(pole, [seen.tip.x, depth_cm.unwrap_or(0.0)])
        } else {
            let (nearest, lean) = self.stem(seen);
            let aim = self.rules.aim(seen.tip.y);
            let x = self.rules.way_x(aim, seen.tip.x, nearest.as_ref(), lean);
            [x, depth_cm.map_or(0.0, |z| self.rules.way_z(aim, z))]
        };
        let light = self.steering.towards(way);
        self.rules.lit(self.steering.sides(light));
        light
    }
}

/// The lower of the two points between which the upper third of ten points of a stem lies, and the upper one.
pub(crate) const LOWER: usize = 6;
pub(crate) const END: usize = STEM_POINTS - 1;

/// The rules of as many plants as a number has lanes, and what they remember.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Rules<R> {
    rule: PredictiveRule<R>,
    /// From the lowest point on; round a pole there is none.
    way: Vec<[R; 3]>,
    /// Along x and z; in the plane the second is not used.
    axes: [Axis<R>; 2],
    /// In cm; not a number at first.
    last_clearance: R,
    /// Running mean of the changes of the clearance, in cm a step.
    clearance_change: R,
}

/// What is remembered of the tip and of the light along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axis<R> {
    /// Where the tip was, in cm; not a number at first.
    last: R,
    /// Running mean of the shifts, in cm a step.
    velocity: R,
    /// Running mean of the light: -1 to the negative side, 1 to the positive side.
    light: R,
    /// The side of the last light; 0 at first, and where that light was of the other axis.
    last_side: R,
}

impl<R: Real> Axis<R> {
    fn at_rest() -> Self {
        let nothing = R::splat(0.0);
        Self { last: R::splat(f64::NAN), velocity: nothing, light: nothing, last_side: nothing }
    }

    fn refill(&mut self, lane: usize) {
        self.last.set_lane(lane, f64::NAN);
        for memory in [&mut self.velocity, &mut self.light, &mut self.last_side] {
            memory.set_lane(lane, 0.0);
        }
    }

    /// Where a tip at `at` is expected, in cm.
    #[inline(always)]
    fn expected(&mut self, rule: &PredictiveRule<R>, at: R) -> R {
        let shift = R::select(self.last.eq(self.last), at - self.last, R::splat(0.0));
        self.velocity += (shift - self.velocity) * VELOCITY_WEIGHT;
        self.last = at;
        at * (rule.lean + 1.0)
            + rule.velocity_steps * self.velocity
            + rule.shift_steps * shift
            + rule.light_memory_cm * self.light
            - rule.persistence_cm * self.last_side
    }
}

impl<R: Real> Rules<R> {
    /// Room for rules on the way of `task`, which may keep away from its obstacles.
    pub(crate) fn new(task: &Task, avoids: bool) -> Self {
        let nothing = R::splat(0.0);
        let avoidance = avoids.then(|| Avoidance::of(nothing));
        let rule = PredictiveRule { look_ahead_cm: R::splat(1.0), avoidance, ..PredictiveRule::of(nothing) };
        Self {
            rule,
            way: vec![[nothing; 3]; way_of(task, None).len()],
            axes: [Axis::at_rest(); 2],
            last_clearance: R::splat(f64::NAN),
            clearance_change: nothing,
        }
    }

    /// Puts a rule at rest into a lane; `false` if only one of them keeps away from obstacles.
    pub(crate) fn refill(&mut self, lane: usize, rule: &PredictiveRule, task: &Task) -> bool {
        if rule.avoidance.is_some() != self.rule.avoidance.is_some() {
            return false;
        }
        let avoidance = self.rule.avoidance.iter_mut().flat_map(Avoidance::numbers_mut);
        for (number, (_, value)) in avoidance.zip(rule.avoidance.iter().flat_map(Avoidance::named)) {
            number.set_lane(lane, value);
        }
        for (number, (_, value)) in self.rule.numbers_mut().into_iter().zip(rule.named()) {
            number.set_lane(lane, value);
        }
        for (place, axes) in self.way.iter_mut().zip(way_of(task, rule.avoidance)) {
            place.iter_mut().zip(axes).for_each(|(axis, value)| axis.set_lane(lane, value));
        }
        self.axes.iter_mut().for_each(|axis| axis.refill(lane));
        self.last_clearance.set_lane(lane, f64::NAN);
        self.clearance_change.set_lane(lane, 0.0);
        true
    }

    /// x and z at which the tips should be at a height of `y`, in cm; `None` without a way.
    #[inline(always)]
    pub(crate) fn aim(&self, y: R) -> Option<[R; 2]> {
        let (rule, last) = (&self.rule, self.way.len().checked_sub(1)?);
        let (mut target, mut after) = (self.way[last], self.way[last]);
        for place in (0..last).rev() {
            let is_below = y.lt(self.way[place][1]);
            for axis in 0..3 {
                target[axis] = R::select(is_below, self.way[place][axis], target[axis]);
                after[axis] = R::select(is_below, self.way[place + 1][axis], after[axis]);
            }
        }
        let nearness = -((target[1] - y) / rule.look_ahead_cm) + 1.0;
        let approach = rule.next_target * nearness.clamp(R::splat(0.0), R::splat(1.0));
        let [x, z] = [0, 2]
            .map(|axis| target[axis] * (rule.overshoot + 1.0) + approach * (after[axis] - target[axis]));
        Some([x + rule.offset_cm, z])
    }

    /// From where the tips, which are at `x`, are expected to where they should be, in cm. `nearest` is where the stems are nearest
    /// to obstacles, and `lean` by how much their upper thirds lean to the right.
    #[inline(always)]
    pub(crate) fn way_x(&mut self, aim: Option<[R; 2]>, x: R, nearest: Option<&Clearance<R>>, lean: R) -> R {
        let (mut push, mut bend) = (R::splat(0.0), R::splat(0.0));
        if let Some(avoidance) = self.rule.avoidance {
            bend = avoidance.bend * lean;
            push = nearest.map_or(push, |nearest| self.push(&avoidance, nearest));
        }
        let expected = self.axes[0].expected(&self.rule, x);
        aim.map_or(R::splat(0.0), |[aim, _]| (aim + push) - (expected + bend))
    }

    /// By how much the aims move away from obstacles, in cm.
    #[inline(always)]
    fn push(&mut self, avoidance: &Avoidance<R>, nearest: &Clearance<R>) -> R {
        let (last, distance) = (self.last_clearance, nearest.distance_cm);
        let change = R::select(last.eq(last), distance - last, R::splat(0.0));
        self.last_clearance = distance;
        self.clearance_change += (change - self.clearance_change) * VELOCITY_WEIGHT;
        let expected = distance + avoidance.clearance_steps * self.clearance_change;
        let is_left = nearest.stem[0].lt(nearest.obstacle[0]);
        let away = R::select(is_left, R::splat(-1.0), R::splat(1.0));
        away * avoidance.push * (avoidance.clearance_cm - expected).max(R::splat(0.0))
    }

    /// Remembers on which sides the lit lamps are: -1, 0 or 1 along each axis.
    #[inline(always)]
    pub(crate) fn lit(&mut self, sides: [R; 2]) {
        for (axis, side) in self.axes.iter_mut().zip(sides) {
            axis.last_side = side;
            axis.light += (side - axis.light) * LIGHT_WEIGHT;
        }
    }
}

impl Rules<f64> {
    /// From where the tip is expected to where it should be along z, in cm.
    fn way_z(&mut self, aim: Option<[f64; 2]>, z: f64) -> f64 {
        let expected = self.axes[1].expected(&self.rule, z);
        aim.map_or(0.0, |[_, aim]| aim - expected)
    }

    /// From where the tip, which is at (x, z), is expected to the point ahead of it on the circle about `pole`, in cm.
    fn round(&mut self, pole: Pole, at: [f64; 2]) -> [f64; 2] {
        let rule = self.rule;
        let [x, z] = &mut self.axes;
        let expected = [x.expected(&rule, at[0]), z.expected(&rule, at[1])];
        round(pole, expected, AHEAD_RAD + rule.overshoot, BESIDE_POLE_CM + rule.offset_cm)
    }
}

/// The way of a task, with its way points shifted; round a pole there is none.
fn way_of(task: &Task, avoidance: Option<Avoidance>) -> Vec<SpacePoint> {
    if task.pole.is_some() {
        return Vec::new();
    }
    let shift = |point: Point| match avoidance {
        Some(avoidance) if !task.targets.contains(&point) => {
            [point.x + avoidance.way_x_cm, point.y + avoidance.way_y_cm, 0.0]
        }
        _ => [point.x, point.y, 0.0],
    };
    task.way_in_space().unwrap_or_else(|| task.way().into_iter().map(shift).collect())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::control::Greedy;
    use crate::geometry::Polyline;
    use crate::math;
    use crate::observation::Depth;

    fn mirrored(task: &Task) -> Task {
        Task { targets: task.targets.iter().map(|target| target.mirrored()).collect(), ..task.clone() }
    }

    fn decisions(controller: &mut impl Controller, tips: &[(f64, f64)]) -> Vec<Light> {
        let seen = |&(x, y): &(f64, f64)| Observation::simulated(Point::new(x, y));
        tips.iter().map(|tip| controller.decide(&seen(tip))).collect()
    }

    fn tips() -> impl Strategy<Value = Vec<(f64, f64)>> {
        prop::collection::vec((-8.0..8.0, 3.0..15.0), 1..60)
    }

    #[test]
    fn near_an_obstacle_the_aim_moves_away() {
        // A disc of 1 cm at (0, 8); the target stands above it.
        let task = Task::obstacles();
        let seen = |x: f64| {
            let stem = Polyline(vec![Point::new(0.0, 0.0), Point::new(x, 6.0), Point::new(x, 9.0)]);
            Observation { stem: Some(stem), ..Observation::simulated(Point::new(x, 9.0)) }
        };
        let light = |avoidance, x| {
            let rule = PredictiveRule { avoidance, ..PredictiveRule::default() };
            PredictiveGreedy::new(rule, &task, &Layout::default()).decide(&seen(x))
        };
        let avoidance = Avoidance { clearance_cm: 1.0, push: 4.0, ..Avoidance::default() };
        assert_eq!(light(None, 1.2), Light::LEFT);
        assert_eq!(light(Some(Avoidance::default()), 1.2), Light::LEFT);
        assert_eq!(light(Some(avoidance), 1.2), Light::RIGHT);
        assert_eq!(light(Some(avoidance), -1.2), Light::LEFT);
        // Far enough from the disc the target counts.
        assert_eq!(light(Some(avoidance), 2.1), Light::LEFT);
    }

    #[test]
    fn each_number_does_what_its_name_says() {
        let task = Task::default();
        let layout = Layout::default();
        let neutral = PredictiveRule::default();
        let lights = |rule, tips: &[(f64, f64)]| {
            decisions(&mut PredictiveGreedy::new(rule, &task, &layout), tips).pop().unwrap()
        };
        // The first target is (3, 6), the second (-5, 9).
        let beyond = PredictiveRule { overshoot: 0.5, ..neutral };
        assert_eq!([neutral, beyond].map(|rule| lights(rule, &[(4.0, 5.0)])), [Light::LEFT, Light::RIGHT]);
        let ahead = PredictiveRule { next_target: 0.5, ..neutral };
        assert_eq!([(2.0, 4.9), (2.0, 5.9)].map(|tip| lights(ahead, &[tip])), [Light::RIGHT, Light::LEFT]);
        let aside = PredictiveRule { offset_cm: 2.0, ..neutral };
        assert_eq!(lights(aside, &[(4.0, 5.0)]), Light::RIGHT);
        let moving = [(2.0, 5.0), (2.5, 5.0)];
        for rule in [
            PredictiveRule { velocity_steps: 5.0, ..neutral },
            PredictiveRule { shift_steps: 2.0, ..neutral },
            PredictiveRule { light_memory_cm: 5.0, ..neutral },
            PredictiveRule { lean: 0.3, ..neutral },
        ] {
            assert_eq!([neutral, rule].map(|rule| lights(rule, &moving)), [Light::RIGHT, Light::LEFT]);
        }
        let slow = PredictiveRule { persistence_cm: 0.5, ..neutral };
        assert_eq!(lights(slow, &[(2.0, 5.0), (3.2, 5.0)]), Light::RIGHT);
    }

    #[test]
    fn numbers_that_cannot_be_are_named() {
        PredictiveRule::default().check().unwrap();
        let error = |rule: PredictiveRule| rule.check().unwrap_err().to_string();
        let unknown = PredictiveRule { lean: f64::NAN, ..PredictiveRule::default() };
        assert!(error(unknown).contains("found lean = NaN"));
        let at_once = PredictiveRule { look_ahead_cm: 0.0, ..PredictiveRule::default() };
        assert_eq!(error(at_once), "found look_ahead_cm = 0, wanted cm above 0");
    }

    #[test]
    fn round_a_pole_it_is_the_greedy_rule_with_foresight() {
        let (task, layout) = (Task::spiral(), Layout::four_sides());
        let decide = |rule: Option<PredictiveRule>, tips: &[[f64; 2]]| {
            let mut greedy = Greedy::new(&task, &layout);
            let mut predictive = rule.map(|rule| PredictiveGreedy::new(rule, &task, &layout));
            let decide = |&[x, z]: &[f64; 2]| {
                let depth = Some(Depth { tip_cm: z, stem_cm: Vec::new() });
                let seen = Observation { depth, ..Observation::simulated(Point::new(x, 9.0)) };
                predictive.as_mut().map_or_else(|| greedy.decide(&seen), |rule| rule.decide(&seen))
            };
            tips.iter().map(decide).collect::<Vec<Light>>()
        };
        // Round the pole at x = 1.3: from its left to the front, to the right and to the back.
        let tips: Vec<[f64; 2]> = (0..40)
            .map(|step| 0.15 * f64::from(step))
            .map(|turn| [1.3 - 1.4 * math::cos(turn), 1.4 * math::sin(turn)])
            .collect();
        let greedy = decide(None, &tips);
        assert!(layout.lights().all(|light| greedy.contains(&light)), "{greedy:?}");
        assert_eq!(decide(Some(PredictiveRule::default()), &tips), greedy);
        // A tip that moves on is led earlier.
        let first_right = |lights: &[Light]| lights.iter().position(|&light| light == Light::RIGHT);
        let led = decide(Some(PredictiveRule { shift_steps: 2.0, ..PredictiveRule::default() }), &tips);
        assert!(first_right(&led) < first_right(&greedy), "{led:?}");
        let ahead = decide(Some(PredictiveRule { overshoot: 0.5, ..PredictiveRule::default() }), &tips);
        assert!(first_right(&ahead) < first_right(&greedy), "{ahead:?}");
    }

    proptest! {
        #[test]
        fn the_neutral_rule_is_greedy(tips in tips(), look_ahead_cm in 0.2..5.0) {
            let (task, layout) = (Task::default(), Layout::default());
            let rule = PredictiveRule { look_ahead_cm, ..PredictiveRule::default() };
            let mut predictive = PredictiveGreedy::new(rule, &task, &layout);
            prop_assert_eq!(
                decisions(&mut predictive, &tips),
                decisions(&mut Greedy::new(&task, &layout), &tips)
            );
        }

        #[test]
        fn without_offset_it_is_the_same_in_a_mirror(tips in tips(), numbers in prop::array::uniform8(-2.0..2.0)) {
            let [look_ahead, overshoot, next_target, velocity, shift, light, lean, persistence]: [f64; 8] = numbers;
            let rule = PredictiveRule {
                look_ahead_cm: 0.2 + look_ahead.abs(),
                overshoot,
                next_target,
                offset_cm: 0.0,
                velocity_steps: 5.0 * velocity,
                shift_steps: 5.0 * shift,
                light_memory_cm: light,
                lean,
                persistence_cm: persistence,
                avoidance: None,
            };
            let (task, layout) = (Task::default(), Layout::default());
            let images: Vec<(f64, f64)> = tips.iter().map(|&(x, y)| (-x, y)).collect();
            let plain = decisions(&mut PredictiveGreedy::new(rule, &task, &layout), &tips);
            let image = decisions(&mut PredictiveGreedy::new(rule, &mirrored(&task), &layout), &images);
            let expected: Vec<Light> = plain.iter().map(|&light| layout.mirrored(light).unwrap()).collect();
            prop_assert_eq!(image, expected);
        }
    }
}
