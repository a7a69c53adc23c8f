//! Random numbers: a stream of its own for every birth, so that nothing depends on threads or on who is born first.
//!
//! A stream is keyed by the run's seed and by what it is for. Births are numbered by generation and individual; initial
//! weights share one stream, each with a place of its own.

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// What a stream is for.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    /// Weights of initial populations.
    Origin = 1,
    /// Selection, crossover and mutation of one child, numbered by generation and place in it.
    Birth = 2,
}

/// One stream of random draws.
pub(crate) struct Dice {
    stream: ChaCha8Rng,
    /// Bits left over for coins, above a highest one that marks their end.
    coins: u32,
}

impl Dice {
    /// The stream of `seed` for `purpose`, number `index`.
    pub(crate) fn new(seed: u64, purpose: Purpose, index: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&(purpose as u64).to_le_bytes());
        let mut stream = ChaCha8Rng::from_seed(key);
        stream.set_stream(index);
        Self { stream, coins: 1 }
    }

    /// The stream of initial weights, from so many of them on.
    pub(crate) fn of_origin(seed: u64, weights: u128) -> Self {
        let mut dice = Self::new(seed, Purpose::Origin, 0);
        // Two words for each.
        dice.stream.set_word_pos(2 * weights);
        dice
    }

    /// A uniform draw from `[0, 1)`, in steps of 2^-32.
    #[inline]
    pub(crate) fn uniform(&mut self) -> f64 {
        f64::from(self.stream.next_u32()) * (1.0 / 4_294_967_296.0)
    }

    /// The difference of two uniform draws: triangular on `(-1, 1)`, standard deviation 0.408.
    #[inline]
    pub(crate) fn signed(&mut self) -> f64 {
        self.uniform() - self.uniform()
    }

    /// True with probability `p`.
    #[inline]
    pub(crate) fn chance(&mut self, p: f64) -> bool {
        self.uniform() < p
    }

    /// True half of the time. A word of the stream is good for 31 coins.
    #[inline]
    pub(crate) fn coin(&mut self) -> bool {
        if self.coins == 1 {
            self.coins = self.stream.next_u32() | 1 << 31;
        }
        let heads = self.coins & 1 == 1;
        self.coins >>= 1;
        heads
    }

    /// A uniform whole number below `n` (at most 2^32 minus 1; the bias is below `n` in 2^32).
    #[inline]
    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((u64::from(self.stream.next_u32()) * n as u64) >> 32) as usize
    }

    /// An index drawn in proportion to `weights` (not negative); `None` when all of them are zero.
    pub(crate) fn roulette(&mut self, weights: impl Iterator<Item = f64> + Clone) -> Option<usize> {
        let total: f64 = weights.clone().sum();
        let mut left = self.uniform() * total;
        let mut last = None;
        for (index, weight) in weights.enumerate().filter(|&(_, weight)| weight > 0.0) {
            if left < weight {
                return Some(index);
            }
            left -= weight;
            last = Some(index);
        }
        last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_by_seed_purpose_and_index() {
        let draw = |seed, purpose, index| Dice::new(seed, purpose, index).stream.next_u64();
        let first = draw(1, Purpose::Birth, 0);
        assert_eq!(first, draw(1, Purpose::Birth, 0));
        assert_ne!(first, draw(2, Purpose::Birth, 0));
        assert_ne!(first, draw(1, Purpose::Origin, 0));
        assert_ne!(first, draw(1, Purpose::Birth, 1));
    }

    #[test]
    fn a_signed_draw_is_triangular() {
        let mut dice = Dice::new(1, Purpose::Birth, 0);
        let draws: Vec<f64> = (0..100_000).map(|_| dice.signed()).collect();
        let n = draws.len() as f64;
        let mean = draws.iter().sum::<f64>() / n;
        let deviation = (draws.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / n).sqrt();
        assert!(draws.iter().all(|s| s.abs() < 1.0));
        assert!(mean.abs() < 0.005, "{mean}");
        assert!((deviation - 0.408).abs() < 0.003, "{deviation}");
        // Of a triangle on (-1, 1), three quarters lie within a half of the middle; of a uniform draw, one half would.
        let central = draws.iter().filter(|s| s.abs() < 0.5).count() as f64 / n;
        assert!((central - 0.75).abs() < 0.01, "{central}");
    }

    #[test]
    fn coins_are_fair_and_do_not_follow_each_other() {
        let mut dice = Dice::new(1, Purpose::Birth, 0);
        let coins: Vec<bool> = (0..100_000).map(|_| dice.coin()).collect();
        let share = |n: usize| n as f64 / coins.len() as f64;
        let heads = share(coins.iter().filter(|&&coin| coin).count());
        let repeats = share(coins.windows(2).filter(|pair| pair[0] == pair[1]).count());
        assert!((heads - 0.5).abs() < 0.005 && (repeats - 0.5).abs() < 0.005, "{heads}, {repeats}");
    }

    #[test]
    fn roulette_follows_the_weights_and_never_draws_a_zero() {
        let mut dice = Dice::new(1, Purpose::Birth, 0);
        let mut drawn = [0_u32; 4];
        for _ in 0..40_000 {
            drawn[dice.roulette([0.0, 1.0, 3.0, 0.0].into_iter()).unwrap()] += 1;
        }
        assert_eq!((drawn[0], drawn[3]), (0, 0));
        assert!((f64::from(drawn[2]) / 40_000.0 - 0.75).abs() < 0.01, "{drawn:?}");
        assert_eq!(dice.roulette([0.0, 0.0].into_iter()), None);
    }
}
