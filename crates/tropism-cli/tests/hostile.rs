//! What may do harm: outputs that are inputs, names that act on terminals and shells, and secrets in addresses.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;
use tropism::photo::Image;

fn tropism(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(folder).args(words).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

const TRACK: &str = "step,time_s,tip_x_cm,tip_y_cm,light,quality\n0,0,0,4,left,measured\n1,300,-0.1,4.03,right,measured\n\
                     2,600,0,4.06,right,measured\n3,900,0.1,4.1,dark,measured\n";

/// Small photographs are quick.
const SCENE: &str = "width = 324\nheight = 243\n";

const GROW: [&str; 11] = [
    "grow",
    "--plants",
    "1",
    "--steps",
    "4",
    "--photographs",
    "--scene",
    "scene.toml",
    "--out",
    "beans",
    "--quiet",
];

/// A folder with a track, a model of it, and a photographed virtual plant in `beans/plant-0001`.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("track.csv"), TRACK).unwrap();
    let fit = tropism(folder.path(), &["fit", "track.csv", "--out", "model.json"]);
    assert!(fit.status.success(), "{}", said(&fit));
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    let grown = tropism(folder.path(), &GROW);
    assert!(grown.status.success(), "{}", said(&grown));
    folder
}

/// Runs a command that must refuse to overwrite `input`, which stays as it is.
#[track_caller]
fn stays(folder: &TempDir, words: &[&str], output: &str, input: &str) {
    let before = fs::read(folder.path().join(input)).unwrap();
    let result = tropism(folder.path(), words);
    let message = said(&result);
    assert_eq!(result.status.code(), Some(1), "{words:?}: {message}");
    let wanted = [format!("{output}: this is the input "), format!("{input}: choose another name")];
    assert!(wanted.iter().all(|part| message.contains(part)), "{words:?}: {message}");
    assert!(fs::read(folder.path().join(input)).unwrap() == before, "{words:?}");
}

#[test]
fn no_output_overwrites_an_input() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("task.toml"), "targets = [[1.0, 5.0]]\nmax_steps = 10\n").unwrap();
    fs::write(path.join("bean.toml"), "").unwrap();
    stays(&folder, &["fit", "track.csv", "--out", "track.csv"], "track.csv", "track.csv");
    stays(
        &folder,
        &["fit", "track.csv", "--out", "./beans/../track.csv"],
        "./beans/../track.csv",
        "track.csv",
    );
    // In the folder that is read, too.
    fs::create_dir(path.join("tracks")).unwrap();
    fs::copy(path.join("track.csv"), path.join("tracks/1.csv")).unwrap();
    let fit = ["fit", "tracks", "--force", "--out", "tracks/../tracks/1.csv"];
    stays(&folder, &fit, "tracks/../tracks/1.csv", "tracks/1.csv");
    let tune = ["tune", "--model", "model.json", "--generations", "1", "--out"];
    stays(&folder, &[&tune[..], &["model.json"]].concat(), "model.json", "model.json");
    stays(&folder, &[&tune[..], &["task.toml", "--task", "task.toml"]].concat(), "task.toml", "task.toml");
    let simulate = ["simulate", "--model", "model.json", "--controller", "greedy", "--out"];
    stays(&folder, &[&simulate[..], &["model.json"]].concat(), "model.json", "model.json");
    stays(
        &folder,
        &[&simulate[..], &["task.toml", "--task", "task.toml"]].concat(),
        "task.toml",
        "task.toml",
    );
    let bean = ["calibrate", "track.csv", "--bean", "bean.toml", "--out", "."];
    if !said(&tropism(path, &bean)).contains("bean.toml: line") {
        stays(&folder, &bean, "./bean.toml", "bean.toml");
    }
    let photo = "beans/plant-0001/photographs/000001.jpg";
    let camera = ["calibrate-camera", photo, "--distance", "74", "--view", "53", "--force", "--out", photo];
    stays(&folder, &camera, photo, photo);
    fs::create_dir(path.join("evolution")).unwrap();
    fs::copy(path.join("model.json"), path.join("evolution/champion.json")).unwrap();
    let evolve =
        ["evolve", "--model", "evolution/champion.json", "--runs", "1", "--generations", "1", "--out"];
    let champion = "evolution/champion.json";
    stays(&folder, &[&evolve[..], &["evolution"]].concat(), champion, champion);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("track.csv", path.join("link.json")).unwrap();
        stays(&folder, &["fit", "track.csv", "--out", "link.json"], "link.json", "track.csv");
        fs::hard_link(path.join("track.csv"), path.join("hard.json")).unwrap();
        stays(&folder, &["fit", "track.csv", "--out", "hard.json"], "hard.json", "track.csv");
        stays(&folder, &["fit", "link.json", "--out", "hard.json"], "hard.json", "link.json");
    }
}

#[test]
fn reports_and_films_overwrite_nothing_of_a_run() {
    let folder = folder();
    let path = folder.path();
    let run = "beans/plant-0001";
    let inside = |name: &str| format!("{run}/{name}");
    for name in ["run.toml", "track.csv", "truth.csv", "photographs/000001.jpg"] {
        stays(&folder, &["report", run, "--out", &inside(name)], &inside(name), &inside(name));
    }
    stays(&folder, &["report", "track.csv", "--out", "track.csv"], "track.csv", "track.csv");
    let photo = inside("photographs/000001.jpg");
    for (source, out) in [
        (run, "photographs/000001.jpg"),
        ("beans/plant-0001/photographs", "photographs/000001.jpg"),
        // The composite beside it would take the place of the photograph.
        (run, "photographs/000001.gif"),
        ("beans/plant-0001/photographs", "photographs/000001.gif"),
    ] {
        stays(&folder, &["timelapse", source, "--out", &inside(out)], &photo, &photo);
        assert!(out.ends_with(".jpg") || !path.join(inside(out)).exists());
    }
    // A former report or picture in the folder of the run is replaced; a film if that is asked for.
    for _ in 0..2 {
        let report = tropism(path, &["report", "track.csv", "--out", "report.html", "--figures", "."]);
        assert!(report.status.success(), "{}", said(&report));
        let report = tropism(path, &["report", run, "--out", &inside("report.html"), "--figures", run]);
        assert!(report.status.success(), "{}", said(&report));
        let film =
            tropism(path, &["timelapse", run, "--width", "64", "--force", "--out", &inside("film.gif")]);
        assert!(film.status.success(), "{}", said(&film));
    }
}

#[test]
fn a_track_overwrites_no_photograph_even_by_force() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("photos")).unwrap();
    for name in ["1.jpg", "2.jpg"] {
        let jpeg = Image { width: 64, height: 48, rgb: vec![40; 3 * 64 * 48] }.to_jpeg(90).unwrap();
        fs::write(folder.path().join("photos").join(name), jpeg).unwrap();
    }
    let track = ["track", "photos", "--force", "--light", "none", "--out"];
    fs::write(folder.path().join("lights.csv"), "frame,light\n1.jpg,left\n2.jpg,left\n").unwrap();
    for (words, out) in [
        (&["t.csv", "--sheet", "photos/2.jpg"][..], "photos/2.jpg"),
        (&["photos/2.jpg"], "photos/2.jpg"),
        (&["lights.csv", "--light", "lights.csv"], "lights.csv"),
    ] {
        let start =
            if words.contains(&"--light") { &["track", "photos", "--force", "--out"][..] } else { &track };
        stays(&folder, &[start, words].concat(), out, out);
    }
    stays(&folder, &[&track[..], &["t.csv", "--overlay", "photos"]].concat(), "photos/1.jpg", "photos/1.jpg");
}

#[cfg(unix)]
#[test]
fn names_that_act_on_terminals_and_names_that_are_not_utf8_are_told_apart() {
    use std::os::unix::ffi::OsStrExt;
    let folder = folder();
    let path = folder.path();
    let names: [&[u8]; 4] = [b"a\xfe.jpg", b"a\xff.jpg", b"=b\x1b[2J\xe2\x80\xae.jpg", b"c\r\x07.jpg"];
    fs::create_dir(path.join("photos")).unwrap();
    for (number, name) in names.iter().enumerate() {
        let to = path.join("photos").join(std::ffi::OsStr::from_bytes(name));
        match number {
            0 | 1 => {
                fs::copy(path.join(format!("beans/plant-0001/photographs/{number:06}.jpg")), to).map(drop)
            }
            _ => fs::write(to, "no photograph"),
        }
        .unwrap();
    }
    let calibration = ["--calibration", "beans/plant-0001/calibration.toml", "--light", "none"];
    let track = ["track", "photos", "--out", "t.csv", "--overlay", "look"];
    let result = tropism(path, &[&track[..], &calibration].concat());
    let shown = said(&result);
    assert!(!shown.contains(['\x1b', '\r', '\x07', '\u{202e}']), "{shown:?}");
    assert!(shown.contains("=b\\u{1b}[2J\\u{202e}.jpg") && shown.contains("c\\r\\u{7}.jpg"), "{shown:?}");
    let table = fs::read_to_string(path.join("t.csv")).unwrap();
    assert!(table.contains(",a\\xfe.jpg,") && table.contains(",a\\xff.jpg,"), "{table}");
    let journal = fs::read_to_string(path.join("t.frames.jsonl")).unwrap();
    assert!(journal.contains("\"a\\\\xfe.jpg\"") && journal.contains("\"a\\\\xff.jpg\""), "{journal}");
    assert_eq!(fs::read_dir(path.join("look")).unwrap().count(), 2);
    let error = said(&tropism(path, &["fit", "no\x1b[2Jfile\u{9b}.csv", "--out", "m.json"]));
    assert!(error.contains("no\\u{1b}[2Jfile\\u{9b}.csv: cannot read"), "{error:?}");
    let film = tropism(path, &["timelapse", "photos", "--width", "64", "--out", "a.gif", "--json"]);
    assert!(said(&film).contains("\"pictures\":2"), "{}", said(&film));
}

#[test]
fn the_next_command_can_be_pasted() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("my track's $(x).csv"), TRACK).unwrap();
    let fit = said(&tropism(folder.path(), &["fit", "my track's $(x).csv", "--out", "my $(model).json"]));
    assert!(
        fit.contains(
            "wrote my $(model).json\nnext: tropism evolve --out evolution --model 'my $(model).json'"
        ),
        "{fit}"
    );
    let grow = said(&tropism(folder.path(), &["grow", "--plants", "1", "--steps", "2", "--out", "my beans"]));
    assert!(grow.contains("next: tropism fit 'my beans'/*.csv --out"), "{grow}");
}

#[test]
fn secrets_of_addresses_are_not_shown_and_a_file_is_advised() {
    let folder = tempfile::tempdir().unwrap();
    let rig = "[camera]\ndriver = \"http\"\nurl = \"http://admin:s3cret@127.0.0.1:1/shot?token=abc123\"\nretries = 0\n\
               [lamps]\nleft = [\"true\"]\nright = [\"true\"]\ndark = [\"true\"]\n\
               [calibration]\npx_per_cm = 11.0\nwidth = 64\nheight = 48\nbase = { x = 32.0, y = 40.0 }\n\
               [[alert]]\ndriver = \"ntfy\"\nurl = \"http://127.0.0.1:1/my-topic?auth=abc123\"\n\
               [[alert]]\ndriver = \"webhook\"\nurl = \"http://127.0.0.1:1/hook\"\n";
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    let hides = |text: &str| {
        assert!(!text.contains("s3cret") && !text.contains("abc123") && !text.contains("my-topic"), "{text}");
    };
    let checked = said(&tropism(folder.path(), &["check", "rig.toml"]));
    hides(&checked);
    assert!(checked.contains("camera (http://***@127.0.0.1:1/shot?token=***)"), "{checked}");
    for advised in [
        "camera.url: the address holds a user, a password or a token\n                 -> authorization_file",
        "alert.1.url: the address holds a user, a password or a token\n                 -> url_file",
    ] {
        assert!(checked.contains(advised), "{advised:?} is not in {checked}");
    }
    assert!(!checked.contains("alert.2.url"), "{checked}");
    fs::write(folder.path().join("rig.toml"), rig.replace("retries = 0", "retris = 0")).unwrap();
    hides(&said(&tropism(folder.path(), &["check", "rig.toml", "--dry"])));
    fs::write(folder.path().join("rig.toml"), rig.replace("http://admin", "htp://admin")).unwrap();
    hides(&said(&tropism(folder.path(), &["check", "rig.toml", "--dry"])));
    fs::write(folder.path().join("rig.toml"), rig.replace("abc123\"\nretries", "abc123\nretries")).unwrap();
    hides(&said(&tropism(
        folder.path(),
        &["run", "--rig", "rig.toml", "--controller", "greedy", "--out", "r"],
    )));
}
