//! The report of a study that is still at work: what its finished stages have found so far.

use tropism::track::Track;
use tropism_report::{Page, Plants};

use super::results::read_seconds;
use super::{STAGES, StudyPlan};
use crate::evolve::EvolutionHistory;
use crate::figures::Figures;
use crate::finished_run::FinishedRun;
use crate::{Error, files};

/// Number of finished stages from which on there are tracks.
const TRACKED: usize = 1;

/// Number of finished stages from which on there is an evolution.
const EVOLVED: usize = 3;

/// Seconds after which a browser reads an unfinished report again. Chosen: short beside a stage.
const REFRESH_S: u32 = 10;

/// Writes the report of a study of which the first `done` stages are finished. The report of the last stage replaces it.
///
/// # Errors
/// [`Error::File`] if what a finished stage wrote cannot be read, or the report not be written.
pub(super) fn write(plan: &StudyPlan, done: usize) -> Result<(), Error> {
    let config = &plan.config;
    let mut figures = Figures::default();
    if done >= TRACKED {
        let runs = FinishedRun::read_numbered(&plan.out.join("open-loop"))?;
        figures.add_setup(runs.first());
        let tracks: Vec<Track> = runs.into_iter().map(|run| run.track).collect();
        figures.add_tracks(&tracks, Plants::Virtual);
    }
    if done >= EVOLVED {
        let history = EvolutionHistory::read(&plan.out.join("evolution/history.csv"))?;
        figures.add_evolution(&history, config.task.kind.unit(), Plants::ModelOfVirtual);
    }
    let seconds = read_seconds(&plan.out);
    let page = Page {
        title: "A study at work".to_owned(),
        intro: format!(
            "Finished: {done} of {} stages. Now: {}. This page is read again every {REFRESH_S} seconds.\n\nThe photographs of the \
             first bean are in open-loop/1/photographs, beside this file.",
            STAGES.len(),
            STAGES[done]
        ),
        plants: Plants::Virtual,
        numbers: Vec::new(),
        tables: Vec::new(),
        figures: figures.drawn,
        left_out: Vec::new(),
        command: format!("tropism study {}/study.toml", plan.out.display()),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seeds: vec![("study".to_owned(), config.seed)],
        stages: STAGES.iter().filter_map(|&name| Some((name.to_owned(), *seconds.get(name)?))).collect(),
        config: files::toml_of(&plan.out.join("study.toml"), config)?,
    };
    Ok(files::write(&plan.out.join("report.html"), page.growing_html(REFRESH_S).as_bytes())?)
}
