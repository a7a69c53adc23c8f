//! A watcher of a wall of nodes over MQTT.
//!
//! In: what all nodes of an experiment say. Out: each new message, once; and the order to all nodes to steer, or to be dark. Nodes do
//! not need a watcher, and do not notice when it ends.

use std::thread;
use std::time::{Duration, Instant};

use rumqttc::{Client, Event, Packet, Publish, QoS, RecvTimeoutError};
use tropism::nodes::NodeMessage;
use tropism::rig::RigError;

use crate::broker::Broker;
use crate::failed;
use crate::node::{check_name, parts, start_topic, topic};

/// Messages that may wait for the network. Chosen: subscriptions and an order.
const WAITING: usize = 64;
/// Longest wait before a request to end is looked at, and before a connection is tried again.
const LOOK: Duration = Duration::from_millis(100);
/// How long an order is waited for at the end.
const ORDER: Duration = Duration::from_secs(5);

/// The wall that is watched.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WallWatch {
    /// Name of the experiment: 1 to 64 letters, digits, `-` or `_`.
    pub experiment: String,
    /// Names of the nodes.
    pub names: Vec<String>,
}

/// What a watcher hears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heard {
    /// The message of a node, by its number, in a step from which none was heard.
    Said(usize, NodeMessage),
    /// Whether a node, by its number, is alive.
    Alive(usize, bool),
    /// Whether the nodes are to steer; otherwise they are dark.
    Started(bool),
}

impl WallWatch {
    /// Checks the names.
    ///
    /// # Errors
    /// What was found, and what is wanted.
    pub fn check(&self) -> Result<(), String> {
        self.names.iter().chain([&self.experiment]).try_for_each(|name| check_name(name))
    }

    /// Watches until `is_over`. `hear` gets what is heard; what it returns is the order to all nodes to steer (`true`) or to be dark,
    /// if it returns one. `order` is given at the beginning.
    ///
    /// # Errors
    /// [`RigError::Device`] if the broker is not found within `patience`, or an order was not taken by it.
    pub fn run(
        &self,
        broker: &Broker,
        order: Option<bool>,
        patience: Duration,
        is_over: &dyn Fn() -> bool,
        hear: &mut dyn FnMut(Heard) -> Option<bool>,
    ) -> Result<(), RigError> {
        let problem = |problem: String| failed(format!("wall {}", self.experiment), problem);
        self.check().map_err(problem)?;
        // Two watchers of one experiment must not throw each other out.
        let name = format!("tropism-{}-watch-{}", self.experiment, std::process::id());
        let (client, mut connection) = broker.opened()?.connect(name, WAITING, |_| {});
        let mut steps: Vec<Option<u32>> = vec![None; self.names.len()];
        let (mut was_connected, begun) = (false, Instant::now());
        let (mut orders, mut taken) = (0_u32, 0_u32);
        let mut over_since: Option<Instant> = None;
        loop {
            if over_since.is_none() && is_over() {
                over_since = Some(Instant::now());
            }
            if over_since.is_some_and(|since| orders == taken || since.elapsed() >= ORDER) {
                break;
            }
            let order = match connection.recv_timeout(LOOK) {
                Ok(Ok(Event::Incoming(Packet::ConnAck(_)))) => {
                    self.subscribe(&client).map_err(problem)?;
                    let first = order.filter(|_| !was_connected);
                    was_connected = true;
                    first
                }
                Ok(Ok(Event::Incoming(Packet::Publish(message)))) => {
                    self.heard(&message, &mut steps).and_then(&mut *hear)
                }
                Ok(Ok(Event::Incoming(Packet::PubAck(_)))) => {
                    taken += 1;
                    None
                }
                Ok(Ok(_)) | Err(RecvTimeoutError::Timeout) => None,
                Ok(Err(error)) => {
                    if !was_connected && begun.elapsed() >= patience {
                        return Err(problem(format!("the broker does not answer: {error}")));
                    }
                    thread::sleep(LOOK);
                    None
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(problem("the connection ended".to_owned()));
                }
            };
            if let Some(is_started) = order {
                let text = if is_started { "1" } else { "0" };
                client
                    .try_publish(start_topic(&self.experiment), QoS::AtLeastOnce, true, text)
                    .map_err(|error| problem(error.to_string()))?;
                orders += 1;
            }
        }
        let _ = client.try_disconnect();
        if orders > taken {
            return Err(problem("the broker did not take the order to all nodes".to_owned()));
        }
        Ok(())
    }

    fn subscribe(&self, client: &Client) -> Result<(), String> {
        let nodes = self
            .names
            .iter()
            .flat_map(|name| ["state", "alive"].map(|what| topic(&self.experiment, name, what)));
        nodes.chain([start_topic(&self.experiment)]).try_for_each(|topic| {
            client.try_subscribe(topic, QoS::AtLeastOnce).map_err(|error| error.to_string())
        })
    }

    fn heard(&self, publish: &Publish, steps: &mut [Option<u32>]) -> Option<Heard> {
        let topic = std::str::from_utf8(&publish.topic).ok()?;
        let text = std::str::from_utf8(&publish.payload).ok()?;
        if topic == start_topic(&self.experiment) {
            return Some(Heard::Started(text == "1"));
        }
        let (name, what) = parts(&self.experiment, topic)?;
        let node = self.names.iter().position(|known| known == name)?;
        if what == "alive" {
            return Some(Heard::Alive(node, text != "offline"));
        }
        let message: NodeMessage = serde_json::from_str(text).ok()?;
        // Numbered steps: what was doubled on its way counts once.
        let is_new = steps[node].is_none_or(|known| message.step > known);
        is_new.then(|| {
            steps[node] = Some(message.step);
            Heard::Said(node, message)
        })
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::node::tests::{Running, Sensors, process};
    use crate::testing::Mosquitto;

    #[test]
    fn a_watcher_starts_nodes_hears_them_and_puts_them_dark() {
        let Some(mosquitto) = Mosquitto::start(None) else { return };
        let (_sensors, _client) = Sensors::start("w", mosquitto.port);
        let begun = Instant::now();
        let nodes = [1, 2, 3].map(|number| Running::start(process("w", number), mosquitto.port, begun));
        let watch =
            WallWatch { experiment: "w".to_owned(), names: ["n1", "n2", "n3"].map(str::to_owned).to_vec() };
        let broker = Broker::new("127.0.0.1", mosquitto.port);
        let (mut latest, is_over) = ([NodeMessage::default(); 3], Cell::new(false));
        let (mut alive, mut has_lit, mut ended) = ([false; 3], false, false);
        watch
            .run(&broker, Some(true), Duration::from_secs(30), &|| is_over.get(), &mut |heard| {
                match heard {
                    Heard::Said(node, message) => {
                        assert!(message.step > latest[node].step || latest[node].step == 0);
                        latest[node] = message;
                    }
                    Heard::Alive(node, is_alive) => alive[node] = is_alive,
                    Heard::Started(is_started) => ended = !is_started,
                }
                let is_lit = latest[0].level > 0;
                is_over.set(has_lit && ended && !is_lit);
                let order = (is_lit && !has_lit).then_some(false);
                has_lit |= is_lit;
                order
            })
            .unwrap();
        assert_eq!((alive, has_lit, ended), ([true; 3], true, true));
        assert!(nodes.iter().all(|node| node.message().level == 0));
    }

    #[test]
    fn a_broker_that_is_not_there_and_names_that_cannot_be_are_told() {
        let watch = |experiment: &str| {
            let watch = WallWatch { experiment: experiment.to_owned(), names: vec!["n1".to_owned()] };
            let broker = Broker::new("127.0.0.1", 1);
            let patience = Duration::from_millis(300);
            watch.run(&broker, None, patience, &|| false, &mut |_| None).unwrap_err().to_string()
        };
        assert!(watch("e").contains("the broker does not answer"));
        assert!(watch("e/#").contains("found name"));
    }
}
