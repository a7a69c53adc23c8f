//! The computer: its disk, its clock, its power, its watchdog and its GPIO lines.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use tropism_rig::driver::{FlashDriver, LampDriver};
use tropism_rig::file::{LampsTable, RigFile};
use tropism_rig::host::Host;

use super::{Findings, Group};
use crate::files;
use crate::units;

/// Steps of the paper's longest experiments: 83.3 hours (section 2.2.1).
const STEPS: u64 = 1000;

/// Factor on the size of all photographs; chosen by hand.
const MARGIN: f64 = 1.3;

/// Bytes for the journal and its mirror: more than the 31 MB that 83.3 hours write at 9 MB a day
/// (measured, docs/validation/cost-of-a-step.md).
const JOURNAL_BYTES: u64 = 64 << 20;

/// Bytes of a photograph for each pixel, if none was taken; chosen by hand for a JPEG of good quality.
const BYTES_PER_PIXEL: f64 = 0.25;

/// Examines the computer. `photograph_bytes` is the mean size of a photograph, if any was taken.
pub(super) fn examine(rig: &RigFile, data: &Path, photograph_bytes: Option<u64>, findings: &mut Findings) {
    if let Some(model) = line("/proc/device-tree/model") {
        findings.pass(Group::System, model.trim_end_matches('\0').to_owned());
    }
    let estimate = rig
        .calibration()
        .map_or(0.0, |calibration| BYTES_PER_PIXEL * (calibration.width * calibration.height) as f64);
    examine_disk(data, photograph_bytes.unwrap_or(estimate as u64), findings);
    if rig.is_virtual() {
        return;
    }
    examine_clock(findings);
    examine_power(findings);
    examine_watchdog(findings);
    let drives_gpio = matches!(&rig.flash, Some(FlashDriver::Gpio(_)))
        || rig
            .lamps
            .iter()
            .flat_map(LampsTable::drivers)
            .any(|(_, driver)| matches!(driver, LampDriver::Gpio(_)));
    if drives_gpio {
        examine_gpio(findings);
    }
}

/// The first line of a file.
fn line(path: &str) -> Option<String> {
    Some(fs::read_to_string(path).ok()?.lines().next()?.trim().to_owned())
}

fn examine_disk(data: &Path, photograph_bytes: u64, findings: &mut Findings) {
    let name = data.display();
    let need = (MARGIN * (STEPS * photograph_bytes) as f64) as u64 + JOURNAL_BYTES;
    match files::free_bytes(data) {
        Err(error) => {
            findings.fail(
                Group::System,
                format!("{name}: {error}"),
                "--data DIR names where runs will be kept",
            );
            return;
        }
        Ok(free) => {
            let found = format!(
                "{name}: {} left, {} wanted for {STEPS} steps",
                units::bytes(free),
                units::bytes(need)
            );
            if free >= need {
                findings.pass(Group::System, found);
            } else {
                findings.fail(Group::System, found, "make room, or keep runs on another disk (--data DIR)");
            }
        }
    }
    if let Some((kind, problem)) = file_system(data) {
        match problem {
            None => findings.pass(Group::System, format!("{name}: {kind}")),
            Some(problem) => findings.warn(
                Group::System,
                format!("{name}: {kind}: {problem}"),
                "a disk of this computer with ext4, best an SSD",
            ),
        }
    }
    match slowest_sync(data) {
        Err(error) => findings.fail(
            Group::System,
            format!("{name}: cannot write: {error}"),
            "a folder that the user who runs tropism may write to",
        ),
        Ok(slowest) if slowest > 0.5 => findings.warn(
            Group::System,
            format!("{name}: what is written is safe after {slowest:.1} s at worst"),
            "another card or an SSD: this one is slow, or about to die",
        ),
        Ok(slowest) => findings.pass(
            Group::System,
            format!("{name}: what is written is safe after {:.0} ms at worst", 1e3 * slowest),
        ),
    }
}

/// The file system of a folder, and what is wrong with it for a run.
#[cfg(target_os = "linux")]
fn file_system(folder: &Path) -> Option<(&'static str, Option<&'static str>)> {
    // Magic numbers of file systems: linux/magic.h.
    const FORGETS: Option<&str> = Some("it is memory, and empty after a restart");
    const NETWORK: Option<&str> = Some("locks and syncs over a network are promises of others");
    const FRAGILE: Option<&str> = Some("a power cut may cost all of it");
    let kind = rustix::fs::statfs(folder).ok()?.f_type;
    Some(match kind {
        0xef53 => ("ext4", None),
        0x5846_5342 => ("xfs", None),
        0x9123_683e => ("btrfs", None),
        0xf2f5_2010 => ("f2fs", None),
        0x794c_7630 => ("overlay", Some("what is in it may be gone after a restart")),
        0x0102_1994 | 0x8584_58f6 => ("tmpfs", FORGETS),
        0x6969 => ("nfs", NETWORK),
        0xfe53_4d42 | 0xff53_4d42 => ("smb", NETWORK),
        0x4d44 => ("vfat", FRAGILE),
        0x2011_bab0 => ("exfat", FRAGILE),
        _ => return None,
    })
}

#[cfg(not(target_os = "linux"))]
fn file_system(_folder: &Path) -> Option<(&'static str, Option<&'static str>)> {
    None
}

/// Seconds that the slowest of 20 synced writes takes.
fn slowest_sync(folder: &Path) -> std::io::Result<f64> {
    let path = folder.join(format!(".tropism-check-{}", std::process::id()));
    let tried = (|| {
        let mut file = fs::File::create_new(&path)?;
        let mut slowest: f64 = 0.0;
        for _ in 0..20 {
            let began = Instant::now();
            file.write_all(&[0; 4096])?;
            file.sync_data()?;
            slowest = slowest.max(began.elapsed().as_secs_f64());
        }
        Ok(slowest)
    })();
    let _ = fs::remove_file(&path);
    tried
}

fn examine_clock(findings: &mut Findings) {
    let asked = Command::new("timedatectl").args(["show", "-p", "NTPSynchronized", "--value"]).output();
    let answer = asked.ok().filter(|answer| answer.status.success());
    match answer.as_ref().map(|answer| answer.stdout.trim_ascii()) {
        Some(b"yes") => findings.pass(Group::System, "the clock is set by the network"),
        Some(b"no") if Path::new("/dev/rtc0").exists() => {
            findings.pass(Group::System, "the clock is not set by the network; there is one with a battery");
        }
        Some(b"no") => findings.warn(
            Group::System,
            "the clock is not set by the network, and there is none with a battery: after a power cut it is wrong",
            "timedatectl set-ntp true, or a clock module (a Pi 5 has one, without its battery)",
        ),
        _ => findings.warn(
            Group::System,
            "the system does not say whether the clock is right",
            "a clock that jumps moves the steps: systemd-timesyncd or chrony",
        ),
    }
}

fn examine_power(findings: &mut Findings) {
    let host = Host::here();
    if let Some(temperature_c) = host.temperature_c() {
        let found = format!("the computer has {temperature_c:.0} °C");
        match temperature_c {
            80.0.. => findings.fail(Group::System, found, "cool it; a Raspberry Pi slows down at 80 °C"),
            70.0.. => findings.warn(Group::System, found, "cool it: the lamps will heat the tent as well"),
            _ => findings.pass(Group::System, found),
        }
    }
    if let Some(supply) = host.supply() {
        let remedy = "the supply that came with it, a short thick cable; lamps on a supply of their own";
        match (supply.is_weak, supply.was_weak) {
            (true, _) => findings.fail(Group::System, "its supply is too weak now", remedy),
            (_, true) => findings.warn(Group::System, "its supply was too weak since it started", remedy),
            _ => findings.pass(Group::System, "its supply never was too weak since it started"),
        }
    }
}

fn examine_watchdog(findings: &mut Findings) {
    match line("/sys/class/watchdog/watchdog0/state").as_deref() {
        Some("active") => findings.pass(Group::System, "a watchdog restarts it when it hangs"),
        _ if Path::new("/dev/watchdog0").exists() => findings.warn(
            Group::System,
            "found a watchdog that is not in use: a system that hangs stays hung",
            "RuntimeWatchdogSec=15s in /etc/systemd/system.conf",
        ),
        _ => findings.warn(
            Group::System,
            "no watchdog: a system that hangs stays so",
            "on a Raspberry Pi dtparam=watchdog=on in config.txt; elsewhere, an alert by heartbeat",
        ),
    }
}

/// Examines whether GPIO lines fall back when the program that drives them dies.
fn examine_gpio(findings: &mut Findings) {
    let kept = ["pinctrl_bcm2835", "pinctrl_rp1"]
        .into_iter()
        .find_map(|driver| line(&format!("/sys/module/{driver}/parameters/persist_gpio_outputs")));
    let remedy = "dtparam=strict_gpiod in config.txt, and a resistor that pulls towards off";
    match kept.as_deref() {
        Some("N") => findings.pass(Group::System, "GPIO lines are let go when their program dies"),
        Some(_) => findings.warn(Group::System, "GPIO lines stay driven when their program dies", remedy),
        None => findings.warn(
            Group::System,
            "the system does not say whether GPIO lines stay driven when their program dies",
            remedy,
        ),
    }
}
