//! Models of plants and what is searched on them, through public items: fits, laws, files, resumed searches.

#[path = "models/baseline.rs"]
mod baseline;
#[path = "models/batch.rs"]
mod batch;
#[path = "models/champion.rs"]
mod champion;
#[path = "models/cma_es.rs"]
mod cma_es;
#[path = "models/nodes.rs"]
mod nodes;
#[path = "models/rule_search.rs"]
mod rule_search;
#[path = "models/saved.rs"]
mod saved;
#[path = "models/space.rs"]
mod space;
#[path = "models/stem.rs"]
mod stem;
#[path = "models/tip_file.rs"]
mod tip_file;
#[path = "models/tuned_rule.rs"]
mod tuned_rule;

use tropism::control::Periodic;
use tropism::environment::unwatched;
use tropism::geometry::Point;
use tropism::lamps::Light;
use tropism::plant::PlantModel;
use tropism::plant::tip::{TipModel, TipModelConfig};
use tropism::random::{NoiseStream, Purpose, StepNoise};
use tropism::task::Task;
use tropism::track::Track;
use tropism_bean::{Species, Trial};

/// A plant that leans towards the light, from 4 to 24 cm.
fn leaning() -> TipModel {
    let mut text = "tip_x_cm,tip_y_cm,light\n".to_owned();
    for step in 0..700_u32 {
        let phase = step % 80;
        let (x, light) = if phase < 40 { (phase, "right") } else { (80 - phase, "left") };
        text += &format!("{},{},{light}\n", f64::from(x) * 0.2 - 4.0, 4.0 + 0.03 * f64::from(step));
    }
    TipModel::fit([&Track::read_csv(text.as_bytes()).unwrap()], TipModelConfig::default()).unwrap()
}

/// A virtual bean under lamps that are switched every three hours.
fn grown(seed: u64, steps: u32, period_min: f64) -> Track {
    let species = Species::default();
    let trial = Trial { period_min, ..Trial::new(&species) };
    let mut controller = Periodic::new((180.0 / period_min) as u32, &trial.layout);
    trial.grow(seed, &mut controller, &Task::open_loop(steps), &mut unwatched)
}

fn step_noise(step: u32) -> StepNoise {
    NoiseStream::new(1, Purpose::Trial, [0; 3]).at(step)
}

/// A plant of `model`, and one of the model of the mirrored plants under mirrored light, move as mirror images; the plant grows
/// higher than `higher_than_cm`.
#[track_caller]
fn assert_mirror<M: PlantModel>(model: &M, mirror: &M, higher_than_cm: f64) {
    let mut plant = model.seedling(Point::new(0.2, 4.0), &mut step_noise(u32::MAX));
    let mut image = mirror.seedling(Point::new(-0.2, 4.0), &mut step_noise(u32::MAX));
    for step in 0..200 {
        let light = if step % 17 < 9 { Light::LEFT } else { Light::RIGHT };
        model.step(&mut plant, light, &mut step_noise(step));
        mirror.step(&mut image, model.layout().mirrored(light).unwrap(), &mut step_noise(step));
        assert_eq!(model.observe(&plant).tip, mirror.observe(&image).tip.mirrored(), "step {step}");
    }
    let tip = model.observe(&plant).tip;
    assert!(tip.y > higher_than_cm, "{tip:?}");
}
