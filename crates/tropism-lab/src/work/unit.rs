//! One unit of a work alone: beside others, also on other machines that share the folder, and in any order.

use std::path::PathBuf;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::claim::claim_beside_others;
use super::{Pace, Place, Stage, Units, Work};
use crate::units::plural;
use crate::{Error, Monitor, Workflow};

/// Executes one unit of a work alone. The work itself then finds it done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "W: DeserializeOwned"))]
pub struct UnitPlan<W> {
    /// The work.
    pub work: W,
    /// Number of the unit, from 1.
    pub unit: usize,
}

/// A unit of a work, as it is listed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ListedUnit {
    /// Its number, from 1.
    pub number: usize,
    /// Number of its stage, from 1: the units of those before must be done first.
    pub stage: usize,
    /// Its name.
    pub unit: String,
    /// What it does, in a few words.
    pub about: String,
    /// Whether it is done.
    pub is_done: bool,
}

/// What became of a unit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct UnitResults {
    /// Folder of the work.
    pub folder: PathBuf,
    /// Number of the unit, from 1.
    pub number: usize,
    /// Its name.
    pub unit: String,
    /// What it does, in a few words.
    pub about: String,
    /// Units of the work that are done, with this one.
    pub done: usize,
    /// Units of the work.
    pub total: usize,
}

/// All units of `work`, which is checked and prepared first, in the order in which they begin.
///
/// # Errors
/// [`Error`] as [`Workflow::execute`] before any work.
pub fn units_of<W: Work>(work: &W) -> Result<Vec<ListedUnit>, Error> {
    work.check()?;
    let mut work = work.clone();
    work.prepare()?;
    let begun = work.begin(&crate::Silent)?;
    listed(&begun, &begun.stages())
}

fn listed(begun: &impl Units, stages: &[Stage]) -> Result<Vec<ListedUnit>, Error> {
    let places = stages
        .iter()
        .enumerate()
        .flat_map(|(stage, units)| (0..units.units.len()).map(move |unit| Place { stage, unit }));
    let listed = (1..).zip(places).map(|(number, place)| {
        let unit = &stages[place.stage].units[place.unit];
        let is_done = begun.is_done(place)?;
        let (name, about) = (unit.name.clone(), unit.about.clone());
        Ok(ListedUnit { number, stage: place.stage + 1, unit: name, about, is_done })
    });
    listed.collect()
}

impl<W: Work> Workflow for UnitPlan<W> {
    type Results = UnitResults;

    const SCHEMA: &'static str = "tropism.unit/1";

    fn check(&self) -> Result<(), Error> {
        if self.work.out().as_os_str().is_empty() {
            return Err(Error::Plan("`out` is missing: units of work lie in a folder".to_owned()));
        }
        self.work.check()
    }

    fn prepare(&mut self) -> Result<(), Error> {
        self.work.prepare()
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<UnitResults, Error> {
        let begun = self.work.begin(monitor)?;
        let stages = begun.stages();
        let total = stages.iter().map(|stage| stage.units.len()).sum::<usize>();
        Error::check_range("unit", self.unit as u64, total as u64)?;
        claim_beside_others(&self.work, &begun)?;
        let mut units = listed(&begun, &stages)?;
        let ListedUnit { number, stage, unit, about, is_done } = units[self.unit - 1].clone();
        let before = units.iter().filter(|one| one.stage < stage && !one.is_done).count();
        if before > 0 {
            return Err(Error::Plan(format!(
                "{}: found {} of stages before that of unit {number} not done, wanted all done",
                self.work.out().display(),
                plural(before, "unit")
            )));
        }
        if !is_done {
            let first = units.iter().position(|one| one.stage == stage).unwrap_or_default();
            let place = Place { stage: stage - 1, unit: number - 1 - first };
            let stage = &stages[place.stage];
            if stage.pace != Pace::InTurn {
                monitor.stage(&about, stage.units[place.unit].size);
            }
            begun.execute(place, monitor).map_err(|error| error.of_part(self.work.out()))?;
            units = listed(&begun, &stages)?;
        }
        let done = units.iter().filter(|unit| unit.is_done).count();
        Ok(UnitResults { folder: self.work.out().to_owned(), number, unit, about, done, total })
    }
}
