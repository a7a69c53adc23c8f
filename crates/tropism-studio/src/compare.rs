//! Compare: evolutions, studies, runs or sweeps on one axis, by the report of the library.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use tropism_lab::report::{ReportPlan, ReportResults};
use tropism_lab::{Silent, Workflow, files};

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

/// Compares what lies `at` below the folder of the studio.
pub(crate) fn compare(studio: &Studio, at: &[String]) -> Result<Value, Refusal> {
    if at.is_empty() || at.len() > MOST {
        return Err(Refusal::bad(format!("found {} folders, wanted 1 to {MOST}", at.len())));
    }
    let sources = at.iter().map(|at| found::resolve(&studio.root, at)).collect::<Result<Vec<_>, _>>()?;
    let folder = folder_of(studio, at);
    let plan = ReportPlan { sources, out: folder.join("report.html"), figures: Some(folder.join("figures")) };
    let _ = std::fs::remove_dir_all(&folder);
    files::make_folder(&folder)?;
    let ReportResults { comparisons, left_out, titles, .. } = plan.execute(&Silent)?;
    let names = names_in(&folder.join("figures"));
    let mut figures: Vec<Value> = Vec::new();
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
        figures.extend(names.iter().filter(own).map(
            |name| json!({ "name": name.rsplit_once('.').map_or(&**name, |(base, _)| base), "title": title }),
        ));
    }
    // Those of the paper have numbers. What compares comes before what each has alone.
    let is_alone = |figure: &Value| {
        figure["name"].as_str().is_some_and(|name| {
            name.strip_prefix("figure-")
                .is_some_and(|number| number.starts_with(|digit: char| digit.is_ascii_digit()))
        })
    };
    if !comparisons.is_empty() {
        figures.sort_by_key(is_alone);
    }
    figures.truncate(FIGURES);
    let mut words: Vec<String> = vec!["report".to_owned()];
    words.extend(at.iter().map(|at| if at.is_empty() { ".".to_owned() } else { at.clone() }));
    words.extend(["--out", "compare.html", "--figures", "figures"].map(str::to_owned));
    Ok(json!({
        "comparisons": comparisons, "left_out": left_out, "figures": figures, "files": names_in(&folder.join("figures")),
        "command": jobs::line(&words),
    }))
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
