//! A form of the stem: as near to a drawn line as can be, or a bow of a given apex, radius, inflection or lean.
//!
//! The paper names "curve radius, apex point of curve, inflection point" as what a fitness on the whole stem could use
//! (section 4). Each is measured on the ten points of the seen stem, and each difference is put in cm.

use super::{Crossing, Past, Score, Task};
use crate::check::{OutOfRange, ensure};
use crate::geometry::{Point, Polyline, STEM_POINTS};
use crate::math::atan2;
use crate::observation::Observation;
use crate::track::Track;

/// A form that the stem is to have when its tip reaches a height: a line, or what is wanted of its bow.
#[derive(Clone, Copy, Debug)]
pub struct Shape;

/// The bow of a stem between its ends.
struct Bow {
    apex: Point,
    /// 1 over the radius of the circle through both ends and the apex, in 1/cm; above 0 for a bow to the right.
    curvature: f64,
    /// Distance between the ends, in cm.
    chord_cm: f64,
}

/// Twice the signed area of a triangle; below 0 where `b` lies to the left of the way from `a` to `c`.
fn area(a: Point, b: Point, c: Point) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

fn bow(stem: &[Point]) -> Bow {
    let (base, tip) = (stem[0], stem[stem.len() - 1]);
    let far = |point: &Point| area(base, *point, tip).abs();
    let apex = stem.iter().copied().max_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(tip);
    let sides = base.distance(apex) * apex.distance(tip) * tip.distance(base);
    // Circle through three points: its curvature is four times their area over the product of the sides.
    let curvature = if sides > 0.0 { 2.0 * area(base, apex, tip) / sides } else { 0.0 };
    Bow { apex, curvature, chord_cm: base.distance(tip) }
}

/// Where the curve of the stem changes its side: between the strongest bends to either side. `None` where it bends one way only.
fn inflection(stem: &[Point]) -> Option<Point> {
    let bends: Vec<f64> = stem.windows(3).map(|three| area(three[0], three[1], three[2])).collect();
    let strongest = |sign: f64| {
        let signed = bends.iter().map(|bend| sign * bend).enumerate();
        signed.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|&(_, bend)| bend > 0.0).map(|(at, _)| at)
    };
    let (right, left) = (strongest(1.0)?, strongest(-1.0)?);
    let (lower, upper) = (right.min(left), right.max(left));
    let sign = bends[lower].signum();
    let change = (lower..upper).find(|&at| bends[at + 1] * sign <= 0.0)?;
    let share = bends[change] / (bends[change] - bends[change + 1]);
    // A bend belongs to the middle one of its three points.
    Some(stem[change + 1].lerp(stem[change + 2], share))
}

impl Task {
    /// No form yet: keys are set beside it.
    #[must_use]
    pub fn shape() -> Self {
        Self { end_height_cm: 12.0, ..Self::new(Shape) }
    }

    /// Whether a form of the stem is wanted.
    #[must_use]
    pub const fn has_form(&self) -> bool {
        !self.line.is_empty()
            || self.apex.is_some()
            || self.radius_cm.is_some()
            || self.inflection.is_some()
            || self.lean_deg.is_some()
    }

    /// The mean difference between the form of a stem and the wanted one, in cm, over what is wanted: for a line the mean
    /// distance of ten points, for a point its distance, for a radius the difference in the height of the bow, for a lean the
    /// difference at the end of the upper third. Where the stem has no inflection, its whole length. 0 where no form is wanted.
    #[must_use]
    pub fn form_difference_cm(&self, stem: &Polyline) -> f64 {
        let ten = stem.resampled(STEM_POINTS);
        if ten.0.len() < STEM_POINTS {
            return f64::INFINITY;
        }
        let (points, bow, length) = (&ten.0, bow(&ten.0), ten.length());
        let mut differences = Vec::new();
        if self.line.len() > 1 {
            let wanted = Polyline(self.line.clone()).resampled(STEM_POINTS);
            let apart = points.iter().zip(&wanted.0).map(|(point, wanted)| point.distance(*wanted));
            differences.push(apart.sum::<f64>() / STEM_POINTS as f64);
        }
        if let Some(apex) = self.apex {
            differences.push(bow.apex.distance(apex));
        }
        if let Some(radius) = self.radius_cm {
            // A flat bow over a chord c is c^2 / (8 r) high.
            differences.push((bow.curvature - 1.0 / radius).abs() * bow.chord_cm * bow.chord_cm / 8.0);
        }
        if let Some(wanted) = self.inflection {
            differences.push(inflection(points).map_or(length, |found| found.distance(wanted)));
        }
        if let Some(lean) = self.lean_deg {
            let (from, to) = (points[STEM_POINTS - 4], points[STEM_POINTS - 1]);
            let found = atan2(to.x - from.x, to.y - from.y);
            differences.push((found - lean.to_radians()).abs() * from.distance(to));
        }
        differences.iter().sum::<f64>() / differences.len().max(1) as f64
    }

    /// The difference of what is seen; that of a straight stem to the tip where no stem is seen.
    fn seen_difference_cm(&self, seen: &Observation) -> f64 {
        match &seen.stem {
            Some(stem) => self.form_difference_cm(stem),
            None => self.form_difference_cm(&Polyline(vec![Point::default(), seen.tip])),
        }
    }

    /// The line from the height of the seedling up, or the apex of the curve: along it controllers steer the tip.
    pub(super) fn upper_line(&self) -> Vec<Point> {
        let mut way: Vec<Point> = Vec::new();
        for point in self.line.iter().chain(self.apex.iter().filter(|_| self.line.is_empty())) {
            if point.y > way.last().map_or(self.start.y, |last| last.y) {
                way.push(*point);
            }
        }
        way
    }
}

impl Score for Shape {
    /// By how much the step brings the stem nearer to the form, in cm. Over an experiment: the difference of the seedling less
    /// that of the grown stem.
    fn step_fitness(&self, task: &Task, past: &Past, after: &Observation) -> f64 {
        task.seen_difference_cm(&past.latest) - task.seen_difference_cm(after)
    }

    /// The difference of the seedling: an upright one, where no stem is seen.
    fn best(&self, task: &Task, first: &Observation) -> Option<f64> {
        Some(task.seen_difference_cm(first))
    }

    /// `None` for a track without stems.
    fn is_done(&self, task: &Task, track: &Track) -> Option<bool> {
        track.samples.iter().find(|sample| sample.stem.is_some())?;
        Some(self.crossings(task, track)[0].is_some_and(|end| end.distance_cm <= task.within_cm))
    }

    /// One, at the end: its distance is the mean difference. `None` where the tip did not reach the height.
    fn crossings(&self, task: &Task, track: &Track) -> Vec<Option<Crossing>> {
        let end = track.samples.iter().find(|sample| sample.tip.y >= task.end_height_cm);
        let distance_cm = |seen: Observation| task.seen_difference_cm(&seen);
        vec![end.map(|end| Crossing { step: end.step, distance_cm: distance_cm(end.observation()) })]
    }

    fn title(&self, _task: &Task) -> String {
        "a form of the stem".to_owned()
    }

    fn name(&self) -> &'static str {
        "shape"
    }

    fn keys(&self) -> &'static [&'static str] {
        &[
            "start",
            "line",
            "apex",
            "radius_cm",
            "inflection",
            "lean_deg",
            "within_cm",
            "end_height_cm",
            "max_steps",
        ]
    }

    fn check(&self, task: &Task) -> Result<(), OutOfRange> {
        ensure(task.has_form(), "line", "[]", "a line, or one of apex, radius_cm, inflection and lean_deg")?;
        ensure(task.end_height_cm.is_finite(), "end_height_cm", task.end_height_cm, "cm")
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::FRAC_1_SQRT_2;

    use proptest::prelude::*;

    use super::*;

    fn arc(radius: f64, turn: f64) -> Polyline {
        // Bows to the left for a radius above 0: the centre lies to the right of the stem.
        let at = |i: i32| turn * f64::from(i) / 60.0;
        let point =
            |i| Point::new(radius * (1.0 - crate::math::cos(at(i))), radius.abs() * crate::math::sin(at(i)));
        Polyline((0..=60).map(point).collect())
    }

    fn wanting(goal: impl FnOnce(&mut Task)) -> Task {
        let mut task = Task::shape();
        goal(&mut task);
        task
    }

    /// A bow to the right and back.
    fn bowed() -> Task {
        let line = [(0.0, 0.0), (0.4, 3.0), (1.8, 6.0), (2.4, 9.0), (1.2, 12.0)];
        Task { line: line.map(|(x, y)| Point::new(x, y)).to_vec(), ..Task::shape() }
    }

    #[test]
    fn a_stem_on_the_line_differs_by_nothing() {
        let shape = bowed();
        shape.check().unwrap();
        assert!(shape.form_difference_cm(&Polyline(shape.line.clone())) < 1e-12);
        let aside = Polyline(shape.line.iter().map(|point| Point::new(point.x + 0.3, point.y)).collect());
        assert!((shape.form_difference_cm(&aside) - 0.3).abs() < 1e-12);
    }

    #[test]
    fn a_bow_has_its_apex_radius_and_lean() {
        // A quarter of a circle that starts upright and ends to the right: its bow points to the upper left.
        let stem = arc(8.0, core::f64::consts::FRAC_PI_2);
        let ten = stem.resampled(STEM_POINTS);
        let apex = bow(&ten.0).apex;
        assert!(
            apex.distance(Point::new(8.0 * (1.0 - FRAC_1_SQRT_2), 8.0 * FRAC_1_SQRT_2)) < 0.8,
            "{apex:?}"
        );
        assert!(wanting(|shape| shape.radius_cm = Some(-8.0)).form_difference_cm(&stem) < 0.02);
        assert!(wanting(|shape| shape.radius_cm = Some(8.0)).form_difference_cm(&stem) > 3.0);
        let lean = wanting(|shape| shape.lean_deg = Some(75.0)).form_difference_cm(&stem);
        assert!(lean < 0.1, "the upper third leans by 60 to 90 degrees: {lean}");
        // It bends one way only.
        let none = wanting(|shape| shape.inflection = Some(apex)).form_difference_cm(&stem);
        assert!((none - ten.length()).abs() < 1e-9);
    }

    #[test]
    fn an_s_changes_its_side_in_the_middle() {
        let s = (0..=60).map(|i| f64::from(i) / 5.0).map(|y| Point::new(crate::math::sin(y / 2.0), y));
        let stem = Polyline(s.collect());
        let middle = Point::new(0.0, core::f64::consts::TAU);
        let shape = wanting(|shape| shape.inflection = Some(middle));
        assert!(shape.form_difference_cm(&stem) < 0.4, "{}", shape.form_difference_cm(&stem));
    }

    proptest! {
        #[test]
        fn a_mirrored_stem_differs_as_much_from_the_mirrored_form(
            xs in prop::collection::vec(-3.0..3.0, 8), lean in -60.0..60.0, radius in 3.0..30.0,
        ) {
            let stem = Polyline(xs.iter().enumerate().map(|(i, &x)| Point::new(x, 1.5 * i as f64)).collect());
            let shape = Task {
                lean_deg: Some(lean), radius_cm: Some(radius), apex: Some(Point::new(1.0, 6.0)), ..bowed()
            };
            let image = Task {
                line: shape.line.iter().map(|point| point.mirrored()).collect(),
                lean_deg: Some(-lean),
                radius_cm: Some(-radius),
                apex: shape.apex.map(Point::mirrored),
                ..shape.clone()
            };
            let difference = shape.form_difference_cm(&stem) - image.form_difference_cm(&stem.mirrored());
            prop_assert!(difference.abs() < 1e-9, "{difference}");
        }
    }
}
