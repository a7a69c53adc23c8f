//! Alerts by MQTT: a retained status, each event, and a last will that says when the connection is lost; for Home Assistant
//! photographs, an announcement, and a button that stops the run.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

use rumqttc::{Client, Connection, Event, LastWill, Packet, QoS, RecvTimeoutError};
use serde_json::{Value, json};
use tropism::rig::EventKind;
use tropism::rig::RigError;

use super::channel::{Channel, Command};
use super::discovery::{STOP, announcement};
use super::{AlertEvent, Kind, MqttAlert, Origin, Seen};
use crate::broker::Broker;

/// How long the thread listens to the broker before it reads commands: chosen by hand.
const LISTEN: Duration = Duration::from_millis(100);

/// Time limit of the end: chosen by hand.
const END_TIMEOUT: Duration = Duration::from_secs(5);

/// Pause after a broken connection: chosen by hand.
const RECONNECT_PAUSE: Duration = Duration::from_secs(5);

/// Largest photograph that is sent, in bytes: chosen, more than a JPEG of 50 megapixels has.
const MOST_BYTES: usize = 32 << 20;

/// Starts the thread that publishes to `broker`. It sets `is_stopped` when somebody asks for an end of the run.
pub(super) fn start(
    broker: &Broker,
    alert: &MqttAlert,
    origin: &Origin,
    is_stopped: Arc<AtomicBool>,
) -> Result<Channel, RigError> {
    let publisher = Publisher {
        broker: broker.opened()?,
        alert: alert.clone(),
        origin: origin.clone(),
        status: json!({"schema": "tropism.status/1", "run": origin.run, "state": "running"}),
        is_status_new: true,
        seen: None,
        is_photograph_new: false,
        is_announced: false,
        is_stopped,
        queue: VecDeque::new(),
    };
    // Every kind of event updates the status.
    Ok(Channel::of("mqtt", Kind::all().collect(), move |commands| publisher.run(commands)))
}

struct Publisher {
    broker: Broker,
    alert: MqttAlert,
    origin: Origin,
    /// The retained status.
    status: Value,
    is_status_new: bool,
    /// The latest step.
    seen: Option<Seen>,
    is_photograph_new: bool,
    /// Whether the run was announced on this connection.
    is_announced: bool,
    is_stopped: Arc<AtomicBool>,
    /// Events that are not yet acknowledged.
    queue: VecDeque<AlertEvent>,
}

/// Why a connection ended.
enum Disconnect {
    Commanded,
    Lost(String),
}

impl Publisher {
    fn topic(&self, name: &str) -> String {
        format!("{}/{name}", self.alert.topic)
    }

    /// The announcement, once on each connection.
    fn announcement(&mut self) -> Option<(String, String)> {
        let is_new = !std::mem::replace(&mut self.is_announced, true);
        let (topic, text) = announcement(&self.alert, &self.origin).filter(|_| is_new)?;
        Some((topic, text.to_string()))
    }

    /// The latest photograph, once. One that cannot be read is not sent: the run itself says what is wrong with its disk.
    fn photograph(&mut self) -> Option<Vec<u8>> {
        let seen = self.seen.as_ref().filter(|_| std::mem::take(&mut self.is_photograph_new))?;
        // The topic and the header of the packet take some bytes.
        std::fs::read(&seen.photograph).ok().filter(|bytes| bytes.len() < MOST_BYTES - 4096)
    }

    /// Publishes until the end. Each reconnection uses a new client, and repeats only what was not acknowledged.
    fn run(mut self, commands: &Receiver<Command>) -> Option<String> {
        let mut end = None;
        loop {
            let (client, mut connection) = self.connect();
            match self.publish(commands, &client, &mut connection, &mut end) {
                Disconnect::Commanded => return None,
                Disconnect::Lost(problem) if end.is_some() => return Some(problem),
                Disconnect::Lost(_) => {}
            }
            self.is_status_new = true;
            self.is_announced = false;
            let reconnect_at = Instant::now() + RECONNECT_PAUSE;
            while Instant::now() < reconnect_at && end.is_none() {
                std::thread::sleep(LISTEN);
                self.read_commands(commands, &mut end);
            }
        }
    }

    fn connect(&self) -> (Client, Connection) {
        let name = format!("tropism-run-{}", std::process::id());
        let will = json!({"schema": "tropism.status/1", "run": self.origin.run, "state": "lost"}).to_string();
        self.broker.connect(name, 16, |options| {
            options.set_keep_alive(15);
            options.set_max_packet_size(MOST_BYTES, MOST_BYTES);
            options.set_last_will(LastWill::new(self.topic("status"), will, QoS::AtLeastOnce, true));
        })
    }

    /// Reads all commands; sets `end` to the deadline once the end is commanded.
    fn read_commands(&mut self, commands: &Receiver<Command>, end: &mut Option<Instant>) {
        loop {
            match commands.try_recv() {
                Ok(Command::Send(event)) => {
                    if let Some(seen) = &event.seen {
                        self.is_photograph_new = self.alert.discovery.is_some();
                        self.seen = Some(seen.clone());
                    }
                    let mut status = event.json(&self.origin);
                    status["schema"] = "tropism.status/1".into();
                    status["state"] = match event.kind {
                        Kind::Event(EventKind::Paused) => "paused",
                        Kind::Event(EventKind::Fault) => "fault",
                        Kind::Event(EventKind::Stopped) => "stopped",
                        Kind::Event(EventKind::Finished) => "finished",
                        Kind::Test => "tried",
                        _ => "running",
                    }
                    .into();
                    if let Some(Value::Object(seen)) = self.seen.as_ref().map(|seen| json!(seen)) {
                        status.as_object_mut().expect("an object").extend(seen);
                    }
                    self.status = status;
                    self.is_status_new = true;
                    if event.kind == Kind::Test || self.alert.on.contains(&event.kind) {
                        self.queue.push_back(event);
                    }
                }
                Ok(Command::End) | Err(TryRecvError::Disconnected) => {
                    end.get_or_insert_with(|| Instant::now() + END_TIMEOUT);
                    return;
                }
                Err(TryRecvError::Empty) => return,
            }
        }
    }

    fn publish(
        &mut self,
        commands: &Receiver<Command>,
        client: &Client,
        connection: &mut Connection,
        end: &mut Option<Instant>,
    ) -> Disconnect {
        let mut is_connected = false;
        // One message in flight at a time, so that its acknowledgement is known.
        let mut in_flight: Option<bool> = None;
        loop {
            match connection.recv_timeout(LISTEN) {
                Ok(Ok(Event::Incoming(Packet::ConnAck(_)))) => {
                    is_connected = true;
                    if self.alert.discovery.is_some()
                        && let Err(error) = client.try_subscribe(self.topic("command"), QoS::AtLeastOnce)
                    {
                        return Disconnect::Lost(error.to_string());
                    }
                }
                // What the broker had kept is no order of now.
                Ok(Ok(Event::Incoming(Packet::Publish(order)))) if !order.retain => {
                    if order.payload.trim_ascii() == STOP.as_bytes() {
                        self.is_stopped.store(true, Ordering::SeqCst);
                    }
                }
                Ok(Ok(Event::Incoming(Packet::PubAck(_)))) => {
                    if in_flight.take() == Some(true) {
                        self.queue.pop_front();
                    }
                }
                Ok(Ok(_)) | Err(RecvTimeoutError::Timeout) => {}
                Ok(Err(error)) => return Disconnect::Lost(error.to_string()),
                Err(RecvTimeoutError::Disconnected) => {
                    return Disconnect::Lost("the connection ended".to_owned());
                }
            }
            self.read_commands(commands, end);
            if end.is_some_and(|end| end <= Instant::now()) {
                return Disconnect::Lost("no answer from the broker in time".to_owned());
            }
            if !is_connected || in_flight.is_some() {
                continue;
            }
            let sent = if let Some((topic, text)) = self.announcement() {
                in_flight = Some(false);
                client.try_publish(topic, QoS::AtLeastOnce, true, text)
            } else if let Some(event) = self.queue.front() {
                in_flight = Some(true);
                let text = event.json(&self.origin).to_string();
                client.try_publish(self.topic("event"), QoS::AtLeastOnce, false, text)
            } else if std::mem::take(&mut self.is_status_new) {
                in_flight = Some(false);
                client.try_publish(self.topic("status"), QoS::AtLeastOnce, true, self.status.to_string())
            } else if let Some(photograph) = self.photograph() {
                in_flight = Some(false);
                client.try_publish(self.topic("photograph"), QoS::AtLeastOnce, true, photograph)
            } else if end.is_some() {
                // A regular disconnect, so that the broker does not publish the last will.
                let _ = client.try_disconnect();
                while let Ok(Ok(_)) = connection.recv_timeout(LISTEN) {}
                return Disconnect::Commanded;
            } else {
                Ok(())
            };
            if let Err(error) = sent {
                return Disconnect::Lost(error.to_string());
            }
        }
    }
}
