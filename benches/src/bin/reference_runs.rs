//! Is it the same algorithm? Our evolution beside reference runs of MultiNEAT on the same data, with p values.
//!
//! `cargo run --release --manifest-path benches/Cargo.toml --bin reference_runs -- --seeds 20 --generations 2000 [--seed 1] [--json]`
//!
//! Needs the data set `synthetic-swing` in the folder that `TROPISM_DATA` names. Without arguments it makes a small
//! comparison of a few seconds.

#[path = "../../../crates/tropism/tests/swing/reference.rs"]
mod reference;

use std::process::ExitCode;

use reference::{Comparison, GENERATIONS, REFERENCE_RUNS, SKIPPED, TABLE};

const USAGE: &str = "wanted --seeds N (above 0), --generations N (at least 50), --seed N, --json";

fn main() -> ExitCode {
    let Arguments { seeds, generations, seed, json } = match arguments() {
        Ok(arguments) => arguments,
        Err(found) => {
            eprintln!("found {found}: {USAGE}");
            return ExitCode::from(2);
        }
    };
    let model = match reference::model() {
        Some(Ok(model)) => model,
        Some(Err(why)) => {
            eprintln!("{why}");
            return ExitCode::FAILURE;
        }
        None => {
            eprintln!("{SKIPPED}");
            return ExitCode::SUCCESS;
        }
    };
    let mut rows = Vec::new();
    for preset in &TABLE {
        let histories = reference::histories(&model, (preset.config)(), seed, seeds, generations);
        rows.extend(reference::compare(preset, &histories));
    }
    if json {
        println!("{}", serde_json::to_string_pretty(&rows).expect("numbers and text are JSON"));
    } else {
        print(&rows, seeds);
    }
    ExitCode::SUCCESS
}

/// What to compare, and how to say it.
struct Arguments {
    seeds: u32,
    generations: u32,
    /// The seed from which all runs get theirs.
    seed: u64,
    json: bool,
}

/// The command line, or what of it is not understood.
fn arguments() -> Result<Arguments, String> {
    fn number<T: std::str::FromStr + PartialOrd>(
        name: &str,
        text: Option<String>,
        least: T,
    ) -> Result<T, String> {
        let text = text.unwrap_or_default();
        let value = text.parse().ok().filter(|value| *value >= least);
        value.ok_or_else(|| format!("{name} {text}"))
    }
    let mut found = Arguments { seeds: 4, generations: 100, seed: 1, json: false };
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        match name.as_str() {
            "--seeds" => found.seeds = number(&name, arguments.next(), 1)?,
            "--generations" => found.generations = number(&name, arguments.next(), GENERATIONS[0])?,
            "--seed" => found.seed = number(&name, arguments.next(), 0)?,
            "--json" => found.json = true,
            _ => return Err(name),
        }
    }
    Ok(found)
}

fn print(rows: &[Comparison], seeds: u32) {
    println!(
        "Best fitness so far in cm (least, quartiles and median, greatest), mean links and species of {seeds} runs of ours \
         and {REFERENCE_RUNS} of MultiNEAT."
    );
    println!(
        "p: of one distribution giving samples so far apart. In brackets, whatever the eight values were.\n"
    );
    println!(
        "{:<12} {:>4}  {:<28} {:<28} {:<19} {:>11} {:>5}  {:>9} {:>5}",
        "preset", "gen", "ours", "MultiNEAT", "p", "links", "p", "species", "p"
    );
    let five = |values: &[f64; 5]| values.map(|value| format!("{value:.1}")).join(" / ");
    for row in rows {
        let [least, most] = row.p_best_range;
        let species = match (row.reference.species, row.p_species) {
            (Some(reference), Some(p)) => format!("{:>4.0} : {reference:>2}  {p:.2}", row.species),
            _ => format!("{:>4.0} :  -     -", row.species),
        };
        println!(
            "{:<12} {:>4}  {:<28} {:<28} {:.3} ({least:.3}-{most:.3}) {:>5.0} : {:>3} {:>5.2}  {species}",
            row.preset,
            row.generations,
            five(&row.best),
            five(&row.reference.best),
            row.p_best,
            row.links,
            row.reference.links,
            row.p_links,
        );
    }
}
