//! Whether a broker does what the plugs behind it need.

use std::time::{Duration, Instant};

use rumqttc::{Client, Event, MqttOptions, Packet, QoS, RecvTimeoutError};
use tropism::rig::RigError;

use crate::failed;
use crate::http::read_secret;
use crate::mqtt::{Broker, Plug, is_online};

/// What a broker showed of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BrokerFound {
    /// From a message out to the same message in.
    pub round_trip: Duration,
    /// Topics of orders in which it keeps one.
    pub kept_orders: Vec<String>,
    /// Topics in which a device is said to be offline.
    pub away: Vec<String>,
}

/// How long a broker may take for all of it.
const TIMEOUT: Duration = Duration::from_secs(5);

/// Connects to `broker`, passes a message through it, and reads what it has kept for `plugs`. Gives no order.
///
/// # Errors
/// [`RigError::Device`] if it does not do so in five seconds.
pub fn broker(broker: &Broker, plugs: &[&Plug]) -> Result<BrokerFound, RigError> {
    let error = |problem: String| failed(format!("broker ({}:{})", broker.host, broker.port), problem);
    let name = format!("tropism-check-{}", std::process::id());
    let own = format!("tropism/check/{}", std::process::id());
    let mut options = MqttOptions::new(&name, &broker.host, broker.port);
    options.set_clean_session(true);
    if let Some(username) = &broker.username {
        let password = broker.password_file.as_deref().map(read_secret).transpose()?;
        options.set_credentials(username, password.unwrap_or_default());
    }
    let (client, mut connection) = Client::new(options, 32);
    let deadline = Instant::now() + TIMEOUT;
    let mut next = |doing: &str| loop {
        match connection.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
            Ok(Ok(Event::Incoming(packet))) => return Ok(packet),
            Ok(Ok(Event::Outgoing(_))) => {}
            Ok(Err(cause)) => return Err(error(format!("while {doing}: {cause}"))),
            Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                return Err(error(format!("while {doing}: found no answer in {TIMEOUT:?}, wanted one")));
            }
        }
    };
    while !matches!(next("connecting")?, Packet::ConnAck(_)) {}
    let mut topics = vec![own.clone()];
    let (mut orders, mut presences) = (Vec::new(), Vec::new());
    for plug in plugs {
        let (order, presence) = plug.watched().map_err(error)?;
        topics.extend([Some(order.clone()), presence.clone()].into_iter().flatten());
        orders.push(order);
        presences.extend(presence);
    }
    let refused = |cause: rumqttc::ClientError| error(cause.to_string());
    for topic in &topics {
        client.try_subscribe(topic, QoS::AtLeastOnce).map_err(refused)?;
    }
    let (mut kept_orders, mut away, mut unanswered) = (Vec::new(), Vec::new(), topics.len());
    let mut sent = None;
    loop {
        match next("passing a message through it")? {
            // What it kept comes with its answers, so before our own message.
            Packet::SubAck(_) => {
                unanswered -= 1;
                if unanswered == 0 {
                    sent = Some(Instant::now());
                    client.try_publish(&own, QoS::AtMostOnce, false, name.as_str()).map_err(refused)?;
                }
            }
            Packet::Publish(message) if message.topic == own => {
                let round_trip = sent.map_or(TIMEOUT, |sent| sent.elapsed());
                let _ = client.try_disconnect();
                return Ok(BrokerFound { round_trip, kept_orders, away });
            }
            Packet::Publish(message) if message.retain && orders.contains(&message.topic) => {
                kept_orders.push(message.topic);
            }
            Packet::Publish(message)
                if presences.contains(&message.topic) && is_online(&message.payload) == Some(false) =>
            {
                away.push(message.topic);
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
    fn a_broker_that_keeps_an_order_is_found_out() {
        let Some(mosquitto) = Mosquitto::start(None) else { return };
        let rig = Broker {
            host: "127.0.0.1".to_owned(),
            port: mosquitto.port,
            username: None,
            password_file: None,
        };
        let plug: Plug = toml::from_str("dialect = \"tasmota\"\nname = \"flash\"").unwrap();
        let found = broker(&rig, &[&plug]).unwrap();
        assert_eq!((found.kept_orders, found.away), (Vec::new(), Vec::new()));

        let (client, mut connection) = Client::new(MqttOptions::new("other", "127.0.0.1", mosquitto.port), 8);
        for (topic, text) in [("cmnd/flash/POWER", "ON"), ("tele/flash/LWT", "Offline")] {
            client.try_publish(topic, QoS::AtLeastOnce, true, text).unwrap();
            hear(&mut connection, |packet| matches!(packet, Packet::PubAck(_)));
        }
        let found = broker(&rig, &[&plug]).unwrap();
        assert_eq!(found.kept_orders, ["cmnd/flash/POWER"]);
        assert_eq!(found.away, ["tele/flash/LWT"]);
        drop(mosquitto);
        let problem = broker(&rig, &[]).unwrap_err().to_string();
        assert!(problem.contains("while connecting"), "{problem}");
    }
}
