//! What of a task is out of reach, told before long work begins.

use tropism::greenhouse::bean::Species;
use tropism::task::{Targets, Task, TaskSpec};

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

/// Whether nothing needs to be grown to know: there is no place to reach, or all are the paper's, which real plants reached.
fn is_surely_reached(task: &TaskSpec) -> bool {
    let known = Targets::default().targets;
    task.shape().is_empty() && task.targets().iter().all(|target| known.contains(target))
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use tropism::geometry::Point;

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
}
