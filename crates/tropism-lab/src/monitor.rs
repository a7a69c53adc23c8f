//! How a workflow tells what it is doing, and how it is asked to stop.

use std::ops::ControlFlow;

use tropism::rig::Event;
use tropism::track::Sample;
use tropism_neat::Generation;

/// Listens to a workflow while it works.
///
/// Workflows call it from several threads. Every method does nothing unless it is implemented.
pub trait Monitor: Sync {
    /// A stage begins that consists of `total` units of work (steps, generations, photographs).
    fn stage(&self, _name: &str, _total: u64) {}

    /// `count` further units of the present stage are done.
    fn advance(&self, _count: u64) {}

    /// `count` units of the present stage were done before the workflow was resumed: they say nothing about the time left.
    fn skip(&self, _count: u64) {}

    /// The present state in a few words, such as `best 12.3, 8 species`.
    fn status(&self, _text: &str) {}

    /// A line that a user should read.
    fn note(&self, _line: &str) {}

    /// A generation of evolutionary run `run` is complete.
    fn generation(&self, _run: u32, _generation: &Generation) {}

    /// A step of an experiment is complete.
    fn sample(&self, _sample: &Sample) {}

    /// An event of an experiment happened. It stands in the journal already, if the journal can still be written.
    fn event(&self, _event: &Event) {}

    /// An experiment is alive: called at each step, and about twice a second while it waits for the next one.
    fn heartbeat(&self) {}

    /// An experiment has ended, well or not. Its alerts are still being delivered, for half a minute at most.
    fn closing(&self) {}

    /// Whether the workflow may go on. After `false` it saves its state and returns
    /// [`Error::Interrupted`](crate::Error::Interrupted).
    fn may_go_on(&self) -> bool {
        true
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
