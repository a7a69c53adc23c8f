//! From tracks to models that are compared on plants that were left out.

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

/// A folder with tracks of three virtual beans, their models of the tip and of the stem, and tracks of two further beans.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    tropism(here, &["grow", "--plants", "3", "--steps", "300", "--out", "beans"]).unwrap();
    tropism(here, &["grow", "--plants", "2", "--steps", "200", "--seed", "2", "--out", "others"]).unwrap();
    for model in ["tip", "stem"] {
        tropism(here, &["fit", "beans", "--kind", model, "--out", &format!("{model}.json")]).unwrap();
    }
    folder
}

fn json(folder: &Path, words: &[&str]) -> Value {
    serde_json::from_str(&tropism(folder, &[words, &["--json"]].concat()).unwrap()).unwrap()
}

#[test]
fn models_are_compared_on_virtual_beans_to_the_same_bits_on_any_number_of_threads() {
    let folder = folder();
    let here = folder.path();
    let forecast = [
        "forecast",
        "--models",
        "tip.json",
        "stem.json",
        "--plants",
        "3",
        "--horizons",
        "5,60",
        "--interval",
        "120",
    ];
    let uneven = ["forecast", "--models", "tip.json", "--tracks", "others", "--horizons", "5,62,4", "--json"];
    let uneven: Value = serde_json::from_str(&tropism(here, &uneven).unwrap()).unwrap();
    assert_eq!(uneven["horizons_min"], serde_json::json!([5.0, 60.0]), "whole steps, each once");
    let one = json(here, &[&forecast[..], &["--threads", "1", "--out", "one"]].concat());
    let two = json(here, &[&forecast[..], &["--threads", "2", "--out", "two"]].concat());
    assert_eq!(one, two);
    assert_eq!((&one["truth"], &one["is_virtual"]), (&"noise-free".into(), &true.into()));
    let lights = one["lights"].as_array().unwrap();
    assert_eq!(
        lights.iter().map(|light| light["light"].as_str().unwrap()).collect::<Vec<_>>(),
        ["six-hour", "random"]
    );
    for light in lights {
        let names: Vec<&str> =
            light["models"].as_array().unwrap().iter().map(|model| model["name"].as_str().unwrap()).collect();
        assert_eq!(names, ["standing still", "tip", "stem"]);
        let after_an_hour =
            |model: usize, part: &str| light["models"][model][part][1]["mean_cm"].as_f64().unwrap();
        assert!(after_an_hour(2, "tip") < after_an_hour(0, "tip"), "{light}");
        assert!(after_an_hour(2, "stem") < after_an_hour(0, "stem"), "{light}");
        let within = light["models"][2]["stem"][1]["within_90"].as_f64().unwrap();
        assert!((0.5..=1.0).contains(&within), "{light}");
        assert!(light["models"][1]["stem"].is_null() && light["models"][0]["tip"][0]["within_90"].is_null());
    }
    let figure = fs::read_to_string(here.join("one/figure-forecast.svg")).unwrap();
    assert!(figure.contains("stem, random light") && figure.contains("standing still"));
    let saved: Value =
        serde_json::from_str(&fs::read_to_string(here.join("one/forecast.json")).unwrap()).unwrap();
    assert_eq!(saved, one);
}

#[test]
fn tracks_that_were_left_out_judge_too() {
    let folder = folder();
    let here = folder.path();
    let forecast = ["forecast", "--models", "stem.json", "--tracks", "others", "--horizons", "30"];
    let printed = tropism(here, &forecast).unwrap();
    assert!(
        printed.contains("2 virtual plants left out") && printed.contains("measured tips and stems"),
        "{printed}"
    );
    let error = |words: &[&str]| tropism(here, words).unwrap_err();
    let far = error(&["forecast", "--models", "stem.json", "--tracks", "others", "--horizons", "3000"]);
    assert!(far.contains("found no start in 2 plants"), "{far}");
    let none = error(&["forecast", "--models", "stem.json", "--horizons", "0"]);
    assert!(none.contains("--horizons") && none.contains("1 to 10000 minutes"), "{none}");
}

#[test]
fn a_model_in_space_is_judged_in_space_and_beside_one_of_the_plane_from_the_front() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    tropism(here, &["grow", "--plants", "3", "--steps", "200", "--cameras", "2", "--out", "beans"]).unwrap();
    for model in ["space", "stem"] {
        tropism(here, &["fit", "beans", "--kind", model, "--out", &format!("{model}.json")]).unwrap();
    }
    let forecast = ["forecast", "--plants", "2", "--horizons", "60", "--interval", "240", "--models"];
    let errors = |models: &[&str]| {
        let out = format!("forecast-{}", models.len());
        let printed = json(here, &[&forecast[..], models, &["--out", &out]].concat());
        let error = |row: usize, part: &str| {
            printed["lights"][0]["models"][row][part][0]["mean_cm"].as_f64().unwrap()
        };
        (printed["in_space"].as_bool().unwrap(), [error(0, "tip"), error(1, "tip"), error(1, "stem")])
    };
    let (in_space, of_space) = errors(&["space.json"]);
    let (in_plane, from_front) = errors(&["space.json", "stem.json"]);
    assert!(in_space && !in_plane);
    // The depth adds to each distance; the model in space foretells the plant better than standing still does.
    assert!((0..3).all(|at| of_space[at] > from_front[at]), "{of_space:?} {from_front:?}");
    assert!(of_space[1] < of_space[0], "{of_space:?}");
}
