//! `tropism check`: is a rig ready for a plant?

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
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
    #[arg(long, value_name = "GROUP,...", value_parser = group_parser(), value_delimiter = ',')]
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

/// The groups of a check: word, group and help.
const GROUPS: [(&str, Group, &str); 9] = [
    ("settings", Group::Settings, "The rig file"),
    ("system", Group::System, "The computer and its disk"),
    ("camera", Group::Camera, "The camera"),
    ("flash", Group::Flash, "The flash"),
    ("lamps", Group::Lamps, "The lamps"),
    ("plant", Group::Plant, "The plant in the photographs"),
    ("broker", Group::Broker, "The MQTT broker"),
    ("alerts", Group::Alerts, "How people are told"),
    ("rehearsal", Group::Rehearsal, "A short run with a kill"),
];

/// Parses the word of a group.
fn group_parser() -> impl TypedValueParser<Value = Group> {
    let values = GROUPS.map(|(word, _, help)| PossibleValue::new(word).help(help));
    PossibleValuesParser::new(values).try_map(|word| {
        GROUPS.iter().find(|(known, ..)| *known == word).map(|(_, group, _)| *group).ok_or("unknown group")
    })
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
            only: self.only,
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
