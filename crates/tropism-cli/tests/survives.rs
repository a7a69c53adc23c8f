//! Whatever ends a run, the same command goes on with it, to the same bits.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::LazyLock;
use std::thread::sleep;
use std::time::Duration;

use tempfile::TempDir;
use tropism::rig::{Event, EventKind};
use tropism_lab::{Journal, StepRecord};

const STEPS: usize = 40;

/// The virtual tent with small photographs in which much goes wrong, as durable as a real one.
const TENT: &str = "durability = \"full\"\n[lamps_in_view]\n[greenhouse.scene]\nwidth = 324\nheight = 243\n\
                    [greenhouse.faults]\nmissed_flash = 0.05\ndropped = 0.05\nrepeated = 0.05\nfly = 0.05\n";

fn command(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tropism"));
    command.current_dir(folder).args(words).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// A run of the virtual tent into `out`.
fn tent(folder: &Path, out: &str) -> Command {
    command(
        folder,
        &[
            "run",
            "--rig",
            "tent.toml",
            "--controller",
            "greedy",
            "--steps",
            "40",
            "--out",
            out,
            "--threads",
            "1",
        ],
    )
}

#[track_caller]
fn done(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn rows(run: &Path) -> Vec<StepRecord> {
    // Before there is a journal, and while it is made, there are none.
    Journal::open_to_read(&run.join("journal.sqlite")).and_then(|journal| journal.steps()).unwrap_or_default()
}

fn events(run: &Path) -> Vec<Event> {
    Journal::open_to_read(&run.join("journal.sqlite")).unwrap().events().unwrap()
}

fn count(run: &Path, kind: EventKind) -> usize {
    events(run).iter().filter(|event| event.kind == kind).count()
}

/// Compares all that a run leaves, but for what the journal says of its interruptions.
#[track_caller]
fn same(one: &Path, other: &Path) {
    let read =
        |run: &Path, name: &str| fs::read(run.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    for name in ["track.csv", "truth.csv", "truth.jsonl", "calibration.toml", "run.toml"] {
        assert!(read(one, name) == read(other, name), "{name} of {} and {}", one.display(), other.display());
    }
    for step in 0..=STEPS {
        // None where the camera gave no photograph.
        let name = format!("photographs/{step:06}.jpg");
        let [one, other] = [one, other].map(|run| fs::read(run.join(&name)).ok());
        assert!(one == other, "{name}");
    }
    assert_eq!(rows(one), rows(other));
}

#[test]
fn a_run_goes_on_when_nobody_reads_what_it_says() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("tent.toml"), TENT).unwrap();
    // As behind `2>&1 | head`, after `head` has ended.
    let dead_pipe = || {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        writer
    };
    let mut run = tent(folder.path(), "unread");
    let status = run.stdout(dead_pipe()).stderr(dead_pipe()).status().unwrap();
    assert_eq!(status.code(), Some(0));
    done(&tent(folder.path(), "read").output().unwrap());
    let track = |run: &str| fs::read(folder.path().join(run).join("track.csv")).unwrap();
    assert_eq!(track("unread"), track("read"));
    // An error that cannot be printed is an error still.
    let status = tent(folder.path(), "unread").stderr(dead_pipe()).status().unwrap();
    assert_eq!(status.code(), Some(1));
}

/// Where in a run it is killed: numbers that look random, the same in every test.
struct Moments(u64);

impl Moments {
    fn next_ms(&mut self, most: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % most
    }
}

/// `TROPISM_KILLS` says how often; `scripts/kills` asks for a thousand.
#[test]
fn a_run_that_is_killed_again_and_again_loses_nothing_and_ends_as_if_it_had_not_been() {
    let kills = std::env::var("TROPISM_KILLS").map_or(24, |kills| kills.parse().expect("a number of kills"));
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("tent.toml"), TENT).unwrap();
    done(&tent(folder.path(), "whole").output().unwrap());
    let whole = folder.path().join("whole");
    let (mut killed, mut runs, mut acknowledged, mut most_ms) = (0, 0, 0, 60);
    let mut moments = Moments(1);
    while killed < kills {
        runs += 1;
        let run = folder.path().join(format!("run-{runs}"));
        let (mut broken_off, mut recorded) = (0, 0);
        loop {
            let mut child = tent(folder.path(), run.file_name().unwrap().to_str().unwrap()).spawn().unwrap();
            let mut left_ms = moments.next_ms(most_ms);
            while left_ms > 0 && child.try_wait().unwrap().is_none() {
                let nap = left_ms.min(10);
                sleep(Duration::from_millis(nap));
                left_ms -= nap;
            }
            // What another program can read is acknowledged.
            let before = rows(&run);
            let has_ended = child.try_wait().unwrap().is_some() || broken_off > 30;
            if !has_ended {
                child.kill().unwrap();
                (killed, broken_off) = (killed + 1, broken_off + 1);
            }
            let ended = child.wait_with_output().unwrap();
            let after = rows(&run);
            assert!(after.len() >= before.len(), "{} steps, {} after a kill", before.len(), after.len());
            for (was, is) in before.iter().zip(&after) {
                // A decision and its confirmation may have come since.
                let mut is = is.clone();
                if was.decided.is_none() {
                    is.decided = None;
                }
                is.is_confirmed &= was.is_confirmed;
                assert_eq!(*was, is);
            }
            acknowledged += before.len();
            // A machine that is busy or slow gives longer lives, so that there is something to kill.
            most_ms = if after.len() > recorded { (most_ms * 4 / 5).max(60) } else { most_ms * 3 / 2 };
            recorded = after.len();
            if has_ended {
                done(&ended);
                break;
            }
            // Killed on its way out.
            if !after.is_empty() && count(&run, EventKind::Finished) > 0 {
                break;
            }
        }
        same(&whole, &run);
        assert!(count(&run, EventKind::Resumed) <= broken_off);
        fs::remove_dir_all(&run).unwrap();
    }
    println!(
        "{killed} kills in {runs} runs of {STEPS} steps: 0 of {acknowledged} acknowledged steps lost, \
         {runs} of {runs} tracks, photographs and journals identical"
    );
}

/// A run of the virtual tent, whose photographs are shown again.
static RECORDED: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    // Larger pictures: a plant that moves in 50 milliseconds as in five minutes is lost in the smaller ones.
    let larger = TENT.replace("width = 324\nheight = 243", "width = 432\nheight = 324");
    fs::write(folder.path().join("tent.toml"), larger).unwrap();
    done(&tent(folder.path(), "tent").output().unwrap());
    folder
});

/// A real rig of programs and recorded photographs, with a step every 50 milliseconds.
struct Real {
    folder: TempDir,
}

impl Real {
    fn new(more: &str) -> Self {
        Self::with_period(8e-4, more)
    }

    fn with_period(period_min: f64, more: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let recorded = RECORDED.path().join("tent");
        let calibration = fs::read_to_string(recorded.join("calibration.toml")).unwrap();
        let photographs = recorded.join("photographs");
        let say = |what: &str| format!("[\"sh\", \"-c\", \"echo {what} >> lamps\"]");
        let rig = format!(
            "period_min = {period_min}\n[fault_policy]\nlate_s = inf\nfree_mb = 0\n{more}\n\
             [camera]\ndriver = \"replay\"\nfolder = {photographs:?}\n\
             [lamps]\non_exit = \"dark\"\nleft = {}\nright = {}\ndark = {}\n\
             [vision.crop]\nx = 5\ny = 13\nwidth = 421\nheight = 253\n\
             [calibration]\n{}",
            say("left"),
            say("right"),
            say("dark"),
            calibration.replace("[base]", "[calibration.base]")
        );
        fs::write(path.join("rig.toml"), rig).unwrap();
        Self { folder }
    }

    fn command(&self, more: &[&str]) -> Command {
        let words = ["run", "--rig", "rig.toml", "--controller", "periodic", "--steps", "40", "--out", "run"];
        command(self.folder.path(), &[&words[..], more].concat())
    }

    fn run(&self) -> std::path::PathBuf {
        self.folder.path().join("run")
    }

    /// Runs it until so many steps are recorded.
    fn until(&self, steps: usize) -> Child {
        let mut child = self.command(&[]).spawn().unwrap();
        while rows(&self.run()).len() < steps {
            assert!(child.try_wait().unwrap().is_none(), "it ended: {:?}", child.wait_with_output());
            sleep(Duration::from_millis(5));
        }
        child
    }
}

#[test]
fn a_second_program_is_refused_and_the_first_goes_on() {
    let real = Real::new("");
    let child = real.until(3);
    let second = real.command(&["--resume"]).output().unwrap();
    let error = String::from_utf8_lossy(&second.stderr);
    assert!(second.status.code() == Some(1) && error.contains("another program (process "), "{error}");
    done(&child.wait_with_output().unwrap());
    assert_eq!((rows(&real.run()).len(), count(&real.run(), EventKind::Resumed)), (41, 0));
}

#[cfg(unix)]
#[test]
fn a_run_ends_in_order_while_it_waits_for_its_next_step_and_goes_on_by_itself() {
    let real = Real::with_period(5.0, "");
    let rig = real.folder.path().join("rig.toml");
    let text = fs::read_to_string(&rig).unwrap();
    for (on_exit, last) in [("keep", "left"), ("dark", "dark")] {
        fs::write(&rig, text.replace("on_exit = \"dark\"", &format!("on_exit = {on_exit:?}"))).unwrap();
        let _ = fs::remove_dir_all(real.run());
        let mut child = real.until(1);
        while !rows(&real.run())[0].is_confirmed {
            assert!(child.try_wait().unwrap().is_none(), "it ended: {:?}", child.wait_with_output());
            sleep(Duration::from_millis(5));
        }
        let pid = child.id().to_string();
        assert!(Command::new("kill").args(["-TERM", &pid]).status().unwrap().success());
        // Its next step is due in five minutes: it would not end by itself before.
        let mut tenths = 0;
        while child.try_wait().unwrap().is_none() {
            tenths += 1;
            assert!(tenths < 1200, "SIGTERM was not heard");
            sleep(Duration::from_millis(100));
        }
        assert_eq!(child.wait_with_output().unwrap().status.code(), Some(130));
        assert_eq!(events(&real.run()).last().unwrap().kind, EventKind::Stopped);
        let lamps = fs::read_to_string(real.folder.path().join("lamps")).unwrap();
        assert_eq!(lamps.lines().last(), Some(last), "on_exit = {on_exit:?}: {lamps}");
    }
    let mut child = real.command(&[]).spawn().unwrap();
    while events(&real.run()).last().unwrap().kind != EventKind::Resumed {
        assert!(child.try_wait().unwrap().is_none());
        sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

#[cfg(unix)]
#[test]
fn a_run_that_is_asked_to_end_again_and_again_still_leaves_no_lamp_lit() {
    let real = Real::with_period(5.0, "");
    let rig = real.folder.path().join("rig.toml");
    let slow = fs::read_to_string(&rig).unwrap().replace("echo dark >>", "sleep 0.5; echo dark >>");
    fs::write(&rig, slow).unwrap();
    let mut child = real.until(1);
    while !rows(&real.run())[0].is_confirmed {
        assert!(child.try_wait().unwrap().is_none(), "it ended: {:?}", child.wait_with_output());
        sleep(Duration::from_millis(5));
    }
    let pid = child.id().to_string();
    for signal in ["-TERM", "-INT", "-TERM", "-HUP"] {
        assert!(Command::new("kill").args([signal, &pid]).status().unwrap().success());
        sleep(Duration::from_millis(100));
    }
    assert_eq!(child.wait_with_output().unwrap().status.code(), Some(130));
    assert_eq!(events(&real.run()).last().unwrap().kind, EventKind::Stopped);
    let lamps = fs::read_to_string(real.folder.path().join("lamps")).unwrap();
    assert_eq!(lamps.lines().last(), Some("dark"), "{lamps}");
}

#[test]
fn a_run_that_was_down_for_long_asks_before_it_goes_on() {
    let real = Real::new("gap_min = 0");
    let mut child = real.until(3);
    child.kill().unwrap();
    child.wait().unwrap();
    for _ in 0..2 {
        let paused = real.command(&[]).output().unwrap();
        let error = String::from_utf8_lossy(&paused.stderr);
        assert_eq!(paused.status.code(), Some(3), "{error}");
        assert!(error.contains("the run was down for") && error.contains("--resume"), "{error}");
    }
    assert_eq!(count(&real.run(), EventKind::Paused), 1);
    let status = command(real.folder.path(), &["status", "run"]).output().unwrap();
    let status = String::from_utf8_lossy(&status.stdout);
    assert!(status.starts_with("run: paused, "), "{status}");
    assert!(status.contains(": paused: the run was down for"), "{status}");
    done(&real.command(&["--resume"]).output().unwrap());
    assert_eq!(rows(&real.run()).len(), 41);
    let again = real.command(&[]).output().unwrap();
    assert!(String::from_utf8_lossy(&again.stderr).contains("a run is here already, and it is over"));
}

/// On a disk of its own, which needs the right to mount one.
#[test]
fn a_full_disk_costs_photographs_and_nothing_else() {
    let may = Command::new("unshare")
        .args(["-rm", "mount", "-t", "tmpfs", "-o", "size=1m", "none", "/mnt"])
        .status();
    if !may.is_ok_and(|status| status.success()) {
        println!("skipped: no disk can be mounted here");
        return;
    }
    let real = Real::new("reserve_mb = 1\nhold_steps = 40");
    fs::create_dir(real.run()).unwrap();
    fs::create_dir(real.folder.path().join("saved")).unwrap();
    let script = "mount -t tmpfs -o size=4m none run || exit 9
        $TROPISM run --rig rig.toml --controller periodic --steps 40 --out run --quiet
        code=$?; cp -r run/. saved/; exit $code";
    let mut child = Command::new("unshare")
        .args(["-rm", "sh", "-c", script])
        .current_dir(real.folder.path())
        .env("TROPISM", env!("CARGO_BIN_EXE_tropism"))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The same folder as that program sees it, and its journal, which SQLite does not find there, copied.
    let run = format!("/proc/{}/root{}", child.id(), real.run().display());
    let run = Path::new(&run);
    let seen = tempfile::tempdir().unwrap();
    let mut until = |steps| {
        loop {
            for name in ["journal.sqlite", "journal.sqlite-wal"] {
                let _ = fs::copy(run.join(name), seen.path().join(name));
            }
            if rows(seen.path()).len() >= steps {
                return;
            }
            assert!(child.try_wait().unwrap().is_none(), "it ended before {steps} steps");
            sleep(Duration::from_millis(2));
        }
    };
    until(6);
    let mut fill = fs::File::create(run.join("fill")).unwrap();
    while fill.write_all(&[0; 1024]).is_ok() {}
    until(20);
    fs::remove_file(run.join("fill")).unwrap();
    drop(fill);
    done(&child.wait_with_output().unwrap());
    let saved = real.folder.path().join("saved");
    let rows = rows(&saved);
    assert_eq!(rows.len(), 41);
    assert!(rows[..40].iter().all(|row| row.is_confirmed));
    let is_kept = |row: &StepRecord| saved.join("photographs").join(&row.photo).exists();
    let kept = rows.iter().filter(|row| is_kept(row)).count();
    assert!(kept < 40 && rows[..6].iter().any(is_kept) && rows[36..].iter().any(is_kept), "{kept} of 41");
    assert_eq!(count(&saved, EventKind::Disk), 1);
    assert!(saved.join("track.csv").exists());
}
