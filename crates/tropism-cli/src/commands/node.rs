//! `tropism node`: one node of a wall over MQTT.

use std::path::PathBuf;
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, anyhow, ensure};
use clap::Args;
use serde::Deserialize;
use tropism::nodes::StateMachine;
use tropism::rig::RigError;
use tropism_lab::files;
use tropism_lab::wall::WallFile;
use tropism_rig::broker::Broker;
use tropism_rig::driver::CameraDriver;

use crate::shell::Shell;

/// Run one node of a wall: its sensor, its lamp and its neighbours over MQTT
///
/// One process a node, on a computer of its own or all on one. There is no central process. The node learns the empty scene until
/// the topic tropism/wall/EXPERIMENT/start holds 1 (retained), then steers by the state machine of the wall file. Its lamp
/// must have a timer of its own. Tried against mosquitto, not on hardware.
#[derive(Args)]
#[command(
    after_help = "Example:\n  tropism node left1 --wall wall.toml --broker raspberrypi.local --experiment june --tasmota plug1\n\n\
                  The path of the wall file must be drawn, the same for all nodes. `tropism watch-wall` starts and watches\n\
                  the experiment."
)]
pub(crate) struct Node {
    /// Name of the node in the wall file
    #[arg(value_name = "NAME")]
    name: String,

    /// Wall file with a drawn path
    #[arg(long, value_name = "WALL.toml")]
    wall: PathBuf,

    /// Host of the MQTT broker, or HOST:PORT
    #[arg(long, default_value = "127.0.0.1", value_name = "HOST")]
    broker: String,

    /// Name of the experiment: a new one for each, so that nothing is left of the last
    #[arg(long, value_name = "ID")]
    experiment: String,

    /// Name of the lamp, if it has Tasmota; others obey the topic of the node
    #[arg(long, value_name = "DEVICE")]
    tasmota: Option<String>,

    /// File with the table [camera] of a rig file: a camera is the sensor of this node
    #[arg(long, value_name = "CAMERA.toml")]
    camera: Option<PathBuf>,

    /// Seconds from one step to the next, 1 to 3600
    #[arg(long, default_value_t = 300.0, value_name = "S")]
    period: f64,
}

impl Node {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        ensure!((1.0..=3600.0).contains(&self.period), "found --period {}, wanted 1 to 3600 s", self.period);
        let file = WallFile::read(&self.wall)?;
        let period = Duration::from_secs_f64(self.period);
        let node = file.node_process(&self.name, &self.experiment, self.tasmota, period)?;
        let mut machine = StateMachine::new(file.machine);
        Shell::end_in_order();
        let per_step = self.period;
        // Steps are counted from 1970, so that they grow over restarts; 32 bits hold them until 2106.
        let step_of = move || {
            let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
            (now.as_secs_f64() / per_step) as u32
        };
        shell.note(&format!(
            "node {} of experiment {}; Ctrl-C ends it with its lamp dark",
            node.name, node.experiment
        ));
        let broker = parse_broker(&self.broker)?;
        let mut watch = |message: &tropism::nodes::NodeMessage| {
            if message.lamp_is_dead {
                shell.note("warning: the lamp does not light up");
            }
        };
        let timeout = Duration::from_secs(60);
        let mut run =
            || node.run(&broker, &mut machine, timeout, &step_of, &Shell::is_interrupted, &mut watch);
        let Some(path) = self.camera else { return Ok(run()?) };
        let mut camera = files::read_toml::<CameraFile>(&path)?.camera.settings().open()?;
        let gain = file.camera.unwrap_or_default().cameras(&file.wall, 0).gain();
        thread::scope(|scope| {
            let running = scope.spawn(run);
            let mut problem = |error: &RigError| shell.note(&format!("warning: {error}"));
            let is_over = || running.is_finished();
            let sensed = node.publish_pictures(&broker, &mut *camera, gain, &is_over, &mut problem);
            // Without its sensor the node goes on, and gives up after hours.
            running.join().expect("no panic").and(sensed).map_err(Into::into)
        })
    }
}

/// A file that names a camera.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraFile {
    camera: CameraDriver,
}

pub(super) fn parse_broker(text: &str) -> Result<Broker> {
    let (host, port) = match text.rsplit_once(':') {
        Some((host, port)) => {
            (host, port.parse().with_context(|| format!("--broker {text}: wanted HOST:PORT"))?)
        }
        None => (text, 1883),
    };
    let broker = Broker::new(host, port);
    broker.check().map_err(|error| anyhow!("--broker {text}: {error}"))?;
    Ok(broker)
}
