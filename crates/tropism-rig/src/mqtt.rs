//! Plugs and relays behind an MQTT broker: Tasmota, zigbee2mqtt, and any device with a command topic and a state topic.
//!
//! An MQTT client may queue a command while the broker is away, and switch a flash on minutes late. So each command has a
//! connection of its own: it is published only after the broker has answered, succeeds when the device reports the new
//! state, and is dropped with its connection at the deadline. A command that the broker delays, or a killed program, is
//! covered by the timer of the device; see docs/reference/lamps.md.
//!
//! # References
//! Tasmota, "MQTT": <https://tasmota.github.io/docs/MQTT/>.
//! Zigbee2MQTT, "MQTT topics and messages": <https://www.zigbee2mqtt.io/guide/usage/mqtt_topics_and_messages.html>.

use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use rumqttc::{Client, Connection, Event, Packet, Publish, QoS, RecvTimeoutError};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use tropism::lighting::FULL;
use tropism::rig::RigError;

use crate::broker::Broker;
use crate::failed;
use crate::http::in_plain_words;
use crate::seconds::{Seconds, one, ten};
use crate::settings::{FlashSettings, LampSettings, Outlet};
use crate::switch::{Switch, cannot_dim};

/// Topics and payloads of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Dialect {
    /// `cmnd/NAME/POWER`, answered in `stat/NAME/POWER`; a dimmer `cmnd/NAME/Dimmer`, answered in `stat/NAME/RESULT`.
    Tasmota,
    /// `zigbee2mqtt/NAME/set`, answered in `zigbee2mqtt/NAME`; a dimmer with its `brightness`.
    Zigbee2mqtt,
    /// `ON` and `OFF` in `set_topic` and `state_topic`.
    Plain,
}

/// A plug or relay.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Plug {
    /// Its topics and payloads.
    pub dialect: Dialect,
    /// Its name, for `tasmota` and `zigbee2mqtt`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Command topic, for `plain`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub set_topic: Option<String>,
    /// State topic, for `plain`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state_topic: Option<String>,
    /// Seconds after which a `zigbee2mqtt` plug switches itself off, if its firmware supports that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on_time_s: Option<u16>,
    /// Whether it is a dimmer, with `tasmota` or `zigbee2mqtt`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub dims: bool,
    /// Time limit of one command.
    #[serde(default = "five")]
    pub timeout_s: Seconds,
}

const fn five() -> Seconds {
    Seconds::new(5.0)
}

/// A lamp on a plug or relay.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MqttLamp {
    /// The plug.
    pub plug: Plug,
}

/// A flash on a plug or relay.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MqttFlash {
    /// The plug.
    pub plug: Plug,
    /// Seconds from switching on to the photograph.
    #[serde(default = "one")]
    pub settle_s: Seconds,
    /// Longest time for which the flash is on.
    #[serde(default = "ten")]
    pub max_on_s: Seconds,
}

/// A command: where it is published, and what answers it.
#[derive(Debug)]
struct Order {
    set: String,
    state: String,
    payload: String,
    /// Key and value of a dimmer's answer.
    steps: Option<(&'static str, u16)>,
}

impl Order {
    /// Whether `payload` says that the command was carried out, which makes the device `is_on`.
    fn is_answered(&self, payload: &[u8], is_on: bool) -> bool {
        let Some((key, steps)) = self.steps else { return self::is_on(payload) == Some(is_on) };
        let said: Option<Value> = serde_json::from_slice(payload).ok();
        let found = said.as_ref().and_then(|said| said.get(key)?.as_f64());
        found == Some(f64::from(steps)) && self::is_on(payload) != Some(false)
    }
}

/// The topics of a plug.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Topics {
    set: String,
    state: String,
    /// The availability topic.
    availability: Option<String>,
}

impl LampSettings for MqttLamp {
    fn check(&self, _period_min: f64) -> Result<(), String> {
        self.plug.check()
    }

    fn outlet(&self) -> Outlet {
        self.plug.outlet()
    }

    fn dims(&self) -> bool {
        self.plug.dims
    }

    fn open(&self, device: &str, broker: Option<&Broker>) -> Result<Box<dyn Switch>, RigError> {
        Ok(Box::new(self.plug.open(device, broker)?))
    }

    fn timeout_s(&self) -> f64 {
        self.plug.timeout_s.into()
    }
}

impl FlashSettings for MqttFlash {
    fn check(&self) -> Result<(), String> {
        self.plug.check()
    }

    fn outlet(&self) -> Outlet {
        self.plug.outlet()
    }

    fn open(&self, broker: Option<&Broker>) -> Result<Box<dyn Switch>, RigError> {
        Ok(Box::new(self.plug.open("flash", broker)?.lit_within(self.max_on_s.duration())))
    }

    fn timeout_s(&self) -> f64 {
        self.plug.timeout_s.into()
    }

    fn times(&self) -> [Seconds; 2] {
        [self.settle_s, self.max_on_s]
    }
}

impl Plug {
    fn check(&self) -> Result<(), String> {
        let topics = self.topics()?;
        for topic in [&topics.set, &topics.state] {
            if topic.is_empty() || topic.contains(['+', '#', '\0']) || topic.len() > 1000 {
                return Err(format!("found topic {topic:?}, wanted one without + and #"));
            }
        }
        if self.dims && self.dialect == Dialect::Plain {
            return Err("plug.dims is for tasmota and zigbee2mqtt, not for a plain plug".to_owned());
        }
        match (self.on_time_s, self.dialect) {
            (None, _) | (Some(1..), Dialect::Zigbee2mqtt) => Ok(()),
            (Some(0), _) => Err("found plug.on_time_s = 0, wanted 1 to 65535 seconds".to_owned()),
            (Some(_), _) => {
                Err("found plug.on_time_s, wanted it only for zigbee2mqtt; a Tasmota plug has its \
                                 PulseTime, set once in the plug"
                    .to_owned())
            }
        }
    }

    fn topics(&self) -> Result<Topics, String> {
        let own = (&self.set_topic, &self.state_topic);
        match (self.dialect, &self.name, own) {
            (Dialect::Tasmota, Some(name), (None, None)) => Ok(Topics {
                set: format!("cmnd/{name}/POWER"),
                state: format!("stat/{name}/POWER"),
                availability: Some(format!("tele/{name}/LWT")),
            }),
            (Dialect::Zigbee2mqtt, Some(name), (None, None)) => Ok(Topics {
                set: format!("zigbee2mqtt/{name}/set"),
                state: format!("zigbee2mqtt/{name}"),
                availability: Some(format!("zigbee2mqtt/{name}/availability")),
            }),
            (Dialect::Plain, None, (Some(set), Some(state))) => {
                Ok(Topics { set: set.clone(), state: state.clone(), availability: None })
            }
            (Dialect::Plain, ..) => Err("a plain plug has set_topic and state_topic, and no name".to_owned()),
            _ => Err("a plug of this dialect has a name and no topics".to_owned()),
        }
    }

    /// Its command topic, and its availability topic if it has one.
    pub(crate) fn watched_topics(&self) -> Result<(String, Option<String>), String> {
        let Topics { set, availability, .. } = self.topics()?;
        Ok((set, availability))
    }

    /// Its command topic, whatever else it has.
    fn outlet(&self) -> Outlet {
        Outlet::Topic(self.topics().map_or_else(|_| String::new(), |topics| topics.set))
    }

    /// The command for a level, 0 to 255.
    ///
    /// # Errors
    /// For a level between on and off if it is no dimmer.
    fn order(&self, topics: &Topics, level: u8) -> Result<Order, u8> {
        let order =
            |payload, steps| Order { set: topics.set.clone(), state: topics.state.clone(), payload, steps };
        if level == 0 || !self.dims {
            let is_on = level == FULL;
            return if is_on || level == 0 { Ok(order(self.payload(is_on), None)) } else { Err(level) };
        }
        // The step below, so that no more light is lit than asked for.
        let steps_of = |most: u16| (u16::from(level) * most / u16::from(FULL)).max(1);
        if self.dialect == Dialect::Zigbee2mqtt {
            let steps = steps_of(254);
            let state = self.payload(true);
            let payload = format!("{},\"brightness\":{steps}}}", state.trim_end_matches('}'));
            return Ok(order(payload, Some(("brightness", steps))));
        }
        let steps = steps_of(100);
        let name = self.name.as_deref().unwrap_or_default();
        Ok(Order {
            set: format!("cmnd/{name}/Dimmer"),
            state: format!("stat/{name}/RESULT"),
            payload: steps.to_string(),
            steps: Some(("Dimmer", steps)),
        })
    }

    fn payload(&self, is_on: bool) -> String {
        let state = if is_on { "ON" } else { "OFF" };
        match (self.dialect, self.on_time_s) {
            (Dialect::Zigbee2mqtt, Some(seconds)) if is_on => {
                format!("{{\"state\":\"{state}\",\"on_time\":{seconds}}}")
            }
            (Dialect::Zigbee2mqtt, _) => format!("{{\"state\":\"{state}\"}}"),
            _ => state.to_owned(),
        }
    }

    pub(crate) fn open(&self, device: &str, broker: Option<&Broker>) -> Result<OpenPlug, RigError> {
        let Some(broker) = broker else {
            return Err(failed(device, "there is no [mqtt], which names the host of the broker"));
        };
        let topics = self.topics().map_err(|problem| failed(device, problem))?;
        Ok(OpenPlug {
            device: format!("{device} ({} at {}:{})", topics.set, broker.host, broker.port),
            plug: self.clone(),
            broker: broker.opened()?,
            topics,
            on_timeout: self.timeout_s.duration(),
        })
    }
}

/// Parses a switch state: `ON` or `OFF`, or JSON with such a `state` or `POWER`. `None` for any other payload.
#[must_use]
pub fn is_on(payload: &[u8]) -> Option<bool> {
    let word = |word: &str| match word.trim().to_ascii_lowercase().as_str() {
        "on" => Some(true),
        "off" => Some(false),
        _ => None,
    };
    let text = std::str::from_utf8(payload).ok()?;
    word(text).or_else(|| {
        let said: Value = serde_json::from_str(text).ok()?;
        ["state", "POWER", "POWER1"].iter().find_map(|key| word(said.get(key)?.as_str()?))
    })
}

/// Parses an availability: `online` or `offline`, or JSON with such a `state`. `None` for any other payload.
#[must_use]
pub fn is_online(payload: &[u8]) -> Option<bool> {
    let word = |word: &str| match word.trim().to_ascii_lowercase().as_str() {
        "online" => Some(true),
        "offline" => Some(false),
        _ => None,
    };
    let text = std::str::from_utf8(payload).ok()?;
    word(text).or_else(|| word(serde_json::from_str::<Value>(text).ok()?.get("state")?.as_str()?))
}

/// An open plug. There is no connection between commands.
pub(crate) struct OpenPlug {
    device: String,
    plug: Plug,
    broker: Broker,
    topics: Topics,
    /// Time limit of the command that switches it on.
    on_timeout: Duration,
}

/// Number of the next connection: a broker closes a connection when another one has the same client identifier.
static CONNECTIONS: AtomicU32 = AtomicU32::new(0);

/// The largest message that is read: chosen by hand.
const MAX_BYTES: usize = 256 << 10;

impl OpenPlug {
    /// The same plug, of which a command to light fails after `limit` at most: it may be lit without an answer.
    pub(crate) fn lit_within(mut self, limit: Duration) -> Self {
        self.on_timeout = self.on_timeout.min(limit);
        self
    }

    fn error(&self, problem: String) -> RigError {
        failed(self.device.as_str(), problem)
    }

    fn connect(&self) -> (Client, Connection) {
        let number = CONNECTIONS.fetch_add(1, Ordering::Relaxed);
        let name = format!("tropism-{}-{number}", std::process::id());
        self.broker.connect(name, 8, |options| {
            options.set_max_packet_size(MAX_BYTES, MAX_BYTES);
        })
    }

    /// Waits for the next packet from the broker.
    fn next(&self, connection: &mut Connection, deadline: Instant, doing: &str) -> Result<Packet, RigError> {
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            match connection.recv_timeout(left) {
                Ok(Ok(Event::Incoming(packet))) => return Ok(packet),
                Ok(Ok(Event::Outgoing(_))) => {}
                Ok(Err(error)) => {
                    return Err(self.error(format!("while {doing}: {}", in_plain_words(&error.to_string()))));
                }
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                    let timeout = self.plug.timeout_s.duration();
                    return Err(self.error(format!("while {doing}: no answer in {timeout:?}")));
                }
            }
        }
    }

    /// Whether `message` says that the device is offline.
    fn is_offline(&self, message: &Publish) -> bool {
        self.topics.availability.as_ref().is_some_and(|topic| message.topic == topic.as_bytes())
            && is_online(&message.payload) == Some(false)
    }

    fn command(&self, client: &Client, connection: &mut Connection, level: u8) -> Result<(), RigError> {
        let order = self.plug.order(&self.topics, level).map_err(|level| cannot_dim(&self.device, level))?;
        let is_on = level > 0;
        let timeout = if is_on { self.on_timeout } else { self.plug.timeout_s.duration() };
        let deadline = Instant::now() + timeout;
        let offline = || self.error("it is offline".to_owned());
        let refused = |error: rumqttc::ClientError| self.error(error.to_string());
        loop {
            // A refusal of the broker arrives as an error.
            if let Packet::ConnAck(_) = self.next(connection, deadline, "connecting")? {
                break;
            }
        }
        let topics = [Some(&order.state), self.topics.availability.as_ref()];
        let mut unanswered = 0;
        for topic in topics.into_iter().flatten() {
            client.try_subscribe(topic, QoS::AtLeastOnce).map_err(refused)?;
            unanswered += 1;
        }
        // The acknowledgements prove that the broker is reachable; retained messages arrive with them.
        while unanswered > 0 {
            match self.next(connection, deadline, "subscribing")? {
                Packet::SubAck(_) => unanswered -= 1,
                Packet::Publish(message) if self.is_offline(&message) => return Err(offline()),
                _ => {}
            }
        }
        // Never retained: a device that restarts would carry the command out again.
        client.try_publish(&order.set, QoS::AtMostOnce, false, order.payload.clone()).map_err(refused)?;
        let doing = if is_on { "waiting for its state to be on" } else { "waiting for its state to be off" };
        loop {
            match self.next(connection, deadline, doing)? {
                Packet::Publish(message) if self.is_offline(&message) => return Err(offline()),
                // A retained state is older than the command.
                Packet::Publish(message)
                    if message.topic == order.state.as_bytes()
                        && !message.retain
                        && order.is_answered(&message.payload, is_on) =>
                {
                    return Ok(());
                }
                _ => {}
            }
        }
    }
}

impl Switch for OpenPlug {
    fn switch(&mut self, is_on: bool) -> Result<(), RigError> {
        self.dim(if is_on { FULL } else { 0 })
    }

    fn dim(&mut self, level: u8) -> Result<(), RigError> {
        let (client, mut connection) = self.connect();
        let done = self.command(&client, &mut connection, level);
        if done.is_ok() && client.try_disconnect().is_ok() {
            // Wait for the end of the connection. What is not sent by then is dropped with it.
            while let Ok(Ok(_)) = connection.recv_timeout(Duration::from_millis(100)) {}
        }
        // Its drop waits for the look-up of the host's name, which the system ends when it likes. The command is over.
        thread::spawn(move || drop(connection));
        done
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;
    use std::sync::{Arc, Mutex};

    use tropism::lamps::Light;
    use tropism::lighting::{Allowed, Lighting};
    use tropism::rig::Lamps;

    #[cfg(feature = "tls")]
    use std::path::{Path, PathBuf};

    use super::*;
    use crate::switch::Interlock;
    use crate::testing::{Mosquitto, hear, wait_until};

    #[test]
    fn what_devices_say_is_understood() {
        for (payload, on) in [
            ("ON", Some(true)),
            ("off", Some(false)),
            ("{\"POWER\":\"ON\"}", Some(true)),
            ("{\"state\":\"OFF\",\"power\":8.9,\"linkquality\":120}", Some(false)),
            ("{\"state\":null}", None),
            ("", None),
            ("[1]", None),
            ("\u{0}", None),
        ] {
            assert_eq!(is_on(payload.as_bytes()), on, "{payload}");
        }
        assert_eq!(is_on(&[0xff]), None);
        assert_eq!(is_online(b"Online"), Some(true));
        assert_eq!(is_online(b"{\"state\":\"offline\"}"), Some(false));
        assert_eq!(is_online(b"{}"), None);
    }

    fn plug(text: &str) -> Plug {
        toml::from_str(text).unwrap()
    }

    #[test]
    fn each_dialect_has_its_topics_and_words() {
        let tasmota = plug("dialect = \"tasmota\"\nname = \"flash\"");
        assert_eq!((tasmota.check(), tasmota.payload(true).as_str()), (Ok(()), "ON"));
        assert_eq!(tasmota.topics().unwrap().set, "cmnd/flash/POWER");
        let z2m = plug("dialect = \"zigbee2mqtt\"\nname = \"flash\"\non_time_s = 5");
        assert_eq!(z2m.check(), Ok(()));
        assert_eq!(z2m.payload(true), "{\"state\":\"ON\",\"on_time\":5}");
        assert_eq!(z2m.payload(false), "{\"state\":\"OFF\"}");
        assert_eq!(z2m.topics().unwrap().state, "zigbee2mqtt/flash");
        for (text, wanted) in [
            ("dialect = \"tasmota\"", "has a name and no topics"),
            ("dialect = \"plain\"\nname = \"x\"", "has set_topic and state_topic"),
            ("dialect = \"plain\"\nset_topic = \"x/#\"\nstate_topic = \"y\"", "without + and #"),
            ("dialect = \"tasmota\"\nname = \"x\"\non_time_s = 3", "PulseTime"),
            ("dialect = \"zigbee2mqtt\"\nname = \"x\"\non_time_s = 0", "on_time_s = 0"),
        ] {
            let problem = plug(text).check().unwrap_err();
            assert!(problem.contains(wanted), "{problem}");
        }
    }

    #[test]
    fn levels_are_orders_to_dimmers_and_refused_by_plugs() {
        let order = |text: &str, level| {
            let plug = plug(text);
            plug.check().unwrap();
            plug.order(&plug.topics().unwrap(), level)
        };
        let tasmota = "dialect = \"tasmota\"\nname = \"lamp\"\ndims = true";
        let half = order(tasmota, 128).unwrap();
        assert_eq!((half.set.as_str(), half.state.as_str()), ("cmnd/lamp/Dimmer", "stat/lamp/RESULT"));
        assert_eq!(half.payload, "50");
        for (said, is_answer) in [
            ("{\"POWER\":\"ON\",\"Dimmer\":50}", true),
            ("{\"POWER\":\"OFF\",\"Dimmer\":50}", false),
            ("{\"POWER\":\"ON\",\"Dimmer\":51}", false),
            ("{\"POWER\":\"ON\"}", false),
            ("50", false),
        ] {
            assert_eq!(half.is_answered(said.as_bytes(), true), is_answer, "{said}");
        }
        assert_eq!(order(tasmota, FULL).unwrap().payload, "100");
        let dark = order(tasmota, 0).unwrap();
        assert_eq!((dark.set.as_str(), dark.payload.as_str()), ("cmnd/lamp/POWER", "OFF"));
        let z2m = "dialect = \"zigbee2mqtt\"\nname = \"lamp\"\ndims = true\non_time_s = 5";
        assert_eq!(order(z2m, 1).unwrap().payload, "{\"state\":\"ON\",\"on_time\":5,\"brightness\":1}");
        assert_eq!(order(z2m, 0).unwrap().payload, "{\"state\":\"OFF\"}");
        assert_eq!(order("dialect = \"tasmota\"\nname = \"lamp\"", 9).unwrap_err(), 9);
        let plain = "dialect = \"plain\"\nset_topic = \"x\"\nstate_topic = \"y\"\ndims = true";
        assert!(plug(plain).check().unwrap_err().contains("dims"));
    }

    fn open(port: u16, plug: &Plug) -> OpenPlug {
        let broker = Broker::new("127.0.0.1", port);
        plug.open("flash", Some(&broker)).unwrap()
    }

    fn tasmota(timeout_s: f64) -> Plug {
        plug(&format!("dialect = \"tasmota\"\nname = \"flash\"\ntimeout_s = {timeout_s}"))
    }

    #[test]
    fn without_a_broker_or_with_a_mute_one_an_order_fails() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let error = open(port, &tasmota(0.2)).switch(true).unwrap_err().to_string();
        assert!(error.contains("while connecting: no answer in 200ms"), "{error}");
        drop(listener);
        let error = open(port, &tasmota(5.0)).switch(true).unwrap_err().to_string();
        assert!(
            error.contains("flash (cmnd/flash/POWER at 127.0.0.1") && error.contains("connecting"),
            "{error}"
        );
        let error = tasmota(1.0).open("flash", None).err().unwrap().to_string();
        assert!(error.contains("no [mqtt]"), "{error}");
    }

    /// A simulated plug: the commands that it received, and whether it obeys.
    #[derive(Clone, Default)]
    struct Device {
        printed: Arc<Mutex<Vec<String>>>,
        is_deaf: Arc<Mutex<bool>>,
        is_there: Arc<Mutex<bool>>,
    }

    impl Device {
        /// Listens for commands to `plug` until the end of the test, and reconnects after a broker restart.
        fn start(plug: &Plug, port: u16) -> Self {
            let device = Self::default();
            let (topics, dialect) = (plug.topics().unwrap(), plug.dialect);
            let name = format!("device-{}", CONNECTIONS.fetch_add(1, Ordering::Relaxed));
            let (client, mut connection) =
                Broker::new("127.0.0.1", port).connect(name.to_string(), 8, |_| {});
            let own = device.clone();
            thread::spawn(move || {
                for event in connection.iter() {
                    match event {
                        Ok(Event::Incoming(Packet::ConnAck(_))) => {
                            client.try_subscribe(&topics.set, QoS::AtLeastOnce).unwrap();
                        }
                        Ok(Event::Incoming(Packet::SubAck(_))) => *own.is_there.lock().unwrap() = true,
                        Ok(Event::Incoming(Packet::Publish(order))) => {
                            let order = String::from_utf8(order.payload.to_vec()).unwrap();
                            own.printed.lock().unwrap().push(order.clone());
                            if !*own.is_deaf.lock().unwrap() {
                                // As the real devices do: zigbee2mqtt retains its state.
                                let kept = dialect == Dialect::Zigbee2mqtt;
                                client.try_publish(&topics.state, QoS::AtMostOnce, kept, order).unwrap();
                            }
                        }
                        Ok(_) => {}
                        Err(_) => {
                            *own.is_there.lock().unwrap() = false;
                            thread::sleep(Duration::from_millis(20));
                        }
                    }
                }
            });
            device.wait();
            device
        }

        fn wait(&self) {
            wait_until(|| *self.is_there.lock().unwrap());
        }

        fn printed(&self) -> Vec<String> {
            self.printed.lock().unwrap().clone()
        }
    }

    #[test]
    fn an_order_is_done_when_the_device_says_so() {
        let Some(broker) = Mosquitto::start(None) else { return };
        let z2m = plug("dialect = \"zigbee2mqtt\"\nname = \"lamp\"\ntimeout_s = 10");
        for plug in [tasmota(10.0), z2m] {
            let device = Device::start(&plug, broker.port);
            let mut open = open(broker.port, &plug);
            for is_on in [true, false, false, true] {
                open.switch(is_on).unwrap();
            }
            assert_eq!(device.printed(), [true, false, false, true].map(|is_on| plug.payload(is_on)));
            // It is on, and what the broker kept of that is no answer to the next order.
            *device.is_deaf.lock().unwrap() = true;
            open = open.lit_within(Duration::from_millis(300));
            let error = open.switch(true).unwrap_err().to_string();
            assert!(error.contains("waiting for its state to be on"), "{error}");
        }
    }

    /// A Tasmota dimmer: its level in percent after each order, and whether it obeys.
    fn dimmer(name: &'static str, port: u16, percents: &Arc<Mutex<Vec<(&'static str, u32)>>>) {
        let (ready, is_ready) = std::sync::mpsc::channel();
        let client_name = format!("dimmer-{name}-{}", CONNECTIONS.fetch_add(1, Ordering::Relaxed));
        let (client, mut connection) = Broker::new("127.0.0.1", port).connect(client_name, 8, |_| {});
        let percents = Arc::clone(percents);
        thread::spawn(move || {
            for event in connection.iter() {
                match event {
                    Ok(Event::Incoming(Packet::ConnAck(_))) => {
                        client.try_subscribe(format!("cmnd/{name}/+"), QoS::AtLeastOnce).unwrap();
                    }
                    Ok(Event::Incoming(Packet::SubAck(_))) => ready.send(()).unwrap(),
                    Ok(Event::Incoming(Packet::Publish(order))) => {
                        let text = String::from_utf8(order.payload.to_vec()).unwrap();
                        let percent = if text == "OFF" { 0 } else { text.parse().unwrap() };
                        percents.lock().unwrap().push((name, percent));
                        let (topic, said) = match percent {
                            0 => ("POWER", "OFF".to_owned()),
                            _ => ("RESULT", format!("{{\"POWER\":\"ON\",\"Dimmer\":{percent}}}")),
                        };
                        client
                            .try_publish(format!("stat/{name}/{topic}"), QoS::AtMostOnce, false, said)
                            .unwrap();
                    }
                    Ok(_) => {}
                    Err(_) => return,
                }
            }
        });
        is_ready.recv_timeout(Duration::from_secs(60)).unwrap();
    }

    #[test]
    fn two_dimmers_stay_within_their_budget() {
        let Some(broker) = Mosquitto::start(None) else { return };
        let percents = Arc::default();
        let lamp = |name| {
            dimmer(name, broker.port, &percents);
            let text = format!("dialect = \"tasmota\"\nname = \"{name}\"\ndims = true\ntimeout_s = 10");
            open(broker.port, &plug(&text))
        };
        let mut lamps = Interlock::new([lamp("one"), lamp("two")], Duration::ZERO)
            .allowing(Allowed::Any { most_lit: 2, budget: 1.0 });
        let both = |left, right| Lighting::DARK.with(Light::LEFT, left).with(Light::RIGHT, right);
        for lighting in [both(255, 0), both(55, 200), both(155, 100), Lighting::DARK] {
            lamps.shine(lighting).unwrap();
        }
        let mut now = [0; 2];
        for (name, percent) in percents.lock().unwrap().iter() {
            now[usize::from(*name == "two")] = *percent;
            assert!(now[0] + now[1] <= 100, "{now:?}");
        }
        assert_eq!(now, [0; 2]);
    }

    #[test]
    fn a_device_that_is_said_to_be_offline_is_told_nothing() {
        let Some(broker) = Mosquitto::start(None) else { return };
        let plug = tasmota(10.0);
        let device = Device::start(&plug, broker.port);
        let (client, mut connection) =
            Broker::new("127.0.0.1", broker.port).connect("will".to_owned(), 8, |_| {});
        client.try_publish("tele/flash/LWT", QoS::AtLeastOnce, true, "Offline").unwrap();
        hear(&mut connection, |packet| matches!(packet, Packet::PubAck(_)));
        let error = open(broker.port, &plug).switch(true).unwrap_err().to_string();
        assert!(error.contains("it is offline"), "{error}");
        assert!(device.printed().is_empty());
    }

    #[test]
    fn an_order_that_failed_is_never_carried_out_later() {
        let Some(broker) = Mosquitto::start(None) else { return };
        let port = broker.port;
        let device = Device::start(&tasmota(10.0), port);
        let mut flash = open(port, &tasmota(10.0));
        flash.switch(true).unwrap();
        flash.switch(false).unwrap();
        // Hung: the kernel accepts the connection and the broker does not answer; then it continues with all that waits.
        broker.signal(rustix::process::Signal::STOP);
        flash = flash.lit_within(Duration::from_millis(300));
        assert!(flash.switch(true).unwrap_err().to_string().contains("while connecting"));
        broker.signal(rustix::process::Signal::CONT);
        flash.switch(false).unwrap();
        assert_eq!(device.printed(), ["ON", "OFF", "OFF"]);
        // Killed, and started again.
        drop(broker);
        assert!(flash.switch(true).is_err());
        *device.is_there.lock().unwrap() = false;
        let _broker = Mosquitto::start(Some(port));
        device.wait();
        flash.switch(false).unwrap();
        assert_eq!(device.printed(), ["ON", "OFF", "OFF", "OFF"]);
    }

    /// A broker with a certificate for 127.0.0.1, and the file of the authority that signed it. `None` where a program is missing.
    #[cfg(feature = "tls")]
    fn encrypted(folder: &Path) -> Option<(Mosquitto, PathBuf)> {
        let script = "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -keyout ca.key -out ca.pem \
                          -subj /CN=tent -days 2
                      openssl req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -keyout own.key -out own.csr -subj /CN=broker
                      echo subjectAltName=IP:127.0.0.1 > names
                      openssl x509 -req -in own.csr -CA ca.pem -CAkey ca.key -CAcreateserial -extfile names -out own.pem -days 2";
        let made = std::process::Command::new("sh").args(["-ec", script]).current_dir(folder).output();
        if !made.is_ok_and(|made| made.status.success()) {
            eprintln!("skipped: wants openssl, which is not installed");
            return None;
        }
        let file = |name: &str| folder.join(name).display().to_string();
        let [own, key, ca] = ["own.pem", "own.key", "ca.pem"].map(file);
        let broker = Mosquitto::start_with(folder, &format!("certfile {own}\nkeyfile {key}\ncafile {ca}\n"))?;
        Some((broker, folder.join("ca.pem")))
    }

    #[cfg(feature = "tls")]
    #[test]
    fn an_encrypted_broker_is_trusted_by_its_authority_alone() {
        let folder = tempfile::tempdir().unwrap();
        let other = tempfile::tempdir().unwrap();
        let Some((broker, ca_file)) = encrypted(folder.path()) else { return };
        let Some((_, foreign)) = encrypted(other.path()) else { return };
        let with = |ca_file: Option<PathBuf>| {
            let mut broker = Broker::new("127.0.0.1", broker.port);
            broker.ca_file = ca_file;
            crate::probe::broker(&broker, &[]).map_err(|error| error.to_string())
        };
        with(Some(ca_file)).unwrap();
        let error = with(Some(foreign)).unwrap_err();
        assert!(error.contains("its certificate is refused: nobody whom this computer trusts"), "{error}");
        assert!(with(None).unwrap_err().contains("while connecting"));
        let error = with(Some(folder.path().join("absent.pem"))).unwrap_err();
        assert!(error.contains("absent.pem: cannot be read"), "{error}");
    }

    /// The name of the test below in its own process.
    const LOOK_UP: &str = "mqtt::tests::a_name_server_that_never_answers_does_not_outlast_the_deadline";

    #[test]
    #[cfg(target_os = "linux")]
    fn a_name_server_that_never_answers_does_not_outlast_the_deadline() {
        if std::env::var_os("TROPISM_MUTE_NAMES").is_some() {
            let _mute = std::net::UdpSocket::bind("127.0.0.1:53").unwrap();
            let broker = Broker::new("broker.test", 1883);
            let started = Instant::now();
            let error =
                tasmota(0.3).open("flash", Some(&broker)).unwrap().switch(false).unwrap_err().to_string();
            let took = started.elapsed();
            assert!(error.contains("no answer in 300ms"), "{error}");
            assert!(took < Duration::from_secs(3), "{took:?}");
            // Not even the end of the process may wait for it.
            std::process::exit(0);
        }
        // A network and a list of name servers of its own, where the system gives such to its users.
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("resolv.conf"), "nameserver 127.0.0.1\n").unwrap();
        let own = |script: &str| {
            let mut command = std::process::Command::new("unshare");
            command
                .args(["--map-root-user", "--mount", "--net", "sh", "-ec", script])
                .current_dir(folder.path());
            command.env("TROPISM_MUTE_NAMES", "1").arg(std::env::current_exe().unwrap()).output()
        };
        let prepare = "ip link set lo up; mount --bind resolv.conf /etc/resolv.conf";
        if !own(prepare).is_ok_and(|output| output.status.success()) {
            eprintln!("skipped: wants unshare and ip, and namespaces for users");
            return;
        }
        let output = own(&format!("{prepare}; exec \"$0\" --exact {LOOK_UP} --nocapture")).unwrap();
        assert!(output.status.success(), "{output:?}");
    }
}
