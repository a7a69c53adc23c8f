//! The configuration of a run, and its file.

use tropism::evolve::Champion;
use tropism_lab::{ControllerSpec, Error, RunConfig};

fn read(text: &str) -> Result<RunConfig, Error> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("run.toml"), text).unwrap();
    RunConfig::read(folder.path())
}

fn network() -> ControllerSpec {
    let genome = tropism_neat::random_genome(&tropism_neat::Config::wahby2016(), 2, 1, 7, 0);
    ControllerSpec::network(Champion::of_genome(genome)).unwrap()
}

#[test]
fn a_configuration_comes_back_from_its_file() {
    for controller in [ControllerSpec::default(), ControllerSpec::Greedy, network()] {
        let task = controller.default_task();
        let config = RunConfig::new(RunConfig::default().rig, controller, task, 1);
        let text = config.to_toml().unwrap();
        let again = read(&text).unwrap();
        assert_eq!(again, config, "{text}");
        assert_eq!(again.to_toml().unwrap(), text);
    }
}

/// A configuration as `tropism.run/1` has it.
fn old(controller: &str) -> String {
    let text = RunConfig::default().to_toml().unwrap();
    let (_, rig) = text.split_once("\n[rig]\n").unwrap();
    format!(
        "schema = \"tropism.run/1\"\nversion = \"0.1.0\"\nis_virtual = true\nseed = 7\n{controller}\n\
         [task]\ntargets = []\nend_height_cm = inf\nmax_steps = 10\n[rig]\n{rig}"
    )
}

#[test]
fn a_file_of_schema_1_is_read() {
    let config = read(&old("controller = \"periodic, 72 steps\"")).unwrap();
    assert_eq!((&config.controller, config.seed), (&ControllerSpec::periodic(360.0), 7));
    assert_eq!(config.controller_description(), "periodic, every 6 h");
    assert_eq!(read(&old("controller = \"chase\"")).unwrap().controller, ControllerSpec::Greedy);
    let json = network().champion().unwrap().genome.to_json();
    let text = old(&format!("controller = \"network\"\nnetwork = '''{json}'''"));
    assert_eq!(read(&text).unwrap().controller, network());
    let error = read(&old("controller = \"magic\"")).unwrap_err().to_string();
    assert!(error.contains("run.toml: found controller \"magic\""), "{error}");
}

#[test]
fn a_file_of_schema_1_is_not_resumed() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("run.toml"), old("controller = \"chase\"")).unwrap();
    let config = RunConfig::read(folder.path()).unwrap();
    let error = config.open_folder(folder.path(), true).unwrap_err().to_string();
    assert!(error.contains("found a run of tropism.run/1, wanted tropism.run/2"), "{error}");
}

#[test]
fn an_unknown_schema_is_named() {
    let error = read("schema = \"tropism.run/9\"").unwrap_err().to_string();
    assert!(error.contains("found schema \"tropism.run/9\""), "{error}");
}
