//! Processes of `tropism`, apart from that of the studio.

use std::fs::File;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use tropism_lab::files;

/// How long a process that is asked to end may take: a step of a run, or a generation.
const ENDS: Duration = Duration::from_secs(10);

/// Starts `tropism` with `words` in the folder `root`, apart from this process: no signal of this terminal reaches it.
pub(crate) fn spawn(program: &Path, root: &Path, words: &[String], log: &Path) -> std::io::Result<Child> {
    if let Some(folder) = log.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let log = File::create(log)?;
    let mut command = Command::new(program);
    command.args(words).arg("--quiet").current_dir(root).stdin(Stdio::null());
    command.stdout(log.try_clone()?).stderr(log);
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.spawn()
}

/// What a process said last into its log.
pub(crate) fn last_words(log: &Path) -> String {
    let text = files::read_text(log).unwrap_or_default();
    let last = text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it ended without a word");
    crate::words::clean(last)
}

/// Asks a process to end in order.
pub(crate) fn ask_to_end(child: &mut Child) {
    // The number of one that has ended may be another's by now.
    #[cfg(unix)]
    if matches!(child.try_wait(), Ok(None)) {
        use rustix::process::{Pid, Signal, kill_process};

        // One that does not hear it is killed after its time.
        let _ = kill_process(Pid::from_child(child), Signal::TERM);
    }
    #[cfg(not(unix))]
    let _ = child;
}

/// Waits until a process that was asked to end has ended; one that takes too long is killed.
pub(crate) fn wait_for_end(child: &mut Child) {
    let asked = Instant::now();
    while asked.elapsed() < ENDS {
        if !matches!(child.try_wait(), Ok(None)) {
            return;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let _ = child.kill();
    let _ = child.wait();
}
