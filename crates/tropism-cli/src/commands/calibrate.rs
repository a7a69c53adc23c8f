//! `tropism calibrate`: tracks of plants into parameters of a bean.

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::Args;
use rayon::prelude::*;
use serde::Serialize;
use tropism::greenhouse::bean::calibrate::{BeanCalibration, Estimate, PARAMETERS, calibrate};
use tropism::greenhouse::bean::{Individual, Species, acceptance};
use tropism::math;
use tropism::random::{self, Purpose};
use tropism::track::PAPER_PERIOD_MIN;
use tropism_lab::files;

use crate::options::{BeanOption, SeedOption};
use crate::shell::Shell;

/// Estimate the parameters of plants from their open-loop tracks
///
/// Growth (G), sensitivity to light (nu), motile zone (La), memory of light (tau_p) and the period of circumnutation (Tcn)
/// of the virtual bean that moves most like each plant, with 90 % intervals; of several plants also their spread. The tracks
/// must show both lamps in turn; half a day tells little, three days what docs/virtual-bean.md shows.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism calibrate tent/1/track.csv tent/2/track.csv --out mine.toml\n  \
    tropism calibrate --recover 50")]
pub(crate) struct Calibrate {
    /// Tracks, a plant each
    #[arg(value_name = "TRACK.csv", required_unless_present = "recover")]
    tracks: Vec<PathBuf>,

    /// Minutes between the rows of the tracks
    #[arg(long, default_value_t = PAPER_PERIOD_MIN, value_name = "MIN")]
    interval: f64,

    /// Bean file to write: the species with these estimates and their spread
    #[arg(long, value_name = "BEAN.toml")]
    out: Option<PathBuf>,

    /// Try it on so many virtual plants instead: bias, error, and how often the interval holds the truth
    #[arg(long, value_name = "N", conflicts_with_all = ["tracks", "out", "interval"], value_parser = clap::value_parser!(u32).range(2..=10_000))]
    recover: Option<u32>,

    #[command(flatten)]
    bean: BeanOption,

    #[command(flatten)]
    seed: SeedOption,
}

#[derive(Serialize)]
struct Plant {
    track: PathBuf,
    rms_cm: f64,
    estimates: Vec<Estimated>,
}

#[derive(Serialize)]
struct Estimated {
    key: &'static str,
    value: f64,
    low: f64,
    high: f64,
}

/// A parameter over all plants.
#[derive(Serialize)]
struct Pooled {
    key: &'static str,
    /// Geometric mean.
    mean: f64,
    /// Coefficient of variation between plants, without what the estimates' own errors add.
    spread: f64,
}

/// How well a parameter is recovered.
#[derive(Serialize)]
struct Recovered {
    key: &'static str,
    /// Mean error, as a share of the truth.
    bias: f64,
    /// Root mean square error, as a share of the truth.
    error: f64,
    /// The same of somebody who says the species' own value of every plant.
    error_of_typical: f64,
    /// Share of intervals that hold the truth.
    coverage: f64,
}

impl Calibrate {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let species = self.bean.load()?.unwrap_or_default();
        if let Some(plants) = self.recover {
            return recover(&species, plants, self.seed.seed, shell);
        }
        ensure!(
            (0.1..=120.0).contains(&self.interval),
            "found --interval {}, wanted 0.1 to 120 minutes",
            self.interval
        );
        let progress = shell.progress("calibrate", self.tracks.len() as u64);
        let found: Vec<BeanCalibration> = self
            .tracks
            .par_iter()
            .map(|path| {
                let track = files::read_track(path)?;
                let found =
                    calibrate(&track, self.interval, &species).with_context(|| path.display().to_string());
                progress.add(1);
                found
            })
            .collect::<Result<_>>()?;
        drop(progress);
        let mut text = String::new();
        for (path, found) in self.tracks.iter().zip(&found) {
            text += &format!("{}: {:.1} cm beside the tip (rms)\n", path.display(), found.rms_cm);
            for ((key, letter, unit), Estimate { value, interval: [low, high] }) in
                PARAMETERS.into_iter().zip(&found.estimates)
            {
                text += &format!("  {letter:<6} {key:<24} {value:>8.4}  [{low:.4}, {high:.4}] {unit}\n");
            }
        }
        let pooled = pool(&found);
        if found.len() > 1 {
            text += &format!("{} plants: mean, and spread between plants\n", found.len());
            for (row, (_, letter, unit)) in pooled.iter().zip(PARAMETERS) {
                let Pooled { key, mean, spread } = row;
                text += &format!("  {letter:<6} {key:<24} {mean:>8.4}  {:>3.0} % {unit}\n", 100.0 * spread);
            }
        }
        if let Some(out) = &self.out {
            files::write(out, toml::to_string(&described(species, &pooled, found.len()))?.as_bytes())?;
            text += &format!("wrote {0}\nnext: tropism grow --bean {0} --out beans\n", out.display());
        }
        let plants: Vec<Plant> = self
            .tracks
            .into_iter()
            .zip(found)
            .map(|(track, found)| {
                let estimates = PARAMETERS.into_iter().zip(found.estimates);
                let estimates = estimates.map(|((key, ..), Estimate { value, interval: [low, high] })| {
                    Estimated { key, value, low, high }
                });
                Plant { track, rms_cm: found.rms_cm, estimates: estimates.collect() }
            })
            .collect();
        shell.result(text.trim_end(), &plants)
    }
}

/// The parameters over all plants, as logarithms add up.
fn pool(found: &[BeanCalibration]) -> Vec<Pooled> {
    let count = found.len() as f64;
    let pooled = |(parameter, (key, ..)): (usize, (&'static str, &str, &str))| {
        let logs: Vec<f64> = found.iter().map(|found| math::ln(found.estimates[parameter].value)).collect();
        let mean = logs.iter().sum::<f64>() / count;
        let variance = logs.iter().map(|log| (log - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        let own = found.iter().map(|found| {
            let [low, high] = found.estimates[parameter].interval;
            (math::ln(high / low) / (2.0 * 1.645)).powi(2)
        });
        let between = (variance - own.sum::<f64>() / count).max(0.0);
        Pooled { key, mean: math::exp(mean), spread: (math::exp(between) - 1.0).sqrt() }
    };
    PARAMETERS.into_iter().enumerate().map(pooled).collect()
}

/// The species with what was estimated; one plant says nothing about the spread.
fn described(mut species: Species, pooled: &[Pooled], plants: usize) -> Species {
    let typical = &mut species.typical;
    let values = [
        &mut typical.growth.rate,
        &mut typical.tropism.light,
        &mut typical.motility.zone,
        &mut typical.tropism.light_memory_h,
        &mut typical.nutation.period_h,
    ];
    for (value, pooled) in values.into_iter().zip(pooled) {
        *value = pooled.mean;
    }
    if plants > 1 {
        let spread = &mut species.spread;
        let values = [
            &mut spread.growth_rate,
            &mut spread.tropism_light,
            &mut spread.motility_zone,
            &mut spread.tropism_light_memory_h,
            &mut spread.nutation_period_h,
        ];
        for (value, pooled) in values.into_iter().zip(pooled) {
            *value = pooled.spread.min(1.0);
        }
    }
    species
}

fn values(plant: &Individual) -> [f64; 5] {
    [
        plant.growth.rate,
        plant.tropism.light,
        plant.motility.zone,
        plant.tropism.light_memory_h,
        plant.nutation.period_h,
    ]
}

/// The true parameters of a plant, and what its track tells.
type Tried = ([f64; 5], BeanCalibration);

fn recover(species: &Species, plants: u32, seed: u64, shell: &Shell) -> Result<()> {
    let progress = shell.progress("calibrating virtual plants", plants.into());
    let found: Vec<Tried> = (0..plants)
        .into_par_iter()
        .map(|plant| {
            let seed = random::derive(seed, Purpose::Plant, plant.into());
            let track = acceptance::open_loop_experiment(species, seed);
            let found = calibrate(&track, PAPER_PERIOD_MIN, species)?;
            progress.add(1);
            Ok((values(&species.draw(seed, 1.0)), found))
        })
        .collect::<Result<_>>()?;
    drop(progress);
    let typical = values(&species.average());
    let count = f64::from(plants);
    let mean = |value: &dyn Fn(&Tried) -> f64| found.iter().map(value).sum::<f64>() / count;
    let mut text = format!("{plants} virtual plants over 83.3 h, the lamps changing every six\n");
    text += &format!("{:<24} {:>8} {:>8} {:>16} {:>10}\n", "", "bias", "error", "of the typical", "coverage");
    let mut rows = Vec::new();
    for (parameter, (key, ..)) in PARAMETERS.into_iter().enumerate() {
        let off = |truth: f64, value: f64| value / truth - 1.0;
        let error = |(truth, found): &Tried| off(truth[parameter], found.estimates[parameter].value);
        let is_held = |(truth, found): &Tried| {
            let [low, high] = found.estimates[parameter].interval;
            f64::from(u8::from((low..=high).contains(&truth[parameter])))
        };
        let row = Recovered {
            key,
            bias: mean(&error),
            error: mean(&|one| error(one).powi(2)).sqrt(),
            error_of_typical: mean(&|(truth, _)| off(truth[parameter], typical[parameter]).powi(2)).sqrt(),
            coverage: mean(&is_held),
        };
        text += &format!(
            "{key:<24} {:>6.1} % {:>6.1} % {:>14.1} % {:>8.0} %\n",
            100.0 * row.bias,
            100.0 * row.error,
            100.0 * row.error_of_typical,
            100.0 * row.coverage
        );
        rows.push(row);
    }
    shell.result(text.trim_end(), &rows)
}
