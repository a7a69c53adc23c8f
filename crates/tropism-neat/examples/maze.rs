//! A maze that misleads: searching for the goal gets stuck near it, searching for the new gets there.
//!
//! `cargo run --release -p tropism-neat --example maze -- --seeds 40`
//!
//! A robot with six range finders and a sense of the goal's direction starts at S and has 400 steps to reach G. Whoever is
//! scored by how close it ends to G is drawn into the dead end between the two; the way there leads away from G, to the far
//! end of the maze and back. After Lehman and Stanley (2011), in a maze of our own. Both searches have the same parameters, and a
//! run is over when a robot reaches G, or after 150 generations.

mod common;

use std::error::Error;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use common::{Outcome, arguments, report};
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
const STEPS: usize = 400;
const GENERATIONS: u32 = 150;
/// Largest way (squares) and turn (radians) of a step.
const REACH: f64 = 0.2;
const TURN: f64 = 0.3;
/// How far the range finders see (squares).
const SIGHT: f64 = 4.0;

type Place = [f64; 2];

/// The middle of the square that bears a letter.
fn square(letter: char) -> Place {
    let row = MAZE.iter().position(|row| row.contains(letter)).expect("the maze has all letters");
    let column = MAZE[row].find(letter).expect("as found above");
    [column as f64 + 0.5, row as f64 + 0.5]
}

fn is_wall([x, y]: Place) -> bool {
    MAZE[y as usize].as_bytes()[x as usize] == b'#'
}

/// Some way from a place in a direction, given by its cosine and sine.
fn ahead([x, y]: Place, [cos, sin]: Place, way: f64) -> Place {
    [x + way * cos, y + way * sin]
}

fn direction(angle: f64) -> Place {
    [libm::cos(angle), libm::sin(angle)]
}

fn distance(a: Place, b: Place) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

/// What the robot senses: how free the way is in six directions, and in which quarter the goal lies.
fn senses(place: Place, heading: f64, goal: Place) -> [f64; 10] {
    let mut senses = [0.0; 10];
    let angles = [-FRAC_PI_2, -FRAC_PI_4, 0.0, FRAC_PI_4, FRAC_PI_2, PI];
    for (sense, angle) in senses.iter_mut().zip(angles) {
        let (direction, mut way) = (direction(heading + angle), 0.0);
        while way < SIGHT && !is_wall(ahead(place, direction, way)) {
            way += 0.1;
        }
        *sense = way / SIGHT;
    }
    let bearing = libm::atan2(goal[1] - place[1], goal[0] - place[0]) - heading + FRAC_PI_4;
    let quarter = ((bearing / FRAC_PI_2).floor() as i64).rem_euclid(4);
    senses[6 + quarter as usize] = 1.0;
    senses
}

/// Where the robot ends up: its behaviour.
fn explore(genome: &Genome) -> Place {
    let mut network = Network::new(genome);
    let (mut place, goal, mut heading) = (square('S'), square('G'), -FRAC_PI_2);
    for _ in 0..STEPS {
        let answer = network.activate(&senses(place, heading, goal));
        heading += TURN * (2.0 * answer[0] - 1.0);
        let next = ahead(place, direction(heading), REACH * answer[1]);
        if !is_wall(next) {
            place = next;
        }
        if is_there(place) {
            break;
        }
    }
    place
}

fn is_there(place: Place) -> bool {
    distance(place, square('G')) < 0.7
}

fn run(seed: u64, seeks_the_new: bool) -> Result<Outcome, Box<dyn Error>> {
    let config = Config {
        population: 100,
        output_activation: Activation::UnsignedSigmoid,
        hidden_activation: Activation::UnsignedSigmoid,
        activation_a: 4.9,
        weight_mutation_max_power: 2.5,
        mutate_add_link_prob: 0.1,
        ..Config::paper()
    };
    let mut neat = Neat::new(config, 10, 2, seed)?;
    let mut novelty = Novelty::new(NoveltyConfig::default())?;
    let (mut solved, mut hidden, mut links) = (false, 0, 0);
    while !solved && neat.generation() < GENERATIONS {
        let places = neat.evaluate(|genome, _trial| explore(genome));
        if let Some(first) = places.iter().position(|&place| is_there(place)) {
            let genome = &neat.ask()[first];
            (solved, hidden, links) = (true, genome.neurons().len() - 13, genome.links().len());
        }
        let scores = if seeks_the_new {
            novelty.scores(&places.iter().map(|place| place.to_vec()).collect::<Vec<_>>())?
        } else {
            places.iter().map(|&place| 20.0 - distance(place, square('G'))).collect()
        };
        neat.tell(&scores)?;
    }
    Ok(Outcome { solved, evaluations: neat.evaluations(), generations: neat.generation(), hidden, links })
}

fn main() -> Result<(), Box<dyn Error>> {
    let (seeds, _) = arguments(1, &[]);
    for (name, seeks_the_new) in [("in search of the goal", false), ("in search of the new", true)] {
        println!("{name}");
        let outcomes: Result<Vec<_>, _> = (0..seeds).map(|seed| run(seed, seeks_the_new)).collect();
        report(&outcomes?);
    }
    Ok(())
}
