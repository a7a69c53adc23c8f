//! Every random number descends from one seed, through streams keyed by purpose.
//!
//! A stream is named by what it is for and for whom (which plant, which genome), never by when it is opened: neither the
//! number of threads nor the order of work can change a result.

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::math;

/// What a stream of random numbers is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Purpose {
    /// Individual parameters of a virtual bean.
    Individual = 1,
    /// Pauses and non-response episodes of a virtual bean.
    Events = 2,
    /// Slow fluctuation of a virtual bean's gains.
    Fluctuation = 3,
    /// Curvature noise along a virtual bean's stem.
    SegmentNoise = 4,
    /// The virtual camera's sensor noise and the detector's noise of `grow`.
    Camera = 5,
    /// The looks of the virtual tent: folds of the cloth, soil, leaf shape.
    Scene = 6,
    /// Growth in the tip-motion model, eq. (4), while evolving.
    Growth = 7,
    /// Growth in the tip-motion model, eq. (4), while choosing a champion or simulating a controller.
    Trial = 8,
    /// Seeds of evolutionary runs.
    Run = 9,
    /// Seeds of the plants of an experiment.
    Plant = 10,
}

/// The stream of `seed` for `purpose`, number `index`.
///
/// Streams of different seeds, purposes or indices are independent of each other.
#[must_use]
pub fn stream(seed: u64, purpose: Purpose, index: u64) -> ChaCha8Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&(purpose as u64).to_le_bytes());
    let mut rng = ChaCha8Rng::from_seed(key);
    rng.set_stream(index);
    rng
}

/// A seed of its own for `purpose`, number `index`, under `seed`.
#[must_use]
pub fn derive(seed: u64, purpose: Purpose, index: u64) -> u64 {
    stream(seed, purpose, index).next_u64()
}

/// A uniform draw from `[0, 1)`.
pub fn uniform(rng: &mut impl Rng) -> f64 {
    rng.random()
}

/// A draw from the standard normal distribution (Box-Muller; the second of the pair is dropped so that one call
/// always takes two words of the stream).
pub fn normal(rng: &mut impl Rng) -> f64 {
    let radius = (-2.0 * math::ln(1.0 - uniform(rng))).sqrt();
    radius * math::cos(core::f64::consts::TAU * uniform(rng))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_by_seed_purpose_and_index() {
        let word = |seed, purpose, index| stream(seed, purpose, index).next_u64();
        let first = word(1, Purpose::Growth, 0);
        assert_eq!(first, word(1, Purpose::Growth, 0));
        assert_ne!(first, word(2, Purpose::Growth, 0));
        assert_ne!(first, word(1, Purpose::Trial, 0));
        assert_ne!(first, word(1, Purpose::Growth, 1));
    }

    #[test]
    fn normal_has_mean_zero_and_unit_variance() {
        let mut rng = stream(7, Purpose::Growth, 0);
        let draws: Vec<f64> = (0..100_000).map(|_| normal(&mut rng)).collect();
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        let variance = draws.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / draws.len() as f64;
        assert!(mean.abs() < 0.015, "{mean}");
        assert!((variance - 1.0).abs() < 0.02, "{variance}");
    }
}
