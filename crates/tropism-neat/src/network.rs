//! The network that a genome describes, run one synchronous step at a time.
//!
//! Every link reads what its source held *before* the step, so a path through h hidden neurons delays a signal by h steps,
//! and recurrent links need no special care. The state stays until it is flushed. What a neuron's inputs bring and what
//! everything else brings are summed apart, so that a network which keeps the second sum while nothing changes
//! ([`StepNetwork`](crate::StepNetwork)) gets the same bits.

use std::ops::Range;

use crate::{Activation, Genome};

/// A network that can be run.
///
/// ```
/// use tropism_neat::{Config, Network, random_genome};
/// let genome = random_genome(&Config::paper(), 2, 1, 42, 0);
/// let mut network = Network::new(&genome);
/// let light_is_right = network.activate(&[0.0, 4.0])[0] > 0.0;
/// # let _ = light_is_right;
/// ```
#[derive(Clone, Debug)]
pub struct Network {
    inputs: usize,
    outputs: usize,
    /// Outputs and hidden neurons, in order of depth.
    units: Vec<Unit>,
    /// Links, grouped by the unit that they enter.
    wires: Vec<Wire>,
    state: Vec<f64>,
    previous: Vec<f64>,
}

/// A neuron that computes.
#[derive(Clone, Debug)]
struct Unit {
    place: usize,
    /// Links from inputs, in their order.
    sensors: Range<usize>,
    /// All other links, in the order of the genes.
    wires: Range<usize>,
    activation: Activation,
    a: f64,
    b: f64,
}

/// A link into a unit.
#[derive(Clone, Copy, Debug)]
struct Wire {
    from: usize,
    weight: f64,
    /// Whether it leads to greater depth.
    is_forward: bool,
}

impl Network {
    /// The network of `genome`, with all activations 0.
    #[must_use]
    pub fn new(genome: &Genome) -> Self {
        let neurons = genome.neurons();
        let place = |id| genome.position(id).expect("a genome's links join its own neurons");
        let ends: Vec<_> = genome.links().iter().map(|link| (place(link.from), place(link.to))).collect();
        let mut entering = vec![0; neurons.len()];
        for &(_, to) in &ends {
            entering[to] += 1;
        }
        let mut places: Vec<usize> = (genome.inputs() + 1..neurons.len()).collect();
        places.sort_by(|&a, &b| neurons[a].depth.total_cmp(&neurons[b].depth));
        // Where the next wire into each neuron goes.
        let (mut next, mut end) = (entering.clone(), 0);
        let unit = |place: usize| {
            let start = end;
            end += entering[place];
            next[place] = start;
            let neuron = &neurons[place];
            Unit {
                place,
                sensors: start..start,
                wires: start..end,
                activation: neuron.activation,
                a: neuron.a,
                b: neuron.b,
            }
        };
        let mut units: Vec<Unit> = places.into_iter().map(unit).collect();
        let mut wires = vec![Wire { from: 0, weight: 0.0, is_forward: false }; ends.len()];
        for (link, (from, to)) in genome.links().iter().zip(ends) {
            let is_forward = neurons[from].depth < neurons[to].depth;
            wires[next[to]] = Wire { from, weight: link.weight, is_forward };
            next[to] += 1;
        }
        // Within a unit, the inputs in their order, then the rest in the order of the genes.
        let inputs = genome.inputs();
        for unit in &mut units {
            let own = &mut wires[unit.wires.clone()];
            own.sort_by_key(|wire| wire.from.min(inputs));
            let middle = unit.wires.start + own.partition_point(|wire| wire.from < inputs);
            unit.sensors = unit.wires.start..middle;
            unit.wires.start = middle;
        }
        let state = vec![0.0; neurons.len()];
        Self {
            inputs: genome.inputs(),
            outputs: genome.outputs(),
            units,
            wires,
            previous: state.clone(),
            state,
        }
    }

    /// Sets the inputs (and the bias to 1), advances every other neuron by one synchronous step, and returns the outputs.
    ///
    /// # Panics
    ///
    /// If there are not as many values as the genome has inputs.
    pub fn activate(&mut self, inputs: &[f64]) -> &[f64] {
        self.sense(inputs);
        for unit in &self.units {
            let bring = |wires: &Range<usize>| {
                self.wires[wires.clone()].iter().fold(0.0, |sum, w| sum + self.previous[w.from] * w.weight)
            };
            let sum = bring(&unit.sensors) + bring(&unit.wires);
            self.state[unit.place] = unit.activation.of(sum, unit.a, unit.b);
        }
        self.output()
    }

    /// Sets the inputs (and the bias to 1), advances every other neuron in order of depth, and returns the outputs.
    ///
    /// A link to greater depth reads what its source holds by now, so that a signal runs all the way within one call; any
    /// other link reads what its source held before the call. In networks evolved with
    /// [`Config::feed_forward`](crate::Config::feed_forward) there are no other links, and the outputs depend on these
    /// inputs alone.
    ///
    /// # Panics
    ///
    /// If there are not as many values as the genome has inputs.
    pub fn activate_feed_forward(&mut self, inputs: &[f64]) -> &[f64] {
        self.sense(inputs);
        for unit in &self.units {
            let bring = |wires: &Range<usize>| {
                self.wires[wires.clone()].iter().fold(0.0, |sum, w| {
                    let source = if w.is_forward { &self.state } else { &self.previous };
                    sum + source[w.from] * w.weight
                })
            };
            let sum = bring(&unit.sensors) + bring(&unit.wires);
            self.state[unit.place] = unit.activation.of(sum, unit.a, unit.b);
        }
        self.output()
    }

    fn sense(&mut self, inputs: &[f64]) {
        assert_eq!(inputs.len(), self.inputs, "one value for each input");
        self.state[..self.inputs].copy_from_slice(inputs);
        self.state[self.inputs] = 1.0;
        self.previous.copy_from_slice(&self.state);
    }

    /// The outputs as they stand.
    #[must_use]
    pub fn output(&self) -> &[f64] {
        &self.state[self.inputs + 1..][..self.outputs]
    }

    /// Sets every activation to 0, as in a new network.
    pub fn flush(&mut self) {
        self.state.fill(0.0);
    }

    /// All activations, in order of the genome's neurons.
    #[must_use]
    pub fn state(&self) -> &[f64] {
        &self.state
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{self, genome};

    #[test]
    fn a_hidden_neuron_delays_a_signal_by_one_step() {
        // x -> hidden -> output, all linear.
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
    fn feed_forward_runs_through_in_one_call() {
        let mut network =
            Network::new(&genome(1, 1, &[(4, 0.5), (5, 0.25)], &[(1, 5, 2.0), (5, 4, 3.0), (4, 3, 5.0)]));
        assert_eq!(network.activate_feed_forward(&[1.0]), [30.0]);
        assert_eq!(network.activate_feed_forward(&[0.0]), [0.0]);
    }

    #[test]
    fn in_a_feed_forward_call_a_recurrent_link_brings_the_call_before() {
        let mut network = Network::new(&genome(1, 1, &[(4, 0.5)], &[(1, 4, 1.0), (4, 3, 1.0), (3, 4, 10.0)]));
        assert_eq!(network.activate_feed_forward(&[1.0]), [1.0]);
        assert_eq!(network.activate_feed_forward(&[2.0]), [12.0]);
    }

    #[test]
    fn feed_forward_agrees_with_as_many_steps_as_the_network_is_deep() {
        let config = crate::Config { feed_forward: true, ..testing::sigmoids() };
        for grown in testing::grown(&config, 1, 200).iter().step_by(20) {
            let (mut at_once, mut stepwise) = (Network::new(grown), Network::new(grown));
            let inputs = [0.3, -1.7];
            for _ in 0..grown.neurons().len() {
                stepwise.activate(&inputs);
            }
            assert_eq!(at_once.activate_feed_forward(&inputs), stepwise.output());
        }
    }
}
