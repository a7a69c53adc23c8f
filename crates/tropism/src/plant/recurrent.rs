//! A small LSTM that is its own mirror image: its state and its inputs change sign in a mirror, its gates do not.
//!
//! In: numbers that change sign in a mirror (light, lean) and numbers that do not (length, products of two such). Out: three
//! changes that do and one that does not. The cell's candidates see the former without an offset, the gates the latter and
//! the squares of the state. So no data need to be mirrored, and no mirror image is predicted worse.
//!
//! # References
//! Hochreiter and Schmidhuber 1997, doi:10.1162/neco.1997.9.8.1735; Gers et al. 2000, doi:10.1162/089976600300015015 (the
//! forget gate, whose offset begins at 1).

use crate::math;
use crate::random::NoiseStream;

/// Units of the hidden state. Chosen: see `docs/beyond.md`.
pub(super) const UNITS: usize = 24;
/// Inputs that change sign in a mirror.
pub(super) const ODD: usize = 8;
/// Inputs that do not; the first is 1.
pub(super) const EVEN: usize = 9;
/// Outputs that change sign in a mirror.
pub(super) const CHANGES: usize = 3;

type Units = [f64; UNITS];

/// Rows of weights, a weight of each unit: candidates from odd inputs and state; input, forget and output gate from even
/// inputs and squared state; the changes from the state; the growth from the squared state.
const CANDIDATE: usize = 0;
const GATES: usize = CANDIDATE + ODD + UNITS;
const GATE_ROWS: usize = EVEN + UNITS;
const OUT: usize = GATES + 3 * GATE_ROWS;
const ROWS: usize = OUT + CHANGES + 1;
/// After the rows: direct weights of the odd inputs in each change, and of the even inputs in the growth.
const DIRECT: usize = ROWS * UNITS;
/// Number of weights.
pub(super) const WEIGHTS: usize = DIRECT + CHANGES * ODD + EVEN;

/// What the network remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Memory {
    hidden: Units,
    cell: Units,
}

impl Memory {
    pub(super) const EMPTY: Self = Self { hidden: [0.0; UNITS], cell: [0.0; UNITS] };
}

/// What a step made of its inputs, as the way back needs it.
#[derive(Clone, Debug)]
pub(super) struct Forward {
    odd: [f64; ODD],
    even: [f64; EVEN],
    before: Memory,
    candidate: Units,
    /// Input, forget and output gate.
    gates: [Units; 3],
    squashed: Units,
    pub(super) after: Memory,
    pub(super) changes: [f64; CHANGES],
    pub(super) growth: f64,
}

/// The derivatives of a loss by what went into a step.
pub(super) struct Backward {
    pub(super) odd: [f64; ODD],
    pub(super) even: [f64; EVEN],
    pub(super) memory: Memory,
}

/// `tanh` by the logistic function, which is faster. By the size alone, so that it is odd to the bit.
fn squash(x: f64) -> f64 {
    (2.0 * math::logistic(2.0 * x.abs()) - 1.0).copysign(x)
}

/// `sums += factor * row`.
fn add_row(sums: &mut Units, factor: f64, row: &[f64]) {
    for (sum, weight) in sums.iter_mut().zip(row) {
        *sum += factor * weight;
    }
}

/// The product of a row of weights and a value of each unit; four sums side by side, in one order on every machine.
fn product(row: &[f64], values: &Units) -> f64 {
    let mut sums = [0.0; 4];
    for (weights, values) in row.chunks_exact(4).zip(values.chunks_exact(4)) {
        for (sum, (weight, value)) in sums.iter_mut().zip(weights.iter().zip(values)) {
            *sum += weight * value;
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

fn squares(values: &Units) -> Units {
    values.map(|value| value * value)
}

/// First weights: small random ones, none from inputs to outputs.
pub(super) fn first_weights(noise: &NoiseStream) -> Vec<f64> {
    let mut weights: Vec<f64> = (0..WEIGHTS)
        .map(|place| {
            let size = if place < DIRECT { 1.0 / ((ODD + UNITS) as f64).sqrt() } else { 0.0 };
            size * noise.at(place as u32).normal()
        })
        .collect();
    let forget = (GATES + GATE_ROWS) * UNITS;
    weights[forget..forget + UNITS].fill(1.0);
    weights[OUT * UNITS..DIRECT].iter_mut().for_each(|weight| *weight *= 0.1);
    weights
}

fn row(weights: &[f64], number: usize) -> &[f64] {
    &weights[number * UNITS..(number + 1) * UNITS]
}

fn row_mut(weights: &mut [f64], number: usize) -> &mut [f64] {
    &mut weights[number * UNITS..(number + 1) * UNITS]
}

/// One step of the network.
pub(super) fn forward(weights: &[f64], before: &Memory, odd: [f64; ODD], even: [f64; EVEN]) -> Forward {
    let mut candidate = [0.0; UNITS];
    for (number, value) in odd.iter().chain(&before.hidden).enumerate() {
        add_row(&mut candidate, *value, row(weights, CANDIDATE + number));
    }
    let squared = squares(&before.hidden);
    let gates: [Units; 3] = core::array::from_fn(|gate| {
        let mut sums = [0.0; UNITS];
        for (number, value) in even.iter().chain(&squared).enumerate() {
            add_row(&mut sums, *value, row(weights, GATES + gate * GATE_ROWS + number));
        }
        sums.map(math::logistic)
    });
    let candidate = candidate.map(squash);
    let [input, forget, output] = &gates;
    let cell: Units =
        core::array::from_fn(|unit| forget[unit] * before.cell[unit] + input[unit] * candidate[unit]);
    let squashed = cell.map(squash);
    let hidden: Units = core::array::from_fn(|unit| output[unit] * squashed[unit]);
    let direct = |from: usize, inputs: &[f64]| -> f64 {
        weights[from..].iter().zip(inputs).map(|(weight, input)| weight * input).sum()
    };
    let changes = core::array::from_fn(|change| {
        product(row(weights, OUT + change), &hidden) + direct(DIRECT + change * ODD, &odd)
    });
    let growth =
        product(row(weights, OUT + CHANGES), &squares(&hidden)) + direct(DIRECT + CHANGES * ODD, &even);
    Forward {
        odd,
        even,
        before: *before,
        candidate,
        gates,
        squashed,
        after: Memory { hidden, cell },
        changes,
        growth,
    }
}

/// One step back: adds the derivatives by the weights to `gradient`. `changes`, `growth` and `after` are the derivatives by
/// what the step gave.
pub(super) fn backward(
    weights: &[f64],
    step: &Forward,
    changes: [f64; CHANGES],
    growth: f64,
    after: &Memory,
    gradient: &mut [f64],
) -> Backward {
    let Forward { odd, even, before, candidate, gates, squashed, after: Memory { hidden, .. }, .. } = step;
    let mut by_hidden = after.hidden;
    let mut by_odd = [0.0; ODD];
    let mut by_even = [0.0; EVEN];
    for (change, by_change) in changes.into_iter().enumerate() {
        add_row(&mut by_hidden, by_change, row(weights, OUT + change));
        row_mut(gradient, OUT + change)
            .iter_mut()
            .zip(hidden)
            .for_each(|(sum, value)| *sum += by_change * value);
        let from = DIRECT + change * ODD;
        for input in 0..ODD {
            by_odd[input] += by_change * weights[from + input];
            gradient[from + input] += by_change * odd[input];
        }
    }
    let of_growth = row(weights, OUT + CHANGES);
    for unit in 0..UNITS {
        by_hidden[unit] += 2.0 * growth * of_growth[unit] * hidden[unit];
        gradient[(OUT + CHANGES) * UNITS + unit] += growth * hidden[unit] * hidden[unit];
    }
    for input in 0..EVEN {
        by_even[input] += growth * weights[DIRECT + CHANGES * ODD + input];
        gradient[DIRECT + CHANGES * ODD + input] += growth * even[input];
    }

    let [input, forget, output] = gates;
    let by_cell: Units = core::array::from_fn(|unit| {
        after.cell[unit] + by_hidden[unit] * output[unit] * (1.0 - squashed[unit] * squashed[unit])
    });
    let by_gate: [Units; 3] = [
        core::array::from_fn(|unit| by_cell[unit] * candidate[unit] * input[unit] * (1.0 - input[unit])),
        core::array::from_fn(|unit| by_cell[unit] * before.cell[unit] * forget[unit] * (1.0 - forget[unit])),
        core::array::from_fn(|unit| by_hidden[unit] * squashed[unit] * output[unit] * (1.0 - output[unit])),
    ];
    let by_candidate: Units =
        core::array::from_fn(|unit| by_cell[unit] * input[unit] * (1.0 - candidate[unit] * candidate[unit]));

    let mut by_before = [0.0; UNITS];
    for (number, value) in odd.iter().chain(&before.hidden).enumerate() {
        let derivative = product(row(weights, CANDIDATE + number), &by_candidate);
        if number < ODD {
            by_odd[number] += derivative
        } else {
            by_before[number - ODD] += derivative
        }
        let row = row_mut(gradient, CANDIDATE + number);
        row.iter_mut().zip(&by_candidate).for_each(|(sum, by)| *sum += value * by);
    }
    let squared = squares(&before.hidden);
    for (gate, by_gate) in by_gate.iter().enumerate() {
        for (number, value) in even.iter().chain(&squared).enumerate() {
            let place = GATES + gate * GATE_ROWS + number;
            let derivative = product(row(weights, place), by_gate);
            match number.checked_sub(EVEN) {
                None => by_even[number] += derivative,
                Some(unit) => by_before[unit] += 2.0 * before.hidden[unit] * derivative,
            }
            row_mut(gradient, place).iter_mut().zip(by_gate).for_each(|(sum, by)| *sum += value * by);
        }
    }
    let cell = core::array::from_fn(|unit| by_cell[unit] * forget[unit]);
    Backward { odd: by_odd, even: by_even, memory: Memory { hidden: by_before, cell } }
}

/// Adam: steps along the mean gradient, each weight by its own scale.
///
/// # References
/// Kingma and Ba 2015, arXiv:1412.6980; Loshchilov and Hutter 2019, arXiv:1711.05101 (decay beside the gradient).
pub(super) struct Adam {
    mean: Vec<f64>,
    square: Vec<f64>,
    steps: i32,
}

impl Adam {
    const DECAYS: [f64; 2] = [0.9, 0.999];

    pub(super) fn new(weights: usize) -> Self {
        Self { mean: vec![0.0; weights], square: vec![0.0; weights], steps: 0 }
    }

    /// One step of the size `rate` against `gradient`, which is first shortened to a length of 1.
    pub(super) fn step(&mut self, weights: &mut [f64], gradient: &[f64], rate: f64, decay: f64) {
        self.steps += 1;
        let length = gradient.iter().map(|value| value * value).sum::<f64>().sqrt();
        let shortened = 1.0 / length.max(1.0);
        let [one, other] = Self::DECAYS.map(|decay| 1.0 - decay.powi(self.steps));
        for (place, weight) in weights.iter_mut().enumerate() {
            let gradient = shortened * gradient[place];
            let (mean, square) = (&mut self.mean[place], &mut self.square[place]);
            *mean += (1.0 - Self::DECAYS[0]) * (gradient - *mean);
            *square += (1.0 - Self::DECAYS[1]) * (gradient * gradient - *square);
            *weight -= rate * ((*mean / one) / ((*square / other).sqrt() + 1e-8) + decay * *weight);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Purpose;

    fn weights() -> Vec<f64> {
        let noise = NoiseStream::new(3, Purpose::Training, [0; 3]);
        first_weights(&noise)
            .into_iter()
            .enumerate()
            .map(|(at, weight)| weight + 0.1 * noise.at(at as u32).normal())
            .collect()
    }

    fn inputs(step: usize) -> ([f64; ODD], [f64; EVEN]) {
        (
            core::array::from_fn(|input| math::sin(1.3 * step as f64 + 0.7 * input as f64)),
            core::array::from_fn(|input| math::cos(0.4 * step as f64 * input as f64)),
        )
    }

    /// A loss that every output of four steps enters.
    fn loss(weights: &[f64]) -> (f64, Vec<Forward>) {
        let (mut memory, mut loss, mut steps) = (Memory::EMPTY, 0.0, Vec::new());
        for step in 0..4 {
            let (odd, even) = inputs(step);
            let made = forward(weights, &memory, odd, even);
            memory = made.after;
            loss += made.changes.iter().chain([&made.growth]).map(|value| 0.5 * value * value).sum::<f64>();
            steps.push(made);
        }
        (loss, steps)
    }

    #[test]
    fn gradients_are_those_of_finite_differences() {
        let mut weights = weights();
        let (_, steps) = loss(&weights);
        let (mut gradient, mut after) = (vec![0.0; WEIGHTS], Memory::EMPTY);
        for step in steps.iter().rev() {
            after = backward(&weights, step, step.changes, step.growth, &after, &mut gradient).memory;
        }
        let mut largest = 0.0_f64;
        for place in 0..WEIGHTS {
            let weight = weights[place];
            let [above, below] = [1e-5, -1e-5].map(|by| {
                weights[place] = weight + by;
                loss(&weights).0
            });
            weights[place] = weight;
            let difference = (above - below) / 2e-5;
            let error = (difference - gradient[place]).abs();
            assert!(
                error < 1e-7 + 1e-5 * difference.abs(),
                "weight {place}: {difference} {}",
                gradient[place]
            );
            largest = largest.max(difference.abs());
        }
        assert!(largest > 0.1, "{largest}");
    }

    #[test]
    fn a_mirror_changes_the_sign_of_changes_alone() {
        let weights = weights();
        let (mut memory, mut image) = (Memory::EMPTY, Memory::EMPTY);
        for step in 0..20 {
            let (odd, even) = inputs(step);
            let one = forward(&weights, &memory, odd, even);
            let other = forward(&weights, &image, odd.map(|value| -value), even);
            assert_eq!((one.changes, one.growth), (other.changes.map(|value| -value), other.growth));
            (memory, image) = (one.after, other.after);
        }
    }
}
