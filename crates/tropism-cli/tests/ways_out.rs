//! Whatever ends a run in a real tent, its light is off within a stated time.
//!
//! A table: each way out, on lamps and a flash behind programs and on an emulated WLED controller.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::{self, sleep};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;
use tropism_lab::Journal;

/// How soon all light is off after a run has ended, whatever ended it.
const WITHIN: Duration = Duration::from_secs(15);

/// A WLED controller of two segments as its documentation describes it.
#[derive(Default)]
struct Wled {
    segments: std::collections::BTreeMap<u64, Value>,
    uptime: u64,
}

impl Wled {
    /// Starts one; returns its address and its state.
    fn start() -> (String, Arc<Mutex<Self>>) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        let wled = Arc::new(Mutex::new(Self::default()));
        let state = Arc::clone(&wled);
        thread::spawn(move || {
            for socket in listener.incoming().flatten() {
                let state = Arc::clone(&state);
                thread::spawn(move || Self::answer(&state, socket));
            }
        });
        (url, wled)
    }

    fn answer(state: &Mutex<Self>, mut socket: TcpStream) -> Option<()> {
        let mut reader = BufReader::new(socket.try_clone().ok()?);
        let (mut line, mut length) = (String::new(), 0);
        reader.read_line(&mut line).ok()?;
        loop {
            let mut header = String::new();
            if reader.read_line(&mut header).ok()? <= 2 {
                break;
            }
            if let Some(value) = header.to_ascii_lowercase().strip_prefix("content-length:") {
                length = value.trim().parse().ok()?;
            }
        }
        let mut body = vec![0; length];
        reader.read_exact(&mut body).ok()?;
        let mut wled = state.lock().unwrap();
        wled.uptime += 1;
        let answer = if line.contains("/json/info") {
            json!({"leds": {"count": 288}, "uptime": wled.uptime, "live": false})
        } else {
            let said: Value = serde_json::from_slice(&body).unwrap_or_default();
            for segment in said["seg"].as_array().into_iter().flatten() {
                wled.segments.insert(segment["id"].as_u64()?, segment.clone());
            }
            json!({"on": true, "bri": 255, "seg": wled.segments.values().collect::<Vec<_>>()})
        };
        let answer = answer.to_string();
        write!(
            socket,
            "HTTP/1.1 200 OK\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{answer}",
            answer.len()
        )
        .ok()
    }

    fn is_lit(&self) -> bool {
        self.segments.values().any(|segment| segment["on"] == true)
    }
}

/// A rig with a WLED strip for each lamp and a flash behind programs, in which the photographs of a virtual tent are seen.
struct Tent {
    folder: TempDir,
    wled: Arc<Mutex<Wled>>,
}

impl Tent {
    fn new(camera: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let small = "[lamps_in_view]\n[greenhouse.scene]\nwidth = 324\nheight = 243\n";
        fs::write(path.join("tent.toml"), small).unwrap();
        let words = ["run", "--rig", "tent.toml", "--controller", "chase", "--steps", "4", "--out", "tent"];
        assert!(tropism(path, &words).output().unwrap().status.success());
        let calibration = fs::read_to_string(path.join("tent/calibration.toml")).unwrap();
        let (url, wled) = Wled::start();
        let lamp = |name: &str, segment: u32| {
            format!(
                "[lamps.{name}]\ndriver = \"wled\"\nurl = {url:?}\nsegment = {segment}\ndead_man_min = 0\n\
                 strip = {{ first = {}, pixels = 144 }}\n",
                144 * segment
            )
        };
        let camera =
            camera.replace("PHOTOGRAPH", &path.join("tent/photographs/000000.jpg").display().to_string());
        let rig = format!(
            "period_min = 5.0\n[patience]\nfree_mb = 0\n[camera]\n{camera}\n{}{}\
             [flash]\ndriver = \"command\"\non = [\"sh\", \"-c\", \"echo on > flash\"]\n\
             off = [\"sh\", \"-c\", \"echo off > flash\"]\nsettle_s = 0.01\nmax_on_s = 5.0\n\
             [vision.crop]\nx = 4\ny = 10\nwidth = 316\nheight = 190\n[calibration]\n{}",
            lamp("left", 0),
            lamp("right", 1),
            calibration.replace("[base]", "[calibration.base]")
        );
        fs::write(path.join("rig.toml"), rig).unwrap();
        Self { folder, wled }
    }

    fn command(&self) -> Command {
        tropism(self.folder.path(), &["run", "--rig", "rig.toml", "--controller", "periodic", "--out", "run"])
    }

    /// Starts the run and waits until its lamp is lit, and its next step is minutes away.
    fn lit(&self, command: &mut Command) -> Child {
        let mut child = command.spawn().unwrap();
        let journal = self.folder.path().join("run/journal.sqlite");
        let is_confirmed = || {
            let steps =
                Journal::open_to_read(&journal).and_then(|journal| journal.steps()).unwrap_or_default();
            steps.first().is_some_and(|step| step.is_confirmed)
        };
        while !is_confirmed() {
            assert!(child.try_wait().unwrap().is_none(), "it ended: {:?}", child.wait_with_output());
            sleep(Duration::from_millis(20));
        }
        assert!(self.wled.lock().unwrap().is_lit());
        child
    }

    fn is_dark(&self) -> bool {
        let flash = fs::read_to_string(self.folder.path().join("flash")).unwrap_or_default();
        !self.wled.lock().unwrap().is_lit() && flash.trim() == "off"
    }

    /// Waits until all light is off; how long it took.
    #[track_caller]
    fn goes_dark(&self, way: &str) -> Duration {
        let began = Instant::now();
        while !self.is_dark() {
            let log = || fs::read_to_string(self.folder.path().join("run/guard.log")).unwrap_or_default();
            assert!(began.elapsed() < WITHIN, "{way}: light after {WITHIN:?}; guard: {}", log());
            sleep(Duration::from_millis(20));
        }
        began.elapsed()
    }
}

/// A camera that shows the photograph of the virtual tent.
const CAMERA: &str = "driver = \"command\"\ncommand = [\"cat\", \"PHOTOGRAPH\"]\nretries = 0";

fn tropism(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
    command
        .current_dir(folder)
        .args(words)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

fn send(signal: &str, process: u32) {
    assert!(Command::new("kill").args([signal, &process.to_string()]).status().unwrap().success());
}

#[test]
fn every_signal_that_ends_a_run_leaves_it_dark() {
    for signal in ["-INT", "-TERM", "-HUP", "-QUIT", "-ABRT", "-KILL"] {
        let tent = Tent::new(CAMERA);
        let mut child = tent.lit(&mut tent.command());
        send(signal, child.id());
        child.wait().unwrap();
        println!("{signal}: dark {:?} after the end", tent.goes_dark(signal));
    }
}

#[test]
fn a_lost_terminal_and_lost_output_leave_a_run_dark_when_it_ends() {
    let tent = Tent::new(CAMERA);
    // Nobody reads what it says.
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut child = tent.lit(tent.command().stdout(writer.try_clone().unwrap()).stderr(writer));
    send("-TERM", child.id());
    child.wait().unwrap();
    tent.goes_dark("lost output");
}

#[test]
fn a_camera_that_fails_pauses_the_run_and_leaves_it_dark() {
    let tent = Tent::new(
        "driver = \"command\"\ncommand = [\"sh\", \"-c\", \"echo off > flash; exit 1\"]\nretries = 0",
    );
    // The first photograph must be one: an error, not a pause.
    let output = tent.command().output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    tent.goes_dark("error");
}

#[test]
fn a_run_that_is_stopped_for_good_is_killed_by_its_guard() {
    let tent = Tent::new(CAMERA);
    let mut child = tent.lit(&mut tent.command());
    // Its own guard waits for minutes; this one listens to nobody.
    send("-STOP", child.id());
    let mut guard = tropism(tent.folder.path(), &["guard", "run", "--silence", "1"]);
    let mut guard = guard.stdin(Stdio::piped()).spawn().unwrap();
    let silent = guard.stdin.take();
    assert!(guard.wait().unwrap().success());
    drop(silent);
    assert!(!child.wait().unwrap().success());
    tent.goes_dark("hang");
}

#[test]
fn a_run_that_is_resumed_at_once_after_a_kill_keeps_its_light() {
    let tent = Tent::new(CAMERA);
    let mut child = tent.lit(&mut tent.command());
    child.kill().unwrap();
    child.wait().unwrap();
    let mut again = tent.command().spawn().unwrap();
    // Its guard may put the light off before the run goes on, and not after.
    let events = || {
        let journal = tent.folder.path().join("run/journal.sqlite");
        Journal::open_to_read(&journal).and_then(|journal| journal.events()).unwrap_or_default()
    };
    while !events().iter().any(|event| event.kind == tropism::rig::EventKind::Resumed) {
        assert!(again.try_wait().unwrap().is_none(), "it ended: {:?}", again.wait_with_output());
        sleep(Duration::from_millis(20));
    }
    sleep(Duration::from_secs(3));
    assert!(tent.wled.lock().unwrap().is_lit(), "the light of the resumed run");
    send("-TERM", again.id());
    again.wait().unwrap();
    tent.goes_dark("end");
}

#[test]
fn a_rig_that_a_run_drives_is_refused_to_another_run() {
    let tent = Tent::new(CAMERA);
    let mut child = tent.lit(&mut tent.command());
    let words = ["run", "--rig", "rig.toml", "--controller", "periodic", "--out", "other"];
    let output = tropism(tent.folder.path(), &words).output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && error.contains("driven by another run"), "{error}");
    assert!(tent.wled.lock().unwrap().is_lit(), "the first run goes on");
    send("-TERM", child.id());
    child.wait().unwrap();
    tent.goes_dark("end");
}
