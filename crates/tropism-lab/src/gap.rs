//! How long nobody looked after a run.

use std::time::Duration;

use crate::journal::{Journal, JournalError};
use tropism::rig::{Boot, Moment};

/// What the clocks say of the time between the last sign of a run and now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gap {
    /// The run has not begun: there is none.
    New,
    /// So long, and the experiment is so old now.
    Known {
        /// Since the last sign.
        away: Duration,
        /// Since the start of the experiment.
        since_start: Duration,
    },
    /// The computer was started meanwhile and its clock on the wall is not known to be right: nobody knows. The last
    /// sign was when the experiment was so old.
    Unknown {
        /// Since the start of the experiment.
        last: Duration,
    },
}

impl Gap {
    /// How long nobody looked after the run of `journal`, if the clocks show `boot_s` seconds on the clock of the boot
    /// `boot_id`, and `unix_s` on the wall, which is known to be right or not.
    ///
    /// The same boot is told by its clock. Another one is told by the clock on the wall, if that was right both times.
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
            return Ok(Self::New);
        };
        let last = last.unwrap_or(Moment { since_start: Duration::ZERO, unix_s });
        let seconds = |value: f64| Duration::try_from_secs_f64(value.max(0.0)).unwrap_or_default();
        if id == boot_id {
            let since_start = seconds(boot_s - start_s);
            return Ok(Self::Known { away: since_start.saturating_sub(last.since_start), since_start });
        }
        if !(is_wall_set && was_set) || unix_s < last.unix_s {
            return Ok(Self::Unknown { last: last.since_start });
        }
        let away = seconds(unix_s - last.unix_s);
        Ok(Self::Known { away, since_start: last.since_start + away })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tropism::rig::Durability;
    use tropism::rig::{Event, EventKind};

    const HOUR: f64 = 3600.0;

    /// An experiment that began at 100 s on the clock of the boot "a", and whose last sign was an hour later.
    fn journal(is_wall_set: bool) -> (tempfile::TempDir, Journal) {
        let folder = tempfile::tempdir().unwrap();
        let journal = Journal::open(&folder.path().join("journal.sqlite"), Durability::Fast).unwrap();
        assert_eq!(Gap::of(&journal, "a", 1.0, 1e9, true).unwrap(), Gap::New);
        journal.taken_up(&Boot { id: "a".to_owned(), start_s: 100.0, is_wall_set }).unwrap();
        let sign = Moment { since_start: Duration::from_secs(3600), unix_s: 1e9 };
        let event = Event { step: 12, kind: EventKind::Started, text: String::new(), at: Some(sign) };
        journal.happened(&event).unwrap();
        (folder, journal)
    }

    #[test]
    fn within_a_boot_its_clock_counts_whatever_the_wall_says() {
        let (_folder, journal) = journal(true);
        let known = Gap::Known { away: Duration::from_secs(600), since_start: Duration::from_secs(4200) };
        for unix_s in [1e9 + 600.0, 0.0, 1e9 - 10.0 * HOUR, 2e9] {
            assert_eq!(Gap::of(&journal, "a", 4300.0, unix_s, false).unwrap(), known);
        }
    }

    #[test]
    fn across_boots_the_wall_counts_if_it_was_right_both_times() {
        let known = Gap::Known { away: Duration::from_secs(600), since_start: Duration::from_secs(4200) };
        let unknown = Gap::Unknown { last: Duration::from_secs(3600) };
        for (was_set, is_set, later_s, wanted) in [
            (true, true, 600.0, known),
            (true, false, 600.0, unknown),
            (false, true, 600.0, unknown),
            (true, true, -1.0, unknown),
        ] {
            let (_folder, journal) = journal(was_set);
            assert_eq!(Gap::of(&journal, "b", 7.0, 1e9 + later_s, is_set).unwrap(), wanted);
        }
    }
}
