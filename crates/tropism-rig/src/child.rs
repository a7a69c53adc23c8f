//! Programs of other people's: run without a shell, with a deadline, and killed with all that they started.

use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use tropism::rig::RigError;

use crate::failed;

/// The most that a program may print: a photograph of any camera in use is smaller.
const MAX_BYTES: u64 = 64 << 20;

/// How long a failed program's complaint is waited for.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// Runs `words` and returns what it prints on stdout.
///
/// # Errors
/// [`RigError::Device`] if it cannot be started, fails, or is not done after `timeout`; then it is dead, and so is what
/// it started in its process group.
pub(crate) fn run(device: &str, words: &[String], timeout: Duration) -> Result<Vec<u8>, RigError> {
    let error = |problem: String| failed(format!("{device} ({})", words.join(" ")), problem);
    let (program, arguments) =
        words.split_first().ok_or_else(|| error("found no words, wanted a program".into()))?;
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    // A group of its own, so that all of it can be killed, and Ctrl-C reaches only tropism.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let mut child = command.spawn().map_err(|cause| error(format!("cannot be started: {cause}")))?;
    let (out, complaint) = (drain(child.stdout.take()), drain(child.stderr.take()));
    let deadline = Instant::now() + timeout;
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if Instant::now() < deadline => thread::sleep(Duration::from_millis(5)),
            Ok(None) => {
                kill(&mut child);
                return Err(error(format!("found it still running after {timeout:?}, wanted it done")));
            }
            Err(cause) => return Err(error(cause.to_string())),
        }
    };
    // A program of its own that it left behind may hold the pipe open: wait for the end of the output no longer than
    // for the program.
    while !out.is_finished() {
        if Instant::now() >= deadline {
            kill(&mut child);
            return Err(error(format!("found its output still open after {timeout:?}, wanted it closed")));
        }
        thread::sleep(Duration::from_millis(5));
    }
    if !status.success() {
        // What it said last may be under way; a program of its own may hold that pipe open too.
        let patience = Instant::now() + LAST_WORDS;
        while !complaint.is_finished() && Instant::now() < patience {
            thread::sleep(Duration::from_millis(5));
        }
        let complaint =
            if complaint.is_finished() { complaint.join().unwrap_or_default() } else { Vec::new() };
        let complaint = String::from_utf8_lossy(&complaint[..complaint.len().min(400)]).trim().to_owned();
        return Err(error(format!("found {status}, wanted success: {complaint}")));
    }
    let bytes = out.join().unwrap_or_default();
    if bytes.len() as u64 > MAX_BYTES {
        return Err(error(format!("found more than {MAX_BYTES} bytes on stdout, wanted a photograph")));
    }
    Ok(bytes)
}

fn drain(pipe: Option<impl Read + Send + 'static>) -> thread::JoinHandle<Vec<u8>> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(pipe) = pipe {
            // What was read until an error is all there is; the exit status tells the rest.
            let _ = pipe.take(MAX_BYTES + 1).read_to_end(&mut bytes);
        }
        bytes
    })
}

/// Kills the whole process group, for `rpicam-still` and shell scripts have children, and reaps the child.
fn kill(child: &mut Child) {
    #[cfg(unix)]
    let _ = rustix::process::kill_process_group(
        rustix::process::Pid::from_child(child),
        rustix::process::Signal::KILL,
    );
    let _ = child.kill();
    let _ = child.wait();
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn words(text: &[&str]) -> Vec<String> {
        text.iter().map(|&word| word.to_owned()).collect()
    }

    fn fails(text: &[&str], timeout: f64) -> String {
        run("camera", &words(text), Duration::from_secs_f64(timeout)).unwrap_err().to_string()
    }

    #[test]
    fn failures_name_the_program_and_what_it_said() {
        let error = fails(&["sh", "-c", "echo no camera >&2; exit 3"], 5.0);
        assert!(error.contains("camera (sh -c") && error.contains("no camera"), "{error}");
        assert!(fails(&["/no/such/program"], 5.0).contains("cannot be started"));
        assert!(fails(&[], 5.0).contains("wanted a program"));
    }

    #[test]
    fn a_program_that_hangs_is_killed() {
        assert!(fails(&["sleep", "60"], 0.1).contains("still running"));
    }

    #[test]
    fn what_a_hanging_program_started_is_killed_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let id = folder.path().join("id");
        let script = format!("sleep 60 & echo $! > {0}.new; mv {0}.new {0}; wait", id.display());
        assert!(fails(&["sh", "-c", &script], 2.0).contains("still running"));
        let id = std::fs::read_to_string(id).unwrap();
        let is_alive = || {
            let state = std::fs::read_to_string(format!("/proc/{}/stat", id.trim()));
            // A zombie nobody reaps yet is dead all the same.
            state.is_ok_and(|state| !state.contains(") Z "))
        };
        while is_alive() {
            thread::sleep(Duration::from_millis(5));
        }
    }

    #[test]
    fn a_program_that_leaves_another_with_its_output_is_not_waited_for() {
        assert!(fails(&["sh", "-c", "sleep 60 & echo photo"], 0.3).contains("still open"));
    }
}
