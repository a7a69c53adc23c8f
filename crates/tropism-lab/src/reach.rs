//! What of a task is out of reach, told before long work begins.

use tropism::geometry::Point;
use tropism::task::{Reach, Targets, Task, TaskSpec};
use tropism_bean::Species;

use crate::Monitor;

/// Notes each target and the farthest point of a form that virtual beans of `species` do not get to. It is no error: other
/// plants may get there, and what is near counts too.
pub(crate) fn note_out_of_reach(task: &TaskSpec, species: &Species, monitor: &dyn Monitor) {
    if is_surely_reached(task) {
        return;
    }
    let of_species;
    let reach = if *species == Species::default() {
        Species::common_reach()
    } else {
        of_species = species.reach();
        &of_species
    };
    for reason in task.out_of_reach(reach) {
        monitor.note(&format!("out of reach of four virtual plants ({}): {reason}", species.name));
    }
}

/// Whether nothing needs to be grown to know: there is no place to reach, or all are where real plants were.
fn is_surely_reached(task: &TaskSpec) -> bool {
    task.shape().is_empty() && task.out_of_reach(&reached_by_real_plants()).is_empty()
}

/// What the paper's plants reached (section 2.3.1, Fig. 8): the line from the start of their tips to each target in turn, every
/// half centimetre of height. What a low plant reaches to one side, a higher one reaches too, and both sides are alike.
fn reached_by_real_plants() -> Reach {
    let Targets { start, targets, .. } = Targets::default();
    let mut tips = vec![[start.y, start.x.abs()]];
    let mut below = start;
    for target in targets {
        let above = Point::new(target.x.abs().max(below.x), target.y);
        let height = above.y - below.y;
        let parts = (2.0 * height).floor();
        let part = |half: u32| {
            let up = 0.5 * f64::from(half);
            [below.y + up, below.x + (above.x - below.x) * up / height]
        };
        tips.extend((1..=parts as u32).map(part));
        below = above;
    }
    Reach { tips, ..Reach::default() }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[derive(Default)]
    struct Notes(Mutex<Vec<String>>);

    impl Monitor for Notes {
        fn note(&self, line: &str) {
            self.0.lock().unwrap().push(line.to_owned());
        }
    }

    #[test]
    fn only_what_is_out_of_reach_is_noted() {
        let noted = |task: TaskSpec| {
            let notes = Notes::default();
            note_out_of_reach(&task, &Species::default(), &notes);
            notes.0.into_inner().unwrap()
        };
        assert!(noted(TaskSpec::default()).is_empty());
        let targets = vec![Point::new(-9.0, 5.0), Point::new(1.0, 9.0)];
        let notes = noted(Targets { targets, ..Targets::default() }.into());
        assert_eq!(notes.len(), 1, "{notes:?}");
        assert!(notes[0].contains("the target (-9, 5)") && notes[0].contains("out of reach"), "{notes:?}");
    }

    #[test]
    fn virtual_beans_get_to_where_real_plants_were() {
        let reached = reached_by_real_plants().tips;
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
    }
}
