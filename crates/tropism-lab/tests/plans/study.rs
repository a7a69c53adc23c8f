//! Studies and evolutions as files.

use std::path::Path;

use tropism_lab::evolve::EvolveConfig;
use tropism_lab::replicates::ReplicatesConfig;
use tropism_lab::study::StudyConfig;
use tropism_lab::wall::WallStudyConfig;

#[test]
fn the_paper_written_out_is_the_default() {
    let written: StudyConfig = toml::from_str(include_str!("../../../../studies/paper.toml")).unwrap();
    assert_eq!(written, StudyConfig::default());
    written.check().unwrap();
}

#[test]
fn the_evolution_of_the_paper_written_out_is_the_default() {
    let written: EvolveConfig = toml::from_str(include_str!("../../../../studies/evolution.toml")).unwrap();
    assert_eq!(written, EvolveConfig::default());
}

#[test]
fn the_studies_that_come_with_the_program_are_right() {
    let mut checked = 0;
    for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../studies")).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let is = |kind: &str| text.starts_with(&format!("#:schema ../schemas/{kind}.json"));
        let done = if is("replicates") {
            ReplicatesConfig::read(&path).unwrap().check()
        } else if is("walls") {
            WallStudyConfig::read(&path).unwrap().check()
        } else if is("study") {
            toml::from_str::<StudyConfig>(&text).unwrap().check()
        } else {
            continue;
        };
        done.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        checked += 1;
    }
    assert!(checked >= 10, "{checked}");
}

#[test]
fn the_quick_study_is_a_small_paper() {
    let (quick, paper) = (StudyConfig::quick(), StudyConfig::default());
    quick.check().unwrap();
    assert_eq!((&quick.task, &quick.model), (&paper.task, &paper.model));
}

#[test]
fn a_resolved_study_reads_back() {
    let text = toml::to_string(&StudyConfig::default()).unwrap();
    assert_eq!(toml::from_str::<StudyConfig>(&text).unwrap(), StudyConfig::default());
}

#[test]
fn a_study_of_walls_evolves_with_each_seed_once() {
    let study = |evolve| WallStudyConfig { evolve, ..WallStudyConfig::default() };
    study(vec![7, 8]).check().unwrap();
    let error = study(vec![7, 8, 7]).check().unwrap_err().to_string();
    assert!(error.contains("evolve") && error.contains("\"7\" stands twice"), "{error}");
}
