use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use rumqttc::{Event, Packet, QoS};
use serde_json::Value;

use super::channel::{Channel, Pace};
use super::*;
use crate::driver::AlertDriver;
use crate::http::tests::{device, reply};
use crate::testing::{Mosquitto, hear, wait_until};

/// Quick, so that a test need not wait a minute.
const QUICK: Pace = Pace {
    min_interval: Duration::from_millis(40),
    is_queued: true,
    first_retry: Duration::from_millis(10),
    max_retry: Duration::from_millis(20),
};

fn event(kind: impl Into<Kind>, step: u32) -> AlertEvent {
    AlertEvent::now(kind, Some(step), format!("text {step}"))
}

/// The page of the run.
const PAGE: &str = "http://greenhouse.local:8734/";

fn origin() -> Origin {
    Origin::new("bean", Some(PAGE), None)
}

fn open(text: &str, broker: Option<&Broker>) -> Alerts {
    let driver: AlertDriver = toml::from_str(text).unwrap();
    driver.check().unwrap();
    Alerts::open(std::iter::once(driver.settings()), broker, &origin()).unwrap()
}

/// What a server was asked, in order.
type Asked = Arc<Mutex<Vec<(String, String, String)>>>;

/// A server that fails as long as `is_down` says so.
fn server(is_down: &Arc<AtomicBool>) -> (String, Asked) {
    let asked = Asked::default();
    let (log, is_down) = (Arc::clone(&asked), Arc::clone(is_down));
    let url = device(move |_, request, socket| {
        if is_down.load(Ordering::SeqCst) {
            let _ = socket.write_all(b"HTTP/1.1 503 Busy\r\nContent-Length: 0\r\n\r\n");
            return;
        }
        let entry = (request.line.trim().to_owned(), request.headers.to_lowercase(), request.body.clone());
        log.lock().unwrap().push(entry);
        reply(socket, b"ok");
    });
    (url, asked)
}

#[test]
fn kinds_are_read_as_they_are_written() {
    for kind in Kind::all() {
        assert_eq!(kind.name().parse(), Ok(kind));
        assert_eq!(serde_json::to_value(kind).unwrap(), kind.name());
    }
    assert!("misstake".parse::<Kind>().unwrap_err().contains("wanted one of started"));
}

#[test]
fn ntfy_gets_title_priority_and_text_and_its_secret_stays_out_of_errors() {
    let folder = tempfile::tempdir().unwrap();
    let (address, token) = (folder.path().join("address"), folder.path().join("token"));
    let (url, asked) = server(&Arc::new(AtomicBool::new(false)));
    std::fs::write(&address, format!("{url}/my-secret-topic\n")).unwrap();
    std::fs::write(&token, "Bearer tk_1\n").unwrap();
    let alerts = open(
        &format!(
            "driver = \"ntfy\"\nurl_file = {address:?}\nauthorization_file = {token:?}\non = [\"fault\"]"
        ),
        None,
    );
    alerts.send(&event(EventKind::Started, 0));
    alerts.send(&event(Kind::Event(EventKind::Fault), 7));
    assert_eq!(alerts.close(), []);
    let asked = asked.lock().unwrap();
    let [(line, headers, body)] = &asked[..] else { panic!("{asked:?}") };
    assert!(line.starts_with("POST /my-secret-topic "), "{line}");
    assert!(headers.contains("title: tropism: fault") && headers.contains("priority: high"), "{headers}");
    assert!(headers.contains("authorization: bearer tk_1"), "{headers}");
    assert!(headers.contains(&format!("click: {PAGE}")), "{headers}");
    assert_eq!(body, "bean\nfault, step 7: text 7");

    std::fs::write(&address, "not-an-address secret\n").unwrap();
    let driver: AlertDriver = toml::from_str(&format!("driver = \"ntfy\"\nurl_file = {address:?}")).unwrap();
    let error = Alerts::open(std::iter::once(driver.settings()), None, &origin()).unwrap_err().to_string();
    assert!(error.contains("no address") && !error.contains("secret"), "{error}");
}

#[test]
fn secrets_of_addresses_and_controls_stay_out_of_alerts_and_of_their_errors() {
    let (url, asked) = server(&Arc::new(AtomicBool::new(false)));
    let alerts = open(&format!("driver = \"webhook\"\nurl = \"{url}/hook\""), None);
    alerts.send(&AlertEvent::now(
        Kind::Event(EventKind::Fault),
        Some(1),
        "camera (http://u:s3cret@c/x?token=abc1): \x1b[2J gone",
    ));
    assert_eq!(alerts.close(), []);
    let said: Value = serde_json::from_str(&asked.lock().unwrap()[0].2).unwrap();
    assert_eq!(said["text"], "camera (http://***@c/x?token=***): \\u{1b}[2J gone");

    // The topic is a secret, too.
    for url in
        ["ftp://ntfy.sh/my-topic?auth=abc1", "ntfy.sh/my-topic", "https://u:p/my-topic x@ntfy.sh/my-topic"]
    {
        let driver: AlertDriver = toml::from_str(&format!("driver = \"ntfy\"\nurl = {url:?}")).unwrap();
        let error = driver.settings().check().unwrap_err();
        assert!(!error.contains("topic") && !error.contains("abc1") && error.contains("ntfy.sh"), "{error}");
    }
    let alerts = open("driver = \"ntfy\"\nurl = \"http://127.0.0.1:1/my-topic?auth=abc1\"", None);
    alerts.send(&AlertEvent::now(Kind::Test, None, "text"));
    let unsent = alerts.close();
    assert!(
        unsent.len() == 1 && !unsent[0].1.contains("topic") && !unsent[0].1.contains("abc1"),
        "{unsent:?}"
    );
}

#[test]
fn a_webhook_gets_an_object_for_each_message_and_a_heartbeat_one_request_for_many_steps() {
    let (url, asked) = server(&Arc::new(AtomicBool::new(false)));
    let alerts = open(&format!("driver = \"webhook\"\nurl = \"{url}/hook\""), None);
    for step in 0..3 {
        alerts.send(&event(Kind::Step, step));
    }
    alerts.send(&event(EventKind::Finished, 3));
    assert_eq!(alerts.close(), []);
    {
        let asked = asked.lock().unwrap();
        let [(_, headers, body)] = &asked[..] else { panic!("{asked:?}") };
        assert!(headers.contains("content-type: application/json"), "{headers}");
        let said: Value = serde_json::from_str(body).unwrap();
        assert_eq!(
            (&said["kind"], &said["step"], &said["run"]),
            (&"finished".into(), &3.into(), &"bean".into())
        );
        assert_eq!(said["url"], PAGE);
    }

    let (url, asked) = server(&Arc::new(AtomicBool::new(false)));
    let alerts = open(&format!("driver = \"heartbeat\"\nurl = \"{url}/beat\""), None);
    alerts.send(&event(Kind::Event(EventKind::Fault), 0));
    for step in 0..5 {
        alerts.send(&event(Kind::Step, step));
    }
    wait_until(|| !asked.lock().unwrap().is_empty());
    assert_eq!(alerts.close(), []);
    let asked = asked.lock().unwrap();
    assert_eq!(asked.iter().map(|(line, ..)| line.as_str()).collect::<Vec<_>>(), ["GET /beat HTTP/1.1"]);
}

#[test]
fn what_could_not_be_delivered_is_delivered_later_together_and_once() {
    let is_down = Arc::new(AtomicBool::new(true));
    let (url, asked) = server(&is_down);
    let sender = Sender::Ntfy { url, authorization: None, timeout: Duration::from_secs(5), origin: origin() };
    let tries = Arc::new(Mutex::new(0));
    let counted = Arc::clone(&tries);
    let channel = Channel::start("ntfy", default_kinds(), QUICK, move |events| {
        *counted.lock().unwrap() += 1;
        sender.send(events)
    });
    channel.send(&event(EventKind::Mismatch, 1));
    wait_until(|| *tries.lock().unwrap() >= 3);
    channel.send(&event(EventKind::Recovered, 2));
    is_down.store(false, Ordering::SeqCst);
    wait_until(|| !asked.lock().unwrap().is_empty());
    assert_eq!(channel.end().wait(), None);
    let bodies: Vec<_> = asked.lock().unwrap().iter().map(|(_, _, body)| body.clone()).collect();
    assert_eq!(bodies.concat().matches("text 1").count(), 1, "{bodies:?}");
    assert_eq!(bodies.concat().matches("text 2").count(), 1, "{bodies:?}");
}

#[test]
fn many_messages_at_once_are_few_and_a_network_that_hangs_delays_nothing() {
    let messages = Arc::new(Mutex::new(Vec::new()));
    let log = Arc::clone(&messages);
    let (enter, entered) = std::sync::mpsc::channel::<()>();
    let channel = Channel::start("ntfy", default_kinds(), QUICK, move |events| {
        // The first one hangs until the test lets it go.
        if log.lock().unwrap().is_empty() {
            let _ = entered.recv();
        }
        log.lock().unwrap().push(events.len());
        Ok(())
    });
    for step in 0..50 {
        channel.send(&event(EventKind::Mismatch, step));
    }
    assert!(messages.lock().unwrap().is_empty(), "all were sent while the first one hangs");
    enter.send(()).unwrap();
    assert_eq!(channel.end().wait(), None);
    let messages = messages.lock().unwrap();
    assert_eq!(messages.iter().sum::<usize>(), 50);
    assert!(messages.len() <= 3, "{messages:?}");
}

#[test]
fn at_the_end_it_is_tried_once_more_and_then_said() {
    let (url, _) = server(&Arc::new(AtomicBool::new(true)));
    let alerts = open(&format!("driver = \"webhook\"\nurl = \"{url}\""), None);
    alerts.send(&event(Kind::Event(EventKind::Fault), 1));
    let left = alerts.close();
    assert!(matches!(&left[..], [("webhook", problem)] if problem.contains("503")), "{left:?}");
}

#[test]
fn a_program_gets_kind_and_text() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log");
    let script = format!("printf '%s|%s' \"$1\" \"$2\" > {}", log.display());
    let alerts = open(&format!("driver = \"command\"\ncommand = [\"sh\", \"-c\", {script:?}, \"sh\"]"), None);
    alerts.send(&AlertEvent::now(EventKind::Paused, None, "the lamp; $(reboot)"));
    assert_eq!(alerts.close(), []);
    assert_eq!(std::fs::read_to_string(log).unwrap(), "paused|paused: the lamp; $(reboot)");
}

/// What came through a broker: topics and messages.
type Heard = Arc<Mutex<Vec<(String, Value)>>>;

/// Listens to a broker as long as it lives; the second value says when.
fn listen(port: u16) -> (Heard, Arc<AtomicBool>) {
    let (heard, is_there) = (Heard::default(), Arc::new(AtomicBool::new(false)));
    let (log, there) = (Arc::clone(&heard), Arc::clone(&is_there));
    let (client, mut connection) =
        Broker::new("127.0.0.1", port).connect("listener".to_owned(), 8, |options| {
            options.set_max_packet_size(1 << 20, 1 << 20);
        });
    client.try_subscribe("#", QoS::AtLeastOnce).unwrap();
    thread::spawn(move || {
        let _client = client;
        for event in connection.iter() {
            match event {
                Ok(Event::Incoming(Packet::SubAck(_))) => there.store(true, Ordering::SeqCst),
                Ok(Event::Incoming(Packet::Publish(message))) => {
                    // A photograph is no JSON: its number of bytes stands for it.
                    let said = serde_json::from_slice(&message.payload)
                        .unwrap_or_else(|_| message.payload.len().into());
                    log.lock().unwrap().push((String::from_utf8_lossy(&message.topic).into_owned(), said));
                }
                Ok(_) => {}
                Err(_) => return,
            }
        }
    });
    (heard, is_there)
}

#[test]
fn a_broker_keeps_the_status_and_says_when_we_are_lost() {
    let Some(mosquitto) = Mosquitto::start(None) else { return };
    let rig = Broker::new("127.0.0.1", mosquitto.port);
    let (heard, is_there) = listen(mosquitto.port);
    wait_until(|| is_there.load(Ordering::SeqCst));
    let settings = "driver = \"mqtt\"\ntopic = \"tent\"\non = [\"mismatch\"]";
    let states = || -> Vec<String> {
        let heard = heard.lock().unwrap();
        let states = heard.iter().filter(|(topic, _)| topic == "tent/status");
        states.map(|(_, said)| said["state"].as_str().unwrap().to_owned()).collect()
    };
    let alerts = open(settings, Some(&rig));
    alerts.send(&event(EventKind::Mismatch, 4));
    wait_until(|| {
        heard.lock().unwrap().iter().any(|(topic, said)| topic == "tent/event" && said["step"] == 4)
    });
    assert!(heard.lock().unwrap().iter().any(|(topic, said)| topic == "tent/event" && said["url"] == PAGE));
    alerts.send(&event(EventKind::Finished, 5));
    assert_eq!(alerts.close(), []);
    wait_until(|| states().last().is_some_and(|state| state == "finished"));
    assert!(!states().contains(&"lost".to_owned()), "an end in order is no loss: {:?}", states());
    let events = heard.lock().unwrap().iter().filter(|(topic, _)| topic == "tent/event").count();
    assert_eq!(events, 1, "only what was asked for");

    // A second program of the same name throws the first out, as a broken line would: the will is spoken, then the
    // status is put right again by the one that lives.
    let count = states().len();
    let alerts = open(settings, Some(&rig));
    wait_until(|| states().len() > count);
    let name = format!("tropism-run-{}", std::process::id());
    let (_client, mut thief) = Broker::new("127.0.0.1", mosquitto.port).connect(name, 8, |_| {});
    hear(&mut thief, |packet| matches!(packet, Packet::ConnAck(_)));
    wait_until(|| states().contains(&"lost".to_owned()));
    drop(alerts);
}

/// Checks an announcement by what Home Assistant demands of one: <https://www.home-assistant.io/integrations/mqtt/>.
fn check_announcement(said: &Value) {
    assert!(said["device"]["identifiers"][0].is_string() && said["device"]["name"].is_string(), "{said}");
    assert!(said["origin"]["name"].is_string());
    let mut ids = std::collections::BTreeSet::new();
    for (key, component) in said["components"].as_object().unwrap() {
        // What an entity of each platform cannot do without.
        let wanted: &[&str] = match component["platform"].as_str().unwrap() {
            "sensor" | "binary_sensor" => &["unique_id", "state_topic", "name", "value_template"],
            "camera" => &["unique_id", "topic", "name"],
            "button" => &["unique_id", "command_topic", "payload_press", "name"],
            other => panic!("{key}: {other}"),
        };
        assert!(wanted.iter().all(|key| component[key].is_string()), "{key}: {component}");
        assert!(ids.insert(component["unique_id"].to_string()), "{key}: its id is not its own");
        // A unit without a class that has it would be refused.
        assert!(
            component["unit_of_measurement"].is_null() || component["device_class"] == "distance",
            "{component}"
        );
    }
    assert_eq!(ids.len(), 9);
}

#[test]
fn a_run_announces_itself_shows_its_plant_and_is_stopped_by_a_button() {
    let Some(mosquitto) = Mosquitto::start(None) else { return };
    let folder = tempfile::tempdir().unwrap();
    let photograph = folder.path().join("000004.jpg");
    std::fs::write(&photograph, vec![0xff; 50_000]).unwrap();
    let (heard, is_there) = listen(mosquitto.port);
    wait_until(|| is_there.load(Ordering::SeqCst));
    let of = |topic: &str| -> Option<Value> {
        heard.lock().unwrap().iter().rev().find(|(other, _)| other == topic).map(|(_, said)| said.clone())
    };
    let broker = Broker::new("127.0.0.1", mosquitto.port);
    // An order that the broker kept from a run before.
    let order = |is_kept: bool| {
        let (client, mut connection) = broker.connect("house".to_owned(), 8, |_| {});
        client.try_publish("tent/a/command", QoS::AtLeastOnce, is_kept, "stop").unwrap();
        hear(&mut connection, |packet| matches!(packet, Packet::PubAck(_)));
    };
    order(true);
    let alerts = open("driver = \"mqtt\"\ntopic = \"tent/a\"\ndiscovery = \"homeassistant\"", Some(&broker));
    let announced = "homeassistant/device/tropism_tent_a/config";
    wait_until(|| of(announced).is_some());
    check_announcement(&of(announced).unwrap());
    assert_eq!(of(announced).unwrap()["device"]["configuration_url"], PAGE);
    let mut step = event(Kind::Step, 4);
    step.seen =
        Some(Seen { tip_x_cm: 1.25, tip_y_cm: 7.5, lamp: "left".to_owned(), next_unix_s: 300.0, photograph });
    alerts.send(&step);
    wait_until(|| of("tent/a/photograph").is_some_and(|said| said == 50_000));
    alerts.send(&event(EventKind::Late, 4));
    wait_until(|| of("tent/a/status").is_some_and(|status| status["kind"] == "late"));
    let status = of("tent/a/status").unwrap();
    assert_eq!((&status["tip_y_cm"], &status["lamp"]), (&Value::from(7.5), &Value::from("left")), "{status}");
    assert!(!alerts.is_stopped(), "the order is of a run before");
    order(false);
    wait_until(|| alerts.is_stopped());
    assert_eq!(alerts.close(), []);
}
