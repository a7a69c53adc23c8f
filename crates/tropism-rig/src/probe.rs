//! Check of a broker: latency, retained commands, and devices that are offline.

use std::time::{Duration, Instant};

use rumqttc::{Event, Packet, QoS, RecvTimeoutError};
use tropism::rig::RigError;

use crate::broker::Broker;
use crate::failed;
use crate::http::in_plain_words;
use crate::mqtt::{Plug, is_online};

/// Result of a broker check.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BrokerReport {
    /// Time from publishing a message to receiving it.
    pub round_trip: Duration,
    /// Command topics with a retained command, which a device that restarts would carry out again.
    pub retained_commands: Vec<String>,
    /// Availability topics that say offline.
    pub offline: Vec<String>,
}

/// Time limit of the whole check: chosen by hand.
const TIMEOUT: Duration = Duration::from_secs(5);

/// Connects to `broker`, publishes a message to itself, and reads the retained messages of `plugs`. Sends no command.
///
/// # Errors
/// [`RigError::Device`] if that takes more than five seconds.
pub fn broker(broker: &Broker, plugs: &[&Plug]) -> Result<BrokerReport, RigError> {
    let error = |problem: String| failed(format!("broker ({}:{})", broker.host, broker.port), problem);
    let name = format!("tropism-check-{}", std::process::id());
    let own = format!("tropism/check/{}", std::process::id());
    let (client, mut connection) = broker.opened()?.connect(name.clone(), 32, |_| {});
    let deadline = Instant::now() + TIMEOUT;
    let mut next = |doing: &str| loop {
        match connection.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
            Ok(Ok(Event::Incoming(packet))) => return Ok(packet),
            Ok(Ok(Event::Outgoing(_))) => {}
            Ok(Err(cause)) => {
                return Err(error(format!("while {doing}: {}", in_plain_words(&cause.to_string()))));
            }
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                return Err(error(format!("while {doing}: no answer in {TIMEOUT:?}")));
            }
        }
    };
    while !matches!(next("connecting")?, Packet::ConnAck(_)) {}
    let mut topics = vec![own.clone()];
    let (mut commands, mut availabilities) = (Vec::new(), Vec::new());
    for plug in plugs {
        let (command, availability) = plug.watched_topics().map_err(error)?;
        topics.extend([Some(command.clone()), availability.clone()].into_iter().flatten());
        commands.push(command);
        availabilities.extend(availability);
    }
    let refused = |cause: rumqttc::ClientError| error(cause.to_string());
    for topic in &topics {
        client.try_subscribe(topic, QoS::AtLeastOnce).map_err(refused)?;
    }
    let (mut retained_commands, mut offline, mut unanswered) = (Vec::new(), Vec::new(), topics.len());
    let mut sent = None;
    loop {
        match next("passing a message through it")? {
            // Retained messages arrive with the acknowledgements, before our own message.
            Packet::SubAck(_) => {
                unanswered -= 1;
                if unanswered == 0 {
                    sent = Some(Instant::now());
                    client.try_publish(&own, QoS::AtMostOnce, false, name.as_str()).map_err(refused)?;
                }
            }
            Packet::Publish(message) if message.topic == own.as_bytes() => {
                let round_trip = sent.map_or(TIMEOUT, |sent| sent.elapsed());
                let _ = client.try_disconnect();
                return Ok(BrokerReport { round_trip, retained_commands, offline });
            }
            Packet::Publish(message) => {
                let is_it = |topic: &&String| message.topic == topic.as_bytes();
                if message.retain {
                    retained_commands.extend(commands.iter().find(is_it).cloned());
                }
                if is_online(&message.payload) == Some(false) {
                    offline.extend(availabilities.iter().find(is_it).cloned());
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Mosquitto, hear};

    #[test]
    fn a_retained_command_is_found() {
        let Some(mosquitto) = Mosquitto::start(None) else { return };
        let rig = Broker::new("127.0.0.1", mosquitto.port);
        let plug: Plug = toml::from_str("dialect = \"tasmota\"\nname = \"flash\"").unwrap();
        let found = broker(&rig, &[&plug]).unwrap();
        assert_eq!((found.retained_commands, found.offline), (Vec::new(), Vec::new()));

        let (client, mut connection) = rig.connect("other".to_owned(), 8, |_| {});
        for (topic, text) in [("cmnd/flash/POWER", "ON"), ("tele/flash/LWT", "Offline")] {
            client.try_publish(topic, QoS::AtLeastOnce, true, text).unwrap();
            hear(&mut connection, |packet| matches!(packet, Packet::PubAck(_)));
        }
        let found = broker(&rig, &[&plug]).unwrap();
        assert_eq!(found.retained_commands, ["cmnd/flash/POWER"]);
        assert_eq!(found.offline, ["tele/flash/LWT"]);
        drop(mosquitto);
        let problem = broker(&rig, &[]).unwrap_err().to_string();
        assert!(problem.contains("while connecting"), "{problem}");
    }
}
