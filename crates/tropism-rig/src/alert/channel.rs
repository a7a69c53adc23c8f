//! An alert channel and its thread: queue, rate limit and repetition.

use std::collections::VecDeque;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use super::{AlertEvent, Kind};

/// Rate limit and repetition of a channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    /// Shortest time from one message to the next.
    pub(super) min_interval: Duration,
    /// Whether events within that time are queued; else they are dropped.
    pub(super) is_queued: bool,
    /// Pause after a failure; doubled with each further failure, up to `max_retry`.
    pub(super) first_retry: Duration,
    pub(super) max_retry: Duration,
}

impl Pace {
    pub(super) const MESSAGES: Self = Self {
        min_interval: Duration::from_secs(60),
        is_queued: true,
        first_retry: Duration::from_secs(10),
        max_retry: Duration::from_secs(600),
    };
    /// A late heartbeat would be wrong, so none is queued.
    pub(super) const HEARTBEAT: Self = Self { is_queued: false, ..Self::MESSAGES };
}

/// Largest length of the queue, chosen by hand; the oldest events are dropped first.
const MAX_QUEUED: usize = 200;

/// Time limit of the end of a channel: chosen by hand.
const END_TIMEOUT: Duration = Duration::from_secs(30);

/// A message to the thread of a channel.
pub(super) enum Command {
    Send(AlertEvent),
    End,
}

/// An open channel.
#[derive(Debug)]
pub(super) struct Channel {
    name: &'static str,
    on: Vec<Kind>,
    commands: Sender<Command>,
    /// At the end, the problem with unsent events.
    unsent: Receiver<Option<String>>,
}

/// A channel that is about to end.
pub(super) struct Ending {
    name: &'static str,
    unsent: Receiver<Option<String>>,
}

impl Channel {
    /// Starts the thread of a channel that sends by `deliver`.
    pub(super) fn start(
        name: &'static str,
        on: Vec<Kind>,
        pace: Pace,
        deliver: impl FnMut(&[AlertEvent]) -> Result<(), String> + Send + 'static,
    ) -> Self {
        Self::of(name, on, move |commands| run(commands, pace, deliver))
    }

    /// Starts `run` on a thread; it returns the problem with unsent events.
    pub(super) fn of(
        name: &'static str,
        on: Vec<Kind>,
        run: impl FnOnce(&Receiver<Command>) -> Option<String> + Send + 'static,
    ) -> Self {
        let ((commands, received), (ended, unsent)) = (mpsc::channel(), mpsc::channel());
        thread::spawn(move || {
            // The receiver may have timed out.
            let _ = ended.send(run(&received));
        });
        Self { name, on, commands, unsent }
    }

    pub(super) fn send(&self, event: &AlertEvent) {
        if event.kind == Kind::Test || self.on.contains(&event.kind) {
            // The thread may have ended.
            let _ = self.commands.send(Command::Send(event.clone()));
        }
    }

    pub(super) fn end(self) -> Ending {
        let _ = self.commands.send(Command::End);
        Ending { name: self.name, unsent: self.unsent }
    }
}

impl Ending {
    pub(super) fn wait(self) -> Option<(&'static str, String)> {
        let unsent = self.unsent.recv_timeout(END_TIMEOUT).unwrap_or_else(|_| Some("it hangs".to_owned()));
        unsent.map(|problem| (self.name, problem))
    }
}

/// Sends events until the end, and then once more what is queued.
fn run(
    commands: &Receiver<Command>,
    pace: Pace,
    mut deliver: impl FnMut(&[AlertEvent]) -> Result<(), String>,
) -> Option<String> {
    let mut queue: VecDeque<AlertEvent> = VecDeque::new();
    let mut not_before = Instant::now();
    let mut retry = pace.first_retry;
    loop {
        let left = not_before.saturating_duration_since(Instant::now());
        // Wait for a command, or until the queue may be sent.
        let command = match queue.is_empty() {
            true => commands.recv().map_err(RecvTimeoutError::from),
            false => commands.recv_timeout(left),
        };
        let is_over = match command {
            Ok(Command::Send(event)) => {
                if pace.is_queued {
                    queue.push_back(event);
                } else if not_before <= Instant::now() {
                    queue = VecDeque::from([event]);
                }
                if queue.len() > MAX_QUEUED {
                    queue.pop_front();
                }
                false
            }
            Ok(Command::End) | Err(RecvTimeoutError::Disconnected) => true,
            Err(RecvTimeoutError::Timeout) => false,
        };
        let is_due = not_before <= Instant::now();
        let mut problem = None;
        if !queue.is_empty() && (is_due || is_over && pace.is_queued) {
            match deliver(queue.make_contiguous()) {
                Ok(()) => {
                    queue.clear();
                    not_before = Instant::now() + pace.min_interval;
                    retry = pace.first_retry;
                }
                Err(found) => {
                    problem = Some(found);
                    not_before = Instant::now() + retry;
                    retry = (2 * retry).min(pace.max_retry);
                    if !pace.is_queued {
                        queue.clear();
                    }
                }
            }
        }
        if is_over {
            return problem;
        }
    }
}
