//! Many beans at once, in vector lanes: the fast twin of [`Bean::advance`], with the same bits.
//!
//! In: beans of any age and size, the powers of the lamps of each, and time. Out: the beans later. The idea: plants with about
//! as many segments grow side by side, one a lane. Random processes and what changes slowly are computed plant by plant, once
//! a tick, by the code of the plain bean; only the noise of curvature and the sub-steps of the rods are another code.

use tropism::lamps::MAX_LAMPS;

use super::bean::{Bean, Tick, ticks_of};
use super::noise;
use super::rod::{LANES, Rod, RodLanes};

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
    lanes: RodLanes,
}

impl Population {
    /// A population of `beans`.
    #[must_use]
    pub fn new(beans: Vec<Bean>) -> Self {
        Self { beans, lanes: RodLanes::new() }
    }

    /// Grows all plants for `minutes`, each under lamps of its own powers: [`Bean::advance`] for each, to the bit.
    ///
    /// # Panics
    /// If there are not as many powers as plants, and where [`Bean::advance`] does.
    pub fn advance(&mut self, lamp_powers: &[[f64; MAX_LAMPS]], minutes: f64) {
        let (found, wanted) = (lamp_powers.len(), self.beans.len());
        assert!(found == wanted, "found lamp powers for {found} beans, wanted them for {wanted}");
        let (ticks, tick_h) = ticks_of(minutes);
        let Self { beans, lanes } = self;
        let mut members = Vec::with_capacity(wanted);
        for (number, (bean, powers)) in beans.iter_mut().zip(lamp_powers).enumerate() {
            // The lanes know the first physiology alone.
            if bean.plant.internodal.is_some() {
                bean.advance(powers, minutes);
                continue;
            }
            let order = (bean.substep_s.to_bits(), bean.rod.count(), number);
            members.push(Member { order, bean, powers });
        }
        members.sort_unstable_by_key(|member| member.order);
        for equal in members.chunk_by_mut(|one, other| one.order.0 == other.order.0) {
            for group in equal.chunks_mut(LANES) {
                if let [Member { bean, powers, .. }] = group {
                    bean.advance(*powers, minutes);
                    continue;
                }
                for _ in 0..ticks {
                    tick_together(lanes, group, tick_h);
                }
            }
        }
    }
}

/// A plant of a population during [`Population::advance`].
struct Member<'a> {
    /// Sub-step, number of segments and number of the plant: plants of about as many segments stand side by side.
    order: (u64, usize, usize),
    bean: &'a mut Bean,
    powers: &'a [f64; MAX_LAMPS],
}

/// A tick of two to [`LANES`] beans with the same sub-step.
fn tick_together(lanes: &mut RodLanes, group: &mut [Member<'_>], tick_h: f64) {
    let begin = |Member { bean, powers, .. }: &mut Member<'_>| {
        let powers = bean.checked_powers(*powers);
        bean.draw_tick(powers, tick_h)
    };
    let mut ticks: Vec<Tick> = group.iter_mut().map(begin).collect();
    lanes.begin(group.iter().map(|member| member.bean.rod.count()).max().unwrap_or(0));
    // Lanes without a plant repeat the first one; nothing comes of them.
    let plants = group.len();
    let place = |lane| if lane < plants { lane } else { 0 };
    for lane in 0..LANES {
        let Bean { rod, plant, .. } = &mut *group[place(lane)].bean;
        lanes.load(lane, rod, plant, &ticks[place(lane)].forcing);
    }
    lanes.load_segments(core::array::from_fn(|lane| &group[place(lane)].bean.rod));
    for (lane, member) in group.iter_mut().enumerate() {
        let Bean { plant, noise: Some(noise), .. } = &mut *member.bean else { continue };
        lanes.draw_curvature(lane, noise::curvature_sigma(plant, tick_h), noise.curvature_stream());
    }
    lanes.begin_tick();
    let mut nutation = [[0.0; 2]; LANES];
    for _ in 0..ticks[0].substeps {
        for (rate, tick) in nutation.iter_mut().zip(&mut ticks) {
            *rate = tick.nutation.next_rate();
        }
        lanes.step(&nutation);
        for (lane, (member, tick)) in group.iter_mut().zip(&ticks).enumerate() {
            if lanes.must_split(lane) {
                let Bean { rod, plant, .. } = &mut *member.bean;
                lanes.store(lane, rod);
                rod.split_overlong(plant, &tick.forcing);
                lanes.reload(lane, rod);
            }
        }
    }
    let mut rods: Vec<&mut Rod> = group.iter_mut().map(|member| &mut member.bean.rod).collect();
    lanes.end_tick(&mut rods);
    for (member, tick) in group.iter_mut().zip(&ticks) {
        member.bean.end_tick(tick, tick_h);
    }
}
