//! Predictive rules side by side, one a vector lane: the fast twin of [`PredictiveGreedy`] in the plane, with the same bits.

#![allow(clippy::needless_range_loop, reason = "a lane is an index into many arrays at once")]

use super::{Avoidance, LIGHT_WEIGHT, PredictiveGreedy, PredictiveRule, VELOCITY_WEIGHT};
use crate::control::steering::Steering;
use crate::geometry::STEM_POINTS;
use crate::lamps::Layout;
use crate::math;
use crate::math::interpolate::lerp;
use crate::math::lanes::{LANES, Row, clamped};
use crate::obstacle::lanes::{ClearanceRow, PointRow};
use crate::task::Task;

/// The rules of some plants, and what they remember. The names are those of [`PredictiveRule`] and [`Avoidance`].
#[repr(C, align(64))]
pub(crate) struct Rules {
    look_ahead_cm: Row,
    overshoot: Row,
    next_target: Row,
    offset_cm: Row,
    velocity_steps: Row,
    shift_steps: Row,
    light_memory_cm: Row,
    lean: Row,
    persistence_cm: Row,
    clearance_cm: Row,
    push: Row,
    clearance_steps: Row,
    bend: Row,
    /// The way of each rule, from its lowest point on.
    way: Vec<PointRow>,
    /// 1 before the first decision, then 0.
    is_first: Row,
    last_x: Row,
    velocity: Row,
    light: Row,
    last_side: Row,
    last_clearance: Row,
    clearance_change: Row,
    /// The side of the lamp on the left and on the right.
    sides: [f64; 2],
}

impl Rules {
    /// Lanes without rules for a task in the plane with `way` points, under the lamps of `layout`.
    pub(crate) fn new(way: usize, layout: &Layout) -> Self {
        let zero = [0.0; LANES];
        Self {
            look_ahead_cm: [1.0; LANES],
            overshoot: zero,
            next_target: zero,
            offset_cm: zero,
            velocity_steps: zero,
            shift_steps: zero,
            light_memory_cm: zero,
            lean: zero,
            persistence_cm: zero,
            clearance_cm: zero,
            push: zero,
            clearance_steps: zero,
            bend: zero,
            way: vec![[zero; 2]; way],
            is_first: [1.0; LANES],
            last_x: zero,
            velocity: zero,
            light: zero,
            last_side: zero,
            last_clearance: zero,
            clearance_change: zero,
            sides: [false, true].map(|is_right| layout.side(layout.towards(is_right))),
        }
    }

    /// Puts a rule at rest into a lane; `false` if it needs a way or lamps that lanes do not know.
    pub(crate) fn refill(&mut self, lane: usize, rule: PredictiveRule, task: &Task, layout: &Layout) -> bool {
        let PredictiveGreedy { way, steering, obstacles, .. } = PredictiveGreedy::new(rule, task, layout);
        let is_known = matches!(steering, Steering::Plane(_)) && way.len() == self.way.len();
        if !is_known || way.is_empty() || rule.avoidance.is_some() == obstacles.is_empty() {
            return false;
        }
        for (row, [x, y, _]) in self.way.iter_mut().zip(way) {
            (row[0][lane], row[1][lane]) = (x, y);
        }
        self.look_ahead_cm[lane] = rule.look_ahead_cm;
        self.overshoot[lane] = rule.overshoot;
        self.next_target[lane] = rule.next_target;
        self.offset_cm[lane] = rule.offset_cm;
        self.velocity_steps[lane] = rule.velocity_steps;
        self.shift_steps[lane] = rule.shift_steps;
        self.light_memory_cm[lane] = rule.light_memory_cm;
        self.lean[lane] = rule.lean;
        self.persistence_cm[lane] = rule.persistence_cm;
        let Avoidance { clearance_cm, push, clearance_steps, bend, .. } = rule.avoidance.unwrap_or_default();
        self.clearance_cm[lane] = clearance_cm;
        self.push[lane] = push;
        self.clearance_steps[lane] = clearance_steps;
        self.bend[lane] = bend;
        self.is_first[lane] = 1.0;
        let state = [&mut self.velocity, &mut self.light, &mut self.last_side, &mut self.clearance_change];
        state.into_iter().for_each(|row| row[lane] = 0.0);
        true
    }

    /// The side of the lamp that each rule lights: -1 or 1. `nearest` is there in a task with obstacles.
    #[inline(always)]
    pub(crate) fn decide(
        &mut self,
        tips: &PointRow,
        stems: &[PointRow; STEM_POINTS],
        nearest: Option<&ClearanceRow>,
    ) -> Row {
        // Copies: a compiler must know that nothing else stands where is written to.
        let ([tip_x, tip_y], sides_of_lamps) = (*tips, self.sides);
        let (mut push, mut bend, mut sides) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        if let Some(nearest) = nearest {
            (push, bend) = self.avoid(*nearest, *stems);
        }
        let ([target_x, target_y], after_x) = self.next_targets(tip_y);
        for lane in 0..LANES {
            let below = 1.0 - (target_y[lane] - tip_y[lane]) / self.look_ahead_cm[lane];
            let approach = self.next_target[lane] * clamped(below, [0.0, 1.0]);
            let aim = target_x[lane] * (1.0 + self.overshoot[lane])
                + approach * (after_x[lane] - target_x[lane])
                + self.offset_cm[lane];

            let (at, last) = (tip_x[lane], self.last_x[lane]);
            let shift = at - if self.is_first[lane] > 0.0 { at } else { last };
            self.velocity[lane] += VELOCITY_WEIGHT * (shift - self.velocity[lane]);
            let expected = at * (1.0 + self.lean[lane])
                + self.velocity_steps[lane] * self.velocity[lane]
                + self.shift_steps[lane] * shift
                + self.light_memory_cm[lane] * self.light[lane]
                - self.persistence_cm[lane] * self.last_side[lane];
            let way = (aim + push[lane]) - (expected + bend[lane]);
            // Where the rule remembers a lamp, right is 1 and left -1, wherever the lamps stand.
            let side = if way > 0.0 { 1.0 } else { -1.0 };
            self.light[lane] += LIGHT_WEIGHT * (side - self.light[lane]);
            (self.last_x[lane], self.last_side[lane]) = (at, side);
            sides[lane] = if way > 0.0 { sides_of_lamps[1] } else { sides_of_lamps[0] };
        }
        self.is_first = [0.0; LANES];
        sides
    }

    /// By how much the aims move away from obstacles, and by how much further right the tips are expected for the lean of the
    /// upper stems, in cm: by the last and the seventh of ten points at equal distances.
    #[inline(always)]
    fn avoid(&mut self, nearest: ClearanceRow, stems: [PointRow; STEM_POINTS]) -> (Row, Row) {
        // Lengths from point to point, and from the base up to each point.
        let (mut lengths, mut walked) = ([[0.0; LANES]; STEM_POINTS], [[0.0; LANES]; STEM_POINTS]);
        // Three at a time: a compiler makes vectors of long loops only.
        for first in (1..STEM_POINTS).step_by(3) {
            let mut total = walked[first - 1];
            for lane in 0..LANES {
                for point in first..first + 3 {
                    let x = stems[point - 1][0][lane] - stems[point][0][lane];
                    let y = stems[point - 1][1][lane] - stems[point][1][lane];
                    let length = math::hypot(x, y);
                    total[lane] += length;
                    (lengths[point][lane], walked[point][lane]) = (length, total[lane]);
                }
            }
        }
        let (mut pushes, mut bends) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let (distance, last) = (nearest.distance_cm[lane], self.last_clearance[lane]);
            let change = distance - if self.is_first[lane] > 0.0 { distance } else { last };
            self.last_clearance[lane] = distance;
            self.clearance_change[lane] += VELOCITY_WEIGHT * (change - self.clearance_change[lane]);
            let expected = distance + self.clearance_steps[lane] * self.clearance_change[lane];
            let away = if nearest.stem_x[lane] < nearest.obstacle_x[lane] { -1.0 } else { 1.0 };
            pushes[lane] = away * self.push[lane] * (self.clearance_cm[lane] - expected).max(0.0);

            // Segments are equal but for rounding, so the seventh point lies at the end of the sixth or at the start of the
            // seventh segment.
            let from_base = walked[STEM_POINTS - 1][lane] / (STEM_POINTS - 1) as f64 * 6.0;
            let of_sixth = (from_base - walked[5][lane]) / lengths[6][lane];
            let of_seventh = (from_base - walked[6][lane]) / lengths[7][lane];
            let on_sixth = lerp(stems[5][0][lane], stems[6][0][lane], of_sixth);
            let on_seventh = lerp(stems[6][0][lane], stems[7][0][lane], of_seventh);
            let seventh = if walked[6][lane] >= from_base { on_sixth } else { on_seventh };
            bends[lane] = self.bend[lane] * (stems[STEM_POINTS - 1][0][lane] - seventh);
        }
        (pushes, bends)
    }

    /// The next point of the way above each height, and the x of the one after it, in cm.
    #[inline(always)]
    fn next_targets(&self, y: Row) -> (PointRow, Row) {
        let last = self.way.len() - 1;
        let ([mut target_x, mut target_y], mut after_x) = (self.way[last], self.way[last][0]);
        for place in (0..last).rev() {
            let ([x, height], [next_x, _]) = (self.way[place], self.way[place + 1]);
            for lane in 0..LANES {
                let is_below = y[lane] < height[lane];
                target_x[lane] = if is_below { x[lane] } else { target_x[lane] };
                target_y[lane] = if is_below { height[lane] } else { target_y[lane] };
                after_x[lane] = if is_below { next_x[lane] } else { after_x[lane] };
            }
        }
        ([target_x, target_y], after_x)
    }
}
