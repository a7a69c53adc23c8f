//! The journal of a run, followed while it is written: what is known is not read again.

use std::path::Path;

use tropism::rig::Event;
use tropism_lab::{Journal, JournalError, StepRecord, read_journal};

/// Hexadecimal digits of a photograph's SHA-256 in its address: enough to tell two photographs of one name apart.
pub(crate) const SHOWN_DIGITS: usize = 12;

/// Steps at the end of a run in which the lamp of the last decision is looked for. Chosen: the last step may have none.
const LAST: u32 = 10;

/// Steps and events of a run so far.
#[derive(Default)]
pub(crate) struct Tail {
    pub(crate) steps: Vec<StepRecord>,
    pub(crate) events: Vec<Event>,
}

impl Tail {
    /// Reads on: the number of steps that are as they were before. `None` if nothing can be read just now.
    pub(crate) fn read(&mut self, folder: &Path) -> Option<usize> {
        let path = folder.join("journal.sqlite");
        if let Ok(same) = self.follow(&path) {
            return Some(same);
        }
        // Damaged: its mirror may stand in.
        let read = match read_journal(folder) {
            // It has just begun.
            Err(_) if !path.exists() => Default::default(),
            read => read.ok()?,
        };
        (self.steps, self.events) = read;
        Some(0)
    }

    /// All events and the last steps of a run on which nobody works, as a list of runs needs them. Its journal is taken as it is:
    /// to check each entry of each of hundreds takes seconds. `None` if it cannot be read.
    pub(crate) fn end_of(folder: &Path) -> Option<Self> {
        let journal = Journal::follow(&folder.join("journal.sqlite")).ok()?;
        let end = journal.next_step().ok()?;
        let steps = journal.steps_in(end.saturating_sub(LAST)..end).ok()?;
        Some(Self { steps, events: journal.events().ok()? })
    }

    fn follow(&mut self, path: &Path) -> Result<usize, JournalError> {
        let journal = Journal::follow(path)?;
        // The last step may still change; the one before it shows whether this is still the same run.
        let mut same = self.steps.len().saturating_sub(2);
        let mut fresh = journal.steps_in(self.steps.get(same).map_or(0, |step| step.step)..u32::MAX)?;
        if !self.steps.is_empty() && fresh.first() != self.steps.get(same) {
            (self.steps, self.events, same) = (Vec::new(), Vec::new(), 0);
            fresh = journal.steps()?;
        }
        self.steps.truncate(same);
        self.steps.append(&mut fresh);
        self.events.extend(journal.events_after(self.events.len())?);
        Ok(same)
    }
}

/// The recorded step `number` of the run in `folder`.
pub(crate) fn step(folder: &Path, number: u32) -> Option<StepRecord> {
    let followed = Journal::follow(&folder.join("journal.sqlite"));
    let found = followed.and_then(|journal| journal.steps_in(number..number.saturating_add(1)));
    let found = found.ok().or_else(|| Some(read_journal(folder).ok()?.0))?;
    found.into_iter().find(|step| step.step == number)
}

#[cfg(test)]
mod tests {
    use tropism_lab::{RunConfig, RunPlan, Silent, Workflow};

    use super::*;

    fn run(folder: &Path, steps: u32, seed: u64) {
        let mut config = RunConfig::default();
        config.seed = seed;
        config.task.max_steps = steps;
        RunPlan { out: folder.to_owned(), config, ..RunPlan::default() }.execute(&Silent).unwrap();
    }

    #[test]
    fn what_is_followed_is_what_is_read_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let (one, other) = (folder.path().join("one"), folder.path().join("other"));
        let mut tail = Tail::default();
        assert_eq!(tail.read(&one), Some(0), "nothing yet");
        run(&one, 7, 1);
        let whole = read_journal(&one).unwrap();
        // As if the run had been followed from its third step on.
        for known in [0, 1, 2, 3, whole.0.len()] {
            let (steps, events) = (whole.0[..known].to_vec(), whole.1[..known.min(1)].to_vec());
            let mut tail = Tail { steps, events };
            assert_eq!(tail.read(&one), Some(known.saturating_sub(2)));
            assert_eq!((&tail.steps, &tail.events), (&whole.0, &whole.1), "{known}");
        }
        assert_eq!(step(&one, 3), Some(whole.0[3].clone()));
        assert_eq!(step(&one, 99), None);
        // Another run in the same folder.
        run(&other, 9, 2);
        tail.read(&one).unwrap();
        std::fs::remove_dir_all(&one).unwrap();
        std::fs::rename(&other, &one).unwrap();
        let whole = read_journal(&one).unwrap();
        assert_eq!(tail.read(&one), Some(0));
        assert_eq!((&tail.steps, &tail.events), (&whole.0, &whole.1));
    }
}
