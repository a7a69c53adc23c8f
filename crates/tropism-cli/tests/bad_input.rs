//! What a user may get wrong: one clear line, exit code 1 or 2, no panic, and what was there stays.

use std::fs;
use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

const TRACK: &str = "step,time_s,tip_x_cm,tip_y_cm,light,quality\n0,0,0,4,left,measured\n1,300,-0.1,4.03,right,measured\n\
                     2,600,0,4.06,right,measured\n3,900,0.1,4.1,dark,measured\n";

/// A folder with a good track, model, controller and photograph in it.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    put("track.csv", TRACK);
    put("empty", "");
    put("header.csv", "x,y\n1,2\n");
    put("nan.csv", &TRACK.replace("-0.1", "NaN"));
    put("infinite.csv", &TRACK.replace("-0.1", "inf"));
    put("truncated.csv", &TRACK[..TRACK.len() - 20]);
    put("rows.csv", "tip_x_cm,tip_y_cm,light\n");
    put("dark.csv", "tip_x_cm,tip_y_cm,light\n0,4,dark\n0,4,dark\n");
    put("bad.toml", "targts = [[1.0, 5.0]]\n");
    put("swapped.toml", "targets = [[1.0, 9.0], [1.0, 5.0]]\n");
    put("nan.toml", "targets = [[nan, 9.0]]\n");
    put("photo.jpg", "no photograph");
    put("nothing.toml", "");
    fs::create_dir(folder.path().join("photos")).unwrap();
    let result = tropism(folder.path(), &["fit", "track.csv", "--out", "model.json"]);
    assert_eq!(result.0, 0, "{}", result.1);
    let text = fs::read_to_string(folder.path().join("model.json")).unwrap();
    put("half.json", &text[..text.len() / 2]);
    put("other.json", &text.replace("model/2", "model/7"));
    folder
}

fn tropism(folder: &Path, words: &[&str]) -> (i32, String) {
    let output =
        Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(folder).args(words).output().unwrap();
    (output.status.code().unwrap_or(-1), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Runs a command that must fail with a message that holds all of `wanted`.
#[track_caller]
fn fails(folder: &TempDir, words: &[&str], wanted: &[&str]) {
    let (code, message) = tropism(folder.path(), words);
    assert!(code == 1 || code == 2, "{words:?}: exit code {code}: {message}");
    assert!(!message.contains("panicked"), "{words:?}: {message}");
    for part in wanted {
        assert!(message.contains(part), "{words:?}: {message:?} lacks {part:?}");
    }
    if code == 1 {
        let errors = message.lines().filter(|line| line.starts_with("error: ")).count();
        assert_eq!(errors, 1, "{words:?}: {message}");
        assert!(message.matches("os error").count() <= 1, "a cause is said once: {message}");
    }
}

#[test]
fn tracks() {
    let folder = folder();
    for (file, wanted) in [
        ("absent.csv", "absent.csv: cannot read"),
        ("empty", "tip_x_cm"),
        ("header.csv", "wanted \"tip_x_cm\""),
        ("nan.csv", "line 3: found tip_x_cm \"NaN\""),
        ("infinite.csv", "line 3"),
        ("truncated.csv", "truncated.csv"),
        ("rows.csv", "no rows"),
        ("photo.jpg", "photo.jpg"),
        ("photos", "photos: no track in this folder"),
    ] {
        fails(&folder, &["fit", file, "--out", "out.json"], &[wanted]);
        fails(&folder, &["score", file], &[wanted]);
    }
    fails(&folder, &["fit", "dark.csv", "--out", "out.json"], &["no step of 1 tracks can be used"]);
    assert!(!folder.path().join("out.json").exists());
}

#[test]
fn earlier_output_stays() {
    let folder = folder();
    let before = fs::read(folder.path().join("model.json")).unwrap();
    fails(&folder, &["fit", "track.csv", "nan.csv", "--out", "model.json", "--force"], &["nan.csv"]);
    fails(&folder, &["fit", "track.csv", "--window", "-1,1", "--out", "model.json", "--force"], &["window"]);
    assert_eq!(fs::read(folder.path().join("model.json")).unwrap(), before);
    fs::create_dir(folder.path().join("taken")).unwrap();
    fails(&folder, &["fit", "track.csv", "--out", "model.json"], &["a file is here already", "--force"]);
    fails(&folder, &["fit", "track.csv", "--out", "taken"], &["taken: cannot write"]);
    fails(
        &folder,
        &["fit", "track.csv", "--out", "no/such/folder/model.json"],
        &["no/such/folder/model.json: cannot write"],
    );
    let grow = |plants| ["grow", "--plants", plants, "--steps", "2", "--out", "beans"];
    assert_eq!(tropism(folder.path(), &grow("2")).0, 0);
    fails(&folder, &grow("1"), &["plant-0002.csv: this is the track of one more plant"]);
    fails(&folder, &grow("2"), &["plant-0001.csv: a file is here already", "--force"]);
    assert_eq!(tropism(folder.path(), &[&grow("2")[..], &["--force"]].concat()).0, 0);
    fs::write(folder.path().join("forecast.json"), "kept").unwrap();
    let tune = ["tune", "--model", "model.json", "--out", "forecast.json"];
    fails(&folder, &tune, &["forecast.json: a file is here already", "or replace it by --force"]);
    for (words, wanted) in [
        (
            &["baseline", "--model", "model.json", "--count", "10", "--out", "forecast.json"][..],
            "found a file",
        ),
        (&["calibrate", "track.csv", "--out", "forecast.json"], "wanted a folder for a calibration"),
        (
            &["forecast", "--models", "model.json", "--horizons", "5", "--plants", "1", "--out", "."],
            "no forecast.toml beside it",
        ),
    ] {
        fails(&folder, words, &["forecast.json: ", wanted, "choose a new", "(--out)"]);
        assert_eq!(fs::read(folder.path().join("forecast.json")).unwrap(), b"kept");
    }
    assert_eq!(tropism(folder.path(), &[&tune[..], &["--generations", "1", "--force"]].concat()).0, 0);
    assert_ne!(fs::read(folder.path().join("forecast.json")).unwrap(), b"kept");
    fs::write(folder.path().join("rule.search.jsonl"), "").unwrap();
    let tune = ["tune", "--model", "model.json", "--generations", "1", "--out", "rule.json"];
    fails(&folder, &tune, &["rule.search.jsonl: an interrupted search is here", "--resume"]);
}

#[test]
fn options_that_would_do_nothing() {
    let folder = folder();
    let tune = ["tune", "--model", "model.json", "--out", "rule.json", "--variation", "0.5"];
    fails(&folder, &tune, &["--variation", "go with --beans"]);
    fails(&folder, &["evolve", "--out", "e", "--resume"], &["e/evolution.toml: cannot read"]);
    fs::write(folder.path().join("methods.toml"), "replicates = 2\n[[scenarios]]\nname = \"one\"\n").unwrap();
    fs::write(
        folder.path().join("space.toml"),
        "kind = \"space\"\ntargets = [[1.0, 6.0]]\ndepths_cm = [1.0]\n",
    )
    .unwrap();
    let space = ["--controller", "greedy", "--task", "space.toml", "--lamps", "2", "--out", "n.json"];
    for command in [&["grow"][..], &["run", "--rig", "greenhouse"]] {
        fails(&folder, &[command, &space].concat(), &["takes 4 lamps", "leave --lamps"]);
    }
    let study = ["study", "methods.toml", "--keep", "photographs", "--out", "study"];
    fails(&folder, &study, &["--keep does not go with"]);
    fs::write(folder.path().join("nowhere.toml"), "targets = []\n").unwrap();
    let nowhere = ["--model", "model.json", "--task", "nowhere.toml", "--out", "n.json"];
    for command in ["baseline", "tune", "evolve"] {
        fails(&folder, &[&[command], &nowhere[..]].concat(), &["--task: it has no targets"]);
    }
    fails(&folder, &["status", "model.json"], &["model.json: this is no rule of `tune`"]);
    assert!(
        ["rule.json", "f.json", "e", "study", "n.json"].iter().all(|name| !folder.path().join(name).exists())
    );
}

#[test]
fn models() {
    let folder = folder();
    for (model, wanted) in [
        ("absent.json", "absent.json: cannot read"),
        ("empty", "empty: found no model"),
        ("half.json", "half.json: found no model"),
        ("other.json", "wanted \"tropism.model/2\""),
        ("track.csv", "track.csv: found no model"),
    ] {
        fails(&folder, &["baseline", "--model", model, "--count", "10"], &[wanted]);
        fails(&folder, &["evolve", "--model", model, "--out", "e", "--generations", "1"], &[wanted]);
        fails(
            &folder,
            &["simulate", "--model", model, "--controller", "greedy", "--out", "t.csv"],
            &[wanted],
        );
    }
    assert!(!folder.path().join("e").exists());
}

#[test]
fn a_model_without_data_where_the_plant_is_says_so() {
    let folder = folder();
    fs::write(folder.path().join("high.csv"), TRACK.replace(",4", ",40")).unwrap();
    assert_eq!(tropism(folder.path(), &["fit", "high.csv", "--out", "high.json"]).0, 0);
    let words = ["--model", "high.json", "--controller", "greedy", "--out", "t.csv"];
    fails(&folder, &[&["simulate"], &words[..]].concat(), &["no data", "0.0, 4.0"]);
    fails(&folder, &["evolve", "--model", "high.json", "--out", "e"], &["no data"]);
    fails(&folder, &["baseline", "--model", "high.json", "--count", "10"], &["no data"]);
}

#[test]
fn controllers() {
    let folder = folder();
    let xor = tropism_neat::Neat::new(tropism_neat::Config::wahby2016(), 3, 2, 1).unwrap();
    fs::write(folder.path().join("shape.json"), xor.ask()[0].to_json()).unwrap();
    for (controller, wanted) in [
        ("absent.json", "absent.json: cannot read"),
        ("empty", "empty"),
        ("half.json", "half.json"),
        ("shape.json", "3 inputs and 2 outputs"),
    ] {
        fails(
            &folder,
            &["simulate", "--model", "model.json", "--controller", controller, "--out", "t.csv"],
            &[wanted],
        );
        fails(&folder, &["run", "--rig", "greenhouse", "--controller", controller, "--out", "r"], &[wanted]);
        fails(&folder, &["grow", "--controller", controller, "--out", "g"], &[wanted]);
    }
    fails(
        &folder,
        &["run", "--rig", "greenhouse", "--controller", "periodic:soon", "--out", "r"],
        &["wanted a time"],
    );
    assert!(!folder.path().join("r").exists() && !folder.path().join("g").exists());
}

#[test]
fn genomes() {
    let folder = folder();
    let config = tropism_neat::Config::wahby2016();
    let json = tropism_neat::random_genome(&config, 2, 1, 1, 0).to_json();
    let put = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    put("good.json", &json);
    let weight = json.find("\"weight\":").unwrap() + 9;
    let end = weight + json[weight..].find(',').unwrap();
    let weighing = |weight_is: &str| format!("{}{weight_is}{}", &json[..weight], &json[end..]);
    for (text, wanted) in [
        (String::new(), "not a genome file: EOF"),
        (json[..json.len() / 2].to_owned(), "not a genome file: EOF"),
        (
            json.replace("genome/1", "genome/2"),
            "found schema \"tropism.genome/2\", wanted \"tropism.genome/1\"",
        ),
        (json.replace("\"from\":3", "\"from\":33"), "from or to neuron 33, wanted a neuron of the genome"),
        (json.replace("\"innovation\":2", "\"innovation\":1"), "innovation 1 after 1"),
        (json.replace("\"to\":4", "\"to\":1"), "to neuron 1, wanted an output or a hidden neuron"),
        (json.replace("\"id\":2", "\"id\":1"), "neuron id 1 after 1"),
        (weighing("1e308"), "wanted a magnitude of at most 1000000"),
        (weighing("1e999"), "out of range"),
        (weighing("null"), "invalid type: null"),
        (json.replace("\"inputs\": 2", "\"inputs\": 200000000"), "200000000 inputs"),
    ] {
        put("bad.json", &text);
        fails(&folder, &["show", "bad.json"], &["bad.json: ", wanted]);
        fails(&folder, &["show", "bad.json", "--out", "bad.svg"], &["bad.json: ", wanted]);
    }
    assert!(!folder.path().join("bad.svg").exists());
    fails(&folder, &["show", "absent.json"], &["absent.json: cannot read"]);
    fails(&folder, &["show", "photos"], &["photos: found no champion.json"]);
    fails(&folder, &["show", "good.json", "--out", "a.png"], &["a.png: wanted .html, .svg, .dot or .txt"]);
    fails(&folder, &["show", "good.json", "--model", "half.json"], &["half.json: found no model"]);
    put("photos/evolution.toml", "");
    fails(&folder, &["show", "photos"], &["evolution.toml"]);
    put("photos/champion.json", &json);
    fails(&folder, &["show", "photos"], &["evolution.toml"]);
    let run = ["run", "--rig", "greenhouse", "--controller", "greedy", "--steps", "1", "--out", "r"];
    assert_eq!(tropism(folder.path(), &run).0, 0);
    fails(&folder, &["show", "r"], &["run.toml: found the controller \"greedy\", wanted a network"]);
    let three = tropism_neat::random_genome(&config, 3, 1, 1, 0).to_json();
    put("three.json", &three);
    assert_eq!(tropism(folder.path(), &["show", "three.json", "--out", "three.html"]).0, 0);
    fails(&folder, &["show", "three.json", "--model", "model.json"], &["three.json", "3 inputs"]);
}

#[test]
fn tasks_rigs_and_studies() {
    let folder = folder();
    fails(&folder, &["score", "track.csv", "--task", "bad.toml"], &["bad.toml", "targts", "targets"]);
    fails(&folder, &["score", "track.csv", "--task", "swapped.toml"], &["swapped.toml", "targets[1]"]);
    fails(&folder, &["score", "track.csv", "--task", "nan.toml"], &["targets[0]"]);
    fails(&folder, &["study", "bad.toml"], &["bad.toml", "targts"]);
    // Other files than settings: none is printed whole.
    fs::write(folder.path().join("long.toml"), "x".repeat(5000)).unwrap();
    fails(&folder, &["study", "long.toml"], &["long.toml: line 1: found \"xxx", "xxx...\""]);
    fs::write(folder.path().join("bytes.toml"), b"seed = \xff").unwrap();
    fails(
        &folder,
        &["study", "bytes.toml"],
        &["bytes.toml: found a byte that is no text (UTF-8) at place 8"],
    );
    fails(&folder, &["study", "absent.toml"], &["absent.toml: cannot read"]);
    fs::write(folder.path().join("methods.toml"), "replicats = 2\n[[scenarios]]\nname = \"one\"\n").unwrap();
    fails(&folder, &["study", "methods.toml"], &["methods.toml: line 1", "`replicats`", "`replicates`"]);
    fs::write(folder.path().join("zero.toml"), "experiments = 0\n").unwrap();
    fails(&folder, &["study", "zero.toml"], &["experiments = 0"]);
    let run = |rig| ["run", "--rig", rig, "--controller", "greedy", "--out", "r"];
    fails(&folder, &run("absent.toml"), &["absent.toml: cannot read"]);
    fails(&folder, &run("bad.toml"), &["bad.toml", "targts"]);
    fails(&folder, &run("nothing.toml"), &["nothing.toml", "no [camera] and no [lamps]"]);
    fs::write(folder.path().join("scale.toml"), "[greenhouse]\nvariation = 3.0\n").unwrap();
    fails(&folder, &run("scale.toml"), &["greenhouse.variation = 3"]);
    let parts = [("06:00", "22:00"), ("21:00", "23:00")]
        .map(|(from, to)| format!("[[programme]]\nfrom = \"{from}\"\nto = \"{to}\"\n"));
    fs::write(folder.path().join("night.toml"), format!("[greenhouse]\n{}", parts.concat())).unwrap();
    fails(
        &folder,
        &run("night.toml"),
        &["night.toml: programme 2: found 21:00 to 23:00", "programme 1, 06:00 to 22:00"],
    );
    let speed = |rig, speed| [&run(rig)[..], &["--speed", speed]].concat();
    for wrong in ["0", "fast", "inf", "NaN", "1e-300"] {
        fails(&folder, &speed("greenhouse", wrong), &["wanted max, or a number"]);
    }
    let command = "[camera]\ncommand = [\"camera\"]\n[lamps]\nleft = [\"l\"]\nright = [\"r\"]\ndark = [\"d\"]\n\
                   [calibration]\npx_per_cm = 9.0\nwidth = 648\nheight = 486\nbase = { x = 324.0, y = 400.0 }\n";
    fs::write(folder.path().join("real.toml"), command).unwrap();
    fails(&folder, &speed("real.toml", "2"), &["--speed 2: this is a real tent"]);
    assert!(!folder.path().join("r").exists());
}

#[test]
fn photographs() {
    let folder = folder();
    fails(&folder, &["track", "absent", "--out", "t.csv"], &["absent: cannot read"]);
    fails(&folder, &["track", "photos", "--out", "t.csv"], &["photos: no photographs here: no .jpg"]);
    fails(&folder, &["track", "photo.jpg", "--out", "t.csv"], &["photo.jpg", "wanted a JPEG, PNG or TIFF"]);
    fails(&folder, &["track", "photo.jpg", "--roi", "1,2,3", "--out", "t.csv"], &["wanted X,Y,WIDTH,HEIGHT"]);
    assert!(!folder.path().join("t.csv").exists());
}

#[test]
fn folders_that_are_taken() {
    let folder = folder();
    let run = ["run", "--rig", "greenhouse", "--controller", "periodic", "--steps", "2", "--out", "r"];
    assert_eq!(tropism(folder.path(), &run).0, 0);
    fails(&folder, &run, &["r: a run is here already", "--resume"]);
    let other = [&run[..], &["--resume", "--seed", "9"]].concat();
    fails(&folder, &other, &["run.toml", "other settings", "seed = 1"]);
    let evolve = ["evolve", "--model", "model.json", "--runs", "1", "--generations", "2", "--out", "e"];
    assert_eq!(tropism(folder.path(), &evolve).0, 0);
    fails(&folder, &evolve, &["e: an evolution is here already"]);
    assert_eq!(tropism(folder.path(), &["export", "r", "--out", "exported"]).0, 0);
    fails(&folder, &["status", "absent"], &["absent: there is no such folder or file: name a folder that"]);
    fails(&folder, &["status", "exported"], &["exported: there is no journal", "exports"]);
    fails(
        &folder,
        &["report", "photos", "--out", "report.html"],
        &["photos: this is not the folder of a finished run"],
    );
}

#[test]
fn numbers_out_of_range() {
    let folder = folder();
    let evolve = |option, value| vec!["evolve", "--model", "model.json", "--out", "e", option, value];
    fails(&folder, &evolve("--runs", "0"), &["runs"]);
    fails(&folder, &evolve("--generations", "0"), &["generations"]);
    fails(&folder, &evolve("--population", "0"), &["population"]);
    fails(&folder, &evolve("--episodes", "0"), &["episodes"]);
    fails(&folder, &["baseline", "--model", "model.json", "--count", "0"], &["--count"]);
    let run = [
        "run",
        "--rig",
        "greenhouse",
        "--controller",
        "greedy",
        "--out",
        "r",
        "--seed",
        "9223372036854775808",
    ];
    fails(&folder, &run, &["9223372036854775808", "--seed", "0..=9223372036854775807"]);
    fails(&folder, &["grow", "--variation", "7", "--out", "g"], &["--variation 7"]);
    fails(&folder, &["studio", "--listen", "localhost:8217"], &["localhost:8217", "such as 127.0.0.1:8217"]);
    fails(
        &folder,
        &["studio", "model.json", "--listen", "127.0.0.1:0"],
        &["model.json: this is a file: name a folder"],
    );
    fails(&folder, &["grow", "--plants", "0", "--out", "g"], &["--plants"]);
    assert!(!folder.path().join("e").exists() && !folder.path().join("g").exists());
}

#[test]
fn beans_scenes_and_faults() {
    let folder = folder();
    let put = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    for (text, wanted) in [
        ("[typical.growth]\nspeed = 1\n", "bean.toml: line 2: found \"speed = 1\": unknown field `speed`"),
        ("[typical.growth]\nrate = \"4 mm/h\"\n", "line 2: found \"rate = \\\"4 mm/h\\\"\": invalid type"),
        // Minutes, millimetres, Pa and cm an hour where hours, cm, MPa and cm a step are wanted.
        ("[typical.nutation]\nperiod_h = 100\n", "bean.toml: found typical.nutation.period_h = 100, wanted"),
        ("[typical.stem]\nradius_base = 1.7\n", "typical.stem.radius_base = 1.7, wanted a radius"),
        ("[typical.stem]\nmodulus_mpa = 4e7\n", "typical.stem.modulus_mpa = 40000000, wanted"),
        ("[typical.growth]\nrate = 0.4\n", "typical.growth.rate = 0.4, wanted 0 to 0.2 cm per five minutes"),
        ("[typical.tropism]\nlight = nan\n", "typical.tropism.light = NaN"),
        ("[spread]\ngrowth_rate = -0.1\n", "spread.growth_rate = -0.1, wanted a share"),
        ("name = [", "bean.toml: line 1"),
    ] {
        put("bean.toml", text);
        fails(&folder, &["grow", "--bean", "bean.toml", "--out", "g"], &[wanted]);
        let run =
            ["run", "--rig", "greenhouse", "--controller", "greedy", "--out", "r", "--bean", "bean.toml"];
        fails(&folder, &run, &[wanted]);
        fails(&folder, &["study", "--quick", "--out", "s", "--bean", "bean.toml"], &[wanted]);
    }
    let run = ["run", "--rig", "greenhouse", "--controller", "greedy", "--out", "r"];
    for (text, wanted) in [
        ("widht = 640\n", "scene.toml: line 1: found \"widht = 640\": unknown field `widht`"),
        ("width = 640.5\n", "invalid type"),
        ("width = 0\n", "scene.toml: found scene.width = 0, wanted 64 to 8192"),
    ] {
        put("scene.toml", text);
        fails(&folder, &[&run[..], &["--scene", "scene.toml"]].concat(), &[wanted]);
    }
    for (faults, wanted) in [
        ("gremlin=0.1", "unknown field `gremlin`"),
        ("fly=2", "faults.fly = 2, wanted a probability"),
        ("fly", "wanted names and rates"),
    ] {
        fails(&folder, &[&run[..], &["--faults", faults]].concat(), &[wanted]);
    }
    fails(&folder, &[&run[..], &["--variation", "3"]].concat(), &["--variation 3, wanted 0 to 2"]);
    put("rig.toml", "[greenhouse]\n");
    let rig = ["run", "--rig", "rig.toml", "--controller", "greedy", "--out", "r", "--variation", "0"];
    fails(&folder, &rig, &["rig.toml: write them into its [greenhouse]"]);
    for (fault_policy, wanted) in [
        ("moved_px = -1", "rig.toml: found fault_policy.moved_px = -1, wanted 0 to 100000, or inf"),
        ("hot_c = nan", "rig.toml: found fault_policy.hot_c = NaN, wanted 0 to 200, or inf"),
        ("flash_tries = 0", "rig.toml: found fault_policy.flash_tries = 0, wanted 1 to 10"),
        (
            "reserve_mb = 4000000000",
            "rig.toml: found fault_policy.reserve_mb = 4000000000, wanted 0 to 10000",
        ),
        ("gap_min = 1e300", "wanted 0 to 525600, or inf"),
        ("flash_tries = \"2\"", "rig.toml: line 2: found \"flash_tries = \\\"2\\\"\": invalid type"),
    ] {
        put("rig.toml", &format!("[fault_policy]\n{fault_policy}\n[greenhouse]\n"));
        fails(&folder, &rig[..7], &[wanted]);
    }
    for (camera, wanted) in [
        ("retries = 4294967295", &["rig.toml: line 6", "retries = 4294967295", "wanted 0 to 10"][..]),
        ("discard_frames = -1", &["rig.toml: line 6", "discard_frames = -1", "wanted 0 to 1000"]),
        ("timeout_s = 3601", &["rig.toml: line 6", "timeout_s = 3601", "wanted 0 to 3600 seconds"]),
    ] {
        let v4l2 = "[camera]\ndriver = \"v4l2\"\ndevice = \"/dev/video0\"\nwidth = 640\nheight = 480\n";
        put("rig.toml", &format!("{v4l2}{camera}\n"));
        fails(&folder, &rig[..7], wanted);
    }
    assert!(["g", "r", "s"].iter().all(|made| !folder.path().join(made).exists()));
}

#[cfg(unix)]
#[test]
fn pipes_devices_and_folders_are_no_files_and_are_not_waited_for() {
    let folder = folder();
    assert!(Command::new("mkfifo").arg(folder.path().join("pipe.csv")).status().unwrap().success());
    fs::create_dir(folder.path().join("folder.csv")).unwrap();
    for (file, found) in
        [("pipe.csv", "this is a pipe"), ("folder.csv", "no track in this folder"), ("/dev/zero", "a device")]
    {
        for command in [&["score", file][..], &["fit", file, "--out", "m.json"]] {
            fails(&folder, command, &[file, found]);
        }
    }
    let rig = ["run", "--rig", "pipe.csv", "--controller", "greedy", "--out", "r"];
    fails(&folder, &rig, &["pipe.csv", "this is a pipe"]);
}
