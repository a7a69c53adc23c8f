//! The guard of a real run, from the side of the run: a process that hears that it lives. [`crate::guard`] is the other side.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use tropism_rig::file::{LampsTable, RigFile};

use crate::files::FileError;

/// What a run says while it lives.
const ALIVE: u8 = b'.';

/// What a run says that has ended in order.
pub(crate) const ENDED: u8 = b'!';

/// What a run says that has ended in order, but has a device that does not confirm that it is off.
pub(crate) const LIT: u8 = b'?';

/// How often a run says that it lives.
pub(crate) const BEAT: Duration = Duration::from_secs(1);

/// A running guard, from the side of the run.
#[derive(Debug)]
pub(crate) struct Guard {
    child: Child,
    last: Instant,
}

impl Guard {
    /// Starts `program guard RUN --silence S`, for the run in the folder `run`. What it does is written into `guard.log`
    /// there.
    ///
    /// # Errors
    /// [`FileError::Disk`] if it cannot be started.
    pub(crate) fn start(program: &Path, run: &Path, silence: Duration) -> Result<Self, FileError> {
        let disk = |source| FileError::Disk { action: "start the guard", path: program.to_owned(), source };
        let log = OpenOptions::new().create(true).append(true).open(run.join("guard.log")).map_err(disk)?;
        let mut command = Command::new(program);
        command.arg("guard").arg(run).args(["--silence", &silence.as_secs().to_string()]);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(log);
        // A process group of its own: Ctrl-C and a closed terminal end the run, and not its guard.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let child = command.spawn().map_err(disk)?;
        // A guard that is stopped lets the pipe fill up: a full one must not hold the run.
        #[cfg(unix)]
        if let Some(pipe) = &child.stdin {
            let _ = rustix::fs::fcntl_setfl(pipe, rustix::fs::OFlags::NONBLOCK);
        }
        Ok(Self { child, last: Instant::now() })
    }

    /// Says that the run lives.
    pub(crate) fn beat(&mut self) {
        if self.last.elapsed() >= BEAT {
            self.last = Instant::now();
            self.say(ALIVE);
        }
    }

    /// Says that the run has ended in order. A guard is left alone with a light that is not confirmed to be off. A guard
    /// that is dropped before hears that the run has died.
    pub(crate) fn end(&mut self, is_dark: bool) {
        self.say(if is_dark { ENDED } else { LIT });
        drop(self.child.stdin.take());
        if is_dark {
            let _ = self.child.wait();
        }
    }

    fn say(&mut self, word: u8) {
        // A guard that has died is missed at the end of the run only; the devices' own timers remain.
        let _ = self.child.stdin.as_mut().map(|pipe| pipe.write_all(&[word]));
    }
}

/// How long a run may be silent: its longest step, several times over. `rig` says how long each device may take.
pub(crate) fn silence(rig: &RigFile) -> Duration {
    let camera = rig.camera.as_ref().map_or(0.0, |camera| {
        let (try_s, tries) = camera.longest_s();
        try_s * f64::from(tries)
    });
    let lamps = rig.lamps.as_ref().map_or(0.0, LampsTable::longest_s);
    let flash: f64 = rig.flash.as_ref().map_or(0.0, |flash| flash.longest_s());
    Duration::from_secs_f64(60.0 + 3.0 * (camera + lamps + flash))
}
