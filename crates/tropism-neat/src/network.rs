//! The network that a genome describes, run one synchronous step at a time.
//!
//! Every link reads what its source held *before* the step, so a path through h hidden neurons delays a signal by h steps,
//! and recurrent links need no special care. The state stays until it is flushed.

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
    links: Vec<Wire>,
    neurons: Vec<(Activation, f64, f64)>,
    state: Vec<f64>,
    sums: Vec<f64>,
}

/// A link between places in the state.
#[derive(Clone, Copy, Debug)]
struct Wire {
    from: usize,
    to: usize,
    weight: f64,
}

impl Network {
    /// The network of `genome`, with all activations 0.
    #[must_use]
    pub fn new(genome: &Genome) -> Self {
        let place = |id| genome.position(id).expect("a genome's links join its own neurons");
        let wire =
            |link: &crate::Link| Wire { from: place(link.from), to: place(link.to), weight: link.weight };
        let count = genome.neurons().len();
        Self {
            inputs: genome.inputs(),
            outputs: genome.outputs(),
            links: genome.links().iter().map(wire).collect(),
            neurons: genome.neurons().iter().map(|neuron| (neuron.activation, neuron.a, neuron.b)).collect(),
            state: vec![0.0; count],
            sums: vec![0.0; count],
        }
    }

    /// Sets the inputs (and the bias to 1), advances every other neuron by one synchronous step, and returns the outputs.
    ///
    /// # Panics
    ///
    /// If there are not as many values as the genome has inputs.
    pub fn activate(&mut self, inputs: &[f64]) -> &[f64] {
        assert_eq!(inputs.len(), self.inputs, "one value for each input");
        self.state[..self.inputs].copy_from_slice(inputs);
        self.state[self.inputs] = 1.0;
        self.sums.fill(0.0);
        for link in &self.links {
            self.sums[link.to] += self.state[link.from] * link.weight;
        }
        for (index, &(activation, a, b)) in self.neurons.iter().enumerate().skip(self.inputs + 1) {
            self.state[index] = activation.of(self.sums[index], a, b);
        }
        self.output()
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
