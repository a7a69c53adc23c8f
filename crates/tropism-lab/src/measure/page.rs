//! The report of a measurement.

use tropism::measure::{Change, Estimate, Quantity, Status};
use tropism_report::{self as report, MeasuredPlant, Page, Plants, Table};

use super::{MeasurePlan, MeasureResults, MeasuredStems};
use crate::Error;

/// Plants of which the page shows kymographs and stems. Chosen: a page of a group stays readable; the files have all.
const MAX_PLANTS: usize = 4;

/// The page.
pub(super) fn page(
    plan: &MeasurePlan,
    plants: &[MeasuredStems],
    results: &MeasureResults,
) -> Result<Page, Error> {
    let kind = if results.is_virtual { Plants::Virtual } else { Plants::Real };
    let all: Vec<MeasuredPlant> = plants
        .iter()
        .map(|plant| MeasuredPlant {
            name: plant.name,
            record: plant.record,
            measurement: &plant.measurement,
        })
        .collect();
    let mut tables = vec![plant_table(results)];
    if results.plants.len() > 1 {
        tables.push(group_table(results));
    }
    if !results.comparisons.is_empty() {
        tables.push(comparison_table(results));
    }
    if !results.self_check.is_empty() {
        tables.push(check_table(results));
        tables.push(sharpening_table(results));
    }
    tables.push(reasons(results));
    let mut figures = Vec::new();
    for plant in all.iter().take(MAX_PLANTS) {
        figures.extend(report::kymographs(*plant, kind));
        figures.push(report::fitted_stems(*plant, kind));
    }
    if !all.is_empty() {
        figures.push(report::ridge(&all, kind));
    }
    if results.plants.len() > 1 {
        let has =
            |symbol: &&str| results.plants[0].estimates.iter().any(|estimate| estimate.symbol == **symbol);
        for symbol in ["Lc", "B", "beta", "gamma", "E", "turn"].into_iter().filter(has) {
            let of =
                |estimates: &'_ [Estimate]| estimates.iter().position(|estimate| estimate.symbol == symbol);
            let groups: Vec<_> = results
                .groups
                .iter()
                .map(|group| {
                    let members = results.plants.iter().filter(|plant| plant.group == group.name);
                    let values = members
                        .filter_map(|plant| of(&plant.estimates).map(|at| &plant.estimates[at]))
                        .collect();
                    let mean = of(&group.estimates).map(|at| &group.estimates[at]);
                    (name_or_all(&group.name), values, mean)
                })
                .collect();
            figures.push(report::strips(symbol, Quantity::of(symbol).unit, &groups, kind));
        }
    }
    let config = toml::to_string(plan).map_err(Error::at("the plan"))?;
    Ok(Page {
        title: "Constants of plants".to_owned(),
        intro: intro(results),
        plants: kind,
        numbers: Vec::new(),
        tables,
        figures,
        left_out: Vec::new(),
        command: String::new(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seeds: vec![("virtual plants and permutations".to_owned(), plan.seed)],
        stages: Vec::new(),
        config,
    })
}

fn name_or_all(name: &str) -> String {
    if name.is_empty() { "all plants".to_owned() } else { name.to_owned() }
}

fn intro(results: &MeasureResults) -> String {
    let responding = results.plants.iter().filter(|plant| plant.responds).count();
    let left_out = if results.left_out.is_empty() {
        String::new()
    } else {
        format!("\n\nLeft out: {}.", results.left_out.join("; "))
    };
    format!(
        "{responding} of {} plants show a response that their own movement does not explain. Intervals are 90 % intervals. That of a \
         plant says how well this plant is known; only that of a group says something of the species.\n\n\
         The equation: {}. A is the angle to the vertical, kappa the curvature, a the distance from the apex, f the forcing of \
         the plant by itself. Where stretch is counted as straightening, gamma is greater by E and gamma~ by 1. Beta and gamma are of a \
         zone that is equally sensitive up to the apex; of a zone whose sensitivity has a peak both come out up to 45 % too \
         high, and their ratio Lc does not change.{left_out}",
        results.plants.len(),
        results.equation,
    )
}

/// A value with its interval, or what can be said instead.
pub(super) fn cell(estimate: &Estimate) -> String {
    with_unit(estimate, "")
}

/// A value with its interval and unit, or what can be said instead.
pub(super) fn with_unit(estimate: &Estimate, unit: &str) -> String {
    let [low, high] = estimate.interval.map(three_digits);
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    match estimate.status {
        // Without an interval of its own the number is one of a group.
        status if status.has_value() && estimate.interval[0].is_nan() => {
            format!("{}{unit} (no interval)", three_digits(estimate.value))
        }
        Status::Measured => format!("{} [{low}, {high}]{unit}", three_digits(estimate.value)),
        Status::Provisional => format!("{} [{low}, {high}]{unit}, provisional", three_digits(estimate.value)),
        Status::Bounded if estimate.interval[1].is_infinite() => format!("above {low}{unit}"),
        Status::Bounded => format!("below {high}{unit}"),
        Status::NotIdentified => "not identified".to_owned(),
    }
}

/// A number with three digits.
fn three_digits(value: f64) -> String {
    let digits = match value.abs() {
        100.0.. => 0,
        10.0.. => 1,
        1.0.. => 2,
        0.1.. => 3,
        _ => 4,
    };
    format!("{value:.digits$}")
}

/// A symbol with its unit.
fn head(symbol: &str) -> String {
    let quantity = Quantity::of(symbol);
    if quantity.unit.is_empty() { symbol.to_owned() } else { format!("{symbol} ({})", quantity.unit) }
}

fn plant_table(results: &MeasureResults) -> Table {
    let symbols = || results.plants[0].estimates.iter().map(|estimate| estimate.symbol.as_str());
    let row = |plant: &super::PlantConstants| {
        let name = if plant.group.is_empty() {
            plant.name.clone()
        } else {
            format!("{} ({})", plant.name, plant.group)
        };
        let frames = format!("{} of {}, {:.1} h", plant.frames.used, plant.frames.all, plant.duration_h);
        let responds = if plant.responds { "yes" } else { "no" };
        let mut row = vec![name, frames, responds.to_owned()];
        row.extend(plant.estimates.iter().map(cell));
        row
    };
    Table {
        title: "Plants".to_owned(),
        caption: "Each constant with its 90 % interval.".to_owned(),
        head: ["Plant", "Frames", "Responds"]
            .into_iter()
            .map(str::to_owned)
            .chain(symbols().map(head))
            .collect(),
        rows: results.plants.iter().map(row).collect(),
    }
}

fn group_table(results: &MeasureResults) -> Table {
    let mut head: Vec<String> = ["Constant", "Unit", "What it is"].map(str::to_owned).to_vec();
    head.extend(
        results.groups.iter().map(|group| format!("{} ({} plants)", name_or_all(&group.name), group.plants)),
    );
    let symbols = results.groups[0].estimates.iter().map(|estimate| &estimate.symbol);
    let row = |symbol: &String| {
        let quantity = Quantity::of(symbol);
        let mut row = vec![symbol.clone(), quantity.unit.to_owned(), quantity.words.to_owned()];
        let of = |group: &super::GroupConstants| {
            group.estimates.iter().find(|estimate| estimate.symbol == *symbol).map_or(String::new(), cell)
        };
        row.extend(results.groups.iter().map(of));
        row
    };
    Table {
        title: "Groups".to_owned(),
        caption: "Geometric means of the plants of which a constant is measured, with 90 % t intervals over plants; 5 % of systematic \
                  error are added."
            .to_owned(),
        head,
        rows: symbols.map(row).collect(),
    }
}

fn comparison_table(results: &MeasureResults) -> Table {
    let row = |comparison: &super::GroupComparison| {
        let [one, other] = &comparison.groups;
        vec![
            comparison.symbol.clone(),
            format!("{} / {}", name_or_all(one), name_or_all(other)),
            format!("{} / {}", comparison.plants[0], comparison.plants[1]),
            comparison.ratio.map_or_else(|| "\u{2013}".to_owned(), |ratio| format!("{ratio:.2}")),
            format!("{:.2}", comparison.test.auc),
            format!("{:.4}", comparison.test.p),
        ]
    };
    Table {
        title: "Groups compared".to_owned(),
        caption: "Ratio of geometric means; probability that a plant of the first group is above one of the second; two-sided p by \
                  permutation of plants. The p values are not corrected for the number of constants."
            .to_owned(),
        head: ["Constant", "Groups", "Plants", "Ratio", "Probability above", "p"].map(str::to_owned).to_vec(),
        rows: results.comparisons.iter().map(row).collect(),
    }
}

fn check_table(results: &MeasureResults) -> Table {
    let row = |recovery: &tropism::measure::Recovery| {
        let share = |value: f64| {
            if value.is_nan() { "\u{2013}".to_owned() } else { format!("{:.0} %", 100.0 * value) }
        };
        vec![
            recovery.symbol.clone(),
            format!("{} of {}", recovery.measured, recovery.plants),
            share(recovery.ratio),
            share(recovery.spread),
            share(recovery.coverage),
            format!("{:.1}", recovery.widening),
        ]
    };
    Table {
        title: "The same experiment on virtual plants".to_owned(),
        caption: "Virtual plants with the constants, the forcing and the noise that were found, at the frames of these records, \
                  measured in the same way. Where their intervals are too narrow, those of the plants above are wider by the factor in \
                  the last column. Virtual plants obey the equation; living ones need not."
            .to_owned(),
        head: ["Constant", "Measured", "Recovered / true", "Spread", "Intervals that hold it", "Widened by"].map(str::to_owned).to_vec(),
        rows: results.self_check.iter().map(row).collect(),
    }
}

fn sharpening_table(results: &MeasureResults) -> Table {
    let symbols: Vec<&str> = {
        let mut symbols: Vec<&str> = results.sharpenings.iter().map(|row| row.symbol.as_str()).collect();
        symbols.sort_unstable();
        symbols.dedup();
        symbols
    };
    let row = |change: Change| {
        let width = |symbol: &&str| {
            let found = results.sharpenings.iter().find(|row| row.change == change && row.symbol == **symbol);
            found.map_or(String::new(), |row| format!("{:.2}", row.width))
        };
        [change.words().to_owned()].into_iter().chain(symbols.iter().map(width)).collect()
    };
    Table {
        title: "What would sharpen this".to_owned(),
        caption: "Width of a plant's interval in a changed experiment on virtual plants, as a multiple of that of the present one. More \
                  plants narrow the interval of a group: four times as many halve it."
            .to_owned(),
        head: ["Change"].into_iter().chain(symbols.iter().copied()).map(str::to_owned).collect(),
        rows: Change::ALL.into_iter().map(row).collect(),
    }
}

fn reasons(results: &MeasureResults) -> Table {
    let of_plant = |plant: &super::PlantConstants| {
        let row = |estimate: &Estimate| {
            vec![
                plant.name.clone(),
                estimate.symbol.clone(),
                estimate.status.name().to_owned(),
                estimate.reason.clone(),
            ]
        };
        let open = plant.estimates.iter().filter(|estimate| !estimate.reason.is_empty());
        open.map(row).collect::<Vec<_>>()
    };
    let mut rows: Vec<Vec<String>> = results.plants.iter().flat_map(of_plant).collect();
    rows.push(vec![
        "all".to_owned(),
        "growth profile".to_owned(),
        "not identified".to_owned(),
        "ten equal points of a centre line carry no material identity: use marks or texture".to_owned(),
    ]);
    Table {
        title: "What these data cannot say".to_owned(),
        caption: String::new(),
        head: ["Plant", "Constant", "Status", "Why"].map(str::to_owned).to_vec(),
        rows,
    }
}
