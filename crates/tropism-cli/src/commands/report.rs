//! `tropism report`: figures and tables of what lies in folders.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use clap::Args;
use serde::Serialize;
use tropism_lab::{FinishedRun, files};
use tropism_report::{Page, Plants, Table};

use super::evolve::EvolutionPlan;
use super::fit::is_of_virtual_plant;
use super::study;
use crate::findings::{self, History};
use crate::shell::Shell;

/// Make a report of runs, tracks, evolutions or a study: one HTML file
///
/// Open-loop runs give Figures 2 to 5 and 9, tracks of `tropism track` Figures 3 to 5 and 9, evolutions Figure 6, steered
/// runs Figure 8; a study gives all of them.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  tropism report tropism-study --out report.html\n  tropism report tent/* --out report.html\n  tropism report track.csv --out report.html"
)]
pub(crate) struct Report {
    /// Folders of runs, evolutions or a study, and tracks of photographs
    #[arg(required = true, value_name = "DIR|TRACK.csv")]
    folders: Vec<PathBuf>,

    /// Where the report goes
    #[arg(long, value_name = "report.html")]
    out: PathBuf,

    /// Folder for the figures as files of their own (SVG and JPEG)
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
}

#[derive(Serialize)]
struct Outcome {
    report: PathBuf,
    figures: Vec<String>,
}

impl Report {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let page = match self.folders.as_slice() {
            [study] if study.join("study.toml").exists() => study::page(study)?,
            folders => page(folders)?,
        };
        files::write(&self.out, page.html().as_bytes())?;
        if let Some(folder) = &self.figures {
            files::make_folder(folder)?;
            for (name, bytes) in page.figures.iter().flat_map(tropism_report::Figure::files) {
                files::write(&folder.join(name), &bytes)?;
            }
        }
        let figures: Vec<String> = page.figures.iter().map(|figure| figure.number.to_owned()).collect();
        let text = format!("figures {}\nwrote {}", figures.join(", "), self.out.display());
        shell.result(&text, &Outcome { report: self.out, figures })
    }
}

fn page(folders: &[PathBuf]) -> Result<Page> {
    let (mut open_loop, mut steered, mut figures) = (Vec::new(), Vec::new(), Vec::new());
    let (mut tracks, mut is_virtual) = (Vec::new(), false);
    for folder in folders {
        if folder.is_file() {
            let track = files::read_track(folder)?;
            is_virtual |= is_of_virtual_plant(folder, &track);
            tracks.push(track);
        } else if folder.join("run.toml").exists() {
            let run = FinishedRun::read(folder)?;
            if run.config.task.targets.is_empty() { open_loop.push(run) } else { steered.push(run) }
        } else if folder.join("history.csv").exists() {
            let history = History::read(&folder.join("history.csv"))?;
            let plan: EvolutionPlan = files::read_toml(&folder.join("evolution.toml"))?;
            let plants = if plan.is_virtual { Plants::ModelOfVirtual } else { Plants::ModelOfReal };
            is_virtual |= plan.is_virtual;
            figures.extend(findings::evolution_figures(&history, plants));
        } else {
            bail!(
                "{}: found no run.toml, history.csv or study.toml, wanted the folder of a finished run, evolution or study",
                folder.display()
            );
        }
    }
    is_virtual |= open_loop.iter().chain(&steered).any(|run| run.config.is_virtual());
    let mut all = findings::open_loop_figures(&open_loop)?;
    all.extend(figures);
    all.extend(steered.iter().map(findings::steered_figure));
    all.extend(findings::stem_figure(&open_loop)?);
    let plants = if is_virtual { Plants::Virtual } else { Plants::Real };
    all.extend(findings::track_figures(&tracks, plants));
    Ok(Page {
        title: "Experiments".to_owned(),
        intro: format!(
            "{} open-loop and {} steered experiments{}.",
            open_loop.len(),
            steered.len(),
            if tracks.is_empty() {
                String::new()
            } else {
                format!(", {} tracks of photographs", tracks.len())
            }
        ),
        plants,
        numbers: Vec::new(),
        tables: if steered.is_empty() { Vec::new() } else { vec![scores(&steered)] },
        figures: all,
        command: format!("tropism report {}", names(folders)),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seeds: open_loop
            .iter()
            .chain(&steered)
            .map(|run| (run.path.display().to_string(), run.config.seed))
            .collect(),
        stages: Vec::new(),
        config: String::new(),
    })
}

fn names(folders: &[PathBuf]) -> String {
    folders.iter().map(|folder| folder.display().to_string()).collect::<Vec<_>>().join(" ")
}

/// Fitness of steered runs, and how near they came to their targets.
pub(crate) fn scores(runs: &[FinishedRun]) -> Table {
    let row = |run: &FinishedRun| {
        let task = &run.config.task;
        let crossings = task.crossings(&run.track);
        let distances: Vec<String> = crossings
            .iter()
            .map(|crossing| {
                crossing.map_or("-".to_owned(), |crossing| format!("{:.1}", crossing.distance_cm))
            })
            .collect();
        vec![
            name_of(&run.path),
            run.config.controller_description(),
            format!("{:.2}", task.fitness(&run.track)),
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

fn name_of(path: &Path) -> String {
    let last: Vec<_> = path.iter().rev().take(2).map(|part| part.to_string_lossy().into_owned()).collect();
    last.into_iter().rev().collect::<Vec<_>>().join("/")
}
