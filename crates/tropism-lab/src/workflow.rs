//! The shape of every workflow: a plan goes in, results come out, a monitor listens.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::Error;
use crate::monitor::Monitor;

/// A plan that can be executed.
///
/// A plan is data: its default is the paper, and it holds all that decides the results. A command, a page and a notebook
/// that do the same thing exchange the same JSON.
pub trait Workflow: Clone + Serialize + DeserializeOwned {
    /// What comes out.
    type Results: Serialize;

    /// Name and version of the JSON of plan and results, such as `tropism.fit/1`.
    const SCHEMA: &'static str;

    /// Checks the plan before any work begins.
    ///
    /// # Errors
    /// [`Error::Plan`] names the key, its value and its range.
    fn check(&self) -> Result<(), Error>;

    /// Draws what a checked plan leaves to its seed, such as random targets.
    ///
    /// # Errors
    /// [`Error`] if a file of the plan cannot be read, or nothing that fits can be drawn.
    fn prepare(&mut self) -> Result<(), Error> {
        Ok(())
    }

    /// Does the work of a plan that is checked and prepared. Callers want [`execute`](Self::execute).
    ///
    /// # Errors
    /// [`Error`]; [`Error::Interrupted`] if `monitor` asked for an end, after what was done is saved.
    fn perform(&self, monitor: &dyn Monitor) -> Result<Self::Results, Error>;

    /// Executes the plan: checks it, prepares a copy and does the work.
    ///
    /// # Errors
    /// As [`check`](Self::check), [`prepare`](Self::prepare) and [`perform`](Self::perform), whichever fails first.
    fn execute(&self, monitor: &dyn Monitor) -> Result<Self::Results, Error> {
        self.check()?;
        let mut plan = self.clone();
        plan.prepare()?;
        plan.perform(monitor)
    }
}
