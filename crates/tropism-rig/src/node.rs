//! One node of a wall over MQTT: its sensor, its lamp and its neighbours.
//!
//! In: readings of the sensor and messages of neighbours. Out: the level of the lamp, and the node's own message, once a step.
//! The idea: there is no central process. Each message holds the whole state of a node and is retained, so that lost and doubled
//! messages and restarts do no harm. Below `tropism/wall/EXPERIMENT/` are
//!
//! | topic | from | content |
//! |---|---|---|
//! | `start` | the user, retained | `1`: the plant is there |
//! | `NAME/state` | the node, retained | a [`NodeMessage`] in JSON |
//! | `NAME/alive` | the node and its last will, retained | `online` or `offline` |
//! | `NAME/reading` | its sensor | natural logarithm of the echo; `null` for none |
//! | `NAME/level` | the node | 0 to 255: what a lamp without Tasmota obeys |
//! | `NAME/lamp` | its lamp, if it can | the level that it has, 0 to 255 |
//!
//! A lamp with Tasmota is dimmed by `cmnd/DEVICE/Dimmer` (0 to 100) and answers in `stat/DEVICE/RESULT`. The experiment stands in
//! each topic, so what an earlier one left retained starts nothing. A lamp needs a timer of its own of some steps: it goes dark
//! when its node or the broker is gone.
//!
//! # References
//! Tasmota, "Commands": <https://tasmota.github.io/docs/Commands/>.

use std::collections::BTreeMap;
use std::thread;
use std::time::{Duration, Instant};

use rumqttc::{Client, Event, LastWill, Packet, Publish, QoS, RecvTimeoutError};
use serde_json::Value;
use tropism::math::statistics::mean;
use tropism::nodes::{FRESH_STEPS, Neighbour, NodeController, NodeMessage, NodeView};
use tropism::rig::RigError;

use crate::broker::Broker;
use crate::failed;

/// Longest message that is read, in bytes. Chosen: a state has some 500.
const MAX_BYTES: usize = 16 << 10;
/// Messages that may wait for the network. Chosen: subscriptions and the messages of some steps.
const WAITING: usize = 64;
/// Pause after a broken connection.
const RETRY: Duration = Duration::from_millis(500);
/// Longest wait before a request to end is looked at.
const LOOK: Duration = Duration::from_millis(100);

/// A node, its neighbours and its lamp.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeProcess {
    /// Name of the experiment: 1 to 64 letters, digits, `-` or `_`.
    pub experiment: String,
    /// Name of the node.
    pub name: String,
    /// Whether it is on the drawn path.
    pub is_on_path: bool,
    /// The node before it on the path.
    pub previous: Option<String>,
    /// The node after it on the path.
    pub next: Option<String>,
    /// The other nodes of its level.
    pub siblings: Vec<String>,
    /// Time from one step to the next.
    pub period: Duration,
    /// Name of its lamp, if that has Tasmota.
    pub tasmota: Option<String>,
}

/// A topic of a node.
pub(crate) fn topic(experiment: &str, name: &str, what: &str) -> String {
    format!("tropism/wall/{experiment}/{name}/{what}")
}

/// The topic that starts an experiment.
pub(crate) fn start_topic(experiment: &str) -> String {
    format!("tropism/wall/{experiment}/start")
}

/// The name and the last part of a topic of a node; `None` of any other.
pub(crate) fn parts<'t>(experiment: &str, topic: &'t str) -> Option<(&'t str, &'t str)> {
    let rest = topic.strip_prefix("tropism/wall/")?.strip_prefix(experiment)?;
    rest.strip_prefix('/')?.split_once('/')
}

/// Checks a name that stands in a topic.
pub(crate) fn check_name(name: &str) -> Result<(), String> {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || letter == '-' || letter == '_';
    if (1..=64).contains(&name.len()) && name.chars().all(is_plain) {
        return Ok(());
    }
    Err(format!("found name {name:?}, wanted 1 to 64 letters, digits, - or _"))
}

/// What a node has heard.
#[derive(Default)]
struct Heard {
    is_started: bool,
    /// Latest reading, and the step in which it came.
    reading: Option<(f64, u32)>,
    /// Level that the lamp reported last.
    lamp: Option<u8>,
    messages: BTreeMap<String, NodeMessage>,
    offline: BTreeMap<String, bool>,
    /// Its own last message, of an earlier process.
    own: Option<NodeMessage>,
}

impl NodeProcess {
    /// Checks the names.
    ///
    /// # Errors
    /// What was found, and what is wanted.
    pub fn check(&self) -> Result<(), String> {
        let names = [Some(&self.experiment), Some(&self.name), self.tasmota.as_ref()];
        names.into_iter().flatten().try_for_each(|name| check_name(name))
    }

    pub(crate) fn topic(&self, name: &str, what: &str) -> String {
        topic(&self.experiment, name, what)
    }

    /// Runs the node until `is_over`. Its first step comes a period after the first connection. While the broker is away later
    /// the node keeps its state, and its lamp goes dark by its own timer. `watch` hears each message.
    ///
    /// `step_of` is the number of the present step: of a clock that goes on over restarts, as numbers must grow.
    ///
    /// # Errors
    /// [`RigError::Device`] if the broker refuses the node or is not found within `timeout`.
    pub fn run(
        &self,
        broker: &Broker,
        controller: &mut dyn NodeController,
        timeout: Duration,
        step_of: &dyn Fn() -> u32,
        is_over: &dyn Fn() -> bool,
        watch: &mut dyn FnMut(&NodeMessage),
    ) -> Result<(), RigError> {
        let problem = |problem: String| failed(format!("node {}", self.name), problem);
        self.check().map_err(problem)?;
        let alive = self.topic(&self.name, "alive");
        let name = format!("tropism-{}-{}", self.experiment, self.name);
        let (client, mut connection) = broker.opened()?.connect(name, WAITING, |options| {
            options.set_max_packet_size(MAX_BYTES, MAX_BYTES);
            options.set_keep_alive(5);
            options.set_last_will(LastWill::new(&alive, "offline", QoS::AtLeastOnce, true));
        });
        let mut heard = Heard::default();
        let (mut is_connected, mut was_connected, mut has_restarted) = (false, false, false);
        let begun = Instant::now();
        let mut next_step = begun;
        while !is_over() {
            let wait = if was_connected { next_step.saturating_duration_since(Instant::now()) } else { LOOK };
            let wait = wait.min(LOOK);
            match connection.recv_timeout(wait) {
                Ok(Ok(Event::Incoming(Packet::ConnAck(_)))) => {
                    if !was_connected {
                        // What is retained, its own memory too, arrives before the first step.
                        next_step = Instant::now() + self.period;
                    }
                    (is_connected, was_connected) = (true, true);
                    self.subscribe(&client, &alive).map_err(problem)?;
                }
                Ok(Ok(Event::Incoming(Packet::Publish(message)))) => {
                    self.hear(&mut heard, &message, step_of())
                }
                Ok(Ok(_)) | Err(RecvTimeoutError::Timeout) => {}
                Ok(Err(error)) => {
                    is_connected = false;
                    if !was_connected && begun.elapsed() >= timeout {
                        return Err(problem(format!("the broker does not answer: {error}")));
                    }
                    thread::sleep(RETRY.min(self.period));
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(problem("the connection ended".to_owned()));
                }
            }
            if !was_connected || Instant::now() < next_step {
                continue;
            }
            next_step += self.period;
            if !has_restarted {
                controller.restart(heard.own.as_ref());
                has_restarted = true;
            }
            let message = self.step(&heard, controller, step_of());
            watch(&message);
            // Nothing is queued while the broker is away: it would arrive late.
            if is_connected {
                self.publish(&client, &message).map_err(problem)?;
            }
        }
        let _ = self.publish_level(&client, 0);
        let _ = client.try_publish(&alive, QoS::AtLeastOnce, true, "offline");
        let _ = client.try_disconnect();
        while let Ok(Ok(_)) = connection.recv_timeout(Duration::from_millis(200)) {}
        Ok(())
    }

    fn subscribe(&self, client: &Client, alive: &str) -> Result<(), String> {
        let neighbours = self.previous.iter().chain(&self.next).chain(&self.siblings);
        let mut topics = vec![
            start_topic(&self.experiment),
            self.topic(&self.name, "state"),
            self.topic(&self.name, "reading"),
            self.topic(&self.name, "lamp"),
        ];
        topics.extend(self.tasmota.iter().map(|device| format!("stat/{device}/RESULT")));
        topics.extend(neighbours.flat_map(|name| ["state", "alive"].map(|what| self.topic(name, what))));
        for topic in topics {
            client.try_subscribe(topic, QoS::AtLeastOnce).map_err(|error| error.to_string())?;
        }
        client.try_publish(alive, QoS::AtLeastOnce, true, "online").map_err(|error| error.to_string())
    }

    fn hear(&self, heard: &mut Heard, publish: &Publish, step: u32) {
        let (Ok(topic), Ok(text)) =
            (std::str::from_utf8(&publish.topic), std::str::from_utf8(&publish.payload))
        else {
            return;
        };
        if topic == start_topic(&self.experiment) {
            heard.is_started = text == "1";
            return;
        }
        if self.tasmota.as_ref().is_some_and(|device| topic == format!("stat/{device}/RESULT")) {
            heard.lamp = dimmer_level(text).or(heard.lamp);
            return;
        }
        let Some((name, what)) = parts(&self.experiment, topic) else { return };
        match (what, name == self.name) {
            ("reading", true) => {
                let value = text.trim().parse().ok().filter(|value: &f64| value.is_finite());
                heard.reading = value.map(|value| (value, step));
            }
            ("lamp", true) => heard.lamp = text.trim().parse().ok().or(heard.lamp),
            // The broker sends what this process said before, too: only an earlier process's message counts.
            ("state", true) if publish.retain => heard.own = heard.own.or(serde_json::from_str(text).ok()),
            ("state", false) => {
                let message: Option<NodeMessage> = serde_json::from_str(text).ok();
                let known = heard.messages.get(name).map(|message| message.step);
                if let Some(message) =
                    message.filter(|message| known.is_none_or(|known| message.step > known))
                {
                    heard.messages.insert(name.to_owned(), message);
                }
            }
            ("alive", false) => {
                heard.offline.insert(name.to_owned(), text == "offline");
            }
            _ => {}
        }
    }

    fn step(&self, heard: &Heard, controller: &mut dyn NodeController, step: u32) -> NodeMessage {
        let neighbour = |name: &String| Neighbour {
            message: heard.messages.get(name),
            is_alive: !heard.offline.get(name).copied().unwrap_or(false),
        };
        let siblings: Vec<&NodeMessage> =
            self.siblings.iter().filter_map(|name| heard.messages.get(name)).collect();
        let is_fresh = |message: &&&NodeMessage| step.saturating_sub(message.step) <= FRESH_STEPS;
        let fresh: Vec<f64> =
            siblings.iter().filter(is_fresh).filter_map(|message| message.reading).collect();
        controller.step(&NodeView {
            step,
            period_h: self.period.as_secs_f64() / 3600.0,
            is_started: heard.is_started,
            reading: heard
                .reading
                .filter(|(_, at)| step.saturating_sub(*at) <= FRESH_STEPS)
                .map(|(reading, _)| reading),
            siblings: (!fresh.is_empty()).then(|| mean(fresh)),
            sibling_sees: siblings.iter().any(|message| message.sees),
            is_on_path: self.is_on_path,
            previous: self.previous.as_ref().map(neighbour),
            next: self.next.as_ref().map(neighbour),
            lamp: heard.lamp,
        })
    }

    fn publish(&self, client: &Client, message: &NodeMessage) -> Result<(), String> {
        let text = serde_json::to_string(message).map_err(|error| error.to_string())?;
        let state = self.topic(&self.name, "state");
        client.try_publish(state, QoS::AtLeastOnce, true, text).map_err(|error| error.to_string())?;
        self.publish_level(client, message.level)
    }

    /// Commands the lamp. Never retained: a lamp that restarts would obey an old command.
    fn publish_level(&self, client: &Client, level: u8) -> Result<(), String> {
        let (topic, payload) = match &self.tasmota {
            Some(device) => {
                // A lit lamp is at 1 % at least.
                let share = (f64::from(level) / 2.55).round();
                let percent = if level > 0 { share.max(1.0) } else { 0.0 };
                (format!("cmnd/{device}/Dimmer"), percent.to_string())
            }
            None => (self.topic(&self.name, "level"), level.to_string()),
        };
        client.try_publish(topic, QoS::AtMostOnce, false, payload).map_err(|error| error.to_string())
    }
}

/// The level in Tasmota's answer `{"POWER":"ON","Dimmer":56}`: 0 to 255; none in any other text.
fn dimmer_level(text: &str) -> Option<u8> {
    let said: Value = serde_json::from_str(text).ok()?;
    if said.get("POWER").and_then(Value::as_str) == Some("OFF") {
        return Some(0);
    }
    let percent = said.get("Dimmer")?.as_f64().filter(|percent| (0.0..=100.0).contains(percent))?;
    Some((percent * 2.55).round() as u8)
}

#[cfg(test)]
pub(crate) mod tests {
    use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
    use std::sync::{Arc, Mutex};

    use tropism::nodes::{DetectorSettings, StateMachine, StateMachineSettings};

    use super::*;
    use crate::testing::{Mosquitto, wait_until};

    #[test]
    fn answers_of_dimmers_are_understood() {
        for (text, level) in [
            ("{\"POWER\":\"ON\",\"Dimmer\":100}", Some(255)),
            ("{\"POWER\":\"OFF\",\"Dimmer\":56}", Some(0)),
            ("{\"Dimmer\":1}", Some(3)),
            ("{\"Dimmer\":1e9}", None),
            ("{\"Wifi\":{}}", None),
            ("", None),
        ] {
            assert_eq!(dimmer_level(text), level, "{text}");
        }
    }

    pub(crate) const PERIOD: Duration = Duration::from_millis(100);

    pub(crate) fn process(experiment: &str, number: usize) -> NodeProcess {
        let name = |number: usize| format!("n{number}");
        NodeProcess {
            experiment: experiment.to_owned(),
            name: name(number),
            is_on_path: true,
            previous: (number > 1).then(|| name(number - 1)),
            next: (number < 3).then(|| name(number + 1)),
            siblings: Vec::new(),
            period: PERIOD,
            tasmota: (number == 2).then(|| "plug2".to_owned()),
        }
    }

    /// A node in a thread of its own, which ends when it is dropped.
    pub(crate) struct Running {
        ends: Arc<AtomicBool>,
        thread: Option<thread::JoinHandle<()>>,
        latest: Arc<Mutex<Option<NodeMessage>>>,
    }

    impl Running {
        pub(crate) fn start(process: NodeProcess, port: u16, begun: Instant) -> Self {
            let ends = Arc::new(AtomicBool::new(false));
            let latest = Arc::new(Mutex::new(None));
            let (is_over, said) = (Arc::clone(&ends), Arc::clone(&latest));
            let thread = thread::spawn(move || {
                let detector = DetectorSettings { siblings: false, ..DetectorSettings::default() };
                let mut machine = StateMachine::new(StateMachineSettings { detector, ..Default::default() });
                let broker = Broker::new("127.0.0.1", port);
                let step_of = || (begun.elapsed().as_secs_f64() / PERIOD.as_secs_f64()) as u32;
                let mut watch = |message: &NodeMessage| *said.lock().unwrap() = Some(*message);
                let over = || is_over.load(Ordering::SeqCst);
                process
                    .run(&broker, &mut machine, Duration::from_secs(30), &step_of, &over, &mut watch)
                    .unwrap();
            });
            Self { ends, thread: Some(thread), latest }
        }

        pub(crate) fn message(&self) -> NodeMessage {
            self.latest.lock().unwrap().unwrap_or_default()
        }
    }

    impl Drop for Running {
        fn drop(&mut self) {
            self.ends.store(true, Ordering::SeqCst);
            if let Some(thread) = self.thread.take() {
                let _ = thread.join();
            }
        }
    }

    /// Publishes readings of three sensors until it is dropped; a plant may stand before one of them.
    pub(crate) struct Sensors {
        plant: Arc<AtomicU32>,
        ends: Arc<AtomicBool>,
    }

    impl Sensors {
        pub(crate) fn start(experiment: &str, port: u16) -> (Self, Client) {
            let (client, mut connection) =
                Broker::new("127.0.0.1", port).connect("sensors".to_owned(), 64, |_| {});
            let (plant, ends) = (Arc::new(AtomicU32::new(0)), Arc::new(AtomicBool::new(false)));
            let (at, over, publisher) = (Arc::clone(&plant), Arc::clone(&ends), client.clone());
            let experiment = experiment.to_owned();
            thread::spawn(move || {
                for step in 0_u32.. {
                    if over.load(Ordering::SeqCst) {
                        return;
                    }
                    for number in 1..=3 {
                        let noise = 0.02 * f64::from((step * 7 + number * 3) % 5);
                        let echo = if at.load(Ordering::SeqCst) == number { 2.0 } else { 0.0 };
                        let topic = format!("tropism/wall/{experiment}/n{number}/reading");
                        let _ =
                            publisher.try_publish(topic, QoS::AtMostOnce, false, (noise + echo).to_string());
                    }
                    let until = Instant::now() + PERIOD;
                    while let Some(left) = until.checked_duration_since(Instant::now()) {
                        let _ = connection.recv_timeout(left);
                    }
                }
            });
            (Self { plant, ends }, client)
        }
    }

    impl Drop for Sensors {
        fn drop(&mut self) {
            self.ends.store(true, Ordering::SeqCst);
        }
    }

    #[test]
    fn nodes_hand_the_light_over_through_a_broker_and_a_restarted_one_remembers() {
        let Some(broker) = Mosquitto::start(None) else { return };
        let (sensors, user) = Sensors::start("a", broker.port);
        let begun = Instant::now();
        let start = |number| Running::start(process("a", number), broker.port, begun);
        let nodes = [1, 2, 3].map(start);
        let level = |number: usize| nodes[number - 1].message().level;
        wait_until(|| nodes.iter().all(|node| node.message().memory.alone.readings[1] > 30));
        assert!((1..=3).all(|number| level(number) == 0), "dark before the start");
        user.try_publish("tropism/wall/a/start", QoS::AtLeastOnce, true, "1").unwrap();
        wait_until(|| level(1) == 255);
        assert_eq!([level(2), level(3)], [0, 0]);
        sensors.plant.store(1, Ordering::SeqCst);
        wait_until(|| level(1) == 0 && level(2) == 255);
        assert!(nodes[0].message().done);
        // The first node restarts: it remembers that it is done.
        let [first, second, third] = nodes;
        drop(first);
        let again = start(1);
        wait_until(|| again.latest.lock().unwrap().is_some());
        assert!(again.message().done && again.message().level == 0);
        // The last node ends before it is called: the one before it stays lit, though it sees the plant, as nobody goes on.
        drop(third);
        sensors.plant.store(2, Ordering::SeqCst);
        wait_until(|| second.message().done);
        assert_eq!(second.message().level, 255);
        // It comes back, and hears that it is its turn.
        let third = start(3);
        wait_until(|| third.message().level == 255 && second.message().level == 0);
        // Another experiment hears nothing of this one.
        let other = Running::start(process("b", 1), broker.port, begun);
        wait_until(|| other.latest.lock().unwrap().is_some());
        assert_eq!((other.message().level, other.message().done), (0, false));
    }
}
