//! Rods go into lanes before a tick, and their states back afterwards.
//!
//! In: rods, and what is held constant over a tick for each. Out: rows of vectors, and later the rods with their new states. The
//! idea: a lane is one column of all rows, so whole rows are read and written, block by block, and not one lane after another.

use core::f64::consts::PI;

use tropism::lamps::MAX_LAMPS;
use tropism::simd::dispatch;

use super::{Apexes, BLOCK, Guest, LANES, PerPlant, RodLanes, Row};
use crate::Individual;
use crate::rod::{Forcing, LAMP_DISTANCE, MAX_NODES, MEGAPASCAL, Rod, STATE, state_of};

impl RodLanes {
    /// Forgets the plants of the last tick; `most` is the greatest number of segments of those to come.
    pub(crate) fn begin(&mut self, most: usize) {
        assert!(most < MAX_NODES);
        self.most = most;
        self.lit = 0;
        self.constants.lamps = [[[0.0; LANES]; 4]; MAX_LAMPS];
        self.constants.curvature_sigma = [0.0; LANES];
        self.are_disturbed = [0.0; LANES];
    }

    /// Puts a rod into a lane before [`Self::begin_tick`].
    pub(crate) fn load(&mut self, lane: usize, rod: &mut Rod, plant: &Individual, forcing: &Forcing) {
        let Individual { motility, tropism, stem, .. } = plant;
        let of = &mut *self.constants;
        for (values, value) in of.base.iter_mut().zip(rod.base.0) {
            values[lane] = value;
        }
        let lit = forcing.lamps.iter().zip(forcing.powers).filter(|(_, power)| *power > 0.0);
        for (number, (&[x, y, z], power)) in lit.enumerate() {
            let strength = power * LAMP_DISTANCE * LAMP_DISTANCE;
            for (values, value) in of.lamps[number].iter_mut().zip([x, y, z, strength]) {
                values[lane] = value;
            }
            self.lit = self.lit.max(number + 1);
        }
        let exponent = 0.5 * (tropism.light_exponent - 1.0);
        let series = [exponent, 0.5 * (exponent - 1.0), (exponent - 2.0) / 3.0, (exponent - 3.0) / 4.0];
        for (values, value) in of.series.iter_mut().zip(series) {
            values[lane] = value;
        }
        of.light_share[lane] = (forcing.dt / tropism.light_memory_h).min(1.0);
        of.gravity_share[lane] = (forcing.dt / tropism.gravity_memory_h).min(1.0);
        (of.local[lane], of.apical[lane]) = (1.0 - tropism.apical, tropism.apical);
        (of.sensitivity[0][lane], of.sensitivity[1][lane]) = (tropism.light, tropism.gravity);
        (of.bias[0][lane], of.bias[1][lane]) = (tropism.bias_x, tropism.bias_z);
        of.growth_step[lane] = forcing.dt * forcing.gain;
        of.straightening[lane] = forcing.straightening;
        (of.tip_mass[lane], of.leaf_mass[lane]) = (stem.tip_g, forcing.leaf_mass);
        (of.radius_apex[lane], of.widening[lane]) = (stem.radius_apex, stem.radius_base - stem.radius_apex);
        of.relaxed_share[lane] = forcing.relaxed_share;
        of.mature[lane] = stem.modulus_mature_mpa * MEGAPASCAL * PI / 4.0;
        of.elongation[lane] = forcing.dt * forcing.growth;
        (of.per_edge[lane], of.per_modulus_length[lane]) = (1.0 / motility.edge, 1.0 / stem.modulus_length);
        (of.growth_zone[lane], of.motile_zone[lane]) = (plant.growth.zone, forcing.zone);
        (of.edge[lane], of.modulus_length[lane]) = (motility.edge, stem.modulus_length);
        of.modulus[lane] = stem.modulus_mpa / stem.modulus_mature_mpa;
        self.guests[lane] = rod.contact.is_some().then(|| Guest {
            plant: plant.clone(),
            forcing: forcing.clone(),
            contact: None,
            is_pressed: false,
        });
        self.place(lane, rod);
    }

    /// Takes over what a rod has beside its segments, and ends the rows of its lane at its apex.
    fn place(&mut self, lane: usize, rod: &mut Rod) {
        if let Some(guest) = &mut self.guests[lane] {
            guest.contact = rod.contact.take();
        }
        let count = rod.count;
        if count > self.most {
            // The rows that come to use lie beyond the apex of all plants, as the last one has.
            let last = self.rows[self.most];
            self.rows[self.most + 1..=count].fill(last);
            self.most = count;
        }
        for row in &mut self.rows[count..=self.most] {
            for values in row.state_mut() {
                values[lane] = 0.0;
            }
            row.from_apex[lane] = 0.0;
            row.growth_exp[lane] = 0.0;
            row.motility_exp[lane] = 0.0;
            row.modulus_ratio[lane] = 1.0;
        }
        self.counts[lane] = count;
        self.leaves[lane] = rod.leaf;
        self.is_stale[lane] = true;
    }

    /// Puts the segments of the rods of all lanes into the rows, after [`Self::load`] of each.
    ///
    /// Block by block: each line of the processor's cache is then read and written once.
    pub(crate) fn load_segments(&mut self, rods: [&Rod; LANES]) {
        let states = rods.map(|rod| rod.segments.state());
        for first in (0..self.most).step_by(BLOCK) {
            let mut block: [_; BLOCK] = rows_from(&mut self.rows, first).map(Row::state_mut);
            for quantity in 0..STATE {
                for (lane, state) in states.iter().enumerate() {
                    // What `load` has put beyond the apex stays.
                    let end = (first + BLOCK).min(self.counts[lane]).max(first);
                    for (row, value) in block.iter_mut().zip(&state[quantity][first..end]) {
                        row[quantity][lane] = *value;
                    }
                }
            }
        }
    }

    /// Puts the segments of a rod back into its lane, after they were split and refreshed.
    pub(crate) fn reload(&mut self, lane: usize, rod: &mut Rod) {
        self.place(lane, rod);
        let (segments, state) = (&*rod.segments, rod.segments.state());
        for (i, row) in self.rows[..rod.count].iter_mut().enumerate() {
            for (values, of_segments) in row.state_mut().into_iter().zip(state) {
                values[lane] = of_segments[i];
            }
            row.from_apex[lane] = segments.from_apex[i];
            row.growth_exp[lane] = segments.growth_exp[i];
            row.motility_exp[lane] = segments.motility_exp[i];
            row.modulus_ratio[lane] = segments.modulus_ratio[i];
        }
    }

    /// Puts the state of a lane back into its rod.
    pub(crate) fn store(&mut self, lane: usize, rod: &mut Rod) {
        if let Some(guest) = &mut self.guests[lane] {
            rod.contact = guest.contact.take();
        }
        let mut state = rod.segments.state_mut();
        for (i, row) in self.rows[..rod.count].iter().enumerate() {
            for (of_segments, values) in state.iter_mut().zip(row.state()) {
                of_segments[i] = values[lane];
            }
        }
    }

    /// Ends a tick: puts the state of the first lanes back into their rods, of which there are at most [`LANES`].
    pub(crate) fn end_tick(&mut self, rods: &mut [&mut Rod]) {
        for (rod, guest) in rods.iter_mut().zip(&mut self.guests) {
            if let Some(guest) = guest {
                rod.contact = guest.contact.take();
            }
        }
        let apexes = dispatch(Apexes { rods: self });
        for (lane, rod) in rods.iter_mut().enumerate() {
            rod.apex = Some(apexes.map(|axis| axis[lane]));
        }
        let mut states: Vec<_> = rods.iter_mut().map(|rod| rod.segments.state_mut()).collect();
        // Block by block, as in `load_segments`. What stands beyond an apex is never read.
        for first in (0..self.most).step_by(BLOCK) {
            let block: [_; BLOCK] = rows_from(&mut self.rows, first).map(Row::state_mut);
            for quantity in 0..STATE {
                for (lane, state) in states.iter_mut().enumerate() {
                    for (row, value) in block.iter().zip(&mut state[quantity][first..first + BLOCK]) {
                        *value = row[quantity][lane];
                    }
                }
            }
        }
    }
}

impl Row {
    /// The state of the segments, in the order of [`Segments::state`].
    #[inline(always)]
    fn state(&self) -> [&PerPlant; STATE] {
        state_of!(&self)
    }

    /// [`Self::state`], to be changed.
    #[inline(always)]
    fn state_mut(&mut self) -> [&mut PerPlant; STATE] {
        state_of!(&mut self)
    }
}

/// A block of rows from `first` on, which is a multiple of [`BLOCK`].
fn rows_from(rows: &mut [Row; MAX_NODES], first: usize) -> [&mut Row; BLOCK] {
    let block: &mut [Row; BLOCK] =
        (&mut rows[first..first + BLOCK]).try_into().expect("MAX_NODES is a multiple of BLOCK");
    block.each_mut()
}
