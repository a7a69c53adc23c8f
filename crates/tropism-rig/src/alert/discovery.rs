//! How a run announces itself to Home Assistant: one retained message that names the device and its entities.
//!
//! All entities read the retained status of the run; the photograph and the stop button have topics of their own.
//!
//! # References
//! Home Assistant, "MQTT", device discovery: <https://www.home-assistant.io/integrations/mqtt/#discovery-messages-and-availability>.

use serde_json::{Value, json};

use super::{MqttAlert, Origin};

/// What asks for an orderly end of the run in `TOPIC/command`.
pub(super) const STOP: &str = "stop";

/// The topic of the announcement, and the announcement. `None` unless the channel has `discovery`.
pub(super) fn announcement(alert: &MqttAlert, origin: &Origin) -> Option<(String, Value)> {
    let prefix = alert.discovery.as_deref()?;
    // Home Assistant allows letters, digits, _ and - in an identifier.
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || letter == '-';
    let plain = |letter: char| if is_plain(letter) { letter } else { '_' };
    let id = format!("tropism_{}", alert.topic.chars().map(plain).collect::<String>());
    let topic = |name: &str| format!("{}/{name}", alert.topic);
    let status = topic("status");
    // A key that the status does not have yet is no error there.
    let value = |key: &str| format!("{{{{ value_json.{key} | default(none) }}}}");
    let entity = |platform: &str, key: &str, name: &str, more: Value| {
        let mut entity = json!({"platform": platform, "unique_id": format!("{id}_{key}"), "name": name});
        let more = more.as_object().cloned().unwrap_or_default();
        entity.as_object_mut().expect("an object").extend(more);
        (key.to_owned(), entity)
    };
    // An entity that shows a key of the status, or what a template makes of it.
    let shown = |platform: &str, key: &str, name: &str, more: Value| {
        let (key, mut entity) = entity(platform, key, name, more);
        entity["state_topic"] = status.clone().into();
        if entity["value_template"].is_null() {
            entity["value_template"] = value(&key).into();
        }
        (key, entity)
    };
    let sensor = |key: &str, name: &str, more: Value| shown("sensor", key, name, more);
    let length =
        json!({"unit_of_measurement": "cm", "device_class": "distance", "suggested_display_precision": 1});
    let is_wrong = "{{ 'ON' if value_json.state in ['paused', 'fault', 'lost'] else 'OFF' }}";
    let next = "{{ (value_json.next_unix_s | default(none)) and (value_json.next_unix_s | as_datetime) }}";
    let components: serde_json::Map<String, Value> = [
        sensor("tip_y_cm", "Tip height", length.clone()),
        sensor("tip_x_cm", "Tip to the right", length),
        sensor("lamp", "Lamp", json!({"icon": "mdi:lightbulb"})),
        sensor(
            "next_unix_s",
            "Next photograph",
            json!({"device_class": "timestamp", "value_template": next}),
        ),
        sensor("state", "State", json!({"icon": "mdi:sprout"})),
        sensor("text", "Last event", json!({"icon": "mdi:message-text"})),
        shown(
            "binary_sensor",
            "problem",
            "Problem",
            json!({"device_class": "problem", "value_template": is_wrong}),
        ),
        entity("camera", "photograph", "Photograph", json!({"topic": topic("photograph")})),
        entity(
            "button",
            "stop",
            "Stop the run",
            json!({"command_topic": topic("command"), "payload_press": STOP, "icon": "mdi:stop"}),
        ),
    ]
    .into_iter()
    .collect();
    let mut announcement = json!({
        "device": {"identifiers": [id], "name": origin.run, "manufacturer": "tropism", "model": "run", "sw_version": env!("CARGO_PKG_VERSION")},
        "origin": {"name": "tropism", "sw_version": env!("CARGO_PKG_VERSION")},
        "components": components,
    });
    if let Some(url) = &origin.url {
        announcement["device"]["configuration_url"] = url.as_str().into();
    }
    Some((format!("{prefix}/device/{id}/config"), announcement))
}
