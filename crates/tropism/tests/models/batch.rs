//! Episodes side by side have the fitness of the plain path.

use super::grown;
use tropism::control::{Avoidance, NetworkController, PredictiveGreedy, PredictiveRule, Sensors};
use tropism::geometry::Point;
use tropism::obstacle::Obstacle;
use tropism::plant::PlantModel;
use tropism::plant::stem::PlaneModel;
use tropism::plant::tip::{TipModel, TipModelConfig};
use tropism::random::{self, NoiseStream, Purpose};
use tropism::simulation::{BatchModel, Episode, cautious_fitness_of, fitness_of};
use tropism::task::{Reading, Task};
use tropism::track::Track;
use tropism_neat::{Config, Genome, Neat};

fn tip_model() -> TipModel {
    let mut rng = random::stream(5, Purpose::Growth, 0);
    let mut text = "tip_x_cm,tip_y_cm,light\n".to_owned();
    let (mut x, mut y) = (0.0_f64, 4.0);
    for step in 0..3000 {
        let right = step / 70 % 2 == 0;
        text += &format!("{x:.4},{y:.4},{}\n", if right { "right" } else { "left" });
        x += (if right { 0.12 } else { -0.12 }) - 0.01 * x + 0.05 * random::normal(&mut rng);
        y = 4.0 + f64::from(step % 1000) * 0.012 - 0.02 * x.abs();
    }
    TipModel::fit([&Track::read_csv(text.as_bytes()).unwrap()], TipModelConfig::default()).unwrap()
}

/// Genomes from minimal networks to networks of over a hundred links.
fn genomes(count: usize) -> Vec<Genome> {
    let mut genomes = Vec::new();
    for seed in 0.. {
        let config = Config { mutate_add_neuron_prob: 0.2, mutate_add_link_prob: 0.4, ..Config::wahby2016() };
        let mut neat = Neat::new(config, 2, 1, seed).unwrap();
        for _ in 0..150 {
            genomes.extend_from_slice(neat.ask());
            let scores: Vec<f64> = neat.ask().iter().map(|genome| genome.links().len() as f64).collect();
            neat.tell(&scores).unwrap();
            if genomes.len() >= count {
                genomes.truncate(count);
                return genomes;
            }
        }
    }
    unreachable!()
}

#[test]
fn ten_thousand_genomes_of_all_sizes_have_the_fitness_of_the_plain_path_to_the_bit() {
    let (model, genomes) = (tip_model(), genomes(10_000));
    assert!(genomes.iter().map(|genome| genome.links().len()).max().unwrap() > 80);
    let noise = |episode: usize| NoiseStream::new(9, Purpose::Trial, [episode as u32, 0, 0]);
    for (task, part) in [
        (Task::default(), &genomes[..]),
        (Task { max_steps: 37, ..Task::default() }, &genomes[..300]),
        (Task { end_height_cm: 60.0, max_steps: 123, ..Task::default() }, &genomes[5000..5300]),
        (Task { targets: Vec::new(), ..Task::default() }, &genomes[9000..9100]),
        (many_targets(7), &genomes[8000..8100]),
        (many_targets(50), &genomes[8100..8140]),
        (Task { score: Reading::Approach, ..Task::default() }, &genomes[..1000]),
        (Task { score: Reading::Approach, targets: Vec::new(), ..Task::default() }, &genomes[9000..9010]),
        (Task { score: Reading::Approach, ..many_targets(7) }, &genomes[8000..8100]),
        (Task { score: Reading::Arrival, ..Task::default() }, &genomes[..1000]),
        (Task { score: Reading::Arrival, ..many_targets(7) }, &genomes[8000..8100]),
    ] {
        let episode = |(number, genome)| Episode { controller: genome, noise: noise(number) };
        let fast = model.score(&task, (&Sensors::default()).into(), part.iter().enumerate().map(episode));
        for (number, genome) in part.iter().enumerate() {
            let mut plain = NetworkController::of_tip(genome).unwrap();
            let exact = fitness_of(&model, &mut plain, &task, noise(number));
            assert_eq!(fast[number].to_bits(), exact.to_bits(), "genome {number}: {} {exact}", fast[number]);
        }
    }
}

fn many_targets(count: u32) -> Task {
    let place = |number: u32| {
        Point::new(if number.is_multiple_of(2) { 0.7 } else { -0.3 }, 4.1 + 0.18 * f64::from(number))
    };
    Task { targets: (0..count).map(place).collect(), ..Task::default() }
}

#[test]
fn no_episodes_are_no_work() {
    assert!(tip_model().score(&Task::default(), (&Sensors::default()).into(), std::iter::empty()).is_empty());
}

fn stem_model() -> PlaneModel {
    PlaneModel::fit(&[grown(1, 250, 5.0)]).unwrap()
}

fn rule(number: u64, avoids: bool) -> PredictiveRule {
    let mut rng = random::stream(number, Purpose::Search, 0);
    let mut draw = |size: f64| size * random::normal(&mut rng);
    let avoidance = Avoidance {
        way_x_cm: draw(1.0),
        way_y_cm: draw(1.0),
        clearance_cm: 1.0 + draw(0.5),
        push: draw(2.0).abs(),
        clearance_steps: draw(5.0),
        bend: draw(1.0),
    };
    PredictiveRule {
        look_ahead_cm: 0.2 + draw(1.0).abs(),
        overshoot: draw(0.3),
        next_target: draw(0.3),
        offset_cm: draw(0.5),
        velocity_steps: draw(10.0),
        shift_steps: draw(3.0),
        light_memory_cm: draw(1.0),
        lean: draw(0.1),
        persistence_cm: draw(0.2),
        avoidance: avoids.then_some(avoidance),
    }
}

fn assert_twins(model: &PlaneModel, task: &Task, avoids: bool) {
    let episode = |number: u32| Episode {
        controller: rule(number.into(), avoids),
        noise: NoiseStream::new(2, Purpose::Trial, [number, 0, 0]),
    };
    let fast = model.score_rules(task, 0.1, (0..21).map(episode));
    for (number, fast) in (0..).zip(fast) {
        let Episode { controller, noise } = episode(number);
        let mut plain = PredictiveGreedy::new(controller, task, model.layout());
        let exact = cautious_fitness_of(model, &mut plain, task, noise, 0.1);
        assert_eq!(fast.to_bits(), exact.to_bits(), "rule {number}: {fast} {exact}");
    }
}

#[test]
fn rules_have_the_fitness_of_the_plain_path_to_the_bit() {
    let model = stem_model();
    let targets = Task { targets: vec![Point::new(2.0, 5.0), Point::new(-2.0, 7.0)], ..Task::default() };
    assert_twins(&model, &Task { end_height_cm: 7.5, max_steps: 160, ..targets.clone() }, false);
    // Without a target above it no step counts; at once over; a rule that avoids what is not there.
    assert_twins(&model, &Task { max_steps: 1, ..targets.clone() }, false);
    assert_twins(&model, &Task { targets: Vec::new(), end_height_cm: 3.0, ..targets.clone() }, false);
    assert_twins(&model, &Task { max_steps: 20, ..targets.clone() }, true);
    for score in [Reading::Approach, Reading::Arrival] {
        assert_twins(&model, &Task { score, max_steps: 160, ..targets.clone() }, false);
    }
    // Stems that are longer than all data.
    assert_twins(&model, &Task { end_height_cm: 30.0, max_steps: 420, ..targets }, false);
    let disc = |x: f64, y: f64| Obstacle::Disc { centre: Point::new(x, y), radius_cm: 0.8 };
    let line = |x: f64, y: f64| Obstacle::Line { ends: [Point::new(x, y), Point::new(x + 3.0, y + 0.5)] };
    for obstacles in [
        vec![disc(0.0, 6.0)],
        vec![disc(-1.5, 5.5), disc(1.0, 6.0)],
        vec![line(0.2, 5.5), disc(-2.0, 6.0)],
        vec![],
    ] {
        let way_points = vec![Point::new(-1.5, 6.5)];
        let targets = vec![Point::new(-1.0, 5.0), Point::new(0.0, 7.0)];
        let task =
            Task { targets, obstacles, way_points, end_height_cm: 7.2, max_steps: 180, ..Task::obstacles() };
        assert_twins(&model, &task, true);
    }
}
