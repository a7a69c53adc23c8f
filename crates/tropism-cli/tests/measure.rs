//! The constants of plants, from the command line.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

fn tropism(folder: &Path, words: &[&str]) -> Result<String, String> {
    let output =
        Command::new(env!("CARGO_BIN_EXE_tropism")).current_dir(folder).args(words).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if output.status.success() { Ok(text(&output.stdout)) } else { Err(text(&output.stderr)) }
}

#[test]
fn tipped_beans_are_measured_to_the_same_bits_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let grow = [
        "grow", "--plants", "2", "--steps", "48", "--period", "10m", "--tilt", "60", "--dark", "--out",
        "beans",
    ];
    tropism(here, &grow).unwrap();
    let track = fs::read_to_string(here.join("beans/plant-0001.csv")).unwrap();
    assert!(track.lines().skip(1).all(|line| line.contains(",dark,")), "{track}");
    let measure = |words: &[&str]| -> Value {
        let all = [
            &["measure", "--group", "bean=beans/*.csv", "--tilt", "60", "--check-plants", "1", "--json"],
            words,
        ]
        .concat();
        serde_json::from_str(&tropism(here, &all).unwrap()).unwrap()
    };
    let one = measure(&["--threads", "1", "--out", "measure"]);
    assert_eq!(one, measure(&["--threads", "2"]));
    assert_eq!(one["is_virtual"], true);
    let plants = one["plants"].as_array().unwrap();
    assert_eq!((plants.len(), &plants[0]["group"]), (2, &"bean".into()));
    for estimate in plants[0]["estimates"].as_array().unwrap() {
        let is_open = estimate["status"] != "measured";
        assert_eq!(is_open, estimate["reason"] != "", "what is not measured has a reason: {estimate}");
    }
    let table = fs::read_to_string(here.join("measure/constants.csv")).unwrap();
    assert!(table.starts_with("plant,group,symbol,value,low_90,high_90,unit,status,reason\n"));
    let page = fs::read_to_string(here.join("measure/report.html")).unwrap();
    assert!(page.contains("Virtual plants") && page.contains("What these data cannot say"));
    // The species file says what was measured, and virtual plants of it grow.
    let species = fs::read_to_string(here.join("measure/species.toml")).unwrap();
    assert!(species.contains("# typical.growth.rate: G ") && species.contains("guesses"), "{species}");
    let words = ["grow", "--bean", "measure/species.toml", "--plants", "1", "--steps", "2", "--out", "more"];
    tropism(here, &words).unwrap();
    let again = tropism(here, &["measure", "beans", "--tilt", "60", "--out", "measure"]).unwrap_err();
    assert!(again.contains("--force"), "{again}");
}

#[test]
fn a_table_of_light_stands_for_the_lamps_of_a_track() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let grow = ["grow", "--plants", "1", "--steps", "60", "--controller", "periodic:1h", "--out", "lit"];
    tropism(here, &grow).unwrap();
    let track = fs::read_to_string(here.join("lit/plant-0001.csv")).unwrap();
    assert!(track.contains(",left,") && track.contains(",right,"));
    fs::create_dir(here.join("dark")).unwrap();
    let without = track.replace(",left,", ",dark,").replace(",right,", ",dark,");
    fs::write(here.join("dark/plant-0001.csv"), without).unwrap();
    // Steps of five minutes: twelve an hour.
    let word = |hour: usize| {
        if track.lines().nth(1 + 12 * hour).unwrap().contains(",left,") { "left" } else { "right" }
    };
    let rows: String = (0..5).map(|hour| format!("{hour},{}\n", word(hour))).collect();
    fs::write(here.join("light.csv"), format!("time_h,light\n{rows}")).unwrap();
    let measure = |words: &[&str]| -> Value {
        let all = [&["measure", "--check-plants", "0", "--json"], words].concat();
        serde_json::from_str(&tropism(here, &all).unwrap()).unwrap()
    };
    let wanted = measure(&["lit", "--lamps"]);
    assert_eq!(measure(&["dark", "--light", "light.csv"]), wanted);
    assert_ne!(measure(&["dark", "--lamps"]), wanted);
}

#[test]
fn groups_of_angles_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (group, rate) in [("seeing", 30.0), ("blind", 1.0)] {
        fs::create_dir(here.join(group)).unwrap();
        for plant in 0..4 {
            let rate = rate + f64::from(plant);
            let rows: String =
                (0..19).map(|k| format!("{},{}\n", 0.1 * f64::from(k), rate * 0.1 * f64::from(k))).collect();
            fs::write(here.join(format!("{group}/{plant}.csv")), format!("time_h,tip_angle_deg\n{rows}"))
                .unwrap();
        }
    }
    let words = ["measure", "--group", "seeing=seeing/*.csv", "--group", "blind=blind/*.csv", "--json"];
    let results: Value = serde_json::from_str(&tropism(here, &words).unwrap()).unwrap();
    let turn = results["comparisons"].as_array().unwrap().iter().find(|row| row["symbol"] == "turn").unwrap();
    // Two of the 70 ways to choose four of eight are as far apart.
    assert_eq!((&turn["test"]["auc"], &turn["test"]["p"]), (&1.0.into(), &(2.0 / 70.0).into()));
}

#[test]
fn wrong_use_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (words, says) in [
        (&["measure", "--demo", "--tilt", "500"][..], "--tilt"),
        (&["measure"][..], "TRACK.csv"),
        (&["measure", "none.csv"][..], "none.csv"),
        (&["measure", "--group", "x=*.csv"][..], "no file matches"),
    ] {
        let error = tropism(here, words).unwrap_err();
        assert!(error.contains(says), "{words:?}: {error}");
    }
}
