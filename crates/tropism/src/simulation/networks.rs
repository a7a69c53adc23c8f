//! Networks of any size side by side: what they sense in vectors, and from state to state each by itself.

#![allow(clippy::needless_range_loop, reason = "a loop over lanes reads and writes many arrays at one place")]

use tropism_neat::{Genome, StepNetwork};

use super::lanes::Controllers;
use super::plants::{Course, Plants};
use crate::control::network::INPUTS;

#[repr(C, align(64))]
pub(super) struct Networks<const LANES: usize> {
    /// The tip in double precision, as networks see it.
    seen: [[f64; LANES]; INPUTS],
    /// The light: 1 for right.
    light: [u32; LANES],
    /// Which sensors of each network fire, one bit each; the first is the light.
    fired: [u64; LANES],
    /// Those that matter for what comes next, and which of them fire if the network stays in the state that it is in.
    watched: [u64; LANES],
    stay: [u64; LANES],
    /// Whether the network goes on to another state.
    goes_on: [u8; LANES],
    /// The first sensor of each network, the second, and so on.
    sensors: Vec<Sensors<LANES>>,
    /// What other links than those of the inputs bring to them.
    rest: Vec<[f64; LANES]>,
    networks: Vec<StepNetwork<INPUTS>>,
}

/// One sensor of each network.
#[repr(C, align(64))]
struct Sensors<const LANES: usize> {
    weights: [[f64; LANES]; INPUTS],
    threshold: [f64; LANES],
}

impl<const LANES: usize> Sensors<LANES> {
    const fn still() -> Self {
        Self { weights: [[0.0; LANES]; INPUTS], threshold: [0.0; LANES] }
    }
}

impl<const LANES: usize> Default for Networks<LANES> {
    fn default() -> Self {
        Self {
            seen: [[0.0; LANES]; INPUTS],
            light: [0; LANES],
            fired: [0; LANES],
            watched: [0; LANES],
            stay: [0; LANES],
            goes_on: [0; LANES],
            sensors: Vec::new(),
            rest: Vec::new(),
            networks: vec![StepNetwork::default(); LANES],
        }
    }
}

impl<const LANES: usize> Controllers<&Genome, LANES> for Networks<LANES> {
    fn begin(&mut self) {
        // No more sensors than these episodes need.
        self.sensors.clear();
        self.rest.clear();
    }

    fn assign<const TARGETS: usize>(
        &mut self,
        lane: usize,
        genome: &&Genome,
        _: &Course<'_, TARGETS>,
    ) -> bool {
        let network = &mut self.networks[lane];
        if !network.assign(genome) {
            return false;
        }
        for (place, sensor) in network.input_units().iter().enumerate() {
            if place == self.sensors.len() {
                self.sensors.push(Sensors::still());
            }
            let row = &mut self.sensors[place];
            row.threshold[lane] = sensor.threshold;
            for (weights, weight) in row.weights.iter_mut().zip(sensor.weights) {
                weights[lane] = weight;
            }
        }
        while self.rest.len() < 4 * network.internal_inputs().len() {
            self.rest.push([0.0; LANES]);
        }
        self.watched[lane] = network.transition_mask();
        self.refresh(lane);
        true
    }

    #[inline(always)]
    fn step<const TARGETS: usize>(&mut self, plants: &mut Plants<LANES>, course: &Course<'_, TARGETS>) {
        self.decide(plants);
        let light = &self.light;
        plants.step(course, |lane, _, _| (light[lane], false), |lane, _, _| light[lane]);
        self.go_on();
    }

    fn rest(&mut self, lane: usize) {
        (self.watched[lane], self.stay[lane]) = (0, 0);
    }
}

impl<const LANES: usize> Networks<LANES> {
    /// Takes over what the state of the network in `lane` brings to its sensors.
    #[inline(always)]
    fn refresh(&mut self, lane: usize) {
        let network = &self.networks[lane];
        let (rows, _) = self.rest.as_chunks_mut::<4>();
        for (rows, rest) in rows.iter_mut().zip(network.internal_inputs()) {
            rows.iter_mut().zip(rest).for_each(|(row, rest)| row[lane] = rest);
        }
        self.stay[lane] = network.self_transition();
    }

    /// Lets every network decide.
    #[inline(always)]
    fn decide(&mut self, plants: &Plants<LANES>) {
        for lane in 0..LANES {
            self.seen[0][lane] = plants.x[lane].into();
            self.seen[1][lane] = plants.y[lane].into();
        }
        self.fired = [0; LANES];
        for (place, (row, rest)) in self.sensors.iter().zip(&self.rest).enumerate() {
            let bit = 1 << place;
            for lane in 0..LANES {
                let [of_x, of_y] = [row.weights[0][lane], row.weights[1][lane]];
                let sensed = self.seen[0][lane] * of_x + self.seen[1][lane] * of_y;
                let fires = sensed + rest[lane] > row.threshold[lane];
                self.fired[lane] |= if fires { bit } else { 0 };
            }
        }
        for lane in 0..LANES {
            self.light[lane] = self.fired[lane] as u32 & 1;
            self.goes_on[lane] = u8::from(self.fired[lane] & self.watched[lane] != self.stay[lane]);
        }
    }

    /// Lets every network go on to its next state.
    ///
    /// This comes after the plants have grown, although it could come before: which networks change is hard to guess, and
    /// the processor finds out while the plants' long sums are under way.
    #[inline(always)]
    fn go_on(&mut self) {
        let mut lanes = bits(&self.goes_on);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            self.networks[lane].advance(self.fired[lane] & self.watched[lane]);
            self.refresh(lane);
        }
    }
}

/// One bit for each lane, of at most 64, from its byte of 0 or 1.
#[inline(always)]
fn bits<const LANES: usize>(bytes: &[u8; LANES]) -> u64 {
    let (groups, _) = bytes.as_chunks::<8>();
    groups.iter().rev().fold(0, |bits, group| {
        // Byte n is moved to bit 56 + n, and no two meet on the way.
        bits << 8 | u64::from_le_bytes(*group).wrapping_mul(0x0102_0408_1020_4080) >> 56
    })
}
