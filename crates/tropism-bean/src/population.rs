//! Many beans at once, in vector lanes: [`Bean::advance`] for each, to the bit.
//!
//! In: beans of any age and size, the powers of the lamps of each, and time. Out: the beans later. The idea: plants with about
//! as many segments grow side by side, one a lane. Random processes and what changes slowly are computed plant by plant, once
//! a tick.

use tropism::lamps::MAX_LAMPS;

use tropism::math::Lanes;

use super::bean::{Bean, tick_together, ticks_of};
use super::rod::{Chains, LANES};

/// Beans that grow side by side.
///
/// Each has its own parameters, random processes and light. Beans may be added, replaced and removed between two calls.
///
/// ```
/// use tropism_bean::{Bean, Population, Species, lamp_powers};
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
    chains: Chains<Lanes<LANES>>,
}

impl Population {
    /// A population of `beans`.
    #[must_use]
    pub fn new(beans: Vec<Bean>) -> Self {
        Self { beans, chains: Chains::new() }
    }

    /// Grows all plants for `minutes`, each under lamps of its own powers: [`Bean::advance`] for each, to the bit.
    ///
    /// # Panics
    /// If there are not as many powers as plants, and where [`Bean::advance`] does.
    pub fn advance(&mut self, lamp_powers: &[[f64; MAX_LAMPS]], minutes: f64) {
        let (found, wanted) = (lamp_powers.len(), self.beans.len());
        assert!(found == wanted, "found lamp powers for {found} beans, wanted them for {wanted}");
        let (ticks, tick_h) = ticks_of(minutes);
        let Self { beans, chains } = self;
        // Plants of about as many segments stand side by side.
        let mut members: Vec<_> = beans.iter_mut().zip(lamp_powers).collect();
        members.sort_by_key(|(bean, _)| (bean.substep_s().to_bits(), bean.rod.computed()));
        for equal in members.chunk_by_mut(|(one, _), (other, _)| one.substep_s() == other.substep_s()) {
            for group in equal.chunks_mut(LANES) {
                if let [(bean, powers)] = group {
                    bean.advance(*powers, minutes);
                    continue;
                }
                let powers: Vec<_> =
                    group.iter().map(|(bean, powers)| bean.checked_powers(*powers)).collect();
                let mut plants: Vec<&mut Bean> = group.iter_mut().map(|(bean, _)| &mut **bean).collect();
                for _ in 0..ticks {
                    tick_together(chains, &mut plants, &powers, tick_h);
                    plants.iter_mut().for_each(|bean| bean.rod.set_down());
                }
            }
        }
    }
}
