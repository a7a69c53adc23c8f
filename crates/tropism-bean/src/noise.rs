//! Random processes of one bean: Ornstein-Uhlenbeck gains, pauses, and noise of curvature.
//!
//! In: the parameters of a plant, a seed, and time. Out: gains and increments. Each process has a random stream of its own, so
//! that a seed means one plant whatever else changes.
//!
//! # References
//! Uhlenbeck and Ornstein 1930, doi:10.1103/PhysRev.36.823.

use rand_chacha::ChaCha8Rng;
use tropism::math;
use tropism::random::{self, NoiseStream, Purpose};

use crate::individual::{FILE_RATES_PER_H, Fluctuation, Individual};

/// Longest time over which everything but the rod itself is held constant, in min. Chosen by hand: far below the hours in
/// which it changes.
pub(crate) const MAX_TICK_MIN: f64 = 5.0;
/// Duration of the linear ramps at both ends of a pause, in h. Chosen by hand.
const RAMP_H: f64 = 0.5;
/// Elongation while the primary leaves unfold, and while the trifoliate leaf unfolds, as a share. Chosen by hand.
const UNFOLDING_GROWTH: [f64; 2] = [0.5, 0.6];
/// Duration of the unfolding of the trifoliate leaf over that of the primary leaves. Chosen by hand.
const TRIFOLIATE_TIME: f64 = 0.8;
/// Non-response episodes: median duration, in h, and standard deviation of its logarithm. Tuned by hand.
const EPISODE_H: (f64, f64) = (1.5, 0.6);
/// Range of motility in such an episode, as a share. Tuned by hand.
const EPISODE_MOTILITY: (f64, f64) = (0.05, 0.35);

/// A period of reduced bending or growth.
#[derive(Clone, Debug, PartialEq)]
pub struct Pause {
    /// Age at its start, in h.
    pub start_h: f64,
    /// Age at its end, in h.
    pub end_h: f64,
    /// Motility during the pause, as a share.
    pub motility: f64,
    /// Elongation during the pause, as a share.
    pub growth: f64,
}

impl Pause {
    /// Strength of the pause at an age: 0 outside, 1 inside, with ramps centred on start and end.
    fn level(&self, age_h: f64) -> f64 {
        let rise = (age_h - self.start_h) / RAMP_H + 0.5;
        let fall = (self.end_h - age_h) / RAMP_H + 0.5;
        rise.min(fall).clamp(0.0, 1.0)
    }
}

/// Gains upon motility and elongation at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gains {
    pub(super) motility: f64,
    pub(super) growth: f64,
}

/// How strongly the random processes of a plant let it respond at the beginning of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResponseState {
    /// Slow fluctuation of motility as a factor: 1 on average over plants. Pauses are left out.
    pub motility: f64,
    /// Share of motility that pauses leave, 0 to 1: 1 outside of all pauses.
    pub unpaused: f64,
}

/// The random processes of the plant with the parameters `plant` that grows from `seed`, at the beginning of each of `steps`
/// steps of `period_min` minutes. They do not depend on the light, so nothing is grown.
///
/// ```
/// use tropism_bean::{Species, response_history};
/// let history = response_history(&Species::default().draw(1, 1.0), 1, 300, 5.0);
/// assert!(history.len() == 300 && history.iter().any(|state| state.unpaused < 0.5));
/// ```
#[must_use]
pub fn response_history(plant: &Individual, seed: u64, steps: u32, period_min: f64) -> Vec<ResponseState> {
    let mut noise = PlantNoise::new(plant, seed);
    // A bean draws its first phase, and a step of the phase a tick, from the stream of the gains.
    noise.phase();
    let ticks = (period_min / MAX_TICK_MIN).ceil().max(1.0) as u32;
    let tick_h = period_min / f64::from(ticks) / 60.0;
    let sigma = plant.fluctuation.motility;
    let mut age_h = 0.0;
    let mut step = |_| {
        let motility = math::exp(noise.motility - 0.5 * sigma * sigma);
        let mut unpaused = None;
        for _ in 0..ticks {
            let gains = noise.gains(plant, age_h, tick_h);
            unpaused.get_or_insert(gains.motility / motility);
            noise.phase_step(plant, tick_h);
            age_h += tick_h;
        }
        ResponseState { motility, unpaused: unpaused.expect("a step has a tick") }
    };
    (0..steps).map(&mut step).collect()
}

/// The random processes of one plant.
#[derive(Clone, Debug)]
pub(super) struct PlantNoise {
    events: ChaCha8Rng,
    slow: ChaCha8Rng,
    /// Logarithms of the gains: Ornstein-Uhlenbeck processes.
    motility: f64,
    growth: f64,
    /// Seed, and number of ticks so far: they name the streams of the noise of curvature.
    seed: u64,
    ticks: u32,
    pauses: Vec<Pause>,
    next_episode_h: f64,
}

impl PlantNoise {
    pub(super) fn new(plant: &Individual, seed: u64) -> Self {
        let mut slow = random::stream(seed, Purpose::Fluctuation, 0);
        let mut events = random::stream(seed, Purpose::Events, 0);
        let unfolding = |start_h: f64, duration_h: f64, growth| Pause {
            start_h,
            end_h: start_h + duration_h,
            motility: plant.pauses.motility,
            growth,
        };
        let duration_h = plant.pauses.unfolding_h;
        let pauses = vec![
            unfolding(plant.leaves.unfold_h, duration_h, UNFOLDING_GROWTH[0]),
            unfolding(plant.pauses.trifoliate_h, TRIFOLIATE_TIME * duration_h, UNFOLDING_GROWTH[1]),
        ];
        let motility = plant.fluctuation.motility * random::normal(&mut slow);
        let growth = plant.fluctuation.growth * random::normal(&mut slow);
        let next_episode_h = waiting_time(&mut events, plant.pauses.episodes_per_h);
        Self { events, slow, motility, growth, seed, ticks: 0, pauses, next_episode_h }
    }

    /// Draws the initial phase of circumnutation, in rad.
    pub(super) fn phase(&mut self) -> f64 {
        core::f64::consts::TAU * random::uniform(&mut self.slow)
    }

    /// The gains at `age_h`; then advances their processes by `tick_h` (exact discretisation).
    pub(super) fn gains(&mut self, plant: &Individual, age_h: f64, tick_h: f64) -> Gains {
        while self.next_episode_h <= age_h + RAMP_H {
            let start_h = self.next_episode_h;
            let (median, sigma) = EPISODE_H;
            let duration_h = median * math::exp(sigma * random::normal(&mut self.events));
            let (least, most) = EPISODE_MOTILITY;
            let motility = least + (most - least) * random::uniform(&mut self.events);
            self.pauses.push(Pause { start_h, end_h: start_h + duration_h, motility, growth: 1.0 });
            self.next_episode_h = start_h + waiting_time(&mut self.events, plant.pauses.episodes_per_h);
        }
        let Fluctuation { motility, motility_h, growth, growth_h, .. } = plant.fluctuation;
        let mut gains = Gains {
            motility: math::exp(self.motility - 0.5 * motility * motility),
            growth: math::exp(self.growth - 0.5 * growth * growth),
        };
        for pause in &self.pauses {
            let level = pause.level(age_h);
            gains.motility *= 1.0 - level * (1.0 - pause.motility);
            gains.growth *= 1.0 - level * (1.0 - pause.growth);
        }
        for (value, sigma, time_h) in
            [(&mut self.motility, motility, motility_h), (&mut self.growth, growth, growth_h)]
        {
            let kept = math::exp(-tick_h / time_h);
            *value = kept * *value + sigma * (1.0 - kept * kept).sqrt() * random::normal(&mut self.slow);
        }
        gains
    }

    /// Random-walk increment of the phase of circumnutation over a tick, in rad.
    pub(super) fn phase_step(&mut self, plant: &Individual, tick_h: f64) -> f64 {
        plant.fluctuation.phase * (FILE_RATES_PER_H * tick_h).sqrt() * random::normal(&mut self.slow)
    }

    /// Noise of curvature of a tick: the stream of all segments, and the standard deviation of the increment, in 1/cm.
    pub(super) fn curvature(&mut self, plant: &Individual, tick_h: f64) -> (NoiseStream, f64) {
        self.ticks += 1;
        let stream = NoiseStream::new(self.seed, Purpose::SegmentNoise, [self.ticks, 0, 0]);
        (stream, plant.fluctuation.curvature * tick_h.sqrt())
    }

    /// Pauses drawn so far.
    pub(super) fn pauses(&self) -> &[Pause] {
        &self.pauses
    }
}

/// Waiting time of a Poisson process, in h; infinite at rate 0.
fn waiting_time(rng: &mut ChaCha8Rng, per_h: f64) -> f64 {
    let drawn = -math::ln(1.0 - random::uniform(rng));
    if per_h > 0.0 { drawn / per_h } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Bean, Species};

    #[test]
    fn a_pause_ramps_about_its_ends() {
        let pause = Pause { start_h: 10.0, end_h: 12.0, motility: 0.1, growth: 1.0 };
        for (age_h, level) in [(9.7, 0.0), (10.0, 0.5), (10.3, 1.0), (11.0, 1.0), (12.0, 0.5), (12.3, 0.0)] {
            assert!((pause.level(age_h) - level).abs() < 1e-12, "{age_h}");
        }
    }

    #[test]
    fn the_history_of_the_response_is_that_of_the_growing_bean() {
        let plant = Species::default().draw(5, 1.0);
        for period_min in [5.0, 12.0] {
            let history = response_history(&plant, 5, 41, period_min);
            let mut bean = Bean::new(plant.clone(), 5);
            for state in &history {
                let noise = bean.noise.as_mut().unwrap();
                let motility = math::exp(noise.motility - 0.5 * plant.fluctuation.motility.powi(2));
                assert_eq!(state.motility, motility);
                let paused = noise.clone().gains(&plant, bean.age_h, 0.0).motility;
                assert!((state.unpaused - paused / motility).abs() < 1e-12);
                bean.advance(&[0.0, 1.0], period_min);
            }
        }
    }

    #[test]
    fn gains_have_mean_one_and_episodes_come_at_their_rate() {
        let plant = Individual::default();
        let (mut motility, mut episodes) = (0.0, 0);
        for seed in 0..200 {
            let mut noise = PlantNoise::new(&plant, seed);
            for step in 0..1000 {
                motility += math::exp(noise.motility - 0.5 * 0.38 * 0.38) / 200_000.0;
                noise.gains(&plant, f64::from(step) / 12.0, 1.0 / 12.0);
            }
            episodes += noise.pauses().len() - 2;
        }
        assert!((motility - 1.0).abs() < 0.03, "{motility}");
        let expected = 200.0 * 1000.0 / 12.0 / 18.0;
        assert!((episodes as f64 / expected - 1.0).abs() < 0.1, "{episodes} against {expected}");
    }
}
