//! `tropism calibrate`: parameters of virtual beans from tracks of plants.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_bean::calibrate::PARAMETERS;
use tropism_lab::calibrate::{
    CalibratePlan, ParameterRecovery, PlantEstimates, PooledEstimate, RecoveryPlan, pool,
};

use tropism_lab::Work;
use tropism_lab::files::shell_word;

use crate::options::{BeanOption, SeedOption};
use crate::progress::{check_outputs, execute_and_print, for_user};
use crate::shell::Shell;
use crate::units::UnitsOption;

/// Estimate the parameters of plants from their open-loop tracks
///
/// Finds the virtual bean that moves most like each plant, with 90 % intervals of its growth (G), sensitivity to light
/// (nu), motile zone (La), memory of light (tau_p) and period of circumnutation (Tcn); of several plants also their
/// spread. `prior` is the share of an estimate that is the species' own: near 100 % the track says nothing about the
/// parameter. The tracks must show both lamps in turn. Half a day gives wide intervals, three days those in
/// docs/validation/calibration.md. With --out, Ctrl-C saves each plant that is done, and --resume goes on.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism calibrate tent/1/track.csv tent/2/track.csv --out mine\n  \
    tropism calibrate tent --out mine\n  \
    tropism calibrate --recover 50")]
pub(crate) struct Calibrate {
    /// Tracks, a plant each, or folders of runs or tracks
    #[arg(value_name = "TRACK.csv|DIR", required_unless_present_any = ["recover", "resume"])]
    tracks: Vec<PathBuf>,

    /// Minutes between the rows of the tracks; as their times say by default
    #[arg(long, value_name = "MIN", requires = "tracks")]
    interval: Option<f64>,

    /// Folder for the estimates, and for a bean file, bean.toml: the species with these estimates and their spread; none by default
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Continue the calibration in DIR; without tracks with its own settings
    #[arg(long, requires = "out")]
    resume: bool,

    /// Estimate known parameters of N virtual plants instead: bias, error, and share of intervals that contain the
    /// truth
    #[arg(long, value_name = "N", conflicts_with_all = ["tracks", "resume", "interval", "unit", "list", "engine"], value_parser = clap::value_parser!(u32).range(2..=10_000))]
    recover: Option<u32>,

    #[command(flatten)]
    bean: BeanOption,

    #[command(flatten)]
    seed: SeedOption,

    #[command(flatten)]
    units: UnitsOption,
}

impl Calibrate {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let species = self.bean.load()?.unwrap_or_default();
        if let Some(plants) = self.recover {
            let plan = RecoveryPlan { plants, species, seed: self.seed.seed };
            return execute_and_print(&plan, shell, |rows| recovery_text(plants, rows));
        }
        let plan = match &self.out {
            Some(out) if self.tracks.is_empty() => {
                shell.check_resumes_alone(out, &[])?;
                CalibratePlan::of_folder(out).map_err(for_user)?
            }
            _ => CalibratePlan {
                tracks: self.tracks,
                interval_min: self.interval,
                species,
                resume: self.resume,
                out: self.out,
            },
        };
        check_outputs(&plan.outputs(), [self.bean.bean.as_ref()])?;
        self.units.execute(&plan, shell, |plants| text(&plan, plants))
    }
}

fn text(plan: &CalibratePlan, plants: &[PlantEstimates]) -> String {
    let mut text = String::new();
    for PlantEstimates { track, rms_cm, estimates } in plants {
        text += &format!("{}: {rms_cm:.1} cm from the tip (rms)\n", track.display());
        for ((key, letter, unit), estimate) in PARAMETERS.into_iter().zip(estimates) {
            let (value, low, high) = (estimate.value, estimate.low, estimate.high);
            let prior = 100.0 * estimate.prior_share;
            let silent = if estimate.is_silent() { ": the track says nothing about it" } else { "" };
            text += &format!(
                "  {letter:<6} {key:<24} {value:>8.4}  [{low:.4}, {high:.4}] {unit}; prior {prior:.0} %{silent}\n"
            );
        }
    }
    let silent = |parameter: usize| plants.iter().all(|plant| plant.estimates[parameter].is_silent());
    if (0..PARAMETERS.len()).all(silent) {
        text += "these tracks say nothing about any parameter: the estimates are the species' own\n";
    }
    if plants.len() > 1 {
        text += &format!("{} plants: mean, and spread between plants\n", plants.len());
        for (PooledEstimate { key, mean, spread }, (_, letter, unit)) in pool(plants).iter().zip(PARAMETERS) {
            text += &format!("  {letter:<6} {key:<24} {mean:>8.4}  {:>3.0} % {unit}\n", 100.0 * spread);
        }
    }
    if let Some(bean) = plan.bean() {
        let word = shell_word(&bean);
        text += &format!("wrote {}\nnext: tropism grow --bean {word} --out grown\n", bean.display());
    }
    text.trim_end().to_owned()
}

fn recovery_text(plants: u32, rows: &[ParameterRecovery]) -> String {
    let mut text = format!("{plants} virtual plants over 83.3 h, the lamps switched every six hours\n");
    text += &format!("{:<24} {:>8} {:>8} {:>16} {:>10}\n", "", "bias", "error", "of the typical", "coverage");
    for row in rows {
        let percent = [row.bias, row.error, row.error_of_typical, row.coverage].map(|share| 100.0 * share);
        let [bias, error, of_typical, coverage] = percent;
        let key = &row.key;
        text += &format!("{key:<24} {bias:>6.1} % {error:>6.1} % {of_typical:>14.1} % {coverage:>8.0} %\n");
    }
    text.trim_end().to_owned()
}
