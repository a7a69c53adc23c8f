//! How far to the side a plant gets: what a task cannot have of it is known before it grows.
//!
//! In: the farthest places at which tips and stems of some plants were. Out: for a place of a task, why no such plant gets
//! there. The idea: what a low plant reaches to one side, a higher one reaches too, and both sides are alike.

use serde::Serialize;

use crate::geometry::Point;

/// How far plants of one kind get, by height. Places are pairs of height and distance from the root to either side, in cm, in
/// ascending height and distance.
///
/// ```
/// use tropism::prelude::*;
/// use tropism::task::Reach;
/// let reach = Reach { tips: vec![[4.0, 1.0], [12.0, 5.0]], ..Reach::default() };
/// assert_eq!(reach.misses_tip(Point::new(-4.5, 12.0)), None);
/// assert_eq!(reach.misses_tip(Point::new(-3.0, 8.0)).unwrap(), "2.0 cm out of reach on the left");
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Reach {
    /// The farthest place at which a tip arrives at a height for the first time.
    pub tips: Vec<[f64; 2]>,
    /// The farthest place at which a stem is whose tip has just become higher than ever.
    pub stems: Vec<[f64; 2]>,
    /// The steepest lean to the vertical of the upper third of such a stem, in degrees.
    pub lean_deg: f64,
}

impl Reach {
    /// Why no tip gets to `target`; `None` within reach, and where nothing is known.
    #[must_use]
    pub fn misses_tip(&self, target: Point) -> Option<String> {
        misses(&self.tips, target)
    }

    /// Why no stem gets to `point`; `None` within reach, and where nothing is known.
    #[must_use]
    pub fn misses_stem(&self, point: Point) -> Option<String> {
        misses(&self.stems, point)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::{Shape, Targets, Task};

    fn reach() -> Reach {
        Reach {
            tips: vec![[4.0, 1.0], [8.0, 3.0], [12.0, 5.0]],
            stems: vec![[0.0, 0.5], [8.0, 3.0]],
            lean_deg: 60.0,
        }
    }

    #[test]
    fn what_is_out_of_reach_is_told_with_the_reason() {
        let targets = [[2.5, 6.0], [-3.0, 9.0], [0.0, 20.0]].map(Point::from).to_vec();
        let task = Targets { targets, ..Targets::default() };
        assert_eq!(
            task.out_of_reach(&reach()),
            [
                "the target (2.5, 6): 1.5 cm out of reach on the right",
                "the target (0, 20): higher than these plants grow, 12.0 cm"
            ]
        );
        let line = [[0.0, 0.0], [-2.0, 4.0], [0.0, 7.0]].map(Point::from).to_vec();
        let task = Shape { line, ..Shape::default() };
        assert_eq!(
            task.out_of_reach(&reach()),
            ["the point (-2, 4) of the form: 1.5 cm out of reach on the left"]
        );
        assert!(task.out_of_reach(&Reach::default()).is_empty(), "nothing is known of these plants");
    }
}
