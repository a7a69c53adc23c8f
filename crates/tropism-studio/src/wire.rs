//! Connections: how many there may be, and how long each may take.
//!
//! A connection that has not sent a whole head in [`HEAD`], or takes nothing of an answer for [`STALL`], is dropped. When
//! there are [`MOST`], the oldest one that has not asked for anything yet makes room: thousands of silent connections do not
//! keep out a browser.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::pin::Pin;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::http::Request;
use axum::response::Response;
use hyper::body::Incoming;
use hyper::server::conn::http1;
#[cfg(feature = "tls")]
use hyper::server::conn::http2;
use hyper::service::service_fn;
#[cfg(feature = "tls")]
use hyper_util::rt::TokioExecutor;
use hyper_util::rt::{TokioIo, TokioTimer};
#[cfg(feature = "tls")]
use tokio::io::AsyncWriteExt;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::AbortHandle;
use tokio::time::Sleep;

use crate::StudioPlan;
use crate::error::StudioError;

/// Connections at once; chosen, well below the 1024 files that a program may have open by default.
const MOST: usize = 400;

/// How long the head of a request may take to come.
const HEAD: Duration = Duration::from_secs(10);

/// How long nothing may go out of what waits to go out.
const STALL: Duration = Duration::from_secs(20);

/// Largest head of a request, in bytes.
const MAX_HEAD: usize = 16 * 1024;

/// The address that a request came from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peer(pub(crate) IpAddr);

/// Connections that have asked for nothing yet, from the oldest.
type Silent = Arc<Mutex<BTreeMap<u64, AbortHandle>>>;

/// How connections are encrypted, if they are.
#[derive(Clone, Default)]
pub(crate) struct Encryption {
    #[cfg(feature = "tls")]
    tls: Option<crate::tls::Tls>,
}

#[cfg(feature = "tls")]
impl Encryption {
    /// # Errors
    /// [`StudioError`] if the certificate or its key cannot be used.
    pub(crate) fn of(plan: &StudioPlan) -> Result<Self, StudioError> {
        Ok(Self { tls: plan.tls.as_ref().map(crate::tls::Tls::read).transpose()? })
    }

    pub(crate) const fn is_on(&self) -> bool {
        self.tls.is_some()
    }

    pub(crate) fn fingerprint(&self) -> Option<String> {
        Some(self.tls.as_ref()?.fingerprint.clone())
    }

    /// Serves one connection; an error is its end, of which there is nobody to tell.
    async fn serve(&self, stream: TcpStream, service: Service) {
        let Some(tls) = &self.tls else { return http(stream, service).await };
        let begun = async {
            let mut first = [0];
            stream.peek(&mut first).await?;
            if crate::tls::is_handshake(first[0]) {
                return tls.accept(Moving::of(stream)).await.map(Some);
            }
            let mut stream = Moving::of(stream);
            stream.write_all(WANTS_HTTPS.as_bytes()).await?;
            stream.shutdown().await.map(|()| None)
        };
        if let Ok(Ok(Some(stream))) = tokio::time::timeout(HEAD, begun).await {
            if crate::tls::is_http2(&stream) {
                http2_over(stream, service).await;
            } else {
                http_over(stream, service).await;
            }
        }
    }
}

/// The answer to a browser that was given an address without the `s`.
#[cfg(feature = "tls")]
const WANTS_HTTPS: &str = "HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain; charset=utf-8\r\nConnection: close\r\n\r\n\
     This page is encrypted: its address begins with https://\n";

#[cfg(not(feature = "tls"))]
impl Encryption {
    pub(crate) fn of(_plan: &StudioPlan) -> Result<Self, StudioError> {
        Ok(Self::default())
    }

    pub(crate) const fn is_on(&self) -> bool {
        false
    }

    pub(crate) const fn fingerprint(&self) -> Option<String> {
        None
    }

    async fn serve(&self, stream: TcpStream, service: Service) {
        http(stream, service).await;
    }
}

/// Serves `router` on `listener` for ever.
pub(crate) async fn serve(listener: TcpListener, encryption: Encryption, router: Router) {
    let silent = Silent::default();
    let all_silent = silent.clone();
    let count = Arc::new(AtomicUsize::new(0));
    for number in 0_u64.. {
        let (stream, peer) = match listener.accept().await {
            Ok(accepted) => accepted,
            // Too many open files, or a connection that is gone already: room comes back.
            Err(_) => {
                tokio::time::sleep(Duration::from_millis(50)).await;
                continue;
            }
        };
        if count.load(Ordering::Relaxed) >= MOST {
            let oldest = lock(&silent).pop_first();
            let Some((_, oldest)) = oldest else { continue };
            oldest.abort();
        }
        let one = Counted::new(&count);
        // Held while it begins: it takes itself out with its first request.
        let mut silent = lock(&silent);
        let service = Service { router: router.clone(), peer, number, silent: all_silent.clone(), _one: one };
        let encryption = encryption.clone();
        let begun = async move {
            let _ = stream.set_nodelay(true);
            encryption.serve(stream, service).await;
        };
        silent.insert(number, tokio::spawn(begun).abort_handle());
        // Those that ended without a word.
        if number.is_multiple_of(64) {
            silent.retain(|_, task| !task.is_finished());
        }
    }
}

fn lock(silent: &Silent) -> std::sync::MutexGuard<'_, BTreeMap<u64, AbortHandle>> {
    silent.lock().unwrap_or_else(PoisonError::into_inner)
}

/// One of the connections that are counted, until it is dropped.
struct Counted(Arc<AtomicUsize>);

impl Counted {
    fn new(count: &Arc<AtomicUsize>) -> Self {
        count.fetch_add(1, Ordering::Relaxed);
        Self(count.clone())
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// What answers the requests of one connection.
struct Service {
    router: Router,
    peer: SocketAddr,
    number: u64,
    silent: Silent,
    _one: Counted,
}

async fn http(stream: TcpStream, service: Service) {
    http_over(Moving::of(stream), service).await;
}

async fn http_over<S: AsyncRead + AsyncWrite + Unpin>(stream: S, service: Service) {
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEAD).max_buf_size(MAX_HEAD).half_close(false);
    // An error is the end of one connection: there is nobody to tell.
    let service = service_fn(|request| service.answer(request));
    let _ = http.serve_connection(TokioIo::new(stream), service).await;
}

/// Requests of one connection that are answered at the same time, at most; chosen, some for each of ten tabs.
#[cfg(feature = "tls")]
const MOST_AT_ONCE: u32 = 100;

#[cfg(feature = "tls")]
async fn http2_over<S: AsyncRead + AsyncWrite + Unpin + Send + 'static>(stream: S, service: Service) {
    let mut http = http2::Builder::new(TokioExecutor::new());
    http.timer(TokioTimer::new()).max_concurrent_streams(MOST_AT_ONCE).max_header_list_size(MAX_HEAD as u32);
    // One that is gone is noticed by pings: nothing else of it need ever come.
    http.keep_alive_interval(HEAD).keep_alive_timeout(STALL);
    let service = Arc::new(service);
    let service = service_fn(move |request| {
        let service = service.clone();
        async move { service.answer(request).await }
    });
    let _ = http.serve_connection(TokioIo::new(stream), service).await;
}

impl Service {
    async fn answer(&self, request: Request<Incoming>) -> Result<Response, Infallible> {
        use tower_service::Service;

        lock(&self.silent).remove(&self.number);
        let mut request = request.map(Body::new);
        request.extensions_mut().insert(Peer(self.peer.ip()));
        Service::<Request<Body>>::call(&mut self.router.clone(), request).await
    }
}

/// A connection that breaks when nothing of what is to go out goes out.
struct Moving {
    stream: TcpStream,
    stall: Option<Pin<Box<Sleep>>>,
}

impl Moving {
    const fn of(stream: TcpStream) -> Self {
        Self { stream, stall: None }
    }

    fn watch<T>(&mut self, context: &mut Context<'_>, poll: Poll<io::Result<T>>) -> Poll<io::Result<T>> {
        if poll.is_ready() {
            self.stall = None;
            return poll;
        }
        let stall = self.stall.get_or_insert_with(|| Box::pin(tokio::time::sleep(STALL)));
        ready!(stall.as_mut().poll(context));
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }
}

impl AsyncRead for Moving {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for Moving {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let poll = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.watch(context, poll)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let poll = Pin::new(&mut self.stream).poll_flush(context);
        self.watch(context, poll)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}
