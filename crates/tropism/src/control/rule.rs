//! The greedy rule with foresight: nine numbers say where it aims and what it expects of the plant.

use serde::{Deserialize, Serialize};

use super::Controller;
use crate::check::{OutOfRange, ensure};
use crate::geometry::Point;
use crate::lamps::{Layout, Light};
use crate::observation::Observation;
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PredictiveRule {
    /// Height below a target from which the target after it is looked at, in cm, above 0.
    pub look_ahead_cm: f64,
    /// Aim beyond the target, as a share of the target's x.
    pub overshoot: f64,
    /// Aim towards the target after, as a share of the way there, on the next target's height.
    pub next_target: f64,
    /// Aim to the right of it all, in cm: a bias. At 0 the rule is the same in a mirror.
    pub offset_cm: f64,
    /// How many steps the mean shift of the tip goes on.
    pub velocity_steps: f64,
    /// How many steps the last shift of the tip goes on.
    pub shift_steps: f64,
    /// Shift yet to come if the same lamp was lit for long, in cm.
    pub light_memory_cm: f64,
    /// Shift yet to come for each cm that the tip is aside.
    pub lean: f64,
    /// How far the expected tip must pass the aim before the other lamp is lit, in cm.
    pub persistence_cm: f64,
}

impl Default for PredictiveRule {
    /// The greedy rule. The look-ahead has no effect then.
    fn default() -> Self {
        Self {
            look_ahead_cm: 1.0,
            overshoot: 0.0,
            next_target: 0.0,
            offset_cm: 0.0,
            velocity_steps: 0.0,
            shift_steps: 0.0,
            light_memory_cm: 0.0,
            lean: 0.0,
            persistence_cm: 0.0,
        }
    }
}

impl PredictiveRule {
    /// The numbers by name, in the order of the fields.
    #[must_use]
    pub const fn named(&self) -> [(&'static str, f64); 9] {
        [
            ("look_ahead_cm", self.look_ahead_cm),
            ("overshoot", self.overshoot),
            ("next_target", self.next_target),
            ("offset_cm", self.offset_cm),
            ("velocity_steps", self.velocity_steps),
            ("shift_steps", self.shift_steps),
            ("light_memory_cm", self.light_memory_cm),
            ("lean", self.lean),
            ("persistence_cm", self.persistence_cm),
        ]
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key, its value and the allowed values.
    pub fn check(&self) -> Result<(), OutOfRange> {
        for (key, value) in self.named() {
            ensure(value.is_finite(), key, value, "a finite number")?;
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
/// let mut controller = PredictiveGreedy::new(rule, &Targets::default(), &Layout::default());
/// let mut decide = |x, y| controller.decide(&Observation::simulated(Point::new(x, y)));
/// assert_eq!(decide(2.0, 5.0), Light::RIGHT); // the target is at x = 3
/// assert_eq!(decide(2.2, 5.1), Light::LEFT); // ten more such shifts would pass it
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PredictiveGreedy {
    rule: PredictiveRule,
    targets: Vec<Point>,
    left: Light,
    right: Light,
    last_x: Option<f64>,
    /// Running mean of the shifts in x, in cm a step.
    velocity: f64,
    /// Running mean of the light: -1 left, 1 right.
    light: f64,
    /// The side of the last light; 0 at first.
    last_side: f64,
}

impl PredictiveGreedy {
    /// Steers towards the targets of `task` with the outermost lamps of `layout`.
    #[must_use]
    pub fn new(rule: PredictiveRule, task: &(impl Task + ?Sized), layout: &Layout) -> Self {
        Self {
            rule,
            targets: task.targets().to_vec(),
            left: layout.towards(false),
            right: layout.towards(true),
            last_x: None,
            velocity: 0.0,
            light: 0.0,
            last_side: 0.0,
        }
    }

    /// The x at which the tip should be for a height of `y`, in cm; `None` without targets.
    fn aim(&self, y: f64) -> Option<f64> {
        let rule = &self.rule;
        let last = self.targets.len().checked_sub(1)?;
        let next = self.targets.iter().position(|target| y < target.y).unwrap_or(last);
        let (target, after) = (self.targets[next], self.targets[(next + 1).min(last)]);
        let nearness = (1.0 - (target.y - y) / rule.look_ahead_cm).clamp(0.0, 1.0);
        let approach = rule.next_target * nearness;
        Some(target.x * (1.0 + rule.overshoot) + approach * (after.x - target.x) + rule.offset_cm)
    }
}

impl Controller for PredictiveGreedy {
    fn decide(&mut self, seen: &Observation) -> Light {
        let rule = &self.rule;
        let x = seen.tip.x;
        let shift = x - self.last_x.unwrap_or(x);
        self.velocity += VELOCITY_WEIGHT * (shift - self.velocity);
        let expected = x * (1.0 + rule.lean)
            + rule.velocity_steps * self.velocity
            + rule.shift_steps * shift
            + rule.light_memory_cm * self.light
            - rule.persistence_cm * self.last_side;
        let is_right = self.aim(seen.tip.y).is_some_and(|aim| expected < aim);
        self.last_x = Some(x);
        self.last_side = if is_right { 1.0 } else { -1.0 };
        self.light += LIGHT_WEIGHT * (self.last_side - self.light);
        if is_right { self.right } else { self.left }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::control::Greedy;
    use crate::task::Targets;

    fn mirrored(task: &Targets) -> Targets {
        Targets { targets: task.targets.iter().map(|target| target.mirrored()).collect(), ..task.clone() }
    }

    fn decisions(controller: &mut impl Controller, tips: &[(f64, f64)]) -> Vec<Light> {
        let seen = |&(x, y): &(f64, f64)| Observation::simulated(Point::new(x, y));
        tips.iter().map(|tip| controller.decide(&seen(tip))).collect()
    }

    fn tips() -> impl Strategy<Value = Vec<(f64, f64)>> {
        prop::collection::vec((-8.0..8.0, 3.0..15.0), 1..60)
    }

    #[test]
    fn each_number_does_what_its_name_says() {
        let task = Targets::default();
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
        assert!(
            error(PredictiveRule { lean: f64::NAN, ..PredictiveRule::default() })
                .contains("found lean = NaN")
        );
        let at_once = PredictiveRule { look_ahead_cm: 0.0, ..PredictiveRule::default() };
        assert_eq!(error(at_once), "found look_ahead_cm = 0, wanted cm above 0");
    }

    proptest! {
        #[test]
        fn the_neutral_rule_is_greedy(tips in tips(), look_ahead_cm in 0.2..5.0) {
            let (task, layout) = (Targets::default(), Layout::default());
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
            };
            let (task, layout) = (Targets::default(), Layout::default());
            let images: Vec<(f64, f64)> = tips.iter().map(|&(x, y)| (-x, y)).collect();
            let plain = decisions(&mut PredictiveGreedy::new(rule, &task, &layout), &tips);
            let image = decisions(&mut PredictiveGreedy::new(rule, &mirrored(&task), &layout), &images);
            let expected: Vec<Light> = plain.iter().map(|&light| layout.mirrored(light).unwrap()).collect();
            prop_assert_eq!(image, expected);
        }
    }
}
