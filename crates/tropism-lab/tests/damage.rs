//! A disk that damages a run folder at random: the whole history comes back, or nothing is changed and the loss is named.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use rand::{Rng, RngExt};
use tropism::geometry::{Pixel, Point, Polyline};
use tropism::lamps::Light;
use tropism::observation::{Observation, Quality};
use tropism::random::{self, Purpose};
use tropism::rig::{Boot, Durability, Event, EventKind};
use tropism::vision::{FrameStatus, TrackedFrame};
use tropism_lab::{PhotoFolder, RunFolder, StepRecord, files};

const SETTINGS: &str = "seed = 1\n# The settings of a run.\n";
const STEPS: u32 = 24;
const DAMAGES: u64 = 300;

fn open(folder: &Path) -> Result<RunFolder, tropism_lab::FolderError> {
    RunFolder::open(folder, SETTINGS, Durability::Fast, true)
}

/// Writes a run of [`STEPS`] steps, and copies its folder as a power cut would leave it: `checkpointed` after the database
/// took over its log, `logged` before.
fn write_run(run: &Path, logged: &Path, checkpointed: &Path) {
    let folder = open(run).unwrap();
    let journal = folder.journal();
    journal.record_boot(&Boot { id: "a".to_owned(), start_s: 12.5, is_wall_set: true }).unwrap();
    for step in 0..STEPS {
        let (photo, bytes) = (format!("{step:06}.jpg"), vec![step as u8; 40]);
        folder.write_photo(PhotoFolder::Front, &photo, &bytes).unwrap();
        let tip = Point::new(0.1 * f64::from(step), 3.0 + 0.01 * f64::from(step));
        let stem = Polyline((0..10).map(|at| Point::new(tip.x * f64::from(at) / 9.0, tip.y)).collect());
        let seen = TrackedFrame {
            observation: Some(Observation { tip, stem: Some(stem), depth: None, quality: Quality::Measured }),
            tip_px: Some(Pixel::new(300.5 + tip.x, 200.25)),
            status: FrameStatus::Ok,
            confidence: 0.9,
            camera_shift: None,
        };
        journal
            .record_observation(&StepRecord {
                side: None,
                step,
                time_s: 300.0 * f64::from(step),
                photo_bytes: bytes.len() as u64,
                photo_sha256: files::sha256(&bytes),
                photo,
                seen,
                decided: None,
                programme: None,
                is_confirmed: false,
                begun: None,
                lit: None,
            })
            .unwrap();
        journal.record_decision(step, if step % 5 < 2 { Light::LEFT } else { Light::RIGHT }).unwrap();
        journal.record_confirmation(step).unwrap();
        if step % 6 == 0 {
            let text = format!("step {step} was reported");
            journal.record_event(&Event { step, kind: EventKind::Started, text, at: None }).unwrap();
        }
    }
    copy(run, logged);
    drop(folder);
    copy(run, checkpointed);
}

/// A copy of a run folder with the same photographs: no damage concerns them, and links cost less than copies.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let (path, to) = entry.map(|entry| (entry.path(), to.join(entry.file_name()))).unwrap();
        if path.is_dir() {
            copy(&path, &to);
        } else if path.extension().is_some_and(|extension| extension == "jpg") {
            fs::hard_link(path, to).unwrap();
        } else {
            fs::copy(path, to).unwrap();
        }
    }
}

/// Every file with its bytes, but for what SQLite makes anew when it reads.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(contents(&path));
        } else if !path.to_string_lossy().ends_with("-shm") && !path.ends_with("run.lock") {
            found.insert(path.clone(), fs::read(&path).unwrap());
        }
    }
    // An empty log is what SQLite leaves of one that was not there.
    found.retain(|path, bytes| !(path.to_string_lossy().ends_with("-wal") && bytes.is_empty()));
    found
}

/// Flips bits, cuts, zeroes, swaps two places or removes the file at `path`; says what it did.
fn damage(path: &Path, rng: &mut impl Rng) -> String {
    let Ok(mut bytes) = fs::read(path) else { return "nothing".to_owned() };
    if bytes.is_empty() {
        return "nothing".to_owned();
    }
    let place = rng.random_range(0..bytes.len());
    let what = rng.random_range(0..5);
    match what {
        0 => {
            for _ in 0..rng.random_range(1..=3) {
                let place = rng.random_range(0..bytes.len());
                bytes[place] ^= 1 << rng.random_range(0..8);
            }
        }
        1 => bytes.truncate(place),
        2 => {
            let end = bytes.len().min(place + rng.random_range(1..=5000));
            bytes[place..end].fill(0);
        }
        3 => {
            let length = rng.random_range(1..=600).min(bytes.len() / 2);
            let [one, other] = [(); 2].map(|()| rng.random_range(0..=(bytes.len() - 2 * length) / 2));
            let other = bytes.len() / 2 + other;
            for at in 0..length {
                bytes.swap(one + at, other + at);
            }
        }
        _ => {
            fs::remove_file(path).unwrap();
            return "removed".to_owned();
        }
    }
    fs::write(path, bytes).unwrap();
    format!("{} at {place}", ["flipped", "cut", "zeroed", "swapped"][what])
}

/// Whether `found` are the first of `steps`; the last one may lack its decision and the lamps' answer.
fn is_beginning(found: &[StepRecord], steps: &[StepRecord]) -> bool {
    let Some((last, before)) = found.split_last() else { return true };
    let seen = |step: &StepRecord| StepRecord { decided: None, is_confirmed: false, ..step.clone() };
    steps.starts_with(before) && seen(last) == seen(&steps[before.len()])
}

#[test]
fn no_random_damage_changes_the_history_or_overwrites_a_file_in_silence() {
    let base = tempfile::tempdir().unwrap();
    let [run, logged, checkpointed, hurt] =
        ["run", "logged", "checkpointed", "hurt"].map(|name| base.path().join(name));
    write_run(&run, &logged, &checkpointed);
    let whole = open(&run).unwrap();
    let (steps, events) = (whole.steps().unwrap(), whole.journal().events().unwrap());
    let (mut came_back, mut refused, mut printed) = (0, 0, 0);
    for seed in 0..DAMAGES {
        let mut rng = random::stream(seed, Purpose::Search, 0);
        let _ = fs::remove_dir_all(&hurt);
        copy(if rng.random_bool(0.5) { &logged } else { &checkpointed }, &hurt);
        let targets: &[&str] = match rng.random_range(0..6) {
            0 => &["journal.sqlite"],
            1 => &["journal.sqlite-wal"],
            2 => &["journal.jsonl"],
            3 => &["run.toml"],
            4 => &["journal.sqlite", "journal.jsonl"],
            _ => &["journal.sqlite-wal", "journal.jsonl"],
        };
        let what: Vec<String> =
            targets.iter().map(|name| format!("{name} {}", damage(&hurt.join(name), &mut rng))).collect();
        let case = format!("seed {seed}: {}", what.join(", "));
        let before = contents(&hurt);
        match open(&hurt) {
            Ok(folder) => {
                let (found, told_of) = (folder.steps().unwrap(), folder.journal().events().unwrap());
                if found == steps && told_of == events {
                    came_back += 1;
                } else {
                    // The end of a copy that was cut while the journal cannot be read: it is reported.
                    let is_told = folder.damages().iter().any(|damage| damage.contains("is lost"));
                    assert!(is_told && is_beginning(&found, &steps), "{case}: {:?}", folder.damages());
                    assert!(steps.len() - found.len() <= 1 && events.starts_with(&told_of), "{case}");
                    printed += 1;
                }
                drop(folder);
                let after: Vec<Vec<u8>> = contents(&hurt).into_values().collect();
                for (path, bytes) in &before {
                    // SQLite writes a whole journal itself.
                    let is_journal = path.to_string_lossy().contains("journal.sqlite");
                    let goes_on = |kept: &Vec<u8>| kept.starts_with(bytes);
                    assert!(is_journal || after.iter().any(goes_on), "{case}: {} is gone", path.display());
                }
            }
            Err(error) => {
                refused += 1;
                assert!(contents(&hurt) == before, "{case}: {error}");
            }
        }
    }
    println!(
        "{DAMAGES} damages: {came_back} came back whole, {printed} reported what is lost, {refused} refused"
    );
    assert!(4 * came_back > 3 * DAMAGES, "{came_back} of {DAMAGES} came back whole");
}

#[test]
fn a_journal_that_was_cut_off_while_it_was_made_is_begun_anew() {
    // A database that a program left in the middle of its first transaction, with the journal that takes it back.
    let torn = tempfile::tempdir().unwrap();
    let source = tempfile::tempdir().unwrap();
    let path = source.path().join("journal.sqlite");
    let db = rusqlite::Connection::open(&path).unwrap();
    db.execute_batch("PRAGMA cache_size = 1; BEGIN; CREATE TABLE a (b)").unwrap();
    for _ in 0..200 {
        db.execute("INSERT INTO a VALUES (zeroblob(1000))", []).unwrap();
    }
    for name in ["journal.sqlite", "journal.sqlite-journal"] {
        assert!(fs::metadata(source.path().join(name)).unwrap().len() > 0);
        fs::copy(source.path().join(name), torn.path().join(name)).unwrap();
    }
    let [nothing, no_database, empty] = [(); 3].map(|()| tempfile::tempdir().unwrap());
    fs::write(no_database.path().join("journal.jsonl"), "").unwrap();
    fs::write(empty.path().join("journal.sqlite"), "").unwrap();
    fs::write(empty.path().join("journal.restored.sqlite"), "half").unwrap();
    for folder in [&nothing, &no_database, &empty, &torn] {
        for _ in 0..2 {
            let folder = open(folder.path()).unwrap();
            assert_eq!(folder.journal().settings().unwrap().as_deref(), Some(SETTINGS));
            assert_eq!(folder.damages(), [""; 0]);
        }
    }
}

/// As another user, who may read everything and write nothing.
#[cfg(target_os = "linux")]
#[test]
fn a_run_that_is_over_can_be_read_where_nothing_can_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let [run, logged, checkpointed] =
        ["a run", "logged", "what? #1 100%"].map(|name| folder.path().join(name));
    write_run(&run, &logged, &checkpointed);
    let (steps, events) = tropism_lab::read_journal(&run).unwrap();
    assert_eq!(steps.len(), STEPS as usize);
    let mount = |script: &str, path: &Path| {
        let words = ["-rm", "sh", "-c", script, "sh"];
        std::process::Command::new("unshare")
            .args(words)
            .arg(path)
            .arg(std::env::current_exe().unwrap())
            .status()
    };
    if !mount("mount --bind \"$1\" \"$1\" && mount -o remount,ro,bind \"$1\"", &logged)
        .is_ok_and(|done| done.success())
    {
        println!("skipped: no disk can be mounted here");
        return;
    }
    for path in [&logged, &checkpointed] {
        let script = "mount --bind \"$1\" \"$1\" && mount -o remount,ro,bind \"$1\" && TROPISM_READ_ONLY=\"$1\" \
                      \"$2\" --exact reads_a_journal_that_cannot_be_written --nocapture --ignored";
        assert!(mount(script, path).unwrap().success(), "{}", path.display());
    }
    assert_eq!(events.len(), 4);
}

/// What [`a_run_that_is_over_can_be_read_where_nothing_can_be_written`] starts on a read-only disk.
#[test]
#[ignore = "started by another test"]
fn reads_a_journal_that_cannot_be_written() {
    let path = PathBuf::from(std::env::var_os("TROPISM_READ_ONLY").unwrap());
    let (steps, events) = tropism_lab::read_journal(&path).unwrap();
    assert_eq!((steps.len(), events.len()), (STEPS as usize, 4));
    fs::write(path.join("x"), "").unwrap_err();
}
