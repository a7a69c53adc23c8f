//! Events of a run, and the monitor that hears of them.

use std::fmt;
use std::ops::ControlFlow;
use std::str::FromStr;

use crate::rig::Moment;

/// A kind of event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EventKind {
    /// The run began.
    Started,
    /// The run was resumed after an interruption.
    Resumed,
    /// The user ended the run before its task was over.
    Stopped,
    /// The run waits for its user, who must decide how it goes on.
    Paused,
    /// The task is over.
    Finished,
    /// An error ended the run.
    Fault,
    /// A step began late, but within the tolerance.
    Late,
    /// Steps passed without a decision: without a photograph, or with a plant that was not detected for too long.
    Missed,
    /// The camera gave no photograph: the last tip is carried forward.
    Camera,
    /// A photograph was dark, and was taken again at the same step.
    Dark,
    /// The plant was not detected in a photograph: the last tip is carried forward.
    CarriedForward,
    /// The plant was not detected for so many steps that a person should look.
    Lost,
    /// A lamp did not obey.
    Lamp,
    /// The photograph shows another lamp lit than was commanded.
    Mismatch,
    /// The camera was moved.
    Moved,
    /// A fault that was reported is over.
    Recovered,
    /// The wall clock was set. It does not move the schedule.
    Clock,
    /// The host computer is too hot, or its supply is too weak.
    Computer,
    /// The disk is full.
    Disk,
    /// A file of the run is damaged or missing.
    Damaged,
    /// A person wrote down what was done to the plant or seen of it.
    Note,
}

impl EventKind {
    /// Every kind.
    pub const ALL: [Self; 21] = [
        Self::Started,
        Self::Resumed,
        Self::Stopped,
        Self::Paused,
        Self::Finished,
        Self::Fault,
        Self::Late,
        Self::Missed,
        Self::Camera,
        Self::Dark,
        Self::CarriedForward,
        Self::Lost,
        Self::Lamp,
        Self::Mismatch,
        Self::Moved,
        Self::Recovered,
        Self::Clock,
        Self::Computer,
        Self::Disk,
        Self::Damaged,
        Self::Note,
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
            Self::Fault => "fault",
            Self::Late => "late",
            Self::Missed => "missed",
            Self::Camera => "camera",
            Self::Dark => "dark",
            Self::CarriedForward => "carried_forward",
            Self::Lost => "lost",
            Self::Lamp => "lamp",
            Self::Mismatch => "mismatch",
            Self::Moved => "moved",
            Self::Recovered => "recovered",
            Self::Clock => "clock",
            Self::Computer => "computer",
            Self::Disk => "disk",
            Self::Damaged => "damaged",
            Self::Note => "note",
        }
    }

    /// Whether it begins, resumes or ends a run: the latest of these is the state of the run.
    #[must_use]
    pub const fn is_state(self) -> bool {
        matches!(
            self,
            Self::Started | Self::Resumed | Self::Stopped | Self::Paused | Self::Finished | Self::Fault
        )
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

/// An event of a run, as its journal records it.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The latest step at that time; 0 before the first.
    pub step: u32,
    /// Kind of event.
    pub kind: EventKind,
    /// What was found and what was done about it, in one line.
    pub text: String,
    /// When it happened; `None` in the virtual tent.
    pub at: Option<Moment>,
}

/// A problem of the host computer that may harm a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HealthProblem {
    /// Name of the problem, the same as long as it lasts, such as `temperature`.
    pub what: &'static str,
    /// What was found.
    pub text: String,
}

/// Listens to a run: alerts people, feeds a watchdog, reports the health of the host, asks for an end.
pub trait RunMonitor {
    /// Hears of an event. It stands in the journal already, if the journal can still be written.
    fn event(&mut self, event: &Event);

    /// The problems of the host computer now. Called at each step.
    fn health(&mut self) -> Vec<HealthProblem> {
        Vec::new()
    }

    /// Hears that the run is alive: at each step, and about twice a second while it waits for the next. `Break` asks for an
    /// orderly end at once.
    fn heartbeat(&mut self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// All of them hear of everything, and each may ask for an end.
impl RunMonitor for Vec<Box<dyn RunMonitor + '_>> {
    fn event(&mut self, event: &Event) {
        self.iter_mut().for_each(|monitor| monitor.event(event));
    }

    fn health(&mut self) -> Vec<HealthProblem> {
        self.iter_mut().flat_map(RunMonitor::health).collect()
    }

    fn heartbeat(&mut self) -> ControlFlow<()> {
        let answers: Vec<_> = self.iter_mut().map(RunMonitor::heartbeat).collect();
        if answers.iter().any(ControlFlow::is_break) {
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

/// A monitor that does nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoMonitor;

impl RunMonitor for NoMonitor {
    fn event(&mut self, _event: &Event) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_comes_back_from_its_name() {
        for kind in EventKind::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
        }
        let error = "faild".parse::<EventKind>().unwrap_err();
        assert!(error.contains("found event \"faild\", wanted one of started, resumed"), "{error}");
    }

    #[test]
    fn one_of_many_monitors_is_enough_to_end_a_run_and_all_are_asked() {
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
        let monitor = |asks| Box::new(Counting(std::rc::Rc::clone(&count), asks)) as Box<dyn RunMonitor>;
        let mut all = vec![monitor(true), monitor(false)];
        assert!(all.heartbeat().is_break());
        let event = Event { step: 3, kind: EventKind::Lamp, text: "left lamp: silent".to_owned(), at: None };
        all.event(&event);
        assert_eq!(count.get(), 22);
    }
}
