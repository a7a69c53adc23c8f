//! How long no program looked after a run.

use std::time::Duration;

use tropism::rig::{Boot, Moment};

use super::{Journal, JournalError};

/// The time between the last moment in a journal and now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Downtime {
    /// The run has not begun.
    NotBegun,
    /// The clocks tell.
    Known {
        /// Time since the last moment in the journal.
        length: Duration,
        /// Time since the start of the experiment.
        since_start: Duration,
    },
    /// The computer was restarted in between, and its wall clock was not known to be right before or is not now.
    Unknown {
        /// The last moment in the journal, since the start of the experiment.
        last: Duration,
    },
}

impl Downtime {
    /// The downtime of the run of `journal`, if the boot `boot_id` is `boot_s` seconds old and the wall clock shows `unix_s`
    /// seconds since 1970, known to be right or not.
    ///
    /// Within a boot the clock of the boot counts. Across boots the wall clock counts, if it was known to be right both
    /// times.
    ///
    /// # Errors
    /// [`JournalError`] if the journal cannot be read.
    pub fn of(
        journal: &Journal,
        boot_id: &str,
        boot_s: f64,
        unix_s: f64,
        is_wall_set: bool,
    ) -> Result<Self, JournalError> {
        let (Some(Boot { id, start_s, is_wall_set: was_set }), last) =
            (journal.latest_boot()?, journal.latest_moment()?)
        else {
            return Ok(Self::NotBegun);
        };
        let last = last.unwrap_or(Moment { since_start: Duration::ZERO, unix_s });
        let seconds = |value: f64| Duration::try_from_secs_f64(value.max(0.0)).unwrap_or_default();
        if id == boot_id {
            let since_start = seconds(boot_s - start_s);
            return Ok(Self::Known { length: since_start.saturating_sub(last.since_start), since_start });
        }
        if !(is_wall_set && was_set) || unix_s < last.unix_s {
            return Ok(Self::Unknown { last: last.since_start });
        }
        let length = seconds(unix_s - last.unix_s);
        Ok(Self::Known { length, since_start: last.since_start + length })
    }
}

#[cfg(test)]
mod tests {
    use tropism::rig::{Durability, Event, EventKind};

    use super::*;

    const HOUR: f64 = 3600.0;

    /// An experiment that began at 100 s on the clock of the boot "a", and whose last moment was an hour later.
    fn journal(is_wall_set: bool) -> (tempfile::TempDir, Journal) {
        let folder = tempfile::tempdir().unwrap();
        let journal = Journal::open(&folder.path().join("journal.sqlite"), Durability::Fast, "").unwrap();
        assert_eq!(Downtime::of(&journal, "a", 1.0, 1e9, true).unwrap(), Downtime::NotBegun);
        journal.record_boot(&Boot { id: "a".to_owned(), start_s: 100.0, is_wall_set }).unwrap();
        let last = Moment { since_start: Duration::from_secs(3600), unix_s: 1e9 };
        let event = Event { step: 12, kind: EventKind::Started, text: String::new(), at: Some(last) };
        journal.record_event(&event).unwrap();
        (folder, journal)
    }

    #[test]
    fn within_a_boot_its_clock_counts_whatever_the_wall_clock_shows() {
        let (_folder, journal) = journal(true);
        let known =
            Downtime::Known { length: Duration::from_secs(600), since_start: Duration::from_secs(4200) };
        for unix_s in [1e9 + 600.0, 0.0, 1e9 - 10.0 * HOUR, 2e9] {
            assert_eq!(Downtime::of(&journal, "a", 4300.0, unix_s, false).unwrap(), known);
        }
    }

    #[test]
    fn across_boots_the_wall_clock_counts_if_it_was_right_both_times() {
        let known =
            Downtime::Known { length: Duration::from_secs(600), since_start: Duration::from_secs(4200) };
        let unknown = Downtime::Unknown { last: Duration::from_secs(3600) };
        for (was_set, is_set, later_s, wanted) in [
            (true, true, 600.0, known),
            (true, false, 600.0, unknown),
            (false, true, 600.0, unknown),
            (true, true, -1.0, unknown),
        ] {
            let (_folder, journal) = journal(was_set);
            assert_eq!(Downtime::of(&journal, "b", 7.0, 1e9 + later_s, is_set).unwrap(), wanted);
        }
    }
}
