//! Notes that people leave beside a run, until the program that has its journal writes them down.
//!
//! A journal has one writer. A note is a small file in `notes/` of the run folder; the run takes it into its journal within
//! seconds, and where nothing runs, who leaves it does so at once.

use std::path::Path;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tropism::rig::{Event, EventKind, Moment};
use tropism_rig::secret::shown;

use crate::files::{self, FileError};
use crate::journal::{Journal, JournalError};

/// Folder of the notes that wait.
const FOLDER: &str = "notes";

/// A note that waits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Note {
    pub(crate) text: String,
    /// The step that it is about; the latest at its time if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) step: Option<u32>,
    /// When it was left, in seconds since 1970.
    pub(crate) unix_s: f64,
}

/// Leaves a note in the run folder `run`.
pub(crate) fn leave(run: &Path, note: &Note) -> Result<(), FileError> {
    let folder = run.join(FOLDER);
    files::make_folder(&folder)?;
    // Names in the order of time; two programs never write the same.
    let name = format!("{:016.0}-{}.json", 1e6 * note.unix_s, std::process::id());
    let text = serde_json::to_string(note).expect("a note is data");
    files::write(&folder.join(name), text.as_bytes())
}

/// Takes the notes that wait in the run folder `run` into its `journal`: what was recorded. One that cannot be read stays.
pub(crate) fn take(run: &Path, journal: &Journal) -> Result<Vec<Event>, JournalError> {
    // A folder that is not there, as in nearly every step of every run, costs one call.
    let Ok(mut paths) = files::list(&run.join(FOLDER), "json") else { return Ok(Vec::new()) };
    paths.sort_unstable();
    let mut taken = Vec::new();
    for path in paths {
        let Ok(note) = files::read_as(&path, |text| serde_json::from_str::<Note>(text)) else { continue };
        let event = event(&note, journal)?;
        // A program that was killed before it deleted the file has recorded it already.
        if !journal.events()?.contains(&event) {
            journal.record_event(&event)?;
            taken.push(event);
        }
        let _ = std::fs::remove_file(&path);
    }
    Ok(taken)
}

fn event(note: &Note, journal: &Journal) -> Result<Event, JournalError> {
    let steps = journal.steps()?;
    let (step, at) = match note.step {
        Some(number) => {
            let about = steps.iter().rfind(|step| step.step <= number);
            (number, about.and_then(|step| step.begun))
        }
        None => {
            let is_before = |begun: Option<Moment>| begun.is_none_or(|begun| begun.unix_s <= note.unix_s);
            let about = steps.iter().rfind(|step| is_before(step.begun));
            let at = journal.latest_moment()?.map(|last| {
                let since_start_s = last.since_start.as_secs_f64() + note.unix_s - last.unix_s;
                Moment { since_start: Duration::from_secs_f64(since_start_s.max(0.0)), unix_s: note.unix_s }
            });
            (about.map_or(0, |step| step.step), at)
        }
    };
    Ok(Event { step, kind: EventKind::Note, text: shown(&note.text), at })
}
