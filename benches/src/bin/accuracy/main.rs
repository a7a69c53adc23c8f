//! Accuracy of vision: bias, deviation, quantiles of the errors, gaps and frame classes. Measured on virtual frames
//! with ground truth, on spoiled files, and on real photographs where `TROPISM_DATA` names their folder.
//!
//! ```text
//! cargo run --release --manifest-path benches/Cargo.toml --bin accuracy -- --frames 500
//! cargo run --release --manifest-path benches/Cargo.toml --bin accuracy -- --frames 500 glare fly real/
//! ```
//!
//! A row is selected by any part of its name; without names all are printed. `--frames` is the least number of frames
//! that a virtual row scores (24 by default). `--seed` is the first seed: seeds below 100 000 were used for tuning,
//! those from 1 000 000 on never. `--list FOLDER` lists the virtual frames with the class ok and a wrong tip, and
//! writes them there. `--mode paper` measures the paper's method instead. Virtual rows show whether a method survives
//! a fault as drawn, not how often the fault occurs in a tent.

#[path = "../../../../crates/tropism/tests/vision/marks.rs"]
mod marks;
#[path = "../../../../crates/tropism/tests/vision/published.rs"]
mod published;
mod reliability;
mod share;
mod score;
mod real;
mod tent;

use std::path::PathBuf;

use reliability::Reliability;
use score::Score;
use tropism::vision::Mode;

/// Options of the command line.
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
    let mut reliability = Reliability::default();
    for row in tent::rows().iter().filter(|row| wanted.has(row.name)) {
        let score = row.score(wanted.frames, wanted.seed, wanted.mode, wanted.list.as_deref());
        println!("{}", score.line(row.name));
        // What is hidden from the first photograph on cannot be recognised.
        if !row.name.starts_with("always") {
            reliability.extend(score.answers.iter().copied());
        }
        let list = score.wrong.iter().filter(|_| wanted.list.is_some());
        list.for_each(|wrong| println!("    {wrong}"));
    }
    println!("confidence, virtual: {reliability}");
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
