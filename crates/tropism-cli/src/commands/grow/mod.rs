//! `tropism grow`: populations of virtual beans.

mod check;
mod kinematics;

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::Work;
use tropism_lab::files::shell_word;
use tropism_lab::grow::{GrowPlan, GrowResults};
use tropism_lab::units::plural;

use crate::controller::{ControllerName, task_for};
use crate::options::{SeedOption, TaskOption, TentOptions, parse_minutes};
use crate::progress::{check_outputs, for_user};
use crate::shell::Shell;
use crate::units::UnitsOption;

/// Grow virtual beans for statistics, with or without photographs
///
/// The tip is the highest point as the paper's detector would place it: projected, leaves included, on its grid and
/// with its noise. The true position of the shoot apex stands in further columns. No photograph is analysed, not even
/// those of --photographs: these are for `tropism track` and for other vision software, with the ground truth beside them.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  tropism grow --plants 60 --steps 1000 --controller periodic:6h --out beans\n  \
                  tropism grow --photographs --cameras 2 --faults fly=0.01 --out beans\n  \
                  tropism grow --check\n  \
                  tropism grow --kinematics figures"
)]
pub(crate) struct Grow {
    /// Number of virtual beans, each an individual
    #[arg(long, default_value_t = 6, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    plants: u32,

    /// Most steps; 1000 by default for a periodic controller
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    steps: Option<u32>,

    /// Time from one step to the next
    #[arg(long, default_value = "5m", value_name = "TIME", value_parser = parse_minutes)]
    period: f64,

    /// periodic[:6h], greedy, or a file of a network or rule
    #[arg(long, default_value = "periodic:6h", value_name = "CONTROLLER")]
    controller: ControllerName,

    /// Folder for a track, or with --photographs a run folder, of each plant
    #[arg(long, value_name = "DIR", required_unless_present_any = ["check", "kinematics"])]
    out: Option<PathBuf>,

    /// Replace existing tracks; photographs never are
    #[arg(long, requires = "out", conflicts_with = "photographs")]
    force: bool,

    /// Write a photograph of each step, and its ground truth
    #[arg(long)]
    photographs: bool,

    /// Tip the pots to the right by this angle at the first step
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "DEG",
        allow_negative_numbers = true,
        conflicts_with = "photographs"
    )]
    tilt: f64,

    /// Keep all lamps dark
    #[arg(long, conflicts_with = "photographs")]
    dark: bool,

    /// Continue with the photographs in DIR; it needs no other option
    #[arg(long, requires = "out")]
    resume: bool,

    /// Compare beans with published values instead
    #[arg(long, conflicts_with_all = ["plants", "steps", "controller", "out", "photographs", "task", "period", "lamps", "variation", "scene", "cameras", "faults", "tilt", "dark", "resume", "unit", "list", "engine"])]
    check: bool,

    /// Draw experiments of plant physiology with the typical plant instead
    #[arg(long, value_name = "DIR", conflicts_with_all = ["check", "plants", "steps", "controller", "out", "photographs", "task", "period", "lamps", "variation", "scene", "cameras", "faults", "tilt", "dark", "resume", "unit", "list", "engine"])]
    kinematics: Option<PathBuf>,

    #[command(flatten)]
    task: TaskOption,

    #[command(flatten)]
    seed: SeedOption,

    #[command(flatten)]
    units: UnitsOption,

    #[command(
        flatten,
        next_help_heading = "The virtual tent (--scene, --cameras and --faults with --photographs)"
    )]
    tent: TentOptions,
}

impl Grow {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let greenhouse = self.tent.load()?.unwrap_or_default();
        if let Some(out) = self.kinematics {
            return kinematics::execute(greenhouse.bean, out, shell);
        }
        let Some(out) = self.out else {
            return check::execute(greenhouse.bean, self.seed.seed, shell);
        };
        if self.resume && !self.photographs {
            shell.check_resumes_alone(&out, &[])?;
            let plan = GrowPlan::of_folder(&out).map_err(for_user)?;
            return self.units.execute(&plan, shell, |results| text(&plan, results));
        }
        let controller = self.controller.load()?;
        let task = task_for(&controller, &self.task, self.steps, shell)?;
        self.tent.check_for(&task)?;
        let plan = GrowPlan {
            plants: self.plants,
            greenhouse: greenhouse.for_task(&task),
            task,
            controller,
            period_min: self.period,
            seed: self.seed.seed,
            out,
            photographs: self.photographs,
            tilt_deg: self.tilt,
            dark: self.dark,
            replace: self.force,
            resume: self.resume,
        };
        let tracks = (0..plan.plants).map(|plant| plan.track_path(plant));
        let inputs = [&self.task.task, &self.tent.bean.bean, &self.tent.scene].map(Option::as_ref);
        check_outputs(&tracks.collect::<Vec<_>>(), inputs.into_iter().chain([self.controller.file()]))?;
        self.units.execute(&plan, shell, |results| text(&plan, results))
    }
}

fn text(plan: &GrowPlan, results: &GrowResults) -> String {
    let GrowResults { plants, mean_final_height_cm, .. } = results;
    let beans = plural(*plants, "virtual bean");
    let mut text = format!("{beans}, mean height at the end {mean_final_height_cm:.1} cm\n");
    if let Some(mean) = results.mean_fitness {
        text += &format!("mean fitness {}\n", plan.task.fitness_in_words(mean));
    }
    let out = results.out.display();
    let next = if plan.photographs {
        let first = plan.folder(0);
        format!(
            "tropism track {} --calibration {} --out {}",
            shell_word(&first.join("photographs")),
            shell_word(&first.join("calibration.toml")),
            shell_word(&first.with_added_extension("csv"))
        )
    } else {
        format!("tropism fit {}/*.csv --out model.json", shell_word(&plan.out))
    };
    text + &format!("wrote {out}\nnext: {next}")
}
