//! `history.csv`: the fitness of each generation of an evolution.

use std::fmt::Write;
use std::path::Path;

use serde::Deserialize;
use tropism::evolve::EvolutionRun;

use crate::files::{self, FileError};
use crate::statistics::median;

/// Largest number of runs that is read from a file: it bounds the memory that a damaged file can ask for.
const MAX_RUNS: usize = 100_000;

/// The fitness of each generation, in cm: one list a run, one value a generation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EvolutionHistory {
    /// Best fitness of the generation.
    pub best: Vec<Vec<f64>>,
    /// Mean fitness of the generation.
    pub mean: Vec<Vec<f64>>,
    /// Best fitness so far.
    pub best_ever: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
struct HistoryRow {
    run: usize,
    best: f64,
    mean: f64,
    best_ever: f64,
}

impl EvolutionHistory {
    /// Reads the `history.csv` of an evolution.
    ///
    /// # Errors
    /// [`FileError`] if the file cannot be read or is no history.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let mut history = Self::default();
        let bytes = files::read(path)?;
        for row in csv::Reader::from_reader(bytes.as_slice()).deserialize() {
            let row: HistoryRow = row.map_err(|error: csv::Error| FileError::Content {
                path: path.to_owned(),
                problem: error.to_string(),
            })?;
            let columns = [
                (&mut history.best, row.best),
                (&mut history.mean, row.mean),
                (&mut history.best_ever, row.best_ever),
            ];
            for (runs, value) in columns {
                if runs.len() <= row.run && row.run < MAX_RUNS {
                    runs.resize(row.run + 1, Vec::new());
                }
                if let Some(generations) = runs.get_mut(row.run) {
                    generations.push(value);
                }
            }
        }
        Ok(history)
    }

    /// The first generation, counted from 1, at which the median over runs of the best fitness so far reaches `share`
    /// of its final value; `None` of an empty history.
    #[must_use]
    pub fn saturation(&self, share: f64) -> Option<usize> {
        let generations = self.best_ever.iter().map(Vec::len).min()?;
        let median_at = |generation: usize| {
            let mut best: Vec<f64> = self.best_ever.iter().map(|run| run[generation]).collect();
            best.sort_by(f64::total_cmp);
            median(&best)
        };
        let last = median_at(generations.checked_sub(1)?);
        (0..generations)
            .find(|&generation| median_at(generation) >= share * last)
            .map(|generation| generation + 1)
    }
}

/// The text of `history.csv`: one row a generation and run.
pub(super) fn csv_of(runs: &[EvolutionRun]) -> String {
    let mut text =
        "run,generation,best,mean,median,best_ever,species,population,links_mean,threshold\n".to_owned();
    for (index, run) in runs.iter().enumerate() {
        for generation in &run.history {
            let _ = writeln!(
                text,
                "{index},{},{},{},{},{},{},{},{},{}",
                generation.generation,
                generation.best,
                generation.mean,
                generation.median,
                generation.best_ever,
                generation.species,
                generation.population,
                generation.links_mean,
                generation.threshold
            );
        }
    }
    text
}
