//! A species of virtual plants with the measured constants: what `tropism grow` and `tropism calibrate` take.

use std::fmt::Write as _;
use std::path::Path;

use tropism::measure::{Estimate, Quantity, Status, group};
use tropism_bean::{EARLY_GROWTH, Individual, Species};

use super::{MeasureResults, values_of};
use crate::units::plural;
use crate::{Error, files};

/// Five minutes in h: the unit of `growth.rate`.
const FIVE_MINUTES_H: f64 = 1.0 / 12.0;

/// The species file, whose head lists what was measured; `None` for several groups, and if no constant of a bean was measured.
pub(super) fn species_file(path: &Path, results: &MeasureResults) -> Result<Option<String>, Error> {
    if results.groups.len() != 1 {
        return Ok(None);
    }
    let mut species = Species { name: "measured".to_owned(), ..Species::default() };
    let mut head = String::new();
    for (key, symbol, set) in KEYS {
        let Some(estimate) = mean(results, symbol) else { continue };
        let mut changed = species.clone();
        set(&mut changed.typical, estimate.value);
        // What no virtual bean can have stays a guess.
        if changed.check().is_ok() {
            species = changed;
            let [low, high] = estimate.interval;
            let unit = Quantity::of(symbol).unit;
            let value = estimate.value;
            let _ = match estimate.interval[0].is_finite() {
                true => writeln!(head, "# {key}: {symbol} {value:.4} [{low:.4}, {high:.4}] {unit}"),
                false => writeln!(head, "# {key}: {symbol} {value:.4} {unit}, without an interval"),
            };
        }
    }
    if head.is_empty() {
        return Ok(None);
    }
    let plants = if results.is_virtual { "virtual plant" } else { "plant" };
    let head = format!(
        "# A bean file for `tropism grow --bean` and `tropism calibrate --bean`, of `tropism measure`.\n# Measured on \
         {}, with 90 % intervals:\n{head}# All other values, and the spread between plants, are those of the common \
         bean: guesses for this species.\n\n",
        plural(results.plants.len(), plants)
    );
    Ok(Some(head + &files::toml_of(path, &species)?))
}

type Set = fn(&mut Individual, f64);

/// Keys of a bean file, the symbols that they follow from, and how. The balance number of a bean is that of light and gravity
/// together, so it follows from gamma, and after the others.
const KEYS: [(&str, &str, Set); 8] = [
    // Of young plants, which are what is measured.
    ("typical.growth.rate", "G", |plant, value| plant.growth.rate = value * FIVE_MINUTES_H / EARLY_GROWTH),
    ("typical.motility.zone_young", "Lgz", |plant, value| plant.motility.zone_young = value),
    ("typical.motility.edge", "W", |plant, value| plant.motility.edge = value),
    ("typical.tropism.gravity", "beta", |plant, value| plant.tropism.gravity = value),
    ("typical.tropism.light", "nu", |plant, value| plant.tropism.light = value),
    // Two stages in a row, whose mean delays add up.
    ("typical.tropism.light_memory_h", "tau", |plant, value| plant.tropism.light_memory_h = 0.5 * value),
    ("typical.tropism.balance", "gamma", |plant, value| {
        let sensitivity = plant.tropism.light + plant.tropism.gravity;
        plant.tropism.balance = sensitivity * plant.motility.zone_young / value;
    }),
    ("typical.nutation.period_h", "T_cn", |plant, value| plant.nutation.period_h = value),
];

/// The mean of the group, or of its few plants without an interval.
fn mean(results: &MeasureResults, symbol: &str) -> Option<Estimate> {
    let of_group = results.groups.first()?.estimates.iter().find(|estimate| estimate.symbol == symbol)?;
    if of_group.status.has_value() {
        return Some(of_group.clone());
    }
    let values = values_of(&results.plants.iter().collect::<Vec<_>>(), symbol);
    let logs: Vec<f64> = values.into_iter().filter(|value| *value > 0.0).map(tropism::math::ln).collect();
    (!logs.is_empty()).then(|| Estimate {
        symbol: symbol.to_owned(),
        value: group::ratio(tropism::math::statistics::mean(logs)),
        interval: [f64::NAN; 2],
        status: Status::Provisional,
        reason: String::new(),
    })
}
