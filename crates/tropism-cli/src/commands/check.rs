//! `tropism check`: is a rig ready for a plant?

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use tropism_lab::check::{CheckPlan, CheckResults, Finding, Group, ProblemReport, Rehearsal, Verdict};
use tropism_lab::units::plural;

use super::light_meter;
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
    tropism check rig.toml --json > commissioning.json\n  \
    tropism check rig.toml --light\n  \
    tropism check rig.toml --dry --report problem.md --run bean")]
pub(crate) struct Check {
    /// Rig file
    #[arg(value_name = "RIG.toml")]
    rig: PathBuf,

    /// Switch nothing, photograph nothing, send nothing
    #[arg(long, conflicts_with = "rehearse")]
    dry: bool,

    /// Light each lamp in turn and ask for the reading of a light meter at the plant; prints `umol` for [lamps]
    #[arg(long, conflicts_with_all = ["dry", "only", "rehearse", "photographs", "report"])]
    light: bool,

    /// Check only these groups
    #[arg(long, value_name = "GROUP,...", value_parser = group_parser(), value_delimiter = ',')]
    only: Vec<Group>,

    /// Then run this many steps in a scratch folder, kill the run in the middle, and resume it
    #[arg(long, value_name = "STEPS", num_args = 0..=1, default_missing_value = "4", value_parser = clap::value_parser!(u32).range(3..=100))]
    rehearse: Option<u32>,

    /// Folder in which runs will be kept: its disk is tested
    #[arg(long, value_name = "DIR", default_value = ".")]
    data: PathBuf,

    /// New folder for the photographs that were taken
    #[arg(long = "out", value_name = "DIR")]
    photographs: Option<PathBuf>,

    /// New file with all that a maintainer needs to know: version, system, findings, rig file without secrets
    #[arg(long, value_name = "FILE.md")]
    report: Option<PathBuf>,

    /// Folder of a run whose last events the report lists
    #[arg(long, value_name = "DIR", requires = "report")]
    run: Option<PathBuf>,
}

/// The groups of a check, and their help.
const GROUPS: [(Group, &str); 9] = [
    (Group::Settings, "The rig file"),
    (Group::System, "The computer and its disk"),
    (Group::Camera, "The camera"),
    (Group::Flash, "The flash"),
    (Group::Lamps, "The lamps"),
    (Group::Plant, "The plant in the photographs"),
    (Group::Broker, "The MQTT broker"),
    (Group::Alerts, "The channels that alert people"),
    (Group::Rehearsal, "A short run that is killed and resumed"),
];

/// Parses the name of a group.
fn group_parser() -> impl TypedValueParser<Value = Group> {
    let values = GROUPS.map(|(group, help)| PossibleValue::new(group.name()).help(help));
    PossibleValuesParser::new(values).try_map(|word| {
        GROUPS.iter().find(|(group, _)| group.name() == word).map(|(group, _)| *group).ok_or("unknown group")
    })
}

impl Check {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        if self.light {
            return light_meter::measure(&self.rig, shell);
        }
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
            report: self.report.map(|path| ProblemReport { path, version: crate::version(), run: self.run }),
        };
        let results = execute(&plan, shell)?;
        shell.result(&text(&results), &results)?;
        let rig = results.rig.display();
        ensure!(results.fail == 0, "{rig}: the check found {}", plural(results.fail, "failure"));
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
        text += &format!("{verdict}  {:<9}  {found}\n", group.name());
        if let Some(remedy) = remedy {
            text += &format!("                 -> {remedy}\n");
        }
    }
    let kind = if results.is_virtual { ", of a virtual tent" } else { "" };
    text + &format!("{} pass, {} warn, {} fail{kind}", results.pass, results.warn, results.fail)
}
