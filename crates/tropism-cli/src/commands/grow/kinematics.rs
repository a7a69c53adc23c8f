//! `tropism grow --kinematics DIR`: the typical plant in the experiments of plant physiology.

use std::path::PathBuf;

use anyhow::Result;
use tropism_bean::Species;
use tropism_lab::grow::{KinematicsPlan, MeasuredQuantity};

use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Writes a figure an experiment into `out`, and prints the measured quantities beside published ones.
pub(super) fn execute(species: Species, out: PathBuf, shell: &Shell) -> Result<()> {
    let plan = KinematicsPlan { species, out };
    execute_and_print(&plan, shell, |results| {
        let mut text = format!("a virtual {}, its typical plant\n", plan.species.name);
        for MeasuredQuantity { quantity, value, published } in &results.measured {
            text += &format!("{quantity:<58} {value:>7.2}   {published}\n");
        }
        text + &format!("wrote {} figures into {}", results.figures.len(), plan.out.display())
    })
}
