//! Server-sent events: a body that is written while the page listens, and states that many pages listen to.

use std::collections::BTreeMap;
use std::io::Write;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use flate2::Compression;
use flate2::write::GzEncoder;
use hyper::body::Frame;
use serde::Serialize;
use tokio::sync::{mpsc, watch};

use crate::error::Refusal;

/// Time between two beats, by which a page sees that it is not cut off.
const BEAT: Duration = Duration::from_secs(5);

/// A page that takes nothing for so long is let go; it comes back and catches up.
const SEND_TIMEOUT: Duration = Duration::from_secs(20);

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

    /// The message as an event. One of several states carries its `key`, and its id within: the browser keeps one id a
    /// stream, not one a state.
    fn text(&self, key: Option<&str>) -> Bytes {
        let Self { id, event, data } = self;
        match key {
            None => format!("id: {id}\nevent: {event}\ndata: {data}\n\n").into(),
            Some(key) => {
                let [key, id] = [key, id].map(quoted);
                format!("event: {event}\ndata: {{\"key\":{key},\"id\":{id},\"data\":{data}}}\n\n").into()
            }
        }
    }
}

/// A text as JSON.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// A state that pages listen to.
pub(crate) trait Listened: Send + Sync + 'static {
    /// What a page lacks that has what `id` names, or nothing if there is none.
    fn since(&self, id: Option<&str>) -> Vec<Message>;
}

/// The latest value of a state.
pub(crate) type Latest<T> = watch::Receiver<Option<Arc<T>>>;

/// A stream of events, as long as its session is allowed to listen.
pub(crate) struct EventStream {
    sender: mpsc::Sender<Piece>,
    is_allowed: Arc<dyn Fn() -> bool + Send + Sync>,
}

/// Bytes of a stream, or its end.
type Piece = Option<Bytes>;

impl EventStream {
    /// Opens a stream: what feeds it, and the answer that carries it, compressed if `headers` allow it.
    pub(crate) fn open(
        headers: &HeaderMap,
        is_allowed: impl Fn() -> bool + Send + Sync + 'static,
    ) -> (Self, Response) {
        let (sender, receiver) = mpsc::channel(WAITING);
        let (own, is_allowed) = (sender.clone(), Arc::new(is_allowed));
        let stream = Self { sender, is_allowed: is_allowed.clone() };
        tokio::spawn(async move {
            let mut text = "retry: 2000\n\n".to_owned();
            while is_allowed() && send(&own, Some(text.into())).await {
                tokio::select! {
                    () = tokio::time::sleep(BEAT) => {}
                    () = own.closed() => return,
                }
                text = format!("event: beat\ndata: {}\n\n", crate::unix_s());
            }
            let _ = send(&own, None).await;
        });
        let asks = headers.get(header::ACCEPT_ENCODING).and_then(|value| value.to_str().ok());
        let gzip = asks.filter(|value| value.contains("gzip")).map(|_| {
            // Curves and rows shrink to a fifth at the lowest level.
            GzEncoder::new(Vec::new(), Compression::fast())
        });
        let encoding = gzip.as_ref().map(|_| [(header::CONTENT_ENCODING, "gzip")]);
        let kind = [(header::CONTENT_TYPE, "text/event-stream"), (header::CACHE_CONTROL, "no-store")];
        // What collects answers before it passes them on would hold back events.
        let pass = [("x-accel-buffering", "no")];
        (
            stream,
            (kind, pass, encoding, Body::new(Channel { receiver, gzip, is_over: false })).into_response(),
        )
    }

    /// Sends each change of `latest` after what `last` names, under `key` if the stream carries several states.
    pub(crate) fn follow<T: Listened>(
        &self,
        key: Option<String>,
        mut latest: Latest<T>,
        last: Option<String>,
    ) {
        let (sender, is_allowed) = (self.sender.clone(), self.is_allowed.clone());
        tokio::spawn(async move {
            let mut id = last;
            while is_allowed() {
                let state = latest.borrow_and_update().clone();
                for message in state.map(|state| state.since(id.as_deref())).unwrap_or_default() {
                    if !send(&sender, Some(message.text(key.as_deref()))).await {
                        return;
                    }
                    id = Some(message.id);
                }
                tokio::select! {
                    // Its reader is gone: the page comes back, and gets another.
                    changed = latest.changed() => if changed.is_err() { break },
                    () = sender.closed() => return,
                }
            }
            let _ = send(&sender, None).await;
        });
    }

    /// Reports that the state `key` cannot be listened to.
    pub(crate) fn refuse(&self, key: &str, Refusal(_, problem): &Refusal) {
        let [key, problem] = [key, problem].map(quoted);
        let text = format!("event: refused\ndata: {{\"key\":{key},\"error\":{problem}}}\n\n");
        let sender = self.sender.clone();
        tokio::spawn(async move { send(&sender, Some(text.into())).await });
    }
}

/// A body that is written while it is sent: what writes it gets its sender, on a thread of its own.
pub(crate) fn written(write: impl FnOnce(&dyn Fn(Vec<u8>) -> bool) + Send + 'static) -> Body {
    let (sender, receiver) = mpsc::channel(2);
    std::thread::spawn(move || {
        // False when nobody takes it any more.
        write(&|bytes: Vec<u8>| sender.blocking_send(Some(bytes.into())).is_ok());
    });
    Body::new(Channel { receiver, gzip: None, is_over: false })
}

async fn send(sender: &mpsc::Sender<Piece>, piece: Piece) -> bool {
    sender.send_timeout(piece, SEND_TIMEOUT).await.is_ok()
}

/// A body that comes piece by piece.
struct Channel {
    receiver: mpsc::Receiver<Piece>,
    gzip: Option<GzEncoder<Vec<u8>>>,
    is_over: bool,
}

impl hyper::body::Body for Channel {
    type Data = Bytes;
    type Error = std::io::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Self::Error>>> {
        if self.is_over {
            return Poll::Ready(None);
        }
        let piece = ready!(self.receiver.poll_recv(context)).flatten();
        self.is_over = piece.is_none();
        let Some(bytes) = piece else {
            let rest = self.gzip.take().map(GzEncoder::finish);
            return Poll::Ready(rest.map(|rest| rest.map(|bytes| Frame::data(bytes.into()))));
        };
        let bytes = match &mut self.gzip {
            None => bytes,
            Some(gzip) => {
                // Flushed at once: a page waits for each event.
                let flushed = gzip.write_all(&bytes).and_then(|()| gzip.flush());
                if let Err(error) = flushed {
                    return Poll::Ready(Some(Err(error)));
                }
                std::mem::take(gzip.get_mut()).into()
            }
        };
        Poll::Ready(Some(Ok(Frame::data(bytes))))
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
