//! A search that is not over: its plan, and the fitness of all that it tried, in a file beside the rule.
//!
//! The first line is the [`Head`]; each further line holds the scores that the search asked for at once, in order. A search is
//! decided by its scores: given those of before it asks for the same next ones. The last line of a search that was killed may
//! be torn, and is left out.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::TunePlan;
use crate::difference::differences;
use crate::files::{self, FileError};
use crate::{Error, Monitor};

const SCHEMA: &str = "tropism.rule-search/1";

/// The first line of the file: all that decides the search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Head {
    schema: String,
    version: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    model_sha256: Option<String>,
    plan: TunePlan,
}

/// The file of the search for the rule `out`: `rule.search.jsonl` beside `rule.json`.
pub(super) fn path(out: &Path) -> PathBuf {
    out.with_extension("search.jsonl")
}

/// The plan of the search for the rule `out`.
pub(super) fn read_plan(out: &Path) -> Result<TunePlan, Error> {
    Ok(read(out)?.0.plan)
}

/// Generations that are done of the search for the rule `out`, its plan, and the best mean fitness of a rule in its last
/// generation, in cm.
pub(super) fn read_progress(out: &Path) -> Result<(usize, TunePlan, Option<f64>), Error> {
    let (head, batches) = read(out)?;
    let lists = head.plan.search.lists().zip(&batches);
    let generations: Vec<&Vec<f64>> = lists.filter_map(|(is_one, scores)| is_one.then_some(scores)).collect();
    let means = generations.last().map(|scores| {
        let plants = scores.chunks(head.plan.search.episodes as usize);
        plants.map(|own| own.iter().sum::<f64>() / own.len() as f64).fold(f64::NEG_INFINITY, f64::max)
    });
    Ok((generations.len(), head.plan, means))
}

fn read(out: &Path) -> Result<(Head, Vec<Vec<f64>>), Error> {
    let path = path(out);
    if !path.exists() && out.exists() {
        return Err(Error::Plan(format!(
            "{}: the search of this rule is over: there is nothing to go on with",
            out.display()
        )));
    }
    let text = files::read_text(&path)?;
    let mut lines = text.split_inclusive('\n').filter(|line| line.ends_with('\n'));
    let damaged =
        |what: &str| FileError::content(&path, format!("found {what}, wanted a search as `tune` saves it"));
    let head = lines.next().ok_or_else(|| damaged("no whole line"))?;
    let head: Head = serde_json::from_str(head).map_err(|error| damaged(&format!("in line 1: {error}")))?;
    if head.schema != SCHEMA {
        return Err(damaged(&format!("schema {:?}", head.schema)).into());
    }
    let scores = (2..).zip(lines).map(|(number, line)| {
        serde_json::from_str(line).map_err(|error| damaged(&format!("in line {number}: {error}")))
    });
    Ok((head, scores.collect::<Result<_, _>>()?))
}

/// The file of a search at work.
pub(super) struct SavedSearch {
    path: PathBuf,
    state: RefCell<State>,
}

struct State {
    /// Scores that were found before.
    known: VecDeque<Vec<f64>>,
    file: File,
    /// Why the file cannot be written any more.
    failed: Option<FileError>,
}

impl SavedSearch {
    /// The file of the search that `plan` says: as it is if it is to go on, else a new one where there is none.
    pub(super) fn begin(plan: &TunePlan, model_sha256: Option<String>) -> Result<Self, Error> {
        let path = path(&plan.out);
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let plan_alone = TunePlan { replace: false, resume: false, ..plan.clone() };
        let head = Head { schema: SCHEMA.to_owned(), version, model_sha256, plan: plan_alone };
        let json = |error: serde_json::Error| FileError::content(&path, error.to_string());
        if !plan.resume && path.exists() {
            return Err(Error::Plan(format!(
                "{}: an interrupted search is here: go on with it by `resume`, or remove it to begin anew",
                path.display()
            )));
        }
        let known = if path.exists() {
            let (mut found, known) = read(&plan.out)?;
            // Neither where the files lie now nor where they lay before decides anything.
            found.plan.out.clone_from(&head.plan.out);
            found.plan.model.clone_from(&head.plan.model);
            if found != head {
                let [found, wanted] = [&found, &head].map(serde_json::to_value);
                let differences = differences(&found.map_err(json)?, &wanted.map_err(json)?);
                return Err(Error::Plan(format!(
                    "{}: a search with other settings is here{}: go on with those, or remove it to begin anew",
                    path.display(),
                    differences.replace("`plan.", "`")
                )));
            }
            known
        } else {
            Vec::new()
        };
        // Written anew: the last line may be torn.
        let line = |value: String| value + "\n";
        let mut text = line(serde_json::to_string(&head).map_err(json)?);
        for scores in &known {
            text += &line(serde_json::to_string(scores).map_err(json)?);
        }
        files::write(&path, text.as_bytes())?;
        let file = File::options().append(true).open(&path).map_err(files::disk("write", &path))?;
        Ok(Self { path, state: RefCell::new(State { known: known.into(), file, failed: None }) })
    }

    /// The next `count` scores: those that were found before, or what `find` finds, which is saved.
    pub(super) fn scores(
        &self,
        count: usize,
        find: impl FnOnce() -> Vec<f64>,
        monitor: &dyn Monitor,
    ) -> Vec<f64> {
        let known = self.state.borrow_mut().known.pop_front();
        if let Some(known) = known.filter(|known| known.len() == count) {
            return known;
        }
        let found = find();
        // Of an interrupted search some may be left out.
        if monitor.may_go_on() {
            self.save(&found);
        }
        found
    }

    fn save(&self, scores: &[f64]) {
        let mut state = self.state.borrow_mut();
        let line = serde_json::to_string(scores).expect("numbers are always written") + "\n";
        if state.failed.is_none() {
            state.failed =
                state.file.write_all(line.as_bytes()).map_err(files::disk("write", &self.path)).err();
        }
    }

    pub(super) fn has_failed(&self) -> bool {
        self.state.borrow().failed.is_some()
    }

    /// Ends the search, with the error of its file if there is one.
    pub(super) fn end(self) -> Result<(), FileError> {
        self.state.into_inner().failed.map_or(Ok(()), Err)
    }
}
