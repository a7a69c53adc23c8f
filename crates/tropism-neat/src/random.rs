//! Random numbers: one ChaCha8 stream per child, so that results depend neither on threads nor on the order of work.
//!
//! A stream is keyed by the run's seed and its purpose. Streams of offspring are numbered by generation and individual.
//! All initial weights come from one stream, each at its own position.
//!
//! # References
//!
//! D. J. Bernstein, *ChaCha, a variant of Salsa20*, 2008, with 8 rounds.

use rand::Rng as _;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Purpose of a random stream: part of its key.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    /// Weights of initial populations.
    InitialWeights = 1,
    /// Selection, crossover and mutation of one child, numbered by generation and index of the child.
    Offspring = 2,
    /// Mutation of a start genome, numbered by index of the mutant in the initial population.
    Mutants = 3,
}

/// A random stream with the distributions that NEAT needs.
pub(crate) struct Rng {
    stream: ChaCha8Rng,
    /// Unused bits for coin flips, below a 1 bit that marks their end.
    coin_bits: u32,
}

/// The ChaCha8 stream number `index` of a seed and a purpose, which together are its key: streams of different seeds,
/// purposes or indices are independent of each other.
#[must_use]
pub fn keyed_stream(seed: u64, purpose: u64, index: u64) -> ChaCha8Rng {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&purpose.to_le_bytes());
    let mut stream = ChaCha8Rng::from_seed(key);
    stream.set_stream(index);
    stream
}

impl Rng {
    /// Stream number `index` of a seed and a purpose.
    pub(crate) fn new(seed: u64, purpose: Purpose, index: u64) -> Self {
        Self { stream: keyed_stream(seed, purpose as u64, index), coin_bits: 1 }
    }

    /// The stream of initial weights, from weight number `first` on.
    pub(crate) fn for_initial_weights(seed: u64, first: u128) -> Self {
        let mut rng = Self::new(seed, Purpose::InitialWeights, 0);
        // Each weight takes two words: see `triangular`.
        rng.stream.set_word_pos(2 * first);
        rng
    }

    /// Draws uniformly from `[0, 1)`, in steps of 2^-32.
    #[inline]
    pub(crate) fn uniform(&mut self) -> f64 {
        f64::from(self.stream.next_u32()) * (1.0 / 4_294_967_296.0)
    }

    /// Draws from the triangular distribution on `(-1, 1)`, as the difference of two uniform draws. Standard deviation 0.408.
    ///
    /// MultiNEAT draws its signed random numbers in this way.
    #[inline]
    pub(crate) fn triangular(&mut self) -> f64 {
        self.uniform() - self.uniform()
    }

    /// Draws `true` with probability `p`.
    #[inline]
    pub(crate) fn bernoulli(&mut self, p: f64) -> bool {
        self.uniform() < p
    }

    /// Draws `true` with probability one half. Each word of the stream serves 31 flips.
    #[inline]
    pub(crate) fn coin(&mut self) -> bool {
        if self.coin_bits == 1 {
            self.coin_bits = self.stream.next_u32() | 1 << 31;
        }
        let heads = self.coin_bits & 1 == 1;
        self.coin_bits >>= 1;
        heads
    }

    /// Draws an integer uniformly from `0..n`, for `n` below 2^32. Probabilities are biased by less than 2^-32.
    #[inline]
    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((u64::from(self.stream.next_u32()) * n as u64) >> 32) as usize
    }

    /// Draws an index in proportion to non-negative `weights`; `None` if all weights are zero.
    pub(crate) fn roulette(&mut self, weights: impl Iterator<Item = f64> + Clone) -> Option<usize> {
        let total: f64 = weights.clone().sum();
        let mut remaining = self.uniform() * total;
        let mut last_positive = None;
        for (index, weight) in weights.enumerate().filter(|&(_, weight)| weight > 0.0) {
            if remaining < weight {
                return Some(index);
            }
            remaining -= weight;
            last_positive = Some(index);
        }
        // Rounding may leave a remainder after the last weight.
        last_positive
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_by_seed_purpose_and_index() {
        let draw = |seed, purpose, index| Rng::new(seed, purpose, index).stream.next_u64();
        let first = draw(1, Purpose::Offspring, 0);
        assert_eq!(first, draw(1, Purpose::Offspring, 0));
        assert_ne!(first, draw(2, Purpose::Offspring, 0));
        assert_ne!(first, draw(1, Purpose::InitialWeights, 0));
        assert_ne!(first, draw(1, Purpose::Offspring, 1));
    }

    #[test]
    fn triangular_draws_have_the_shape_and_deviation_of_a_triangle() {
        let mut rng = Rng::new(1, Purpose::Offspring, 0);
        let draws: Vec<f64> = (0..100_000).map(|_| rng.triangular()).collect();
        let n = draws.len() as f64;
        let mean = draws.iter().sum::<f64>() / n;
        let deviation = (draws.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / n).sqrt();
        assert!(draws.iter().all(|s| s.abs() < 1.0));
        assert!(mean.abs() < 0.005, "{mean}");
        assert!((deviation - 0.408).abs() < 0.003, "{deviation}");
        // Three quarters of a triangular distribution on (-1, 1) lie in (-0.5, 0.5); of a uniform one, only half.
        let central = draws.iter().filter(|s| s.abs() < 0.5).count() as f64 / n;
        assert!((central - 0.75).abs() < 0.01, "{central}");
    }

    #[test]
    fn coin_flips_are_fair_and_uncorrelated() {
        let mut rng = Rng::new(1, Purpose::Offspring, 0);
        let coins: Vec<bool> = (0..100_000).map(|_| rng.coin()).collect();
        let share = |n: usize| n as f64 / coins.len() as f64;
        let heads = share(coins.iter().filter(|&&coin| coin).count());
        let repeats = share(coins.windows(2).filter(|pair| pair[0] == pair[1]).count());
        assert!((heads - 0.5).abs() < 0.005 && (repeats - 0.5).abs() < 0.005, "{heads}, {repeats}");
    }

    #[test]
    fn roulette_follows_the_weights_and_never_draws_a_zero() {
        let mut rng = Rng::new(1, Purpose::Offspring, 0);
        let mut drawn = [0_u32; 4];
        for _ in 0..40_000 {
            drawn[rng.roulette([0.0, 1.0, 3.0, 0.0].into_iter()).unwrap()] += 1;
        }
        assert_eq!((drawn[0], drawn[3]), (0, 0));
        assert!((f64::from(drawn[2]) / 40_000.0 - 0.75).abs() < 0.01, "{drawn:?}");
        assert_eq!(rng.roulette([0.0, 0.0].into_iter()), None);
    }
}
