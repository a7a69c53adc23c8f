//! `tropism check`: is a rig ready for a plant?

mod devices;
mod rehearsal;
mod settings;
mod system;

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use serde::Serialize;
use tropism_lab::files;
use tropism_rig::file::RigFile;

use self::devices::Devices;
use crate::shell::Shell;

/// Try a rig before a plant depends on it: settings, computer, camera, flash, lamps, plant, broker, alerts
///
/// Lights lamps and flash one after the other and judges by photographs; no run should be going on. Every line is pass,
/// warn or FAIL, and says what to do. Exit code 1 if one fails. `--dry` switches nothing and photographs nothing.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism check rigs/wled-ipcam.toml\n  \
    tropism check rig.toml --only camera,flash\n  \
    tropism check rig.toml --rehearse --data /media/ssd\n  \
    tropism check rig.toml --json > commissioning.json")]
pub(crate) struct Check {
    /// Rig file
    #[arg(value_name = "RIG.toml")]
    rig: PathBuf,

    /// Switch nothing, photograph nothing, send nothing
    #[arg(long, conflicts_with = "rehearse")]
    dry: bool,

    /// Check these alone
    #[arg(long, value_name = "GROUP,...", value_enum, value_delimiter = ',')]
    only: Vec<Group>,

    /// Then run this many steps in a scratch folder, kill the run in the middle, and let it go on
    #[arg(long, value_name = "STEPS", num_args = 0..=1, default_missing_value = "4", value_parser = clap::value_parser!(u32).range(3..=100))]
    rehearse: Option<u32>,

    /// Folder in which runs will be kept: its disk is tried
    #[arg(long, value_name = "DIR", default_value = ".")]
    data: PathBuf,

    /// Keep the photographs that were taken in this new folder
    #[arg(long, value_name = "DIR")]
    photographs: Option<PathBuf>,
}

/// What a line is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
enum Group {
    /// The rig file.
    Settings,
    /// The computer and its disk.
    System,
    /// The camera.
    Camera,
    /// The flash.
    Flash,
    /// The lamps.
    Lamps,
    /// The plant in the photographs.
    Plant,
    /// The MQTT broker.
    Broker,
    /// How people are told.
    Alerts,
    /// A short run with a kill.
    Rehearsal,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Verdict {
    Pass,
    Warn,
    Fail,
}

/// One line.
#[derive(Debug, Serialize)]
struct Finding {
    group: Group,
    verdict: Verdict,
    /// What was found.
    found: String,
    /// What to do about it.
    remedy: Option<String>,
}

/// The lines so far.
#[derive(Debug, Default)]
struct Findings(Vec<Finding>);

impl Findings {
    fn pass(&mut self, group: Group, found: impl Into<String>) {
        self.0.push(Finding { group, verdict: Verdict::Pass, found: found.into(), remedy: None });
    }

    fn warn(&mut self, group: Group, found: impl Into<String>, remedy: impl Into<String>) {
        let remedy = Some(remedy.into());
        self.0.push(Finding { group, verdict: Verdict::Warn, found: found.into(), remedy });
    }

    fn fail(&mut self, group: Group, found: impl Into<String>, remedy: impl Into<String>) {
        let remedy = Some(remedy.into());
        self.0.push(Finding { group, verdict: Verdict::Fail, found: found.into(), remedy });
    }

    fn count(&self, verdict: Verdict) -> usize {
        self.0.iter().filter(|finding| finding.verdict == verdict).count()
    }
}

#[derive(Serialize)]
struct Outcome {
    rig: PathBuf,
    is_virtual: bool,
    /// Version of tropism.
    version: &'static str,
    is_dry: bool,
    pass: usize,
    warn: usize,
    fail: usize,
    findings: Vec<Finding>,
}

impl Check {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let mut findings = Findings::default();
        let mut is_virtual = false;
        match self.load() {
            Err(error) => findings.fail(Group::Settings, format!("{error:#}"), "correct the rig file"),
            Ok(rig) => {
                is_virtual = rig.is_virtual();
                self.examine(shell, &rig, &mut findings)?;
            }
        }
        let [pass, warn, fail] =
            [Verdict::Pass, Verdict::Warn, Verdict::Fail].map(|verdict| findings.count(verdict));
        let outcome = Outcome {
            rig: self.rig,
            is_virtual,
            version: env!("CARGO_PKG_VERSION"),
            is_dry: self.dry,
            pass,
            warn,
            fail,
            findings: findings.0,
        };
        shell.result(&outcome.text(), &outcome)?;
        if fail > 0 {
            bail!("{}: found {fail} failures, wanted none", outcome.rig.display());
        }
        Ok(())
    }

    fn load(&self) -> Result<RigFile> {
        let rig: RigFile = files::read_toml(&self.rig)?;
        rig.check().with_context(|| self.rig.display().to_string())?;
        Ok(rig)
    }

    fn wants(&self, group: Group) -> bool {
        self.only.is_empty() || self.only.contains(&group)
    }

    fn examine(&self, shell: &Shell, rig: &RigFile, findings: &mut Findings) -> Result<()> {
        if self.wants(Group::Settings) {
            findings.pass(Group::Settings, format!("{} can be read", self.rig.display()));
            settings::examine(rig, findings);
        }
        let mut photograph_bytes = None;
        let optical = [Group::Camera, Group::Flash, Group::Lamps, Group::Plant];
        if !self.dry && optical.into_iter().any(|group| self.wants(group)) {
            shell.note("photographs with and without flash and lamps ...");
            if let Some(folder) = &self.photographs {
                std::fs::create_dir(folder).with_context(|| folder.display().to_string())?;
            }
            let mut seen = Findings::default();
            if let Some(mut devices) = Devices::open(rig, self.photographs.clone(), &mut seen) {
                devices.examine(&mut seen)?;
                photograph_bytes = devices.photograph_bytes();
            }
            // What was not asked for was needed to judge the rest, and is told only if it failed.
            findings.0.extend(
                seen.0
                    .into_iter()
                    .filter(|finding| self.wants(finding.group) || finding.verdict == Verdict::Fail),
            );
        }
        if !self.dry && self.wants(Group::Broker) {
            settings::examine_broker(rig, findings);
        }
        if !self.dry && self.wants(Group::Alerts) {
            settings::examine_alerts(rig, findings);
        }
        if self.wants(Group::System) {
            system::examine(rig, &self.data, photograph_bytes, findings);
        }
        if let Some(steps) = self.rehearse {
            if findings.count(Verdict::Fail) > 0 {
                findings.warn(
                    Group::Rehearsal,
                    "not held: something failed before",
                    "correct that, then check again",
                );
            } else {
                shell.note("a run, a kill, and the rest of the run ...");
                rehearsal::hold(rig, &self.data, steps, findings)?;
            }
        }
        Ok(())
    }
}

impl Outcome {
    fn text(&self) -> String {
        let mut text = String::new();
        for Finding { group, verdict, found, remedy } in &self.findings {
            let verdict = match verdict {
                Verdict::Pass => "pass",
                Verdict::Warn => "warn",
                Verdict::Fail => "FAIL",
            };
            let group = format!("{group:?}").to_lowercase();
            text += &format!("{verdict}  {group:<9}  {found}\n");
            if let Some(remedy) = remedy {
                text += &format!("                 -> {remedy}\n");
            }
        }
        let kind = if self.is_virtual { ", of a virtual tent" } else { "" };
        text + &format!("{} pass, {} warn, {} fail{kind}", self.pass, self.warn, self.fail)
    }
}
