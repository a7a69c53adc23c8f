//! What an evolution, a study or other long work does now, as text.

use std::path::Path;

use tropism_lab::evolve::EvolutionStatus;
use tropism_lab::files::shell_word;
use tropism_lab::replicates::{ReplicatesStatus, ScenarioStatus};
use tropism_lab::study::{StageStatus, StudyStatus};
use tropism_lab::sweep::SweepStatus;
use tropism_lab::transfer::{SteeredPlants, TransferStatus};
use tropism_lab::tune::TuneStatus;
use tropism_lab::units::{self, plural};

pub(super) fn evolution_text(status: &EvolutionStatus) -> String {
    let EvolutionStatus { evolution, is_over, is_virtual, process, .. } = status;
    let kind = if *is_virtual { "on a model of virtual plants" } else { "on a model of plants" };
    let mut text = format!("{}, {kind}\n", headline(evolution, *is_over, *process));
    text += &progress(status);
    for (index, run) in status.runs.iter().enumerate() {
        let best =
            run.best_fitness.map_or_else(|| "-".to_owned(), |best| format!("{best:.2} {}", status.unit));
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
    let best = best.map_or_else(String::new, |best| format!(", best {best:.2} {}", status.unit));
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

pub(super) fn sweep_text(status: &SweepStatus) -> String {
    let SweepStatus { sweep, is_over, process, settings, seeds, done, total, begun, .. } = status;
    let mut text = format!("{}\n", headline(sweep, *is_over, *process));
    text += &format!(
        "units        {done} of {total} ({} with {})\n",
        plural(*settings, "setting"),
        plural(*seeds, "seed")
    );
    if let Some((generations, all)) = status.generations_done.zip(status.generations) {
        let percent = 100.0 * generations as f64 / all.max(1) as f64;
        text += &format!("generations  {generations} of {all} ({percent:.0} %)\n");
    }
    if !begun.is_empty() {
        text += &format!("begun        {}\n", begun.join(", "));
    }
    if *is_over {
        text += &format!("table: {}", sweep.join("sweep.csv").display());
    } else if process.is_none() {
        text += &format!("next: tropism sweep --out {} --resume", shell_word(sweep));
    }
    text.trim_end().to_owned()
}

pub(super) fn transfer_text(status: &TransferStatus) -> String {
    let TransferStatus { transfer, is_over, process, plants, controllers, optima } = status;
    let mut text = format!("{}, virtual plants\n", headline(transfer, *is_over, *process));
    text += &steered(status);
    for SteeredPlants { name, plants: done } in controllers {
        text += &format!("{name:<12} {done} of {}\n", plural(*plants, "plant"));
    }
    if let Some(done) = optima {
        text += &format!("schedules    {done} of {}\n", plural(*plants, "plant"));
    }
    if *is_over {
        text += &format!("report: {}", transfer.join("report.html").display());
    } else if process.is_none() {
        text += &format!("next: tropism transfer --out {} --resume", shell_word(transfer));
    }
    text.trim_end().to_owned()
}

/// One line: how far all controllers are.
fn steered(status: &TransferStatus) -> String {
    let percent = 100.0 * status.done() as f64 / status.total().max(1) as f64;
    format!("steered      {} of {} ({percent:.0} %)\n", status.done(), plural(status.total(), "plant"))
}

pub(super) fn replicates_text(status: &ReplicatesStatus) -> String {
    let ReplicatesStatus { replicates, is_over, process, scenarios } = status;
    let mut text = format!("{}, virtual plants\n", headline(replicates, *is_over, *process));
    for ScenarioStatus { scenario, controllers_of, has_reference, controllers_done, controllers, judged } in
        scenarios
    {
        let reference = match has_reference {
            None => "",
            Some(true) => "reference found, ",
            Some(false) => "reference not found yet, ",
        };
        let judged = judged.as_ref().map_or_else(String::new, |judged| {
            format!(", judged on {} of {}", judged.done(), plural(judged.total(), "plant"))
        });
        let made = match controllers_of {
            Some(other) => format!("controllers of {other}"),
            None => format!("{controllers_done} of {} made", plural(*controllers, "controller")),
        };
        text += &format!("{scenario:<16} {reference}{made}{judged}\n");
    }
    if *is_over {
        text += &format!("results: {}", replicates.join("replicates.json").display());
    } else if process.is_none() {
        text += &format!("next: tropism study --out {} --resume", shell_word(replicates));
    }
    text.trim_end().to_owned()
}

pub(super) fn tune_text(status: &TuneStatus) -> String {
    let TuneStatus { rule, generation, generations, unit, best_fitness, saved_ago_s, .. } = status;
    let name = rule.display();
    let Some((done, all)) = generation.zip(*generations) else { return format!("{name}: over") };
    let best = best_fitness.map_or_else(String::new, |best| format!(", best {best:.2} {unit} in the latest"));
    let ago = saved_ago_s.map_or_else(String::new, |ago| format!("saved        {} ago\n", units::time(ago)));
    format!(
        "{name}: not finished\ngenerations  {done} of {all}{best}\n{ago}next, if no program works on it: tropism tune --out {} \
         --resume",
        shell_word(rule)
    )
}

fn headline(folder: &Path, is_over: bool, process: Option<u32>) -> String {
    let folder = folder.display();
    match process {
        Some(process) => format!("{folder}: goes on (process {process})"),
        None if is_over => format!("{folder}: over"),
        None => format!("{folder}: not finished, and no program works on it"),
    }
}
