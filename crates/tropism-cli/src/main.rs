//! The command `tropism`. It reads arguments into the plans of `tropism-lab`, draws progress, and prints results.

mod options;
mod signals;
mod shell;
mod progress;
mod announce;
#[cfg(feature = "studio")]
mod page;
mod controller;
mod python;
mod units;
mod commands;

use std::process::ExitCode;

use clap::builder::{PossibleValue, Resettable};
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, CommandFactory, FromArgMatches, Parser};
use tropism::simd::VectorUnit;

use crate::commands::Command;
use crate::shell::{Interrupted, Paused, Shell, print_line};

// Each photograph allocates and frees buffers of the same sizes. The system's allocator returns their pages and asks for
// them again, which takes a quarter of the time of detection; that of musl, in static programs, takes longer still.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Steers living plants with light: photograph, model, evolution, controller, lamps.
///
/// After Wahby et al. 2016. The plants of `study`, `grow` and `run --rig greenhouse` are virtual.
#[derive(Parser)]
#[command(
    max_term_width = 100,
    after_help = "Start here:\n  tropism study --quick    the whole paper at small scale, in about a minute\n  tropism study            the whole paper"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,

    /// Print one JSON object on stdout instead of text
    #[arg(long, global = true)]
    json: bool,

    /// Print no progress and no notes on stderr
    #[arg(long, short, global = true)]
    quiet: bool,

    /// Threads, all cores by default; results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

/// The command line with all its commands.
fn command() -> clap::Command {
    Cli::command().name("tropism").version(version()).mut_subcommands(on_one_screen)
}

/// A command whose help begins with its examples and has a line for an option, in place of clap's long form, which takes
/// several screens.
fn on_one_screen(command: clap::Command) -> clap::Command {
    let about = command.get_long_about().or(command.get_about()).cloned().unwrap_or_default();
    let options = command.mut_args(|option| {
        let help = option.get_long_help().or(option.get_help()).cloned().unwrap_or_default();
        let values: Vec<String> = option.get_possible_values().iter().filter_map(explained).collect();
        let option = option.long_help(Resettable::Reset);
        match values.is_empty() {
            true => option.help(help),
            false => option.help(format!("{help}: {}", values.join(", "))).hide_possible_values(true),
        }
    });
    let template = "{about}{after-help}\n\n{usage-heading} {usage}\n\n{all-args}";
    options.about(about).long_about(Resettable::Reset).help_template(template)
}

/// A value with what it means.
fn explained(value: &PossibleValue) -> Option<String> {
    value.get_help().map(|help| format!("{} ({help})", value.get_name()))
}

/// The command line without what only the program itself calls: for completions and manual pages.
fn visible_command() -> clap::Command {
    let all = command();
    let commands = all.get_subcommands().filter(|command| !command.is_hide_set()).cloned();
    let about = all.get_about().cloned().unwrap_or_default();
    let visible = clap::Command::new("tropism").version(version()).about(about);
    visible.args(all.get_arguments()).subcommands(commands)
}

/// The version with the commit that was built, and the instruction set that simulations use on this processor.
pub(crate) fn version() -> String {
    let commit = match env!("TROPISM_COMMIT") {
        "" => "not built from a commit".to_owned(),
        commit => format!("commit {commit}"),
    };
    let vectors = format!("{} with {}", std::env::consts::ARCH, VectorUnit::detect());
    format!("{} ({commit}, {vectors})", env!("CARGO_PKG_VERSION"))
}

fn main() -> ExitCode {
    let command = command();
    let matches = command.clone().get_matches();
    let given = options_given(&command, &matches);
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    if let Some(threads) = cli.threads {
        // This fails only if a thread pool exists already.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
    }
    let shell = Shell::new(cli.json, cli.quiet, given);
    if cli.command.is_in_one_piece() {
        Shell::end_at_once();
    }
    match cli.command.execute(&shell) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is::<Interrupted>() => {
            shell.note(&error.to_string());
            ExitCode::from(130)
        }
        Err(error) if error.is::<Paused>() => {
            print_line(&error.to_string());
            ExitCode::from(3)
        }
        Err(error) => {
            print_line(&format!("error: {}", in_one_line(&error)));
            ExitCode::FAILURE
        }
    }
}

/// The options of the command that stand on the command line, without those of all commands.
fn options_given(command: &clap::Command, matches: &ArgMatches) -> Vec<String> {
    let Some((name, matches)) = matches.subcommand() else { return Vec::new() };
    let options = command.find_subcommand(name).into_iter().flat_map(clap::Command::get_arguments);
    let is_given = |option: &&Arg| {
        !option.is_global_set()
            && matches.value_source(option.get_id().as_str()) == Some(ValueSource::CommandLine)
    };
    options.filter(is_given).filter_map(|option| Some(format!("--{}", option.get_long()?))).collect()
}

/// The error and its causes in one line. A cause that an error's text contains already is left out.
fn in_one_line(error: &anyhow::Error) -> String {
    error.chain().skip(1).fold(error.to_string(), |line, cause| {
        let cause = cause.to_string();
        let cause = cause.trim_end();
        if line.contains(cause) { line } else { format!("{line}: {cause}") }
    })
}
