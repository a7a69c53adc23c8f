//! Evolution of nodes on a model of beans that grew before their wall.

use std::ops::ControlFlow;

use tropism::nodes::{DetectorSettings, NodeEvolution, NodeEvolutionConfig, NodeWall, Proximity};
use tropism::plant::PlantModel;
use tropism::plant::stem::SpaceModel;
use tropism_bean::Species;
use tropism_bean::wall::WallTrial;

fn trial() -> WallTrial {
    WallTrial { wall: NodeWall::levels(&[6.0, 8.0]), ..WallTrial::new(Species::default()) }
}

fn model() -> SpaceModel {
    let tracks = [1, 2, 3].map(|seed| trial().open_loop(seed, 250, 3.0));
    SpaceModel::fit(&tracks).unwrap()
}

#[test]
fn evolution_is_that_of_its_seed() {
    let (wall, model) = (trial().wall, model());
    assert_eq!(*model.layout(), wall.layout().unwrap());
    let mut config =
        NodeEvolutionConfig { runs: 2, generations: 3, plants: 2, test_plants: 4, ..Default::default() };
    config.neat.population = 12;
    let evolution = NodeEvolution {
        wall: &wall,
        sensor: &Proximity::default(),
        detector: DetectorSettings::default(),
        model: &model,
        config: &config,
    };
    let run = || evolution.evolve(3, &|_| ControlFlow::Continue(())).unwrap().unwrap();
    let found = run();
    assert_eq!(found, run());
    assert!(found.evaluations >= 48 && found.run < 2 && found.generation < 3);
    let most = 2.0 + config.aim_weight;
    assert!(found.test.fitness <= most && (-4.0..=1.0).contains(&found.test.aim), "{:?}", found.test);
    assert!(evolution.evolve(3, &|_| ControlFlow::Break(())).unwrap().is_none());
}
