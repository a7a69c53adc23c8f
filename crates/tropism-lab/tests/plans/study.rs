//! Studies and evolutions as files.

use tropism_lab::evolve::EvolveConfig;
use tropism_lab::study::StudyConfig;

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
