//! Many beans at once, in vector lanes: the fast twin of [`Bean::advance`], with the same bits.
//!
//! In: beans of any age and size, the powers of the lamps of each, and time. Out: the beans later. The idea: plants with about
//! as many segments grow side by side, one a lane. Random processes and what changes slowly are computed plant by plant, once
//! a tick, by the code of the plain bean; only the sub-steps of the rods are another code.

use super::rod::{LANES, RodLanes};
use super::{Bean, Tick, noise, ticks_of};
use crate::lamps::MAX_LAMPS;

/// Beans that grow side by side.
///
/// Each has its own parameters, random processes and light. Beans may be added, replaced and removed between two calls.
///
/// ```
/// use tropism::greenhouse::bean::{Bean, Population, Species, lamp_powers};
/// use tropism::lamps::Light;
/// let species = Species::default();
/// let seedling = |seed| Bean::new(species.draw(seed, 1.0), seed);
/// let mut population = Population::new((0..20).map(seedling).collect());
/// let lights = |seed| lamp_powers(Some(if seed < 10 { Light::LEFT } else { Light::RIGHT }));
/// let powers: Vec<_> = (0..20).map(lights).collect();
/// for _ in 0..12 {
///     population.advance(&powers, 5.0);
/// }
/// let mut alone = seedling(7);
/// for _ in 0..12 {
///     alone.advance(&lights(7), 5.0);
/// }
/// assert_eq!(population.beans[7].apex(), alone.apex());
/// ```
pub struct Population {
    /// The plants.
    pub beans: Vec<Bean>,
    /// Sub-step, number of segments and number of each plant, sorted: plants of about as many segments stand side by side.
    order: Vec<(u64, usize, usize)>,
    lanes: RodLanes,
}

impl Population {
    /// A population of `beans`.
    #[must_use]
    pub fn new(beans: Vec<Bean>) -> Self {
        Self { beans, order: Vec::new(), lanes: RodLanes::new() }
    }

    /// Grows all plants for `minutes`, each under lamps of its own powers: [`Bean::advance`] for each, to the bit.
    ///
    /// # Panics
    /// If there are not as many powers as plants, and where [`Bean::advance`] does.
    pub fn advance(&mut self, lamp_powers: &[[f64; MAX_LAMPS]], minutes: f64) {
        let (found, wanted) = (lamp_powers.len(), self.beans.len());
        assert!(found == wanted, "found lamp powers for {found} beans, wanted them for {wanted}");
        let (ticks, tick_h) = ticks_of(minutes);
        let Self { beans, order, lanes } = self;
        order.clear();
        let by_work = |(number, bean): (usize, &Bean)| (bean.substep_s.to_bits(), bean.rod.count(), number);
        let plain = |(_, bean): &(usize, &Bean)| bean.plant.internodal.is_none();
        order.extend(beans.iter().enumerate().filter(plain).map(by_work));
        order.sort_unstable();
        // The lanes know the first physiology alone.
        for (bean, powers) in beans.iter_mut().zip(lamp_powers) {
            if bean.plant.internodal.is_some() {
                bean.advance(powers, minutes);
            }
        }
        for equal in order.chunk_by(|(one, ..), (other, ..)| one == other) {
            for group in equal.chunks(LANES) {
                if let [(.., number)] = *group {
                    beans[number].advance(&lamp_powers[number], minutes);
                    continue;
                }
                let group: Vec<usize> = group.iter().map(|&(.., number)| number).collect();
                for _ in 0..ticks {
                    tick_together(lanes, beans, &group, lamp_powers, tick_h);
                }
            }
        }
    }
}

/// A tick of two to [`LANES`] beans with the same sub-step.
fn tick_together(
    lanes: &mut RodLanes,
    beans: &mut [Bean],
    group: &[usize],
    lamp_powers: &[[f64; MAX_LAMPS]],
    tick_h: f64,
) {
    let mut begin = |&number: &usize| {
        let powers = beans[number].checked_powers(&lamp_powers[number]);
        beans[number].draw_tick(powers, tick_h)
    };
    let mut ticks: Vec<Tick> = group.iter().map(&mut begin).collect();
    lanes.begin(group.iter().map(|&number| beans[number].rod.count()).max().unwrap_or(0));
    for lane in 0..LANES {
        // Lanes without a plant repeat the first one; nothing comes of them.
        let place = if lane < group.len() { lane } else { 0 };
        let Bean { rod, plant, .. } = &mut beans[group[place]];
        lanes.load(lane, rod, plant, &ticks[place].forcing);
    }
    for (lane, &number) in group.iter().enumerate() {
        let Bean { plant, noise: Some(noise), .. } = &mut beans[number] else { continue };
        lanes.draw_curvature(lane, noise::curvature_sigma(plant, tick_h), || noise.uniforms_of_curvature());
    }
    lanes.begin_tick();
    let mut nutation = [[0.0; 2]; LANES];
    for _ in 0..ticks[0].substeps {
        for (rate, tick) in nutation.iter_mut().zip(&mut ticks) {
            *rate = tick.nutation.next_rate();
        }
        lanes.step(&nutation);
        for (lane, (&number, tick)) in group.iter().zip(&ticks).enumerate() {
            if lanes.must_split(lane) {
                let Bean { rod, plant, .. } = &mut beans[number];
                lanes.store(lane, rod);
                rod.split_overlong(plant, &tick.forcing);
                lanes.load_segments(lane, rod);
            }
        }
    }
    for (lane, &number) in group.iter().enumerate() {
        lanes.store(lane, &mut beans[number].rod);
        beans[number].end_tick(&ticks[lane], tick_h);
    }
}
