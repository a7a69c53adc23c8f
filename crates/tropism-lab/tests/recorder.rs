//! A run folder survives whatever ends the program: the run goes on as if nothing had happened.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::ops::{ControlFlow, Range};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Duration;

use tropism::control::{Greedy, Periodic};
use tropism::environment::{run, unwatched};
use tropism::geometry::{Pixel, Point, Region};
use tropism::lamps::{Layout, Light};
use tropism::lighting::{Allowed, Lighting};
use tropism::photo::{Image, Photo};
use tropism::programme::{Part, Programme, TimeOfDay};
use tropism::rig::{Boot, Camera, Clock, Flash, Lamps, Moment, OnExit, Rig, RigError};
use tropism::rig::{
    Durability, Event, EventKind, FaultPolicy, HealthProblem, LampsInView, OnFault, RunMonitor,
};
use tropism::task::Task;
use tropism::track::{Sample, Track};
use tropism::vision::{Calibration, TipTracker, VisionConfig};
use tropism_lab::{Journal, LightLimits, RecordError, Recorder, RunFolder, StepRecord, Supervision, files};

/// A straight stem that grows and leans to the lit lamp, what goes wrong in its tent, and a log of what was done to it.
#[derive(Default)]
struct Tent {
    lean: f64,
    minutes: f64,
    /// Minutes for which a lamp was lit.
    lit_min: f64,
    lit: Option<Light>,
    has_flash: bool,
    photographs: u32,
    /// The latest photograph.
    last: Vec<u8>,
    lights: Vec<Option<Light>>,
    wrong: Wrong,
}

/// What goes wrong, by minute.
#[derive(Clone, Default)]
struct Wrong {
    /// Photographs that come out black, by minute and by their number from 1.
    dark_at: Vec<u32>,
    dark: Vec<u32>,
    /// By how many pixels the camera's picture stands to the right, from which minute on.
    moved: Option<(u32, usize)>,
    /// Photographs that are none.
    camera_fails: Range<u32>,
    /// Photographs that take so many minutes.
    camera_takes: Vec<(u32, f64)>,
    /// Photographs that show what the one before showed, in a file with a comment of its own.
    frozen: Range<u32>,
    /// Commands that the lamps do not obey, and say so.
    lamps_fail: Range<u32>,
    /// Commands that the lamps do not obey, and say nothing.
    lamps_lie: Range<u32>,
    /// What becomes of its lamps at the end.
    on_exit: OnExit,
    /// The minute at which a program opens it.
    opens: f64,
    /// Whether it has the clocks of a real tent; the one on the wall is set by two hours after 100 minutes.
    is_real: bool,
}

impl Tent {
    fn is_in(&self, range: &Range<u32>) -> bool {
        range.contains(&(self.minutes as u32))
    }

    fn advance_to(&mut self, minutes: f64) {
        let sign = self.lit.map_or(0.0, |light| Layout::default().side(light));
        self.lit_min += self.lit.map_or(0.0, |_| minutes - self.minutes);
        self.lean = (self.lean + 0.02 * sign * (minutes - self.minutes)).clamp(-7.0, 7.0);
        self.minutes = minutes;
    }
}

#[derive(Clone)]
struct Hand(Rc<RefCell<Tent>>);

const CALIBRATION: Calibration = Calibration::from_scale(Pixel::new(100.0, 189.0), 10.0, 200, 200);

fn failed(device: &str) -> RigError {
    RigError::Device { device: device.to_owned(), problem: "found silence, wanted an answer".to_owned() }
}

impl Camera for Hand {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        let mut tent = self.0.borrow_mut();
        tent.photographs += 1;
        if tent.is_in(&tent.wrong.camera_fails) {
            return Err(failed("camera"));
        }
        let mut image = Image { width: 200, height: 200, rgb: vec![12; 3 * 200 * 200] };
        let is_dark = !tent.has_flash
            || tent.wrong.dark_at.contains(&(tent.minutes as u32))
            || tent.wrong.dark.contains(&tent.photographs);
        let height = 4.0 + 0.02 * tent.minutes;
        for step in 0..=(if is_dark { 0 } else { 400 }) {
            let share = f64::from(step) / 400.0;
            let centre = CALIBRATION.pixel(Point::new(tent.lean * share * share, height * share));
            for offset in -2..=2 {
                let (x, y) = ((centre.x.round() as i64 + offset) as usize, centre.y.round() as usize);
                image.rgb[3 * (200 * y + x)..][..3].copy_from_slice(&[150, 210, 80]);
            }
        }
        // The lit lamp, below the crop.
        if let Some(light) = tent.lit.filter(|_| !is_dark) {
            let left = if light == Light::LEFT { 4 } else { 180 };
            (190..198).for_each(|y| image.rgb[3 * (200 * y + left)..][..48].fill(250));
        }
        if let Some((from, right)) = tent.wrong.moved.filter(|_| !is_dark) {
            // Faint bricks beside the plant, which stand still, and all of it moved.
            for (x, y) in (0..26).chain(174..200).flat_map(|x| (0..190).map(move |y| (x, y))) {
                let (row, column) = (y / 11, (x + 5 * (y / 11 % 3)) / 9);
                let shade = 14 + 4 * ((7 * row + 5 * column + row * column) % 6);
                image.rgb[3 * (200 * y + x)..][..3].fill(shade as u8);
            }
            let right = if tent.minutes as u32 >= from { right } else { 0 };
            for line in image.rgb.chunks_exact_mut(3 * 200) {
                line.copy_within(..3 * (200 - right), 3 * right);
            }
        }
        let mut bytes = image.to_jpeg(90).unwrap();
        if tent.is_in(&tent.wrong.frozen) {
            let comment = [&[0xff, 0xfe, 0, 6][..], &tent.photographs.to_be_bytes()].concat();
            bytes = [&tent.last[..2], &comment, &tent.last[2..]].concat();
        } else {
            tent.last.clone_from(&bytes);
        }
        let minutes = tent.minutes;
        if let Some(&(_, takes)) = tent.wrong.camera_takes.iter().find(|(at, _)| *at == minutes as u32) {
            tent.advance_to(minutes + takes);
        }
        Ok(Photo { name: String::new(), bytes, time_s: 0.0 })
    }
}

impl Lamps for Hand {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        let mut tent = self.0.borrow_mut();
        if light.is_some() && tent.is_in(&tent.wrong.lamps_fail) {
            return Err(failed("left lamp"));
        }
        if light.is_none() || !tent.is_in(&tent.wrong.lamps_lie) {
            tent.lit = light;
        }
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
    fn wait_until(
        &mut self,
        since_start: Duration,
        meanwhile: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let minutes = since_start.as_secs_f64() / 60.0;
        let now = self.0.borrow().minutes;
        if minutes > now {
            self.0.borrow_mut().advance_to(minutes);
            meanwhile()?;
        }
        ControlFlow::Continue(())
    }

    fn now(&self) -> Option<Moment> {
        let tent = self.0.borrow();
        let wall_s = if tent.minutes > 100.0 { 1e9 + 7200.0 } else { 1e9 };
        let since_start = Duration::from_secs_f64(60.0 * tent.minutes);
        tent.wrong.is_real.then_some(Moment { since_start, unix_s: wall_s + since_start.as_secs_f64() })
    }

    fn boot(&self) -> Option<Boot> {
        let boot = Boot { id: "a".to_owned(), start_s: 7.0, is_wall_set: true };
        self.0.borrow().wrong.is_real.then_some(boot)
    }

    /// It begins at 08:00.
    fn time_of_day(&self) -> TimeOfDay {
        TimeOfDay::new(8, 0).later(self.0.borrow().minutes as u64)
    }

    fn replay(&mut self, lighting: Lighting, until: Duration) {
        let mut tent = self.0.borrow_mut();
        tent.lit = lighting.single().flatten();
        tent.advance_to(until.as_secs_f64() / 60.0);
    }
}

/// Steps of a run: the last things go wrong at minute 200, which is step 40.
const STEPS: u32 = 45;
const SAMPLES: usize = STEPS as usize + 1;

fn task() -> Task {
    Task { max_steps: STEPS, end_height_cm: 1e9, ..Task::default() }
}

type Recording = Recorder<'static, Hand, Hand, Hand, Hand>;

fn open(path: &Path, is_resumed: bool, dark_at: &[u32]) -> Result<(Recording, Hand), RecordError> {
    let wrong = Wrong { dark_at: dark_at.to_vec(), ..Wrong::default() };
    open_with(path, is_resumed, wrong, Supervision::default())
}

fn open_with(
    path: &Path,
    is_resumed: bool,
    wrong: Wrong,
    supervision: Supervision<'static>,
) -> Result<(Recording, Hand), RecordError> {
    let on_exit = wrong.on_exit;
    let hand = Hand(Rc::new(RefCell::new(Tent { minutes: wrong.opens, wrong, ..Tent::default() })));
    let config = VisionConfig {
        crop: Some(Region { x: 0, y: 0, width: 200, height: 185 }),
        ..VisionConfig::default()
    };
    let tracker = TipTracker::new(CALIBRATION, config).unwrap();
    let device = || hand.clone();
    let rig = Rig::new(device(), device(), device(), device(), tracker, Duration::from_secs(300));
    let rig = rig.with_on_exit(on_exit);
    let folder = RunFolder::open(path, "seed = 1\n", Durability::Fast, is_resumed)?;
    Ok((Recorder::new(rig, folder, supervision)?, hand))
}

/// Goes on with the run in `path` for at most `steps` samples.
fn go(path: &Path, is_resumed: bool, dark_at: &[u32], steps: usize) -> (Track, Hand) {
    let (mut world, hand) = open(path, is_resumed, dark_at).unwrap();
    let mut controller = Greedy::new(&task(), &Layout::default());
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
    assert_eq!(track.samples.len(), SAMPLES);
    (folder, track)
}

fn steps_of(path: &Path) -> Vec<StepRecord> {
    Journal::open_to_read(&path.join("journal.sqlite")).unwrap().steps().unwrap()
}

#[test]
fn a_run_broken_off_anywhere_ends_as_if_it_had_not_been() {
    let dark = [50, 55, 60, 200];
    let (reference, track) = whole(&dark);
    for breaks in [vec![1], vec![2, 1], vec![11, 12, 13], vec![30, 45], vec![SAMPLES]] {
        let folder = tempfile::tempdir().unwrap();
        for (turn, &steps) in breaks.iter().enumerate() {
            go(folder.path(), turn > 0, &dark, steps);
        }
        let (resumed, hand) = go(folder.path(), true, &dark, usize::MAX);
        assert_eq!(resumed, track, "broken off after {breaks:?}");
        assert_eq!(steps_of(folder.path()), steps_of(reference.path()), "broken off after {breaks:?}");
        for step in 0..=STEPS {
            let name = format!("photographs/{step:06}.jpg");
            assert_eq!(
                std::fs::read(folder.path().join(&name)).unwrap(),
                std::fs::read(reference.path().join(&name)).unwrap(),
                "{name} after {breaks:?}"
            );
        }
        // What was recorded before is not done again.
        let before: usize = *breaks.iter().max().unwrap();
        assert_eq!(hand.0.borrow().photographs as usize, SAMPLES - before);
    }
}

#[test]
fn lamps_are_dark_when_a_run_ends() {
    let folder = tempfile::tempdir().unwrap();
    let (_, hand) = go(folder.path(), false, &[], 20);
    let tent = hand.0.borrow();
    assert_eq!(tent.lights.last(), Some(&None));
    assert_eq!(tent.lights[0], None, "and when it begins");
    assert!(tent.lights[1..20].iter().all(Option::is_some));
    assert!(!tent.has_flash);
}

#[test]
fn lamps_stay_lit_if_that_is_wanted_however_the_run_ends() {
    for (on_exit, is_dark) in [(OnExit::Dark, true), (OnExit::Keep, false)] {
        let left = |ends_at: Option<u32>, has_panicked: bool| {
            let folder = tempfile::tempdir().unwrap();
            let wrong = Wrong { on_exit, is_real: true, ..Wrong::default() };
            let monitor = Box::new(EventLog { ends_at, ..EventLog::default() });
            let (mut world, hand) =
                open_with(folder.path(), true, wrong, Supervision { monitor, ..Supervision::default() })
                    .unwrap();
            let ended = std::panic::catch_unwind(std::panic::AssertUnwindSafe(move || {
                let mut watch = |sample: &Sample| match sample.step {
                    5 if has_panicked => panic!("as a test"),
                    _ => ControlFlow::Continue(()),
                };
                run(&mut world, &mut Greedy::new(&task(), &Layout::default()), &task(), &mut watch).is_ok()
            }));
            assert_eq!(
                (ended.is_err(), ended.unwrap_or(false)),
                (has_panicked, ends_at.is_none() && !has_panicked)
            );
            let tent = hand.0.borrow();
            assert!(!tent.has_flash);
            tent.lit.is_none()
        };
        assert_eq!(left(None, false), is_dark, "{on_exit:?}: at its end");
        assert_eq!(left(Some(10), false), is_dark, "{on_exit:?}: when it is asked to end");
        assert_eq!(left(None, true), is_dark, "{on_exit:?}: when it panics");
    }
}

#[test]
fn the_journal_holds_what_was_seen_and_done() {
    let (reference, track) = whole(&[50]);
    let (world, _) = open(reference.path(), true, &[50]).unwrap();
    let rows = world.folder().steps().unwrap();
    assert_eq!(rows.len(), SAMPLES);
    for (row, sample) in rows.iter().zip(&track.samples) {
        assert_eq!(row.decided, sample.light.map(Lighting::only));
        assert_eq!(row.is_confirmed, sample.light.is_some());
        let bytes = std::fs::read(reference.path().join("photographs").join(&row.photo)).unwrap();
        assert_eq!((row.photo_bytes, &row.photo_sha256), (bytes.len() as u64, &files::sha256(&bytes)));
    }
    assert_eq!(rows[10].seen.status.name(), "dark");
    // A stem carried forward is recorded as well: a controller may see it, and sees the same in a replay.
    let stem = |row: &StepRecord| row.seen.observation.as_ref().unwrap().stem.clone().unwrap();
    assert_eq!(stem(&rows[9]).0.len(), 10);
    assert_eq!(stem(&rows[10]), stem(&rows[9]));
    world.folder().write_track(&track).unwrap();
    let written = files::read_track(&reference.path().join("track.csv")).unwrap();
    assert_eq!(written.samples[10].quality.name(), "carried_forward");
    assert_eq!(written.samples[10].tip, written.samples[9].tip);
    assert_eq!(written.columns[0].values.text(3), "000003.jpg");
    assert_eq!(
        written.columns[1].values.text(10),
        "",
        "a tip carried forward has no place in the photograph"
    );
}

#[test]
fn a_controller_that_decides_otherwise_is_found_out() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), false, &[], 30);
    let (mut world, _) = open(folder.path(), true, &[]).unwrap();
    let elsewhere = Task { targets: vec![Point::new(-9.0, 20.0)], ..Task::default() };
    let mut other = Greedy::new(&elsewhere, &Layout::default());
    let error = run(&mut world, &mut other, &task(), &mut unwatched).unwrap_err();
    assert!(error.to_string().contains("step 0: found the decision right"), "{error}");
}

#[test]
fn a_folder_is_not_taken_twice() {
    let folder = tempfile::tempdir().unwrap();
    let (world, _) = open(folder.path(), false, &[]).unwrap();
    let error = |is_resumed| open(folder.path(), is_resumed, &[]).err().unwrap().to_string();
    assert!(error(false).contains("uses this run"), "{}", error(false));
    drop(world);
    // One that is not over is gone on with; one that is over, only if that is wanted.
    let (mut world, _) = open(folder.path(), false, &[]).unwrap();
    world.report(EventKind::Finished, "60 steps".to_owned()).unwrap();
    drop(world);
    assert!(error(false).contains("already, and it is over"), "{}", error(false));
    open(folder.path(), true, &[]).unwrap();
    let other = RunFolder::open(folder.path(), "seed = 2\n", Durability::Fast, true).unwrap_err().to_string();
    assert!(other.contains("found a run that was started with other settings (\"seed = 1\")"), "{other}");
}

/// Overwrites the middle of the journal, or all of it.
fn damage(folder: &Path, is_whole: bool) {
    let path = folder.join("journal.sqlite");
    let mut bytes = std::fs::read(&path).unwrap();
    let from = if is_whole { 0 } else { bytes.len() / 3 };
    bytes[from..].fill(0x5a);
    std::fs::write(&path, bytes).unwrap();
    let _ = std::fs::remove_file(folder.join("journal.sqlite-wal"));
    let _ = std::fs::remove_file(folder.join("journal.sqlite-shm"));
}

#[test]
fn a_journal_that_is_none_is_named() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), false, &[], 5);
    damage(folder.path(), true);
    std::fs::remove_file(folder.path().join("journal.jsonl")).unwrap();
    let error = open(folder.path(), true, &[]).err().unwrap().to_string();
    assert!(error.contains("journal.sqlite"), "{error}");
}

/// Every file of a folder and below it, with its bytes, but for what SQLite makes anew when a journal is read.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(contents(&path));
        } else if !path.to_string_lossy().ends_with("-shm") && !path.ends_with("run.lock") {
            files.insert(path.clone(), std::fs::read(&path).unwrap());
        }
    }
    files.retain(|path, bytes| !(path.to_string_lossy().ends_with("-wal") && bytes.is_empty()));
    files
}

#[test]
fn a_journal_that_lost_its_latest_steps_takes_them_from_its_copy() {
    let (_, track) = whole(&[]);
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), false, &[], 20);
    let [journal, log] = ["journal.sqlite", "journal.sqlite-wal"].map(|name| folder.path().join(name));
    // What a power cut leaves on an SD card: an empty file.
    std::fs::write(&journal, b"").unwrap();
    let _ = std::fs::remove_file(&log);
    go(folder.path(), true, &[], 30);
    // A journal of some steps before, whole in itself.
    let early = std::fs::read(&journal).unwrap();
    go(folder.path(), true, &[], 40);
    std::fs::write(&journal, early).unwrap();
    let _ = std::fs::remove_file(&log);
    let (resumed, _) = go(folder.path(), true, &[], usize::MAX);
    assert_eq!(resumed, track);
    assert!(folder.path().join("journal.broken.sqlite").exists());
    assert!(folder.path().join("journal.2.broken.sqlite").exists());
}

#[test]
fn a_row_that_is_not_what_was_written_is_made_again() {
    let (_, track) = whole(&[]);
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), false, &[], 20);
    let path = folder.path().join("journal.sqlite");
    let change = |sql: &str| rusqlite::Connection::open(&path).unwrap().execute(sql, []).unwrap();
    change("UPDATE steps SET tip_x_cm = 77.0 WHERE step = 7");
    go(folder.path(), true, &[], 22);
    change("UPDATE entry SET text = replace(text, '.jpg', '.png') WHERE id = 9");
    go(folder.path(), true, &[], 24);
    let (resumed, _) = go(folder.path(), true, &[], usize::MAX);
    assert_eq!(resumed, track);
    let events = Journal::open_to_read(&path).unwrap().events().unwrap();
    let damaged: Vec<&str> = events
        .iter()
        .filter(|event| event.kind == EventKind::Damaged)
        .map(|event| event.text.as_str())
        .collect();
    assert!(damaged[0].contains("row 8 of \"SELECT * FROM steps"), "{damaged:?}");
    assert!(damaged[1].contains("1 entry of its copy not in it"), "{damaged:?}");
}

#[test]
fn the_copy_of_another_run_is_refused_and_nothing_changes() {
    let [folder, other] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    go(folder.path(), false, &[], 20);
    go(other.path(), false, &[], 10);
    // It has an entry that says so.
    go(other.path(), true, &[], 20);
    let copy = |folder: &Path| folder.join("journal.jsonl");
    std::fs::copy(copy(other.path()), copy(folder.path())).unwrap();
    let before = contents(folder.path());
    let error = open(folder.path(), true, &[]).err().unwrap().to_string();
    assert!(error.contains("contradicts its copy") && error.contains("found entry"), "{error}");
    assert!(contents(folder.path()) == before);
}

#[test]
fn settings_that_are_lost_or_damaged_come_from_the_journal() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), false, &[], 20);
    let settings = folder.path().join("run.toml");
    let text = std::fs::read(&settings).unwrap();
    std::fs::write(&settings, [0xff, 0xfe]).unwrap();
    go(folder.path(), true, &[], 22);
    assert_eq!(std::fs::read(&settings).unwrap(), text);
    assert_eq!(std::fs::read(folder.path().join("run.broken.toml")).unwrap(), [0xff, 0xfe]);
    std::fs::remove_file(&settings).unwrap();
    go(folder.path(), true, &[], 24);
    assert_eq!(std::fs::read(&settings).unwrap(), text);
    // Those of another command are not taken, whatever became of the file.
    std::fs::remove_file(&settings).unwrap();
    let other = RunFolder::open(folder.path(), "seed = 2\n", Durability::Fast, true).unwrap_err().to_string();
    assert!(other.contains("found a run that was started with other settings"), "{other}");
    assert!(!settings.exists());
}

#[test]
fn a_photograph_that_was_not_recorded_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), false, &[], 20);
    std::fs::write(folder.path().join("photographs/000020.jpg"), b"not recorded").unwrap();
    go(folder.path(), true, &[], 22);
    assert_eq!(std::fs::read(folder.path().join("unrecorded/000020.jpg")).unwrap(), b"not recorded");
}

#[test]
fn a_copy_with_a_damaged_line_restores_nothing() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), false, &[], 20);
    let copy = folder.path().join("journal.jsonl");
    let text = std::fs::read_to_string(&copy).unwrap();
    let mut lines: Vec<&str> = text.lines().collect();
    lines[9] = "[\"saw\",9,27";
    let damaged_copy = lines.join("\n") + "\n";
    std::fs::write(&copy, &damaged_copy).unwrap();
    let journal = std::fs::read(folder.path().join("journal.sqlite")).unwrap();
    damage(folder.path(), true);
    let before = contents(folder.path());
    let error = open(folder.path(), true, &[]).err().unwrap().to_string();
    assert!(error.contains("found 9 whole entries, but 51 more in journal.jsonl"), "{error}");
    assert_eq!(contents(folder.path()), before);
    // With a whole journal the damaged copy is kept, and a new one is made.
    std::fs::write(folder.path().join("journal.sqlite"), journal).unwrap();
    go(folder.path(), true, &[], 22);
    let kept = std::fs::read_to_string(folder.path().join("journal.broken.jsonl")).unwrap();
    assert_eq!(kept, damaged_copy);
}

#[test]
fn photographs_without_their_journal_are_never_taken_over() {
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), false, &[], 20);
    for name in ["journal.sqlite", "journal.sqlite-wal", "journal.jsonl"] {
        let _ = std::fs::remove_file(folder.path().join(name));
    }
    let photographs = contents(&folder.path().join("photographs"));
    let error = open(folder.path(), true, &[]).err().unwrap().to_string();
    assert!(error.contains("000000") && error.contains("it has lost steps"), "{error}");
    assert_eq!(contents(&folder.path().join("photographs")), photographs);
}

#[test]
fn a_damaged_journal_is_set_aside_and_made_again_from_its_copy() {
    let (_, track) = whole(&[50]);
    let folder = tempfile::tempdir().unwrap();
    let hurts: [&dyn Fn(); 3] = [&|| damage(folder.path(), true), &|| damage(folder.path(), false), &|| {
        std::fs::remove_file(folder.path().join("journal.sqlite")).unwrap()
    }];
    go(folder.path(), false, &[50], 20);
    for (turn, hurt) in hurts.iter().enumerate() {
        let copy = folder.path().join("journal.jsonl");
        // A line that was cut short is as if it had not been.
        let mut text = std::fs::read_to_string(&copy).unwrap();
        text.push_str("[\"saw\",20,6000.0,\"0000");
        std::fs::write(&copy, text).unwrap();
        hurt();
        go(folder.path(), true, &[50], 22 + turn);
    }
    let (resumed, _) = go(folder.path(), true, &[50], usize::MAX);
    assert_eq!(resumed, track);
    assert!(folder.path().join("journal.broken.sqlite").exists());
    let journal = Journal::open_to_read(&folder.path().join("journal.sqlite")).unwrap();
    let events = journal.events().unwrap();
    let damaged: Vec<_> = events.iter().filter(|event| event.kind == EventKind::Damaged).collect();
    assert_eq!(damaged.len(), 3, "{damaged:?}");
    assert!(damaged[0].text.contains("what followed entry 61 is lost"), "{}", damaged[0].text);
}

#[test]
fn a_first_photograph_without_a_plant_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let (mut world, _) = open(folder.path(), false, &[0]).unwrap();
    let error =
        run(&mut world, &mut Greedy::new(&task(), &Layout::default()), &task(), &mut unwatched).unwrap_err();
    assert!(error.to_string().contains("000000.jpg: no plant is seen"), "{error}");
}

/// Hears all, and asks for an end at a beat.
#[derive(Clone, Default)]
struct EventLog {
    heard: Rc<RefCell<Vec<Event>>>,
    beats: Rc<Cell<u32>>,
    ends_at: Option<u32>,
    /// How often it was asked about the computer, and when that was too hot.
    asked: u32,
    hot: Range<u32>,
}

impl RunMonitor for EventLog {
    fn event(&mut self, event: &Event) {
        self.heard.borrow_mut().push(event.clone());
    }

    fn health(&mut self) -> Vec<HealthProblem> {
        self.asked += 1;
        let text = format!("{} degrees", 80 + self.asked);
        let trouble = HealthProblem { what: "temperature", text };
        if self.hot.contains(&self.asked) { vec![trouble] } else { Vec::new() }
    }

    fn heartbeat(&mut self) -> ControlFlow<()> {
        self.beats.set(self.beats.get() + 1);
        if self.ends_at == Some(self.beats.get()) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

struct Outcome {
    track: Result<Track, RecordError>,
    hand: Hand,
    rows: Vec<StepRecord>,
    /// What happened, by minute and kind, without the beginning.
    events: Vec<(u32, EventKind)>,
    texts: Vec<String>,
    /// All events of the journal.
    written: Vec<Event>,
}

/// A run of [`STEPS`] steps in a real tent, in which much is `wrong`.
fn real(path: &Path, wrong: Wrong, policy: FaultPolicy, ends_at: Option<u32>) -> Outcome {
    let log = EventLog { ends_at, ..EventLog::default() };
    let supervision = Supervision {
        policy: FaultPolicy { reserve_mb: 0, ..policy },
        lamps_in_view: Some(LampsInView::default()),
        programme: None,
        light: LightLimits::default(),
        last_step: STEPS,
        monitor: Box::new(log.clone()),
    };
    let (mut world, hand) = open_with(path, true, Wrong { is_real: true, ..wrong }, supervision).unwrap();
    let track = run(&mut world, &mut Greedy::new(&task(), &Layout::default()), &task(), &mut unwatched);
    let rows = world.folder().steps().unwrap();
    let heard = log.heard.borrow();
    let written = world.folder().journal().events().unwrap();
    assert_eq!(written[written.len() - heard.len()..], heard[..], "all that is reported is written down");
    let events =
        heard[1..].iter().map(|event| (event.at.unwrap().since_start.as_secs() as u32 / 60, event.kind));
    let texts = heard.iter().map(|event| event.text.clone()).collect();
    Outcome { track, hand, rows, events: events.collect(), texts, written }
}

fn steps(track: &Track) -> Vec<u32> {
    track.samples.iter().map(|sample| sample.step).collect()
}

#[test]
fn a_camera_that_fails_for_some_steps_is_stood_in_for() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = Wrong { camera_fails: 50..65, ..Wrong::default() };
    let outcome = real(folder.path(), wrong, FaultPolicy::default(), None);
    let track = outcome.track.unwrap();
    assert_eq!(steps(&track), (0..=STEPS).collect::<Vec<_>>());
    let qualities: Vec<&str> = track.samples[9..14].iter().map(|sample| sample.quality.name()).collect();
    assert_eq!(qualities, ["measured", "carried_forward", "carried_forward", "carried_forward", "measured"]);
    assert_eq!(outcome.rows[11].photo_bytes, 0);
    use EventKind::{Camera, Clock, Lost, Recovered};
    assert_eq!(
        outcome.events,
        [
            (50, Camera),
            (55, Camera),
            (60, Camera),
            (60, Lost),
            (65, Recovered),
            (65, Recovered),
            (105, Clock)
        ]
    );
    assert!(outcome.texts[1].contains("camera: found silence, wanted an answer"), "{:?}", outcome.texts);
}

#[test]
fn a_camera_that_fails_for_longer_costs_steps_in_which_nothing_is_decided() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = Wrong { camera_fails: 50..75, ..Wrong::default() };
    let policy = FaultPolicy { on_fault: OnFault::Dark, ..FaultPolicy::default() };
    let outcome = real(folder.path(), wrong, policy, None);
    let track = outcome.track.unwrap();
    // Held at 10, 11 and 12; 13 and 14 are missed; the experiment is not longer for it.
    assert_eq!(steps(&track), (0..=12).chain(15..=STEPS).collect::<Vec<_>>());
    assert_eq!(track.samples[13].time_s, 75.0 * 60.0);
    let missed = outcome.events.iter().filter(|(_, kind)| *kind == EventKind::Missed).count();
    assert_eq!(missed, 2);
    assert!(outcome.hand.0.borrow().lights[1..].contains(&None), "dark meanwhile");
    assert_eq!(Some(track.samples[12].lighting()), outcome.rows[12].decided);
}

#[test]
fn a_camera_that_never_comes_back_pauses_the_run_which_can_be_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = Wrong { camera_fails: 50..10_000, ..Wrong::default() };
    let outcome = real(folder.path(), wrong, FaultPolicy::default(), None);
    let error = outcome.track.unwrap_err();
    assert!(matches!(&error, RecordError::Paused(why) if why == "no plant detected for 12 steps"), "{error}");
    assert_eq!(outcome.rows.len(), 13);
    assert_eq!(outcome.events.last(), Some(&(105, EventKind::Paused)));
    let outcome = real(folder.path(), Wrong::default(), FaultPolicy::default(), None);
    assert_eq!(*steps(&outcome.track.unwrap()).last().unwrap(), STEPS);
    // Each step is reported once, under its own number, and the end of the fault counts all of them.
    let concerned = |kind| -> Vec<u32> {
        outcome.written.iter().filter(|event| event.kind == kind).map(|event| event.step).collect()
    };
    assert_eq!(concerned(EventKind::Camera), [10, 11, 12]);
    assert_eq!(concerned(EventKind::Missed), (13..=21).collect::<Vec<_>>());
    let recovered: Vec<&str> =
        outcome.texts.iter().map(String::as_str).filter(|text| text.contains("again")).collect();
    assert_eq!(recovered, ["a photograph again after 12 steps", "the plant again after 12 steps"]);
}

#[test]
fn a_run_is_over_at_its_last_step_also_if_nothing_is_seen_then() {
    // The camera fails to the end and beyond: before the run would be paused, it is over.
    let folder = tempfile::tempdir().unwrap();
    let wrong = Wrong { camera_fails: 190..10_000, ..Wrong::default() };
    let outcome = real(folder.path(), wrong, FaultPolicy::default(), None);
    let track = outcome.track.unwrap();
    assert_eq!(steps(&track), (0..=40).chain([STEPS]).collect::<Vec<_>>());
    assert!(track.samples[41].is_dark() && outcome.hand.0.borrow().lit.is_none());
    // The program is down from step 10 until long after the end.
    let folder = tempfile::tempdir().unwrap();
    let broken = real(folder.path(), Wrong::default(), FaultPolicy::default(), Some(30));
    assert!(matches!(broken.track, Err(RecordError::Stopped)));
    let last = broken.rows.last().unwrap().step;
    let late = Wrong { opens: 600.0, ..Wrong::default() };
    let track = real(folder.path(), late, FaultPolicy::default(), None).track.unwrap();
    assert_eq!(steps(&track), (0..=last).chain([STEPS]).collect::<Vec<_>>());
    assert_eq!(track.samples.last().unwrap().quality.name(), "carried_forward");
}

#[test]
fn a_paused_run_is_not_paused_again_by_what_its_user_has_seen() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = || Wrong { camera_fails: 50..10_000, ..Wrong::default() };
    assert!(real(folder.path(), wrong(), FaultPolicy::default(), None).track.is_err());
    let outcome = real(folder.path(), wrong(), FaultPolicy::default(), None);
    let error = outcome.track.unwrap_err().to_string();
    assert_eq!(error, "paused: no plant detected for 24 steps");
}

#[test]
fn a_plant_that_is_not_seen_is_stood_in_for_as_long_and_then_nothing_is_decided() {
    let folder = tempfile::tempdir().unwrap();
    let dark_at = vec![50, 55, 60, 65, 70];
    let policy = FaultPolicy { flash_tries: 1, ..FaultPolicy::default() };
    let outcome = real(folder.path(), Wrong { dark_at, ..Wrong::default() }, policy, None);
    // As for a camera that fails: held at 10, 11 and 12; from 13 on nothing is decided, until the plant, which has grown
    // in the dark, is accepted again. The detections are recorded.
    let track = outcome.track.unwrap();
    let back = outcome.rows[13..].iter().find(|row| row.seen.is_measured()).unwrap().step;
    assert!(back >= 15);
    assert_eq!(steps(&track), (0..=12).chain(back..=STEPS).collect::<Vec<_>>());
    assert_eq!(outcome.rows.len(), SAMPLES);
    assert!(outcome.rows[13..back as usize].iter().all(|row| row.decided.is_none()));
    assert!(outcome.rows[13].photo_bytes > 0);
    use EventKind::{CarriedForward, Clock, Lost, Missed, Recovered};
    let missed = (13..back).map(|step| (5 * step, Missed));
    let wanted = [(50, CarriedForward), (60, Lost)]
        .into_iter()
        .chain(missed)
        .chain([(5 * back, Recovered), (105, Clock)]);
    assert_eq!(outcome.events, wanted.collect::<Vec<_>>());
    let lights = &outcome.hand.0.borrow().lights;
    assert_eq!(
        lights[1..lights.len() - 1].iter().filter(|light| light.is_none()).count(),
        0,
        "the lamp stays lit"
    );
    let (world, _) = open_with(folder.path(), true, Wrong::default(), Supervision::default()).unwrap();
    world.folder().write_track(&track).unwrap();
    let written = files::read_track(&folder.path().join("track.csv")).unwrap();
    let photo = format!("{back:06}.jpg");
    assert_eq!((written.samples[13].step, &written.columns[0].values.text(13)), (back, &photo));
}

#[test]
fn a_run_broken_off_while_nothing_is_decided_ends_as_if_it_had_not_been() {
    let dark_at: Vec<u32> = (0..7).map(|step| 50 + 5 * step).collect();
    let ways = [OnFault::Hold, OnFault::Dark].into_iter().flat_map(|way| [(way, None), (way, Some(day(75)))]);
    for (on_fault, programme) in ways {
        let go_on = |path: &Path, ends_at: Option<u32>| {
            let supervision = Supervision {
                programme: programme.clone(),
                light: LightLimits::default(),
                last_step: STEPS,
                policy: FaultPolicy { hold_steps: 3, on_fault, ..FaultPolicy::unlimited() },
                monitor: Box::new(EventLog { ends_at, ..EventLog::default() }),
                lamps_in_view: None,
            };
            let wrong = Wrong { dark_at: dark_at.clone(), ..Wrong::default() };
            let (mut world, _) = open_with(path, true, wrong, supervision).unwrap();
            run(&mut world, &mut Greedy::new(&task(), &Layout::default()), &task(), &mut unwatched)
        };
        let whole = tempfile::tempdir().unwrap();
        let track = go_on(whole.path(), None).unwrap();
        let back = steps(&track)[13];
        assert!(back >= 17);
        assert_eq!(steps(&track), (0..=12).chain(back..=STEPS).collect::<Vec<_>>());
        for ends_at in [24, 28, 32, 40] {
            let folder = tempfile::tempdir().unwrap();
            assert!(matches!(go_on(folder.path(), Some(ends_at)), Err(RecordError::Stopped)));
            assert_eq!(
                go_on(folder.path(), None).unwrap(),
                track,
                "{on_fault:?}, broken off at beat {ends_at}"
            );
            assert_eq!(steps_of(folder.path()), steps_of(whole.path()), "{on_fault:?}, beat {ends_at}");
        }
    }
}

/// A day that ends so many minutes after the beginning.
fn day(minutes: u64) -> Programme {
    let from = TimeOfDay::new(8, 0);
    let part = Part { from, to: from.later(minutes), steer: true, base: "dark".to_owned(), ramp_min: 0 };
    Programme::new(&[part], &Layout::default(), Allowed::One).unwrap()
}

#[test]
fn the_night_is_dark_also_where_nothing_is_decided() {
    for (camera_fails, dark_at) in
        [(0..0, vec![]), (100..170, vec![]), (0..0, (20..40).map(|step| 5 * step).collect())]
    {
        let folder = tempfile::tempdir().unwrap();
        let wrong = Wrong { camera_fails, dark_at, is_real: true, ..Wrong::default() };
        let policy = FaultPolicy { hold_steps: 2, ..FaultPolicy::unlimited() };
        let supervision = Supervision { policy, programme: Some(day(120)), ..Supervision::default() };
        let (mut world, hand) = open_with(folder.path(), true, wrong, supervision).unwrap();
        run(&mut world, &mut Greedy::new(&task(), &Layout::default()), &task(), &mut unwatched).unwrap();
        let rows = world.folder().steps().unwrap();
        assert_eq!(hand.0.borrow().lit_min, 120.0, "the held lamp is lit by day, and no longer");
        for row in rows.iter().filter(|row| row.step < STEPS) {
            let programme = row.programme.unwrap();
            assert_eq!(
                (programme.acting.part, programme.acting.is_steered),
                if row.step < 24 { (1, true) } else { (0, false) }
            );
            assert_eq!(programme.commanded == Lighting::DARK, row.step >= 24);
            assert!(row.is_confirmed, "step {}", row.step);
        }
    }
}

#[test]
fn a_run_that_is_resumed_at_night_is_dark_at_once() {
    for (opens, is_lit) in [(102.0, true), (130.0, false)] {
        let folder = tempfile::tempdir().unwrap();
        let open = |opens| {
            let supervision = Supervision { programme: Some(day(120)), ..Supervision::default() };
            let wrong = Wrong { opens, is_real: true, ..Wrong::default() };
            open_with(folder.path(), true, wrong, supervision).unwrap()
        };
        let (mut world, _) = open(0.0);
        let mut watch = |sample: &Sample| match sample.step {
            20 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        };
        run(&mut world, &mut Greedy::new(&task(), &Layout::default()), &task(), &mut watch).unwrap();
        drop(world);
        let (_, hand) = open(opens);
        assert_eq!(hand.0.borrow().lights[0].is_some(), is_lit, "at minute {opens}");
    }
}

#[test]
fn a_dark_photograph_is_taken_again_at_once() {
    use EventKind::{CarriedForward, Clock, Dark};
    for (dark, photographs, wanted) in [
        (vec![11], STEPS + 2, vec![(50, Dark), (105, Clock)]),
        (vec![11, 12], STEPS + 2, vec![(50, Dark), (50, CarriedForward), (105, Clock)]),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let is_dark_twice = dark.len() > 1;
        let outcome = real(folder.path(), Wrong { dark, ..Wrong::default() }, FaultPolicy::default(), None);
        assert_eq!(outcome.events, wanted);
        assert_eq!(outcome.hand.0.borrow().photographs, photographs);
        assert_eq!(outcome.rows[10].seen.is_measured(), !is_dark_twice);
        let text = if is_dark_twice { "dark again: is the flash dead?" } else { "taken again: bright" };
        assert!(outcome.texts[1].contains(text), "{:?}", outcome.texts);
    }
}

#[test]
fn a_camera_that_shows_one_picture_in_ever_new_files_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    // Its lamps are in the picture, too: a frozen one shows the wrong one.
    let policy = FaultPolicy { pause_steps: 1000, ..FaultPolicy::default() };
    let outcome = real(folder.path(), Wrong { frozen: 50..150, ..Wrong::default() }, policy, None);
    let is_report = |text: &&String| text.starts_with("13 photographs show the very same picture");
    assert_eq!(outcome.texts.iter().filter(is_report).count(), 1, "{:?}", outcome.texts);
    let found = outcome.texts.iter().any(|text| text.starts_with("a new picture after"));
    assert!(found, "{:?}", outcome.texts);
}

#[test]
fn a_camera_that_is_moved_is_told_and_far_enough_pauses_the_run() {
    use EventKind::{Clock, Moved, Paused};
    // One pixel of 200 is 13 of the paper's 2592, four are 52.
    let folder = tempfile::tempdir().unwrap();
    let wrong = |right| Wrong { moved: Some((50, right)), ..Wrong::default() };
    let outcome = real(folder.path(), wrong(1), FaultPolicy::default(), None);
    assert_eq!(outcome.events, [(55, Moved), (105, Clock)], "{:?}", outcome.texts);
    let shift = |row: usize| outcome.rows[row].seen.camera_shift.unwrap();
    assert!(shift(9).distance(Pixel::default()) == 0.0 && shift(10).distance(Pixel::new(1.0, 0.0)) < 0.4);

    let folder = tempfile::tempdir().unwrap();
    let outcome = real(folder.path(), wrong(4), FaultPolicy::default(), None);
    assert_eq!(outcome.events, [(55, Moved), (55, Paused)], "{:?}", outcome.texts);
    let error = outcome.track.unwrap_err().to_string();
    assert!(error.starts_with("paused: the camera was moved: its picture stands +"), "{error}");
    // Resuming accepts the camera's new place.
    let outcome = real(folder.path(), wrong(4), FaultPolicy::default(), None);
    assert_eq!(outcome.events, [(105, Clock)], "{:?}", outcome.texts);
    assert!(outcome.track.is_ok());
}

#[test]
fn a_computer_that_is_too_hot_is_told_once_and_when_it_is_right_again() {
    let folder = tempfile::tempdir().unwrap();
    let log = EventLog { hot: 10..13, ..EventLog::default() };
    let supervision = Supervision { monitor: Box::new(log.clone()), ..Supervision::default() };
    let (mut world, _) = open_with(folder.path(), true, Wrong::default(), supervision).unwrap();
    run(&mut world, &mut Greedy::new(&task(), &Layout::default()), &task(), &mut unwatched).unwrap();
    let heard = log.heard.borrow();
    let printed: Vec<_> =
        heard[1..].iter().map(|event| (event.step, event.kind, event.text.as_str())).collect();
    use EventKind::{Computer, Recovered};
    assert_eq!(printed, [(9, Computer, "90 degrees"), (12, Recovered, "temperature: right again")]);
}

#[test]
fn a_day_has_no_more_light_than_the_rig_allows_also_after_a_resume() {
    for programme in [None, Some(day(180))] {
        // An hour, and as many photons: 12 steps.
        let hour = LightLimits { most_h: Some(1.0), ..LightLimits::default() };
        let photons = LightLimits { most_mol: Some(0.0361), flux: vec![10.0; 2], ..LightLimits::default() };
        for light in [hour, photons] {
            cap_holds(&light, programme.as_ref());
        }
    }
}

fn cap_holds(light: &LightLimits, programme: Option<&Programme>) {
    let folder = tempfile::tempdir().unwrap();
    let part = |steps: usize| {
        let programme = programme.cloned();
        let supervision = Supervision { light: light.clone(), programme, ..Supervision::default() };
        let (mut world, hand) = open_with(folder.path(), true, Wrong::default(), supervision).unwrap();
        let mut left = steps;
        let mut watch = |_: &_| {
            left -= 1;
            if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        run(&mut world, &mut Greedy::new(&task(), &Layout::default()), &task(), &mut watch).unwrap();
        hand
    };
    part(8);
    let hand = part(usize::MAX);
    assert_eq!(hand.0.borrow().lit, None);
    let rows = steps_of(folder.path());
    let is_lit = |row: &&StepRecord| row.is_confirmed && row.commanded() != Some(Lighting::DARK);
    let lit: Vec<u32> = rows.iter().filter(is_lit).map(|row| row.step).collect();
    assert_eq!(lit, (0..12).collect::<Vec<_>>());
    assert_eq!(hand.0.borrow().lit_min, 60.0);
    let events = Journal::open_to_read(&folder.path().join("journal.sqlite")).unwrap().events().unwrap();
    let printed: Vec<u32> =
        events.iter().filter(|event| event.kind == EventKind::Lamp).map(|event| event.step).collect();
    assert_eq!(printed, [12]);
}

#[test]
fn a_lamp_that_does_not_obey_is_told_again_until_it_does() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = Wrong { lamps_fail: 50..58, ..Wrong::default() };
    let outcome = real(folder.path(), wrong, FaultPolicy::default(), None);
    assert_eq!(steps(&outcome.track.unwrap()).len(), SAMPLES);
    use EventKind::{Clock, Lamp, Recovered};
    // Not at the next step but as soon as it obeys.
    assert_eq!(outcome.events, [(50, Lamp), (55, Lamp), (58, Recovered), (105, Clock)]);
    assert!(!outcome.rows[10].is_confirmed && outcome.rows[11].is_confirmed);
    let wrong = Wrong { lamps_fail: 50..10_000, ..Wrong::default() };
    let folder = tempfile::tempdir().unwrap();
    let outcome = real(folder.path(), wrong, FaultPolicy::default(), None);
    assert!(matches!(outcome.track, Err(RecordError::Paused(why)) if why.contains("no lamp for 12 steps")));
}

#[test]
fn a_lamp_that_says_it_obeys_and_does_not_is_seen_in_the_photograph() {
    let folder = tempfile::tempdir().unwrap();
    // The hand-written controller changes lamps now and then, and the lamps then stay as they were.
    let wrong = Wrong { lamps_lie: 0..10_000, ..Wrong::default() };
    let policy = FaultPolicy { pause_steps: 5, ..FaultPolicy::default() };
    let outcome = real(folder.path(), wrong, policy, None);
    let error = outcome.track.unwrap_err().to_string();
    assert!(error.contains("found dark lit in the photograph, wanted right, 5 in a row"), "{error}");
    assert_eq!(outcome.rows[1].lit, Some(None));
    let folder = tempfile::tempdir().unwrap();
    let outcome = real(folder.path(), Wrong::default(), FaultPolicy::default(), None);
    let seen: Vec<_> = outcome.rows[1..].iter().map(|row| row.lit.unwrap().map(Lighting::only)).collect();
    let decided: Vec<_> = outcome.rows[..STEPS as usize].iter().map(|row| row.decided).collect();
    assert_eq!(seen, decided);
}

#[test]
fn steps_whose_time_has_passed_are_missed_and_none_come_in_a_burst() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = Wrong { camera_takes: vec![(50, 17.0), (100, 5.6)], ..Wrong::default() };
    let outcome = real(folder.path(), wrong, FaultPolicy::default(), None);
    // Begun at 50 and over at 67: 55 and 60 are missed, and 65 would be two minutes late. At 105.6, 105 is in time.
    let track = outcome.track.unwrap();
    assert_eq!(steps(&track), (0..=10).chain(14..=STEPS).collect::<Vec<_>>());
    use EventKind::{Clock, Late, Missed};
    assert_eq!(outcome.events, [(67, Missed), (105, Late), (105, Clock)]);
    assert!(
        outcome.texts[1]
            .starts_with("steps 11 to 13 without a photograph and a decision: step 11 would be 720 s late")
    );
    let begun: Vec<f64> =
        outcome.rows.iter().map(|row| row.begun.unwrap().since_start.as_secs_f64() - row.time_s).collect();
    assert!(begun.iter().all(|late| (0.0..=60.0).contains(late)), "{begun:?}");
}

#[test]
fn the_clock_on_the_wall_moves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = real(folder.path(), Wrong::default(), FaultPolicy::default(), None);
    assert_eq!(outcome.events, [(105, EventKind::Clock)]);
    assert!(outcome.texts[1].contains("set by +7200 s"), "{:?}", outcome.texts);
    assert_eq!(steps(&outcome.track.unwrap()), (0..=STEPS).collect::<Vec<_>>());
}

#[test]
fn a_run_that_is_asked_to_end_ends_while_it_waits_and_goes_on_with_its_lamp_lit_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = real(folder.path(), Wrong::default(), FaultPolicy::default(), Some(40));
    assert!(matches!(outcome.track, Err(RecordError::Stopped)));
    let rows = outcome.rows.len();
    assert_eq!(outcome.hand.0.borrow().lights.last(), Some(&None), "dark when it ends");
    let wrong = Wrong { is_real: true, ..Wrong::default() };
    let (world, hand) = open_with(folder.path(), true, wrong, Supervision::default()).unwrap();
    let lit = world.folder().steps().unwrap()[rows - 1].decided.and_then(Lighting::brightest);
    assert!(lit.is_some());
    assert_eq!(hand.0.borrow().lights, [lit], "before anything else");
    drop(world);
    let outcome = real(folder.path(), Wrong::default(), FaultPolicy::default(), None);
    assert_eq!(steps(&outcome.track.unwrap()).len(), SAMPLES);
}

#[test]
fn a_run_goes_on_with_the_photographs_that_it_needs_and_says_which_are_damaged() {
    let dark = [95, 100];
    let (_, track) = whole(&dark);
    let folder = tempfile::tempdir().unwrap();
    go(folder.path(), false, &dark, 27);
    let photo = |step: u32| folder.path().join(format!("photographs/{step:06}.jpg"));
    // Only the first few, the last dozen accepted ones and those after them are needed.
    (6..12).for_each(|step| std::fs::remove_file(photo(step)).unwrap());
    let (resumed, _) = go(folder.path(), true, &dark, 36);
    assert_eq!(resumed.samples[..], track.samples[..36]);
    std::fs::write(photo(0), b"no photograph").unwrap();
    std::fs::remove_file(photo(35)).unwrap();
    let (resumed, _) = go(folder.path(), true, &dark, usize::MAX);
    assert_eq!(resumed.samples.len(), SAMPLES);
    let journal = Journal::open_to_read(&folder.path().join("journal.sqlite")).unwrap();
    let damaged: Vec<_> =
        journal.events().unwrap().into_iter().filter(|event| event.kind == EventKind::Damaged).collect();
    assert_eq!(damaged.iter().map(|event| event.step).collect::<Vec<_>>(), [0, 35]);
    assert!(damaged[0].text.contains("000000.jpg: found 13 bytes with SHA-256"), "{}", damaged[0].text);
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
    assert_eq!(
        events[1],
        (19, EventKind::Resumed, "found 20 steps, going on; right is lit as before".to_owned())
    );
    assert_eq!(journal.state().unwrap().unwrap().kind, EventKind::Resumed);
}

#[test]
fn a_lamp_that_refuses_when_a_run_goes_on_is_not_called_lit() {
    let folder = tempfile::tempdir().unwrap();
    assert!(real(folder.path(), Wrong::default(), FaultPolicy::default(), Some(40)).track.is_err());
    let wrong = Wrong { lamps_fail: 0..1, ..Wrong::default() };
    let outcome = real(folder.path(), wrong, FaultPolicy::default(), None);
    assert!(outcome.texts[0].ends_with("was lit before, and does not obey now"), "{:?}", outcome.texts);
    assert!(outcome.texts[1].contains("left lamp: found silence"), "{:?}", outcome.texts);
}

#[test]
fn the_light_of_a_row_is_the_one_that_acted() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = Wrong { lamps_fail: 50..65, lamps_lie: 100..125, ..Wrong::default() };
    let outcome = real(folder.path(), wrong, FaultPolicy::default(), None);
    let decided = outcome.track.unwrap();
    let (world, _) = open_with(folder.path(), true, Wrong::default(), Supervision::default()).unwrap();
    let acted = world.folder().write_track(&decided).unwrap();
    let mut is_any_false = false;
    for (index, row) in outcome.rows[..STEPS as usize].iter().enumerate() {
        let is_false = !row.is_confirmed || outcome.rows[index + 1].lit.map(Lighting::from) != row.decided;
        is_any_false |= is_false && row.is_confirmed;
        let wanted = row.decided.filter(|_| !is_false).unwrap_or_default();
        assert_eq!(acted.samples[index].lighting(), wanted, "step {index}");
    }
    assert!(is_any_false, "a lamp was found dark that had been confirmed");
    let refused: Vec<u32> = (10..13).collect();
    assert!(refused.iter().all(|&step| acted.samples[step as usize].light.is_none()));
    let written = files::read_track(&folder.path().join("track.csv")).unwrap();
    assert_eq!(written.shifts().count(), acted.shifts().count());
    assert!(written.shifts().count() < decided.shifts().count());
    let column = written.columns.iter().find(|column| column.name == "decided").unwrap();
    assert_eq!(column.values.text(10), decided.layout.name(decided.samples[10].light));
}

#[test]
fn a_periodic_controller_switches_by_the_clock_whatever_steps_are_missed() {
    let folder = tempfile::tempdir().unwrap();
    // The camera takes its time once, and fails for a while.
    let wrong =
        Wrong { camera_takes: vec![(20, 17.0)], camera_fails: 120..145, is_real: true, ..Wrong::default() };
    let policy = FaultPolicy { reserve_mb: 0, pause_steps: 60, ..FaultPolicy::default() };
    let go = |is_resumed, breaks_off_at: usize| {
        let supervision = Supervision { policy: policy.clone(), ..Supervision::default() };
        let (mut world, _) = open_with(folder.path(), is_resumed, wrong.clone(), supervision).unwrap();
        let mut controller = Periodic::new(12, &Layout::default());
        let mut watch = |sample: &Sample| {
            if sample.step as usize >= breaks_off_at {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        run(&mut world, &mut controller, &task(), &mut watch).unwrap()
    };
    go(false, 40);
    let track = go(true, usize::MAX);
    assert!(track.samples.len() < SAMPLES - 4, "steps are missed");
    for sample in track.samples.iter().filter(|sample| sample.step < STEPS) {
        let wanted = if sample.step / 12 % 2 == 0 { Light::LEFT } else { Light::RIGHT };
        assert_eq!(sample.light, Some(wanted), "step {}", sample.step);
    }
}
