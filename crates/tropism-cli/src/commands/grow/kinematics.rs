//! `tropism grow --kinematics DIR`: how the typical plant answers the experiments of plant physiology.

use std::path::{Path, PathBuf};

use anyhow::Result;
use serde::Serialize;
use tropism::greenhouse::bean::Species;
use tropism_lab::files;
use tropism_report as report;

use crate::shell::Shell;

#[derive(Serialize)]
struct Measured {
    quantity: String,
    value: f64,
    published: &'static str,
}

#[derive(Serialize)]
struct Outcome {
    is_virtual: bool,
    figures: Vec<PathBuf>,
    measured: Vec<Measured>,
}

/// Writes a figure an experiment into `folder`, and prints what is read off them beside what is published.
pub(super) fn draw(species: &Species, folder: &Path, shell: &Shell) -> Result<()> {
    files::make_folder(folder)?;
    let (figures, rows) = report::kinematics(&species.average());
    let mut outcome = Outcome { is_virtual: true, figures: Vec::new(), measured: Vec::new() };
    for (name, bytes) in figures.iter().flat_map(report::Figure::files) {
        let path = folder.join(name);
        files::write(&path, &bytes)?;
        outcome.figures.push(path);
    }
    let mut text = format!("a virtual {}, its typical plant\n", species.name);
    for row in rows {
        text += &format!("{:<58} {:>7.2}   {}\n", row.quantity, row.value, row.published);
        outcome.measured.push(Measured {
            quantity: row.quantity,
            value: row.value,
            published: row.published,
        });
    }
    text += &format!("wrote {} figures into {}", outcome.figures.len(), folder.display());
    shell.result(&text, &outcome)
}
