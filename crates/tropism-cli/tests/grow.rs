//! Populations of virtual plants, with photographs and without.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const SCENE: &str = "width = 324\nheight = 243\n";
const OPTIONS: [&str; 9] =
    ["--controller", "periodic:1h", "--steps", "16", "--scene", "scene.toml", "--cameras", "2", "--faults"];
/// Everything but a lamp that fails, for then the plant would be another.
const FAULTS: &str =
    "missed_flash=0.05,fly=0.05,repeated=0.1,dropped=0.05,half_written=0.05,leaf_across=0.05";

fn tropism(folder: &Path, words: &[&str]) -> Result<String, String> {
    let output =
        Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(folder).args(words).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if output.status.success() { Ok(text(&output.stdout)) } else { Err(text(&output.stderr)) }
}

/// Every file below `folder`, in order, but for the lock.
fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap().map(|entry| entry.unwrap().path()) {
            if entry.is_dir() {
                folders.push(entry);
            } else if entry.file_name().unwrap() != "run.lock" {
                found.push((entry.strip_prefix(folder).unwrap().to_owned(), fs::read(&entry).unwrap()));
            }
        }
    }
    found.sort();
    found
}

#[test]
fn photographs_are_those_of_a_run_and_survive_an_interruption() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("scene.toml"), SCENE).unwrap();
    let grow = [&["grow", "--photographs", "--plants", "2"], &OPTIONS[..], &[FAULTS, "--out"]].concat();
    let printed = tropism(here, &[&grow[..], &["beans"]].concat()).unwrap();
    assert!(printed.contains("next: tropism track beans/plant-0001/photographs --calibration"), "{printed}");
    let whole = files(&here.join("beans"));
    // Plan and results; of each plant plan, calibrations, truths and track; a photograph a step and camera.
    assert_eq!(whole.len(), 2 + 2 * (6 + 2 * 17));
    assert!(tropism(here, &["status", "beans"]).unwrap().starts_with("beans: over, virtual plants"));

    // The track is that of the same plant without photographs.
    tropism(
        here,
        &[
            "grow",
            "--plants",
            "2",
            "--cameras",
            "2",
            "--controller",
            "periodic:1h",
            "--steps",
            "16",
            "--out",
            "bare",
        ],
    )
    .unwrap();
    for plant in ["plant-0001", "plant-0002"] {
        let track = fs::read(here.join("beans").join(plant).join("track.csv")).unwrap();
        assert!(track == fs::read(here.join("bare").join(plant).with_extension("csv")).unwrap(), "{plant}");
    }

    // The photographs are those of a run with the seed in the plant's plan.
    let plan = fs::read_to_string(here.join("beans/plant-0002/run.toml")).unwrap();
    let seed = plan.lines().find_map(|line| line.strip_prefix("seed = ")).unwrap();
    let run =
        [&["run", "--rig", "greenhouse", "--out", "run", "--seed", seed], &OPTIONS[..], &[FAULTS]].concat();
    tropism(here, &run).unwrap();
    for (name, bytes) in files(&here.join("beans/plant-0002")) {
        if name != Path::new("track.csv") {
            assert!(bytes == fs::read(here.join("run").join(&name)).unwrap(), "{name:?}");
        }
    }

    // Without a track a plant is not complete: it grows again, and what is missing is drawn again.
    for lost in ["plant-0001/track.csv", "plant-0001/photographs/000009.jpg", "plant-0001/side/000016.jpg"] {
        fs::remove_file(here.join("beans").join(lost)).unwrap();
    }
    let refused = tropism(here, &[&grow[..], &["beans"]].concat()).unwrap_err();
    assert!(refused.contains("beans: a set of photographed plants is here already"), "{refused}");
    let refused = tropism(here, &[&grow[..], &["beans", "--resume", "--seed", "2"]].concat()).unwrap_err();
    assert!(
        refused.contains("plant-0001/run.toml: a plant with other settings is here: --seed = "),
        "{refused}"
    );
    tropism(here, &["grow", "--out", "beans", "--resume"]).unwrap();
    assert!(files(&here.join("beans")) == whole);

    // They are read as any photographs are, from both sides, and are known to be virtual.
    for (photographs, calibration) in [("photographs", "calibration.toml"), ("side", "side/calibration.toml")]
    {
        let plant = |name: &str| format!("beans/plant-0001/{name}");
        let out = format!("{photographs}.csv");
        let printed = tropism(
            here,
            &[
                "track",
                &plant(photographs),
                "--calibration",
                &plant(calibration),
                "--roi",
                "57,86,140,150",
                "--out",
                &out,
                "--json",
            ],
        );
        let printed: serde_json::Value = serde_json::from_str(&printed.unwrap()).unwrap();
        assert_eq!((&printed["frames"], &printed["is_virtual"]), (&17.into(), &true.into()), "{printed}");
        assert!(printed["measured"].as_u64().unwrap() >= 8, "{printed}");
    }
    tropism(here, &["depth", "photographs.csv", "side.csv", "--distance", "74,74", "--out", "space.csv"])
        .unwrap();
    tropism(here, &["timelapse", "beans/plant-0001", "--width", "160", "--out", "film.gif"]).unwrap();
}

#[test]
fn what_is_about_photographs_is_refused_without_them() {
    let folder = tempfile::tempdir().unwrap();
    let refused = tropism(folder.path(), &["grow", "--faults", "fly=0.1", "--out", "beans"]).unwrap_err();
    assert!(refused.contains("wanted --photographs"), "{refused}");
    let refused = tropism(folder.path(), &["grow", "--resume", "--out", "beans"]).unwrap_err();
    assert!(refused.contains("beans/grow.toml: "), "{refused}");
    let refused = tropism(folder.path(), &["grow", "--list", "--out", "beans"]).unwrap_err();
    assert!(refused.contains("without --photographs grow as a whole"), "{refused}");
    assert!(!folder.path().join("beans").exists());
}

#[test]
fn a_track_of_photographs_has_the_lamps_of_the_plant() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let grow = ["grow", "--photographs", "--plants", "1", "--controller", "periodic:15m", "--steps", "12"];
    tropism(here, &[&grow[..], &["--out", "beans"]].concat()).unwrap();
    let plant = "beans/plant-0001";
    let calibration = format!("{plant}/calibration.toml");
    let photographs = format!("{plant}/photographs");
    tropism(here, &["track", &photographs, "--calibration", &calibration, "--out", "seen.csv"]).unwrap();
    let lights = |track: &str| -> Vec<String> {
        let text = fs::read_to_string(here.join(track)).unwrap();
        let place = text.lines().next().unwrap().split(',').position(|column| column == "light").unwrap();
        text.lines().skip(1).map(|row| row.split(',').nth(place).unwrap().to_owned()).collect()
    };
    let wanted = lights(&format!("{plant}/track.csv"));
    assert_eq!(wanted[..4], ["left", "left", "left", "right"]);
    assert_eq!(lights("seen.csv"), wanted);
}
