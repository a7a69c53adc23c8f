//! How accurate vision is: bias and spread, medians, tails, gaps and classes, on virtual frames with the truth beside
//! them, on spoiled files, and on real photographs where `TROPISM_DATA` names the folder that holds them.
//!
//! ```text
//! cargo run --release -p tropism --example accuracy -- --frames 500
//! cargo run --release -p tropism --example accuracy -- --frames 500 glare fly real/
//! ```
//!
//! Rows are named by any part of their names; without names all are printed. `--frames` is how many frames a virtual row
//! scores at least (24 by default), `--seed` the first seed: 1 000 000 and above were never used to tune anything, seeds
//! below 100 000 were. `--list FOLDER` names the virtual frames called ok, but wrong, and writes them there. `--mode paper`
//! shows the paper's method instead. Virtual rows show whether a method survives a
//! fault as drawn, not how often it occurs in a tent.

mod marks;
mod published;
mod real;
mod score;
mod tent;

use std::path::PathBuf;

use score::Score;
use tropism::vision::Mode;

/// What is asked for on the command line.
struct Wanted {
    rows: Vec<String>,
    frames: usize,
    seed: u64,
    mode: Mode,
    list: Option<PathBuf>,
}

impl Wanted {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut wanted =
            Self { rows: Vec::new(), frames: 24, seed: 1_000_000, mode: Mode::Robust, list: None };
        while let Some(argument) = arguments.next() {
            let mut number = |key: &str| {
                let text = arguments.next().unwrap_or_default();
                text.parse().map_err(|_| format!("{key}: found {text:?}, wanted a whole number"))
            };
            match argument.as_str() {
                "--frames" => wanted.frames = number("--frames")? as usize,
                "--seed" => wanted.seed = number("--seed")?,
                "--mode" => {
                    wanted.mode = match arguments.next().as_deref() {
                        Some("paper") => Mode::Paper,
                        Some("robust") => Mode::Robust,
                        other => return Err(format!("--mode: found {other:?}, wanted paper or robust")),
                    }
                }
                "--list" => {
                    let folder = arguments.next().ok_or("--list: found nothing, wanted a folder")?;
                    wanted.list = Some(folder.into());
                }
                key if key.starts_with('-') => {
                    return Err(format!(
                        "found {key}, wanted --frames, --seed, --mode, --list or names of rows"
                    ));
                }
                name => wanted.rows.push(name.to_owned()),
            }
        }
        Ok(wanted)
    }

    fn has(&self, row: &str) -> bool {
        self.rows.is_empty() || self.rows.iter().any(|name| row.contains(name.as_str()))
    }
}

fn main() -> Result<(), String> {
    let wanted = Wanted::parse(std::env::args().skip(1))?;
    if let Some(folder) = &wanted.list {
        std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    println!(
        "mode {:?}, seeds from {}, at least {} frames a virtual row",
        wanted.mode, wanted.seed, wanted.frames
    );
    println!("\nvirtual frames, mm; shares in % of the frames scored\n{}", Score::HEADER);
    for row in tent::rows().iter().filter(|row| wanted.has(row.name)) {
        let score = row.score(wanted.frames, wanted.seed, wanted.mode, wanted.list.as_deref());
        println!("{}", score.line(row.name));
        let list = score.wrong.iter().filter(|_| wanted.list.is_some());
        list.for_each(|wrong| println!("    {wrong}"));
    }
    for row in tent::file_rows().iter().filter(|row| wanted.has(row.name)) {
        println!("{}", row.score(wanted.frames, wanted.seed, wanted.mode));
    }
    match std::env::var_os("TROPISM_DATA") {
        Some(data) => {
            real::print(&std::path::Path::new(&data).join("real"), wanted.mode, |row| wanted.has(row))
        }
        None => println!("\nreal photographs skipped: TROPISM_DATA does not name the folder that holds them"),
    }
    Ok(())
}
