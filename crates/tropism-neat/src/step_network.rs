//! Networks of step neurons, run as finite automata: the decisions of [`Network`](crate::Network), much faster.
//!
//! The activation of a step neuron is 0 or 1, so a network of them has finitely many states. An episode visits few: some
//! dozens, however large the network. In a given state, the weighted sum of the links from neurons and bias, the
//! *internal input*, is constant for each neuron. It is computed when the state first occurs, and cached.
//!
//! A step then needs a few products and a comparison for each *input unit*, which is a neuron with a link from an input.
//! The *pattern* of the input units that fire selects the transition from the present state to the next.
//!
//! Decisions equal those of [`Network`](crate::Network) bit for bit. Both sum the links from inputs and all other links
//! separately, each in a fixed order, and then add the two sums.

use std::cell::RefCell;
use std::hint::select_unpredictable;

use crate::activation::Activation;
use crate::genome::Genome;

/// Largest number of cached states; a network with more starts the cache afresh. State numbers have 8 bits.
const MAX_STATES: usize = 250;

/// Slots in the hash index of states: twice as many as states, so that look-ups are short.
const INDEX_SLOTS: usize = 512;

/// An empty slot of the index.
const EMPTY: u8 = u8::MAX;

/// Internal inputs of input units are stored in blocks of this many, which are copied at once.
const BLOCK: usize = 4;

/// A pattern that never occurs, since there are fewer than 64 input units.
const NO_PATTERN: u64 = u64::MAX;

/// A network with one output in which every neuron is an [`Activation::UnsignedStep`].
///
/// ```
/// use tropism_neat::{Config, Network, StepNetwork, random_genome};
/// let genome = random_genome(&Config::wahby2016(), 2, 1, 42, 0);
/// let mut network = Network::new(&genome);
/// let mut fast = StepNetwork::<2>::new(&genome).unwrap();
/// assert_eq!(fast.activate([0.3, 4.0]), network.activate(&[0.3, 4.0])[0] > 0.5);
/// ```
///
/// [`activate`](Self::activate) makes one step. To step many networks at once, compute in vectors which of their
/// [`input_units`](Self::input_units) [fire](LinearThreshold::fires), and call [`advance`](Self::advance) only on networks
/// whose pattern, masked by [`transition_mask`](Self::transition_mask), differs from
/// [`self_transition`](Self::self_transition).
#[derive(Clone, Debug)]
pub struct StepNetwork<const INPUTS: usize> {
    cache: StateCache,
    wiring: Wiring,
    input_units: Vec<LinearThreshold<INPUTS>>,
}

/// A linear threshold unit: it fires if the weighted sum of its inputs exceeds a threshold.
///
/// In a [`StepNetwork`] these are the units with a link from an input, and the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearThreshold<const INPUTS: usize> {
    /// Weights of the inputs.
    pub weights: [f64; INPUTS],
    /// Value that the sum must exceed.
    pub threshold: f64,
}

/// The links between units, without those from inputs.
///
/// Units are numbered: the output, the other input units, the remaining neurons, and the bias as a unit that is always 1.
/// Sets of units are rows of bits.
#[derive(Clone, Debug, Default)]
struct Wiring {
    /// All units but the bias.
    units: Vec<Unit>,
    /// The third and further links into units that have so many.
    further_links: Vec<FurtherLink>,
    /// Two rows for each unit and the bias. The first holds the targets whose sum is recomputed when this unit changes. The
    /// second holds the targets without any other source, which simply take its value.
    targets: Vec<u64>,
    /// The units with a link to any unit.
    has_targets: Vec<u64>,
    /// Words in a row.
    row: usize,
    /// Number of input units.
    input_units: usize,
}

/// A neuron. Numbers are short, so that two units fit in a cache line.
#[derive(Clone, Copy, Debug)]
struct Unit {
    threshold: f64,
    /// Weights of the first two links into the unit, in the order of the genes.
    weights: [f64; 2],
    /// Sources of these links.
    from: [u16; 2],
    /// Index of the third link, or [`NONE`].
    further: u16,
    /// Number of links into the unit if there are at most two; otherwise 2 plus the index of the last one.
    last: u16,
}

/// The third or a further link into a unit, in a linked list.
#[derive(Clone, Copy, Debug)]
struct FurtherLink {
    weight: f64,
    from: u16,
    /// Index of the next link into the same unit, or [`NONE`].
    next: u16,
}

const UNLINKED: Unit = Unit { threshold: 0.0, weights: [0.0; 2], from: [0; 2], further: NONE, last: 0 };

/// No further link.
const NONE: u16 = u16::MAX;

/// Largest number of neurons, and of links, that 16-bit numbers distinguish.
const MAX_SIZE: usize = 65_000;

/// The states that have occurred, and their transitions.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct StateCache {
    /// One record for each state. The first is a state that no network is in: even the bias is 0 there.
    records: Vec<u64>,
    /// Start of the present state's record.
    present: usize,
    layout: RecordLayout,
    /// Numbers of states, by a hash of their bits.
    index: [u8; INDEX_SLOTS],
}

/// Offsets in a record. What every step needs comes first.
#[derive(Clone, Copy, Debug, Default)]
struct RecordLayout {
    /// The state: one bit for each unit. It follows the internal inputs of the input units, which are `f64`.
    state: usize,
    /// The next state, as far as it is determined: one bit for each unit that is no input unit.
    next_state: usize,
    /// Length of a record.
    words: usize,
}

impl RecordLayout {
    /// The pattern that leads from this state to itself.
    const SELF_TRANSITION: usize = 0;
    /// The two latest patterns that led to another state.
    const PATTERNS: [usize; 2] = [1, 2];
    /// Starts of the records of the states that they led to.
    const SUCCESSORS: [usize; 2] = [3, 4];
    /// Never read: receives the internal inputs of units that are no input units.
    const SCRATCH: usize = 5;
    /// Internal inputs of the input units.
    const INTERNAL_INPUTS: usize = 6;

    const fn new(input_units: usize, row: usize) -> Self {
        let state = Self::INTERNAL_INPUTS + input_units.next_multiple_of(BLOCK);
        Self { state, next_state: state + row, words: state + 2 * row }
    }
}

impl<const INPUTS: usize> LinearThreshold<INPUTS> {
    /// Whether the unit fires, given its inputs and its internal input: the weighted sum of all other links into it.
    #[inline]
    #[must_use]
    pub fn fires(&self, inputs: [f64; INPUTS], internal_input: f64) -> bool {
        let sum = self.weights.iter().zip(inputs).fold(0.0, |sum, (weight, input)| sum + input * weight);
        sum + internal_input > self.threshold
    }
}

impl<const INPUTS: usize> Default for StepNetwork<INPUTS> {
    /// A network of one unlinked output.
    fn default() -> Self {
        let cache = StateCache {
            records: Vec::new(),
            present: 0,
            layout: RecordLayout::default(),
            index: [EMPTY; INDEX_SLOTS],
        };
        let mut network = Self { cache, wiring: Wiring::default(), input_units: Vec::new() };
        network.input_units.push(LinearThreshold { weights: [0.0; INPUTS], threshold: 0.5 });
        network.wiring.reset(1, 1);
        network.cache.reset(&network.wiring);
        network
    }
}

impl<const INPUTS: usize> StepNetwork<INPUTS> {
    /// Builds the network of `genome`, with all activations 0.
    ///
    /// `None` if the genome has not `INPUTS` inputs and one output, a neuron that is no unsigned step, more than 63 input
    /// units, or more than 65 000 neurons or links.
    #[must_use]
    pub fn new(genome: &Genome) -> Option<Self> {
        let mut network = Self::default();
        network.assign(genome).then_some(network)
    }

    /// Becomes the network of `genome`, with all activations 0, and reuses its allocations.
    ///
    /// Returns `false` where [`new`](Self::new) returns `None`. The network must then not be run before another genome is
    /// assigned.
    #[must_use]
    pub fn assign(&mut self, genome: &Genome) -> bool {
        let has_shape = genome.inputs() == INPUTS && genome.outputs() == 1;
        let is_built = has_shape && UNIT_NUMBERS.with_borrow_mut(|numbers| self.build(genome, numbers));
        if is_built {
            self.cache.reset(&self.wiring);
        }
        is_built
    }

    /// Numbers the units and links them; `false` if the network cannot be represented.
    fn build(&mut self, genome: &Genome, numbers: &mut UnitNumbers) -> bool {
        let neurons = &genome.neurons()[INPUTS + 1..];
        if neurons.len() > MAX_SIZE || genome.links().len() > MAX_SIZE {
            return false;
        }
        if neurons.iter().any(|neuron| neuron.activation != Activation::UnsignedStep) {
            return false;
        }
        let is_input = |id: u32| id <= INPUTS as u32;
        numbers.reset(genome);
        self.input_units.clear();
        let with_input = genome.links().iter().filter(|link| is_input(link.from)).map(|link| link.to);
        for id in std::iter::once(neurons[0].id).chain(with_input) {
            if numbers.get(genome, id) == UNNUMBERED {
                if self.input_units.len() == 63 {
                    return false;
                }
                numbers.set(genome, id, self.input_units.len() as u32);
                self.input_units.push(LinearThreshold { weights: [0.0; INPUTS], threshold: 0.0 });
            }
        }
        self.wiring.reset(neurons.len(), self.input_units.len());
        let mut next = self.input_units.len() as u32;
        for neuron in neurons {
            let mut number = numbers.get(genome, neuron.id);
            if number == UNNUMBERED {
                number = next;
                numbers.set(genome, neuron.id, number);
                next += 1;
            }
            let threshold = 0.5 + neuron.b;
            self.wiring.units[number as usize].threshold = threshold;
            if let Some(unit) = self.input_units.get_mut(number as usize) {
                unit.threshold = threshold;
            }
        }
        numbers.set(genome, INPUTS as u32 + 1, neurons.len() as u32);
        for link in genome.links() {
            let to = numbers.get(genome, link.to);
            if is_input(link.from) {
                self.input_units[to as usize].weights[link.from as usize - 1] = link.weight;
            } else {
                self.wiring.link(numbers.get(genome, link.from), to, link.weight);
            }
        }
        true
    }

    /// Sets every activation to 0, as in a new network.
    pub fn flush(&mut self) {
        // The second record: its state has only the bias at 1.
        self.cache.present = self.cache.layout.words;
    }

    /// The input units: the units with a link from an input. The output comes first, with or without such a link.
    #[inline]
    #[must_use]
    pub fn input_units(&self) -> &[LinearThreshold<INPUTS>] {
        &self.input_units
    }

    /// Internal input of each input unit in the present state, in blocks of four; the last block is padded with zeros.
    #[inline]
    pub fn internal_inputs(&self) -> impl ExactSizeIterator<Item = [f64; BLOCK]> {
        let StateCache { records, present, layout, .. } = &self.cache;
        let (blocks, _) =
            records[present + RecordLayout::INTERNAL_INPUTS..present + layout.state].as_chunks();
        blocks.iter().map(|block| block.map(f64::from_bits))
    }

    /// The input units that influence the next state, one bit each: those with a link to any unit.
    #[inline]
    #[must_use]
    pub fn transition_mask(&self) -> u64 {
        self.wiring.has_targets[0] & low_bits(self.input_units.len())
    }

    /// The pattern, masked by [`transition_mask`](Self::transition_mask), that leads from the present state to itself.
    #[inline]
    #[must_use]
    pub fn self_transition(&self) -> u64 {
        self.cache.records[self.cache.present + RecordLayout::SELF_TRANSITION]
    }

    /// Advances to the next state. `pattern` has a bit for each input unit that fires in the present state, masked by
    /// [`transition_mask`](Self::transition_mask).
    #[inline]
    pub fn advance(&mut self, pattern: u64) {
        if let [self_transition, latest, earlier, to_latest, to_earlier, ..] =
            self.cache.records[self.cache.present..]
        {
            if (pattern == latest) | (pattern == earlier) {
                let successor = select_unpredictable(pattern == latest, to_latest, to_earlier);
                self.cache.present = successor as usize;
            } else if pattern != self_transition {
                self.cache.look_up(&self.wiring, pattern);
            }
        }
    }

    /// Makes one synchronous step and returns whether the output is 1.
    #[inline]
    pub fn activate(&mut self, inputs: [f64; INPUTS]) -> bool {
        let units = self.input_units.iter().zip(self.internal_inputs().flatten()).enumerate();
        let pattern = units.fold(0, |pattern, (number, (unit, internal_input))| {
            pattern | u64::from(unit.fires(inputs, internal_input)) << number
        });
        self.advance(pattern & self.transition_mask());
        pattern & 1 == 1
    }
}

/// A word whose lowest `count` bits are 1.
const fn low_bits(count: usize) -> u64 {
    (1 << count) - 1
}

impl Wiring {
    /// Starts with this many units, without links.
    fn reset(&mut self, units: usize, input_units: usize) {
        self.input_units = input_units;
        self.row = units / 64 + 1;
        self.units.clear();
        self.units.resize(units, UNLINKED);
        self.further_links.clear();
        self.targets.clear();
        self.targets.resize(2 * (units + 1) * self.row, 0);
        self.has_targets.clear();
        self.has_targets.resize(self.row, 0);
    }

    /// Adds a link from a unit or the bias to a unit.
    #[inline]
    fn link(&mut self, from: u32, to: u32, weight: f64) {
        let target = to as usize;
        self.has_targets[from as usize / 64] |= 1 << (from % 64);
        let (unit, from) = (&mut self.units[target], from as u16);
        let own = usize::from(unit.last);
        let row = |from: u16| 2 * usize::from(from) * self.row + target / 64;
        // Whether the unit has been, or may become, one that simply takes the value of its only source.
        let follows = target >= self.input_units && unit.threshold >= 0.0 && own < 2;
        if follows && own == 0 {
            self.targets[row(from) + self.row] |= u64::from(weight > unit.threshold) << (target % 64);
        } else {
            if follows {
                self.targets[row(unit.from[0]) + self.row] &= !(1 << (target % 64));
                self.targets[row(unit.from[0])] |= 1 << (target % 64);
            }
            self.targets[row(from)] |= 1 << (target % 64);
        }
        if own < 2 {
            (unit.weights[own], unit.from[own]) = (weight, from);
            unit.last += 1;
            return;
        }
        let number = self.further_links.len() as u16;
        match unit.further {
            NONE => unit.further = number,
            _ => self.further_links[own - 2].next = number,
        }
        unit.last = number + 2;
        self.further_links.push(FurtherLink { weight, from, next: NONE });
    }

    /// Weighted sum of all links into a unit in the given state.
    #[inline]
    fn sum(&self, unit: &Unit, state: &[u64]) -> f64 {
        // A branch would be mispredicted half of the time.
        let term = |from: u16, weight: f64| {
            let is_one = state[usize::from(from / 64)] >> (from % 64) & 1 == 1;
            f64::from_bits(select_unpredictable(is_one, weight.to_bits(), 0))
        };
        let mut sum = 0.0 + term(unit.from[0], unit.weights[0]) + term(unit.from[1], unit.weights[1]);
        let mut next = unit.further;
        while next != NONE {
            let link = self.further_links[usize::from(next)];
            sum += term(link.from, link.weight);
            next = link.next;
        }
        sum
    }
}

impl StateCache {
    /// Discards all states and starts with all activations 0.
    fn reset(&mut self, wiring: &Wiring) {
        let bias = wiring.units.len();
        self.layout = RecordLayout::new(wiring.input_units, wiring.row);
        let RecordLayout { state, next_state, words } = self.layout;
        self.records.clear();
        self.index.fill(EMPTY);
        // The first record: all units and the bias are 0, so all sums are 0.
        self.records.resize(words, 0);
        self.records[RecordLayout::SELF_TRANSITION] = NO_PATTERN;
        self.clear_transitions(0);
        for unit in wiring.input_units..bias {
            self.records[next_state + unit / 64] |=
                u64::from(wiring.units[unit].threshold < 0.0) << (unit % 64);
        }
        self.records[next_state + bias / 64] |= 1 << (bias % 64);
        // The second record: only the bias is 1.
        self.present = self.append_copy(0);
        self.records[self.present + state + bias / 64] = 1 << (bias % 64);
        let slot = self.find_slot(self.present);
        self.complete(wiring, self.present, 0, slot);
    }

    /// Appends a copy of the record at `original`, without its transitions; returns the start of the copy.
    fn append_copy(&mut self, original: usize) -> usize {
        let new = self.records.len();
        self.records.extend_from_within(original..original + self.layout.words);
        self.clear_transitions(new);
        new
    }

    /// Clears the cached transitions of a record.
    fn clear_transitions(&mut self, record: usize) {
        for offset in RecordLayout::PATTERNS {
            self.records[record + offset] = NO_PATTERN;
        }
    }

    /// Advances to a state that is not among the latest successors of the present one.
    #[inline(never)]
    fn look_up(&mut self, wiring: &Wiring, pattern: u64) {
        // The next state is written where its record would be.
        let old = self.present;
        let new = self.append_copy(old);
        let RecordLayout { state, next_state, words } = self.layout;
        self.records.copy_within(old + next_state..old + words, new + state);
        self.records[new + state] |= pattern;
        let slot = self.find_slot(new);
        if self.index[slot] == EMPTY && new >= MAX_STATES * words {
            return self.restart_with(wiring, new);
        }
        let successor = match self.index[slot] {
            EMPTY => {
                self.complete(wiring, new, old, slot);
                new
            }
            known => {
                self.records.truncate(new);
                usize::from(known) * words
            }
        };
        for ([latest, earlier], value) in
            [(RecordLayout::PATTERNS, pattern), (RecordLayout::SUCCESSORS, successor as u64)]
        {
            self.records[old + earlier] = std::mem::replace(&mut self.records[old + latest], value);
        }
        self.present = successor;
    }

    /// Discards all states but the first two, and advances to the one written at `new`.
    fn restart_with(&mut self, wiring: &Wiring, new: usize) {
        let RecordLayout { state, next_state, words } = self.layout;
        self.index.fill(EMPTY);
        let second = self.find_slot(words);
        self.index[second] = 1;
        self.clear_transitions(words);
        self.records.copy_within(new + state..new + next_state, 2 * words + state);
        self.records.copy_within(..state, 2 * words);
        self.records.copy_within(next_state..words, 2 * words + next_state);
        self.records.truncate(3 * words);
        self.present = 2 * words;
        let slot = self.find_slot(self.present);
        self.complete(wiring, self.present, 0, slot);
    }

    /// Completes the record at `new`, whose state is written, and enters it into `slot` of the index.
    ///
    /// The rest of the record is a copy of that at `similar`. Only units with a source that differs between the two states
    /// are recomputed.
    fn complete(&mut self, wiring: &Wiring, new: usize, similar: usize, slot: usize) {
        let RecordLayout { state, next_state, words } = self.layout;
        self.index[slot] = (new / words) as u8;
        let (before, record) = self.records.split_at_mut(new);
        let (head, after) = record.split_at_mut(next_state);
        let (head, present) = head.split_at_mut(state);
        let before = &before[similar + state..similar + next_state];
        for (column, after) in after.iter_mut().enumerate() {
            // Units to recompute, among the 64 of this column.
            let mut affected = 0;
            for (word, (before, present)) in before.iter().zip(&*present).enumerate() {
                for bit in set_bits(before ^ present) {
                    let row = 2 * (64 * word + bit) * wiring.row + column;
                    affected |= wiring.targets[row];
                    *after ^= wiring.targets[row + wiring.row];
                }
            }
            for bit in set_bits(affected) {
                let number = 64 * column + bit;
                let unit = &wiring.units[number];
                let sum = wiring.sum(unit, present);
                let is_input_unit = number < wiring.input_units;
                head[select_unpredictable(
                    is_input_unit,
                    RecordLayout::INTERNAL_INPUTS + number,
                    RecordLayout::SCRATCH,
                )] = sum.to_bits();
                *after = *after & !(1 << bit) | u64::from(sum > unit.threshold) << bit;
            }
        }
        let input_units = low_bits(wiring.input_units);
        after[0] &= !input_units;
        let is_fixed = present[0] & !input_units == after[0] && present[1..] == after[1..];
        head[RecordLayout::SELF_TRANSITION] = if is_fixed { present[0] & input_units } else { NO_PATTERN };
    }

    /// The slot of the index that holds the state of this record, or the empty slot where it belongs.
    fn find_slot(&self, record: usize) -> usize {
        let RecordLayout { state, next_state, words } = self.layout;
        let own = &self.records[record + state..record + next_state];
        // The multiplier is 2^64 divided by the golden ratio (Knuth, The Art of Computer Programming 3, section 6.4).
        let hash = own.iter().fold(0, |hash: u64, word| (hash ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut slot = (hash >> 55) as usize;
        loop {
            let number = usize::from(self.index[slot]);
            let is_other = || {
                let other = &self.records[number * words + state..];
                own.iter().zip(other).any(|(own, other)| own != other)
            };
            if self.index[slot] == EMPTY || !is_other() {
                return slot;
            }
            slot = (slot + 1) % INDEX_SLOTS;
        }
    }
}

/// Positions of the bits of a word that are 1.
fn set_bits(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let position = word.trailing_zeros();
        word &= word.wrapping_sub(1);
        (position < 64).then_some(position as usize)
    })
}

/// A neuron without a unit number.
const UNNUMBERED: u32 = u32::MAX;

/// Neuron ids below this are looked up in a table.
const TABLE_SIZE: usize = 1 << 16;

/// Unit numbers of the neurons of a genome.
#[derive(Default)]
struct UnitNumbers {
    /// By id, for ids below [`TABLE_SIZE`]. Entries of ids that are not in the genome are stale.
    table: Vec<u32>,
    /// By index in the genome, for all others.
    by_position: Vec<u32>,
}

thread_local! {
    /// Reused for every genome: to allocate the table costs more than to use it.
    static UNIT_NUMBERS: RefCell<UnitNumbers> = RefCell::default();
}

impl UnitNumbers {
    /// Removes the numbers of all neurons of `genome`.
    fn reset(&mut self, genome: &Genome) {
        let neurons = genome.neurons();
        let size = neurons.last().map_or(0, |neuron| neuron.id as usize + 1);
        if self.table.len() < size.min(TABLE_SIZE) {
            self.table.resize(size.min(TABLE_SIZE), UNNUMBERED);
        }
        for neuron in neurons {
            if let Some(number) = self.table.get_mut(neuron.id as usize) {
                *number = UNNUMBERED;
            }
        }
        self.by_position.clear();
        if size > TABLE_SIZE {
            self.by_position.resize(neurons.len(), UNNUMBERED);
        }
    }

    #[inline]
    fn get(&self, genome: &Genome, id: u32) -> u32 {
        match self.table.get(id as usize) {
            Some(&number) => number,
            None => self.by_position[position(genome, id)],
        }
    }

    fn set(&mut self, genome: &Genome, id: u32, number: u32) {
        match self.table.get_mut(id as usize) {
            Some(entry) => *entry = number,
            None => self.by_position[position(genome, id)] = number,
        }
    }
}

#[cold]
fn position(genome: &Genome, id: u32) -> usize {
    genome.position(id).expect("a genome's links join its own neurons")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Config, Neat, Network};

    /// A path in the plane, with jumps: the inputs at each step.
    fn path(step: u32) -> [f64; 2] {
        let turn = f64::from(step) * 0.37;
        [8.0 * libm::sin(turn) + libm::sin(5.1 * turn), 4.0 + 0.03 * f64::from(step) + libm::cos(turn)]
    }

    #[test]
    fn decisions_equal_those_of_a_network_for_genomes_of_all_sizes() {
        let mut compared = 0;
        let mut largest = 0;
        for seed in 0..6 {
            let config =
                Config { mutate_add_neuron_prob: 0.3, mutate_add_link_prob: 0.3, ..Config::wahby2016() };
            let mut neat = Neat::new(config, 2, 1, seed).unwrap();
            for generation in 0..120_u32 {
                for genome in neat.ask().iter().step_by(5) {
                    let mut network = Network::new(genome);
                    let mut fast = StepNetwork::<2>::new(genome).unwrap();
                    for step in 0..60 {
                        let inputs = path(step + generation);
                        assert_eq!(fast.activate(inputs), network.activate(&inputs)[0] > 0.5, "{genome:?}");
                    }
                    fast.flush();
                    network.flush();
                    assert_eq!(fast.activate([1.0, 5.0]), network.activate(&[1.0, 5.0])[0] > 0.5);
                    compared += 1;
                    largest = largest.max(genome.links().len());
                }
                // Large genomes are fit, so that genomes grow.
                let scores: Vec<f64> = neat.ask().iter().map(|genome| genome.links().len() as f64).collect();
                neat.tell(&scores).unwrap();
            }
        }
        assert!(compared > 5000 && largest > 60, "{compared} genomes of up to {largest} links");
    }

    #[test]
    fn decisions_stay_right_with_more_states_than_fit_in_the_cache() {
        // A shift register: its state is the input of the last 20 steps.
        let hidden: Vec<_> = (5..25).map(|id| (id, 0.5)).collect();
        let links: Vec<_> = (5..25).map(|id| (if id == 5 { 1 } else { id - 1 }, id, 1.0)).collect();
        let mut register = crate::testing::genome(2, 1, &hidden, &[&links[..], &[(24, 4, 1.0)]].concat());
        for neuron in &mut register.neurons {
            neuron.activation = Activation::UnsignedStep;
        }
        let (mut network, mut fast) = (Network::new(&register), StepNetwork::<2>::new(&register).unwrap());
        for episode in 0..3_u32 {
            for step in 0..2000_u32 {
                let noise = (step ^ episode << 20).wrapping_mul(0x9e37_79b9) >> 15 & 1;
                let inputs = [f64::from(noise), 0.0];
                assert_eq!(fast.activate(inputs), network.activate(&inputs)[0] > 0.5, "step {step}");
            }
            fast.flush();
            network.flush();
        }
    }

    #[test]
    fn neuron_ids_above_the_table_are_found() {
        let high = 1 << 30;
        let mut large_id =
            crate::testing::genome(2, 1, &[(high, 0.5)], &[(1, high, 1.0), (high, 4, 1.0), (3, 4, 0.3)]);
        large_id.neurons.iter_mut().for_each(|neuron| neuron.activation = Activation::UnsignedStep);
        let mut fast = StepNetwork::<2>::new(&large_id).unwrap();
        assert_eq!([1.0, 0.0, 0.0].map(|x| fast.activate([x, 0.0])), [false, true, false]);
    }

    #[test]
    fn genomes_of_another_shape_or_activation_function_are_refused() {
        let three_inputs = crate::random_genome(&Config::wahby2016(), 3, 1, 1, 0);
        assert!(StepNetwork::<2>::new(&three_inputs).is_none());
        let sigmoid = Config { output_activation: Activation::UnsignedSigmoid, ..Config::wahby2016() };
        assert!(StepNetwork::<2>::new(&crate::random_genome(&sigmoid, 2, 1, 1, 0)).is_none());
    }

    #[test]
    fn a_minimal_genome_has_one_input_unit_and_one_state() {
        let genome = crate::random_genome(&Config::wahby2016(), 2, 1, 1, 7);
        let weights: Vec<f64> = genome.links().iter().map(|link| link.weight).collect();
        let network = StepNetwork::<2>::new(&genome).unwrap();
        assert_eq!(
            network.input_units(),
            [LinearThreshold { weights: [weights[0], weights[1]], threshold: 0.5 }]
        );
        assert_eq!(network.internal_inputs().next(), Some([weights[2], 0.0, 0.0, 0.0]));
        assert_eq!((network.transition_mask(), network.self_transition()), (0, 0));
    }
}
