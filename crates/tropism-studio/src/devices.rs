//! Devices by hand: one rig at a time is open, in a thread of its own, for as long as a page uses it.
//!
//! The thread keeps the time of a lamp and the watchdog alive, and gives the rig back when nothing is lit and nobody has asked
//! for a while.

use std::path::PathBuf;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tropism::vision::VisionConfig;
use tropism_bean::tent::Greenhouse;
use tropism_lab::by_hand::{MAX_LIT_S, RigByHand, Seen, Taken, time_by_hand};
use tropism_lab::run::read_rig;
use tropism_lab::safe_state::SafeStatePlan;
use tropism_lab::{RunConfig, Silent, Workflow, files, holder};
use tropism_rig::file::RigFile;

use crate::Studio;
use crate::begin::files_below;
use crate::error::Refusal;
use crate::found::{Finder, Kind, resolve};

/// The word for the virtual tent where a rig file is named.
const TENT: &str = "greenhouse";

/// Pause between two looks at the time.
const TICK: Duration = Duration::from_millis(200);

/// How long a rig in which nothing is lit stays open; chosen: a run that begins waits no longer.
const IDLE: Duration = Duration::from_secs(15);

/// How long *off* waits for a camera that hangs, before the lamps are switched off without it; chosen.
const PATIENCE: Duration = Duration::from_secs(3);

/// What is asked of the open rig.
enum Ask {
    /// A lamp, or the flash, for a time.
    Light {
        lamp: String,
        time: Duration,
    },
    Dark,
    Photo {
        has_flash: bool,
    },
    State,
    Close,
}

/// What the rig answers: its state, and a photograph.
type Answer = Result<(RigState, Option<Taken>), String>;

/// What is lit in a rig by hand.
#[derive(Default, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct RigState {
    /// A lamp, or `flash`.
    lit: Option<String>,
    /// Seconds until it goes off.
    left_s: Option<f64>,
    /// A lamp that did not obey.
    problem: Option<String>,
    /// The photograph that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    photo: Option<PhotoByHand>,
}

/// A photograph that was taken by hand.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct PhotoByHand {
    /// By which it is asked for.
    number: u64,
    /// What is seen in it; `None` as long as the rig file has no calibration.
    seen: Option<Seen>,
}

/// The open rig.
struct Session {
    rig: String,
    /// Its file as it was opened.
    file: RigFile,
    ask: Sender<(Ask, Sender<Answer>)>,
    thread: JoinHandle<()>,
}

/// Devices that pages switch by hand.
#[derive(Default)]
pub(crate) struct Devices {
    session: Mutex<Option<Session>>,
    /// The latest photograph, and its number.
    latest: Mutex<(u64, Vec<u8>)>,
}

impl Devices {
    /// Asks the rig `at`, which is opened if it is not open; the one that was open before is closed. Photographs and light are
    /// by the rig file as it is now, what puts light off by the one that lit it. `None` if it does not answer in time.
    fn ask(
        &self,
        studio: &Studio,
        at: &str,
        ask: Ask,
        timeout: Duration,
    ) -> Result<Option<RigState>, Refusal> {
        let (answer, heard) = mpsc::channel();
        {
            let mut session = self.session.lock().unwrap_or_else(PoisonError::into_inner);
            let open = session.as_ref().filter(|open| open.rig == at && !open.thread.is_finished());
            let wants_now = matches!(ask, Ask::Photo { .. } | Ask::Light { .. });
            let to_open = match open {
                Some(_) if !wants_now => None,
                _ => Some(rig(studio, at)?).filter(|(_, rig)| open.is_none_or(|open| open.file != *rig)),
            };
            if let Some((path, rig)) = to_open {
                if let Some(other) = session.take() {
                    end(other);
                }
                refuse_of_run(studio, &rig)?;
                *session = Some(begin(at, path, rig, studio.program.clone())?);
            }
            let sent = session.as_ref().map(|open| open.ask.send((ask, answer)));
            if !matches!(sent, Some(Ok(()))) {
                return Err(Refusal::bad("the rig was given back just now; try again"));
            }
        }
        match heard.recv_timeout(timeout) {
            Ok(Ok((mut state, photo))) => {
                if let Some(Taken { photo, seen }) = photo {
                    let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
                    *latest = (latest.0 + 1, photo.bytes);
                    state.photo = Some(PhotoByHand { number: latest.0, seen });
                }
                Ok(Some(state))
            }
            Ok(Err(problem)) => Err(Refusal::bad(crate::words::clean(&problem))),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(Refusal::bad("the rig was given back; try again")),
        }
    }

    /// Whether `at` is open.
    fn has(&self, at: &str) -> bool {
        let session = self.session.lock().unwrap_or_else(PoisonError::into_inner);
        session.as_ref().is_some_and(|open| open.rig == at && !open.thread.is_finished())
    }

    /// Puts all light off that was lit by hand, and gives the rig back.
    pub(crate) fn close(&self) {
        let session = self.session.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(session) = session {
            end(session);
        }
    }

    /// The photograph `number`, as long as it is the latest one.
    pub(crate) fn photograph(&self, number: u64) -> Result<Vec<u8>, Refusal> {
        let latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        if latest.0 == number && number > 0 {
            return Ok(latest.1.clone());
        }
        Err(Refusal::missing("there is a newer photograph by now"))
    }
}

fn end(session: Session) {
    let _ = session.ask.send((Ask::Close, mpsc::channel().0));
    // Its light is off when it has ended.
    let _ = session.thread.join();
}

fn begin(at: &str, path: PathBuf, rig: RigFile, program: PathBuf) -> Result<Session, Refusal> {
    let (ask, asks) = mpsc::channel();
    let (opened, is_open) = mpsc::channel();
    let file = rig.clone();
    // Devices stay in the thread that has opened them.
    let thread = thread::spawn(move || match RigByHand::open(rig, &path, Some(&program)) {
        Ok(rig) => {
            let _ = opened.send(Ok(()));
            serve(rig, &asks);
        }
        Err(error) => {
            let _ = opened.send(Err(error.with_causes()));
        }
    });
    match is_open.recv() {
        Ok(Ok(())) => Ok(Session { rig: at.to_owned(), file, ask, thread }),
        Ok(Err(problem)) => Err(Refusal::bad(crate::words::clean(&problem))),
        Err(_) => Err(Refusal::bad("the rig could not be opened")),
    }
}

/// What is lit, and until when.
struct Lit {
    name: String,
    until: Instant,
}

fn serve(mut rig: RigByHand, asks: &Receiver<(Ask, Sender<Answer>)>) {
    let mut lit: Option<Lit> = None;
    let mut used = Instant::now();
    let mut problem = None;
    loop {
        let asked = match asks.recv_timeout(TICK) {
            Ok((Ask::Close, _)) | Err(RecvTimeoutError::Disconnected) => return,
            Ok(asked) => Some(asked),
            Err(RecvTimeoutError::Timeout) => None,
        };
        rig.beat();
        if lit.as_ref().is_some_and(|lit| lit.until <= Instant::now()) {
            // A lamp that does not obey is tried again at the next look.
            problem = off(&mut rig, &mut lit).err();
        }
        let Some((ask, answer)) = asked else {
            if lit.is_none() && used.elapsed() > IDLE {
                return;
            }
            continue;
        };
        used = Instant::now();
        let answered = act(&mut rig, ask, &mut lit).map(|photo| {
            let left_s =
                lit.as_ref().map(|lit| lit.until.saturating_duration_since(Instant::now()).as_secs_f64());
            let lit = lit.as_ref().map(|lit| lit.name.clone());
            (RigState { lit, left_s, problem: problem.take(), photo: None }, photo)
        });
        let _ = answer.send(answered);
    }
}

fn act(rig: &mut RigByHand, ask: Ask, lit: &mut Option<Lit>) -> Result<Option<Taken>, String> {
    let in_words = |error: tropism_lab::Error| error.with_causes();
    match ask {
        Ask::Light { lamp, time } => {
            off(rig, lit)?;
            rig.switch(&lamp, true).map_err(in_words)?;
            *lit = Some(Lit { name: lamp, until: Instant::now() + time });
            Ok(None)
        }
        Ask::Dark => {
            // All are switched, also where one does not obey.
            let (flash, lamps) = (rig.flash(false), rig.light(None));
            flash.and(lamps).map_err(in_words)?;
            *lit = None;
            Ok(None)
        }
        Ask::Photo { has_flash } => rig.photograph(has_flash).map(Some).map_err(in_words),
        Ask::State | Ask::Close => Ok(None),
    }
}

/// Switches off what is lit, which is forgotten when it has obeyed.
fn off(rig: &mut RigByHand, lit: &mut Option<Lit>) -> Result<(), String> {
    let Some(Lit { name, .. }) = lit else { return Ok(()) };
    rig.switch(name, false).map_err(|error| error.with_causes())?;
    *lit = None;
    Ok(())
}

/// The path and the content of the rig file `at`, or the virtual tent.
fn rig(studio: &Studio, at: &str) -> Result<(PathBuf, RigFile), Refusal> {
    if at == TENT {
        return Ok((TENT.into(), RigFile::greenhouse(Greenhouse::default(), VisionConfig::default())));
    }
    let path = resolve(&studio.root, at)?;
    if !path.is_file() || !at.ends_with(".toml") {
        return Err(Refusal::missing(format!("found no rig file {at:?}")));
    }
    let rig = read_rig(&path)?;
    Ok((path, rig))
}

/// Refuses a rig whose lamps or flash a run in the folder has just now.
fn refuse_of_run(studio: &Studio, rig: &RigFile) -> Result<(), Refusal> {
    if rig.is_virtual() {
        return Ok(());
    }
    for found in Finder::default().find(&studio.root) {
        if found.kind != Kind::Run || !holder(&found.path).is_ok_and(|process| process.is_some()) {
            continue;
        }
        let Ok(config) = RunConfig::follow(&found.path) else { continue };
        if config.rig.lamps == rig.lamps && config.rig.mqtt == rig.mqtt {
            return Err(Refusal::bad(format!(
                "The run {} has this rig. Stop the run first; it goes on when you resume it.",
                found.at
            )));
        }
    }
    Ok(())
}

/// Rig files in the folder, and the word for the virtual tent.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Rigs {
    rigs: Vec<String>,
    tent: &'static str,
}

/// Rig files in the folder, and the virtual tent.
pub(crate) fn rigs(studio: &Studio) -> Rigs {
    let is_rig = |at: &String| {
        let text = files::read_text(&studio.root.join(at)).unwrap_or_default();
        let begins = |line: &str| line.starts_with("[camera]") || line.starts_with("[greenhouse");
        text.lines().any(|line| begins(line.trim()))
    };
    let files = files_below(&studio.root).into_iter().filter(|at| at.ends_with(".toml"));
    let of_work = |at: &String| Kind::is_named_by(at.rsplit_once('/').map_or(&**at, |(_, name)| name));
    Rigs { rigs: files.filter(|at| !of_work(at) && is_rig(at)).collect(), tent: TENT }
}

/// What a rig has, and what is lit in it by hand.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct AboutRig {
    lamps: Vec<String>,
    has_flash: bool,
    is_virtual: bool,
    /// Columns and rows of a photograph, if the rig has a calibration.
    size: Option<[usize; 2]>,
    /// Seconds for which something is lit, at most.
    max_s: f64,
    state: RigState,
}

/// What a rig has, and what is lit in it by hand.
pub(crate) fn about(studio: &Studio, at: &str) -> Result<AboutRig, Refusal> {
    let (_, file) = rig(studio, at)?;
    let layout = file.layout().map_err(|error| Refusal::bad(error.to_string()))?;
    let size = file.calibration().map(|calibration| [calibration.width, calibration.height]);
    let state =
        if studio.devices.has(at) { studio.devices.ask(studio, at, Ask::State, PATIENCE)? } else { None };
    Ok(AboutRig {
        lamps: layout.lamps().iter().map(|lamp| lamp.name.clone()).collect(),
        has_flash: file.is_virtual() || file.flash.is_some(),
        is_virtual: file.is_virtual(),
        size,
        max_s: MAX_LIT_S,
        state: state.unwrap_or_default(),
    })
}

/// What a page wants of a rig.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "do", rename_all = "lowercase")]
pub(crate) enum Wish {
    /// Lights a lamp, or the flash, for some seconds.
    Light { rig: String, lamp: String, seconds: f64 },
    /// Puts all light off.
    Dark { rig: String },
    /// Takes a photograph; its lamps stay as they are.
    Photo { rig: String, has_flash: bool },
}

/// Does what a page wishes: the state of the rig after it.
pub(crate) fn grant(studio: &Studio, wish: Wish) -> Result<RigState, Refusal> {
    /// A camera may take its time, and try again.
    const ANSWERS: Duration = Duration::from_secs(120);
    let (rig, ask) = match wish {
        Wish::Dark { rig } => return dark(studio, &rig),
        Wish::Light { rig, lamp, seconds } => (rig, Ask::Light { lamp, time: time_by_hand(seconds)? }),
        Wish::Photo { rig, has_flash } => (rig, Ask::Photo { has_flash }),
    };
    let state = studio.devices.ask(studio, &rig, ask, ANSWERS)?;
    state.ok_or_else(|| Refusal::bad("the rig does not answer: a device hangs"))
}

/// Puts all light off; without the open rig where it does not answer.
fn dark(studio: &Studio, at: &str) -> Result<RigState, Refusal> {
    if let Some(state) = studio.devices.ask(studio, at, Ask::Dark, PATIENCE)? {
        return Ok(state);
    }
    let (rig, file) = rig(studio, at)?;
    if file.is_virtual() {
        return Ok(RigState::default());
    }
    let devices = SafeStatePlan { rig, dark: true }.execute(&Silent)?.devices;
    match devices.into_iter().find(|device| !device.is_off) {
        None => Ok(RigState::default()),
        Some(lit) => {
            let problem = crate::words::clean(&lit.problem.unwrap_or_default());
            Err(Refusal::bad(format!("Not off: {}: {problem}", lit.device)))
        }
    }
}
