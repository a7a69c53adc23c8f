//! One unit of a work alone: beside others, also on other machines that share the folder, and in any order.

use std::path::PathBuf;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::claim::claim_beside_others;
use super::{Pace, Place, Stage, Unit, Units, Work};
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
    /// Units of the work.
    pub total: usize,
    /// Its name.
    pub unit: String,
    /// What it does, in a few words.
    pub about: String,
}

/// All units of `work`, which is checked and prepared first, in the order in which they begin.
///
/// # Errors
/// [`Error`] as [`Workflow::execute`] before any work.
pub fn units_of<W: Work>(work: &W) -> Result<Vec<ListedUnit>, Error> {
    check_out(work)?;
    work.check()?;
    let mut work = work.clone();
    work.prepare()?;
    let begun = work.begin(&crate::Silent)?;
    let stages = begun.stages();
    let listed = (1..).zip(places(&stages)).map(|(number, place)| {
        let Unit { name, about, .. } = stages[place.stage].units[place.unit].clone();
        let is_done = begun.is_done(place)?;
        Ok(ListedUnit { number, stage: place.stage + 1, unit: name, about, is_done })
    });
    listed.collect()
}

impl<W: Work> Workflow for UnitPlan<W> {
    type Results = UnitResults;

    const SCHEMA: &'static str = "tropism.unit/1";

    fn check(&self) -> Result<(), Error> {
        check_out(&self.work)?;
        self.work.check()
    }

    fn prepare(&mut self) -> Result<(), Error> {
        self.work.prepare()
    }

    fn perform(&self, monitor: &dyn Monitor) -> Result<UnitResults, Error> {
        let begun = self.work.begin(monitor)?;
        let stages = begun.stages();
        let places = places(&stages);
        let (number, total) = (self.unit, places.len());
        Error::check_range("unit", number as u64, total as u64)?;
        let _lock = claim_beside_others(&self.work, &begun)?;
        let place = places[number - 1];
        let mut before = 0;
        for &other in places.iter().filter(|other| other.stage < place.stage) {
            before += usize::from(!begun.is_done(other)?);
        }
        if before > 0 {
            return Err(Error::Plan(format!(
                "{}: found {} of stages before that of unit {number} not done, wanted all done",
                self.work.out().display(),
                plural(before, "unit")
            )));
        }
        let stage = &stages[place.stage];
        let Unit { name, about, size } = stage.units[place.unit].clone();
        if !begun.is_done(place)? {
            if stage.pace != Pace::Nested {
                monitor.stage(&about, size);
            }
            begun.execute(place, monitor).map_err(|error| error.of_part(self.work.out()))?;
        }
        Ok(UnitResults { folder: self.work.out().to_owned(), number, total, unit: name, about })
    }
}

fn check_out(work: &impl Work) -> Result<(), Error> {
    if work.out().as_os_str().is_empty() {
        return Err(Error::Plan("`out` is missing: units of work lie in a folder".to_owned()));
    }
    Ok(())
}

fn places(stages: &[Stage]) -> Vec<Place> {
    let of_stage =
        |(stage, units): (usize, &Stage)| (0..units.units.len()).map(move |unit| Place { stage, unit });
    stages.iter().enumerate().flat_map(of_stage).collect()
}
