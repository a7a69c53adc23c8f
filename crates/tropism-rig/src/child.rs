//! Child processes: run without a shell, with a deadline, and killed together with their own children.

use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use tropism::rig::RigError;

use crate::failed;

/// The largest output, in bytes: chosen larger than a photograph of any supported camera.
const MAX_BYTES: u64 = 64 << 20;

/// How long the error output of a failed program is waited for: chosen by hand.
const STDERR_WAIT: Duration = Duration::from_secs(1);

/// Runs `words` and returns what it prints on stdout.
///
/// # Errors
/// [`RigError::Device`] if the program cannot be started, fails, or runs longer than `timeout`; then its whole process
/// group is killed.
pub(crate) fn run(device: &str, words: &[String], timeout: Duration) -> Result<Vec<u8>, RigError> {
    let error = |problem: String| failed(format!("{device} ({})", words.join(" ")), problem);
    let (program, arguments) = words.split_first().ok_or_else(|| error("the command is empty".into()))?;
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    // A process group of its own: it can be killed as a whole, and Ctrl-C does not reach it.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let mut child = command.spawn().map_err(|cause| error(format!("cannot be started: {cause}")))?;
    let (stdout, stderr) = (drain(child.stdout.take()), drain(child.stderr.take()));
    let deadline = Instant::now() + timeout;
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if Instant::now() < deadline => thread::sleep(Duration::from_millis(5)),
            Ok(None) => {
                kill(&mut child);
                return Err(error(format!("it still runs after {timeout:?}")));
            }
            Err(cause) => return Err(error(cause.to_string())),
        }
    };
    // A child that it left behind may hold the pipe open: the deadline holds for the end of the output, too.
    while !stdout.is_finished() {
        if Instant::now() >= deadline {
            kill(&mut child);
            return Err(error(format!("its output is still open after {timeout:?}")));
        }
        thread::sleep(Duration::from_millis(5));
    }
    if !status.success() {
        // Wait for the end of stderr, but not for ever: a child may hold that pipe open, too.
        let stderr_deadline = Instant::now() + STDERR_WAIT;
        while !stderr.is_finished() && Instant::now() < stderr_deadline {
            thread::sleep(Duration::from_millis(5));
        }
        let stderr = if stderr.is_finished() { stderr.join().unwrap_or_default() } else { Vec::new() };
        let stderr = String::from_utf8_lossy(&stderr[..stderr.len().min(400)]).trim().to_owned();
        return Err(error(format!("it ended with {status}: {stderr}")));
    }
    let bytes = stdout.join().unwrap_or_default();
    if bytes.len() as u64 > MAX_BYTES {
        return Err(error(format!("it wrote more than {MAX_BYTES} bytes, which is no photograph")));
    }
    Ok(bytes)
}

fn drain(pipe: Option<impl Read + Send + 'static>) -> thread::JoinHandle<Vec<u8>> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(pipe) = pipe {
            // After a read error, the bytes so far are kept; the exit status shows a failure.
            let _ = pipe.take(MAX_BYTES + 1).read_to_end(&mut bytes);
        }
        bytes
    })
}

/// Kills the process group (`rpicam-still` and shell scripts have children) and reaps the child.
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
        assert!(fails(&[], 5.0).contains("the command is empty"));
    }

    #[test]
    fn a_program_that_hangs_is_killed() {
        assert!(fails(&["sleep", "60"], 0.1).contains("still runs"));
    }

    #[test]
    fn what_a_hanging_program_started_is_killed_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let id = folder.path().join("id");
        let script = format!("sleep 60 & echo $! > {0}.new; mv {0}.new {0}; wait", id.display());
        assert!(fails(&["sh", "-c", &script], 2.0).contains("still runs"));
        let id = std::fs::read_to_string(id).unwrap();
        let is_alive = || {
            let state = std::fs::read_to_string(format!("/proc/{}/stat", id.trim()));
            // A zombie is dead, too.
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
