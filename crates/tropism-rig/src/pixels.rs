//! LED strips on a data line of this computer: a frame with all pixels of the line is sent as a whole.
//!
//! Pixels keep their colour, but a voltage dip leaves them dark: a thread repeats the frame every 30 s. Several lamps may be
//! parts of one line. Nothing can be read back; only a photograph shows whether a lamp is lit.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use tropism::lighting::FULL;
use tropism::rig::RigError;

use crate::failed;
use crate::strip::Strip;
use crate::switch::Switch;

/// Red, green and blue of a pixel, linear, 0 to 255.
pub(crate) type Pixel = [f64; 3];

/// The data line to the pixels.
pub(crate) trait Wire: Send {
    /// Sends all pixels, the first one first.
    ///
    /// # Errors
    /// The failure.
    fn send(&mut self, frame: &[Pixel]) -> Result<(), String>;
}

/// Interval at which a frame is repeated: chosen by hand, against voltage dips.
const REPEAT: Duration = Duration::from_secs(30);

/// A data line and the colours of its pixels.
struct Frame {
    wire: Box<dyn Wire>,
    pixels: Vec<Pixel>,
}

impl Frame {
    fn send(&mut self) -> Result<(), String> {
        self.wire.send(&self.pixels)
    }
}

/// Repeats a frame for as long as a lamp on its line is open.
struct Keeper {
    frame: Arc<Mutex<Frame>>,
    /// Dropped at the end, which stops the thread.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Keeper {
    fn new(wire: Box<dyn Wire>, every: Duration) -> Self {
        let frame = Arc::new(Mutex::new(Frame { wire, pixels: Vec::new() }));
        let (end, ended) = mpsc::channel();
        let kept = Arc::clone(&frame);
        let thread = thread::spawn(move || {
            while ended.recv_timeout(every) == Err(RecvTimeoutError::Timeout) {
                // The next command reports the same failure.
                let _ = lock(&kept).send();
            }
        });
        Self { frame, end: Some(end), thread: Some(thread) }
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has already been reported.
            let _ = thread.join();
        }
    }
}

/// An open data line.
struct OpenWire {
    device: PathBuf,
    keeper: Weak<Keeper>,
}

/// All open data lines: several lamps may share one.
static OPEN: Mutex<Vec<OpenWire>> = Mutex::new(Vec::new());

/// A lamp on a data line.
pub(crate) struct PixelLamp {
    device: String,
    strip: Strip,
    keeper: Arc<Keeper>,
}

impl PixelLamp {
    /// Opens a lamp of `strip` on the data line `path`, which `wire` opens unless another lamp has done so.
    ///
    /// # Errors
    /// The error of `wire`.
    pub(crate) fn open(
        device: &str,
        path: &Path,
        strip: Strip,
        wire: impl FnOnce() -> Result<Box<dyn Wire>, String>,
    ) -> Result<Self, RigError> {
        Self::open_every(device, path, strip, REPEAT, wire)
    }

    fn open_every(
        device: &str,
        path: &Path,
        strip: Strip,
        every: Duration,
        wire: impl FnOnce() -> Result<Box<dyn Wire>, String>,
    ) -> Result<Self, RigError> {
        let device = format!("{device} ({})", path.display());
        let mut open = lock(&OPEN);
        open.retain(|known| known.keeper.strong_count() > 0);
        let known = open.iter().find(|known| known.device == path).and_then(|known| known.keeper.upgrade());
        let keeper = match known {
            Some(keeper) => keeper,
            None => {
                let wire = wire().map_err(|problem| failed(device.as_str(), problem))?;
                let keeper = Arc::new(Keeper::new(wire, every));
                open.push(OpenWire { device: path.to_owned(), keeper: Arc::downgrade(&keeper) });
                keeper
            }
        };
        drop(open);
        let mut frame = lock(&keeper.frame);
        let length = frame.pixels.len().max(usize::from(strip.stop()));
        frame.pixels.resize(length, [0.0; 3]);
        drop(frame);
        Ok(Self { device, strip, keeper })
    }
}

impl Switch for PixelLamp {
    fn switch(&mut self, is_on: bool) -> Result<(), RigError> {
        self.dim(if is_on { FULL } else { 0 })
    }

    /// The level is linear in duty and light.
    fn dim(&mut self, level: u8) -> Result<(), RigError> {
        let share = f64::from(level) / f64::from(FULL);
        let color = self.strip.color.map(|channel| f64::from(channel) * self.strip.duty * share);
        let mut frame = lock(&self.keeper.frame);
        frame.pixels[usize::from(self.strip.first)..usize::from(self.strip.stop())].fill(color);
        frame.send().map_err(|problem| failed(self.device.as_str(), problem))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wire that keeps what was sent.
    struct Kept(Arc<Mutex<Vec<Vec<Pixel>>>>);

    impl Wire for Kept {
        fn send(&mut self, frame: &[Pixel]) -> Result<(), String> {
            lock(&self.0).push(frame.to_vec());
            Ok(())
        }
    }

    fn strip(text: &str) -> Strip {
        toml::from_str(text).unwrap()
    }

    #[test]
    fn two_lamps_are_halves_of_one_wire() {
        let sent = Arc::new(Mutex::new(Vec::new()));
        let lamp = |text: &str| {
            let wire = || Ok(Box::new(Kept(Arc::clone(&sent))) as Box<dyn Wire>);
            PixelLamp::open("lamp", Path::new("/test/halves"), strip(text), wire).unwrap()
        };
        let (mut left, mut right) = (lamp("pixels = 2"), lamp("first = 2\npixels = 1\ncolor = [255, 0, 10]"));
        right.switch(true).unwrap();
        right.switch(false).unwrap();
        left.switch(true).unwrap();
        let (dark, white, own) = ([0.0; 3], [127.5; 3], [127.5, 0.0, 5.0]);
        assert_eq!(*lock(&sent), [vec![dark, dark, own], vec![dark; 3], vec![white, white, dark]]);
        lock(&sent).clear();
        left.dim(51).unwrap();
        right.dim(102).unwrap();
        let [dim, half] = [[25.5; 3], [51.0, 0.0, 2.0]];
        assert_eq!(*lock(&sent), [vec![dim, dim, dark], vec![dim, dim, half]]);
    }

    #[test]
    fn the_frame_is_sent_again_until_the_lamp_is_gone() {
        let sent = Arc::new(Mutex::new(Vec::new()));
        let wire = || Ok(Box::new(Kept(Arc::clone(&sent))) as Box<dyn Wire>);
        let every = Duration::from_millis(2);
        let path = Path::new("/test/again");
        let mut lamp = PixelLamp::open_every("lamp", path, strip("pixels = 1"), every, wire).unwrap();
        lamp.switch(true).unwrap();
        while lock(&sent).iter().filter(|frame| frame[0] == [127.5; 3]).count() < 3 {
            thread::sleep(every);
        }
        drop(lamp);
        let count = lock(&sent).len();
        thread::sleep(10 * every);
        assert_eq!(lock(&sent).len(), count);
    }

    #[test]
    fn a_wire_that_cannot_be_opened_is_named() {
        let error = PixelLamp::open("left lamp", Path::new("/test/absent"), strip("pixels = 1"), || {
            Err("cannot be opened: no such file".to_owned())
        });
        let error = error.err().unwrap().to_string();
        assert_eq!(error, "left lamp (/test/absent): cannot be opened: no such file");
    }
}
