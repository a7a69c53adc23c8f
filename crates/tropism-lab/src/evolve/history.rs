//! `history.csv`: the fitness of each generation of an evolution.

use std::fmt::Write;
use std::path::Path;

use serde::Deserialize;
use tropism::evolve::EvolutionRun;
use tropism::math::statistics::median;

use crate::files::{self, FileError};

/// Largest number of runs that is read from a file: it bounds the memory that a damaged file can ask for.
const MAX_RUNS: usize = 100_000;

/// The fitness of each generation, in cm: one list a run, one value a generation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EvolutionHistory {
    /// Best fitness of the generation.
    pub best: Vec<Vec<f64>>,
    /// Mean fitness of the generation.
    pub mean: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
struct HistoryRow {
    run: usize,
    best: f64,
    mean: f64,
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
            let columns = [(&mut history.best, row.best), (&mut history.mean, row.mean)];
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

    /// The median over runs of the best fitness of each generation, as Fig. 6a draws it.
    #[must_use]
    pub fn medians(&self) -> Vec<f64> {
        let generations = self.best.iter().map(Vec::len).min().unwrap_or(0);
        let of_runs = |generation| self.best.iter().map(|run| run[generation]).collect::<Vec<f64>>();
        (0..generations).map(|generation| median(&of_runs(generation))).collect()
    }

    /// The first generation, counted from 1, at which [`Self::medians`] reach `share` of their final value; `None` if that is in
    /// the last tenth of them, where they still rise, and of an empty history.
    #[must_use]
    pub fn saturation(&self, share: f64) -> Option<usize> {
        let medians = self.medians();
        let first = medians.iter().position(|median| *median >= share * medians[medians.len() - 1])?;
        (10 * first < 9 * medians.len()).then_some(first + 1)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn history(best: &[[f64; 10]]) -> EvolutionHistory {
        let best: Vec<Vec<f64>> = best.iter().map(|run| run.to_vec()).collect();
        EvolutionHistory { mean: best.clone(), best }
    }

    #[test]
    fn saturation_is_that_of_the_median_that_is_drawn() {
        // The best so far rises to the end by single lucky evaluations; the best of a generation does not.
        let one = [1.0, 5.0, 9.0, 9.9, 10.0, 11.0, 10.0, 12.0, 10.0, 10.0];
        let other = [1.0, 5.0, 9.0, 9.9, 10.0, 10.0, 12.0, 10.0, 13.0, 10.0];
        assert_eq!(history(&[one, other, one]).saturation(0.98), Some(4));
        let rising = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0];
        assert_eq!(history(&[rising]).saturation(0.98), None);
        assert_eq!(EvolutionHistory::default().saturation(0.98), None);
    }
}
