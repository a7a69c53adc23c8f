//! What of a task is out of reach.

use tropism::task::Task;
use tropism_bean::Species;

use crate::Monitor;

/// Notes each target and the farthest point of a form that virtual beans of `species` do not get to. It is no error: other
/// plants may get there, and what is near counts too.
pub(crate) fn note_out_of_reach(task: &Task, species: &Species, monitor: &dyn Monitor) {
    if task.has_goal() && task.best_fitness().is_some_and(|best| best <= 0.0) {
        let advice = "the targets lie straight above the start, and eq. (9) pays for steps to the side alone: \
                      `score = \"arrival\"` pays for passing them";
        monitor.note(advice);
    }
    for reason in species.out_of_reach(task) {
        monitor.note(&format!("out of reach of four virtual plants ({}): {reason}", species.name));
    }
}
