//! Server-sent events: a body that is written while the page listens, and states that many pages listen to.

use std::collections::BTreeMap;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use hyper::body::Frame;
use serde::Serialize;
use tokio::sync::{mpsc, watch};

/// Silence longer than this is broken by a beat, so that a page sees that it is cut off.
const BEAT: Duration = Duration::from_secs(5);

/// A page that takes nothing for so long is let go; it comes back and catches up.
const FAULT_POLICY: Duration = Duration::from_secs(20);

/// How long a state is kept up to date that nobody listens to.
const LINGER: Duration = Duration::from_secs(30);

/// Messages that wait for one page.
const WAITING: usize = 16;

/// A message to a page.
pub(crate) struct Message {
    /// What the page has after this message; it comes back with it.
    pub(crate) id: String,
    pub(crate) event: &'static str,
    /// JSON in one line.
    pub(crate) data: String,
}

impl Message {
    pub(crate) fn new(id: String, event: &'static str, data: &impl Serialize) -> Self {
        Self { id, event, data: serde_json::to_string(data).unwrap_or_else(|_| "null".to_owned()) }
    }

    fn text(&self) -> Bytes {
        format!("id: {}\nevent: {}\ndata: {}\n\n", self.id, self.event, self.data).into()
    }
}

/// A state that pages listen to.
pub(crate) trait Listened: Send + Sync + 'static {
    /// What a page lacks that has what `id` names, or nothing if there is none.
    fn since(&self, id: Option<&str>) -> Vec<Message>;
}

/// The latest value of a state.
pub(crate) type Latest<T> = watch::Receiver<Option<Arc<T>>>;

/// Sends a page each change of `latest`, from what it has, as long as `is_allowed`.
pub(crate) fn stream<T: Listened>(
    mut latest: Latest<T>,
    last: Option<String>,
    is_allowed: impl Fn() -> bool + Send + 'static,
) -> Response {
    let (sender, receiver) = mpsc::channel(WAITING);
    tokio::spawn(async move {
        let send = async |bytes: Bytes| sender.send_timeout(bytes, FAULT_POLICY).await.is_ok();
        let mut id = last;
        if !send("retry: 2000\n\n".into()).await {
            return;
        }
        // Asked again at each beat.
        while is_allowed() {
            let state = latest.borrow_and_update().clone();
            for message in state.map(|state| state.since(id.as_deref())).unwrap_or_default() {
                if !send(message.text()).await {
                    return;
                }
                id = Some(message.id);
            }
            tokio::select! {
                changed = latest.changed() => if changed.is_err() { return },
                () = tokio::time::sleep(BEAT) => {
                    let beat = format!("event: beat\ndata: {}\n\n", crate::unix_s());
                    if !send(beat.into()).await {
                        return;
                    }
                }
                () = sender.closed() => return,
            }
        }
    });
    let headers = [(header::CONTENT_TYPE, "text/event-stream"), (header::CACHE_CONTROL, "no-store")];
    // What collects answers before it passes them on would hold back events.
    (headers, [("x-accel-buffering", "no")], Body::new(Channel(receiver))).into_response()
}

/// A body that comes piece by piece.
struct Channel(mpsc::Receiver<Bytes>);

impl hyper::body::Body for Channel {
    type Data = Bytes;
    type Error = std::convert::Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Self::Error>>> {
        self.0.poll_recv(context).map(|bytes| bytes.map(|bytes| Ok(Frame::data(bytes))))
    }
}

/// States by name, each kept up to date while pages listen to it.
pub(crate) struct Topics<T>(Mutex<BTreeMap<String, Latest<T>>>);

impl<T> Default for Topics<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Listened> Topics<T> {
    /// The state `name`: `read` makes it anew from what it was, `None` if nothing changed, every `pause`.
    pub(crate) fn listen(
        &self,
        name: &str,
        pause: Duration,
        mut read: impl FnMut(Option<&Arc<T>>) -> Option<T> + Send + 'static,
    ) -> Latest<T> {
        let mut topics = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // Those whose reader has ended.
        topics.retain(|_, latest| latest.has_changed().is_ok());
        if let Some(latest) = topics.get(name) {
            return latest.clone();
        }
        let (sender, latest) = watch::channel(None);
        topics.insert(name.to_owned(), latest.clone());
        // A thread of its own: it reads the disk.
        std::thread::spawn(move || {
            let mut alone = Duration::ZERO;
            // One receiver is the map's.
            while alone < LINGER {
                let known = sender.borrow().clone();
                if let Some(state) = read(known.as_ref()) {
                    sender.send_replace(Some(Arc::new(state)));
                }
                std::thread::sleep(pause);
                alone = if sender.receiver_count() > 1 { Duration::ZERO } else { alone + pause };
            }
        });
        latest
    }
}

/// Waits for the first value of a state.
pub(crate) async fn first<T>(mut latest: Latest<T>) -> Option<Arc<T>> {
    let value = tokio::time::timeout(Duration::from_secs(20), latest.wait_for(Option::is_some)).await;
    value.ok()?.ok()?.clone()
}
