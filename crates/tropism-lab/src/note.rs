//! The workflow `note`: writes down what was done to a plant, or seen of it, in the journal of its run.

use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::folder::FolderError;
use crate::lock::{LockError, holder};
use crate::monitor::Monitor;
use crate::notes::{self, Note};
use crate::run::RunConfig;
use crate::workflow::Workflow;

/// A note about a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NotePlan {
    /// Run folder; the run may go on.
    pub run: PathBuf,
    /// What happened, in one line of at most 500 letters.
    pub text: String,
    /// The step that it is about; the latest one if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<u32>,
}

/// A note that was left.
#[derive(Clone, Debug, Serialize)]
pub struct NoteResults {
    /// Run folder.
    pub run: PathBuf,
    /// Step that it stands at; `None` while the run has not written it down.
    pub step: Option<u32>,
    /// Number of the process of the run, which writes it down within seconds; `None` where it stands in the journal.
    pub process: Option<u32>,
}

/// The longest note, in letters: chosen, a few lines on a page.
const MOST_LETTERS: usize = 500;

impl Workflow for NotePlan {
    type Results = NoteResults;
    const SCHEMA: &'static str = "tropism.note/1";

    fn check(&self) -> Result<(), Error> {
        let letters = self.text.trim().chars().count();
        if !(1..=MOST_LETTERS).contains(&letters) {
            return Err(Error::Plan(format!("`text`: found {letters} letters, wanted 1 to {MOST_LETTERS}")));
        }
        if self.text.trim().chars().any(char::is_control) {
            return Err(Error::Plan("`text` has several lines: write one".to_owned()));
        }
        Ok(())
    }

    fn perform(&self, _monitor: &dyn Monitor) -> Result<NoteResults, Error> {
        // A folder that is no run gets no note.
        let config = RunConfig::read(&self.run)?;
        let unix_s = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64());
        notes::leave(&self.run, &Note { text: self.text.trim().to_owned(), step: self.step, unix_s })?;
        let results = |step, process| NoteResults { run: self.run.clone(), step, process };
        match config.open_folder(&self.run, true) {
            Ok(folder) => {
                let taken = notes::take(folder.path(), folder.journal())?;
                Ok(results(taken.last().map(|event| event.step), None))
            }
            Err(Error::Folder(FolderError::Lock(LockError::InUse { process, .. }))) => {
                Ok(results(None, process.or(holder(&self.run)?)))
            }
            Err(error) => Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::Silent;
    use crate::report::ReportPlan;
    use crate::run::RunPlan;
    use crate::{files, read_journal};

    fn note(run: &std::path::Path, text: &str, step: Option<u32>) -> Result<NoteResults, Error> {
        NotePlan { run: run.to_owned(), text: text.to_owned(), step }.execute(&Silent)
    }

    #[test]
    fn a_note_stands_in_the_journal_of_a_run_that_is_over_or_goes_on_and_in_its_report() {
        let folder = tempfile::tempdir().unwrap();
        let run = folder.path().join("run");
        let mut config = RunConfig::default();
        config.task.max_steps = 6;
        let plan = RunPlan { out: run.clone(), config, ..RunPlan::default() };
        plan.execute(&Silent).unwrap();
        let (steps, before) = read_journal(&run).unwrap();
        assert_eq!(note(&run, " watered ", None).unwrap().step, steps.last().map(|step| step.step));
        assert_eq!(note(&run, "pot moved", Some(2)).unwrap().step, Some(2));
        // While another program has the folder a note waits, and the next one takes it with itself.
        {
            let _held = crate::lock(&run).unwrap();
            let left = note(&run, "turned", Some(3)).unwrap();
            assert_eq!((left.step, left.process), (None, Some(std::process::id())));
        }
        note(&run, "last", Some(4)).unwrap();
        let (_, after) = read_journal(&run).unwrap();
        let noted: Vec<_> = after[before.len()..].iter().map(|event| (&*event.text, event.step)).collect();
        assert_eq!(noted, [("watered", 6), ("pot moved", 2), ("turned", 3), ("last", 4)]);
        let out = folder.path().join("report.html");
        ReportPlan { sources: vec![run.clone()], out: out.clone(), figures: None }.execute(&Silent).unwrap();
        let page = files::read_text(&out).unwrap();
        assert!(page.contains("pot moved") && page.contains("Dotted lines are notes"));
        // It is still the same run.
        RunPlan { resume: true, ..plan }.execute(&Silent).unwrap();

        let long = "a".repeat(501);
        for (text, problem) in
            [("  ", "found 0 letters"), ("a\nb", "several lines"), (&*long, "found 501 letters")]
        {
            assert!(note(&run, text, None).unwrap_err().to_string().contains(problem), "{text}");
        }
        assert!(note(folder.path(), "no run", None).is_err());
    }
}
