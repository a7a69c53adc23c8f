//! A network of step neurons, flattened and driven by events.
//!
//! A step neuron is 0 or 1 and seldom changes: between two changes, all that its links bring to their targets is
//! constant. So the sum of each neuron's links from other neurons and the bias is kept, and computed anew only when one of
//! its sources has changed. What remains of a step is a few products and a comparison for each neuron that sees an input,
//! however many links there are.
//!
//! The decisions are those of [`Network`](crate::Network) to the bit: both add what the inputs bring and what everything
//! else brings apart, each in a fixed order, and then the two.

use std::ops::Range;

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
    /// Units that see an input: they may change at every step.
    sensing: Vec<Chunk<INPUTS>>,
    /// All units, the sensing ones first.
    units: Vec<Unit>,
    /// The unit that is the output.
    output: usize,
    /// Links from units and the bias, in the order of the genes, grouped by the unit that they enter.
    wires: Vec<Wire>,
    /// Units that each unit leads to, grouped by unit.
    targets: Vec<u32>,
    /// Units whose sum is out of date, each once.
    stale: Vec<u32>,
    /// Units that see no input and whose sum changed after the last step: they fire in the next.
    due: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Chunk<const INPUTS: usize> {
    weights: [[f64; WIDTH]; INPUTS],
    /// What all other links bring.
    rest: [f64; WIDTH],
    threshold: [f64; WIDTH],
    /// One bit a unit: whether it is 1.
    fired: u8,
}

#[derive(Clone, Debug)]
struct Unit {
    /// Its wires and targets.
    wires: Range<u32>,
    targets: Range<u32>,
    threshold: f64,
    /// What links from units and the bias bring: of a unit that sees no input, its whole sum.
    sum: f64,
    /// Whether it is 1.
    is_one: bool,
    is_stale: bool,
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
        let unit_of = units(neurons.len(), output, INPUTS, &links);
        let count = unit_of.iter().flatten().count();
        let mut wires: Vec<(usize, Wire)> = Vec::with_capacity(links.len());
        let mut targets: Vec<(usize, usize)> = Vec::with_capacity(links.len());
        let mut weights: Vec<(usize, usize, f64)> = Vec::new();
        for &(from, to, weight) in &links {
            let Some(unit) = unit_of[to] else { continue };
            if from < INPUTS {
                weights.push((unit, from, weight));
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
        let sensing = weights.iter().map(|weight| weight.0 + 1).max().unwrap_or(0);
        let mut chunks = vec![Chunk::still(); sensing.div_ceil(WIDTH)];
        for (unit, input, weight) in weights {
            chunks[unit / WIDTH].weights[input][unit % WIDTH] = weight;
        }
        let (entries, exits) = (ranges(count, &wires), ranges(count, &targets));
        let mut units = Vec::with_capacity(count);
        for (wires, targets) in entries.into_iter().zip(exits) {
            units.push(Unit { wires, targets, threshold: 0.0, sum: 0.0, is_one: false, is_stale: false });
        }
        for (place, unit) in unit_of.iter().enumerate() {
            if let Some(unit) = *unit {
                units[unit].threshold = 0.5 + neurons[place].b;
                if let Some(chunk) = chunks.get_mut(unit / WIDTH).filter(|_| unit < sensing) {
                    chunk.threshold[unit % WIDTH] = units[unit].threshold;
                }
            }
        }
        let mut network = Self {
            sensing: chunks,
            units,
            output: unit_of[output].expect("the output leads to itself"),
            wires: wires.into_iter().map(|wire| wire.1).collect(),
            targets: targets.into_iter().map(|target| target.1 as u32).collect(),
            stale: Vec::with_capacity(count),
            due: Vec::with_capacity(count),
        };
        network.flush();
        Some(network)
    }

    /// Sets every activation to 0, as in a new network.
    pub fn flush(&mut self) {
        for chunk in &mut self.sensing {
            chunk.fired = 0;
        }
        self.stale.clear();
        self.due.clear();
        for unit in 0..self.units.len() {
            self.units[unit].is_one = false;
            self.mark(unit as u32);
        }
        self.settle();
    }

    /// If the output depends on the inputs and the bias alone: the weights of the inputs, the bias's, and the threshold.
    /// It is 1 where `(sum of weight * input) + bias > threshold`.
    #[must_use]
    pub fn linear(&self) -> Option<([f64; INPUTS], f64, f64)> {
        let only = self.units.first().filter(|_| self.units.len() == 1 && self.targets.is_empty())?;
        let weights =
            self.sensing.first().map_or([0.0; INPUTS], |chunk| chunk.weights.map(|weights| weights[0]));
        Some((weights, only.sum, only.threshold))
    }

    /// One synchronous step: inputs in, whether the output is 1 out.
    #[inline]
    pub fn activate(&mut self, inputs: [f64; INPUTS]) -> bool {
        for at in 0..self.sensing.len() {
            let chunk = &mut self.sensing[at];
            let fired = chunk.fire(inputs);
            let mut changed = fired ^ chunk.fired;
            chunk.fired = fired;
            while changed != 0 {
                let bit = changed.trailing_zeros() as usize;
                changed &= changed - 1;
                self.set(at * WIDTH + bit, fired >> bit & 1 == 1);
            }
        }
        // Those that fell due after the last step; none can fall due before all have fired.
        for index in 0..self.due.len() {
            let unit = self.due[index] as usize;
            let is_one = self.units[unit].sum > self.units[unit].threshold;
            if is_one != self.units[unit].is_one {
                self.set(unit, is_one);
            }
        }
        self.due.clear();
        // Only now, when all have fired: a step reads what the sources were before it.
        if !self.stale.is_empty() {
            self.settle();
        }
        self.units[self.output].is_one
    }

    fn set(&mut self, unit: usize, is_one: bool) {
        self.units[unit].is_one = is_one;
        for target in self.units[unit].targets.clone() {
            self.mark(self.targets[target as usize]);
        }
    }

    fn mark(&mut self, unit: u32) {
        if !std::mem::replace(&mut self.units[unit as usize].is_stale, true) {
            self.stale.push(unit);
        }
    }

    /// Brings the sums of stale units up to date.
    fn settle(&mut self) {
        while let Some(at) = self.stale.pop() {
            let unit = at as usize;
            let wires = self.units[unit].wires.clone();
            let mut sum = 0.0;
            for wire in &self.wires[wires.start as usize..wires.end as usize] {
                if wire.from == BIAS || self.units[wire.from as usize].is_one {
                    sum += wire.weight;
                }
            }
            self.units[unit].is_stale = false;
            self.units[unit].sum = sum;
            match self.sensing.get_mut(unit / WIDTH) {
                Some(chunk) if chunk.is_sensing(unit % WIDTH) => chunk.rest[unit % WIDTH] = sum,
                _ => self.due.push(at),
            }
        }
    }
}

impl<const INPUTS: usize> Chunk<INPUTS> {
    /// Units that never fire.
    const fn still() -> Self {
        Self {
            weights: [[0.0; WIDTH]; INPUTS],
            rest: [0.0; WIDTH],
            threshold: [f64::INFINITY; WIDTH],
            fired: 0,
        }
    }

    /// Whether a unit belongs to this chunk, which may be filled up with none.
    const fn is_sensing(&self, unit: usize) -> bool {
        self.threshold[unit] < f64::INFINITY
    }

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

/// The number of each neuron that leads to the output, those that see an input first.
fn units(neurons: usize, output: usize, inputs: usize, links: &[(usize, usize, f64)]) -> Vec<Option<usize>> {
    let mut sources: Vec<(usize, usize)> =
        links.iter().filter(|link| link.0 >= output).map(|&(from, to, _)| (to, from)).collect();
    sources.sort_unstable();
    let mut leads = vec![false; neurons];
    leads[output] = true;
    let mut found = vec![output];
    while let Some(to) = found.pop() {
        let first = sources.partition_point(|source| source.0 < to);
        for &(_, from) in sources[first..].iter().take_while(|source| source.0 == to) {
            if !std::mem::replace(&mut leads[from], true) {
                found.push(from);
            }
        }
    }
    let mut senses = vec![false; neurons];
    for link in links.iter().filter(|link| link.0 < inputs) {
        senses[link.1] = true;
    }
    let mut unit_of = vec![None; neurons];
    let mut next = 0;
    for is_first in [true, false] {
        for place in (output..neurons).filter(|&place| leads[place] && senses[place] == is_first) {
            unit_of[place] = Some(next);
            next += 1;
        }
    }
    unit_of
}

/// Where each unit's entries stand in a list sorted by unit.
fn ranges<T>(units: usize, sorted: &[(usize, T)]) -> Vec<Range<u32>> {
    let mut end = 0;
    (0..units)
        .map(|unit| {
            let start = end;
            end += sorted[start..].iter().take_while(|entry| entry.0 == unit).count();
            start as u32..end as u32
        })
        .collect()
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
