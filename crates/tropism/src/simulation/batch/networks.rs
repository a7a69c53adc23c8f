//! Step networks of any size side by side: their input sums in vectors, their state transitions one by one.

#![allow(clippy::needless_range_loop, reason = "a loop over lanes reads and writes many arrays at one place")]

use tropism_neat::{Genome, StepNetwork};

use super::plants::{LANES, Plants};
use crate::control::TIP_INPUTS as INPUTS;

#[repr(C, align(64))]
pub(super) struct Networks {
    /// The light: 1 for right.
    light: [u32; LANES],
    /// Input neurons (those with links from the inputs) of each network that fire, one bit each; the first is the output.
    fired: [u64; LANES],
    /// Input neurons on which the next state depends, and which of them fire if the network stays in its state.
    watched: [u64; LANES],
    stay: [u64; LANES],
    /// 1 where the network changes its state.
    changes: [u8; LANES],
    /// Input weights and threshold of the first input neuron of each network, of the second, and so on.
    neurons: Vec<InputNeurons>,
    /// Sum over the recurrent and hidden links into each input neuron, in the present state.
    recurrent: Vec<[f64; LANES]>,
    networks: Vec<StepNetwork<INPUTS>>,
}

/// One input neuron of each network.
#[repr(C, align(64))]
struct InputNeurons {
    weights: [[f64; LANES]; INPUTS],
    threshold: [f64; LANES],
}

impl InputNeurons {
    const fn silent() -> Self {
        Self { weights: [[0.0; LANES]; INPUTS], threshold: [0.0; LANES] }
    }
}

impl Default for Networks {
    fn default() -> Self {
        Self {
            light: [0; LANES],
            fired: [0; LANES],
            watched: [0; LANES],
            stay: [0; LANES],
            changes: [0; LANES],
            neurons: Vec::new(),
            recurrent: Vec::new(),
            networks: vec![StepNetwork::default(); LANES],
        }
    }
}

impl Networks {
    /// Prepares for a new set of episodes: all lanes are free.
    pub(super) fn begin(&mut self) {
        // No more rows than these episodes need.
        self.neurons.clear();
        self.recurrent.clear();
    }

    /// Puts the network of `genome` into a lane, at rest; `false` if it cannot be run in lanes.
    pub(super) fn assign(&mut self, lane: usize, genome: &Genome) -> bool {
        let network = &mut self.networks[lane];
        if !network.assign(genome) {
            return false;
        }
        for (place, sensor) in network.input_units().iter().enumerate() {
            if place == self.neurons.len() {
                self.neurons.push(InputNeurons::silent());
            }
            let row = &mut self.neurons[place];
            row.threshold[lane] = sensor.threshold;
            for (weights, weight) in row.weights.iter_mut().zip(sensor.weights) {
                weights[lane] = weight;
            }
        }
        while self.recurrent.len() < 4 * network.internal_inputs().len() {
            self.recurrent.push([0.0; LANES]);
        }
        self.watched[lane] = network.transition_mask();
        self.refresh(lane);
        true
    }

    /// Marks the network of a lane as no longer needed.
    pub(super) fn retire(&mut self, lane: usize) {
        (self.watched[lane], self.stay[lane]) = (0, 0);
    }

    /// Copies the recurrent sums of the network in `lane` for its present state.
    #[inline(always)]
    fn refresh(&mut self, lane: usize) {
        let network = &self.networks[lane];
        let (rows, _) = self.recurrent.as_chunks_mut::<4>();
        for (rows, rest) in rows.iter_mut().zip(network.internal_inputs()) {
            rows.iter_mut().zip(rest).for_each(|(row, rest)| row[lane] = rest);
        }
        self.stay[lane] = network.self_transition();
    }

    /// Every network's output: 1 for the right light.
    #[inline(always)]
    pub(super) fn decide(&mut self, plants: &Plants) -> &[u32; LANES] {
        self.fired = [0; LANES];
        for (place, (row, rest)) in self.neurons.iter().zip(&self.recurrent).enumerate() {
            let bit = 1 << place;
            for lane in 0..LANES {
                let [of_x, of_y] = [row.weights[0][lane], row.weights[1][lane]];
                let sensed = plants.tip[0][lane] * of_x + plants.tip[1][lane] * of_y;
                let fires = sensed + rest[lane] > row.threshold[lane];
                self.fired[lane] |= if fires { bit } else { 0 };
            }
        }
        for lane in 0..LANES {
            self.light[lane] = self.fired[lane] as u32 & 1;
            self.changes[lane] = u8::from(self.fired[lane] & self.watched[lane] != self.stay[lane]);
        }
        &self.light
    }

    /// Moves every network to its next state.
    ///
    /// After the plants have grown, although it could come before: the branch on which networks change is hard to predict,
    /// and the processor resolves it while the plants' arithmetic is still in flight.
    #[inline(always)]
    pub(super) fn advance(&mut self) {
        let mut lanes = bits(&self.changes);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            self.networks[lane].advance(self.fired[lane] & self.watched[lane]);
            self.refresh(lane);
        }
    }
}

/// Packs the bytes of at most 64 lanes, each 0 or 1, into bits.
#[inline(always)]
fn bits(bytes: &[u8; LANES]) -> u64 {
    let (groups, _) = bytes.as_chunks::<8>();
    groups.iter().rev().fold(0, |bits, group| {
        // Byte n is moved to bit 56 + n, and no two meet on the way.
        bits << 8 | u64::from_le_bytes(*group).wrapping_mul(0x0102_0408_1020_4080) >> 56
    })
}
