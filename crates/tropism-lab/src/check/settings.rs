//! Settings of a rig file that are missing, unsafe or too slow; its broker and its alerts.

use std::path::Path;
use std::time::Duration;

use tropism::programme::Acting;
use tropism::rig::{Clock, Durability};
use tropism_rig::alert::{AlertEvent, Kind};
use tropism_rig::driver::{AlertDriver, CameraDriver, FlashDriver, LampDriver};
use tropism_rig::file::{LampsTable, RigFile};
use tropism_rig::mqtt::{Dialect, Plug};
use tropism_rig::probe;
use tropism_rig::secret::shows_secret;
use tropism_rig::settings::FlashSettings;
use tropism_rig::strip::Strip;

use super::{Findings, Group};
use crate::files::{self, shell_word};
use crate::units::time;

/// Examines what can be known without the devices.
pub(super) fn examine(rig: &RigFile, findings: &mut Findings) {
    if rig.is_virtual() {
        findings.pass(Group::Settings, "a virtual tent: no device of it can fail");
        return;
    }
    if let Err(fault) = rig.calibrated() {
        let remedy =
            "by clicks: tropism studio, Devices by hand; then check again, also that the plant is seen";
        findings.fail(Group::Settings, fault.to_string(), remedy);
    }
    if rig.durability() == Durability::Fast {
        findings.warn(
            Group::Settings,
            "durability is \"fast\": a power cut may cost steps",
            "durability = \"full\" for real plants",
        );
    }
    let secrets = [
        rig.mqtt.as_ref().and_then(|broker| broker.password_file.as_deref()),
        match &rig.camera {
            Some(CameraDriver::Http(camera)) => camera.authorization_file.as_deref(),
            _ => None,
        },
    ];
    let secrets = secrets.into_iter().flatten().chain(rig.alert.iter().flat_map(AlertDriver::secrets));
    for secret in secrets {
        examine_secret(secret, findings);
    }
    if rig.alert.is_empty() {
        findings.warn(
            Group::Settings,
            "no alert is sent when a run stops",
            "[[alert]] with driver = \"ntfy\", and one with \"heartbeat\", which also notices a dead computer",
        );
    }
    examine_times(rig, findings);
    examine_programme(rig, findings);
    for (name, lamp) in lamps(rig) {
        examine_lamp(&name, lamp, findings);
    }
    match &rig.flash {
        None => findings.warn(
            Group::Settings,
            "no flash: photographs are taken by the light of the lamp that is lit",
            "[flash], or constant light of a colour that plants do not bend to",
        ),
        Some(FlashDriver::Mqtt(flash)) => examine_plug("the flash", &flash.plug, findings),
        Some(_) => {}
    }
}

/// The lamps that have drivers, with their names.
fn lamps(rig: &RigFile) -> impl Iterator<Item = (String, &LampDriver)> {
    let named = rig.lamps.iter().flat_map(LampsTable::drivers);
    named.map(|(name, driver)| (format!("{name} lamp"), driver))
}

/// Looks for secrets in the addresses of the rig file at `path`: they would be kept in run folders, too.
pub(super) fn examine_addresses(path: &Path, findings: &mut Findings) {
    let Ok(table) = files::read_toml::<toml::Table>(path) else { return };
    let mut keys = Vec::new();
    add_secret_keys("", &toml::Value::Table(table), &mut keys);
    for key in keys {
        let remedy = if key.starts_with("alert") {
            "url_file: a file with the address in its first line, readable for you alone"
        } else if key.starts_with("camera") {
            "authorization_file: a file with \"Basic …\" or \"Bearer …\" in its first line, readable for you alone"
        } else {
            "an address without it; else keep the rig file and the run folders to yourself: chmod 600"
        };
        findings.warn(
            Group::Settings,
            format!("{key}: the address holds a user, a password or a token"),
            remedy,
        );
    }
}

/// Adds the keys of `value` whose text is an address with a secret, such as `camera.url` and `alert.2.url`.
fn add_secret_keys(key: &str, value: &toml::Value, found: &mut Vec<String>) {
    let inner = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match value {
        toml::Value::String(text) if shows_secret(text) => found.push(key.to_owned()),
        toml::Value::Table(table) => {
            table.iter().for_each(|(name, value)| add_secret_keys(&inner(name), value, found));
        }
        toml::Value::Array(values) => (1..)
            .zip(values)
            .for_each(|(number, value)| add_secret_keys(&inner(&number.to_string()), value, found)),
        _ => {}
    }
}

fn examine_secret(path: &Path, findings: &mut Findings) {
    let name = path.display();
    match std::fs::read_to_string(path) {
        Err(error) => findings.fail(
            Group::Settings,
            format!("{name}: cannot be read: {error}"),
            "make it, readable for the user that runs tropism",
        ),
        Ok(text) if text.lines().next().unwrap_or_default().trim().is_empty() => {
            findings.fail(
                Group::Settings,
                format!("{name}: its first line is empty"),
                "write the secret there",
            );
        }
        Ok(_) if is_open_to_all(path) => findings.warn(
            Group::Settings,
            format!("{name}: everybody on this computer can read it"),
            format!("chmod 600 {}", shell_word(path)),
        ),
        Ok(_) => findings.pass(Group::Settings, format!("{name}: a secret that others cannot read")),
    }
}

#[cfg(unix)]
fn is_open_to_all(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    std::fs::metadata(path).is_ok_and(|about| about.permissions().mode() & 0o004 != 0)
}

#[cfg(not(unix))]
fn is_open_to_all(_path: &Path) -> bool {
    false
}

/// Examines whether a step fits into its period if everything takes as long as it may, and whether the flash outlasts a
/// photograph.
fn examine_times(rig: &RigFile, findings: &mut Findings) {
    let (try_s, tries) = rig.camera.as_ref().map_or((0.0, 1), CameraDriver::longest_s);
    let flash = rig.flash.as_ref().map(FlashDriver::settings);
    let [settle_s, max_on_s] = flash.map_or([0.0, f64::INFINITY], |flash| flash.times().map(f64::from));
    let order_s = flash.map_or(0.0, FlashSettings::timeout_s);
    let lamps_s = rig.lamps.as_ref().map_or(0.0, LampsTable::longest_s);
    let worst_s = f64::from(tries) * try_s + 2.0 * order_s + settle_s + lamps_s;
    let period_s = 60.0 * rig.period_min;
    let found = format!("a step takes {} at worst, of a period of {}", time(worst_s), time(period_s));
    if worst_s <= period_s / 2.0 {
        findings.pass(Group::Settings, found);
    } else {
        findings.warn(
            Group::Settings,
            found,
            "shorter timeout_s or fewer retries: at most half of the period",
        );
    }
    if max_on_s < settle_s + try_s {
        findings.warn(
            Group::Settings,
            format!(
                "the flash goes off after {max_on_s} s, and a photograph may take {} s: it may be dark",
                settle_s + try_s
            ),
            format!("flash.max_on_s of {} or more, or a shorter camera.timeout_s", settle_s + try_s),
        );
    }
}

/// Says what the programme wants now: whether its clock and time zone are right is for the user to see.
fn examine_programme(rig: &RigFile, findings: &mut Findings) {
    let (Ok(Some(programme)), Ok(clock), Ok(layout)) =
        (rig.programme(), rig.clock(Duration::ZERO), rig.layout())
    else {
        return;
    };
    let now = clock.time_of_day();
    let Acting { part, is_steered, base } = programme.at(now);
    let part = if part == 0 { "night".to_owned() } else { format!("part {part}") };
    let steered = if is_steered { "steered" } else { "not steered" };
    findings.pass(
        Group::Settings,
        format!(
            "programme: {now} here ({}), {part}: {steered}, base light {}",
            clock.zone(),
            base.word(&layout)
        ),
    );
}

fn examine_lamp(name: &str, lamp: &LampDriver, findings: &mut Findings) {
    let mut amps = |strip: &Strip| {
        let (amps, most) = (strip.amps(), strip.max_amps);
        findings.pass(Group::Settings, format!("{name}: {amps:.2} A at most, of {most} A"));
    };
    match lamp {
        LampDriver::Wled(lamp) => {
            amps(&lamp.strip);
            if lamp.dead_man_min == 0 {
                findings.warn(
                    Group::Settings,
                    format!("{name}: nothing darkens it if this computer dies"),
                    "dead_man_min of more than two steps",
                );
            }
        }
        LampDriver::Leds(lamp) => amps(&lamp.strip),
        LampDriver::Ws2812(lamp) => amps(&lamp.strip),
        LampDriver::Mqtt(lamp) => examine_plug(name, &lamp.plug, findings),
        LampDriver::Command(_) | LampDriver::Gpio(_) => {}
    }
}

fn examine_plug(name: &str, plug: &Plug, findings: &mut Findings) {
    match plug.dialect {
        Dialect::Tasmota => findings.warn(
            Group::Settings,
            format!("{name}: whether the plug goes off by itself cannot be seen from here"),
            "once in its console: Backlog PowerOnState 0; SetOption0 0; PulseTime1 115; PowerRetain 0",
        ),
        Dialect::Zigbee2mqtt if plug.on_time_s.is_none() => findings.warn(
            Group::Settings,
            format!("{name}: nothing puts its plug off if this computer dies"),
            "plug.on_time_s, and try that its firmware obeys",
        ),
        Dialect::Zigbee2mqtt | Dialect::Plain => {}
    }
}

/// Connects to the broker, and looks for retained orders: a device that restarts would carry them out again.
pub(super) fn examine_broker(rig: &RigFile, findings: &mut Findings) {
    let Some(broker) = &rig.mqtt else { return };
    let plugs = lamps(rig).filter_map(|(_, lamp)| match lamp {
        LampDriver::Mqtt(lamp) => Some(&lamp.plug),
        _ => None,
    });
    let flash = rig.flash.iter().filter_map(|flash| match flash {
        FlashDriver::Mqtt(flash) => Some(&flash.plug),
        _ => None,
    });
    let plugs: Vec<&Plug> = plugs.chain(flash).collect();
    match probe::broker(broker, &plugs) {
        Err(error) => findings.fail(
            Group::Broker,
            error.to_string(),
            format!("mosquitto_sub -h {} -p {} -t '#' shows whether it is there", broker.host, broker.port),
        ),
        Ok(found) => {
            let ms = 1e3 * found.round_trip.as_secs_f64();
            findings.pass(
                Group::Broker,
                format!("{}:{} passes a message on in {ms:.0} ms", broker.host, broker.port),
            );
            for topic in found.retained_commands {
                findings.fail(
                    Group::Broker,
                    format!("it keeps an order in {topic}: a device that restarts carries it out again"),
                    format!("mosquitto_pub -h {} -t {topic} -r -n, and find who retains it", broker.host),
                );
            }
            for topic in found.offline {
                findings.fail(Group::Broker, format!("{topic} says offline"), "plug the device in");
            }
        }
    }
}

/// Sends a test message by each channel.
pub(super) fn examine_alerts(rig: &RigFile, findings: &mut Findings) {
    if rig.alert.is_empty() {
        return;
    }
    let remedy = "its address, its secret, the network; curl from this computer shows more";
    let alerts = match rig.open_alerts("tropism check", None) {
        Ok(alerts) => alerts,
        Err(error) => return findings.fail(Group::Alerts, error.to_string(), remedy),
    };
    alerts.send(&AlertEvent::now(Kind::Test, None, "a test by tropism check: this channel works"));
    let failed = alerts.close();
    for (name, problem) in &failed {
        findings.fail(Group::Alerts, format!("{name}: {problem}"), remedy);
    }
    if failed.is_empty() {
        let found = format!("{} channels took a test message; see that it arrived", rig.alert.len());
        findings.pass(Group::Alerts, found);
    }
}
