//! The paper's figures of what the page has grown, fitted and evolved.

use serde_json::{Value, json};
use tropism::simulation::AnyModel;
use tropism::task::Task;
use tropism::track::Track;
use tropism_page::figure;
use tropism_report::{self as report, Figure, Goals, Plants};

use crate::SessionError;
use crate::evolution::simulate;

fn answer(figures: Vec<Figure>) -> Value {
    json!(figures.into_iter().filter_map(figure).collect::<Vec<_>>())
}

/// Figures 4a, 4b and 5a to 5d of the beans' tracks.
pub(crate) fn tracks(tracks: &[Track]) -> Value {
    let mut figures =
        vec![report::trajectories(tracks, Plants::Virtual), report::directions(tracks, Plants::Virtual)];
    figures.extend(report::shift_maps(tracks, Plants::Virtual));
    answer(figures)
}

/// Figures 6a and 6b: the best fitness of each generation over all runs, and best and mean fitness of the run that ends with the median.
pub(crate) fn fitness(best: &[Vec<f64>], mean: &[Vec<f64>]) -> Value {
    let median = report::fitness_median_run(best, mean, "cm", Plants::ModelOfVirtual);
    let boxes = report::fitness_boxes(best, "cm", Plants::ModelOfVirtual);
    answer(std::iter::once(boxes).chain(median).collect())
}

/// Figure 7: a simulated plant that a champion steers.
pub(crate) fn steered(
    champion: &tropism::Champion,
    model: &AnyModel,
    task: &Task,
    seed: u64,
) -> Result<Value, SessionError> {
    let track = simulate(champion, model, task, seed, 0)?;
    let fitness = (task.fitness(&track), task.best_fitness_of(&track));
    let title = "Simulated plant";
    Ok(answer(vec![report::steering("7a", title, &track, &Goals::of(task), fitness, Plants::ModelOfVirtual)]))
}
