//! The typical plant of a species in the experiments of plant physiology: a figure an experiment, and measured
//! quantities.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism_bean::Species;
use tropism_report as report;

use crate::{Error, Monitor, Workflow, files};

/// NoiseStream how the typical plant of a species responds in the experiments of plant physiology.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct KinematicsPlan {
    /// The species.
    pub species: Species,
    /// Folder for the figures.
    pub out: PathBuf,
}

impl Default for KinematicsPlan {
    fn default() -> Self {
        Self { species: Species::default(), out: "figures".into() }
    }
}

/// The figures of a [`KinematicsPlan`], and what was measured in them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KinematicsResults {
    /// Always true.
    pub is_virtual: bool,
    /// Figure files.
    pub figures: Vec<PathBuf>,
    /// Measured quantities.
    pub measured: Vec<MeasuredQuantity>,
}

/// A quantity of the virtual plant beside its published value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredQuantity {
    /// What was measured, with its unit.
    pub quantity: String,
    /// The value of the virtual plant.
    pub value: f64,
    /// The published value of living plants, with its source.
    pub published: String,
}

impl Workflow for KinematicsPlan {
    type Results = KinematicsResults;

    const SCHEMA: &'static str = "tropism.kinematics/1";

    fn check(&self) -> Result<(), Error> {
        self.species.check().map_err(Error::in_plan("species"))
    }

    fn perform(&self, _monitor: &dyn Monitor) -> Result<KinematicsResults, Error> {
        files::make_folder(&self.out)?;
        let (figures, quantities) = report::kinematics(&self.species.average());
        let mut results = KinematicsResults { is_virtual: true, figures: Vec::new(), measured: Vec::new() };
        for (name, bytes) in report::files(&figures) {
            let path = self.out.join(name);
            files::write(&path, &bytes)?;
            results.figures.push(path);
        }
        results.measured.extend(quantities.into_iter().map(|quantity| MeasuredQuantity {
            quantity: quantity.quantity,
            value: quantity.value,
            published: quantity.published.to_owned(),
        }));
        Ok(results)
    }
}
