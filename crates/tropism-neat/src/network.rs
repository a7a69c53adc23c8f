//! Networks: the phenotypes of genomes.
//!
//! In a synchronous step every link reads the activation that its source had before the step. A path through h hidden
//! neurons delays a signal by h steps, and recurrent links need no special treatment. The state persists until it is
//! flushed.
//!
//! Links from inputs are summed separately from all other links. [`StepNetwork`](crate::StepNetwork) stores the second sum
//! and does the same, so that both give equal bits.

use std::ops::Range;

use crate::activation::Activation;
use crate::genome::Genome;
use crate::topology::topological_order;

/// A network that can be run.
///
/// | call | suits | one call |
/// |---|---|---|
/// | [`run`](Self::run) | any network | a pass if the network [is feed-forward](Self::is_feed_forward), else a step |
/// | [`activate`](Self::activate) | recurrent networks | one synchronous step: the outputs lag behind the inputs |
/// | [`activate_feed_forward`](Self::activate_feed_forward) | networks of [`Config::feed_forward`](crate::Config::feed_forward) | one pass in order of depth |
///
/// ```
/// use tropism_neat::{Config, Network, random_genome};
/// let genome = random_genome(&Config::multineat(), 2, 1, 42, 0);
/// let mut network = Network::new(&genome);
/// assert!(network.is_feed_forward());
/// let output = network.run(&[0.0, 4.0])[0];
/// assert!((0.0..=1.0).contains(&output));
/// ```
#[derive(Clone, Debug)]
pub struct Network {
    inputs: usize,
    outputs: usize,
    is_feed_forward: bool,
    /// Outputs and hidden neurons: in topological order if the network is feed-forward, else in order of depth.
    units: Vec<Unit>,
    /// Links, grouped by the unit that they enter.
    connections: Vec<Connection>,
    state: Vec<f64>,
    previous: Vec<f64>,
}

/// An output or a hidden neuron.
#[derive(Clone, Debug)]
struct Unit {
    /// Index of the neuron in the genome and in the state.
    index: usize,
    /// Connections from inputs, in the order of the inputs.
    from_inputs: Range<usize>,
    /// All other connections, in the order of the link genes.
    from_others: Range<usize>,
    activation: Activation,
    a: f64,
    b: f64,
}

/// A link into a unit.
#[derive(Clone, Copy, Debug)]
struct Connection {
    /// Index of the source neuron.
    from: usize,
    weight: f64,
    /// Whether the link leads to greater depth.
    is_forward: bool,
}

impl Network {
    /// Builds the network of `genome`, with all activations 0.
    #[must_use]
    pub fn new(genome: &Genome) -> Self {
        let neurons = genome.neurons();
        let position = |id| genome.position(id).expect("a genome's links join its own neurons");
        let ends: Vec<_> =
            genome.links().iter().map(|link| (position(link.from), position(link.to))).collect();
        let mut incoming = vec![0; neurons.len()];
        for &(_, to) in &ends {
            incoming[to] += 1;
        }
        let inputs = genome.inputs();
        let is_forward = |&(from, to): &(usize, usize)| neurons[from].depth < neurons[to].depth;
        let is_ordered_by_depth = ends.iter().all(is_forward);
        let topological =
            if is_ordered_by_depth { None } else { topological_order(&ends, inputs + 1, neurons.len()) };
        let is_feed_forward = is_ordered_by_depth || topological.is_some();
        let order = topological.unwrap_or_else(|| {
            let mut order: Vec<usize> = (inputs + 1..neurons.len()).collect();
            order.sort_by(|&a, &b| neurons[a].depth.total_cmp(&neurons[b].depth));
            order
        });
        // Index of the next connection into each neuron.
        let (mut next, mut end) = (incoming.clone(), 0);
        let unit = |index: usize| {
            let start = end;
            end += incoming[index];
            next[index] = start;
            let neuron = &neurons[index];
            Unit {
                index,
                from_inputs: start..start,
                from_others: start..end,
                activation: neuron.activation,
                a: neuron.a,
                b: neuron.b,
            }
        };
        let mut units: Vec<Unit> = order.into_iter().map(unit).collect();
        let mut connections = vec![Connection { from: 0, weight: 0.0, is_forward: false }; ends.len()];
        for (link, ends) in genome.links().iter().zip(&ends) {
            let &(from, to) = ends;
            connections[next[to]] = Connection { from, weight: link.weight, is_forward: is_forward(ends) };
            next[to] += 1;
        }
        // Within a unit, connections from inputs come first in the order of the inputs, then the others in that of the genes.
        for unit in &mut units {
            let own = &mut connections[unit.from_others.clone()];
            own.sort_by_key(|connection| connection.from.min(inputs));
            let middle = unit.from_others.start + own.partition_point(|connection| connection.from < inputs);
            unit.from_inputs = unit.from_others.start..middle;
            unit.from_others.start = middle;
        }
        let state = vec![0.0; neurons.len()];
        Self {
            inputs,
            outputs: genome.outputs(),
            is_feed_forward,
            units,
            connections,
            previous: state.clone(),
            state,
        }
    }

    /// Whether the network is feed-forward: whether its links form no cycle. See [`Genome::is_feed_forward`].
    #[must_use]
    pub fn is_feed_forward(&self) -> bool {
        self.is_feed_forward
    }

    /// Runs the network once on `inputs` in the way that suits it, and returns the outputs.
    ///
    /// In a feed-forward network the signal passes through all neurons, and the outputs depend on `inputs` alone. Any other
    /// network advances by one synchronous step, as in [`activate`](Self::activate).
    ///
    /// # Panics
    ///
    /// If the number of values differs from the number of inputs.
    pub fn run(&mut self, inputs: &[f64]) -> &[f64] {
        if self.is_feed_forward { self.pass(inputs, |_| true) } else { self.activate(inputs) }
    }

    /// Advances the network by one synchronous step and returns the outputs.
    ///
    /// Sets the inputs, and the bias to 1. Every other neuron then reads the activations before the step.
    ///
    /// # Panics
    ///
    /// If the number of values differs from the number of inputs.
    pub fn activate(&mut self, inputs: &[f64]) -> &[f64] {
        self.set_inputs(inputs);
        for unit in &self.units {
            let weighted_sum = |range: &Range<usize>| {
                self.connections[range.clone()]
                    .iter()
                    .fold(0.0, |sum, c| sum + self.previous[c.from] * c.weight)
            };
            let sum = weighted_sum(&unit.from_inputs) + weighted_sum(&unit.from_others);
            self.state[unit.index] = unit.activation.apply(sum, unit.a, unit.b);
        }
        self.output()
    }

    /// Passes the inputs through the network in order of depth and returns the outputs.
    ///
    /// A link to greater depth reads the new activation of its source, any other link the activation before the call.
    /// Networks evolved with [`Config::feed_forward`](crate::Config::feed_forward) have only links to greater depth: their
    /// outputs depend on `inputs` alone, and [`run`](Self::run) returns the same.
    ///
    /// # Panics
    ///
    /// If the number of values differs from the number of inputs.
    pub fn activate_feed_forward(&mut self, inputs: &[f64]) -> &[f64] {
        self.pass(inputs, |connection| connection.is_forward)
    }

    /// Updates the units one after the other. Connections for which `reads_new` holds read the updated activations.
    #[inline]
    fn pass(&mut self, inputs: &[f64], reads_new: impl Fn(&Connection) -> bool) -> &[f64] {
        self.set_inputs(inputs);
        for unit in &self.units {
            let weighted_sum = |range: &Range<usize>| {
                self.connections[range.clone()].iter().fold(0.0, |sum, c| {
                    let source = if reads_new(c) { &self.state } else { &self.previous };
                    sum + source[c.from] * c.weight
                })
            };
            let sum = weighted_sum(&unit.from_inputs) + weighted_sum(&unit.from_others);
            self.state[unit.index] = unit.activation.apply(sum, unit.a, unit.b);
        }
        self.output()
    }

    /// Sets the inputs and the bias, and stores the state before the step.
    fn set_inputs(&mut self, inputs: &[f64]) {
        assert_eq!(inputs.len(), self.inputs, "one value for each input");
        self.state[..self.inputs].copy_from_slice(inputs);
        self.state[self.inputs] = 1.0;
        self.previous.copy_from_slice(&self.state);
    }

    /// The present activations of the outputs.
    #[must_use]
    pub fn output(&self) -> &[f64] {
        &self.state[self.inputs + 1..][..self.outputs]
    }

    /// Sets every activation to 0, as in a new network.
    pub fn flush(&mut self) {
        self.state.fill(0.0);
    }

    /// All activations, in the order of the genome's neurons.
    #[must_use]
    pub fn state(&self) -> &[f64] {
        &self.state
    }

    /// Sets all activations to those that [`state`](Self::state) gave, so that a saved network goes on.
    ///
    /// # Panics
    /// If there are not as many activations as neurons.
    pub fn set_state(&mut self, state: &[f64]) {
        self.state.copy_from_slice(state);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::config::Config;
    use crate::testing::{self, genome};

    #[test]
    fn a_hidden_neuron_delays_a_signal_by_one_step() {
        // Input, hidden neuron and output in a row, all linear.
        let mut network = Network::new(&genome(1, 1, &[(4, 0.5)], &[(1, 4, 2.0), (4, 3, 3.0)]));
        assert_eq!(network.activate(&[1.0]), [0.0]);
        assert_eq!(network.activate(&[0.0]), [6.0]);
        assert_eq!(network.activate(&[0.0]), [0.0]);
    }

    #[test]
    fn state_is_kept_until_it_is_flushed() {
        // The output adds its input to itself.
        let mut network = Network::new(&genome(1, 1, &[], &[(1, 3, 1.0), (3, 3, 1.0)]));
        assert_eq!(network.activate(&[1.0]), [1.0]);
        assert_eq!(network.activate(&[1.0]), [2.0]);
        assert_eq!(network.state(), [1.0, 1.0, 2.0]);
        let mut resumed = network.clone();
        resumed.flush();
        resumed.set_state(network.state());
        assert_eq!(resumed.activate(&[1.0]), [3.0]);
        network.flush();
        assert_eq!(network.state(), [0.0; 3]);
        assert_eq!(network.activate(&[1.0]), [1.0]);
    }

    #[test]
    fn the_bias_is_always_one() {
        let mut network = Network::new(&genome(1, 1, &[], &[(2, 3, 0.25)]));
        assert_eq!(network.activate(&[7.0]), [0.25]);
    }

    #[test]
    fn a_feed_forward_pass_reaches_the_output_in_one_call() {
        let mut network =
            Network::new(&genome(1, 1, &[(4, 0.5), (5, 0.25)], &[(1, 5, 2.0), (5, 4, 3.0), (4, 3, 5.0)]));
        assert_eq!(network.activate_feed_forward(&[1.0]), [30.0]);
        assert_eq!(network.activate_feed_forward(&[0.0]), [0.0]);
    }

    #[test]
    fn in_a_feed_forward_pass_a_recurrent_link_reads_the_activation_before_the_call() {
        let mut network = Network::new(&genome(1, 1, &[(4, 0.5)], &[(1, 4, 1.0), (4, 3, 1.0), (3, 4, 10.0)]));
        assert_eq!(network.activate_feed_forward(&[1.0]), [1.0]);
        assert_eq!(network.activate_feed_forward(&[2.0]), [12.0]);
    }

    #[test]
    fn a_feed_forward_pass_agrees_with_as_many_steps_as_there_are_neurons() {
        let config = Config { feed_forward: true, ..testing::sigmoid_config() };
        for genome in testing::mutants(&config, 1, 200).iter().step_by(20) {
            let (mut at_once, mut stepwise) = (Network::new(genome), Network::new(genome));
            let inputs = [0.3, -1.7];
            for _ in 0..genome.neurons().len() {
                stepwise.activate(&inputs);
            }
            assert_eq!(at_once.activate_feed_forward(&inputs), stepwise.output());
        }
    }

    #[test]
    fn a_run_passes_through_links_between_equal_depths() {
        // Two hidden neurons in a row at the same depth, the second with the lower id.
        let genome = genome(1, 1, &[(4, 0.5), (5, 0.5)], &[(1, 5, 2.0), (5, 4, 3.0), (4, 3, 5.0)]);
        let mut network = Network::new(&genome);
        assert!(network.is_feed_forward());
        assert_eq!(network.run(&[1.0]), [30.0]);
        assert_eq!(network.run(&[0.0]), [0.0]);
        // By depth, the link between them counts as recurrent.
        network.flush();
        assert_eq!(network.activate_feed_forward(&[1.0]), [0.0]);
        assert_eq!(network.activate_feed_forward(&[1.0]), [30.0]);
    }

    #[test]
    fn a_run_of_a_recurrent_network_is_one_step() {
        let genome = genome(1, 1, &[(4, 0.5)], &[(1, 4, 1.0), (4, 3, 1.0), (3, 4, 10.0)]);
        let (mut run, mut stepped) = (Network::new(&genome), Network::new(&genome));
        assert!(!run.is_feed_forward());
        for step in 0..5 {
            assert_eq!(run.run(&[f64::from(step)]), stepped.activate(&[f64::from(step)]));
        }
    }

    proptest! {
        #[test]
        fn a_run_of_a_feed_forward_network_depends_on_its_inputs_alone(
            seed in 0_u64..10_000, feed_forward: bool, inputs in prop::array::uniform2(-3.0..3.0),
        ) {
            let config = Config { feed_forward, recurrent_prob: 0.02, ..testing::sigmoid_config() };
            for genome in testing::mutants(&config, seed, 60).iter().step_by(5) {
                let mut network = Network::new(genome);
                prop_assert_eq!(network.is_feed_forward(), genome.is_feed_forward());
                prop_assert!(network.is_feed_forward() || !feed_forward);
                if network.is_feed_forward() {
                    let fresh = network.run(&inputs).to_vec();
                    network.run(&[5.0, -7.0]);
                    network.activate(&[1.0, 2.0]);
                    prop_assert_eq!(network.run(&inputs), fresh);
                }
                if feed_forward {
                    let passed = network.activate_feed_forward(&inputs).to_vec();
                    prop_assert_eq!(network.run(&inputs), passed);
                }
            }
        }
    }
}
