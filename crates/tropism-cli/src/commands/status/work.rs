//! What an evolution or a study does now, as text.

use std::path::Path;

use tropism_lab::evolve::EvolutionStatus;
use tropism_lab::files::shell_word;
use tropism_lab::study::{StageStatus, StudyStatus};
use tropism_lab::units::{self, plural};

pub(super) fn evolution_text(status: &EvolutionStatus) -> String {
    let EvolutionStatus { evolution, is_over, is_virtual, process, .. } = status;
    let kind = if *is_virtual { "on a model of virtual plants" } else { "on a model of plants" };
    let mut text = format!("{}, {kind}\n", headline(evolution, *is_over, *process));
    text += &progress(status);
    for (index, run) in status.runs.iter().enumerate() {
        let best = run.best_fitness.map_or_else(|| "-".to_owned(), |best| format!("{best:.2} cm"));
        text +=
            &format!("run {index:<8} generation {} of {}, best {best}\n", run.generation, status.generations);
    }
    if let Some(age) = status.saved_ago_s.filter(|_| !is_over) {
        text += &format!("saved        {} ago\n", units::time(age));
    }
    if !is_over && process.is_none() {
        text += &format!("next: tropism evolve --out {} --resume", shell_word(evolution));
    }
    text.trim_end().to_owned()
}

/// One line: how far all runs are, and the best of them.
fn progress(status: &EvolutionStatus) -> String {
    let total = u64::from(status.generations) * status.runs.len() as u64;
    let best = status.runs.iter().filter_map(|run| run.best_fitness).reduce(f64::max);
    let best = best.map_or_else(String::new, |best| format!(", best {best:.2} cm"));
    let percent = 100.0 * status.generations_done() as f64 / total.max(1) as f64;
    let runs = plural(status.runs.len(), "run");
    format!("generations  {} of {total} ({percent:.0} %) in {runs}{best}\n", status.generations_done())
}

pub(super) fn study_text(status: &StudyStatus) -> String {
    let StudyStatus { study, is_over, process, stages, evolution } = status;
    let mut text = format!("{}, virtual plants\n", headline(study, *is_over, *process));
    for (number, StageStatus { name, done, total, unit, seconds }) in (1..).zip(stages) {
        let spent = seconds.map_or_else(String::new, |seconds| format!(", {}", units::time(seconds)));
        text += &format!("{number}/{} {name:<22} {done} of {total} {unit}{spent}\n", stages.len());
    }
    if let Some(evolution) = evolution.as_ref().filter(|evolution| !evolution.is_over) {
        text += &progress(evolution);
    }
    if *is_over {
        text += &format!("report: {}", study.join("report.html").display());
    } else if process.is_none() {
        text += &format!("next: tropism study --out {} --resume", shell_word(study));
    }
    text.trim_end().to_owned()
}

fn headline(folder: &Path, is_over: bool, process: Option<u32>) -> String {
    let folder = folder.display();
    match process {
        Some(process) => format!("{folder}: goes on (process {process})"),
        None if is_over => format!("{folder}: over"),
        None => format!("{folder}: not finished, and no program works on it"),
    }
}
