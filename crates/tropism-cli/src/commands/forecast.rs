//! `tropism forecast`: models compared by their forecasts of plants that were left out.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::Work;
use tropism_lab::forecast::{ForecastError, ForecastPlan, ForecastResults, LightForecasts, Truth};
use tropism_lab::units::plural;

use crate::options::{BeanOption, SeedOption, checked_variation};
use crate::progress::{check_outputs, for_user};
use crate::shell::Shell;
use crate::units::UnitsOption;

/// Compare models by what they predict of plants that were left out
///
/// From many starts each model runs on by itself, under the lamps that were lit, and never sees the plant again. Printed are
/// the distances of tip and stem from the plant, beside those of a plant that stands still, and how often the plant is within
/// the 90 % interval of the forecasts. Without --tracks the plants are virtual beans that no other command grows, under lamps
/// that change every six hours and at random times, and the truth is without noise. The plants of --tracks must not be those
/// of which the models were made.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism forecast --models model.json stem.json --out forecast\n  \
    tropism forecast --models stem.json --tracks left-out --horizons 5,30,60,120\n  \
    tropism forecast --models replicate-1/stem.json replicate-2/stem.json    one row, its interval over both replicates")]
pub(crate) struct Forecast {
    /// Model files of `tropism fit`; those of one file name are one model of several replicates
    #[arg(long, required_unless_present = "resume", num_args = 1.., value_name = "model.json")]
    models: Vec<PathBuf>,

    /// Tracks of plants that were left out, and folders of runs or of tracks; virtual beans by default
    #[arg(long, num_args = 1.., value_name = "TRACK.csv|DIR", requires = "models", conflicts_with_all = ["plants", "variation", "bean"])]
    tracks: Vec<PathBuf>,

    /// Number of virtual beans, the same ones under both kinds of light
    #[arg(long, default_value_t = 12, value_name = "N", requires = "models", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    plants: u32,

    /// Times of the forecasts after each start, in minutes
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "MIN,...",
        default_value = "5,60,360",
        requires = "models"
    )]
    horizons: Vec<f64>,

    /// Time from one start to the next, in minutes
    #[arg(long, value_name = "MIN", default_value_t = 60.0, requires = "models")]
    interval: f64,

    /// Individual variation of the virtual beans: 0 for the average, 1 as between real plants, up to 2
    #[arg(long, default_value_t = 1.0, value_name = "X", requires = "models")]
    variation: f64,

    /// Folder for the scores of each model, forecast.json and the figure; none by default
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Continue the forecasts in DIR; without --models with their own settings
    #[arg(long, requires = "out")]
    resume: bool,

    #[command(flatten)]
    bean: BeanOption,

    #[command(flatten)]
    seed: SeedOption,

    #[command(flatten)]
    units: UnitsOption,
}

impl Forecast {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        if let Some(out) = self.out.as_ref().filter(|_| self.models.is_empty()) {
            shell.check_resumes_alone(out, &[])?;
            let plan = ForecastPlan::of_folder(out).map_err(for_user)?;
            return self.units.execute(&plan, shell, |results| text(&plan, results));
        }
        let mut plan = ForecastPlan {
            models: self.models,
            tracks: self.tracks,
            plants: self.plants,
            horizons_min: self.horizons,
            interval_min: self.interval,
            seed: self.seed.seed,
            resume: self.resume,
            out: self.out,
            ..ForecastPlan::default()
        };
        plan.greenhouse.variation = checked_variation(self.variation)?;
        if let Some(bean) = self.bean.load()? {
            plan.greenhouse.bean = bean;
        }
        check_outputs(&plan.outputs(), [self.bean.bean.as_ref()])?;
        self.units.execute(&plan, shell, |results| text(&plan, results))
    }
}

fn text(plan: &ForecastPlan, results: &ForecastResults) -> String {
    let kind = if results.is_virtual { "virtual plant" } else { "plant" };
    let truth = match results.truth {
        Truth::NoiseFree => "the truth without noise",
        Truth::Measured => "measured tips and stems, with their noise",
    };
    let place = if results.in_space { " in space" } else { "" };
    let mut text = String::new();
    for light in &results.lights {
        let under = if light.light == "tracks" { String::new() } else { format!(", {} light", light.light) };
        text += &format!(
            "{} left out{under}: {}, compared with {truth}\n",
            plural(light.plants, kind),
            plural(light.starts, "start")
        );
        text += &table(&format!("tip{place} (cm)"), light, results, |row| Some(&light.models[row].tip));
        text += &table(&format!("stem{place} (cm)"), light, results, |row| light.models[row].stem.as_ref());
        text += "\n";
    }
    text += "error with its 95 % interval over plants and replicates; then the share of the plant within the 90 % interval";
    if let Some(out) = &plan.out {
        text += &format!("\nwrote {0}/forecast.json and {0}/figure-forecast.svg", out.display());
    }
    text
}

/// One line a model of which `errors` says something.
fn table<'r>(
    what: &str,
    light: &LightForecasts,
    results: &ForecastResults,
    errors: impl Fn(usize) -> Option<&'r Vec<ForecastError>>,
) -> String {
    let rows: Vec<_> = (0..light.models.len()).filter_map(|row| Some((row, errors(row)?))).collect();
    if rows.is_empty() {
        return String::new();
    }
    let longest = light.models.iter().map(|model| model.name.len()).max().unwrap_or(0).max(what.len());
    let heads = results.horizons_min.iter().map(|minutes| format!("{:<30}", duration(*minutes)));
    let mut text = format!("{what:<longest$}  {}\n", heads.collect::<String>().trim_end());
    for (row, errors) in rows {
        let cells = errors.iter().map(|error| format!("{:<30}", cell(error)));
        let name = &light.models[row].name;
        text += &format!("{name:<longest$}  {}\n", cells.collect::<String>().trim_end());
    }
    text
}

fn cell(error: &ForecastError) -> String {
    let [low, high] = error.interval_cm;
    let within = error.within_90.map_or(String::new(), |share| format!("  {:.0} %", 100.0 * share));
    format!("{:.3} ({low:.3} to {high:.3}){within}", error.mean_cm)
}

fn duration(minutes: f64) -> String {
    if minutes < 60.0 { format!("{minutes} min") } else { format!("{} h", minutes / 60.0) }
}
