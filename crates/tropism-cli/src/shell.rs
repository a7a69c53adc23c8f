//! The terminal: results go to stdout, everything else to stderr.

use std::io::{IsTerminal, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Result, ensure};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use tropism::text::{plain_json, plain_lines};
use tropism_lab::units;
use tropism_rig::secret::shown;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Whether a second request to end is ignored, too: lamps may be lit.
static ENDS_IN_ORDER: AtomicBool = AtomicBool::new(false);

/// Whether the first request to end ends the program: there is nothing to put in order.
static ENDS_AT_ONCE: AtomicBool = AtomicBool::new(false);

/// The user asked for an end by Ctrl-C, SIGTERM or SIGHUP: exit code 130. The text says what is left of the work.
#[derive(Debug, thiserror::Error)]
#[error("interrupted: {0}")]
pub(crate) struct Interrupted(pub(crate) String);

impl Interrupted {
    /// The work so far is saved in `folder`, where --resume continues.
    pub(crate) fn resumable(folder: &Path) -> anyhow::Error {
        Self(format!("{} is saved; the same command with --resume goes on", folder.display())).into()
    }
}

/// A run met a condition that its user must decide: exit code 3.
#[derive(Debug, thiserror::Error)]
#[error("paused: {0}")]
pub(crate) struct Paused(String);

impl Paused {
    /// The run in `folder` is paused for `reason`.
    pub(crate) fn at(folder: &Path, reason: &str) -> anyhow::Error {
        Self(format!("{}: {reason}; the same command with --resume goes on", folder.display())).into()
    }
}

/// The output channels of a command.
pub(crate) struct Shell {
    is_json: bool,
    is_quiet: bool,
    is_terminal: bool,
    /// The options of the command that stand on the command line.
    given: Vec<String>,
}

impl Shell {
    /// Opens the terminal and installs the handler of Ctrl-C, SIGTERM and SIGHUP: the first asks for an orderly end,
    /// the second ends at once, unless [`end_in_order`](Self::end_in_order) was asked for.
    pub(crate) fn new(is_json: bool, is_quiet: bool, given: Vec<String>) -> Self {
        let handler = || {
            let is_second = INTERRUPTED.swap(true, Ordering::SeqCst);
            let is_enough = is_second || ENDS_AT_ONCE.load(Ordering::SeqCst);
            if is_enough && !ENDS_IN_ORDER.load(Ordering::SeqCst) {
                std::process::exit(130);
            }
        };
        crate::signals::handle(handler);
        Self { is_json, is_quiet, is_terminal: std::io::stderr().is_terminal(), given }
    }

    /// Checks that of the options that decide results only `taken` are given: work that goes on with the settings in `out` would
    /// ignore the others.
    pub(crate) fn check_resumes_alone(&self, out: &Path, taken: &[&str]) -> Result<()> {
        let of_work = ["--out", "--resume", "--unit", "--list", "--engine"];
        let is_ignored = |option: &&str| !of_work.contains(option) && !taken.contains(option);
        let ignored: Vec<&str> = self.given.iter().map(String::as_str).filter(is_ignored).collect();
        ensure!(
            ignored.is_empty(),
            "--resume goes on with the settings in {}: leave out {}, or name all that it began with",
            out.display(),
            ignored.join(" and ")
        );
        Ok(())
    }

    /// From now on the first request to end ends the program. For commands that write whole files and nothing else: they do
    /// not ask while they work.
    pub(crate) fn end_at_once() {
        ENDS_AT_ONCE.store(true, Ordering::SeqCst);
    }

    /// From now on the program ends in order however often it is asked to: a rig is put into its safe state first. Each
    /// device has a deadline, so this does not last.
    pub(crate) fn end_in_order() {
        ENDS_IN_ORDER.store(true, Ordering::SeqCst);
    }

    /// Whether the user asked for an end by Ctrl-C, SIGTERM or SIGHUP.
    pub(crate) fn is_interrupted() -> bool {
        INTERRUPTED.load(Ordering::SeqCst)
    }

    /// Prints a line for people on stderr.
    pub(crate) fn note(&self, line: &str) {
        if !self.is_quiet {
            print_line(line);
        }
    }

    /// Prints the result on stdout: text for people, or one JSON object for scripts.
    pub(crate) fn result(&self, text: &str, json: &impl Serialize) -> anyhow::Result<()> {
        if self.is_json { self.line(json) } else { print(&plain_lines(text)) }
    }

    /// Prints one JSON object on a line of stdout, with or without --json.
    pub(crate) fn line(&self, json: &impl Serialize) -> anyhow::Result<()> {
        print(&plain_json(&serde_json::to_string(json)?))
    }

    /// Shows a progress line with the time left. If stderr is no terminal, prints a line at the beginning, at the end, and every
    /// half minute.
    pub(crate) fn progress(&self, name: &str, total: u64) -> Progress {
        let is_shown = !self.is_quiet && self.is_terminal;
        let target =
            if is_shown { ProgressDrawTarget::stderr_with_hz(8) } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(total), target);
        let style = "{prefix:<22} {bar:24} {percent:>3} %  {elapsed} so far, {eta} left  {msg}";
        bar.set_style(ProgressStyle::with_template(style).expect("a valid template").progress_chars("=> "));
        bar.set_prefix(name.to_owned());
        if is_shown {
            bar.enable_steady_tick(Duration::from_millis(500));
        } else if !self.is_quiet {
            print_line(&format!("{name} ..."));
        }
        let has_lines = !self.is_quiet && !self.is_terminal;
        let is_quiet = self.is_quiet;
        let lines = has_lines.then(|| Lines { total, said: Mutex::new((Instant::now(), 0)) });
        Progress { bar, name: name.to_owned(), started: Instant::now(), lines, is_quiet }
    }
}

/// Prints a line on stderr, without the secrets of addresses and the controls of terminals: parts of it may come from
/// a device or be the name of a file. A line that nobody can read any more is lost. The panic of `eprintln!` would end
/// a run with a lamp lit.
pub(crate) fn print_line(line: &str) {
    let _ = writeln!(std::io::stderr(), "{}", shown(line));
}

fn print(text: &str) -> anyhow::Result<()> {
    match writeln!(std::io::stdout().lock(), "{text}") {
        // The reader of the pipe has closed it (`tropism … | head`): not an error.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        other => Ok(other?),
    }
}

/// A line of progress: share of the units that are finished, and the time left by the pace of those that were not skipped.
fn line_of(name: &str, [finished, skipped, total]: [u64; 3], elapsed: Duration) -> String {
    let percent = 100 * finished / total.max(1);
    let pace = elapsed.as_secs_f64() / finished.saturating_sub(skipped).max(1) as f64;
    let left_s = pace * total.saturating_sub(finished) as f64;
    format!("{name} ... {percent} %, about {} left", units::time(left_s))
}

/// A progress line on stderr. It ends when it is dropped.
pub(crate) struct Progress {
    bar: ProgressBar,
    name: String,
    started: Instant,
    /// Where there is no terminal.
    lines: Option<Lines>,
    is_quiet: bool,
}

/// Lines of progress where there is no terminal.
struct Lines {
    total: u64,
    /// When the latest was printed, and the units that were finished before the command was resumed.
    said: Mutex<(Instant, u64)>,
}

/// Time between lines of progress where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(30);

impl Progress {
    /// Adds `count` finished units.
    pub(crate) fn add(&self, count: u64) {
        self.bar.inc(count);
        let Some(lines) = &self.lines else { return };
        // A thread that panicked while it printed leaves numbers that can still be read.
        let (latest, skipped) = &mut *lines.said.lock().unwrap_or_else(PoisonError::into_inner);
        if latest.elapsed() >= LINE_EVERY {
            *latest = Instant::now();
            print_line(&line_of(
                &self.name,
                [self.bar.position(), *skipped, lines.total],
                self.started.elapsed(),
            ));
        }
    }

    /// Adds `count` units that were finished before the command was resumed; the time left is not estimated from them.
    pub(crate) fn skip(&self, count: u64) {
        self.bar.inc(count);
        self.bar.reset_eta();
        if let Some(lines) = &self.lines {
            lines.said.lock().unwrap_or_else(PoisonError::into_inner).1 += count;
        }
    }

    /// Prints a line for people above the progress line.
    pub(crate) fn note(&self, line: &str) {
        if !self.is_quiet {
            self.bar.suspend(|| print_line(line));
        }
    }

    /// Shows a few words at the end of the progress line.
    pub(crate) fn say(&self, message: String) {
        self.bar.set_message(plain_lines(&message).into_owned());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        if self.lines.is_some() {
            print_line(&format!("{} ... {:.1} s", self.name, self.started.elapsed().as_secs_f64()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_tells_the_share_and_the_time_left_by_the_pace_since_the_resume() {
        let line = |finished, skipped| line_of("evolve", [finished, skipped, 400], Duration::from_secs(30));
        assert_eq!(line(100, 0), "evolve ... 25 %, about 90 s left");
        assert_eq!(line(100, 50), "evolve ... 25 %, about 3 min left");
        assert_eq!(line(400, 400), "evolve ... 100 %, about 0 s left");
    }
}
