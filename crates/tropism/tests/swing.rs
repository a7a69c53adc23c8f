//! Model, task and NEAT together against reference runs on a made-up data set, looked up as its description says: window
//! mean at the nearest node of a 0.1 cm grid, mirrored, 0 where a window is empty.

use std::path::PathBuf;

use rayon::prelude::*;
use tropism::evolve::{EvolutionConfig, Run, baseline};
use tropism::experiment::files;
use tropism::plant::tip::{TipModel, TipModelConfig};
use tropism::task::Task;
use tropism_neat::Config;

/// The model of `synthetic-swing`, or a line that says why not.
fn model() -> Option<TipModel> {
    let Some(data) = std::env::var_os("TROPISM_DATA") else {
        eprintln!("skipped: TROPISM_DATA is not set, so there is no synthetic-swing to read");
        return None;
    };
    let folder = PathBuf::from(data).join("synthetic-swing");
    let tracks: Vec<_> = (1..=6)
        .map(|number| files::read_track(&folder.join(format!("experiment-{number}.csv"))).unwrap())
        .collect();
    Some(TipModel::fit(&tracks, TipModelConfig::default()).unwrap())
}

#[test]
fn random_controllers_do_as_the_reference() {
    let Some(model) = model() else { return };
    let found = baseline(&model, &Task::default(), &Config::paper(), 1, 200_000, |_| true).unwrap();
    assert!((-8.6..=-7.5).contains(&found.median), "median {}", found.median);
    assert!((6.0..=8.0).contains(&found.best), "best {}", found.best);
}

#[test]
fn eight_runs_of_500_generations_do_as_the_reference() {
    let Some(model) = model() else { return };
    let task = Task::default();
    let config = EvolutionConfig { generations: 500, ..EvolutionConfig::default() };
    let mut best: Vec<f64> = (0..8)
        .into_par_iter()
        .map(|index| {
            let mut run = Run::new(&config, 1, index).unwrap();
            for _ in 0..500 {
                run.advance(&model, &task);
            }
            run.champion().unwrap().1
        })
        .collect();
    best.sort_by(f64::total_cmp);
    let median = 0.5 * (best[3] + best[4]);
    assert!((10.5..=12.5).contains(&median), "median {median} of {best:?}");
}
