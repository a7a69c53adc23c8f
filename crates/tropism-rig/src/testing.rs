//! Shared parts of the tests of drivers. Nothing here waits for ever.

use std::fs::File;
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rumqttc::{Client, Connection, Event, MqttOptions, Packet};

/// Time limit of a wait: chosen far longer than any test takes on a busy machine.
const TIMEOUT: Duration = Duration::from_secs(60);

/// Waits until `what` holds.
#[track_caller]
pub(crate) fn wait_until(what: impl Fn() -> bool) {
    let started = Instant::now();
    while !what() {
        assert!(started.elapsed() < TIMEOUT, "waited {TIMEOUT:?} in vain");
        thread::sleep(Duration::from_millis(2));
    }
}

/// Reads packets from a broker until one is `wanted`.
#[track_caller]
pub(crate) fn hear(connection: &mut Connection, wanted: impl Fn(&Packet) -> bool) {
    let started = Instant::now();
    loop {
        let left = TIMEOUT.checked_sub(started.elapsed()).expect("the broker says it in time");
        match connection.recv_timeout(left) {
            Ok(Ok(Event::Incoming(packet))) if wanted(&packet) => return,
            Ok(_) => {}
            Err(error) => panic!("listening to the broker: {error:?}"),
        }
    }
}

/// A mosquitto process that is killed when it is dropped.
pub(crate) struct Mosquitto {
    pub(crate) port: u16,
    child: Child,
    /// Keeps the port from other tests.
    lock: Option<File>,
}

fn lock_of(port: u16) -> PathBuf {
    std::env::temp_dir().join(format!("tropism-test-port-{port}"))
}

/// A port that no other test has, as long as the file is open. A broker binds it later than it is found, and until then the one
/// of another test could answer there.
fn free_port() -> (u16, Option<File>) {
    loop {
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let lock = File::create(lock_of(port)).unwrap();
        if lock.try_lock().is_ok() {
            return (port, Some(lock));
        }
    }
}

impl Mosquitto {
    /// `None` where it is not installed.
    pub(crate) fn start(port: Option<u16>) -> Option<Self> {
        let set_up = |command: &mut Command, port: u16| {
            command.args(["-p", &port.to_string()]);
        };
        Self::start_by(port, set_up, Self::answers)
    }

    /// A broker with further lines of a configuration file, which is written into `folder`.
    #[cfg_attr(not(feature = "tls"), expect(dead_code, reason = "for encrypted brokers"))]
    pub(crate) fn start_with(folder: &std::path::Path, lines: &str) -> Option<Self> {
        let set_up = |command: &mut Command, port: u16| {
            let config = folder.join("mosquitto.conf");
            let text = format!("listener {port} 127.0.0.1\nallow_anonymous true\nuser root\n{lines}");
            std::fs::write(&config, text).unwrap();
            command.arg("-c").arg(config);
        };
        Self::start_by(None, set_up, |broker| TcpStream::connect(("127.0.0.1", broker.port)).is_ok())
    }

    /// A broker on `port`, or on a free one, whose command `set_up` completes, once it `answers`.
    fn start_by(
        port: Option<u16>,
        set_up: impl Fn(&mut Command, u16),
        answers: impl Fn(&Self) -> bool,
    ) -> Option<Self> {
        let program = ["/usr/sbin/mosquitto", "/usr/bin/mosquitto"]
            .into_iter()
            .find(|path| std::path::Path::new(path).is_file());
        let Some(program) = program else {
            eprintln!("skipped: wants mosquitto, which is not installed");
            return None;
        };
        let started = Instant::now();
        loop {
            let (port, lock) = port.map_or_else(free_port, |port| (port, None));
            let mut command = Command::new(program);
            set_up(&mut command, port);
            let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
            let mut broker = Self { port, child, lock };
            // Another program may have taken the port meanwhile; then this broker has ended.
            while broker.child.try_wait().unwrap().is_none() {
                if answers(&broker) && broker.child.try_wait().unwrap().is_none() {
                    return Some(broker);
                }
                assert!(started.elapsed() < TIMEOUT, "no broker on port {port}");
                thread::sleep(Duration::from_millis(10));
            }
            assert!(started.elapsed() < TIMEOUT, "mosquitto ends on port {port}");
        }
    }

    /// Whether a broker accepts a connection.
    fn answers(&self) -> bool {
        let (_client, mut connection) =
            Client::builder(MqttOptions::new("knock", ("127.0.0.1", self.port))).capacity(1).build();
        matches!(connection.recv_timeout(Duration::from_secs(1)), Ok(Ok(Event::Incoming(Packet::ConnAck(_)))))
    }

    pub(crate) fn signal(&self, signal: rustix::process::Signal) {
        rustix::process::kill_process(rustix::process::Pid::from_child(&self.child), signal).unwrap();
    }
}

impl Drop for Mosquitto {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        self.child.wait().unwrap();
        if self.lock.is_some() {
            let _ = std::fs::remove_file(lock_of(self.port));
        }
    }
}
