//! What happens to a run, for those who are not there to see it.

use std::fmt;
use std::ops::ControlFlow;
use std::str::FromStr;

use crate::rig::Moment;

/// A kind of event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EventKind {
    /// The run begins.
    Started,
    /// The run goes on after an interruption.
    Resumed,
    /// The run was ended by its user before its task was over.
    Stopped,
    /// The run waits for its user: it has come to something that it must not decide.
    Paused,
    /// The task is over.
    Finished,
    /// A step began late, but within bounds.
    Late,
    /// Steps passed without a decision: without a photograph, or without a believed plant for too long.
    Missed,
    /// The camera gave no photograph: the last sighting stands in.
    Camera,
    /// A photograph was dark, and another one of the same step was taken.
    Dark,
    /// A photograph shows no plant that can be believed: the last sighting stands in.
    Held,
    /// The plant was not seen for so long that somebody should look.
    Lost,
    /// A lamp does not obey.
    Lamp,
    /// The photograph shows another lamp lit than was commanded.
    Mismatch,
    /// The camera was moved.
    Moved,
    /// What was wrong is right again.
    Recovered,
    /// The clock on the wall was set; the schedule is not moved by it.
    Clock,
    /// The computer is too hot or its supply too weak.
    Computer,
    /// The disk is full or nearly so.
    Disk,
    /// A file of the run is damaged or gone.
    Damaged,
}

impl EventKind {
    /// Every kind.
    pub const ALL: [Self; 19] = [
        Self::Started,
        Self::Resumed,
        Self::Stopped,
        Self::Paused,
        Self::Finished,
        Self::Late,
        Self::Missed,
        Self::Camera,
        Self::Dark,
        Self::Held,
        Self::Lost,
        Self::Lamp,
        Self::Mismatch,
        Self::Moved,
        Self::Recovered,
        Self::Clock,
        Self::Computer,
        Self::Disk,
        Self::Damaged,
    ];

    /// The word used in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Started => "started",
            Self::Resumed => "resumed",
            Self::Stopped => "stopped",
            Self::Paused => "paused",
            Self::Finished => "finished",
            Self::Late => "late",
            Self::Missed => "missed",
            Self::Camera => "camera",
            Self::Dark => "dark",
            Self::Held => "held",
            Self::Lost => "lost",
            Self::Lamp => "lamp",
            Self::Mismatch => "mismatch",
            Self::Moved => "moved",
            Self::Recovered => "recovered",
            Self::Clock => "clock",
            Self::Computer => "computer",
            Self::Disk => "disk",
            Self::Damaged => "damaged",
        }
    }

    /// Whether it says that the run begins, goes on or ends: the latest one of these is the state of a run.
    #[must_use]
    pub const fn is_state(self) -> bool {
        matches!(self, Self::Started | Self::Resumed | Self::Stopped | Self::Paused | Self::Finished)
    }
}

impl fmt::Display for EventKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for EventKind {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|kind| kind.name() == word).ok_or_else(|| {
            let names = Self::ALL.map(Self::name);
            format!("found event {word:?}, wanted one of {}", names.join(", "))
        })
    }
}

/// Something that happened to a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The step that was the latest one then; 0 before there was one.
    pub step: u32,
    /// What kind of thing happened.
    pub kind: EventKind,
    /// What was found and what was done about it, in one line.
    pub text: String,
    /// When; `None` in the virtual tent.
    pub at: Option<Moment>,
}

/// Something that may harm a run and that it cannot see by itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HealthProblem {
    /// What it is with, the same as long as it lasts: `temperature`.
    pub what: &'static str,
    /// What was found.
    pub text: String,
}

/// Somebody who watches over a run: tells people, feeds a watchdog, asks for an end.
pub trait RunMonitor {
    /// Something happened. It stands in the journal already, if the journal can still be written.
    fn event(&mut self, event: &Event);

    /// What is wrong with the computer now; asked at each step.
    fn health(&mut self) -> Vec<HealthProblem> {
        Vec::new()
    }

    /// The run is alive: told at each step, and about twice a second while the next one is waited for. `Break` asks for
    /// an orderly end, at once.
    fn heartbeat(&mut self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Each of them; any one may ask for an end.
impl RunMonitor for Vec<Box<dyn RunMonitor + '_>> {
    fn event(&mut self, event: &Event) {
        self.iter_mut().for_each(|watcher| watcher.event(event));
    }

    fn health(&mut self) -> Vec<HealthProblem> {
        self.iter_mut().flat_map(RunMonitor::health).collect()
    }

    fn heartbeat(&mut self) -> ControlFlow<()> {
        let asked: Vec<_> = self.iter_mut().map(RunMonitor::heartbeat).collect();
        if asked.iter().any(ControlFlow::is_break) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

impl<T: RunMonitor + ?Sized> RunMonitor for Box<T> {
    fn event(&mut self, event: &Event) {
        (**self).event(event);
    }

    fn health(&mut self) -> Vec<HealthProblem> {
        (**self).health()
    }

    fn heartbeat(&mut self) -> ControlFlow<()> {
        (**self).heartbeat()
    }
}

/// Nobody.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoMonitor;

impl RunMonitor for NoMonitor {
    fn event(&mut self, _event: &Event) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_as_they_are_written() {
        for kind in EventKind::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
        }
        let error = "faild".parse::<EventKind>().unwrap_err();
        assert!(error.contains("found event \"faild\", wanted one of started, resumed"), "{error}");
    }

    #[test]
    fn one_of_many_watchers_is_enough_to_end_a_run_and_all_are_asked() {
        struct Counting(std::rc::Rc<std::cell::Cell<u32>>, bool);
        impl RunMonitor for Counting {
            fn event(&mut self, _event: &Event) {
                self.0.set(self.0.get() + 1);
            }
            fn heartbeat(&mut self) -> ControlFlow<()> {
                self.0.set(self.0.get() + 10);
                if self.1 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            }
        }
        let count = std::rc::Rc::default();
        let watcher = |asks| Box::new(Counting(std::rc::Rc::clone(&count), asks)) as Box<dyn RunMonitor>;
        let mut all = vec![watcher(true), watcher(false)];
        assert!(all.heartbeat().is_break());
        let event = Event { step: 3, kind: EventKind::Lamp, text: "left lamp: silent".to_owned(), at: None };
        all.event(&event);
        assert_eq!(count.get(), 22);
    }
}
