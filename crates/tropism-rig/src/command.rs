//! Drivers that run a program: the way to any hardware that a command line reaches.
//!
//! Programs are given as a list of words and run without a shell. Each has a deadline, after which it is killed.

use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tropism::light::Light;
use tropism::photo::Photo;
use tropism::rig::{Camera, Flash, Lamps, RigError};

/// The most that a program may print: a photograph of any camera in use is smaller.
const MAX_BYTES: u64 = 64 << 20;

/// Runs `words` and returns what it prints on stdout.
///
/// # Errors
/// [`RigError::Device`] if it cannot be started, fails, or is not done after `timeout`.
fn run(device: &str, words: &[String], timeout: Duration) -> Result<Vec<u8>, RigError> {
    let error =
        |problem: String| RigError::Device { device: format!("{device} ({})", words.join(" ")), problem };
    let (program, arguments) =
        words.split_first().ok_or_else(|| error("found no words, wanted a program".into()))?;
    let mut child = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|cause| error(format!("cannot be started: {cause}")))?;
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
            return Err(error(format!("found its output still open after {timeout:?}, wanted it closed")));
        }
        thread::sleep(Duration::from_millis(5));
    }
    if !status.success() {
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

fn kill(child: &mut Child) {
    let _ = child.kill();
    let _ = child.wait();
}

/// A camera behind a program that writes a photograph to stdout, such as
/// `rpicam-still --immediate --nopreview --output -`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandCamera {
    /// Program and arguments.
    pub command: Vec<String>,
    /// Seconds until it is given up.
    #[serde(default = "twenty")]
    pub timeout_s: f64,
    /// Further tries if a photograph fails.
    #[serde(default = "two")]
    pub retries: u32,
}

const fn twenty() -> f64 {
    20.0
}

const fn two() -> u32 {
    2
}

impl Camera for CommandCamera {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        let mut tries = 0;
        loop {
            match run("camera", &self.command, Duration::from_secs_f64(self.timeout_s)) {
                Ok(bytes) => return Ok(Photo { name: String::new(), bytes, time_s: 0.0 }),
                Err(error) if tries >= self.retries => return Err(error),
                Err(_) => tries += 1,
            }
        }
    }
}

/// Lamps behind three programs, one for each state in which the pair may be. Each must darken the other lamp first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandLamps {
    /// Lights the left lamp and darkens the right one.
    pub left: Vec<String>,
    /// Lights the right lamp and darkens the left one.
    pub right: Vec<String>,
    /// Darkens both: the safe state.
    pub dark: Vec<String>,
    /// Seconds until it is given up.
    #[serde(default = "twenty")]
    pub timeout_s: f64,
}

impl Lamps for CommandLamps {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        let words = match light {
            Some(Light::Left) => &self.left,
            Some(Light::Right) => &self.right,
            None => &self.dark,
        };
        run("lamps", words, Duration::from_secs_f64(self.timeout_s)).map(drop)
    }
}

/// A flash behind two programs, with time to reach its brightness.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandFlash {
    /// Switches it on.
    pub on: Vec<String>,
    /// Switches it off.
    pub off: Vec<String>,
    /// Seconds between switching it on and the photograph.
    #[serde(default = "one")]
    pub settle_s: f64,
    /// Seconds until it is given up.
    #[serde(default = "twenty")]
    pub timeout_s: f64,
}

const fn one() -> f64 {
    1.0
}

impl Flash for CommandFlash {
    fn flash(&mut self, is_on: bool) -> Result<(), RigError> {
        let words = if is_on { &self.on } else { &self.off };
        run("flash", words, Duration::from_secs_f64(self.timeout_s))?;
        if is_on {
            thread::sleep(Duration::from_secs_f64(self.settle_s));
        }
        Ok(())
    }
}

/// No flash: the tent is bright enough, or the camera has its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoFlash;

impl Flash for NoFlash {
    fn flash(&mut self, _is_on: bool) -> Result<(), RigError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &[&str]) -> Vec<String> {
        text.iter().map(|&word| word.to_owned()).collect()
    }

    fn fails(text: &[&str], timeout: f64) -> String {
        run("camera", &words(text), Duration::from_secs_f64(timeout)).unwrap_err().to_string()
    }

    #[test]
    fn gives_what_the_program_prints() {
        let mut camera = CommandCamera {
            command: words(&["sh", "-c", "printf '\\377\\330x'"]),
            timeout_s: 5.0,
            retries: 0,
        };
        assert_eq!(camera.photograph().unwrap().bytes, [0xff, 0xd8, b'x']);
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
    fn a_camera_that_fails_twice_is_asked_again() {
        let folder = tempfile::tempdir().unwrap();
        let count = folder.path().join("count");
        let script = format!("echo x >> {0}; test $(wc -l < {0}) -ge 3 && echo photo", count.display());
        let mut camera = CommandCamera { command: words(&["sh", "-c", &script]), timeout_s: 5.0, retries: 2 };
        assert_eq!(camera.photograph().unwrap().bytes, b"photo\n");
    }

    #[test]
    fn each_state_of_the_lamps_is_a_program() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("log");
        let say = |word: &str| words(&["sh", "-c", &format!("echo {word} >> {}", log.display())]);
        let mut lamps =
            CommandLamps { left: say("left"), right: say("right"), dark: say("dark"), timeout_s: 5.0 };
        for light in [Some(Light::Right), None, Some(Light::Left)] {
            lamps.light(light).unwrap();
        }
        assert_eq!(std::fs::read_to_string(log).unwrap(), "right\ndark\nleft\n");
    }
}
