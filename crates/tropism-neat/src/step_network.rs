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
use std::hint::select_unpredictable;

use crate::{Activation, Genome};

/// States that are remembered; a network that meets more begins anew.
const STATES: usize = 250;

/// Places in the index of states: twice as many, so that a look-up is short.
const PLACES: usize = 512;

/// No state, in the index.
const VACANT: u8 = u8::MAX;

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
/// Many networks can sense side by side: whoever steps them may find out in vectors which of their
/// [`sensors`](Self::sensors) [fire](Sensor::fires), and need only [`go_on`](Self::go_on) with those networks that do not
/// [`stay`](Self::stay) as they are.
#[derive(Clone, Debug)]
pub struct StepNetwork<const INPUTS: usize> {
    memory: Memory,
    wiring: Wiring,
    sensors: Vec<Sensor<INPUTS>>,
}

/// A unit that sees an input, or is the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor<const INPUTS: usize> {
    /// Weights of the inputs.
    pub weights: [f64; INPUTS],
    /// What the sum of all that comes in must exceed.
    pub threshold: f64,
}

/// Who brings what to whom, but for the inputs.
///
/// Units are numbered: the output, then the others that see an input, then the rest; the bias comes last, as a unit that
/// is always 1. Sets of units are rows of bits.
#[derive(Clone, Debug, Default)]
struct Wiring {
    /// All but the bias.
    units: Vec<Unit>,
    /// The third and further links into units that have so many.
    more: Vec<Wire>,
    /// Two rows for each unit and the bias: the units that it leads to whose sum is to be computed when it changes; and
    /// those that have no other source and simply follow it.
    targets: Vec<u64>,
    /// The units that lead to any.
    leads: Vec<u64>,
    /// Words in a row.
    row: usize,
    /// How many units are sensors.
    sensors: usize,
}

/// A neuron that computes. All numbers are short, so that two units fill a line of the cache.
#[derive(Clone, Copy, Debug)]
struct Unit {
    threshold: f64,
    /// The first two links that enter it, in the order of the genes: their weights and where they come from.
    weights: [f64; 2],
    from: [u16; 2],
    /// The first of the links after those two, or [`NONE`].
    more: u16,
    /// How many of the two there are; with more, two and the number of the last one.
    last: u16,
}

#[derive(Clone, Copy, Debug)]
struct Wire {
    weight: f64,
    from: u16,
    /// The next one into the same unit, or [`NONE`].
    next: u16,
}

const UNLINKED: Unit = Unit { threshold: 0.0, weights: [0.0; 2], from: [0; 2], more: NONE, last: 0 };

/// No further link.
const NONE: u16 = u16::MAX;

/// The most neurons or links that numbers so short can tell apart.
const MOST: usize = 65_000;

/// The states met so far.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Memory {
    /// A record for each state. The first is of none that a network is ever in: there even the bias is 0.
    records: Vec<u64>,
    /// Where the record of the present state begins.
    present: usize,
    layout: Layout,
    /// Numbers of states, by a hash of their bits.
    index: [u8; PLACES],
}

/// Where things stand in a record. What is needed at every step comes first.
#[derive(Clone, Copy, Debug, Default)]
struct Layout {
    /// Behind what other links than those of the inputs bring to each sensor, as `f64`: the units that are 1.
    bits: usize,
    /// The units that see no input and are 1 in the next state.
    next: usize,
    /// The length of a record.
    words: usize,
}

impl Layout {
    /// What the sensors do if the network stays in this state.
    const STAY: usize = 0;
    /// What the sensors did when it was last left for another state, and before that with something else.
    const LEFT_WITH: [usize; 2] = [1, 2];
    /// Where the states that came after begin.
    const LEFT_FOR: [usize; 2] = [3, 4];
    /// Read by nobody: what is brought to units that are no sensors may be written here.
    const WASTE: usize = 5;
    /// What is brought to the sensors.
    const REST: usize = 6;

    const fn new(sensors: usize, row: usize) -> Self {
        let bits = Self::REST + sensors.next_multiple_of(BLOCK);
        Self { bits, next: bits + row, words: bits + 2 * row }
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
    /// The smallest network: its output sees nothing.
    fn default() -> Self {
        let memory =
            Memory { records: Vec::new(), present: 0, layout: Layout::default(), index: [VACANT; PLACES] };
        let mut network = Self { memory, wiring: Wiring::default(), sensors: Vec::new() };
        network.sensors.push(Sensor { weights: [0.0; INPUTS], threshold: 0.5 });
        network.wiring.begin(1, 1);
        network.memory.forget(&network.wiring);
        network
    }
}

impl<const INPUTS: usize> StepNetwork<INPUTS> {
    /// The network of `genome` at rest; `None` if it has not [`INPUTS`](Self) inputs and one output, a neuron that is no
    /// unsigned step, more than 63 neurons that see an input, or more than 65000 neurons or links.
    #[must_use]
    pub fn new(genome: &Genome) -> Option<Self> {
        let mut network = Self::default();
        network.assign(genome).then_some(network)
    }

    /// Becomes the network of `genome`, at rest, in the room that it has; `false` where [`new`](Self::new) gives `None`, and
    /// then it is of no use until it is assigned another.
    #[must_use]
    pub fn assign(&mut self, genome: &Genome) -> bool {
        let has_shape = genome.inputs() == INPUTS && genome.outputs() == 1;
        let is_done = has_shape && NUMBERS.with_borrow_mut(|numbers| self.wire_up(genome, numbers));
        if is_done {
            self.memory.forget(&self.wiring);
        }
        is_done
    }

    /// Numbers the units and links them; `false` if that cannot be done.
    fn wire_up(&mut self, genome: &Genome, numbers: &mut Numbers) -> bool {
        let neurons = &genome.neurons()[INPUTS + 1..];
        if neurons.len() > MOST || genome.links().len() > MOST {
            return false;
        }
        if neurons.iter().any(|neuron| neuron.activation != Activation::UnsignedStep) {
            return false;
        }
        let is_input = |id: u32| id <= INPUTS as u32;
        numbers.begin(genome);
        self.sensors.clear();
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
        self.wiring.begin(neurons.len(), self.sensors.len());
        let mut next = self.sensors.len() as u32;
        for neuron in neurons {
            let mut number = numbers.of(genome, neuron.id);
            if number == UNNUMBERED {
                number = next;
                numbers.give(genome, neuron.id, number);
                next += 1;
            }
            let threshold = 0.5 + neuron.b;
            self.wiring.units[number as usize].threshold = threshold;
            if let Some(sensor) = self.sensors.get_mut(number as usize) {
                sensor.threshold = threshold;
            }
        }
        numbers.give(genome, INPUTS as u32 + 1, neurons.len() as u32);
        for link in genome.links() {
            let to = numbers.of(genome, link.to);
            if is_input(link.from) {
                self.sensors[to as usize].weights[link.from as usize - 1] = link.weight;
            } else {
                self.wiring.link(numbers.of(genome, link.from), to, link.weight);
            }
        }
        true
    }

    /// Sets every activation to 0, as in a new network.
    pub fn flush(&mut self) {
        // The state after the one where even the bias is 0.
        self.memory.present = self.memory.layout.words;
    }

    /// The units that see an input, the output first.
    #[inline]
    #[must_use]
    pub fn sensors(&self) -> &[Sensor<INPUTS>] {
        &self.sensors
    }

    /// What links from units and the bias bring to each sensor in the present state, in blocks of four; zeros fill the last.
    #[inline]
    pub fn rest(&self) -> impl ExactSizeIterator<Item = [f64; BLOCK]> {
        let Memory { records, present, layout, .. } = &self.memory;
        let (blocks, _) = records[present + Layout::REST..present + layout.bits].as_chunks();
        blocks.iter().map(|block| block.map(f64::from_bits))
    }

    /// The sensors that matter for the next state, one bit each.
    #[inline]
    #[must_use]
    pub fn watched(&self) -> u64 {
        self.wiring.leads[0] & of_sensors(self.sensors.len())
    }

    /// The watched sensors that fire if the present state is also the next.
    #[inline]
    #[must_use]
    pub fn stay(&self) -> u64 {
        self.memory.records[self.memory.present + Layout::STAY]
    }

    /// Goes on to the next state, `fired` being the watched sensors that fire in the present one.
    #[inline]
    pub fn go_on(&mut self, fired: u64) {
        if let [stay, last, before, after_last, after_before, ..] = self.memory.records[self.memory.present..]
        {
            if (fired == last) | (fired == before) {
                let after = select_unpredictable(fired == last, after_last, after_before);
                self.memory.present = after as usize;
            } else if fired != stay {
                self.memory.look_up(&self.wiring, fired);
            }
        }
    }

    /// One synchronous step: inputs in, whether the output is 1 out.
    #[inline]
    pub fn activate(&mut self, inputs: [f64; INPUTS]) -> bool {
        let sensors = self.sensors.iter().zip(self.rest().flatten()).enumerate();
        let fired = sensors
            .fold(0, |fired, (place, (sensor, rest))| fired | u64::from(sensor.fires(inputs, rest)) << place);
        self.go_on(fired & self.watched());
        fired & 1 == 1
    }
}

/// One bit for each of so many sensors.
const fn of_sensors(count: usize) -> u64 {
    (1 << count) - 1
}

impl Wiring {
    /// So many units without a link.
    fn begin(&mut self, units: usize, sensors: usize) {
        self.sensors = sensors;
        self.row = units / 64 + 1;
        self.units.clear();
        self.units.resize(units, UNLINKED);
        self.more.clear();
        self.targets.clear();
        self.targets.resize(2 * (units + 1) * self.row, 0);
        self.leads.clear();
        self.leads.resize(self.row, 0);
    }

    /// Adds a link from a unit or the bias to a unit.
    #[inline]
    fn link(&mut self, from: u32, to: u32, weight: f64) {
        let place = to as usize;
        self.leads[from as usize / 64] |= 1 << (from % 64);
        let (unit, from) = (&mut self.units[place], from as u16);
        let own = usize::from(unit.last);
        let row = |from: u16| 2 * usize::from(from) * self.row + place / 64;
        // Whether it has been, or may be, one that only follows.
        let follows = place >= self.sensors && unit.threshold >= 0.0 && own < 2;
        if follows && own == 0 {
            self.targets[row(from) + self.row] |= u64::from(weight > unit.threshold) << (place % 64);
        } else {
            if follows {
                self.targets[row(unit.from[0]) + self.row] &= !(1 << (place % 64));
                self.targets[row(unit.from[0])] |= 1 << (place % 64);
            }
            self.targets[row(from)] |= 1 << (place % 64);
        }
        if own < 2 {
            (unit.weights[own], unit.from[own]) = (weight, from);
            unit.last += 1;
            return;
        }
        let number = self.more.len() as u16;
        match unit.more {
            NONE => unit.more = number,
            _ => self.more[own - 2].next = number,
        }
        unit.last = number + 2;
        self.more.push(Wire { weight, from, next: NONE });
    }

    /// What all links bring to a unit if the units of `bits` are 1.
    #[inline]
    fn sum(&self, unit: &Unit, bits: &[u64]) -> f64 {
        // A branch would be guessed wrong half of the time.
        let brings = |from: u16, weight: f64| {
            let is_one = bits[usize::from(from / 64)] >> (from % 64) & 1 == 1;
            f64::from_bits(select_unpredictable(is_one, weight.to_bits(), 0))
        };
        let mut sum = 0.0 + brings(unit.from[0], unit.weights[0]) + brings(unit.from[1], unit.weights[1]);
        let mut next = unit.more;
        while next != NONE {
            let wire = self.more[usize::from(next)];
            sum += brings(wire.from, wire.weight);
            next = wire.next;
        }
        sum
    }
}

impl Memory {
    /// Forgets every state, and is at rest.
    fn forget(&mut self, wiring: &Wiring) {
        let bias = wiring.units.len();
        self.layout = Layout::new(wiring.sensors, wiring.row);
        let Layout { bits, next, words } = self.layout;
        self.records.clear();
        self.index.fill(VACANT);
        // First the state where nothing is 1, not even the bias. It brings nothing.
        self.records.resize(words, 0);
        self.records[Layout::STAY] = NEVER;
        self.never_left(0);
        for unit in wiring.sensors..bias {
            self.records[next + unit / 64] |= u64::from(wiring.units[unit].threshold < 0.0) << (unit % 64);
        }
        self.records[next + bias / 64] |= 1 << (bias % 64);
        // Then the one where the bias is.
        self.present = self.begin_record(0);
        self.records[self.present + bits + bias / 64] = 1 << (bias % 64);
        let place = self.place_of(self.present);
        self.meet(wiring, self.present, 0, place);
    }

    /// Appends a record like the one at `near`; says where it begins.
    fn begin_record(&mut self, near: usize) -> usize {
        let new = self.records.len();
        self.records.extend_from_within(near..near + self.layout.words);
        self.never_left(new);
        new
    }

    /// Notes that the state at `record` was never left.
    fn never_left(&mut self, record: usize) {
        for place in Layout::LEFT_WITH {
            self.records[record + place] = NEVER;
        }
    }

    /// Goes on to a state that did not come after the present one the last time.
    #[inline(never)]
    fn look_up(&mut self, wiring: &Wiring, fired: u64) {
        // The next state, written where it would be remembered.
        let old = self.present;
        let new = self.begin_record(old);
        let Layout { bits, next, words } = self.layout;
        self.records.copy_within(old + next..old + words, new + bits);
        self.records[new + bits] |= fired;
        let place = self.place_of(new);
        if self.index[place] == VACANT && new >= STATES * words {
            return self.forget_all_but(wiring, new);
        }
        let after = match self.index[place] {
            VACANT => {
                self.meet(wiring, new, old, place);
                new
            }
            known => {
                self.records.truncate(new);
                usize::from(known) * words
            }
        };
        for ([last, before], now) in [(Layout::LEFT_WITH, fired), (Layout::LEFT_FOR, after as u64)] {
            self.records[old + before] = std::mem::replace(&mut self.records[old + last], now);
        }
        self.present = after;
    }

    /// Forgets every state but the first two and goes on to the one at `new`.
    fn forget_all_but(&mut self, wiring: &Wiring, new: usize) {
        let Layout { bits, next, words } = self.layout;
        self.index.fill(VACANT);
        let rest = self.place_of(words);
        self.index[rest] = 1;
        self.never_left(words);
        self.records.copy_within(new + bits..new + next, 2 * words + bits);
        self.records.copy_within(..bits, 2 * words);
        self.records.copy_within(next..words, 2 * words + next);
        self.records.truncate(3 * words);
        self.present = 2 * words;
        let place = self.place_of(self.present);
        self.meet(wiring, self.present, 0, place);
    }

    /// Completes the record at `new`, in which the state's bits are written, with all that follows from them, and enters
    /// it at `place` of the index. What else is written there is copied from the state at `near`, and still true of units
    /// that see nothing new.
    fn meet(&mut self, wiring: &Wiring, new: usize, near: usize, place: usize) {
        let Layout { bits, next, words } = self.layout;
        self.index[place] = (new / words) as u8;
        let (before, record) = self.records.split_at_mut(new);
        let (head, after) = record.split_at_mut(next);
        let (head, present) = head.split_at_mut(bits);
        let before = &before[near + bits..near + next];
        for (column, after) in after.iter_mut().enumerate() {
            // The units that see something new, of these 64.
            let mut touched = 0;
            for (word, (before, present)) in before.iter().zip(&*present).enumerate() {
                for bit in ones(before ^ present) {
                    let row = 2 * (64 * word + bit) * wiring.row + column;
                    touched |= wiring.targets[row];
                    *after ^= wiring.targets[row + wiring.row];
                }
            }
            for bit in ones(touched) {
                let number = 64 * column + bit;
                let unit = &wiring.units[number];
                let sum = wiring.sum(unit, present);
                let is_sensor = number < wiring.sensors;
                head[select_unpredictable(is_sensor, Layout::REST + number, Layout::WASTE)] = sum.to_bits();
                *after = *after & !(1 << bit) | u64::from(sum > unit.threshold) << bit;
            }
        }
        let of_sensors = of_sensors(wiring.sensors);
        after[0] &= !of_sensors;
        let is_still = present[0] & !of_sensors == after[0] && present[1..] == after[1..];
        head[Layout::STAY] = if is_still { present[0] & of_sensors } else { NEVER };
    }

    /// Where in the index the state at `record` stands, or where it would.
    fn place_of(&self, record: usize) -> usize {
        let Layout { bits, next, words } = self.layout;
        let own = &self.records[record + bits..record + next];
        let hash = own.iter().fold(0, |hash: u64, word| (hash ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut place = (hash >> 55) as usize;
        loop {
            let state = usize::from(self.index[place]);
            let is_other = || {
                let other = &self.records[state * words + bits..];
                own.iter().zip(other).any(|(own, other)| own != other)
            };
            if self.index[place] == VACANT || !is_other() {
                return place;
            }
            place = (place + 1) % PLACES;
        }
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
        assert_eq!(network.rest().next(), Some([weights[2], 0.0, 0.0, 0.0]));
        assert_eq!((network.watched(), network.stay()), (0, 0));
    }
}
