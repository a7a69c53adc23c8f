//! Histories of an evolution as curves, thinned to what a page can draw.

use serde::{Deserialize, Serialize};
use tropism::math::statistics::five_numbers;
use tropism_neat::Generation;

use crate::rounded;

/// Generations of a curve that are sent, at most: as many as a page has pixels for.
const POINTS: usize = 300;

/// What is shown of a generation.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct ShownGeneration {
    /// Best fitness so far, in cm.
    pub best_ever: f64,
    /// Number of species.
    pub species: f64,
    /// Mean number of links.
    pub links_mean: f64,
    /// Evaluations of this run so far.
    pub evaluations: u64,
}

impl From<&Generation> for ShownGeneration {
    fn from(generation: &Generation) -> Self {
        Self {
            best_ever: generation.best_ever,
            species: generation.species as f64,
            links_mean: generation.links_mean,
            evaluations: generation.evaluations,
        }
    }
}

/// The histories of all runs of an evolution.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Curves {
    /// Generations that are done, of all runs.
    pub done: usize,
    /// Evaluations of all runs.
    pub evaluations: u64,
    /// The generations that are shown, from 1.
    pub marks: Vec<usize>,
    /// Best fitness of each run at the marks that it has reached.
    pub best: Vec<Vec<f64>>,
    /// Lower quartile of the best fitness over the runs, at each mark.
    pub q1: Vec<f64>,
    /// Its median.
    pub median: Vec<f64>,
    /// Its upper quartile.
    pub q3: Vec<f64>,
    /// Its highest value.
    pub top: Vec<f64>,
    /// Mean number of species, at each mark.
    pub species: Vec<f64>,
    /// Mean number of links, at each mark.
    pub links: Vec<f64>,
    /// Best fitness of each run so far; `None` before its first generation.
    pub latest: Vec<Option<f64>>,
}

/// The histories of all runs as curves.
#[must_use]
pub fn curves(runs: &[&[ShownGeneration]]) -> Curves {
    let longest = runs.iter().map(|run| run.len()).max().unwrap_or(0);
    let marks = marks(longest, longest.div_ceil(POINTS).max(1));
    let curve = |of: fn(&ShownGeneration) -> f64| -> Vec<Vec<f64>> {
        let values = |run: &&[ShownGeneration]| -> Vec<f64> {
            let shown = marks.iter().map_while(|&mark| run.get(mark - 1));
            shown.map(|generation| rounded(of(generation), 3)).collect()
        };
        runs.iter().map(values).collect()
    };
    let best = curve(|generation| generation.best_ever);
    let at = |curves: &[Vec<f64>], place: usize| -> Vec<f64> {
        curves.iter().filter_map(|run| run.get(place).copied()).collect()
    };
    let means = |curves: &[Vec<f64>]| -> Vec<f64> {
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len().max(1) as f64;
        (0..marks.len()).map(|place| rounded(mean(at(curves, place)), 3)).collect()
    };
    let quartiles: Vec<[f64; 5]> =
        (0..marks.len()).filter_map(|place| five_numbers(&at(&best, place))).collect();
    let column = |place: usize| quartiles.iter().map(|five| rounded(five[place], 3)).collect::<Vec<f64>>();
    Curves {
        done: runs.iter().map(|run| run.len()).sum(),
        evaluations: runs.iter().filter_map(|run| run.last()).map(|last| last.evaluations).sum(),
        q1: column(1),
        median: column(2),
        q3: column(3),
        top: column(4),
        species: means(&curve(|generation| generation.species)),
        links: means(&curve(|generation| generation.links_mean)),
        latest: runs.iter().map(|run| run.last().map(|last| rounded(last.best_ever, 3))).collect(),
        marks,
        best,
    }
}

/// Generations from 1 that are shown of so many: every `stride`-th, and the last.
fn marks(longest: usize, stride: usize) -> Vec<usize> {
    let mut marks: Vec<usize> = (1..=longest).step_by(stride).collect();
    if longest > 0 && marks.last() != Some(&longest) {
        marks.push(longest);
    }
    marks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_cover_the_generations_that_a_run_has() {
        let generation = |best_ever, evaluations| ShownGeneration {
            best_ever,
            species: 2.0,
            links_mean: 3.5,
            evaluations,
        };
        let [long, short] = [[generation(1.0, 50), generation(4.0, 100)], [generation(2.0, 50); 2]];
        let answer = curves(&[&long, &short[..1]]);
        assert_eq!(answer.marks, [1, 2]);
        assert_eq!((answer.top, answer.median), (vec![2.0, 4.0], vec![1.5, 4.0]));
        assert_eq!((answer.done, answer.evaluations), (3, 150));
        assert_eq!(answer.latest, [Some(4.0), Some(2.0)]);
        assert!(curves(&[&[]]).marks.is_empty());
        assert_eq!(marks(10, 4), [1, 5, 9, 10]);
    }
}
