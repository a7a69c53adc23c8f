//! A channel and its thread: what waits, when it goes out, and when it is tried again.

use std::collections::VecDeque;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use super::{Happening, Kind};

/// How often a channel speaks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    /// After a message, the next one waits so long.
    pub(super) gap: Duration,
    /// Whether what happens in that time waits; else it is dropped.
    pub(super) waits: bool,
    /// After a failure; doubled with each further one, up to `longest`.
    pub(super) again: Duration,
    pub(super) longest: Duration,
}

impl Pace {
    pub(super) const MESSAGES: Self = Self {
        gap: Duration::from_secs(60),
        waits: true,
        again: Duration::from_secs(10),
        longest: Duration::from_secs(600),
    };
    /// An old heartbeat says nothing of now.
    pub(super) const HEARTBEAT: Self = Self { waits: false, ..Self::MESSAGES };
}

/// What waits at most: beyond, the oldest are forgotten.
const WAITING: usize = 200;

/// How long the end of a channel may take.
const END: Duration = Duration::from_secs(30);

/// What a thread is told.
pub(super) enum Order {
    Tell(Happening),
    End,
}

/// A channel at work.
#[derive(Debug)]
pub(super) struct Channel {
    name: &'static str,
    on: Vec<Kind>,
    orders: Sender<Order>,
    /// What is left at its end.
    left: Receiver<Option<String>>,
}

/// A channel that was told to end.
pub(super) struct Ending {
    name: &'static str,
    left: Receiver<Option<String>>,
}

impl Channel {
    /// Starts the thread of a channel that sends by `deliver`.
    pub(super) fn start(
        name: &'static str,
        on: Vec<Kind>,
        pace: Pace,
        deliver: impl FnMut(&[Happening]) -> Result<(), String> + Send + 'static,
    ) -> Self {
        Self::of(name, on, move |orders| attend(orders, pace, deliver))
    }

    /// Starts `attend` on a thread; it returns what is wrong with what is left.
    pub(super) fn of(
        name: &'static str,
        on: Vec<Kind>,
        attend: impl FnOnce(&Receiver<Order>) -> Option<String> + Send + 'static,
    ) -> Self {
        let ((orders, received), (ended, left)) = (mpsc::channel(), mpsc::channel());
        thread::spawn(move || {
            // Whoever waits for the end may have given up.
            let _ = ended.send(attend(&received));
        });
        Self { name, on, orders, left }
    }

    pub(super) fn tell(&self, happening: &Happening) {
        if happening.kind == Kind::Test || self.on.contains(&happening.kind) {
            // A thread that is gone can tell nobody.
            let _ = self.orders.send(Order::Tell(happening.clone()));
        }
    }

    pub(super) fn end(self) -> Ending {
        let _ = self.orders.send(Order::End);
        Ending { name: self.name, left: self.left }
    }
}

impl Ending {
    pub(super) fn wait(self) -> Option<(&'static str, String)> {
        let left = self.left.recv_timeout(END).unwrap_or_else(|_| Some("it hangs".to_owned()));
        left.map(|problem| (self.name, problem))
    }
}

/// Delivers until the end, and then once more whatever waits.
fn attend(
    orders: &Receiver<Order>,
    pace: Pace,
    mut deliver: impl FnMut(&[Happening]) -> Result<(), String>,
) -> Option<String> {
    let mut waiting: VecDeque<Happening> = VecDeque::new();
    let mut not_before = Instant::now();
    let mut again = pace.again;
    loop {
        let left = not_before.saturating_duration_since(Instant::now());
        // Until there is something to do, and it may be done.
        let order = match waiting.is_empty() {
            true => orders.recv().map_err(RecvTimeoutError::from),
            false => orders.recv_timeout(left),
        };
        let is_over = match order {
            Ok(Order::Tell(happening)) => {
                if pace.waits {
                    waiting.push_back(happening);
                } else if not_before <= Instant::now() {
                    waiting = VecDeque::from([happening]);
                }
                if waiting.len() > WAITING {
                    waiting.pop_front();
                }
                false
            }
            Ok(Order::End) | Err(RecvTimeoutError::Disconnected) => true,
            Err(RecvTimeoutError::Timeout) => false,
        };
        let is_due = not_before <= Instant::now();
        let mut problem = None;
        if !waiting.is_empty() && (is_due || is_over && pace.waits) {
            match deliver(waiting.make_contiguous()) {
                Ok(()) => {
                    waiting.clear();
                    not_before = Instant::now() + pace.gap;
                    again = pace.again;
                }
                Err(found) => {
                    problem = Some(found);
                    not_before = Instant::now() + again;
                    again = (2 * again).min(pace.longest);
                    if !pace.waits {
                        waiting.clear();
                    }
                }
            }
        }
        if is_over {
            return problem;
        }
    }
}
