//! The engine of long work: a folder with a record, and units in stages, which any number of programs may execute.
//!
//! A [`Work`] says what its record is, which units it has, what one of them does, and how results are collected from the
//! folder. The rest is said here once: who may work in a folder, what "the same work" means, what is done already, and three
//! ways to execute all: the threads of this program ([`Workflow::execute`]), a program for each unit ([`UnitPlan`]), and from
//! Python the workers of a cluster, each of which executes a [`UnitPlan`]. All come to the same bits.

mod claim;
mod drive;
mod unit;
mod status;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

pub(crate) use self::claim::check_same;
pub(crate) use self::drive::{perform, perform_in};
pub use self::status::{PartStatus, WorkStatus};
pub use self::unit::{ListedUnit, UnitPlan, UnitResults, units_of};
use crate::{Error, Monitor, Workflow, files};

/// A workflow that is long: it works in a folder, unit by unit, can be interrupted, and be shared among programs.
pub trait Work: Workflow {
    /// Its name as a workflow, in plans of programs: `sweep`.
    const WORKFLOW: &'static str;

    /// Its name with the article, as messages call it: `a sweep`.
    const NAME: &'static str;

    /// File in its folder with all that decides the results: `sweep.toml`.
    const RECORD: &'static str;

    /// Files in its folder that are written last, the one that says that it is over first. They are removed when it is extended.
    const RESULTS: &'static [&'static str];

    /// A plan at work.
    type Begun<'p>: Units
    where
        Self: 'p;

    /// Its folder.
    fn out(&self) -> &Path;

    /// The setting of the plan by which it may go on in a folder where it has begun.
    fn resume_mut(&mut self) -> &mut bool;

    /// Whether it may go on in a folder where it has begun.
    fn is_resumed(&self) -> bool {
        *self.clone().resume_mut()
    }

    /// The same plan, which may go on in a folder where it has begun.
    #[must_use]
    fn to_resume(mut self) -> Self {
        *self.resume_mut() = true;
        self
    }

    /// Its folder, and the files and folders that it reads.
    fn paths_mut(&mut self) -> Vec<&mut PathBuf>;

    /// The plan with paths that mean the same in each working folder. An address, such as `s3://bucket/sweep`, stays.
    ///
    /// # Errors
    /// [`Error`] if the working folder is not known.
    fn with_absolute_paths(mut self) -> Result<Self, Error> {
        for path in self.paths_mut() {
            if !path.to_string_lossy().contains("://") {
                *path = std::path::absolute(&path).map_err(Error::at(path.display()))?;
            }
        }
        Ok(self)
    }

    /// The plan that goes on with the work in `folder`, from what lies there alone.
    ///
    /// # Errors
    /// [`Error`] if there is none, or it cannot be read.
    fn of_folder(folder: &Path) -> Result<Self, Error>;

    /// How far the work in `folder` is, also while programs work in it.
    ///
    /// # Errors
    /// [`Error`] if its record or the lock cannot be read.
    fn status(folder: &Path) -> Result<WorkStatus, Error>;

    /// Reads what a checked and prepared plan needs to work.
    ///
    /// # Errors
    /// [`Error`] of a file, or of what it says.
    fn begin(&self, monitor: &dyn Monitor) -> Result<Self::Begun<'_>, Error>;

    /// Collects the results from the folder, when all units are done, and writes them there.
    ///
    /// # Errors
    /// [`Error`] of a file, or [`Error::Interrupted`].
    fn collect(&self, begun: &Self::Begun<'_>, monitor: &dyn Monitor) -> Result<Self::Results, Error>;
}

/// What a plan at work consists of.
pub trait Units: Sync {
    /// All that decides the results.
    ///
    /// # Errors
    /// [`Error`] if it cannot be written as text.
    fn record(&self) -> Result<Record, Error>;

    /// The stages in order.
    fn stages(&self) -> Vec<Stage>;

    /// Whether the unit at a place is done: the folder has what it makes.
    ///
    /// # Errors
    /// [`Error`] if what is there is of another work.
    fn is_done(&self, place: Place) -> Result<bool, Error>;

    /// Does the unit at a place, from where it was interrupted, and advances the stage by its size.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Interrupted`] if `monitor` asked for an end, after what was done is saved.
    fn execute(&self, place: Place, monitor: &dyn Monitor) -> Result<(), Error>;

    /// Is called where a whole work has reached a milestone: nothing by default.
    ///
    /// # Errors
    /// [`Error`] if it cannot write what it writes then.
    fn reached(&self, _milestone: &Milestone, _monitor: &dyn Monitor) -> Result<(), Error> {
        Ok(())
    }

    /// Whether a folder with the record `known` is of this work, though its text is another one: shorter, for example.
    fn extends(&self, _known: &str) -> bool {
        false
    }
}

/// What a whole work has reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Milestone {
    /// It begins, or goes on; its folder is there, and nobody else works in it.
    Begun,
    /// A stage has ended, well or not.
    StageEnded {
        /// Number of the stage, from 0.
        stage: usize,
        /// Wall-clock seconds that were spent on it just now.
        seconds: f64,
        /// Whether the stage is done.
        is_done: bool,
    },
}

/// All that decides the results of a work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// The text of the record.
    pub text: String,
    /// Files that it needs beside it, so that it can go on from its folder alone: their names and contents.
    pub beside: Vec<(&'static str, Vec<u8>)>,
}

impl Record {
    /// The record of a `work`: its content as TOML.
    pub(crate) fn of<W: Work>(work: &W, content: &impl Serialize) -> Result<Self, Error> {
        let text = files::toml_of(&work.out().join(W::RECORD), content)?;
        Ok(Self { text, beside: Vec::new() })
    }
}

/// A file that a work reads, as its record names it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// The file.
    pub file: PathBuf,
    /// SHA-256 of its content, in hexadecimal.
    sha256: String,
}

impl Input {
    /// # Errors
    /// [`Error::File`] if one cannot be read.
    pub(crate) fn all(paths: impl IntoIterator<Item = PathBuf>) -> Result<Vec<Self>, Error> {
        let input = |path: PathBuf| {
            let sha256 = files::sha256(&files::read(&path)?);
            // From wherever it goes on.
            let file = std::path::absolute(&path).map_err(Error::at(path.display()))?;
            Ok(Self { file, sha256 })
        };
        paths.into_iter().map(input).collect()
    }
}

/// Units that need nothing of each other, and all of the stages before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stage {
    /// What is done in it: `steering unseen beans`.
    pub name: String,
    /// How its units share the threads of a program.
    pub pace: Pace,
    /// Its units in the order in which they begin.
    pub units: Vec<Unit>,
}

/// How the units of a stage share the threads of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// Each takes one thread.
    Parallel,
    /// As many at once as there are threads, and each may use all of them.
    SideBySide,
    /// One after the other: each uses all threads.
    Sequential,
    /// One after the other: each is a workflow of its own, which uses all threads and shows its own stages.
    Nested,
}

/// What is done as a whole: by one program, in one place of the folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unit {
    /// Its name, different from all others of the work.
    pub name: String,
    /// What it does, in a few words.
    pub about: String,
    /// How far it advances its stage.
    pub size: u64,
}

impl Unit {
    /// A unit that advances its stage by 1.
    #[must_use]
    pub fn new(name: impl Into<String>, about: impl Into<String>) -> Self {
        Self { name: name.into(), about: about.into(), size: 1 }
    }
}

/// Which unit of a work is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Number of the stage, from 0.
    pub stage: usize,
    /// Number of the unit in the stage, from 0.
    pub unit: usize,
}
