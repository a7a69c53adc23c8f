//! Compare: evolutions, studies, runs or sweeps on one axis, by the report of the library.

use std::path::{Path, PathBuf};

use serde::Serialize;
use tropism::track::Track;
use tropism_lab::report::{ReportComparison, ReportPlan, ReportResults};
use tropism_lab::{RunConfig, Silent, Workflow, files};
use tropism_report::{Figure, LeftOut, Plants};

use crate::error::Refusal;
use crate::{Studio, found, jobs};

/// Things that are compared at once, at most.
const MOST: usize = 12;

/// Figures that are shown on the page, at most.
const FIGURES: usize = 12;

/// Where the figures of a comparison of `at` lie.
fn folder_of(studio: &Studio, at: &[String]) -> PathBuf {
    let name = files::sha256(at.join("\n").as_bytes());
    studio.scratch.join(format!("compare-{}", &name[..24]))
}

/// A comparison as the page shows it.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Compared {
    comparisons: Vec<ReportComparison>,
    /// Figures for which there are no data.
    left_out: Vec<LeftOut>,
    figures: Vec<ComparedFigure>,
    /// Names of all files of figures.
    files: Vec<String>,
    /// The command that does the same.
    command: String,
}

/// A figure of a comparison.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct ComparedFigure {
    /// The name of its files, without their endings.
    name: String,
    title: String,
}

/// Compares what lies `at` below the folder of the studio.
pub(crate) fn compare(studio: &Studio, at: &[String]) -> Result<Compared, Refusal> {
    if at.is_empty() || at.len() > MOST {
        return Err(Refusal::bad(format!("found {} folders, wanted 1 to {MOST}", at.len())));
    }
    let sources = at.iter().map(|at| found::resolve(&studio.root, at)).collect::<Result<Vec<_>, _>>()?;
    let folder = folder_of(studio, at);
    let plan = ReportPlan { sources, out: folder.join("report.html"), figures: Some(folder.join("figures")) };
    let _ = std::fs::remove_dir_all(&folder);
    files::make_folder(&folder)?;
    let ReportResults { comparisons, left_out, mut titles, .. } = plan.execute(&Silent)?;
    if let Some(paths) = paths(at, &plan.sources) {
        titles.push((paths.number.to_owned(), paths.title.clone()));
        for (name, bytes) in paths.files() {
            files::write(&folder.join("figures").join(name), &bytes)?;
        }
    }
    let names = names_in(&folder.join("figures"));
    let mut figures: Vec<ComparedFigure> = Vec::new();
    for (number, title) in &titles {
        let own = |name: &&String| {
            let (base, ending) = name.rsplit_once('.').unwrap_or((name.as_str(), ""));
            let rest = base.strip_prefix("figure-").and_then(|base| base.strip_prefix(number.as_str()));
            // Pictures of one figure are numbered.
            let is_part = |rest: &str| rest.strip_prefix('-').is_some_and(|part| part.parse::<u32>().is_ok());
            match ending {
                "svg" => rest == Some(""),
                "jpg" => rest.is_some_and(|rest| rest.is_empty() || is_part(rest)),
                _ => false,
            }
        };
        let base = |name: &String| name.rsplit_once('.').map_or(&**name, |(base, _)| base).to_owned();
        let figure = |name| ComparedFigure { name: base(name), title: title.clone() };
        figures.extend(names.iter().filter(own).map(figure));
    }
    // What compares comes before what each has alone; the set-up is the same for all, and comes last.
    if at.len() > 1 {
        figures.sort_by_key(|figure| rank(&figure.name));
    }
    figures.truncate(FIGURES);
    let mut words: Vec<String> = vec!["report".to_owned()];
    words.extend(at.iter().map(|at| if at.is_empty() { ".".to_owned() } else { at.clone() }));
    words.extend(["--out", "compare.html", "--figures", "figures"].map(str::to_owned));
    Ok(Compared { comparisons, left_out, figures, files: names, command: jobs::line(&words) })
}

/// The place of a figure among those of a comparison. Those of the paper have numbers, the set-up the first.
fn rank(name: &str) -> u8 {
    let number = name.strip_prefix("figure-").unwrap_or(name);
    match number {
        PATHS => 0,
        "1a" | "1b" => 3,
        _ if number.starts_with(|digit: char| digit.is_ascii_digit()) => 2,
        _ => 1,
    }
}

/// The figure of all paths.
const PATHS: &str = "paths";

/// The paths of the tips of all runs among `sources`, which lie `at`, in one figure; `None` unless there are several, all
/// virtual or all real.
fn paths(at: &[String], sources: &[PathBuf]) -> Option<Figure> {
    let runs = at.iter().zip(sources).filter_map(|(at, folder)| {
        let is_virtual = RunConfig::follow(folder).ok()?.is_virtual();
        Some((at, is_virtual, files::read_track(&folder.join("track.csv")).ok()?))
    });
    let runs: Vec<_> = runs.collect();
    let (_, is_virtual, _) = runs.first()?;
    if runs.len() < 2 || runs.iter().any(|(_, other, _)| other != is_virtual) {
        return None;
    }
    let plants = if *is_virtual { Plants::Virtual } else { Plants::Real };
    let names: Vec<String> = (1..).zip(&runs).map(|(number, (at, ..))| format!("{number} {at}")).collect();
    let tracks: Vec<Track> = runs.into_iter().map(|(.., track)| track).collect();
    let title = format!("Paths of the tips: {}", names.join(", "));
    Some(Figure { number: PATHS, title, ..tropism_report::trajectories(&tracks, plants) })
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort_unstable();
    names
}

/// A file of the comparison of `at`: its bytes and their type.
pub(crate) fn file(studio: &Studio, at: &[String], name: &str) -> Result<(Vec<u8>, &'static str), Refusal> {
    let missing = || Refusal::missing(format!("found no figure {name:?}"));
    let path = if name == "report.html" {
        folder_of(studio, at).join(name)
    } else {
        let folder = folder_of(studio, at).join("figures");
        if !names_in(&folder).iter().any(|found| found == name) {
            return Err(missing());
        }
        folder.join(name)
    };
    let kind = match name.rsplit_once('.').map(|(_, ending)| ending) {
        Some("svg") => "image/svg+xml",
        Some("png") => "image/png",
        Some("jpg") => "image/jpeg",
        Some("pdf") => "application/pdf",
        Some("csv") => "text/csv; charset=utf-8",
        _ => return Err(missing()),
    };
    Ok((files::read(&path)?, kind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_compares_comes_first_and_the_set_up_last() {
        let mut names =
            ["figure-1a", "figure-1b", "figure-8", "figure-comparison", "figure-10", "figure-paths"];
        names.sort_by_key(|name| rank(name));
        assert_eq!(
            names,
            ["figure-paths", "figure-comparison", "figure-8", "figure-10", "figure-1a", "figure-1b"]
        );
    }
}
