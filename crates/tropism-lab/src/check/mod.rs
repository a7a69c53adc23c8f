//! The workflow `check`: tries a rig before a plant depends on it.
//!
//! In comes a rig file. Its settings and the computer are examined, the camera, the flash and the lamps are tried one after
//! the other and judged by photographs, and a short run may be rehearsed with a kill in the middle. Out come findings, each
//! with a verdict and what to do.

mod shot;
mod judgement;
mod devices;
mod rehearsal;
mod report;
mod settings;
mod system;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism_rig::file::RigFile;
use tropism_rig::secret::shown;

use crate::error::Error;
use crate::monitor::Monitor;
use crate::run::{read_rig, rig_faults};
use crate::workflow::Workflow;
use devices::Devices;
pub use report::ProblemReport;

/// The rig to check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CheckPlan {
    /// Rig file.
    pub rig: PathBuf,
    /// Whether nothing is switched, photographed or sent.
    #[serde(default)]
    pub dry: bool,
    /// Groups that are checked; all if empty.
    #[serde(default)]
    pub only: Vec<Group>,
    /// A short run with a kill.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rehearsal: Option<Rehearsal>,
    /// Folder in which runs will be kept: its disk is tried.
    #[serde(default = "here")]
    pub data: PathBuf,
    /// New folder in which the photographs are kept.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub photographs: Option<PathBuf>,
    /// A report for a maintainer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub report: Option<ProblemReport>,
}

fn here() -> PathBuf {
    ".".into()
}

/// A short run that is killed in the middle and resumed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rehearsal {
    /// Steps, 3 to 100.
    pub steps: u32,
    /// The command `tropism`, which is started as a program of its own, to be killed.
    pub program: PathBuf,
}

/// What a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Group {
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
    /// The channels that alert people.
    Alerts,
    /// A short run with a kill.
    Rehearsal,
}

impl Group {
    /// Its name, as in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Settings => "settings",
            Self::System => "system",
            Self::Camera => "camera",
            Self::Flash => "flash",
            Self::Lamps => "lamps",
            Self::Plant => "plant",
            Self::Broker => "broker",
            Self::Alerts => "alerts",
            Self::Rehearsal => "rehearsal",
        }
    }
}

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// As it should be.
    Pass,
    /// A run works, but with less safety or quality.
    Warn,
    /// A run would not work.
    Fail,
}

impl Verdict {
    /// Its name, as in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Warn => "warn",
            Self::Fail => "fail",
        }
    }
}

/// One finding.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// What it is about.
    pub group: Group,
    /// How bad it is.
    pub verdict: Verdict,
    /// What was found.
    pub found: String,
    /// What to do about it; `None` for a pass.
    pub remedy: Option<String>,
}

/// The findings so far.
#[derive(Debug, Default)]
struct Findings(Vec<Finding>);

impl Findings {
    fn pass(&mut self, group: Group, found: impl Into<String>) {
        self.add(group, Verdict::Pass, found.into(), None);
    }

    fn warn(&mut self, group: Group, found: impl Into<String>, remedy: impl Into<String>) {
        self.add(group, Verdict::Warn, found.into(), Some(remedy.into()));
    }

    fn fail(&mut self, group: Group, found: impl Into<String>, remedy: impl Into<String>) {
        self.add(group, Verdict::Fail, found.into(), Some(remedy.into()));
    }

    /// What devices say is shown without the secrets of addresses and the controls of terminals.
    fn add(&mut self, group: Group, verdict: Verdict, found: String, remedy: Option<String>) {
        let remedy = remedy.map(|remedy| shown(&remedy));
        self.0.push(Finding { group, verdict, found: shown(&found), remedy });
    }

    fn count(&self, verdict: Verdict) -> usize {
        self.0.iter().filter(|finding| finding.verdict == verdict).count()
    }
}

/// What a check found.
#[derive(Clone, Debug, Serialize)]
pub struct CheckResults {
    /// Rig file.
    pub rig: PathBuf,
    /// Whether the tent is virtual.
    pub is_virtual: bool,
    /// Version of tropism.
    pub version: &'static str,
    /// Whether nothing was switched, photographed or sent.
    pub is_dry: bool,
    /// How many findings pass.
    pub pass: usize,
    /// How many warn.
    pub warn: usize,
    /// How many fail.
    pub fail: usize,
    /// All findings, in the order in which they were made.
    pub findings: Vec<Finding>,
}

impl Workflow for CheckPlan {
    type Results = CheckResults;
    const SCHEMA: &'static str = "tropism.check/1";

    fn check(&self) -> Result<(), Error> {
        self.report.as_ref().map_or(Ok(()), ProblemReport::check)?;
        let Some(Rehearsal { steps, .. }) = self.rehearsal else { return Ok(()) };
        if self.dry {
            return Err(Error::Plan("`dry` and `rehearsal` stand both here: keep one".to_owned()));
        }
        if !(3..=100).contains(&steps) {
            return Err(Error::Plan(format!("`rehearsal` {steps}: wanted 3 to 100 steps")));
        }
        Ok(())
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<CheckResults, Error> {
        let mut findings = Findings::default();
        let mut is_virtual = false;
        match read_rig(&self.rig) {
            // A rig that cannot be read is a finding like any other, and so is each fault of it.
            Err(error) => {
                let mut faults = rig_faults(&self.rig);
                if faults.is_empty() {
                    faults.push(error.with_causes());
                }
                faults
                    .into_iter()
                    .for_each(|fault| findings.fail(Group::Settings, fault, "correct the rig file"));
            }
            Ok(rig) => {
                is_virtual = rig.is_virtual();
                self.examine(&rig, &mut findings, monitor)?;
            }
        }
        let [pass, warn, fail] =
            [Verdict::Pass, Verdict::Warn, Verdict::Fail].map(|verdict| findings.count(verdict));
        let results = CheckResults {
            rig: self.rig.clone(),
            is_virtual,
            version: env!("CARGO_PKG_VERSION"),
            is_dry: self.dry,
            pass,
            warn,
            fail,
            findings: findings.0,
        };
        if let Some(report) = &self.report {
            report.write(&results)?;
        }
        Ok(results)
    }
}

impl CheckPlan {
    fn wants(&self, group: Group) -> bool {
        self.only.is_empty() || self.only.contains(&group)
    }

    fn examine(&self, rig: &RigFile, findings: &mut Findings, monitor: &dyn Monitor) -> Result<(), Error> {
        if self.wants(Group::Settings) {
            findings.pass(Group::Settings, format!("{} can be read", self.rig.display()));
            settings::examine(rig, findings);
            settings::examine_addresses(&self.rig, findings);
        }
        let photograph_bytes = self.examine_devices(rig, findings, monitor)?;
        if !self.dry && self.wants(Group::Broker) {
            settings::examine_broker(rig, findings);
        }
        if !self.dry && self.wants(Group::Alerts) {
            settings::examine_alerts(rig, findings);
        }
        if self.wants(Group::System) {
            system::examine(rig, &self.data, photograph_bytes, findings);
        }
        let Some(rehearsal) = &self.rehearsal else { return Ok(()) };
        if findings.count(Verdict::Fail) > 0 {
            let found = "not held: something failed before";
            findings.warn(Group::Rehearsal, found, "correct that, then check again");
            return Ok(());
        }
        monitor.note("a run, a kill, and the rest of the run ...");
        rehearsal::hold(rig, &self.data, rehearsal, findings, monitor)
    }

    /// Tries camera, flash and lamps, and looks for the plant. Returns the mean size of a photograph, if any was taken.
    fn examine_devices(
        &self,
        rig: &RigFile,
        findings: &mut Findings,
        monitor: &dyn Monitor,
    ) -> Result<Option<u64>, Error> {
        let groups = [Group::Camera, Group::Flash, Group::Lamps, Group::Plant];
        if self.dry || !groups.into_iter().any(|group| self.wants(group)) {
            return Ok(None);
        }
        monitor.note("photographs with and without flash and lamps ...");
        if let Some(folder) = &self.photographs {
            std::fs::create_dir(folder).map_err(Error::at(folder.display()))?;
        }
        let mut photograph_bytes = None;
        let mut found = Findings::default();
        if let Some(mut devices) = Devices::open(rig, self.photographs.clone(), monitor, &mut found) {
            devices.examine(&mut found)?;
            photograph_bytes = devices.photograph_bytes();
        }
        if let Some(folder) = &self.photographs {
            // Only an empty one goes: there was nothing to keep.
            let _ = std::fs::remove_dir(folder);
        }
        // Groups that were not asked for were needed to judge the others: of them only failures count.
        let is_told = |finding: &Finding| self.wants(finding.group) || finding.verdict == Verdict::Fail;
        findings.0.extend(found.0.into_iter().filter(is_told));
        Ok(photograph_bytes)
    }
}
