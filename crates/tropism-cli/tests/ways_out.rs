//! Whatever ends a run in a real tent, its light is off within a stated time.
//!
//! A table: each way out, on lamps of an emulated WLED controller with a flash behind programs, and on emulated plugs behind
//! an MQTT broker. `scripts/emulated-pi ways-out` is the same for lamps and flash on GPIO.
#![cfg(unix)]

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Mutex};
use std::thread::{self, sleep};
use std::time::{Duration, Instant};

use rumqttc::{Client, Event, MqttOptions, Packet, QoS};
use serde_json::{Value, json};
use tempfile::TempDir;
use testing::Mosquitto;
use tropism_lab::Journal;

#[expect(dead_code, reason = "shared with the tests of drivers")]
#[path = "../../tropism-rig/src/testing.rs"]
mod testing;

/// How soon all light is off after a run has ended, whatever ended it.
const WITHIN: Duration = Duration::from_secs(15);

/// What emulated devices share with their test.
#[derive(Default)]
struct Devices {
    /// The state of each, as JSON of WLED or as a switch.
    states: Mutex<BTreeMap<String, Value>>,
    /// Whether they hear, but neither obey nor answer.
    hang: AtomicBool,
}

impl Devices {
    fn is_lit(&self) -> bool {
        self.states.lock().unwrap().values().any(|state| state["on"] == true)
    }

    fn wait_while_hung(&self) {
        while self.hang.load(Ordering::SeqCst) {
            sleep(Duration::from_millis(10));
        }
    }
}

/// Starts a WLED controller of two segments as its documentation describes it; returns its address.
fn start_wled(devices: &Arc<Devices>) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let devices = Arc::clone(devices);
    thread::spawn(move || {
        for socket in listener.incoming().flatten() {
            let devices = Arc::clone(&devices);
            thread::spawn(move || answer_as_wled(&devices, socket));
        }
    });
    url
}

fn answer_as_wled(devices: &Devices, mut socket: TcpStream) -> Option<()> {
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
    if devices.hang.load(Ordering::SeqCst) {
        devices.wait_while_hung();
        return None;
    }
    let mut states = devices.states.lock().unwrap();
    let answer = if line.contains("/json/info") {
        static UPTIME: std::sync::atomic::AtomicU64 = std::sync::atomic::AtomicU64::new(0);
        json!({"leds": {"count": 288}, "uptime": UPTIME.fetch_add(1, Ordering::SeqCst), "live": false})
    } else {
        let said: Value = serde_json::from_slice(&body).unwrap_or_default();
        for segment in said["seg"].as_array().into_iter().flatten() {
            states.insert(segment["id"].to_string(), segment.clone());
        }
        json!({"on": true, "bri": 255, "seg": states.values().collect::<Vec<_>>()})
    };
    let answer = answer.to_string();
    write!(socket, "HTTP/1.1 200 OK\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{answer}", answer.len())
        .ok()
}

/// Starts Tasmota plugs of the names `left`, `right` and `flash` at a broker.
fn start_plugs(devices: &Arc<Devices>, port: u16) {
    let (client, mut connection) = Client::new(MqttOptions::new("plugs", "127.0.0.1", port), 16);
    client.try_subscribe("cmnd/+/POWER", QoS::AtLeastOnce).unwrap();
    testing::hear(&mut connection, |packet| matches!(packet, Packet::SubAck(_)));
    let devices = Arc::clone(devices);
    thread::spawn(move || {
        for event in connection.iter() {
            // The broker of a test that is over has ended.
            let Ok(event) = event else { return };
            let Event::Incoming(Packet::Publish(command)) = event else { continue };
            if devices.hang.load(Ordering::SeqCst) {
                continue;
            }
            let name = command.topic.split('/').nth(1).unwrap();
            let is_on = *command.payload == *b"ON";
            devices.states.lock().unwrap().insert(name.to_owned(), json!({"on": is_on}));
            let answer = if is_on { "ON" } else { "OFF" };
            client.try_publish(format!("stat/{name}/POWER"), QoS::AtMostOnce, false, answer).unwrap();
        }
    });
}

/// What switches the light.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Switches {
    /// A WLED strip for each lamp, and a flash behind programs.
    Wled,
    /// Plugs behind a broker.
    Mqtt,
}

impl Switches {
    /// All that this machine can emulate.
    fn all() -> impl Iterator<Item = Self> {
        [Self::Wled, Self::Mqtt]
            .into_iter()
            .filter(|&kind| kind != Self::Mqtt || Mosquitto::start(None).is_some())
    }
}

/// Calibration and first photograph of a run of the virtual tent: what all rigs see.
static PHOTOGRAPHED: LazyLock<(String, Vec<u8>)> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let small = "[lamps_in_view]\n[greenhouse.scene]\nwidth = 324\nheight = 243\n";
    fs::write(folder.path().join("tent.toml"), small).unwrap();
    let words = ["run", "--rig", "tent.toml", "--controller", "chase", "--steps", "1", "--out", "tent"];
    assert!(tropism(folder.path(), &words).output().unwrap().status.success());
    let run = folder.path().join("tent");
    let calibration = fs::read_to_string(run.join("calibration.toml")).unwrap();
    (calibration, fs::read(run.join("photographs/000000.jpg")).unwrap())
});

/// A rig with emulated devices, in which the photographs of a virtual tent are seen.
struct Tent {
    folder: TempDir,
    devices: Arc<Devices>,
    _broker: Option<Mosquitto>,
}

impl Tent {
    fn new(switches: Switches, camera: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let (calibration, photograph) = &*PHOTOGRAPHED;
        fs::write(path.join("photograph.jpg"), photograph).unwrap();
        let devices = Arc::new(Devices::default());
        let mut broker = None;
        let light = match switches {
            Switches::Wled => wled_rig(&start_wled(&devices)),
            Switches::Mqtt => {
                let started = Mosquitto::start(None).unwrap();
                start_plugs(&devices, started.port);
                let rig = mqtt_rig(started.port);
                broker = Some(started);
                rig
            }
        };
        let camera = camera.replace("PHOTOGRAPH", &path.join("photograph.jpg").display().to_string());
        let rig = format!(
            "period_min = 5.0\n[patience]\nfree_mb = 0\n[camera]\n{camera}\n{light}settle_s = 0.01\nmax_on_s = 5.0\n\
             [vision.crop]\nx = 4\ny = 10\nwidth = 316\nheight = 190\n[calibration]\n{}",
            calibration.replace("[base]", "[calibration.base]")
        );
        fs::write(path.join("rig.toml"), rig).unwrap();
        Self { folder, devices, _broker: broker }
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
        assert!(self.devices.is_lit());
        child
    }

    fn is_dark(&self) -> bool {
        // The flash behind programs; plugs are among the devices.
        let flash = fs::read_to_string(self.folder.path().join("flash")).unwrap_or_default();
        !self.devices.is_lit() && flash.trim() != "on"
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

/// Lamps on a WLED controller, and a flash behind programs.
fn wled_rig(url: &str) -> String {
    let lamp = |name: &str, segment: u32| {
        format!(
            "[lamps.{name}]\ndriver = \"wled\"\nurl = {url:?}\nsegment = {segment}\ndead_man_min = 0\n\
             timeout_s = 1.0\nstrip = {{ first = {}, pixels = 144 }}\n",
            144 * segment
        )
    };
    format!(
        "{}{}[flash]\ndriver = \"command\"\non = [\"sh\", \"-c\", \"echo on > flash\"]\n\
         off = [\"sh\", \"-c\", \"echo off > flash\"]\n",
        lamp("left", 0),
        lamp("right", 1)
    )
}

/// Lamps and flash on plugs behind a broker.
fn mqtt_rig(port: u16) -> String {
    let plug = |name: &str| format!("plug = {{ dialect = \"tasmota\", name = {name:?}, timeout_s = 1.0 }}\n");
    format!(
        "[mqtt]\nhost = \"127.0.0.1\"\nport = {port}\n[lamps.left]\ndriver = \"mqtt\"\n{}[lamps.right]\n\
         driver = \"mqtt\"\n{}[flash]\ndriver = \"mqtt\"\n{}",
        plug("left"),
        plug("right"),
        plug("flash")
    )
}

/// A camera that shows the photograph of the virtual tent.
const CAMERA: &str = "driver = \"command\"\ncommand = [\"cat\", \"PHOTOGRAPH\"]\nretries = 0";

fn tropism(folder: &Path, words: &[&str]) -> Command {
    let mut command = common::hearing(env!("CARGO_BIN_EXE_tropism"));
    command
        .current_dir(folder)
        .args(words)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Tries all ways at once: each only waits.
fn for_all<Way: Send>(ways: impl IntoIterator<Item = Way>, holds: impl Fn(Way) + Sync) {
    thread::scope(|scope| {
        for way in ways {
            let holds = &holds;
            scope.spawn(move || holds(way));
        }
    });
}

fn send(signal: &str, process: u32) {
    assert!(Command::new("kill").args([signal, &process.to_string()]).status().unwrap().success());
}

#[test]
fn every_signal_that_ends_a_run_leaves_it_dark() {
    let signals = ["-INT", "-TERM", "-HUP", "-QUIT", "-ABRT", "-KILL"];
    let ways = Switches::all().flat_map(|switches| signals.map(|signal| (switches, signal)));
    for_all(ways, |(switches, signal)| {
        let tent = Tent::new(switches, CAMERA);
        let mut child = tent.lit(&mut tent.command());
        send(signal, child.id());
        child.wait().unwrap();
        println!("{switches:?}, {signal}: dark {:?} after the end", tent.goes_dark(signal));
    });
}

#[test]
fn a_lost_terminal_and_lost_output_leave_a_run_dark_when_it_ends() {
    for_all(Switches::all(), |switches| {
        let tent = Tent::new(switches, CAMERA);
        // Nobody reads what it says.
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut child = tent.lit(tent.command().stdout(writer.try_clone().unwrap()).stderr(writer));
        send("-TERM", child.id());
        child.wait().unwrap();
        println!("{switches:?}, lost output: dark {:?} after the end", tent.goes_dark("lost output"));
    });
}

#[test]
fn a_run_that_ends_by_itself_or_by_an_error_leaves_it_dark() {
    for_all(Switches::all(), |switches| {
        let tent = Tent::new(switches, CAMERA);
        let rig = tent.folder.path().join("rig.toml");
        let quick = fs::read_to_string(&rig).unwrap().replace("period_min = 5.0", "period_min = 0.02");
        fs::write(&rig, quick).unwrap();
        let output = tent.command().args(["--steps", "1"]).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        println!("{switches:?}, end: dark {:?} after it", tent.goes_dark("end"));

        let tent = Tent::new(switches, "driver = \"command\"\ncommand = [\"false\"]\nretries = 0");
        let output = tent.command().output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        println!("{switches:?}, error: dark {:?} after it", tent.goes_dark("error"));
    });
}

#[test]
fn devices_that_hang_at_the_end_are_put_off_by_the_guard_when_they_hear_again() {
    let ways = Switches::all().flat_map(|switches| ["-TERM", "-KILL"].map(|signal| (switches, signal)));
    for_all(ways, |(switches, signal)| {
        let tent = Tent::new(switches, CAMERA);
        let mut child = tent.lit(&mut tent.command());
        tent.devices.hang.store(true, Ordering::SeqCst);
        send(signal, child.id());
        child.wait().unwrap();
        assert!(!tent.is_dark(), "{switches:?}: a device that hangs stays as it is");
        tent.devices.hang.store(false, Ordering::SeqCst);
        let took = tent.goes_dark(signal);
        println!("{switches:?}, {signal} while they hang: dark {took:?} after they hear again");
    });
}

#[test]
fn a_run_that_is_stopped_for_good_is_killed_by_its_guard() {
    for_all(Switches::all(), |switches| {
        let tent = Tent::new(switches, CAMERA);
        let mut child = tent.lit(&mut tent.command());
        // Its own guard waits for minutes; this one listens to nobody.
        send("-STOP", child.id());
        let mut guard = tropism(tent.folder.path(), &["guard", "run", "--silence", "1"]);
        let mut guard = guard.stdin(Stdio::piped()).spawn().unwrap();
        let silent = guard.stdin.take();
        assert!(guard.wait().unwrap().success());
        drop(silent);
        assert!(!child.wait().unwrap().success());
        println!("{switches:?}, hang: dark {:?} after the guard's time", tent.goes_dark("hang"));
    });
}

#[test]
fn a_run_that_is_resumed_at_once_after_a_kill_keeps_its_light() {
    let tent = Tent::new(Switches::Wled, CAMERA);
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
    assert!(tent.devices.is_lit(), "the light of the resumed run");
    send("-TERM", again.id());
    again.wait().unwrap();
    tent.goes_dark("end");
}

#[test]
fn a_rig_that_a_run_drives_is_refused_to_another_run() {
    let tent = Tent::new(Switches::Wled, CAMERA);
    let mut child = tent.lit(&mut tent.command());
    let words = ["run", "--rig", "rig.toml", "--controller", "periodic", "--out", "other"];
    let output = tropism(tent.folder.path(), &words).output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && error.contains("driven by another run"), "{error}");
    assert!(tent.devices.is_lit(), "the first run goes on");
    send("-TERM", child.id());
    child.wait().unwrap();
    tent.goes_dark("end");
}
