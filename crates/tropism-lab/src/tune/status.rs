//! How far the search for a rule is, read from its file.

use std::path::{Path, PathBuf};

use serde::Serialize;
use tropism::task::Task;

use super::saved;
use crate::Error;
use crate::controller::ControllerSpec;
use crate::files::{self, FileError};

/// What a search for a rule does now.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TuneStatus {
    /// File of the rule.
    pub rule: PathBuf,
    /// Whether the rule is written.
    pub is_over: bool,
    /// Generations that are done; `None` if the search is over.
    pub generation: Option<usize>,
    /// Generations of the search; `None` if it is over.
    pub generations: Option<u32>,
    /// Unit of the fitness: `cm`, or `turns` round a pole.
    pub unit: &'static str,
    /// Best mean fitness of a rule in the last generation.
    pub best_fitness: Option<f64>,
    /// Seconds since a generation was saved last.
    pub saved_ago_s: Option<f64>,
}

/// The status of the search for the rule `out`; `None` if there is neither search nor file.
///
/// # Errors
/// [`Error`] if the search cannot be read, or the file is no rule.
pub(crate) fn status(out: &Path) -> Result<Option<TuneStatus>, Error> {
    let path = saved::path(out);
    let over = |is_over, task: Option<&Task>| TuneStatus {
        rule: out.to_owned(),
        is_over,
        generation: None,
        generations: None,
        unit: task.map_or("cm", |task| task.kind.unit()),
        best_fitness: None,
        saved_ago_s: None,
    };
    if !path.exists() {
        if !out.is_file() {
            return Ok(None);
        }
        return match ControllerSpec::read(out)? {
            rule @ ControllerSpec::Rule { .. } => Ok(Some(over(true, rule.own_task()))),
            other => {
                let found = other.description();
                let problem = format!(
                    "found the controller {found:?}, wanted a rule of `tune`, or the folder of other work"
                );
                Err(FileError::content(out, problem).into())
            }
        };
    }
    let (done, plan, best_fitness) = saved::read_progress(out)?;
    Ok(Some(TuneStatus {
        generation: Some(done),
        generations: Some(plan.search.generations),
        best_fitness,
        saved_ago_s: files::age_s(&path),
        ..over(false, Some(&plan.task))
    }))
}
