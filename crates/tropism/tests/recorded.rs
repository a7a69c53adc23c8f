//! A run folder survives whatever ends the program: the run goes on as if nothing had happened.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::Path;
use std::rc::Rc;
use std::time::Duration;

use tropism::control::chase::Chase;
use tropism::environment::{run, unwatched};
use tropism::experiment::{
    Durability, EventKind, Journal, RecordError, Recorded, RunFolder, Unwatched, files,
};
use tropism::geometry::{Pixel, Point, Region};
use tropism::light::Light;
use tropism::photo::{Image, Photo};
use tropism::rig::{Camera, Clock, Flash, Lamps, Rig, RigError};
use tropism::task::Task;
use tropism::track::Track;
use tropism::vision::{Calibration, Eye, VisionConfig};

/// A straight stem that grows and leans to the lit lamp, and a log of what was done to it.
#[derive(Default)]
struct Tent {
    lean: f64,
    minutes: f64,
    lit: Option<Light>,
    has_flash: bool,
    photographs: u32,
    lights: Vec<Option<Light>>,
    /// Photographs that come out black, by minute.
    dark_at: Vec<u32>,
}

#[derive(Clone)]
struct Hand(Rc<RefCell<Tent>>);

const CALIBRATION: Calibration = Calibration::flat(Pixel::new(100.0, 189.0), 10.0, 200, 200);

impl Camera for Hand {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        let mut tent = self.0.borrow_mut();
        tent.photographs += 1;
        let mut image = Image { width: 200, height: 200, rgb: vec![12; 3 * 200 * 200] };
        let is_dark = !tent.has_flash || tent.dark_at.contains(&(tent.minutes as u32));
        let height = 4.0 + 0.02 * tent.minutes;
        for step in 0..=(if is_dark { 0 } else { 400 }) {
            let share = f64::from(step) / 400.0;
            let centre = CALIBRATION.pixel(Point::new(tent.lean * share * share, height * share));
            for offset in -2..=2 {
                let (x, y) = ((centre.x.round() as i64 + offset) as usize, centre.y.round() as usize);
                image.rgb[3 * (200 * y + x)..][..3].copy_from_slice(&[150, 210, 80]);
            }
        }
        let bytes = image.to_jpeg(90).unwrap();
        Ok(Photo { name: String::new(), bytes, time_s: 0.0 })
    }
}

impl Lamps for Hand {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        let mut tent = self.0.borrow_mut();
        tent.lit = light;
        tent.lights.push(light);
        Ok(())
    }
}

impl Flash for Hand {
    fn flash(&mut self, is_on: bool) -> Result<(), RigError> {
        self.0.borrow_mut().has_flash = is_on;
        Ok(())
    }
}

impl Clock for Hand {
    fn wait_until(&mut self, since_start: Duration) {
        let mut tent = self.0.borrow_mut();
        let minutes = since_start.as_secs_f64() / 60.0;
        let sign = tent.lit.map_or(0.0, Light::sign);
        tent.lean = (tent.lean + 0.02 * sign * (minutes - tent.minutes)).clamp(-7.0, 7.0);
        tent.minutes = minutes;
    }

    fn relive(&mut self, light: Light, until: Duration) {
        self.0.borrow_mut().lit = Some(light);
        self.wait_until(until);
    }
}

fn task() -> Task {
    Task { max_steps: 60, end_height_cm: 1e9, ..Task::default() }
}

type Recording = Recorded<Hand, Hand, Hand, Hand>;

fn open(path: &Path, is_resumed: bool, dark_at: &[u32]) -> Result<(Recording, Hand), RecordError> {
    let hand = Hand(Rc::new(RefCell::new(Tent { dark_at: dark_at.to_vec(), ..Tent::default() })));
    let config = VisionConfig {
        crop: Some(Region { x: 0, y: 0, width: 200, height: 185 }),
        ..VisionConfig::default()
    };
    let eye = Eye::new(CALIBRATION, config).unwrap();
    let device = || hand.clone();
    let rig = Rig::new(device(), device(), device(), device(), eye, Duration::from_secs(300));
    let folder = RunFolder::open(path, "seed = 1\n", Durability::Fast, is_resumed)?;
    Ok((Recorded::new(rig, folder, Box::new(Unwatched))?, hand))
}

/// Goes on with the run in `path` for at most `steps` samples.
fn go(path: &Path, is_resumed: bool, dark_at: &[u32], steps: usize) -> (Track, Hand) {
    let (mut world, hand) = open(path, is_resumed, dark_at).unwrap();
    let mut controller = Chase::new(task().targets);
    let mut left = steps;
    let mut watch = |_: &_| {
        left -= 1;
        if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let track = run(&mut world, &mut controller, &task(), &mut watch).unwrap();
    (track, hand)
}

fn whole(dark_at: &[u32]) -> (tempfile::TempDir, Track) {
    let folder = tempfile::tempdir().unwrap();
    let (track, _) = go(folder.path(), false, dark_at, usize::MAX);
    assert_eq!(track.samples.len(), 61);
    (folder, track)
}

#[test]
fn a_run_broken_off_anywhere_ends_as_if_it_had_not_been() {
    let dark = [50, 55, 60, 200];
    let (reference, track) = whole(&dark);
    for breaks in [vec![1], vec![2, 1], vec![11, 12, 13], vec![30, 60], vec![61]] {
        let folder = tempfile::tempdir().unwrap();
        for (turn, &steps) in breaks.iter().enumerate() {
            go(folder.path(), turn > 0, &dark, steps);
        }
        let (resumed, hand) = go(folder.path(), true, &dark, usize::MAX);
        assert_eq!(resumed, track, "broken off after {breaks:?}");
        for step in 0..=60 {
            let name = format!("photographs/{step:06}.jpg");
            assert_eq!(
                std::fs::read(folder.path().join(&name)).unwrap(),
                std::fs::read(reference.path().join(&name)).unwrap(),
                "{name} after {breaks:?}"
            );
        }
        // What was recorded before is not done again.
        let before: usize = *breaks.iter().max().unwrap();
        assert_eq!(hand.0.borrow().photographs as usize, 61 - before);
    }
}

#[test]
fn lamps_are_dark_when_a_run_ends() {
    let folder = tempfile::tempdir().unwrap();
    let (_, hand) = go(folder.path(), false, &[], 20);
    let tent = hand.0.borrow();
    assert_eq!(tent.lights.last(), Some(&None));
    assert!(tent.lights[..19].iter().all(Option::is_some));
    assert!(!tent.has_flash);
}

#[test]
fn the_journal_holds_what_was_seen_and_done() {
    let (reference, track) = whole(&[50]);
    let (world, _) = open(reference.path(), true, &[50]).unwrap();
    let rows = world.folder().rows().unwrap();
    assert_eq!(rows.len(), 61);
    for (row, sample) in rows.iter().zip(&track.samples) {
        assert_eq!(row.decided, sample.light);
        assert_eq!(row.is_done, sample.light.is_some());
        let bytes = std::fs::read(reference.path().join("photographs").join(&row.photo)).unwrap();
        assert_eq!((row.photo_bytes, &row.photo_sha256), (bytes.len() as u64, &files::sha256(&bytes)));
    }
    assert_eq!(rows[10].seen.class.name(), "dark");
    world.folder().write_track(&track).unwrap();
    let written = files::read_track(&reference.path().join("track.csv")).unwrap();
    assert_eq!(written.samples[10].quality.name(), "held");
    assert_eq!(written.samples[10].tip, written.samples[9].tip);
    assert_eq!(written.columns[0].values[3], "000003.jpg");
    assert_eq!(written.columns[1].values[10], "", "a held tip has no place in the photograph");
}

#[test]
fn a_controller_that_decides_otherwise_is_found_out() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), false, &[], 30);
    let (mut world, _) = open(folder.path(), true, &[]).unwrap();
    let mut other = Chase::new(vec![Point::new(-9.0, 20.0)]);
    let error = run(&mut world, &mut other, &task(), &mut unwatched).unwrap_err();
    assert!(error.to_string().contains("step 0: found the decision right"), "{error}");
}

#[test]
fn a_folder_is_not_taken_twice() {
    let folder = tempfile::tempdir().unwrap();
    let (world, _) = open(folder.path(), false, &[]).unwrap();
    let error = |is_resumed| open(folder.path(), is_resumed, &[]).err().unwrap().to_string();
    assert!(error(false).contains("--resume"), "{}", error(false));
    assert!(error(true).contains("in use"), "{}", error(true));
    drop(world);
    let other = RunFolder::open(folder.path(), "seed = 2\n", Durability::Fast, true).unwrap_err().to_string();
    assert!(other.contains("found a run that was started with other settings (\"seed = 1\")"), "{other}");
}

#[test]
fn a_journal_that_is_none_is_named() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), false, &[], 5);
    std::fs::write(folder.path().join("journal.sqlite"), b"this is not a database, not at all").unwrap();
    let _ = std::fs::remove_file(folder.path().join("journal.sqlite-wal"));
    let error = open(folder.path(), true, &[]).err().unwrap().to_string();
    assert!(error.contains("journal.sqlite"), "{error}");
}

#[test]
fn a_first_photograph_without_a_plant_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let (mut world, _) = open(folder.path(), false, &[0]).unwrap();
    let error = run(&mut world, &mut Chase::new(task().targets), &task(), &mut unwatched).unwrap_err();
    assert!(error.to_string().contains("000000.jpg: found no plant (dark)"), "{error}");
}

#[test]
fn what_happened_to_a_run_stands_in_its_journal() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), false, &[], 20);
    go(folder.path(), true, &[], 30);
    let journal = Journal::open_to_read(&folder.path().join("journal.sqlite")).unwrap();
    let events: Vec<_> =
        journal.events().unwrap().into_iter().map(|event| (event.step, event.kind, event.text)).collect();
    assert_eq!(events[0], (0, EventKind::Started, "the run begins".to_owned()));
    assert_eq!(events[1], (19, EventKind::Resumed, "found 20 steps, going on with the next".to_owned()));
    assert_eq!(journal.state().unwrap().unwrap().kind, EventKind::Resumed);
}
