//! Two poles of unlike length on one cart, balanced without knowing any velocity.
//!
//! `cargo run --release -p tropism-neat --example double_pole -- --seeds 100 [--velocities]`
//!
//! Without velocities the network has to remember, and is scored as by Gruau, Whitley and Pyeatt (1996): a tenth for the time
//! balanced, up to 1000 steps, and nine tenths for not jiggling in the last hundred. A run is solved when the best network of
//! a generation balances for 100 000 steps and from at least 200 of 625 other starts for 1000. Stanley and Miikkulainen (2002)
//! report 33 184 evaluations (and 286 of 625 starts). With velocities the score is the steps balanced, and 100 000 of
//! them the solution; they report 3 600 evaluations.
//!
//! What is not solved within 40 generations seldom is later, so a run then starts over, at most four times. Evaluations
//! and generations count from the first start.

mod common;

use common::{Outcome, arguments, report};
use tropism_neat::{Activation, Config, Genome, Neat, NeatError, Network};

/// Generations after which a run starts over, and how often it may start.
const PATIENCE: (u32, u64) = (40, 5);
/// Steps that a solution has to balance for.
const LONG: usize = 100_000;
/// Largest force on the cart (N).
const FORCE: f64 = 10.0;
/// Half the track (m).
const TRACK: f64 = 2.4;
/// Largest angle of a pole that has not fallen: 36 degrees.
const FALLEN: f64 = std::f64::consts::PI / 5.0;
/// Half length (m) and mass (kg) of the two poles.
const POLES: [(f64, f64); 2] = [(0.5, 0.1), (0.05, 0.01)];

/// Cart position (m), its velocity, then angle from the vertical (radians) and angular velocity of the long and the short pole.
type State = [f64; 6];

/// The time derivative of the state under a force, after Wieland (1991).
fn derivative(state: &State, force: f64) -> State {
    let (gravity, cart, track_friction, hinge_friction) = (-9.8, 1.0, 0.0005, 0.000_002);
    let (mut pull, mut mass) =
        (force - track_friction * if state[1] == 0.0 { 0.0 } else { state[1].signum() }, cart);
    let torque = |pole: usize| {
        let ((length, weight), angle, velocity) = (POLES[pole], state[2 + 2 * pole], state[3 + 2 * pole]);
        (hinge_friction * velocity / (weight * length) + gravity * libm::sin(angle), libm::cos(angle))
    };
    for (pole, (length, weight)) in POLES.into_iter().enumerate() {
        let (angle, velocity) = (state[2 + 2 * pole], state[3 + 2 * pole]);
        let (torque, cos) = torque(pole);
        pull += weight * length * velocity * velocity * libm::sin(angle) + 0.75 * weight * cos * torque;
        mass += weight * (1.0 - 0.75 * cos * cos);
    }
    let acceleration = pull / mass;
    let turn = |pole: usize| {
        let (torque, cos) = torque(pole);
        -0.75 * (acceleration * cos + torque) / POLES[pole].0
    };
    [state[1], acceleration, state[3], turn(0), state[5], turn(1)]
}

/// A hundredth of a second, by the classical Runge-Kutta method.
fn advance(state: &mut State, force: f64) {
    let h = 0.01;
    let at = |slope: &State, h: f64| std::array::from_fn(|i| state[i] + h * slope[i]);
    let k1 = derivative(state, force);
    let k2 = derivative(&at(&k1, h / 2.0), force);
    let k3 = derivative(&at(&k2, h / 2.0), force);
    let k4 = derivative(&at(&k3, h), force);
    for i in 0..6 {
        state[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    }
}

/// Steps (of 0.02 s) for which a network balances from a start, at most `limit`, and how much it jiggled in each.
fn balance(genome: &Genome, start: State, velocities: bool, limit: usize) -> Vec<f64> {
    let mut network = Network::new(genome);
    let (mut state, mut jiggle) = (start, Vec::new());
    while jiggle.len() < limit {
        let [x, dx, a, da, b, db] = state;
        let force = if velocities {
            network.activate(&[x / 4.8, dx / 2.0, a / 0.52, da / 2.0, b / 0.52, db / 2.0])[0]
        } else {
            network.activate(&[x / 4.8, a / 0.52, b / 0.52])[0]
        };
        for _ in 0..2 {
            advance(&mut state, force * FORCE);
        }
        if state[0].abs() > TRACK || state[2].abs() > FALLEN || state[4].abs() > FALLEN {
            break;
        }
        jiggle.push(state[..4].iter().map(|value| value.abs()).sum());
    }
    jiggle
}

/// The usual start: only the long pole leans, by 4.5 degrees.
fn start() -> State {
    [0.0, 0.0, 4.5_f64.to_radians(), 0.0, 0.0, 0.0]
}

fn score(genome: &Genome, velocities: bool) -> f64 {
    if velocities {
        return balance(genome, start(), true, LONG).len() as f64;
    }
    let jiggle = balance(genome, start(), false, 1000);
    let calm = match jiggle.len() {
        0..100 => 0.0,
        steps => 0.75 / jiggle[steps - 100..].iter().sum::<f64>(),
    };
    0.1 * jiggle.len() as f64 / 1000.0 + 0.9 * calm
}

/// From how many of 625 starts, spread over the first four of the state, the network balances for 1000 steps.
fn starts_mastered(genome: &Genome) -> usize {
    let spread = |range: f64| [0.05, 0.275, 0.5, 0.725, 0.95].map(|share| (2.0 * share - 1.0) * range);
    let (mut mastered, degrees) = (0, f64::to_radians);
    for x in spread(2.16) {
        for dx in spread(1.35) {
            for angle in spread(degrees(3.6)) {
                for turn in spread(degrees(8.6)) {
                    let steps = balance(genome, [x, dx, angle, turn, 0.0, 0.0], false, 1000).len();
                    mastered += usize::from(steps == 1000);
                }
            }
        }
    }
    mastered
}

fn run(config: &Config, seed: u64, velocities: bool) -> Result<Outcome, NeatError> {
    let (patience, starts) = PATIENCE;
    let mut outcome = Outcome { solved: false, evaluations: 0, generations: 0, hidden: 0, links: 0 };
    for start in 0..starts {
        let mut neat = Neat::new(config.clone(), if velocities { 6 } else { 3 }, 1, seed * starts + start)?;
        while !outcome.solved && neat.generation() < patience {
            let scores = neat.evaluate(|genome, _trial| score(genome, velocities));
            let first = (0..scores.len()).reduce(|a, b| if scores[b] > scores[a] { b } else { a });
            let best = neat.ask()[first.expect("a population has members")].clone();
            neat.tell(&scores)?;
            outcome.solved = is_solution(&best, velocities);
            outcome.hidden = best.neurons().len() - best.inputs() - 2;
            outcome.links = best.links().len();
        }
        outcome.evaluations += neat.evaluations();
        outcome.generations += neat.generation();
        if outcome.solved {
            break;
        }
    }
    Ok(outcome)
}

fn is_solution(genome: &Genome, velocities: bool) -> bool {
    balance(genome, start(), velocities, LONG).len() == LONG && (velocities || starts_mastered(genome) >= 200)
}

fn main() -> Result<(), NeatError> {
    let (seeds, flags) = arguments(2, &["--velocities"]);
    let velocities = !flags.is_empty();
    // Small networks with memory: loops are likely, and what is added can be removed. Tanh makes rest the middle.
    let config = Config {
        population: if velocities { 150 } else { 1000 },
        output_activation: Activation::Tanh,
        hidden_activation: Activation::Tanh,
        activation_a: 2.45,
        min_species: 20,
        max_species: 60,
        compat_threshold: 4.0,
        weight_diff_coeff: 3.0,
        species_max_stagnation: 8,
        survival_rate: 0.2,
        mutate_add_link_prob: 0.1,
        mutate_rem_link_prob: 0.1,
        mutate_rem_neuron_prob: 0.02,
        recurrent_prob: 0.6,
        recurrent_loop_prob: 0.6,
        mutate_weights_severe_prob: 0.5,
        weight_mutation_rate: 1.0,
        weight_mutation_max_power: 2.5,
        weight_replacement_max_power: 2.5,
        ..Config::paper()
    };
    let outcomes: Result<Vec<_>, _> = (0..seeds).map(|seed| run(&config, seed, velocities)).collect();
    report(&outcomes?);
    Ok(())
}
