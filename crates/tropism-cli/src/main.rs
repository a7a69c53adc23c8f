//! `tropism`: steers living plants with light, from photograph to lamp.

mod announce;
mod commands;
mod controller;
mod findings;
mod options;
mod progress;
mod shell;

use std::process::ExitCode;

use clap::Parser;

use crate::commands::Command;
use crate::shell::{Interrupted, Paused, Shell};

// Planes and pictures of the same sizes come and go with each photograph: the system's allocator gives their pages back and
// asks for them again, for a quarter of vision's time; musl's, in static programs, is slower still.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Steers living plants with light: photograph, model, evolution, controller, lamps.
///
/// After Wahby et al. 2016. The plants of `study`, `grow` and `run --rig greenhouse` are virtual.
#[derive(Parser)]
#[command(
    version,
    max_term_width = 100,
    after_help = "Start here:\n  tropism study --quick    the whole paper at small scale, in about a minute\n  tropism study            the whole paper"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,

    /// One JSON object on stdout instead of text
    #[arg(long, global = true)]
    json: bool,

    /// No progress and no notes on stderr
    #[arg(long, short, global = true)]
    quiet: bool,

    /// Threads to work with (all cores by default); results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    if let Some(threads) = cli.threads {
        // Fails only if a pool exists already, and none does this early.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
    }
    let shell = Shell::new(cli.json, cli.quiet);
    match cli.command.execute(&shell) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is::<Interrupted>() => {
            shell.note(&error.to_string());
            ExitCode::from(130)
        }
        Err(error) if error.is::<Paused>() => {
            eprintln!("{error}");
            ExitCode::from(3)
        }
        Err(error) => {
            eprintln!("error: {}", in_one_line(&error));
            ExitCode::FAILURE
        }
    }
}

/// The error and its causes, each said once: some errors of the library tell their cause themselves.
fn in_one_line(error: &anyhow::Error) -> String {
    error.chain().skip(1).fold(error.to_string(), |line, cause| {
        let cause = cause.to_string();
        let cause = cause.trim_end();
        if line.contains(cause) { line } else { format!("{line}: {cause}") }
    })
}
