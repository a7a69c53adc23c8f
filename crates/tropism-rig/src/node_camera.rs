//! A camera as the sensor of a real node.
//!
//! In: a camera. Out: a reading once a step in the node's topic `NAME/reading`, as any other sensor publishes it; `null` where the
//! camera gave no picture.

use std::thread;
use std::time::{Duration, Instant};

use rumqttc::{QoS, RecvTimeoutError};
use tropism::nodes::green_reading;
use tropism::rig::{Camera, RigError};

use crate::broker::Broker;
use crate::failed;
use crate::node::NodeProcess;

/// Messages that may wait for the network. Chosen: none that is older than some steps.
const WAITING: usize = 4;
/// Longest wait before a request to end is looked at, and before a connection is tried again.
const LOOK: Duration = Duration::from_millis(100);

impl NodeProcess {
    /// Publishes what the node's camera sees, once a period, until `is_over`. `gain` is that of
    /// [`green_reading`]; `problem` hears of each picture that failed.
    ///
    /// # Errors
    /// [`RigError::Device`] if a secret of the broker cannot be read or the connection ends.
    pub fn publish_pictures(
        &self,
        broker: &Broker,
        camera: &mut dyn Camera,
        gain: f64,
        is_over: &dyn Fn() -> bool,
        problem: &mut dyn FnMut(&RigError),
    ) -> Result<(), RigError> {
        let device = || format!("camera of node {}", self.name);
        let name = format!("tropism-{}-{}-camera", self.experiment, self.name);
        let (client, mut connection) = broker.opened()?.connect(name, WAITING, |options| {
            // A camera may take its time.
            options.set_keep_alive(60);
        });
        while !is_over() {
            let next = Instant::now() + self.period;
            let reading = camera.photograph().and_then(|photo| {
                let picture = photo.decode().map_err(|error| failed(device(), error.to_string()))?;
                Ok(green_reading(&picture, gain))
            });
            let text = match &reading {
                Ok(reading) => reading.to_string(),
                Err(error) => {
                    problem(error);
                    "null".to_owned()
                }
            };
            // A full queue is a broker that is away: what it does not hear is old by the time it is back.
            let _ = client.try_publish(self.topic(&self.name, "reading"), QoS::AtMostOnce, false, text);
            while let Some(left) = next.checked_duration_since(Instant::now()).filter(|_| !is_over()) {
                match connection.recv_timeout(left.min(LOOK)) {
                    Ok(Ok(_)) | Err(RecvTimeoutError::Timeout) => {}
                    Ok(Err(_)) => thread::sleep(left.min(LOOK)),
                    Err(RecvTimeoutError::Disconnected) => {
                        return Err(failed(device(), "the connection ended"));
                    }
                }
            }
        }
        let _ = client.try_disconnect();
        while let Ok(Ok(_)) = connection.recv_timeout(LOOK) {}
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::{Arc, Mutex};

    use rumqttc::{Event, Packet};
    use tropism::photo::{Image, Photo};

    use super::*;
    use crate::testing::{Mosquitto, wait_until};

    /// Gives a dark picture, then a green one, and then none.
    struct Pictures(Arc<AtomicUsize>);

    impl Camera for Pictures {
        fn photograph(&mut self) -> Result<Photo, RigError> {
            let bytes = match self.0.fetch_add(1, Ordering::SeqCst) {
                0 => jpeg([4, 4, 4]),
                1 => jpeg([60, 120, 40]),
                2 => b"no picture".to_vec(),
                _ => return Err(failed("camera", "it is gone")),
            };
            Ok(Photo { name: "picture".to_owned(), bytes, time_s: 0.0 })
        }
    }

    fn jpeg(colour: [u8; 3]) -> Vec<u8> {
        Image { width: 16, height: 16, rgb: colour.repeat(256) }.to_jpeg(90).unwrap()
    }

    #[test]
    fn pictures_become_readings_and_a_camera_that_fails_none() {
        let Some(mosquitto) = Mosquitto::start(None) else { return };
        let broker = Broker::new("127.0.0.1", mosquitto.port);
        let process = NodeProcess {
            experiment: "e".to_owned(),
            name: "n1".to_owned(),
            is_on_path: true,
            previous: None,
            next: None,
            siblings: Vec::new(),
            period: Duration::from_millis(100),
            tasmota: None,
        };
        let heard = Arc::new(Mutex::new(Vec::new()));
        let (client, mut connection) = broker.connect("listener".to_owned(), 64, |_| {});
        client.try_subscribe("tropism/wall/e/n1/reading", QoS::AtMostOnce).unwrap();
        let all = Arc::clone(&heard);
        let is_ready = Arc::new(AtomicUsize::new(0));
        let ready = Arc::clone(&is_ready);
        thread::spawn(move || {
            for event in connection.iter().map_while(Result::ok) {
                match event {
                    Event::Incoming(Packet::SubAck(_)) => ready.store(1, Ordering::SeqCst),
                    Event::Incoming(Packet::Publish(message)) => {
                        all.lock().unwrap().push(String::from_utf8(message.payload.to_vec()).unwrap());
                    }
                    _ => {}
                }
            }
        });
        wait_until(|| is_ready.load(Ordering::SeqCst) == 1);
        let taken = Arc::new(AtomicUsize::new(0));
        let mut problems = Vec::new();
        let over = || taken.load(Ordering::SeqCst) > 4;
        process
            .publish_pictures(&broker, &mut Pictures(Arc::clone(&taken)), 50.0, &over, &mut |error| {
                problems.push(error.to_string());
            })
            .unwrap();
        wait_until(|| heard.lock().unwrap().len() >= 4);
        let heard = heard.lock().unwrap();
        assert_eq!(heard[0], "0");
        assert!(heard[1].parse::<f64>().unwrap() > 2.0, "{heard:?}");
        assert_eq!(heard[2..4], ["null", "null"]);
        assert!(
            problems[0].contains("camera of node n1") && problems[1].contains("it is gone"),
            "{problems:?}"
        );
    }
}
