//! The paper's figures, and the table of fitness, from runs, tracks and evolutions.

use std::path::Path;

use rayon::prelude::*;
use tropism::task::Task;
use tropism::track::Track;
use tropism_report::{self as report, Composite, Figure, LitStem, Plants, Table};

use crate::Error;
use crate::evolve::EvolutionHistory;
use crate::finished_run::FinishedRun;
use crate::track::stem_at;

/// Figures 2 to 5 of open-loop runs; none without a run.
pub(crate) fn of_open_loop_runs(runs: &[FinishedRun]) -> Result<Vec<Figure>, Error> {
    let Some(first) = runs.first() else { return Ok(Vec::new()) };
    let plants = first.plants();
    let composites: Vec<Composite> = runs.par_iter().map(FinishedRun::composite).collect::<Result<_, _>>()?;
    let tracks: Vec<Track> = runs.iter().map(|run| run.track.clone()).collect();
    let mut figures = vec![report::composite(&composites, plants)];
    figures.extend(of_tips(&tracks, plants));
    Ok(figures)
}

/// Figures 3 to 5, and 9 if a track has stems, of tracks of photographs; none without a track.
pub(crate) fn of_tracks(tracks: &[Track], plants: Plants) -> Vec<Figure> {
    if tracks.is_empty() {
        return Vec::new();
    }
    let mut figures = of_tips(tracks, plants);
    let mut stems = tracks.iter().map(|track| (stems_of_track(track), &track.layout));
    let stems = stems.find(|(stems, _)| !stems.is_empty());
    figures.extend(stems.map(|(stems, layout)| report::stems(&stems, layout, plants)));
    figures
}

/// Figures 3 to 5: speed, trajectories, directions and shifts of the tips.
fn of_tips(tracks: &[Track], plants: Plants) -> Vec<Figure> {
    let mut figures = vec![
        report::speed(tracks, plants),
        report::trajectories(tracks, plants),
        report::directions(tracks, plants),
    ];
    figures.extend(report::shift_maps(tracks, plants));
    figures
}

/// Figures 6a and 6b: fitness over the generations of all runs, and of a typical successful one.
pub(crate) fn of_evolution(history: &EvolutionHistory, plants: Plants) -> Vec<Figure> {
    let mut figures = vec![report::fitness_boxes(&history.best, plants)];
    if let Some(run) = history.typical_run() {
        figures.push(report::fitness_run(run, &history.best[run], &history.mean[run], plants));
    }
    figures
}

/// Figure 8: the track of a steered plant between its targets.
pub(crate) fn of_steered_run(run: &FinishedRun) -> Figure {
    let title = format!("Steered by {}", run.config.controller_description());
    report::steering("8", &title, &run.track, run.config.task.targets(), run.fitness(), run.plants())
}

/// Figure 9: the stems of the first run in whose photographs stems are detected.
pub(crate) fn of_stems(runs: &[FinishedRun]) -> Result<Option<Figure>, Error> {
    for run in runs {
        let stems = run.stems()?;
        if !stems.is_empty() {
            return Ok(Some(report::stems(&stems, &run.track.layout, run.plants())));
        }
    }
    Ok(None)
}

/// Largest number of stems of a track in Figure 9; chosen: some 150 bytes each.
const MAX_STEMS: usize = 4000;

/// The stems in the columns of a track, each with the light that followed; of a long track at equal distances.
fn stems_of_track(track: &Track) -> Vec<LitStem> {
    let Some(bases) = track.numbers("stem_1_x_cm") else { return Vec::new() };
    let rows: Vec<usize> = (0..bases.len()).filter(|&row| bases[row].is_finite()).collect();
    let stride = rows.len().div_ceil(MAX_STEMS).max(1);
    let drawn = rows.into_iter().step_by(stride);
    drawn.filter_map(|row| Some((stem_at(track, row)?, track.samples[row].light))).collect()
}

/// The fitness of steered runs, and the distance of their tips to each target.
pub(crate) fn fitness_table(runs: &[FinishedRun]) -> Table {
    let row = |run: &FinishedRun| {
        let targets = run.config.task.as_targets();
        let distances: Vec<String> = targets
            .map_or_else(Vec::new, |task| task.crossings(&run.track))
            .iter()
            .map(|crossing| {
                crossing.map_or("-".to_owned(), |crossing| format!("{:.1}", crossing.distance_cm))
            })
            .collect();
        vec![
            short_name(&run.path),
            run.config.controller_description(),
            format!("{:.2}", run.fitness()),
            (run.track.samples.len() - 1).to_string(),
            distances.join(", "),
        ]
    };
    let head = ["Run", "Controller", "Fitness (cm)", "Steps", "Distance to each target at its height (cm)"];
    Table {
        title: "Steered experiments".to_owned(),
        caption: "Fitness after eq. (9). Tips are as the controller saw them in photographs.".to_owned(),
        head: head.map(str::to_owned).to_vec(),
        rows: runs.iter().map(row).collect(),
    }
}

/// The last two parts of a path: `champion/1`.
fn short_name(path: &Path) -> String {
    let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
    parts[parts.len().saturating_sub(2)..].join("/")
}
