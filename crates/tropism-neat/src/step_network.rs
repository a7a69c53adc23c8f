//! A network of step neurons, flattened and driven by events.
//!
//! A step neuron is 0 or 1 and seldom changes: between two changes, all that its links bring to their targets is
//! constant. So the sum of each neuron's links from other neurons and the bias is kept, and computed anew only when one of
//! its sources has changed. What remains of a step is two products and a comparison per neuron, however many links there
//! are.
//!
//! The decisions are those of [`Network`](crate::Network) to the bit: both add what the inputs bring and what everything
//! else brings apart, each in a fixed order, and then the two.

use crate::{Activation, Genome};

/// Neurons whose sums are computed side by side.
const WIDTH: usize = 8;

/// A network with one output in which every neuron is an [`Activation::UnsignedStep`].
///
/// ```
/// use tropism_neat::{Config, Network, StepNetwork, random_genome};
/// let genome = random_genome(&Config::paper(), 2, 1, 42, 0);
/// let mut plain = Network::new(&genome);
/// let mut flat = StepNetwork::<2>::new(&genome).unwrap();
/// assert_eq!(flat.activate([0.3, 4.0]), plain.activate(&[0.3, 4.0])[0] > 0.5);
/// ```
#[derive(Clone, Debug)]
pub struct StepNetwork<const INPUTS: usize> {
    /// Per chunk of units: weights from each input, sums of all other links, thresholds.
    chunks: Vec<Chunk<INPUTS>>,
    /// Units, the output being unit 0.
    units: usize,
    /// Links from units and the bias, in the order of the genes, grouped by the unit that they enter.
    wires: Vec<Wire>,
    /// For each unit, where its wires begin; one more at the end.
    entries: Vec<u32>,
    /// Units that each unit leads to, and where each unit's begin.
    targets: Vec<u32>,
    exits: Vec<u32>,
    /// Units whose sums are out of date, each once.
    stale: Vec<u32>,
    is_stale: Vec<bool>,
}

#[derive(Clone, Debug)]
struct Chunk<const INPUTS: usize> {
    weights: [[f64; WIDTH]; INPUTS],
    rest: [f64; WIDTH],
    threshold: [f64; WIDTH],
    /// One bit a unit: whether it is 1.
    fired: u8,
}

#[derive(Clone, Copy, Debug)]
struct Wire {
    /// Source; [`BIAS`] for the bias, which is always 1.
    from: u32,
    weight: f64,
}

const BIAS: u32 = u32::MAX;

impl<const INPUTS: usize> StepNetwork<INPUTS> {
    /// The network of `genome` at rest; `None` if it has not [`INPUTS`](Self) inputs and one output, or a neuron that is
    /// no unsigned step.
    ///
    /// Neurons from which no path leads to the output are left out: they decide nothing.
    #[must_use]
    pub fn new(genome: &Genome) -> Option<Self> {
        let neurons = genome.neurons();
        let output = genome.inputs() + 1;
        let is_step = |place: usize| neurons[place].activation == Activation::UnsignedStep;
        if genome.inputs() != INPUTS || genome.outputs() != 1 || !(output..neurons.len()).all(is_step) {
            return None;
        }
        let place = |id| genome.position(id).expect("a genome's links join its own neurons");
        let links: Vec<(usize, usize, f64)> =
            genome.links().iter().map(|link| (place(link.from), place(link.to), link.weight)).collect();
        let unit_of = units(neurons.len(), output, &links);
        let units = unit_of.iter().flatten().count();
        let mut network = Self::at_rest(units);
        for (place, unit) in unit_of.iter().enumerate() {
            if let Some(unit) = *unit {
                network.chunks[unit / WIDTH].threshold[unit % WIDTH] = 0.5 + neurons[place].b;
            }
        }
        let mut wires: Vec<(usize, Wire)> = Vec::new();
        let mut targets: Vec<(usize, usize)> = Vec::new();
        for &(from, to, weight) in &links {
            let Some(unit) = unit_of[to] else { continue };
            if from < INPUTS {
                network.chunks[unit / WIDTH].weights[from][unit % WIDTH] = weight;
            } else if from == INPUTS {
                wires.push((unit, Wire { from: BIAS, weight }));
            } else if let Some(source) = unit_of[from] {
                wires.push((unit, Wire { from: source as u32, weight }));
                targets.push((source, unit));
            }
        }
        // Stable: within a unit, sums run in the order of the genes.
        wires.sort_by_key(|&(unit, _)| unit);
        targets.sort_unstable();
        network.entries = starts(units, wires.iter().map(|wire| wire.0));
        network.exits = starts(units, targets.iter().map(|target| target.0));
        network.wires = wires.into_iter().map(|wire| wire.1).collect();
        network.targets = targets.into_iter().map(|target| target.1 as u32).collect();
        network.flush();
        Some(network)
    }

    fn at_rest(units: usize) -> Self {
        let chunk = Chunk {
            weights: [[0.0; WIDTH]; INPUTS],
            rest: [0.0; WIDTH],
            threshold: [f64::INFINITY; WIDTH],
            fired: 0,
        };
        Self {
            chunks: vec![chunk; units.div_ceil(WIDTH)],
            units,
            wires: Vec::new(),
            entries: Vec::new(),
            targets: Vec::new(),
            exits: Vec::new(),
            stale: Vec::with_capacity(units),
            is_stale: vec![false; units],
        }
    }

    /// Sets every activation to 0, as in a new network.
    pub fn flush(&mut self) {
        for chunk in &mut self.chunks {
            chunk.fired = 0;
        }
        self.stale.clear();
        self.is_stale.fill(false);
        for unit in 0..self.units {
            self.settle(unit);
        }
    }

    /// If the output depends on the inputs and the bias alone: the weights of the inputs, and the bias's. It is 1 where
    /// `(sum of weight * input) + bias > threshold`.
    #[must_use]
    pub fn linear(&self) -> Option<([f64; INPUTS], f64, f64)> {
        let chunk = self.chunks.first().filter(|_| self.units == 1 && self.targets.is_empty())?;
        Some((chunk.weights.map(|weights| weights[0]), chunk.rest[0], chunk.threshold[0]))
    }

    /// One synchronous step: inputs in, whether the output is 1 out.
    pub fn activate(&mut self, inputs: [f64; INPUTS]) -> bool {
        for at in 0..self.chunks.len() {
            let chunk = &mut self.chunks[at];
            let fired = chunk.fire(inputs);
            let mut changed = fired ^ chunk.fired;
            chunk.fired = fired;
            while changed != 0 {
                let unit = at * WIDTH + changed.trailing_zeros() as usize;
                changed &= changed - 1;
                for target in self.exits[unit]..self.exits[unit + 1] {
                    let target = self.targets[target as usize];
                    if !std::mem::replace(&mut self.is_stale[target as usize], true) {
                        self.stale.push(target);
                    }
                }
            }
        }
        // Only now, when all have fired: a step reads what the sources were before it.
        while let Some(unit) = self.stale.pop() {
            self.is_stale[unit as usize] = false;
            self.settle(unit as usize);
        }
        self.chunks[0].fired & 1 == 1
    }

    /// Brings the sum of a unit's links from units and the bias up to date.
    fn settle(&mut self, unit: usize) {
        let mut sum = 0.0;
        for wire in &self.wires[self.entries[unit] as usize..self.entries[unit + 1] as usize] {
            let is_one = wire.from == BIAS
                || self.chunks[wire.from as usize / WIDTH].fired >> (wire.from % WIDTH as u32) & 1 == 1;
            if is_one {
                sum += wire.weight;
            }
        }
        self.chunks[unit / WIDTH].rest[unit % WIDTH] = sum;
    }
}

impl<const INPUTS: usize> Chunk<INPUTS> {
    /// Which units are 1 for these inputs, one bit each.
    #[inline]
    fn fire(&self, inputs: [f64; INPUTS]) -> u8 {
        let mut sums = [0.0; WIDTH];
        for (weights, input) in self.weights.iter().zip(inputs) {
            for (sum, weight) in sums.iter_mut().zip(weights) {
                *sum += input * weight;
            }
        }
        let units = sums.iter().zip(&self.rest).zip(&self.threshold).enumerate();
        units.fold(0, |fired, (unit, ((sum, rest), threshold))| {
            fired | u8::from(sum + rest > *threshold) << unit
        })
    }
}

/// The number of each neuron that leads to the output, the output itself being 0.
fn units(neurons: usize, output: usize, links: &[(usize, usize, f64)]) -> Vec<Option<usize>> {
    let mut leads = vec![false; neurons];
    leads[output] = true;
    let mut found = vec![output];
    while let Some(to) = found.pop() {
        for &(from, _, _) in links.iter().filter(|link| link.1 == to && link.0 > output) {
            if !std::mem::replace(&mut leads[from], true) {
                found.push(from);
            }
        }
    }
    let mut next = 0;
    let number = |(place, leads): (usize, bool)| {
        (place >= output && leads).then(|| {
            next += 1;
            next - 1
        })
    };
    leads.into_iter().enumerate().map(number).collect()
}

/// Where each unit's entries begin in a list sorted by unit, and the end.
fn starts(units: usize, sorted: impl Iterator<Item = usize>) -> Vec<u32> {
    let mut starts = vec![0; units + 1];
    for unit in sorted {
        starts[unit + 1] += 1;
    }
    for unit in 0..units {
        starts[unit + 1] += starts[unit];
    }
    starts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Config, Neat, Network};

    /// A walk over the plane that a tip might take, with jumps.
    fn walk(step: u32) -> [f64; 2] {
        let turn = f64::from(step) * 0.37;
        [8.0 * libm::sin(turn) + libm::sin(5.1 * turn), 4.0 + 0.03 * f64::from(step) + libm::cos(turn)]
    }

    #[test]
    fn decides_as_the_plain_network_on_genomes_of_all_sizes() {
        let mut compared = 0;
        let mut largest = 0;
        for seed in 0..6 {
            let config = Config { mutate_add_neuron_prob: 0.3, mutate_add_link_prob: 0.3, ..Config::paper() };
            let mut neat = Neat::new(config, 2, 1, seed).unwrap();
            for generation in 0..120_u32 {
                for genome in neat.ask().iter().step_by(5) {
                    let mut plain = Network::new(genome);
                    let mut flat = StepNetwork::<2>::new(genome).unwrap();
                    for step in 0..60 {
                        let inputs = walk(step + generation);
                        assert_eq!(flat.activate(inputs), plain.activate(&inputs)[0] > 0.5, "{genome:?}");
                    }
                    flat.flush();
                    plain.flush();
                    assert_eq!(flat.activate([1.0, 5.0]), plain.activate(&[1.0, 5.0])[0] > 0.5);
                    compared += 1;
                    largest = largest.max(genome.links().len());
                }
                // The largest are the fittest: what counts is that genomes grow.
                let scores: Vec<f64> = neat.ask().iter().map(|genome| genome.links().len() as f64).collect();
                neat.tell(&scores).unwrap();
            }
        }
        assert!(compared > 5000 && largest > 60, "{compared} genomes of up to {largest} links");
    }

    #[test]
    fn other_shapes_and_neurons_are_refused() {
        let step = crate::random_genome(&Config::paper(), 3, 1, 1, 0);
        assert!(StepNetwork::<2>::new(&step).is_none());
        let sigmoid = Config { output_activation: Activation::UnsignedSigmoid, ..Config::paper() };
        assert!(StepNetwork::<2>::new(&crate::random_genome(&sigmoid, 2, 1, 1, 0)).is_none());
    }

    #[test]
    fn a_seed_is_linear() {
        let genome = crate::random_genome(&Config::paper(), 2, 1, 1, 7);
        let weights: Vec<f64> = genome.links().iter().map(|link| link.weight).collect();
        let (inputs, bias, threshold) = StepNetwork::<2>::new(&genome).unwrap().linear().unwrap();
        assert_eq!((inputs[0], inputs[1], bias, threshold), (weights[0], weights[1], weights[2], 0.5));
    }
}
