//! How a workflow reports what it is doing, and how it is asked to stop.

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};

use tropism::rig::Event;
use tropism::track::Sample;
use tropism_neat::Generation;

/// Listens to a workflow while it works.
///
/// Workflows call it from several threads. Every method passes on to [`next`](Self::next) unless it is implemented; without a
/// next monitor it does nothing.
pub trait Monitor: Sync {
    /// The monitor that hears what this one does not take itself.
    fn next(&self) -> Option<&dyn Monitor> {
        None
    }

    /// A stage begins that consists of `total` units of work (steps, generations, photographs).
    fn stage(&self, name: &str, total: u64) {
        self.next().iter().for_each(|next| next.stage(name, total));
    }

    /// `count` further units of the present stage are done.
    fn advance(&self, count: u64) {
        self.next().iter().for_each(|next| next.advance(count));
    }

    /// `count` units of the present stage were done before the workflow was resumed: they say nothing about the time left.
    fn skip(&self, count: u64) {
        self.next().iter().for_each(|next| next.skip(count));
    }

    /// The present state in a few words, such as `best 12.3, 8 species`.
    fn status(&self, text: &str) {
        self.next().iter().for_each(|next| next.status(text));
    }

    /// A line that a user should read.
    fn note(&self, line: &str) {
        self.next().iter().for_each(|next| next.note(line));
    }

    /// A generation of evolutionary run `run` is complete.
    fn generation(&self, run: u32, generation: &Generation) {
        self.next().iter().for_each(|next| next.generation(run, generation));
    }

    /// A step of an experiment is complete.
    fn sample(&self, sample: &Sample) {
        self.next().iter().for_each(|next| next.sample(sample));
    }

    /// An event of an experiment happened. It stands in the journal already, if the journal can still be written.
    fn event(&self, event: &Event) {
        self.next().iter().for_each(|next| next.event(event));
    }

    /// An experiment is alive: called at each step, and about twice a second while it waits for the next one.
    fn heartbeat(&self) {
        self.next().iter().for_each(|next| next.heartbeat());
    }

    /// An experiment has ended, well or not. Its alerts are still being delivered, for half a minute at most.
    fn closing(&self) {
        self.next().iter().for_each(|next| next.closing());
    }

    /// Whether the workflow may go on. After `false` it saves its state and returns
    /// [`Error::Interrupted`](crate::Error::Interrupted).
    fn may_go_on(&self) -> bool {
        self.next().is_none_or(Monitor::may_go_on)
    }

    /// [`may_go_on`](Self::may_go_on), as a loop that is watched wants to hear it.
    fn answer(&self) -> ControlFlow<()> {
        if self.may_go_on() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }
}

/// A monitor that listens to nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Monitor for Silent {}

/// The monitor of a workflow that is a part of another: the whole shows its own stages, the part advances them.
#[derive(Clone, Copy)]
pub struct Part<'a>(pub &'a dyn Monitor);

impl Monitor for Part<'_> {
    fn advance(&self, count: u64) {
        self.0.advance(count);
    }

    fn skip(&self, count: u64) {
        self.0.skip(count);
    }

    fn note(&self, line: &str) {
        self.0.note(line);
    }

    fn may_go_on(&self) -> bool {
        self.0.may_go_on()
    }
}

/// The monitor of a whole with many like parts: what several of them note is noted once.
pub(crate) struct NotedOnce<'a> {
    monitor: &'a dyn Monitor,
    noted: Mutex<BTreeSet<String>>,
}

impl<'a> NotedOnce<'a> {
    pub(crate) fn new(monitor: &'a dyn Monitor) -> Self {
        Self { monitor, noted: Mutex::default() }
    }
}

impl Monitor for NotedOnce<'_> {
    fn next(&self) -> Option<&dyn Monitor> {
        Some(self.monitor)
    }

    fn note(&self, line: &str) {
        // A thread that panicked between two notes leaves a set that can still be read.
        if self.noted.lock().unwrap_or_else(PoisonError::into_inner).insert(line.to_owned()) {
            self.monitor.note(line);
        }
    }
}

/// The monitor of a stage of a whole, such as `3/7`: its title stands before the names of the stage's own stages.
pub(crate) struct Titled<'a> {
    pub(crate) monitor: &'a dyn Monitor,
    pub(crate) title: String,
}

impl Monitor for Titled<'_> {
    fn next(&self) -> Option<&dyn Monitor> {
        Some(self.monitor)
    }

    fn stage(&self, name: &str, total: u64) {
        self.monitor.stage(&format!("{} {name}", self.title), total);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_parts_note_alike_is_told_once() {
        #[derive(Default)]
        struct Listener(Mutex<Vec<String>>);
        impl Monitor for Listener {
            fn note(&self, line: &str) {
                self.0.lock().unwrap().push(line.to_owned());
            }
        }
        let listener = Listener::default();
        let once = NotedOnce::new(&listener);
        for line in ["virtual", "slow", "virtual"] {
            Part(&once).note(line);
        }
        assert_eq!(*listener.0.lock().unwrap(), ["virtual", "slow"]);
    }
}
