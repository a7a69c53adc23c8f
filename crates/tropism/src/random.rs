//! Every random number descends from one seed, through streams keyed by purpose.
//!
//! A stream is named by what it is for and for whom (which plant, which genome), never by when it is opened: neither the
//! number of threads nor the order of work can change a result.

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;

use crate::math::{self, Lanes, Real};

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
    /// Seeds of the plants on which finished controllers are judged: none of them is a plant of an experiment.
    Judge = 11,
    /// Seeds of the plants that stand for a species, with which a single plant is compared.
    Reference = 12,
    /// Resamples of the bootstrap.
    Bootstrap = 13,
    /// Mutations of an evolution strategy.
    Search = 14,
    /// Seeds of the virtual plants on which a rule is tuned: none of them is a plant of an experiment or judges.
    Tuning = 15,
    /// Random sequences of targets.
    Targets = 16,
    /// Random schedules of lamps.
    Schedule = 17,
    /// First weights of a recurrent network, and the order of its examples.
    Training = 18,
    /// Simulated plants of a forecast.
    Forecast = 19,
    /// Seeds of searches that begin side by side.
    Start = 21,
    /// Virtual plants on which a measurement checks itself.
    SelfCheck = 22,
    /// Permutations of plants between groups.
    Permutation = 23,
    /// Sensors, messages and faults of the nodes of a wall, and its random paths.
    Nodes = 24,
    /// Examples and features from which the trees of a random forest learn.
    Forest = 25,
}

/// The stream of `seed` for `purpose`, number `index`.
///
/// Streams of different seeds, purposes or indices are independent of each other.
#[must_use]
pub fn stream(seed: u64, purpose: Purpose, index: u64) -> ChaCha8Rng {
    tropism_neat::keyed_stream(seed, purpose as u64, index)
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

/// Fills `draws` with standard normal draws: pairs of Box-Muller, four side by side.
pub fn fill_normal(draws: &mut [f64], rng: &mut impl Rng) {
    for draws in draws.chunks_mut(8) {
        let of_radius = Lanes::<4>::from_fn(|_| 1.0 - uniform(rng));
        let radius = (math::ln(of_radius) * -2.0).sqrt();
        let (sin, cos) = math::sin_cos(Lanes::<4>::from_fn(|_| core::f64::consts::TAU * uniform(rng)));
        let (first, second) = draws.split_at_mut(draws.len().min(4));
        first.copy_from_slice(&(radius * cos).0[..first.len()]);
        second.copy_from_slice(&(radius * sin).0[..second.len()]);
    }
}

/// Standard normal draws of one episode, addressed by step.
///
/// Philox4x32-10, a counter-based generator (Salmon et al. 2011, doi:10.1145/2063384.2063405), turns seed and episode into
/// a key; a hash turns key and step into 32 bits. Any draw can be computed without those before it, so plants may be
/// advanced one by one, in any order, or many side by side. `approx_normal` maps the bits to a normal draw.
///
/// ```
/// use tropism::random::{NoiseStream, Purpose};
/// let noise = NoiseStream::new(1, Purpose::Growth, [0, 7, 0]);
/// assert_eq!(noise.normal(360), noise.normal(360));
/// assert_eq!(noise.at(360).normal(), noise.normal(360));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoiseStream {
    key: [u32; 2],
}

impl NoiseStream {
    /// The stream of an episode under `seed`. Three numbers name the episode, such as generation, individual and
    /// repetition; 24 bits of the last one count, the purpose fills the rest.
    #[must_use]
    pub const fn new(seed: u64, purpose: Purpose, [first, second, third]: [u32; 3]) -> Self {
        let tagged = (third & 0x00ff_ffff) | ((purpose as u32) << 24);
        let [one, other, ..] = philox([0, first, second, tagged], [seed as u32, (seed >> 32) as u32]);
        Self { key: [one, other] }
    }

    /// The first standard normal draw of `step`.
    #[must_use]
    #[inline]
    pub fn normal(&self, step: u32) -> f64 {
        approx_normal(noise_bits(self.key, step)).into()
    }

    /// All draws of `step`, one after the other.
    #[must_use]
    #[inline]
    pub const fn at(&self, step: u32) -> StepNoise {
        StepNoise { key: self.key, step, drawn: 0 }
    }

    /// Draws for what a plant is from the start: its individual parameters.
    #[must_use]
    pub const fn of_seedling(&self) -> StepNoise {
        self.at(u32::MAX)
    }

    /// The key of [`noise_bits`].
    #[inline]
    pub(crate) const fn key(&self) -> [u32; 2] {
        self.key
    }
}

/// The standard normal draws of one step of an episode: as many as a model needs.
#[derive(Clone, Debug)]
pub struct StepNoise {
    key: [u32; 2],
    step: u32,
    drawn: u32,
}

impl StepNoise {
    /// The next draw. The first one of a step is [`NoiseStream::normal`]; all are independent.
    #[inline]
    pub fn normal(&mut self) -> f64 {
        let number = self.drawn;
        self.drawn += 1;
        if number == 0 {
            return approx_normal(noise_bits(self.key, self.step)).into();
        }
        let [bits, ..] = philox([number, self.step, 0, 0], self.key);
        approx_normal(bits).into()
    }

    /// A uniform draw from `[0, 1)`, in steps of 2^-32.
    pub fn uniform(&mut self) -> f64 {
        self.drawn += 1;
        let [bits, ..] = philox([self.drawn - 1, self.step, 1, 0], self.key);
        f64::from(bits) * (0.5_f64).powi(32)
    }
}

/// Increment of the key from one step to the next: 2^32 divided by the golden ratio (Weyl sequence), which spreads
/// consecutive steps evenly.
pub(crate) const STEP_INCREMENT: u32 = 0x9e37_79b9;

/// 32 random bits for a step.
///
/// Two rounds of xor-shift and multiplication with the low-bias multipliers of C. Wellons' hash-prospector search
/// (`lowbias32`), with the second half of the key mixed in between, so that the correlation of two steps depends on a
/// secret of the episode.
#[inline(always)]
pub(crate) const fn noise_bits(key: [u32; 2], step: u32) -> u32 {
    let begun = key[0].wrapping_add(step.wrapping_mul(STEP_INCREMENT));
    let once = (begun ^ (begun >> 16) ^ key[1]).wrapping_mul(0x7feb_352d);
    (once ^ (once >> 15)).wrapping_mul(0x846c_a68b)
}

/// An approximate standard normal draw: the sum of four bytes (Irwin-Hall), corrected by a cubic.
///
/// Mean, variance, third and fourth moments are those of the normal distribution; the distribution function is met within
/// 0.0021, and the largest value is 4.04. Against the standard deviation of 0.01 cm in eq. (4) the error is negligible,
/// and these few operations give the same bits in a vector, on any machine. The two coefficients solve the equations of
/// the second and fourth moment (tested below).
#[inline(always)]
pub(crate) fn approx_normal(bits: u32) -> f32 {
    const BYTES: u32 = 0x00ff_00ff;
    let pairs = (bits & BYTES) + ((bits >> 8) & BYTES);
    let sum = (pairs & 0xffff) + (pairs >> 16);
    let centred = (sum as i32 - 510) as f32;
    centred * (0.006_421_040_6 + 5.773_954e-9 * (centred * centred))
}

/// Ten rounds of Philox4x32: 128 random bits for a counter and a key.
#[must_use]
#[inline]
pub const fn philox(mut counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    let mut round = 0;
    while round < 10 {
        counter = philox_round(counter, [round_key(key[0], 0, round), round_key(key[1], 1, round)]);
        round += 1;
    }
    counter
}

#[inline(always)]
const fn philox_round(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    let left = 0xd251_1f53_u64 * counter[0] as u64;
    let right = 0xcd9e_8d57_u64 * counter[2] as u64;
    [
        (right >> 32) as u32 ^ counter[1] ^ key[0],
        right as u32,
        (left >> 32) as u32 ^ counter[3] ^ key[1],
        left as u32,
    ]
}

/// Half `which` of the key in a round.
#[inline(always)]
const fn round_key(key: u32, which: usize, round: u32) -> u32 {
    key.wrapping_add([0x9e37_79b9_u32, 0xbb67_ae85][which].wrapping_mul(round))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn philox_gives_the_published_vectors() {
        assert_eq!(philox([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(philox([!0; 4], [!0; 2]), [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]);
    }

    #[test]
    fn the_corrected_sum_of_four_bytes_is_nearly_normal() {
        // How often each sum comes up among all 2^32.
        let mut ways = vec![1.0_f64];
        for _ in 0..4 {
            let mut next = vec![0.0; ways.len() + 255];
            for (sum, count) in ways.iter().enumerate() {
                next[sum..sum + 256].iter_mut().for_each(|ways| *ways += count / 256.0);
            }
            ways = next;
        }
        let spread = |sum: u32| {
            (0..4).fold((0, sum), |(bits, left), byte| {
                let share = left.min(255);
                (bits | share << (8 * byte), left - share)
            })
        };
        let (mut below, mut moments) = (0.0, [0.0; 4]);
        for (sum, share) in ways.iter().enumerate() {
            let z = f64::from(approx_normal(spread(sum as u32).0));
            (1..).zip(&mut moments).for_each(|(power, moment)| *moment += share * z.powi(power));
            let normal = 0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
            assert!((below + 0.5 * share - normal).abs() < 0.0021, "{z}");
            below += share;
        }
        for (found, wanted) in moments.iter().zip([0.0, 1.0, 0.0, 3.0]) {
            assert!((found - wanted).abs() < 1e-5, "{moments:?}");
        }
    }

    #[test]
    fn draws_are_standard_normal_and_named_by_episode_and_step() {
        let of = |episode| NoiseStream::new(3, Purpose::Growth, episode);
        let draws: Vec<f64> =
            (0..200).flat_map(|plant| (0..500).map(move |step| of([0, plant, 0]).normal(step))).collect();
        let moment = |power| draws.iter().map(|z| z.powi(power)).sum::<f64>() / draws.len() as f64;
        let moments = [1, 2, 3, 4].map(moment);
        for (found, wanted) in moments.iter().zip([0.0, 1.0, 0.0, 3.0]) {
            assert!((found - wanted).abs() < 0.05, "{moments:?}");
        }
        // What one step says of the next ones, and one episode of the next.
        for apart in [1, 2, 3, 7, 16, 500] {
            let pairs = draws.iter().zip(&draws[apart..]);
            let correlation = pairs.map(|(one, other)| one * other).sum::<f64>() / draws.len() as f64;
            assert!(correlation.abs() < 0.015, "{apart} apart: {correlation}");
        }
        let within = draws.iter().filter(|z| z.abs() < 1.0).count() as f64 / draws.len() as f64;
        assert!((within - 0.6827).abs() < 0.006, "{within}");
        assert_ne!(of([0, 1, 0]).normal(5), of([1, 0, 0]).normal(5));
        assert_ne!(of([0, 0, 0]).normal(5), NoiseStream::new(3, Purpose::Trial, [0, 0, 0]).normal(5));
    }

    #[test]
    fn further_draws_of_a_step_are_standard_normal_and_independent_of_the_first() {
        let draws: Vec<[f64; 3]> = (0..40_000)
            .map(|step| {
                let mut noise = NoiseStream::new(5, Purpose::Growth, [step / 500, 0, 0]).at(step % 500);
                [noise.normal(), noise.normal(), noise.normal()]
            })
            .collect();
        let mean =
            |value: &dyn Fn(&[f64; 3]) -> f64| draws.iter().map(value).sum::<f64>() / draws.len() as f64;
        for one in 0..3 {
            assert!(mean(&|draw| draw[one]).abs() < 0.02);
            for other in 0..3 {
                let wanted = f64::from(u8::from(one == other));
                assert!((mean(&|draw| draw[one] * draw[other]) - wanted).abs() < 0.03, "{one} {other}");
            }
        }
    }

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
    fn normal_draws_have_mean_zero_and_unit_variance() {
        let mut rng = stream(7, Purpose::Growth, 0);
        let alone: Vec<f64> = (0..100_000).map(|_| normal(&mut rng)).collect();
        let mut filled = vec![0.0; 100_003];
        fill_normal(&mut filled, &mut rng);
        for draws in [alone, filled] {
            let mean = draws.iter().sum::<f64>() / draws.len() as f64;
            let variance = draws.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / draws.len() as f64;
            assert!(mean.abs() < 0.015, "{mean}");
            assert!((variance - 1.0).abs() < 0.02, "{variance}");
        }
    }
}
