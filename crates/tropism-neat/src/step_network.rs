//! A network of step neurons, run as the automaton that it is.
//!
//! A step neuron is 0 or 1, so a network of them is in one of finitely many states, and an episode visits few: some dozens,
//! however large the network. In each state, what links from neurons and the bias bring to their targets is constant. So
//! it is summed when a state is met for the first time, and remembered with it. What remains of a step is a few products
//! and a comparison for each neuron that sees an input, and to follow the memory from one state to the next.
//!
//! The decisions are those of [`Network`](crate::Network) to the bit: both add what the inputs bring and what everything
//! else brings apart, each in a fixed order, and then the two.

use std::cell::RefCell;

use crate::{Activation, Genome};

/// States that are remembered; a network that meets more begins anew.
const STATES: usize = 256;

/// Places in the index of states: twice as many, so that a look-up is short.
const PLACES: usize = 2 * STATES;

/// No state, in the index.
const VACANT: u32 = u32::MAX;

/// What is brought to the sensors is remembered in blocks of so many, which are copied at once.
const BLOCK: usize = 4;

/// What the sensors cannot do, for there are fewer than 64.
const NEVER: u64 = u64::MAX;

/// A network with one output in which every neuron is an [`Activation::UnsignedStep`].
///
/// ```
/// use tropism_neat::{Config, Network, StepNetwork, random_genome};
/// let genome = random_genome(&Config::paper(), 2, 1, 42, 0);
/// let mut plain = Network::new(&genome);
/// let mut flat = StepNetwork::<2>::new(&genome).unwrap();
/// assert_eq!(flat.activate([0.3, 4.0]), plain.activate(&[0.3, 4.0])[0] > 0.5);
/// ```
///
/// Many networks can sense side by side: whoever steps them may compute [`fired`](Sensor::fires) for all their
/// [`sensors`](Self::sensors) in vectors, and need only [`go_on`](Self::go_on) with those networks that do not
/// [`stay`](Self::stay) as they are.
#[derive(Clone, Debug)]
pub struct StepNetwork<const INPUTS: usize> {
    /// Units are numbered: the output, then the others that see an input, then the rest; the bias comes last, as a unit
    /// that is always 1.
    sensors: Vec<Sensor<INPUTS>>,
    /// Of all units but the bias.
    thresholds: Vec<f64>,
    /// Links from units and the bias, grouped by the unit that they enter, in the order of the genes.
    wires: Vec<Wire>,
    /// Where each unit's wires end; they begin where those of the one before end.
    ends: Vec<u32>,
    /// A row of bits for each unit and the bias: the units that it leads to.
    targets: Vec<u64>,
    /// A row of bits: the units that lead to any.
    leads: Vec<u64>,
    /// Words in a row of bits.
    words: usize,
    /// The states met so far, each a record of [`Record::words`]. The first is none that a network is ever in: there even
    /// the bias is 0.
    memory: Vec<u64>,
    record: Record,
    /// States in the memory.
    states: usize,
    /// Places of states in the memory, by a hash of their bits.
    index: Vec<u32>,
    /// A row of bits: units whose sum is to be computed for a new state.
    touched: Vec<u64>,
    /// Place of the present state in the memory.
    present: usize,
}

/// A unit that sees an input, or is the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor<const INPUTS: usize> {
    /// Weights of the inputs.
    pub weights: [f64; INPUTS],
    /// What the sum of all that comes in must exceed.
    pub threshold: f64,
}

#[derive(Clone, Copy, Debug)]
struct Wire {
    from: u32,
    weight: f64,
}

/// What a state's record in the memory holds, and where: what is needed at every step comes first.
#[derive(Clone, Copy, Debug, Default)]
struct Record {
    /// Behind what links from units and the bias bring to each sensor, as `f64`: a row of bits, the units that are 1.
    bits: usize,
    /// A row of bits, the units that see no input and are 1 in the next state.
    next: usize,
    /// The end.
    words: usize,
}

impl Record {
    /// What the sensors do if the network stays in this state.
    const STAY: usize = 0;
    /// What the sensors did when it was last left.
    const LEFT_WITH: usize = 1;
    /// The place of the state that came after.
    const LEFT_FOR: usize = 2;
    const REST: usize = 3;

    const fn new(sensors: usize, words: usize) -> Self {
        let bits = Self::REST + sensors.next_multiple_of(BLOCK);
        Self { bits, next: bits + words, words: bits + 2 * words }
    }
}

impl<const INPUTS: usize> Sensor<INPUTS> {
    /// Whether it is 1 after a step with these inputs, if all other links bring `rest`.
    #[inline]
    #[must_use]
    pub fn fires(&self, inputs: [f64; INPUTS], rest: f64) -> bool {
        let sensed = self.weights.iter().zip(inputs).fold(0.0, |sum, (weight, input)| sum + input * weight);
        sensed + rest > self.threshold
    }
}

impl<const INPUTS: usize> Default for StepNetwork<INPUTS> {
    /// A network without a link, whose output is 0.
    fn default() -> Self {
        let mut network = Self {
            sensors: vec![Sensor { weights: [0.0; INPUTS], threshold: 0.5 }],
            thresholds: vec![0.5],
            wires: Vec::new(),
            ends: vec![0],
            targets: vec![0; 2],
            leads: vec![0],
            words: 1,
            memory: Vec::new(),
            record: Record::default(),
            states: 0,
            index: vec![VACANT; PLACES],
            touched: Vec::new(),
            present: 0,
        };
        network.forget();
        network
    }
}

impl<const INPUTS: usize> StepNetwork<INPUTS> {
    /// The network of `genome` at rest; `None` if it has not [`INPUTS`](Self) inputs and one output, a neuron that is no
    /// unsigned step, or more than 63 neurons that see an input.
    #[must_use]
    pub fn new(genome: &Genome) -> Option<Self> {
        let mut network = Self::default();
        network.assign(genome).then_some(network)
    }

    /// Becomes the network of `genome`, at rest, in the room that it has; `false` where [`new`](Self::new) gives `None`, and
    /// then it is of no use until it is assigned another.
    #[must_use]
    pub fn assign(&mut self, genome: &Genome) -> bool {
        if genome.inputs() != INPUTS || genome.outputs() != 1 {
            return false;
        }
        let done = NUMBERS.with_borrow_mut(|numbers| self.wire_up(genome, numbers));
        if done {
            self.forget();
        }
        done
    }

    /// Becomes a network of nothing but an output that sees the inputs and the bias, as NEAT begins with.
    pub fn assign_seed(&mut self, weights: [f64; INPUTS], bias: f64, threshold: f64) {
        self.sensors.clear();
        self.sensors.push(Sensor { weights, threshold });
        self.thresholds.clear();
        self.thresholds.push(threshold);
        self.wires.clear();
        self.wires.push(Wire { from: 1, weight: bias });
        self.ends.clear();
        self.ends.push(1);
        self.words = 1;
        self.targets.clear();
        self.targets.extend([0, 1]);
        self.leads.clear();
        self.leads.push(0b10);
        self.forget();
    }

    /// Numbers the units and sorts the links; `false` if that cannot be done.
    fn wire_up(&mut self, genome: &Genome, numbers: &mut Numbers) -> bool {
        let neurons = &genome.neurons()[INPUTS + 1..];
        let is_step = |neuron: &crate::Neuron| neuron.activation == Activation::UnsignedStep;
        if !neurons.iter().all(is_step) {
            return false;
        }
        let units = neurons.len();
        self.words = units / 64 + 1;
        self.sensors.clear();
        numbers.begin(genome);
        let is_input = |id: u32| id <= INPUTS as u32;
        let sensing = genome.links().iter().filter(|link| is_input(link.from)).map(|link| link.to);
        for id in std::iter::once(neurons[0].id).chain(sensing) {
            if numbers.of(genome, id) == UNNUMBERED {
                if self.sensors.len() == 63 {
                    return false;
                }
                numbers.give(genome, id, self.sensors.len() as u32);
                self.sensors.push(Sensor { weights: [0.0; INPUTS], threshold: 0.0 });
            }
        }
        let mut next = self.sensors.len() as u32;
        self.thresholds.clear();
        self.thresholds.resize(units, 0.0);
        for neuron in neurons {
            let mut number = numbers.of(genome, neuron.id);
            if number == UNNUMBERED {
                number = next;
                numbers.give(genome, neuron.id, number);
                next += 1;
            }
            self.thresholds[number as usize] = 0.5 + neuron.b;
        }
        for (sensor, &threshold) in self.sensors.iter_mut().zip(&self.thresholds) {
            sensor.threshold = threshold;
        }
        numbers.give(genome, INPUTS as u32 + 1, units as u32);

        self.ends.clear();
        self.ends.resize(units, 0);
        for link in genome.links().iter().filter(|link| !is_input(link.from)) {
            self.ends[numbers.of(genome, link.to) as usize] += 1;
        }
        let mut start = 0;
        for end in &mut self.ends {
            // Where the next wire goes; the last one makes it the end.
            start += std::mem::replace(end, start);
        }
        self.wires.clear();
        self.wires.resize(start as usize, Wire { from: 0, weight: 0.0 });
        self.targets.clear();
        self.targets.resize((units + 1) * self.words, 0);
        self.leads.clear();
        self.leads.resize(self.words, 0);
        for link in genome.links() {
            let to = numbers.of(genome, link.to) as usize;
            if is_input(link.from) {
                self.sensors[to].weights[link.from as usize - 1] = link.weight;
                continue;
            }
            let from = numbers.of(genome, link.from);
            let end = &mut self.ends[to];
            self.wires[*end as usize] = Wire { from, weight: link.weight };
            *end += 1;
            self.targets[from as usize * self.words + to / 64] |= 1 << (to % 64);
            self.leads[from as usize / 64] |= 1 << (from % 64);
        }
        true
    }

    /// Sets every activation to 0, as in a new network.
    pub fn flush(&mut self) {
        // The state after the one where even the bias is 0.
        self.present = self.record.words;
    }

    /// The units that see an input, the output first.
    #[inline]
    #[must_use]
    pub fn sensors(&self) -> &[Sensor<INPUTS>] {
        &self.sensors
    }

    /// What links from units and the bias bring to each sensor in the present state, and zeros up to a multiple of four.
    #[inline]
    pub fn rest(&self) -> impl ExactSizeIterator<Item = f64> {
        let rest = self.present + Record::REST..self.present + self.record.bits;
        self.memory[rest].iter().map(|&bits| f64::from_bits(bits))
    }

    /// The sensors that matter for the next state, one bit each.
    #[inline]
    #[must_use]
    pub fn watched(&self) -> u64 {
        self.leads[0] & ((1 << self.sensors.len()) - 1)
    }

    /// The watched sensors that fire if the present state is also the next.
    #[inline]
    #[must_use]
    pub fn stay(&self) -> u64 {
        self.memory[self.present + Record::STAY]
    }

    /// Goes on to the next state, `fired` being the watched sensors that fire in the present one.
    #[inline]
    pub fn go_on(&mut self, fired: u64) {
        if let [stay, left_with, left_for, ..] = self.memory[self.present..] {
            if fired == left_with {
                self.present = left_for as usize;
            } else if fired != stay {
                self.look_up(fired);
            }
        }
    }

    /// One synchronous step: inputs in, whether the output is 1 out.
    #[inline]
    pub fn activate(&mut self, inputs: [f64; INPUTS]) -> bool {
        let sensors = self.sensors.iter().zip(self.rest()).enumerate();
        let fired = sensors
            .fold(0, |fired, (place, (sensor, rest))| fired | u64::from(sensor.fires(inputs, rest)) << place);
        self.go_on(fired & self.watched());
        fired & 1 == 1
    }

    /// Goes on to a state that did not come after the present one the last time.
    #[inline(never)]
    fn look_up(&mut self, fired: u64) {
        // The next state, written where it would be remembered.
        let (new, old) = (self.memory.len(), self.present);
        self.begin_record(old);
        let Record { bits, next, .. } = self.record;
        self.memory.copy_within(old + next..old + next + self.words, new + bits);
        self.memory[new + bits] |= fired;
        let place = self.place_of(new);
        let after = match self.index[place] {
            VACANT if self.states == STATES => {
                self.forget_all_but(new);
                return;
            }
            VACANT => {
                self.index[place] = new as u32;
                self.meet(new, old);
                new
            }
            known => {
                self.memory.truncate(new);
                known as usize
            }
        };
        self.memory[old + Record::LEFT_WITH] = fired;
        self.memory[old + Record::LEFT_FOR] = after as u64;
        self.present = after;
    }

    /// Appends a record of a state that is like the one at `near` so far.
    fn begin_record(&mut self, near: usize) {
        self.memory.extend_from_within(near..near + self.record.words);
        let new = self.memory.len() - self.record.words;
        self.memory[new + Record::LEFT_WITH] = NEVER;
    }

    /// Forgets every state, and is at rest.
    fn forget(&mut self) {
        let (units, words) = (self.thresholds.len(), self.words);
        self.record = Record::new(self.sensors.len(), words);
        let Record { bits, next, .. } = self.record;
        self.memory.clear();
        self.index.fill(VACANT);
        // First the state where nothing is 1, not even the bias. It brings nothing.
        self.memory.resize(self.record.words, 0);
        self.memory[Record::STAY] = NEVER;
        self.memory[Record::LEFT_WITH] = NEVER;
        let is_bias = 1 << (units % 64);
        self.memory[next + units / 64] = is_bias;
        for unit in (self.sensors.len()..units).filter(|&unit| self.thresholds[unit] < 0.0) {
            self.memory[next + unit / 64] |= 1 << (unit % 64);
        }
        // Then the one where the bias is.
        self.begin_record(0);
        self.present = self.record.words;
        self.memory[self.present + bits + units / 64] = is_bias;
        let place = self.place_of(self.present);
        self.index[place] = self.present as u32;
        self.states = 1;
        self.meet(self.present, 0);
    }

    /// Forgets every state but the first two and goes on to the one at `new`.
    fn forget_all_but(&mut self, new: usize) {
        let Record { bits, next, words } = self.record;
        self.memory.copy_within(new + bits..new + next, 2 * words + bits);
        self.memory.truncate(3 * words);
        self.index.fill(VACANT);
        self.memory[words + Record::LEFT_WITH] = NEVER;
        self.memory[2 * words + Record::LEFT_WITH] = NEVER;
        for state in [words, 2 * words] {
            let place = self.place_of(state);
            self.index[place] = state as u32;
        }
        self.memory.copy_within(Record::REST..bits, 2 * words + Record::REST);
        self.memory.copy_within(next..words, 2 * words + next);
        self.states = 2;
        self.present = 2 * words;
        self.meet(self.present, 0);
    }

    /// Completes the record of the state at `new`, whose bits are written, with all that follows from them. What else is
    /// written there is copied from the state at `near`, and still true of units that see nothing new.
    fn meet(&mut self, new: usize, near: usize) {
        let (words, sensors, Record { bits, next, .. }) = (self.words, self.sensors.len(), self.record);
        self.states += 1;
        self.touched.clear();
        self.touched.resize(words, 0);
        for word in 0..words {
            for bit in ones(self.memory[near + bits + word] ^ self.memory[new + bits + word]) {
                let targets = &self.targets[(64 * word + bit) * words..][..words];
                self.touched.iter_mut().zip(targets).for_each(|(touched, targets)| *touched |= targets);
            }
        }
        let record = &mut self.memory[new..];
        let (head, next) = record.split_at_mut(next);
        let (head, bits) = head.split_at_mut(bits);
        for (word, (next, &touched)) in next.iter_mut().zip(&self.touched).enumerate() {
            for bit in ones(touched) {
                let unit = 64 * word + bit;
                let start = if unit == 0 { 0 } else { self.ends[unit - 1] };
                let wires = &self.wires[start as usize..self.ends[unit] as usize];
                let sum = wires.iter().fold(0.0, |sum, wire| {
                    let is_one = bits[wire.from as usize / 64] >> (wire.from % 64) & 1;
                    sum + f64::from_bits(wire.weight.to_bits() & is_one.wrapping_neg())
                });
                if unit < sensors {
                    head[Record::REST + unit] = sum.to_bits();
                } else {
                    let fires = u64::from(sum > self.thresholds[unit]);
                    *next = *next & !(1 << bit) | fires << bit;
                }
            }
        }
        let of_sensors = (1 << sensors) - 1;
        let is_still = bits[0] & !of_sensors == next[0] && bits[1..] == next[1..];
        head[Record::STAY] = if is_still { bits[0] & of_sensors } else { NEVER };
    }

    /// Where in the index the state at `state` stands, or where it would.
    fn place_of(&self, state: usize) -> usize {
        let bits = |state: usize| &self.memory[state + self.record.bits..state + self.record.next];
        let own = bits(state);
        let hash = own.iter().fold(0, |hash: u64, word| (hash ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut place = (hash >> 55) as usize;
        while self.index[place] != VACANT && bits(self.index[place] as usize) != own {
            place = (place + 1) % PLACES;
        }
        place
    }
}

/// The places of the ones in a word.
fn ones(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = word.trailing_zeros();
        word &= word.wrapping_sub(1);
        (place < 64).then_some(place as usize)
    })
}

/// A neuron that has no number yet.
const UNNUMBERED: u32 = u32::MAX;

/// Ids up to here are looked up in a table.
const NEAR: usize = 1 << 16;

/// The numbers of neurons by their ids.
#[derive(Default)]
struct Numbers {
    /// Of ids below [`NEAR`]. Holds what it held of ids that are not in the genome.
    near: Vec<u32>,
    /// Of all others, by place in the genome.
    far: Vec<u32>,
}

thread_local! {
    /// Kept from genome to genome: to make the table would cost more than all that it is for.
    static NUMBERS: RefCell<Numbers> = RefCell::default();
}

impl Numbers {
    /// Nobody in `genome` has a number.
    fn begin(&mut self, genome: &Genome) {
        let neurons = genome.neurons();
        let most = neurons.last().map_or(0, |neuron| neuron.id as usize + 1);
        if self.near.len() < most.min(NEAR) {
            self.near.resize(most.min(NEAR), UNNUMBERED);
        }
        for neuron in neurons {
            if let Some(number) = self.near.get_mut(neuron.id as usize) {
                *number = UNNUMBERED;
            }
        }
        self.far.clear();
        if most > NEAR {
            self.far.resize(neurons.len(), UNNUMBERED);
        }
    }

    #[inline]
    fn of(&self, genome: &Genome, id: u32) -> u32 {
        match self.near.get(id as usize) {
            Some(&number) => number,
            None => self.far[place(genome, id)],
        }
    }

    fn give(&mut self, genome: &Genome, id: u32, number: u32) {
        match self.near.get_mut(id as usize) {
            Some(near) => *near = number,
            None => self.far[place(genome, id)] = number,
        }
    }
}

#[cold]
fn place(genome: &Genome, id: u32) -> usize {
    genome.position(id).expect("a genome's links join its own neurons")
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
    fn more_states_than_are_remembered_are_still_right() {
        // A shift register: its state is what its input was in the last 20 steps.
        let hidden: Vec<_> = (5..25).map(|id| (id, 0.5)).collect();
        let links: Vec<_> = (5..25).map(|id| (if id == 5 { 1 } else { id - 1 }, id, 1.0)).collect();
        let mut register = crate::testing::genome(2, 1, &hidden, &[&links[..], &[(24, 4, 1.0)]].concat());
        for neuron in &mut register.neurons {
            neuron.activation = Activation::UnsignedStep;
        }
        let (mut plain, mut flat) = (Network::new(&register), StepNetwork::<2>::new(&register).unwrap());
        for episode in 0..3_u32 {
            for step in 0..2000_u32 {
                let noise = (step ^ episode << 20).wrapping_mul(0x9e37_79b9) >> 15 & 1;
                let inputs = [f64::from(noise), 0.0];
                assert_eq!(flat.activate(inputs), plain.activate(&inputs)[0] > 0.5, "step {step}");
            }
            flat.flush();
            plain.flush();
        }
    }

    #[test]
    fn ids_of_any_size_are_found() {
        let high = 1 << 30;
        let mut grown =
            crate::testing::genome(2, 1, &[(high, 0.5)], &[(1, high, 1.0), (high, 4, 1.0), (3, 4, 0.3)]);
        grown.neurons.iter_mut().for_each(|neuron| neuron.activation = Activation::UnsignedStep);
        let mut flat = StepNetwork::<2>::new(&grown).unwrap();
        assert_eq!([1.0, 0.0, 0.0].map(|x| flat.activate([x, 0.0])), [false, true, false]);
    }

    #[test]
    fn other_shapes_and_neurons_are_refused() {
        let step = crate::random_genome(&Config::paper(), 3, 1, 1, 0);
        assert!(StepNetwork::<2>::new(&step).is_none());
        let sigmoid = Config { output_activation: Activation::UnsignedSigmoid, ..Config::paper() };
        assert!(StepNetwork::<2>::new(&crate::random_genome(&sigmoid, 2, 1, 1, 0)).is_none());
    }

    #[test]
    fn a_seed_is_one_sensor_that_nothing_else_depends_on() {
        let genome = crate::random_genome(&Config::paper(), 2, 1, 1, 7);
        let weights: Vec<f64> = genome.links().iter().map(|link| link.weight).collect();
        let network = StepNetwork::<2>::new(&genome).unwrap();
        assert_eq!(network.sensors(), [Sensor { weights: [weights[0], weights[1]], threshold: 0.5 }]);
        assert_eq!(network.rest().next(), Some(weights[2]));
        assert_eq!((network.watched(), network.stay()), (0, 0));
        let mut seed = StepNetwork::<2>::default();
        seed.assign_seed([weights[0], weights[1]], weights[2], 0.5);
        assert_eq!(seed.sensors(), network.sensors());
        assert!(seed.rest().eq(network.rest()));
        assert_eq!((seed.watched(), seed.stay()), (0, 0));
    }
}
