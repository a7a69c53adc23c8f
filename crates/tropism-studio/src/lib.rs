//! The page of tropism: `tropism studio`.
//!
//! It serves the runs, evolutions and other work below a folder: what they do now, read from their files without disturbing
//! them, by the status functions of `tropism-lab`. Changes go through the same workflows as the commands: a stop is that of
//! `tropism stop`, an evolution that a page asks for is the process `tropism evolve ...`. Pages are plain modules and styles
//! in `assets/`, embedded as they are committed.
//!
//! `docs/reference/studio.md` says what is protected and what is not.

mod error;
mod access;
#[cfg(feature = "tls")]
mod tls;
mod wire;
mod gate;
mod stream;
mod assets;
mod found;
mod words;
mod tail;
mod items;
mod metrics;
mod jobs;
mod run;
mod evolution;
mod draw;
mod begin;
mod devices;
mod calibrate;
mod housekeeping;
mod zip;
mod compare;
mod tune;
mod wall;
mod demo;
mod api;

use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use tokio::net::TcpListener;
use tokio::sync::Semaphore;

pub use access::{Tokens, new_tokens};
pub use error::StudioError;
#[cfg(feature = "tls")]
pub use tls::TlsFiles;

/// The folder of the studio's own files in the folder that it serves.
const OWN: &str = tropism_rig::alert::OF_STUDIO;

/// Requests that read or compute at once; others wait.
const TURNS: usize = 6;

/// Threads for them, and for stops and log-ins, which wait for nobody. Each keeps some memory.
const BLOCKING: usize = 2 * TURNS;

/// Reading what changes rests so many times as long as it took: it costs a twentieth of a core at most.
const REST: u32 = 20;

/// How often the queue is looked after.
const QUEUE_PAUSE: Duration = Duration::from_millis(300);

/// What a studio serves, and to whom.
#[derive(Clone, Debug)]
pub struct StudioPlan {
    /// Folder with runs, evolutions and other work; that of a demonstration by default.
    pub folder: Option<PathBuf>,
    /// Address to listen on. Any other than loopback asks for a token.
    pub listen: SocketAddr,
    /// Further names of this computer that a browser may ask for, such as that of a proxy.
    pub hosts: Vec<String>,
    /// Whether to ask for a token on loopback, too: behind a proxy everybody comes from there.
    pub ask_token: bool,
    /// Whether nothing may be changed.
    pub read_only: bool,
    /// Whether to show a virtual bean and evolutions that begin now, in a folder that is deleted at the end.
    pub demo: bool,
    /// Certificate with which connections are encrypted; none by default.
    #[cfg(feature = "tls")]
    pub tls: Option<TlsFiles>,
    /// The program `tropism`, which does what pages ask for.
    pub program: PathBuf,
}

/// A studio that is served.
pub(crate) struct Studio {
    root: PathBuf,
    program: PathBuf,
    hosts: Vec<String>,
    read_only: bool,
    is_demo: bool,
    access: access::Access,
    /// Whether connections are encrypted.
    is_encrypted: bool,
    /// Name of the session's cookie: studios on several ports of one computer share cookies.
    cookie: String,
    queue: jobs::Queue,
    devices: devices::Devices,
    /// For figures of comparisons.
    scratch: PathBuf,
    turns: Semaphore,
    /// One turn for what takes many seconds.
    heavy: Semaphore,
    reader: Mutex<items::Reader>,
    overviews: stream::Topics<items::Overview>,
    runs: stream::Topics<run::RunView>,
    evolutions: stream::Topics<evolution::EvolutionView>,
    predictions: run::Predictions,
}

impl Studio {
    /// The overview; `None` if nothing changed for a page that has one.
    fn overview(&self, has_one: bool) -> Option<items::Overview> {
        let mut reader = self.reader.lock().unwrap_or_else(PoisonError::into_inner);
        reader.read(&self.root, has_one, self.queue.shown())
    }
}

/// What is printed when a studio begins to serve.
#[derive(Clone, Debug)]
pub struct Welcome {
    /// Address of the first page.
    pub address: String,
    /// The folder.
    pub folder: PathBuf,
    /// New tokens, which are shown this once.
    pub tokens: Option<Tokens>,
    /// Whether pages ask for a token.
    pub asks_for_token: bool,
    /// SHA-256 of the certificate, as browsers show it; `None` if connections are not encrypted.
    pub fingerprint: Option<String>,
}

impl Welcome {
    /// The address with the token that may change things: the part after `#` is never sent.
    #[must_use]
    pub fn link(&self) -> String {
        match &self.tokens {
            Some(tokens) => format!("{}login#{}", self.address, tokens.change),
            None => self.address.clone(),
        }
    }

    /// The [link](Self::link) as a QR code of half blocks, for a terminal.
    #[must_use]
    pub fn qr(&self) -> Option<String> {
        let code = qrcode::QrCode::new(self.link()).ok()?;
        Some(code.render::<qrcode::render::unicode::Dense1x2>().quiet_zone(true).build())
    }
}

/// Serves `plan` until Ctrl-C or SIGTERM. `welcome` is called when pages can be had.
///
/// # Errors
/// [`StudioError`] if the folder cannot be read or the address cannot be listened on.
pub fn serve(plan: &StudioPlan, welcome: impl FnOnce(&Welcome)) -> Result<(), StudioError> {
    let own = match &plan.folder {
        None if plan.demo => Some(demo::folder()?),
        _ => None,
    };
    let folder = own.clone().or_else(|| plan.folder.clone()).unwrap_or_else(|| PathBuf::from("."));
    yield_to_runs();
    let done = serve_folder(plan, &folder, welcome);
    own.iter().for_each(|folder| demo::remove(folder));
    done
}

/// Gives way to the run of a plant on the same computer: pages, and the jobs that they start, can wait.
fn yield_to_runs() {
    #[cfg(unix)]
    let _ = rustix::process::nice(NICE);
}

/// By how much the studio gives way; chosen: it then gets a tenth of a core that a run wants, too (`man 7 sched`).
#[cfg(unix)]
const NICE: i32 = 10;

fn serve_folder(plan: &StudioPlan, folder: &Path, welcome: impl FnOnce(&Welcome)) -> Result<(), StudioError> {
    let root = folder
        .canonicalize()
        .map_err(|source| StudioError::Address { address: folder.display().to_string(), source })?;
    if !root.is_dir() {
        return Err(tropism_lab::files::FileError::content(folder, "this is a file: name a folder").into());
    }
    let is_local = plan.listen.ip().is_loopback() && !plan.ask_token;
    let has_tokens = access::path(&root).exists();
    let tokens = if is_local || has_tokens { None } else { Some(new_tokens(&root)?) };
    let access = if is_local { access::Access::open()? } else { access::Access::with_tokens(&root)? };
    let tls = wire::Encryption::of(plan)?;
    let mut runtime = tokio::runtime::Builder::new_multi_thread();
    let runtime = runtime.worker_threads(2).max_blocking_threads(BLOCKING).enable_all().build();
    let runtime = runtime.map_err(|error| StudioError::System(format!("threads: {error}")))?;
    let at = |source| StudioError::Address { address: plan.listen.to_string(), source };
    let listener = runtime.block_on(TcpListener::bind(plan.listen)).map_err(at)?;
    let address = listener.local_addr().map_err(at)?;
    let scratch = std::env::temp_dir().join(format!("tropism-studio-{}", &access::random_word()?[..12]));
    make_private_folder(&scratch)?;
    let studio = Arc::new(Studio {
        queue: jobs::Queue::open(&root, &plan.program)?,
        devices: devices::Devices::default(),
        program: plan.program.clone(),
        hosts: plan.hosts.clone(),
        read_only: plan.read_only,
        is_demo: plan.demo,
        access,
        is_encrypted: tls.is_on(),
        cookie: format!("tropism-studio-{}", address.port()),
        scratch: scratch.clone(),
        turns: Semaphore::new(TURNS),
        heavy: Semaphore::new(1),
        reader: Mutex::default(),
        overviews: stream::Topics::default(),
        runs: stream::Topics::default(),
        evolutions: stream::Topics::default(),
        predictions: run::Predictions::default(),
        root: root.clone(),
    });
    let demo = if plan.demo { Some(demo::Demo::start(&studio)?) } else { None };
    let queue = Arc::downgrade(&studio);
    std::thread::spawn(move || {
        // The first page finds its files compressed, and that which looks at everything finds it read.
        assets::prepare();
        queue.upgrade().map(|studio| studio.overview(false));
        while let Some(studio) = queue.upgrade() {
            studio.queue.advance();
            drop(studio);
            std::thread::sleep(QUEUE_PAUSE);
        }
    });
    let shown = SocketAddr::new(shown_ip(address.ip()), address.port());
    welcome(&Welcome {
        address: format!("{}://{shown}/", if tls.is_on() { "https" } else { "http" }),
        fingerprint: tls.fingerprint(),
        folder: root,
        tokens,
        asks_for_token: studio.access.asks_for_token(),
    });
    runtime.block_on(async {
        tokio::select! {
            () = wire::serve(listener, tls, api::router(studio.clone())) => {}
            () = asked_to_end() => {}
        }
    });
    studio.devices.close();
    // Pages that listen for ever do not hold it up.
    runtime.shutdown_timeout(Duration::from_millis(200));
    drop(demo);
    let _ = std::fs::remove_dir_all(scratch);
    Ok(())
}

#[cfg(unix)]
fn make_private_folder(path: &Path) -> Result<(), StudioError> {
    use std::os::unix::fs::DirBuilderExt;

    let made = std::fs::DirBuilder::new().mode(0o700).create(path);
    made.map_err(|error| StudioError::System(format!("{}: {error}", path.display())))
}

#[cfg(not(unix))]
fn make_private_folder(path: &Path) -> Result<(), StudioError> {
    std::fs::create_dir(path).map_err(|error| StudioError::System(format!("{}: {error}", path.display())))
}

/// Waits for Ctrl-C or SIGTERM.
async fn asked_to_end() {
    #[cfg(unix)]
    {
        let term = tokio::signal::unix::signal(tokio::signal::unix::SignalKind::terminate());
        let Ok(mut term) = term else { return std::future::pending().await };
        tokio::select! {
            _ = tokio::signal::ctrl_c() => {}
            _ = term.recv() => {}
        }
    }
    #[cfg(not(unix))]
    let _ = tokio::signal::ctrl_c().await;
}

/// An address of this computer that others reach, where it listens on all of them.
fn shown_ip(ip: IpAddr) -> IpAddr {
    if !ip.is_unspecified() {
        return ip;
    }
    // Nothing is sent: the system says by which address it would be.
    let outward = std::net::UdpSocket::bind("0.0.0.0:0").and_then(|socket| {
        socket.connect("192.0.2.1:9")?;
        socket.local_addr()
    });
    outward.map_or(IpAddr::from([127, 0, 0, 1]), |address| address.ip())
}

/// Seconds since 1970.
fn unix_s() -> f64 {
    (1000.0 * unix_of(SystemTime::now())).round() / 1000.0
}

fn unix_of(time: SystemTime) -> f64 {
    time.duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}
