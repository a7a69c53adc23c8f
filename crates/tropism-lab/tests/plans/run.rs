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

#[test]
fn an_unknown_schema_is_named() {
    let error = read("schema = \"tropism.run/9\"").unwrap_err().to_string();
    assert!(error.contains("found schema \"tropism.run/9\""), "{error}");
}
