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
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Mutex};
use std::thread::{self, sleep};
use std::time::{Duration, Instant};

use rumqttc::{Client, Event, MqttOptions, Packet, QoS};
use serde_json::{Value, json};
use tempfile::TempDir;
use testing::Mosquitto;
use tropism::programme::TimeOfDay;
use tropism::rig::Lamps;
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
    /// The most lamps that were lit at once, and the most power, in units of one at full power.
    peak: Mutex<(usize, f64)>,
    /// Whether they hear, but neither obey nor answer.
    hang: AtomicBool,
}

impl Devices {
    fn is_lit(&self) -> bool {
        self.states.lock().unwrap().values().any(|state| state["on"] == true)
    }

    /// Takes the state of a device, and what is lit then.
    fn take(&self, states: &mut BTreeMap<String, Value>, name: String, state: Value) {
        states.insert(name, state);
        let lamps = states.iter().filter(|(name, state)| *name != "flash" && state["on"] == true);
        // The brightness of a strip at full power is its `duty`, 0.5. A plug has none.
        let powers: Vec<f64> =
            lamps.map(|(_, state)| state["bri"].as_f64().unwrap_or(128.0) / 128.0).collect();
        let mut peak = self.peak.lock().unwrap();
        *peak = (peak.0.max(powers.len()), peak.1.max(powers.iter().sum()));
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
            devices.take(&mut states, segment["id"].to_string(), segment.clone());
        }
        json!({"on": true, "bri": 255, "seg": states.values().collect::<Vec<_>>()})
    };
    let answer = answer.to_string();
    write!(socket, "HTTP/1.1 200 OK\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{answer}", answer.len())
        .ok()
}

/// Starts Tasmota plugs of the names `left`, `right` and `flash` at a broker.
fn start_plugs(devices: &Arc<Devices>, port: u16) {
    let (client, mut connection) =
        Client::builder(MqttOptions::new("plugs", ("127.0.0.1", port))).capacity(16).build();
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
            let topic = String::from_utf8_lossy(&command.topic);
            let name = topic.split('/').nth(1).unwrap();
            let is_on = *command.payload == *b"ON";
            devices.take(&mut devices.states.lock().unwrap(), name.to_owned(), json!({"on": is_on}));
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
    let words = ["run", "--rig", "tent.toml", "--controller", "greedy", "--steps", "1", "--out", "tent"];
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
        Self::with_period(switches, camera, 5.0)
    }

    fn with_period(switches: Switches, camera: &str, period_min: f64) -> Self {
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
            "period_min = {period_min:?}\n[fault_policy]\nfree_mb = 0\nreserve_mb = 1\nhold_steps = 1000\npause_steps = 1000\n[camera]\n{camera}\n{light}settle_s = 0.01\nmax_on_s = 5.0\n\
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

    /// Waits until all light is off, not for long; how long it took.
    fn is_dark_within(&self, limit: Duration) -> Option<Duration> {
        let began = Instant::now();
        while !self.is_dark() {
            if began.elapsed() > limit {
                return None;
            }
            sleep(Duration::from_millis(20));
        }
        Some(began.elapsed())
    }

    /// Waits until all light is off; how long it took.
    #[track_caller]
    fn goes_dark(&self, way: &str) -> Duration {
        let log = || fs::read_to_string(self.folder.path().join("run/watchdog.log")).unwrap_or_default();
        self.is_dark_within(WITHIN)
            .unwrap_or_else(|| panic!("{way}: light after {WITHIN:?}; watchdog: {}", log()))
    }

    /// Starts a watchdog of the process `run` in this tent; its input comes with it.
    fn watchdog(&self, run: u32, silence_s: u64) -> (Child, ChildStdin) {
        let rig = fs::read_to_string(self.folder.path().join("rig.toml")).unwrap();
        let rig = toml::from_str(&rig).unwrap();
        let plan = tropism_lab::watchdog::WatchdogPlan { process: run, silence_s, rig };
        let mut watchdog = tropism(self.folder.path(), &["watchdog", "run"]);
        let mut watchdog = watchdog.stdin(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
        let mut pipe = watchdog.stdin.take().unwrap();
        write!(pipe, "{}\0", toml::to_string(&plan).unwrap()).unwrap();
        (watchdog, pipe)
    }

    fn events(&self) -> Vec<tropism::rig::Event> {
        let journal = self.folder.path().join("run/journal.sqlite");
        Journal::open_to_read(&journal).and_then(|journal| journal.events()).unwrap_or_default()
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

/// Waits for something that comes soon.
#[track_caller]
fn wait_for(what: &str, is_there: impl Fn() -> bool) {
    let began = Instant::now();
    while !is_there() {
        assert!(began.elapsed() < Duration::from_secs(60), "waited in vain for {what}");
        sleep(Duration::from_millis(20));
    }
}

/// The processes that `process` started and that still live, as Linux lists them.
fn children_of(process: u32) -> Vec<u32> {
    let is_child = |entry: &fs::DirEntry| {
        let stat = fs::read_to_string(entry.path().join("stat")).unwrap_or_default();
        let mut fields = stat.rsplit_once(')').map_or("", |(_, rest)| rest).split_whitespace();
        fields.next() != Some("Z") && fields.next() == Some(&*process.to_string())
    };
    let found = fs::read_dir("/proc").unwrap().flatten().filter(is_child);
    found.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).collect()
}

fn watchdogs_of(run: &Child) -> Vec<u32> {
    let is_watchdog = |process: &u32| {
        let words = fs::read_to_string(format!("/proc/{process}/cmdline")).unwrap_or_default();
        words.split('\0').any(|word| word == "watchdog")
    };
    children_of(run.id()).into_iter().filter(is_watchdog).collect()
}

#[track_caller]
fn watchdog_of(run: &Child) -> u32 {
    wait_for("a watchdog", || !watchdogs_of(run).is_empty());
    watchdogs_of(run)[0]
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

/// A programme that lights both lamps of an emulated rig: one steered, the other as its base light.
fn both_lit(tent: &Tent, base: &str, budget: f64) {
    let rig = tent.folder.path().join("rig.toml");
    let text = fs::read_to_string(&rig).unwrap();
    let lamps =
        format!("[lamps]\nallowed = {{ any = {{ most_lit = 2, budget = {budget:?} }} }}\n[lamps.left]");
    let programme = format!("\n[[programme]]\nfrom = \"00:00\"\nto = \"24:00\"\nbase = {base:?}\n");
    let zone = "time_zone = \"Europe/Berlin\"\n";
    fs::write(&rig, format!("{zone}{}{programme}", text.replacen("[lamps.left]", &lamps, 1))).unwrap();
}

#[test]
fn several_lit_lamps_go_dark_whatever_ends_the_run() {
    let ways = Switches::all().flat_map(|switches| ["-TERM", "-KILL"].map(|signal| (switches, signal)));
    for_all(ways, |(switches, signal)| {
        let tent = Tent::new(switches, CAMERA);
        both_lit(&tent, "left+right", 2.0);
        let mut child = tent.lit(&mut tent.command());
        assert_eq!(*tent.devices.peak.lock().unwrap(), (2, 2.0), "both are lit");
        send(signal, child.id());
        child.wait().unwrap();
        println!("{switches:?}, two lamps, {signal}: dark {:?} after the end", tent.goes_dark(signal));
        assert_eq!(*tent.devices.peak.lock().unwrap(), (2, 2.0), "nor was there ever more");
    });
}

#[test]
fn a_budget_is_never_exceeded_while_lamps_change_places() {
    for_all(Switches::all(), |switches| {
        let tent = Tent::new(switches, CAMERA);
        // Plugs are at full power or dark.
        let (base, budget) =
            if switches == Switches::Wled { ("left:51+right:51", 1.2) } else { ("dark", 1.0) };
        both_lit(&tent, base, budget);
        // Nothing here is about slow devices: a busy machine is given time.
        let rig = fs::read_to_string(tent.folder.path().join("rig.toml")).unwrap();
        let rig = rig.replace("timeout_s = 1.0", "timeout_s = 20.0");
        let rig: tropism_rig::file::RigFile = toml::from_str(&rig).unwrap();
        rig.check().unwrap();
        let (layout, acting) =
            (rig.layout().unwrap(), rig.programme().unwrap().unwrap().at(TimeOfDay::MIDNIGHT));
        let mut lamps = rig.lamps.as_ref().unwrap().open(rig.mqtt.as_ref()).unwrap();
        for _ in 0..5 {
            for light in layout.lights() {
                lamps.shine(acting.lighting(light.into())).unwrap();
            }
        }
        let (_, power) = *tent.devices.peak.lock().unwrap();
        // Brightness of WLED has steps of a 255th.
        assert!(power > budget - 0.01 && power < budget + 0.01, "{switches:?}: {power} full lamps");
        lamps.light(None).unwrap();
        assert!(tent.is_dark());
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
        // Devices are slow on a machine that is busy.
        let quick = quick.replace("timeout_s = 1.0", "timeout_s = 20.0");
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
fn devices_that_hang_at_the_end_are_put_off_by_the_watchdog_when_they_hear_again() {
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
fn a_run_that_is_stopped_for_good_is_killed_by_its_watchdog() {
    for_all(Switches::all(), |switches| {
        let tent = Tent::new(switches, CAMERA);
        let mut child = tent.lit(&mut tent.command());
        // Its own watchdog waits for minutes; this one hears nothing.
        send("-STOP", child.id());
        let (mut watchdog, silent) = tent.watchdog(child.id(), 1);
        assert!(watchdog.wait().unwrap().success());
        drop(silent);
        assert!(!child.wait().unwrap().success());
        println!("{switches:?}, hang: dark {:?} after the watchdog's time", tent.goes_dark("hang"));
    });
}

#[test]
fn a_watchdog_that_is_killed_or_hangs_is_replaced_and_the_run_says_so() {
    for_all(["-KILL", "-STOP", "-ABRT"], |signal| {
        let tent = Tent::with_period(Switches::Wled, CAMERA, 0.05);
        let mut child = tent.lit(&mut tent.command());
        let first = watchdog_of(&child);
        send(signal, first);
        wait_for("another watchdog", || watchdogs_of(&child).into_iter().any(|found| found != first));
        wait_for("an event", || {
            let events = tent.events();
            events.iter().any(|event| event.text.contains("watchdog ended"))
        });
        let status = tropism(tent.folder.path(), &["status", "run"]).output().unwrap();
        let status = String::from_utf8_lossy(&status.stdout).into_owned();
        assert!(status.contains("watchdog ended"), "{status}");
        wait_for("light", || tent.devices.is_lit());
        child.kill().unwrap();
        child.wait().unwrap();
        println!("watchdog {signal}, run -KILL: dark {:?} after it", tent.goes_dark(signal));
    });
}

#[test]
fn a_run_ends_in_order_beside_a_watchdog_that_hangs_and_leaves_its_light_to_another() {
    for_all([false, true], |devices_hang| {
        let tent = Tent::new(Switches::Wled, CAMERA);
        let mut child = tent.lit(&mut tent.command());
        send("-STOP", watchdog_of(&child));
        tent.devices.hang.store(devices_hang, Ordering::SeqCst);
        let began = Instant::now();
        send("-TERM", child.id());
        child.wait().unwrap();
        println!("watchdog -STOP, run -TERM: it ended after {:?}", began.elapsed());
        tent.devices.hang.store(false, Ordering::SeqCst);
        tent.goes_dark("-TERM beside a watchdog that hangs");
    });
}

#[test]
fn a_run_that_was_frozen_with_its_watchdog_goes_on() {
    let tent = Tent::new(Switches::Wled, CAMERA);
    // What stands in for the run: the test speaks for it.
    let mut child = Command::new("sleep").arg("60").spawn().unwrap();
    let (watchdog, mut pipe) = tent.watchdog(child.id(), 4);
    for _ in 0..2 {
        pipe.write_all(b".").unwrap();
        sleep(Duration::from_secs(1));
        send("-STOP", watchdog.id());
        sleep(Duration::from_secs(6));
        send("-CONT", watchdog.id());
        // The run wakes later than its watchdog.
        sleep(Duration::from_secs(1));
    }
    assert!(child.try_wait().unwrap().is_none(), "the run goes on");
    pipe.write_all(b"!").unwrap();
    assert!(watchdog.wait_with_output().unwrap().status.success());
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn a_run_folder_that_is_moved_or_deleted_keeps_no_lamp_lit() {
    for_all(
        Switches::all().flat_map(|switches| [(switches, true), (switches, false)]),
        |(switches, is_moved)| {
            let tent = Tent::new(switches, CAMERA);
            let mut child = tent.lit(&mut tent.command());
            let run = tent.folder.path().join("run");
            if is_moved {
                fs::rename(&run, tent.folder.path().join("moved")).unwrap();
            } else {
                fs::remove_dir_all(&run).unwrap();
            }
            child.kill().unwrap();
            child.wait().unwrap();
            println!(
                "{switches:?}, folder moved or deleted: dark {:?} after the kill",
                tent.goes_dark("moved")
            );
        },
    );
}

/// On a disk of its own, which needs the right to mount one.
#[test]
fn a_disk_that_fails_keeps_no_lamp_lit() {
    let image = tempfile::tempdir().unwrap();
    let sh = |script: &str, folder: &Path| {
        let done = Command::new("sh").args(["-c", script, "sh"]).arg(image.path()).arg(folder).output();
        done.is_ok_and(|done| done.status.success())
    };
    let make = "truncate -s 32M $1/disk && mkfs.ext4 -q -F $1/disk";
    let has_freeze = sh("command -v fsfreeze", image.path());
    for (how, fail, heal) in [
        ("read-only", "mount -o remount,abort $2/run; true", "true"),
        ("frozen", "fsfreeze -f $2/run", "fsfreeze -u $2/run"),
    ] {
        let tent = Tent::new(Switches::Wled, CAMERA);
        let folder = tent.folder.path();
        fs::create_dir(folder.join("run")).unwrap();
        if !(has_freeze && sh(make, folder) && sh("mount -o loop $1/disk $2/run", folder)) {
            println!("skipped: no disk can be mounted here");
            return;
        }
        let mut child = tent.lit(&mut tent.command());
        assert!(sh(fail, folder));
        child.kill().unwrap();
        child.wait().unwrap();
        let took = tent.is_dark_within(WITHIN);
        assert!(sh(heal, folder));
        // The watchdog lets go of its log.
        wait_for("the end of the disk", || sh("umount $2/run", folder));
        println!("disk {how}: dark {:?} after the kill", took.expect("dark"));
    }
}

#[test]
fn a_run_that_is_refused_leaves_no_watchdog() {
    let tent = Tent::new(Switches::Wled, CAMERA);
    let rig = tent.folder.path().join("rig.toml");
    let text = fs::read_to_string(&rig).unwrap();
    let keep = text.replace("[lamps.left]", "[lamps]\non_exit = \"keep\"\n[lamps.left]");
    fs::write(&rig, keep).unwrap();
    let mut child = tent.lit(&mut tent.command());
    // The same lamps, which this one would darken.
    fs::write(&rig, text).unwrap();
    let words = ["run", "--rig", "rig.toml", "--controller", "periodic", "--out", "other"];
    let refused = tropism(tent.folder.path(), &words).output().unwrap();
    assert_eq!(refused.status.code(), Some(1));
    assert!(!tent.folder.path().join("other/watchdog.log").exists());
    send("-TERM", child.id());
    child.wait().unwrap();
    sleep(Duration::from_secs(3));
    assert!(tent.devices.is_lit(), "the lamp that is to stay lit");
}

#[test]
fn a_run_that_is_resumed_at_once_after_a_kill_keeps_its_light() {
    let tent = Tent::new(Switches::Wled, CAMERA);
    let mut child = tent.lit(&mut tent.command());
    child.kill().unwrap();
    child.wait().unwrap();
    let mut again = tent.command().spawn().unwrap();
    // Its watchdog may put the light off before the run goes on, and not after.
    while !tent.events().iter().any(|event| event.kind == tropism::rig::EventKind::Resumed) {
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
    assert!(output.status.code() == Some(1) && error.contains("driven by another run (process"), "{error}");
    assert!(tent.devices.is_lit(), "the first run goes on");
    send("-TERM", child.id());
    child.wait().unwrap();
    tent.goes_dark("end");
}

/// The abstract sockets of a process, without their `@`.
#[cfg(target_os = "linux")]
fn abstract_sockets_of(process: u32) -> Vec<String> {
    let files = fs::read_dir(format!("/proc/{process}/fd")).unwrap().flatten();
    let targets: Vec<_> = files.filter_map(|file| fs::read_link(file.path()).ok()).collect();
    let all = fs::read_to_string("/proc/net/unix").unwrap();
    let name = |line: &str| {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let socket = format!("socket:[{}]", fields.get(6)?);
        let is_its = targets.iter().any(|target| target.as_os_str() == &*socket);
        is_its.then(|| Some(fields.get(7)?.strip_prefix('@')?.to_owned()))?
    };
    all.lines().filter_map(name).collect()
}

/// Needs the right to be another user.
#[cfg(target_os = "linux")]
#[test]
fn another_user_who_takes_the_locks_of_lamps_keeps_none_lit_and_is_named() {
    let as_nobody = |words: &[&str]| {
        let mut command = Command::new("setpriv");
        command.args(["--reuid", "65534", "--regid", "65534", "--clear-groups"]).args(words);
        command
    };
    let program = std::env::current_exe().unwrap();
    let program = program.to_str().unwrap();
    if !as_nobody(&[program, "--list"]).output().is_ok_and(|done| done.status.success()) {
        println!("skipped: no other user can be taken");
        return;
    }
    let tent = Tent::new(Switches::Wled, CAMERA);
    let mut child = tent.lit(&mut tent.command());
    let names = abstract_sockets_of(child.id());
    assert_eq!(names.len(), 3, "two lamps and a flash: {names:?}");
    let mut stranger = as_nobody(&[program, "--exact", "takes_locks_as_a_stranger", "--ignored"]);
    let mut stranger = stranger.env("TROPISM_NAMES", names.join(" ")).stdout(Stdio::null()).spawn().unwrap();
    sleep(Duration::from_secs(1));
    child.kill().unwrap();
    child.wait().unwrap();
    println!("locks taken by another user: dark {:?} after the kill", tent.goes_dark("stranger"));
    wait_for("the stranger", || abstract_sockets_of(stranger.id()).len() == 3);
    let refused = tent.command().output().unwrap();
    let error = String::from_utf8_lossy(&refused.stderr);
    let wanted = format!("driven by another run (process {} of user 65534)", stranger.id());
    assert!(refused.status.code() == Some(1) && error.contains(&wanted), "{error}");
    stranger.kill().unwrap();
    stranger.wait().unwrap();
}

/// What [`another_user_who_takes_the_locks_of_lamps_keeps_none_lit_and_is_named`] starts as another user.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "started by another test"]
fn takes_locks_as_a_stranger() {
    use std::os::linux::net::SocketAddrExt;
    use std::os::unix::net::{SocketAddr, UnixListener};
    let names = std::env::var("TROPISM_NAMES").unwrap();
    let take = |name: &str| loop {
        if let Ok(taken) = UnixListener::bind_addr(&SocketAddr::from_abstract_name(name).unwrap()) {
            return taken;
        }
    };
    let _taken: Vec<_> = names.split(' ').map(take).collect();
    sleep(Duration::from_secs(60));
}
