//! SHA-256 digests of everything that a seed decides: a model, an evolution, beans and a photograph. They are the same on
//! every processor and system; `scripts/same-digests` compares them.
//!
//! `cargo run -p tropism-bean --example digest`

use std::error::Error;
use std::ops::ControlFlow;

use sha2::{Digest, Sha256};
use tropism::plant::stem::PlaneModel;
use tropism::prelude::*;
use tropism_bean::render::Renderer;
use tropism_bean::scene::Scene;
use tropism_bean::{Species, Trial};

/// Steps of the beans. Chosen: some ten hours, and a second in a debug build.
const STEPS: u32 = 120;

/// Plants that grow side by side: more than one vector of any processor holds.
const PLANTS: u64 = 9;

fn print(what: &str, bytes: &[u8]) {
    let digest: String = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    println!("{digest}  {what}");
}

/// Every bit of a track: files round.
fn bits(track: &Track) -> Vec<u8> {
    let numbers = track.samples.iter().flat_map(|sample| {
        let stem = sample.stem.iter().flat_map(|stem| &stem.0).flat_map(|at| [at.x, at.y]);
        let light = sample.light.map_or(-1.0, |light| light.index() as f64);
        [sample.tip.x, sample.tip.y, light].into_iter().chain(stem)
    });
    numbers.flat_map(f64::to_le_bytes).collect()
}

fn main() -> Result<(), Box<dyn Error>> {
    let species = Species::default();
    let trial = Trial::new(&species);
    let open_loop = Task::open_loop(STEPS);
    let periodic = || Periodic::new(20, &trial.layout);

    let one = trial.grow(1, &mut periodic(), &open_loop, &mut unwatched);
    print("bean", &bits(&one));
    let seeds: Vec<u64> = (1..=PLANTS).collect();
    let tracks = trial.grow_all(&seeds, |_| periodic(), &open_loop, &mut |_, _| ControlFlow::Continue(()));
    assert_eq!(tracks[0], one, "a bean among others is the bean alone");
    print("beans side by side", &tracks.iter().flat_map(bits).collect::<Vec<u8>>());

    let task = Task { max_steps: STEPS, ..Task::default() };
    let greedy = || Greedy::new(&task, &trial.layout);
    let model = TipModel::fit(&tracks, TipModelConfig::default())?;
    print("predictions of the tip model", &bits(&simulate(&model, &mut greedy(), &task, 7)));
    let stem = PlaneModel::fit(&tracks)?;
    print("predictions of the stem model", &bits(&simulate(&stem, &mut greedy(), &task, 7)));

    let config = EvolutionConfig { runs: 1, generations: 8, ..EvolutionConfig::default() };
    let evolution = Evolution::new(&model, &task, config, 1)?;
    let runs = evolution.evolve(&|_, _| ControlFlow::Continue(()))?.expect("never broken off");
    let (genome, fitness) = runs[0].champion().expect("a run of eight generations");
    print("champion of an evolution", format!("{} {}", genome.to_json(), fitness.to_bits()).as_bytes());

    let mut specimen = trial.specimen(1);
    for _ in 0..STEPS {
        let Ok(()) = specimen.step(Light::LEFT);
    }
    let scene = Scene { width: 324, height: 243, ..Scene::default() };
    let photograph = Renderer::new(&scene, 1).draw(&specimen.bean().pose(), Some(Light::LEFT), false, 0);
    print("pixels of a photograph", &photograph.rgb);
    Ok(())
}
