//! `tropism grow --check`: virtual beans held against what is published.

use anyhow::{Result, ensure};
use rayon::prelude::*;
use serde::Serialize;
use tropism::greenhouse::bean::{Species, acceptance};
use tropism::plant::tip::{TipModel, TipModelConfig};
use tropism::random::{self, Purpose};
use tropism::task::Targets;
use tropism::track::Track;

use super::tune;
use crate::shell::Shell;

/// Open-loop beans: ten sets of six.
const OPEN_LOOP: u32 = 60;
/// Sets of six that a model is made of and a controller tuned on.
const TUNED: usize = 5;
/// Fresh beans that each controller steers.
const STEERED: u32 = 60;

/// A statistic with its range.
#[derive(Serialize)]
struct Checked {
    number: u32,
    statistic: &'static str,
    value: f64,
    least: f64,
    most: Option<f64>,
    holds: bool,
}

impl From<acceptance::AcceptanceRow> for Checked {
    fn from(row: acceptance::AcceptanceRow) -> Self {
        Self {
            number: row.number,
            statistic: row.statistic,
            value: row.value,
            least: row.range[0],
            most: row.range[1].is_finite().then_some(row.range[1]),
            holds: row.holds(),
        }
    }
}

impl Checked {
    fn line(&self) -> String {
        let range = match self.most {
            Some(most) => format!("{} to {most}", self.least),
            None => format!("above {}", self.least),
        };
        let mark = if self.holds { "ok" } else { "MISSED" };
        format!("{:>2}  {:<48} {:>9.3}  {range:<14} {mark}", self.number, self.statistic, self.value)
    }
}

/// Prints each statistic of the species with its range.
pub(super) fn check(species: &Species, seed: u64, shell: &Shell) -> Result<()> {
    let seeds: Vec<u64> =
        (0..OPEN_LOOP + STEERED).map(|plant| random::derive(seed, Purpose::Plant, plant.into())).collect();
    let (open_loop, fresh) = seeds.split_at(OPEN_LOOP as usize);
    let progress = shell.progress("open-loop beans", OPEN_LOOP.into());
    let tracks: Vec<Track> = open_loop
        .par_iter()
        .map(|&seed| {
            let track = acceptance::open_loop_experiment(species, seed);
            progress.add(1);
            track
        })
        .collect();
    drop(progress);
    let progress = shell.progress("tuning controllers", TUNED as u64 * tune::WORK);
    let task = Targets::default();
    let mut tuned = tracks
        .chunks(acceptance::SET_SIZE)
        .take(TUNED)
        .map(|set| {
            let model = TipModel::fit(set, TipModelConfig::default())?;
            Ok(tune::tuned(&model, &task, seed, || progress.add(1)))
        })
        .collect::<Result<Vec<_>>>()?;
    drop(progress);
    // Some searches end too early: they give no nearly perfect controllers.
    tuned.sort_by(|a, b| b.0.total_cmp(&a.0));
    let good = tuned.iter().filter(|(fitness, _)| *fitness >= acceptance::GOOD_MODEL_FITNESS).count();
    tuned.truncate(good.max(1));
    let mut rows = acceptance::population(&tracks);
    rows.extend(acceptance::single_plant(species));
    rows.extend(acceptance::closed_loop(species, fresh, &tuned));
    rows.sort_by_key(|row| row.number);
    let rows: Vec<Checked> = rows.into_iter().map(Checked::from).collect();
    let missed = rows.iter().filter(|row| !row.holds).count();
    let mut lines: Vec<String> = rows.iter().map(Checked::line).collect();
    lines.push(format!(
        "{} of {} hold, over {OPEN_LOOP} open-loop and {STEERED} steered virtual beans",
        rows.len() - missed,
        rows.len()
    ));
    shell.result(&lines.join("\n"), &rows)?;
    ensure!(missed == 0, "found {missed} statistics outside their range, wanted none");
    Ok(())
}
