//! What a bean leaves to chance: fluctuating gains, pauses, noise of curvature.
//!
//! Each has a random stream of its own, so that one seed is one plant whatever else changes.

use rand_chacha::ChaCha8Rng;

use super::{FILE_RATES_PER_H, Fluctuation, Individual};
use crate::math;
use crate::random::{self, Purpose};

/// Ramps at the beginning and the end of a pause, in h.
const RAMP_H: f64 = 0.5;
/// Elongation while the primary leaves, and while the trifoliate leaf unfold, as a share.
const UNFOLDING_GROWTH: [f64; 2] = [0.5, 0.6];
/// Duration of the trifoliate leaf's unfolding over the primary leaves'.
const TRIFOLIATE_TIME: f64 = 0.8;
/// Median duration of an episode of no response, in h, and the standard deviation of its logarithm.
const EPISODE_H: (f64, f64) = (1.5, 0.6);
/// Least and most motility in such an episode, as a share.
const EPISODE_MOTILITY: (f64, f64) = (0.05, 0.35);

/// A time in which the plant bends or grows less.
#[derive(Clone, Debug, PartialEq)]
pub struct Pause {
    /// Its beginning, in h of age.
    pub start_h: f64,
    /// Its end, in h of age.
    pub end_h: f64,
    /// Motility in it, as a share.
    pub motility: f64,
    /// Elongation in it, as a share.
    pub growth: f64,
}

impl Pause {
    /// How much of it is in force: 0 outside, 1 inside, with ramps whose middles are its beginning and end.
    fn level(&self, age_h: f64) -> f64 {
        let rise = (age_h - self.start_h) / RAMP_H + 0.5;
        let fall = (self.end_h - age_h) / RAMP_H + 0.5;
        rise.min(fall).clamp(0.0, 1.0)
    }
}

/// Factors upon motility and elongation at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Factors {
    pub(super) motility: f64,
    pub(super) growth: f64,
}

/// The chance in one plant's life.
#[derive(Clone, Debug)]
pub(super) struct Chance {
    events: ChaCha8Rng,
    slow: ChaCha8Rng,
    /// Logarithms of the gains, Ornstein-Uhlenbeck.
    motility: f64,
    growth: f64,
    segments: ChaCha8Rng,
    pauses: Vec<Pause>,
    next_episode_h: f64,
}

impl Chance {
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
        let next_episode_h = waiting(&mut events, plant.pauses.episodes_per_h);
        let segments = random::stream(seed, Purpose::SegmentNoise, 0);
        Self { events, slow, motility, growth, segments, pauses, next_episode_h }
    }

    /// Phase of nutation at the start, in rad.
    pub(super) fn phase(&mut self) -> f64 {
        core::f64::consts::TAU * random::uniform(&mut self.slow)
    }

    /// The factors at `age_h`, once their fluctuation has gone on for `tick_h`.
    pub(super) fn factors(&mut self, plant: &Individual, age_h: f64, tick_h: f64) -> Factors {
        while self.next_episode_h <= age_h + RAMP_H {
            let start_h = self.next_episode_h;
            let (median, sigma) = EPISODE_H;
            let duration_h = median * math::exp(sigma * random::normal(&mut self.events));
            let (least, most) = EPISODE_MOTILITY;
            let motility = least + (most - least) * random::uniform(&mut self.events);
            self.pauses.push(Pause { start_h, end_h: start_h + duration_h, motility, growth: 1.0 });
            self.next_episode_h = start_h + waiting(&mut self.events, plant.pauses.episodes_per_h);
        }
        let Fluctuation { motility, motility_h, growth, growth_h, .. } = plant.fluctuation;
        let mut factors = Factors {
            motility: math::exp(self.motility - 0.5 * motility * motility),
            growth: math::exp(self.growth - 0.5 * growth * growth),
        };
        for pause in &self.pauses {
            let level = pause.level(age_h);
            factors.motility *= 1.0 - level * (1.0 - pause.motility);
            factors.growth *= 1.0 - level * (1.0 - pause.growth);
        }
        for (value, sigma, time_h) in
            [(&mut self.motility, motility, motility_h), (&mut self.growth, growth, growth_h)]
        {
            let kept = math::exp(-tick_h / time_h);
            *value = kept * *value + sigma * (1.0 - kept * kept).sqrt() * random::normal(&mut self.slow);
        }
        factors
    }

    /// How far nutation's phase wanders in a tick, in rad.
    pub(super) fn wander(&mut self, plant: &Individual, tick_h: f64) -> f64 {
        plant.fluctuation.phase * (FILE_RATES_PER_H * tick_h).sqrt() * random::normal(&mut self.slow)
    }

    /// One draw of a segment's curvature noise over a tick, in 1/cm.
    pub(super) fn curvature(&mut self, plant: &Individual, tick_h: f64) -> f64 {
        plant.fluctuation.curvature * tick_h.sqrt() * random::normal(&mut self.segments)
    }

    /// The pauses known so far.
    pub(super) fn pauses(&self) -> &[Pause] {
        &self.pauses
    }
}

/// Time to the next event of a Poisson process, in h; for ever at rate 0.
fn waiting(rng: &mut ChaCha8Rng, per_h: f64) -> f64 {
    let drawn = -math::ln(1.0 - random::uniform(rng));
    if per_h > 0.0 { drawn / per_h } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pause_ramps_about_its_ends() {
        let pause = Pause { start_h: 10.0, end_h: 12.0, motility: 0.1, growth: 1.0 };
        for (age_h, level) in [(9.7, 0.0), (10.0, 0.5), (10.3, 1.0), (11.0, 1.0), (12.0, 0.5), (12.3, 0.0)] {
            assert!((pause.level(age_h) - level).abs() < 1e-12, "{age_h}");
        }
    }

    #[test]
    fn gains_have_mean_one_and_episodes_come_at_their_rate() {
        let plant = Individual::default();
        let (mut motility, mut episodes) = (0.0, 0);
        for seed in 0..200 {
            let mut chance = Chance::new(&plant, seed);
            for step in 0..1000 {
                motility += math::exp(chance.motility - 0.5 * 0.38 * 0.38) / 200_000.0;
                chance.factors(&plant, f64::from(step) / 12.0, 1.0 / 12.0);
            }
            episodes += chance.pauses().len() - 2;
        }
        assert!((motility - 1.0).abs() < 0.03, "{motility}");
        let expected = 200.0 * 1000.0 / 12.0 / 18.0;
        assert!((episodes as f64 / expected - 1.0).abs() < 0.1, "{episodes} against {expected}");
    }
}
