//! A deceptive maze: objective search gets stuck near the goal, novelty search reaches it.
//!
//! `cargo run --release -p tropism-neat --example maze -- --seeds 40`
//!
//! A robot with six range finders and a four-quadrant goal sensor starts at S and has 400 steps to reach G. A score for the
//! final distance to G leads into the dead end between the two, because the path to G first leads away from it. The
//! experiment is that of Lehman and Stanley (2011), in another maze. Both searches have the same parameters. A run ends when
//! a robot reaches G, or after 150 generations.

mod common;

use std::error::Error;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use common::{RunResult, arguments, report};
use tropism_neat::{Activation, Config, Genome, Neat, Network, Novelty, NoveltyConfig};

const MAZE: [&str; 12] = [
    "####################",
    "#G       #         #",
    "#        #         #",
    "#######  #   ###   #",
    "#     #  #     #   #",
    "#     #  ####  #   #",
    "#     #     #  #   #",
    "#     ####  #  #   #",
    "#        #     #   #",
    "#  ####  #######   #",
    "#S #               #",
    "####################",
];
/// Steps of an evaluation.
const STEPS: usize = 400;
const MAX_GENERATIONS: u32 = 150;
/// Largest length of a step (squares).
const MAX_STEP: f64 = 0.2;
/// Largest turn in a step (radians).
const MAX_TURN: f64 = 0.3;
/// Range of the range finders (squares).
const SENSOR_RANGE: f64 = 4.0;

/// A position, or a direction as cosine and sine.
type Vector = [f64; 2];

/// Centre of the square with this letter.
fn square(letter: char) -> Vector {
    let row = MAZE.iter().position(|row| row.contains(letter)).expect("the maze has all letters");
    let column = MAZE[row].find(letter).expect("the row contains the letter");
    [column as f64 + 0.5, row as f64 + 0.5]
}

fn is_wall([x, y]: Vector) -> bool {
    MAZE[y as usize].as_bytes()[x as usize] == b'#'
}

/// The position at a distance in a direction.
fn displaced([x, y]: Vector, [cos, sin]: Vector, distance: f64) -> Vector {
    [x + distance * cos, y + distance * sin]
}

fn direction(angle: f64) -> Vector {
    [libm::cos(angle), libm::sin(angle)]
}

fn distance(a: Vector, b: Vector) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

/// Sensor readings: free distance in six directions, and a 1 for the quadrant of the goal.
fn sense(position: Vector, heading: f64, goal: Vector) -> [f64; 10] {
    let mut readings = [0.0; 10];
    let angles = [-FRAC_PI_2, -FRAC_PI_4, 0.0, FRAC_PI_4, FRAC_PI_2, PI];
    for (reading, angle) in readings.iter_mut().zip(angles) {
        let (direction, mut distance) = (direction(heading + angle), 0.0);
        while distance < SENSOR_RANGE && !is_wall(displaced(position, direction, distance)) {
            distance += 0.1;
        }
        *reading = distance / SENSOR_RANGE;
    }
    let bearing = libm::atan2(goal[1] - position[1], goal[0] - position[0]) - heading + FRAC_PI_4;
    let quadrant = ((bearing / FRAC_PI_2).floor() as i64).rem_euclid(4);
    readings[6 + quadrant as usize] = 1.0;
    readings
}

/// Final position of the robot that a network steers: its behaviour.
fn final_position(genome: &Genome) -> Vector {
    let mut network = Network::new(genome);
    let (mut position, goal, mut heading) = (square('S'), square('G'), -FRAC_PI_2);
    for _ in 0..STEPS {
        let output = network.activate(&sense(position, heading, goal));
        heading += MAX_TURN * (2.0 * output[0] - 1.0);
        let next = displaced(position, direction(heading), MAX_STEP * output[1]);
        if !is_wall(next) {
            position = next;
        }
        if is_at_goal(position) {
            break;
        }
    }
    position
}

fn is_at_goal(position: Vector) -> bool {
    distance(position, square('G')) < 0.7
}

fn run(seed: u64, is_novelty_search: bool) -> Result<RunResult, Box<dyn Error>> {
    let config = Config {
        population: 100,
        output_activation: Activation::UnsignedSigmoid,
        hidden_activation: Activation::UnsignedSigmoid,
        activation_a: 4.9,
        weight_mutation_max_power: 2.5,
        mutate_add_link_prob: 0.1,
        ..Config::wahby2016()
    };
    let mut neat = Neat::new(config, 10, 2, seed)?;
    let mut novelty = Novelty::new(NoveltyConfig::default())?;
    let (mut is_solved, mut hidden, mut links) = (false, 0, 0);
    while !is_solved && neat.generation() < MAX_GENERATIONS {
        let positions = neat.evaluate(|genome, _| final_position(genome));
        if let Some(first) = positions.iter().position(|&position| is_at_goal(position)) {
            let genome = &neat.ask()[first];
            (is_solved, hidden, links) = (true, genome.neurons().len() - 13, genome.links().len());
        }
        let scores = if is_novelty_search {
            novelty.scores(&positions.iter().map(|position| position.to_vec()).collect::<Vec<_>>())?
        } else {
            positions.iter().map(|&position| 20.0 - distance(position, square('G'))).collect()
        };
        neat.tell(&scores)?;
    }
    Ok(RunResult {
        is_solved,
        evaluations: neat.evaluations(),
        generations: neat.generation(),
        hidden,
        links,
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let seeds = arguments(1, &[]).seeds;
    for (name, is_novelty_search) in [("objective search", false), ("novelty search", true)] {
        println!("{name}");
        let results: Result<Vec<_>, _> = (0..seeds).map(|seed| run(seed, is_novelty_search)).collect();
        report(&results?);
    }
    Ok(())
}
