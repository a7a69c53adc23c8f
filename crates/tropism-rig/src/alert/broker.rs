//! MQTT: what goes on is kept by the broker, which itself says when we are lost.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

use rumqttc::{Client, Connection, Event, LastWill, MqttOptions, Packet, QoS, RecvTimeoutError};
use serde_json::{Value, json};
use tropism::rig::EventKind;
use tropism::rig::RigError;

use super::channel::{Channel, Order};
use super::{Happening, Kind, MqttAlert};
use crate::http::read_secret;
use crate::mqtt::Broker;

/// How long the thread listens to the broker before it looks for orders.
const LISTEN: Duration = Duration::from_millis(100);

/// How long the end may take.
const END: Duration = Duration::from_secs(5);

/// After a broken connection.
const AGAIN: Duration = Duration::from_secs(5);

/// Starts the thread that speaks with `broker`.
pub(super) fn start(broker: &Broker, alert: &MqttAlert, run: &str) -> Result<Channel, RigError> {
    let password = broker.password_file.as_deref().map(read_secret).transpose()?;
    let speaker = Speaker {
        broker: broker.clone(),
        password,
        alert: alert.clone(),
        run: run.to_owned(),
        status: json!({"schema": "tropism.status/1", "run": run, "state": "running"}),
        is_status_new: true,
        waiting: VecDeque::new(),
    };
    // The status is kept up by all that happens.
    Ok(Channel::of("mqtt", Kind::all().collect(), move |orders| speaker.speak(orders)))
}

struct Speaker {
    broker: Broker,
    password: Option<String>,
    alert: MqttAlert,
    run: String,
    /// What is kept at the broker.
    status: Value,
    is_status_new: bool,
    /// What passes through.
    waiting: VecDeque<Happening>,
}

/// How a connection came to its end.
enum Broken {
    ByOrder,
    Lost(String),
}

impl Speaker {
    fn topic(&self, name: &str) -> String {
        format!("{}/{name}", self.alert.topic)
    }

    /// A connection of its own after each that broke: nothing of the old one is repeated but what is not known to be
    /// there.
    fn speak(mut self, orders: &Receiver<Order>) -> Option<String> {
        let mut end = None;
        loop {
            let (client, mut connection) = self.connect();
            match self.attend(orders, &client, &mut connection, &mut end) {
                Broken::ByOrder => return None,
                Broken::Lost(problem) if end.is_some() => return Some(problem),
                Broken::Lost(_) => {}
            }
            self.is_status_new = true;
            let again = Instant::now() + AGAIN;
            while Instant::now() < again && end.is_none() {
                std::thread::sleep(LISTEN);
                self.take(orders, &mut end);
            }
        }
    }

    fn connect(&self) -> (Client, Connection) {
        let name = format!("tropism-run-{}", std::process::id());
        let mut options = MqttOptions::new(name, &self.broker.host, self.broker.port);
        options.set_clean_session(true).set_keep_alive(Duration::from_secs(15));
        let will = json!({"schema": "tropism.status/1", "run": self.run, "state": "lost"}).to_string();
        options.set_last_will(LastWill::new(self.topic("status"), will, QoS::AtLeastOnce, true));
        if let Some(username) = &self.broker.username {
            options.set_credentials(username, self.password.as_deref().unwrap_or_default());
        }
        Client::new(options, 16)
    }

    /// Takes what was ordered; sets `end` to when it must be over.
    fn take(&mut self, orders: &Receiver<Order>, end: &mut Option<Instant>) {
        loop {
            match orders.try_recv() {
                Ok(Order::Tell(happening)) => {
                    let mut status = happening.json(&self.run);
                    status["schema"] = "tropism.status/1".into();
                    status["state"] = match happening.kind {
                        Kind::Event(EventKind::Paused) => "paused",
                        Kind::Fault => "fault",
                        Kind::Event(EventKind::Stopped) => "stopped",
                        Kind::Event(EventKind::Finished) => "finished",
                        Kind::Test => "tried",
                        _ => "running",
                    }
                    .into();
                    self.status = status;
                    self.is_status_new = true;
                    if happening.kind == Kind::Test || self.alert.on.contains(&happening.kind) {
                        self.waiting.push_back(happening);
                    }
                }
                Ok(Order::End) | Err(TryRecvError::Disconnected) => {
                    end.get_or_insert_with(|| Instant::now() + END);
                    return;
                }
                Err(TryRecvError::Empty) => return,
            }
        }
    }

    fn attend(
        &mut self,
        orders: &Receiver<Order>,
        client: &Client,
        connection: &mut Connection,
        end: &mut Option<Instant>,
    ) -> Broken {
        let mut is_connected = false;
        // One message is under way at a time: what the broker acknowledges is known.
        let mut under_way: Option<bool> = None;
        loop {
            match connection.recv_timeout(LISTEN) {
                Ok(Ok(Event::Incoming(Packet::ConnAck(_)))) => is_connected = true,
                Ok(Ok(Event::Incoming(Packet::PubAck(_)))) => {
                    if under_way.take() == Some(true) {
                        self.waiting.pop_front();
                    }
                }
                Ok(Ok(_)) | Err(RecvTimeoutError::Timeout) => {}
                Ok(Err(error)) => return Broken::Lost(error.to_string()),
                Err(RecvTimeoutError::Disconnected) => {
                    return Broken::Lost("the connection ended".to_owned());
                }
            }
            self.take(orders, end);
            if end.is_some_and(|end| end <= Instant::now()) {
                return Broken::Lost("found no answer from the broker in time, wanted one".to_owned());
            }
            if !is_connected || under_way.is_some() {
                continue;
            }
            let sent = if let Some(happening) = self.waiting.front() {
                under_way = Some(true);
                let text = happening.json(&self.run).to_string();
                client.try_publish(self.topic("event"), QoS::AtLeastOnce, false, text)
            } else if std::mem::take(&mut self.is_status_new) {
                under_way = Some(false);
                client.try_publish(self.topic("status"), QoS::AtLeastOnce, true, self.status.to_string())
            } else if end.is_some() {
                // In order, so that the broker does not speak our last will.
                let _ = client.try_disconnect();
                while let Ok(Ok(_)) = connection.recv_timeout(LISTEN) {}
                return Broken::ByOrder;
            } else {
                Ok(())
            };
            if let Err(error) = sent {
                return Broken::Lost(error.to_string());
            }
        }
    }
}
