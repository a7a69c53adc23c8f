//! `tropism check`: is a rig ready for a plant?

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};
use tropism_lab::check::{CheckPlan, CheckResults, Finding, Group, Rehearsal, Verdict};

use crate::progress::execute;
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
    only: Vec<GroupName>,

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

/// The groups of a check, as the command line names them.
#[derive(Clone, Copy, ValueEnum)]
enum GroupName {
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

impl From<GroupName> for Group {
    fn from(name: GroupName) -> Self {
        match name {
            GroupName::Settings => Self::Settings,
            GroupName::System => Self::System,
            GroupName::Camera => Self::Camera,
            GroupName::Flash => Self::Flash,
            GroupName::Lamps => Self::Lamps,
            GroupName::Plant => Self::Plant,
            GroupName::Broker => Self::Broker,
            GroupName::Alerts => Self::Alerts,
            GroupName::Rehearsal => Self::Rehearsal,
        }
    }
}

impl Check {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let rehearsal = match self.rehearse {
            Some(steps) => {
                let program = std::env::current_exe().context("cannot find this program")?;
                Some(Rehearsal { steps, program })
            }
            None => None,
        };
        let plan = CheckPlan {
            rig: self.rig,
            dry: self.dry,
            only: self.only.into_iter().map(Group::from).collect(),
            rehearsal,
            data: self.data,
            photographs: self.photographs,
        };
        let results = execute(&plan, shell)?;
        shell.result(&text(&results), &results)?;
        let rig = results.rig.display();
        ensure!(results.fail == 0, "{rig}: found {} failures, wanted none", results.fail);
        Ok(())
    }
}

fn text(results: &CheckResults) -> String {
    let mut text = String::new();
    for Finding { group, verdict, found, remedy } in &results.findings {
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
    let kind = if results.is_virtual { ", of a virtual tent" } else { "" };
    text + &format!("{} pass, {} warn, {} fail{kind}", results.pass, results.warn, results.fail)
}
