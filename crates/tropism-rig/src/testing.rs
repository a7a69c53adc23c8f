//! What the tests of several drivers wait for; nothing here waits for ever.

use std::net::TcpListener;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rumqttc::{Client, Connection, Event, MqttOptions, Packet};

/// Far longer than anything here takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// Waits until `what` holds.
#[track_caller]
pub(crate) fn wait_until(what: impl Fn() -> bool) {
    let started = Instant::now();
    while !what() {
        assert!(started.elapsed() < PATIENCE, "waited {PATIENCE:?} in vain");
        thread::sleep(Duration::from_millis(2));
    }
}

/// Listens to a broker until it says what is `wanted`.
#[track_caller]
pub(crate) fn hear(connection: &mut Connection, wanted: impl Fn(&Packet) -> bool) {
    let started = Instant::now();
    loop {
        let left = PATIENCE.checked_sub(started.elapsed()).expect("the broker says it in time");
        match connection.recv_timeout(left) {
            Ok(Ok(Event::Incoming(packet))) if wanted(&packet) => return,
            Ok(_) => {}
            Err(error) => panic!("listening to the broker: {error:?}"),
        }
    }
}

/// A broker that is killed when it goes.
pub(crate) struct Mosquitto {
    pub(crate) port: u16,
    child: Child,
}

impl Mosquitto {
    /// `None` where it is not installed.
    pub(crate) fn start(port: Option<u16>) -> Option<Self> {
        let program = ["/usr/sbin/mosquitto", "/usr/bin/mosquitto"]
            .into_iter()
            .find(|path| std::path::Path::new(path).is_file());
        let Some(program) = program else {
            eprintln!("skipped: wants mosquitto, which is not installed");
            return None;
        };
        let started = Instant::now();
        loop {
            let free = || TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
            let port = port.unwrap_or_else(free);
            let child = Command::new(program)
                .args(["-p", &port.to_string()])
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .unwrap();
            let mut broker = Self { port, child };
            // Another test may have been given the same port in the meantime; then the broker is gone, and whoever
            // answers there is somebody else.
            while broker.child.try_wait().unwrap().is_none() {
                if broker.answers() && broker.child.try_wait().unwrap().is_none() {
                    return Some(broker);
                }
                assert!(started.elapsed() < PATIENCE, "no broker on port {port}");
                thread::sleep(Duration::from_millis(10));
            }
            assert!(started.elapsed() < PATIENCE, "mosquitto ends on port {port}");
        }
    }

    /// Whether a broker lets somebody in.
    fn answers(&self) -> bool {
        let (_client, mut connection) = Client::new(MqttOptions::new("knock", "127.0.0.1", self.port), 1);
        matches!(connection.recv_timeout(Duration::from_secs(1)), Ok(Ok(Event::Incoming(Packet::ConnAck(_)))))
    }

    pub(crate) fn signal(&self, signal: rustix::process::Signal) {
        rustix::process::kill_process(rustix::process::Pid::from_child(&self.child), signal).unwrap();
    }
}

impl Drop for Mosquitto {
    fn drop(&mut self) {
        // It may be dead already.
        let _ = self.child.kill();
        self.child.wait().unwrap();
    }
}
