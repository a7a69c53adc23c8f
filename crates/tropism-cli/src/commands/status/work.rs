//! What a long work does now, as text.

use std::path::Path;

use tropism_lab::files::shell_word;
use tropism_lab::units;
use tropism_lab::work::{PartStatus, WorkStatus};

pub(super) fn text(status: &WorkStatus) -> String {
    let WorkStatus { work, folder, is_over, is_virtual, process, is_shared, parts, saved_ago_s } = status;
    let virtual_plants = if *is_virtual == Some(true) { ", virtual plants or a model of them" } else { "" };
    let mut text = format!("{}{virtual_plants}\n", headline(folder, status));
    let (done, total, unit) = status.progress();
    if parts.len() > 1 {
        let best = best_of(status.best(), parts.first().and_then(|part| part.best_unit));
        let percent = 100.0 * done as f64 / total as f64;
        text += &format!("{unit:<14} {done} of {total} ({percent:.0} %){best}\n");
    }
    let width = parts.iter().map(|part| part.name.chars().count()).max().unwrap_or(0);
    for PartStatus { name, done, total, unit, best, best_unit, seconds } in parts {
        let best = best_of(*best, *best_unit);
        let spent = seconds.map_or_else(String::new, |seconds| format!(", {}", units::time(seconds)));
        text += &format!("  {name:<width$}  {done} of {total} {unit}{best}{spent}\n");
    }
    if *is_over {
        text += result(work, folder).map(|file| format!("results: {file}")).as_deref().unwrap_or("");
        return text.trim_end().to_owned();
    }
    if let Some(age) = saved_ago_s {
        text += &format!("saved {} ago\n", units::time(*age));
    }
    if process.is_none() && !is_shared {
        let command = if matches!(*work, "replicates" | "wall_study") { "study" } else { work };
        let free = if *work == "tune" { ", if no program works on it" } else { "" };
        text += &format!("next{free}: tropism {command} --out {} --resume", shell_word(folder));
    }
    text.trim_end().to_owned()
}

fn best_of(best: Option<f64>, unit: Option<&str>) -> String {
    best.map_or_else(String::new, |best| format!(", best {best:.2} {}", unit.unwrap_or("cm")))
}

/// What somebody opens when the work is over.
fn result(work: &str, folder: &Path) -> Option<String> {
    let file = match work {
        "study" | "transfer" => "report.html",
        "sweep" => "sweep.csv",
        "evolve" | "baseline" => "champion.json",
        "replicates" => "replicates.json",
        "wall_study" => "walls.json",
        "forecast" => "forecast.json",
        "calibrate" => "bean.toml",
        _ => return None,
    };
    Some(folder.join(file).display().to_string())
}

fn headline(folder: &Path, status: &WorkStatus) -> String {
    let folder = folder.display();
    match status.process {
        Some(process) => format!("{folder}: goes on (process {process})"),
        None if status.is_shared => format!("{folder}: programs work on units of it"),
        None if status.is_over => format!("{folder}: over"),
        None if status.work == "tune" => format!("{folder}: not finished"),
        None => format!("{folder}: not finished, and no program works on it"),
    }
}
