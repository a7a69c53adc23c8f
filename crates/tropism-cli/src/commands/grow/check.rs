//! `tropism grow --check`: virtual beans beside published values.

use anyhow::{Result, ensure};
use tropism::text::plural;
use tropism_bean::Species;
use tropism_lab::grow::{AcceptancePlan, AcceptanceRow, OPEN_LOOP_PLANTS, STEERED_PLANTS};

use crate::progress;
use crate::shell::Shell;

/// Prints each statistic of the species with its range. Fails if one is outside.
pub(super) fn execute(species: Species, seed: u64, shell: &Shell) -> Result<()> {
    let rows = progress::execute(&AcceptancePlan { species, seed }, shell)?;
    let missed = rows.iter().filter(|row| !row.holds).count();
    let mut lines: Vec<String> = rows.iter().map(line).collect();
    lines.push(format!(
        "{} of {} hold, over {OPEN_LOOP_PLANTS} open-loop and {STEERED_PLANTS} steered virtual beans",
        rows.len() - missed,
        rows.len()
    ));
    shell.result(&lines.join("\n"), &rows)?;
    ensure!(missed == 0, "{} outside the accepted range", plural(missed, "statistic"));
    Ok(())
}

fn line(row: &AcceptanceRow) -> String {
    let AcceptanceRow { number, statistic, value, least, most, holds } = row;
    let range = match most {
        Some(most) => format!("{least} to {most}"),
        None => format!("above {least}"),
    };
    let verdict = if *holds { "ok" } else { "MISSED" };
    format!("{number:>2}  {statistic:<48} {value:>9.3}  {range:<14} {verdict}")
}
