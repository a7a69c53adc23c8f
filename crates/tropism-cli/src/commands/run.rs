//! `tropism run`: the loop of photograph, decision and lamp, into a run folder.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use clap::error::ErrorKind;
use tropism::task::Task;
use tropism::vision::VisionConfig;
use tropism_bean::tent::Greenhouse;
use tropism_lab::files::{self, shell_word};
use tropism_lab::run::alerts_of;
use tropism_lab::units::plural;
use tropism_lab::{RunConfig, RunPlan, RunResults};
use tropism_rig::file::RigFile;

use crate::announce::RunMonitor;
use crate::controller::{ControllerName, task_for};
use crate::options::{TaskOption, TentOptions};
use crate::progress::execute_with;
use crate::shell::Shell;

/// Run an experiment: a photograph every five minutes, a decision, a lamp
///
/// In the virtual tent (`--rig greenhouse`) five minutes pass in milliseconds, and the plant is virtual. The same command
/// continues a run after Ctrl-C, a kill or a power cut, with the same result as without an interruption. A run that paused
/// for a decision of its user (exit code 3) continues with --resume. The run folder holds all settings: --out alone
/// continues the run.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism run --rig greenhouse --controller periodic:6h --out tent/1 --seed 1\n  \
    tropism run --rig greenhouse --controller evolution/champion.json --out steered\n  \
    tropism run --rig greenhouse --bean beans/sunflower.toml --controller periodic:6h --out sunflower\n  \
    tropism run --rig rigs/command.toml --controller evolution/champion.json --out bean --resume\n  \
    tropism run --out steered")]
pub(crate) struct Run {
    /// `greenhouse`, the virtual tent, or a rig file; that of the run in DIR by default
    #[arg(long, value_name = "greenhouse|RIG.toml")]
    rig: Option<PathBuf>,

    /// periodic[:6h], greedy, or the file of an evolved network or a tuned rule; that of the run in DIR by default
    #[arg(long, value_name = "CONTROLLER")]
    controller: Option<ControllerName>,

    /// New run folder, or the folder of a run to continue
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    #[command(flatten)]
    task: TaskOption,

    /// Largest number of steps; 1000 (83.3 hours) by default for a periodic controller
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    steps: Option<u32>,

    /// Speed of the virtual tent: as fast as possible, or N times as fast as real plants. The result is the same
    #[arg(long, value_name = "max|N", default_value = "max", value_parser = parse_speed)]
    speed: Speed,

    /// Continue the run in DIR even if it paused or was down for long
    #[arg(long)]
    resume: bool,

    /// Seed of all random numbers: the same seed gives the same result; that of the run in DIR by default, or 1
    // TOML, in which it is kept, has no larger numbers.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    seed: Option<u64>,

    /// Serve a page of this run beside it, in a process of its own, until the run ends
    #[cfg(feature = "studio")]
    #[arg(long, value_name = "ADDRESS:PORT", num_args = 0..=1, default_missing_value = crate::page::LISTEN, value_parser = crate::page::parse_address)]
    studio: Option<std::net::SocketAddr>,

    #[command(flatten, next_help_heading = "The virtual tent (--rig greenhouse)")]
    tent: TentOptions,
}

/// How many times as fast as real plants virtual ones grow; as fast as the machine can if it says nothing.
#[derive(Clone, Copy)]
struct Speed(Option<f64>);

fn parse_speed(text: &str) -> Result<Speed, String> {
    match text.parse() {
        _ if text == "max" => Ok(Speed(None)),
        Ok(times) if (0.001..=1e9).contains(&times) => Ok(Speed(Some(times))),
        _ => Err("wanted max, or a number from 0.001 to 1000000000, such as 60".to_owned()),
    }
}

impl Run {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let config = self.config(shell)?;
        // This program again, as it was when the run began.
        let watchdog = std::env::current_exe().ok();
        #[cfg(feature = "studio")]
        let _page = self.studio.map(|address| crate::page::Beside::start(&self.out, address)).transpose()?;
        let rig_file = self.rig.or_else(|| alerts_of(&self.out));
        let (out, resume, speed) = (self.out, self.resume, self.speed.0);
        let plan = RunPlan { out, resume, speed, watchdog, rig_file, config };
        if plan.config.is_virtual() {
            shell.note("a virtual plant in a virtual tent");
        }
        if !plan.config.is_virtual() {
            Shell::end_in_order();
        }
        let monitor = RunMonitor::new(shell, !plan.config.is_virtual());
        let results = execute_with(&plan, &monitor)?;
        shell.result(&text(&plan, &results), &results)
    }

    /// What decides the outcome: as the options say, and where they say nothing, as the run in the folder does.
    fn config(&self, shell: &Shell) -> Result<RunConfig> {
        let tent = self.tent.load()?;
        let is_there = ["run.toml", "journal.sqlite"].iter().any(|name| self.out.join(name).exists());
        let found = is_there.then(|| RunConfig::read(&self.out)).transpose()?;
        let controller = match (&self.controller, &found) {
            (None, None) if self.rig.is_none() => missing("--rig", &self.out),
            (None, None) => missing("--controller", &self.out),
            (None, Some(found)) => found.controller.clone(),
            (Some(name), _) => name.load()?,
        };
        let task = match &found {
            Some(found) if self.task.task.is_none() => {
                Task { max_steps: self.steps.unwrap_or(found.task.max_steps), ..found.task.clone() }
            }
            _ => task_for(&controller, &self.task, self.steps, shell)?,
        };
        let rig = match (&self.rig, &found) {
            (None, None) => missing("--rig", &self.out),
            (None, Some(found)) => {
                ensure!(tent.is_none(), "options of the virtual tent go with --rig greenhouse");
                with_alerts(found.rig.clone(), &self.out, shell)
            }
            (Some(path), _) => {
                self.tent.check_for(&task)?;
                load_rig(path, tent, &task, controller.own_period_min())?
            }
        };
        let seed = self.seed.or(found.map(|found| found.seed)).unwrap_or(1);
        Ok(RunConfig::new(rig, controller, task, seed))
    }
}

/// The rig of a run that goes on, with the alerts of its rig file, which its folder does not keep.
fn with_alerts(rig: RigFile, out: &Path, shell: &Shell) -> RigFile {
    let Some(file) = alerts_of(out) else { return rig };
    match files::read_toml::<RigFile>(&file) {
        Ok(RigFile { alert, page, .. }) => RigFile { alert, page, ..rig },
        Err(error) => {
            shell.note(&format!("WITHOUT ALERTS: {error}; --rig RIG.toml names the rig file"));
            rig
        }
    }
}

/// Ends the program as clap does if an option is missing that no run folder stands in for.
fn missing(option: &str, out: &Path) -> ! {
    let text = format!("{}: there is no run to go on with: name {option}\n", out.display());
    clap::Error::raw(ErrorKind::MissingRequiredArgument, text).exit()
}

/// The virtual `tent` with what the task needs, at the interval of the controller, if it has one; or the rig of a file.
fn load_rig(path: &Path, tent: Option<Greenhouse>, task: &Task, period_min: Option<f64>) -> Result<RigFile> {
    if path == Path::new("greenhouse") {
        let rig = RigFile::greenhouse(tent.unwrap_or_default().for_task(task), VisionConfig::default());
        return Ok(RigFile { period_min: period_min.unwrap_or(rig.period_min), ..rig });
    }
    ensure!(
        tent.is_none(),
        "options of the virtual tent beside {}: write them into its [greenhouse]",
        path.display()
    );
    let rig: RigFile = files::read_toml(path)?;
    rig.check().and_then(|()| rig.calibrated()).with_context(|| path.display().to_string())?;
    Ok(rig)
}

fn text(plan: &RunPlan, results: &RunResults) -> String {
    let last = results.track.samples[results.track.samples.len() - 1].tip;
    let kind = if results.is_virtual { "virtual plant" } else { "plant" };
    let missed = match results.missed {
        0 => String::new(),
        missed => format!(" (of which {missed} were missed)"),
    };
    let mut text = format!(
        "{} of a {kind}{missed}, {} without it; tip at {:.1}, {:.1} cm\n",
        plural(results.steps, "step"),
        plural(results.carried_forward, "photograph"),
        last.x,
        last.y
    );
    if let Some(fitness) = results.fitness {
        text += &format!("fitness {}\n", plan.config.task.fitness_in_words(fitness));
    }
    let track = results.track_file.display();
    text += &format!("wrote {track}\nnext: ");
    text += &match results.fitness {
        None => format!("tropism fit {} --out model.json", shell_word(&results.track_file)),
        Some(_) => format!("tropism report {} --out report.html", shell_word(&results.run)),
    };
    text
}
