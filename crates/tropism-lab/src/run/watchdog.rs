//! The watchdog of a real run, from the side of the run: starts it, gives it signs of life, and starts another one when it
//! dies or hangs. [`crate::watchdog`] is the other side.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use tropism::rig::HealthProblem;
use tropism_rig::file::{LampsTable, RigFile};

use crate::error::Error;
use crate::files::FileError;
use crate::watchdog::{ALIVE, ENDED, LIT, WatchdogPlan};

/// Time between two signs of life.
const BEAT: Duration = Duration::from_secs(1);

/// How many signs of life may remain without an answer; chosen, above what a busy or swapping computer needs. Counted, so that
/// a computer that was frozen does not make a watchdog late.
const MAX_UNANSWERED: u32 = 10;

/// Pause before a watchdog is started that stands in for one that died at once.
const RESTART_PAUSE: Duration = Duration::from_secs(1);

/// How long a watchdog may take to end, or to hear that a light is left to it.
const END_WAIT: Duration = Duration::from_secs(5);

/// Keeps a watchdog at the side of a run. When it is dropped without [`end`](Self::end), the watchdog takes the run for dead.
#[derive(Debug)]
pub(crate) struct Watchdog(Arc<Mutex<Kept>>);

#[derive(Debug)]
struct Kept {
    launch: Launch,
    child: Child,
    /// To the watchdog.
    pipe: Option<ChildStdin>,
    last_beat: Instant,
    unanswered: u32,
    /// What happened to a watchdog since the last [`Watchdog::health`].
    problem: Option<String>,
    /// Whether a watchdog that ends is not missed.
    is_over: bool,
}

/// All that a further watchdog needs. The disk of the run is not asked again.
#[derive(Debug)]
struct Launch {
    program: PathBuf,
    run: PathBuf,
    plan: String,
    /// What it does; without a file on stderr.
    log: Option<File>,
}

impl Launch {
    fn start(&self) -> io::Result<Child> {
        let mut command = Command::new(as_it_was(&self.program));
        command.arg("watchdog").arg(&self.run);
        let log =
            self.log.as_ref().map_or_else(|| Ok(Stdio::inherit()), |log| log.try_clone().map(Into::into))?;
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(log);
        // A process group of its own: Ctrl-C and a closed terminal end the run, and not its watchdog.
        #[cfg(unix)]
        {
            use std::os::unix::process::CommandExt;
            command.process_group(0).arg0("tropism");
        }
        let mut child = command.spawn()?;
        // One that dies at once is noticed as any other.
        let _ = child.stdin.as_mut().map(|pipe| pipe.write_all(self.plan.as_bytes()));
        // A watchdog that is stopped lets the pipe fill up: a full one must not hold the run.
        #[cfg(unix)]
        if let Some(pipe) = &child.stdin {
            let _ = rustix::fs::fcntl_setfl(pipe, rustix::fs::OFlags::NONBLOCK);
        }
        Ok(child)
    }
}

impl Watchdog {
    /// Starts `program watchdog RUN` for the run of this process in the folder `run`. What it does is written into
    /// `watchdog.log` there; on stderr where `run` is no folder, but the rig file of one who switches by hand.
    ///
    /// # Errors
    /// [`FileError::Disk`] if it cannot be started.
    pub(crate) fn start(program: &Path, run: &Path, rig: &RigFile) -> Result<Self, Error> {
        let disk =
            |source| FileError::Disk { action: "start the watchdog", path: program.to_owned(), source };
        let plan =
            WatchdogPlan { process: std::process::id(), silence_s: silence(rig).as_secs(), rig: rig.clone() };
        let plan = toml::to_string(&plan).map_err(Error::at("plan of the watchdog"))? + "\0";
        let open = || OpenOptions::new().create(true).append(true).open(run.join("watchdog.log"));
        let log = run.is_dir().then(open).transpose().map_err(disk)?;
        let launch = Launch { program: program.to_owned(), run: run.to_owned(), plan, log };
        let mut child = launch.start().map_err(disk)?;
        let (pipe, answers) = (child.stdin.take(), child.stdout.take());
        let kept = Arc::new(Mutex::new(Kept {
            launch,
            child,
            pipe,
            last_beat: Instant::now(),
            unanswered: 0,
            problem: None,
            is_over: false,
        }));
        let keeper = Arc::clone(&kept);
        thread::spawn(move || keep(&keeper, answers));
        Ok(Self(kept))
    }

    /// Gives a sign of life, if it is time for one. A watchdog that does not answer is killed, and another one is started.
    pub(crate) fn beat(&self) {
        let mut kept = lock(&self.0);
        if kept.last_beat.elapsed() >= BEAT {
            kept.last_beat = Instant::now();
            kept.say(ALIVE);
            if kept.unanswered > MAX_UNANSWERED {
                let _ = kept.child.kill();
            }
        }
    }

    /// What happened to a watchdog since this was asked last.
    pub(crate) fn health(&self) -> Vec<HealthProblem> {
        let problem = lock(&self.0).problem.take();
        problem.into_iter().map(|text| HealthProblem { what: "watchdog", text }).collect()
    }

    /// Says that the run has ended in order. A watchdog is left alone with a light that is not confirmed to be off.
    pub(crate) fn end(&self, is_dark: bool) {
        {
            let mut kept = lock(&self.0);
            kept.is_over = true;
            kept.unanswered = 0;
            kept.say(if is_dark { ENDED } else { LIT });
            kept.pipe = None;
        }
        let began = Instant::now();
        while began.elapsed() < END_WAIT {
            let mut kept = lock(&self.0);
            if matches!(kept.child.try_wait(), Ok(Some(_))) && is_dark || kept.unanswered == 0 {
                return;
            }
            drop(kept);
            thread::sleep(Duration::from_millis(10));
        }
        // It hangs.
        let mut kept = lock(&self.0);
        let _ = kept.child.kill();
        if !is_dark && let Ok(mut child) = kept.launch.start() {
            let _ = child.stdin.as_mut().map(|pipe| pipe.write_all(&[LIT]));
        }
    }
}

impl Drop for Watchdog {
    fn drop(&mut self) {
        let mut kept = lock(&self.0);
        kept.is_over = true;
        kept.pipe = None;
    }
}

impl Kept {
    fn say(&mut self, word: u8) {
        self.unanswered += 1;
        // The keeper notices a watchdog that is gone.
        let _ = self.pipe.as_mut().map(|pipe| pipe.write_all(&[word]));
    }
}

fn lock(kept: &Mutex<Kept>) -> MutexGuard<'_, Kept> {
    kept.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Reads the answers of a watchdog; when it is gone, starts another one.
fn keep(kept: &Mutex<Kept>, mut answers: Option<ChildStdout>) {
    let mut words = [0; 64];
    loop {
        let began = Instant::now();
        while let Some(Ok(1..)) = answers.as_mut().map(|answers| answers.read(&mut words)) {
            lock(kept).unanswered = 0;
        }
        let wait = RESTART_PAUSE.saturating_sub(began.elapsed());
        if !wait.is_zero() {
            thread::sleep(wait);
        }
        let mut kept = lock(kept);
        let _ = kept.child.kill();
        let status = kept.child.wait();
        if kept.is_over {
            return;
        }
        let status = status.map_or_else(|error| error.to_string(), |status| status.to_string());
        let problem = match kept.launch.start() {
            Ok(mut child) => {
                (kept.pipe, answers, kept.unanswered) = (child.stdin.take(), child.stdout.take(), 0);
                kept.child = child;
                "another one was started".to_owned()
            }
            Err(error) => {
                answers = None;
                format!("no other one can be started: {error}")
            }
        };
        kept.problem = Some(format!("the watchdog ended ({status}); {problem}"));
    }
}

/// `program`; if it is the one that runs now and its file was replaced or deleted, that file as it was.
fn as_it_was(program: &Path) -> &Path {
    let this = Path::new("/proc/self/exe");
    let deleted = format!("{} (deleted)", program.display());
    if std::fs::read_link(this).is_ok_and(|now| now == Path::new(&deleted)) { this } else { program }
}

/// How long a run may be silent: its longest step, several times over. `rig` says how long each device may take.
fn silence(rig: &RigFile) -> Duration {
    let camera = rig.camera.as_ref().map_or(0.0, |camera| {
        let (try_s, tries) = camera.longest_s();
        try_s * f64::from(tries)
    });
    let lamps = rig.lamps.as_ref().map_or(0.0, LampsTable::longest_s);
    let flash: f64 = rig.flash.as_ref().map_or(0.0, |flash| flash.longest_s());
    Duration::from_secs_f64(60.0 + 3.0 * (camera + lamps + flash))
}
