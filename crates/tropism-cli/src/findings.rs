//! What lies in the folders of runs, evolutions and studies, and the report made of it.

use std::path::Path;

use anyhow::Result;
use rayon::prelude::*;
use serde::Deserialize;
use tropism::track::Track;
use tropism_lab::track::stem_at;
use tropism_lab::{FinishedRun, files};
use tropism_report::{self as report, Composite, Figure, LitStem, Plants};

/// The history of an evolution, a list a run.
pub(crate) struct History {
    /// Best fitness of each generation.
    pub(crate) best: Vec<Vec<f64>>,
    /// Mean fitness of each generation.
    pub(crate) mean: Vec<Vec<f64>>,
    /// Best fitness so far.
    pub(crate) best_ever: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
struct Row {
    run: usize,
    best: f64,
    mean: f64,
    best_ever: f64,
}

impl History {
    /// Reads `history.csv` of an evolution.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let mut history = Self { best: Vec::new(), mean: Vec::new(), best_ever: Vec::new() };
        let bytes = files::read(path)?;
        for row in csv::Reader::from_reader(bytes.as_slice()).deserialize() {
            let Row { run, best, mean, best_ever } =
                row.map_err(|error| anyhow::anyhow!("{}: {error}", path.display()))?;
            for (list, value) in
                [(&mut history.best, best), (&mut history.mean, mean), (&mut history.best_ever, best_ever)]
            {
                if list.len() <= run && run < 100_000 {
                    list.resize(run + 1, Vec::new());
                }
                if let Some(list) = list.get_mut(run) {
                    list.push(value);
                }
            }
        }
        Ok(history)
    }

    /// Generation, from 1, at which the median of the best fitness so far first comes within `share` of its last value.
    pub(crate) fn saturation(&self, share: f64) -> Option<usize> {
        let generations = self.best_ever.iter().map(Vec::len).min()?;
        let median = |generation: usize| {
            let mut best: Vec<f64> = self.best_ever.iter().map(|run| run[generation]).collect();
            best.sort_by(f64::total_cmp);
            0.5 * (best[(best.len() - 1) / 2] + best[best.len() / 2])
        };
        let last = median(generations.checked_sub(1)?);
        (0..generations)
            .find(|&generation| median(generation) >= share * last)
            .map(|generation| generation + 1)
    }
}

/// Figure 9: the stems of the first run in which any were detected.
pub(crate) fn stem_figure(runs: &[FinishedRun]) -> Result<Option<Figure>> {
    for run in runs {
        let stems = run.stems()?;
        if !stems.is_empty() {
            return Ok(Some(report::stems(&stems, run.plants())));
        }
    }
    Ok(None)
}

/// The stems of a track that `tropism track` made, from its columns; none in another.
fn stems_of(track: &Track) -> Vec<LitStem> {
    let rows = track.samples.iter().enumerate();
    rows.filter_map(|(row, sample)| Some((stem_at(track, row)?, sample.light))).collect()
}

/// Figures 3 to 5 and 9: what tracks of photographs show.
pub(crate) fn track_figures(tracks: &[Track], plants: Plants) -> Vec<Figure> {
    if tracks.is_empty() {
        return Vec::new();
    }
    let mut figures = vec![
        report::speed(tracks, plants),
        report::trajectories(tracks, plants),
        report::directions(tracks, plants),
    ];
    figures.extend(report::shift_maps(tracks, plants));
    let stems = tracks.iter().map(stems_of).find(|stems| !stems.is_empty());
    figures.extend(stems.map(|stems| report::stems(&stems, plants)));
    figures
}

/// The photographs of a run, laid over each other.
fn composite(run: &FinishedRun) -> Result<Composite> {
    Ok(run.photographs()?.map(|(_, image)| image).collect())
}

/// Figures 2 to 5: what open-loop experiments show.
pub(crate) fn open_loop_figures(runs: &[FinishedRun]) -> Result<Vec<Figure>> {
    let Some(first) = runs.first() else { return Ok(Vec::new()) };
    let plants = first.plants();
    let composites = runs.par_iter().map(composite).collect::<Result<Vec<_>>>()?;
    let tracks: Vec<Track> = runs.iter().map(|run| run.track.clone()).collect();
    let mut figures = vec![
        report::composite(&composites, plants),
        report::speed(&tracks, plants),
        report::trajectories(&tracks, plants),
        report::directions(&tracks, plants),
    ];
    figures.extend(report::shift_maps(&tracks, plants));
    Ok(figures)
}

/// Figures 6a and 6b: how fitness rose.
pub(crate) fn evolution_figures(history: &History, plants: Plants) -> Vec<Figure> {
    let mut figures = vec![report::fitness_boxes(&history.best, plants)];
    if let (Some(best), Some(mean)) = (history.best.first(), history.mean.first()) {
        figures.push(report::fitness_run(best, mean, plants));
    }
    figures
}

/// Figure 8: a steered plant.
pub(crate) fn steered_figure(run: &FinishedRun) -> Figure {
    let task = &run.config.task;
    let title = format!("Steered by {}", run.config.controller_description());
    report::steering("8", &title, &run.track, &task.targets, task.fitness(&run.track), run.plants())
}
