//! Random numbers side by side, one stream a vector lane: the fast twin of [`uniform`](super::uniform) and
//! [`normal`](super::normal) on [`ChaCha8Rng`], with the same bits.
//!
//! # References
//! Bernstein 2008, "ChaCha, a variant of Salsa20": 8 rounds, and as in `rand_chacha` a counter and a stream of 64 bits each.

#![allow(clippy::needless_range_loop, reason = "a lane is an index into many arrays at once")]

use core::f64::consts::TAU;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::uniform;
use crate::math::lanes::{LANES, Row};
use crate::math::{self, Lanes};
use crate::simd::{Kernel, dispatch};

/// Words of a block of ChaCha.
const WORDS: usize = 16;
/// Uniform draws of half a block, of two words each: what [`Streams`] gives at a time.
pub const DRAWS: usize = 4;
/// Blocks that are computed at a time: with as many lanes of 32 bits a vector of AVX-512 is full.
const BLOCKS: usize = 2;
/// Half blocks of these.
const HALVES: usize = 2 * BLOCKS;

/// The streams of some plants, which are read half a block at a time.
pub struct Streams {
    /// First words of the blocks: constants, keys, counters and stream numbers.
    words: [[u32; LANES]; WORDS],
    counters: [u64; LANES],
    /// Whether a stream goes on in the middle of a block.
    is_odd: [bool; LANES],
}

impl Streams {
    /// No streams yet.
    pub fn new() -> Self {
        /// "expand 32-byte k".
        const CONSTANTS: [u32; 4] = [0x6170_7865, 0x3320_646e, 0x7962_2d32, 0x6b20_6574];
        let mut words = [[0; LANES]; WORDS];
        for (word, constant) in words.iter_mut().zip(CONSTANTS) {
            *word = [constant; LANES];
        }
        Self { words, counters: [0; LANES], is_odd: [false; LANES] }
    }

    /// Puts a stream into a lane, which then gives the draws that `rng` would give next; `rng` goes on after `halves` half
    /// blocks.
    ///
    /// # Panics
    /// Unless `rng` is at the beginning or in the middle of a block.
    pub fn take(&mut self, lane: usize, rng: &mut ChaCha8Rng, halves: usize) {
        const HALF: u128 = WORDS as u128 / 2;
        let position = rng.get_word_pos();
        assert!(position.is_multiple_of(HALF), "found word {position}, wanted the beginning of half a block");
        self.counters[lane] = (position / WORDS as u128) as u64;
        self.is_odd[lane] = position / HALF % 2 == 1;
        for (word, bytes) in self.words[4..12].iter_mut().zip(rng.get_seed().as_chunks().0) {
            word[lane] = u32::from_le_bytes(*bytes);
        }
        let stream = rng.get_stream();
        (self.words[14][lane], self.words[15][lane]) = (stream as u32, (stream >> 32) as u32);
        rng.set_word_pos(position + HALF * halves as u128);
    }

    /// The next uniform draws of all lanes, half a block after the other.
    #[inline(always)]
    pub fn draw(&self, halves: &mut [[Row; DRAWS]]) {
        let mut before = [[0.0; LANES]; DRAWS];
        for first in (0..=halves.len()).step_by(HALVES) {
            let blocks = self.blocks((first / 2) as u64);
            for half in 0..HALVES {
                let now = uniforms(&blocks, half);
                // What stands in the middle of a block in a lane is wanted one half sooner.
                if let Some(draws) = (first + half).checked_sub(1).and_then(|place| halves.get_mut(place)) {
                    self.choose(&now, &before, draws);
                }
                before = now;
            }
        }
    }

    /// `now` where a stream goes on in the middle of a block, else `before`.
    #[inline(always)]
    fn choose(&self, now: &[Row; DRAWS], before: &[Row; DRAWS], draws: &mut [Row; DRAWS]) {
        for draw in 0..DRAWS {
            for lane in 0..LANES {
                draws[draw][lane] = if self.is_odd[lane] { now[draw][lane] } else { before[draw][lane] };
            }
        }
    }

    /// The blocks `number` and following ones of all streams: word by word, the first block of all streams and then the second.
    #[inline(always)]
    fn blocks(&self, number: u64) -> [[u32; BLOCKS * LANES]; WORDS] {
        let mut begun = [[0; BLOCKS * LANES]; WORDS];
        for (both, word) in begun.iter_mut().zip(&self.words) {
            both[..LANES].copy_from_slice(word);
            both[LANES..].copy_from_slice(word);
        }
        for lane in 0..BLOCKS * LANES {
            let counter = self.counters[lane % LANES].wrapping_add(number + (lane / LANES) as u64);
            (begun[12][lane], begun[13][lane]) = (counter as u32, (counter >> 32) as u32);
        }
        let mut blocks = [[0; BLOCKS * LANES]; WORDS];
        for lane in 0..BLOCKS * LANES {
            let mut x = [0; WORDS];
            for word in 0..WORDS {
                x[word] = begun[word][lane];
            }
            let x = double_round(double_round(double_round(double_round(x))));
            for word in 0..WORDS {
                blocks[word][lane] = x[word].wrapping_add(begun[word][lane]);
            }
        }
        blocks
    }
}

/// A round on columns, and one on diagonals.
#[inline(always)]
fn double_round(x: [u32; WORDS]) -> [u32; WORDS] {
    let [x0, x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12, x13, x14, x15] = x;
    let [x0, x4, x8, x12] = quarter_round([x0, x4, x8, x12]);
    let [x1, x5, x9, x13] = quarter_round([x1, x5, x9, x13]);
    let [x2, x6, x10, x14] = quarter_round([x2, x6, x10, x14]);
    let [x3, x7, x11, x15] = quarter_round([x3, x7, x11, x15]);
    let [x0, x5, x10, x15] = quarter_round([x0, x5, x10, x15]);
    let [x1, x6, x11, x12] = quarter_round([x1, x6, x11, x12]);
    let [x2, x7, x8, x13] = quarter_round([x2, x7, x8, x13]);
    let [x3, x4, x9, x14] = quarter_round([x3, x4, x9, x14]);
    [x0, x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12, x13, x14, x15]
}

#[inline(always)]
fn quarter_round([a, b, c, d]: [u32; 4]) -> [u32; 4] {
    let a = a.wrapping_add(b);
    let d = (d ^ a).rotate_left(16);
    let c = c.wrapping_add(d);
    let b = (b ^ c).rotate_left(12);
    let a = a.wrapping_add(b);
    let d = (d ^ a).rotate_left(8);
    let c = c.wrapping_add(d);
    let b = (b ^ c).rotate_left(7);
    [a, b, c, d]
}

/// The uniform draws of half a block, of which `blocks` hold [`HALVES`] for each stream.
#[inline(always)]
fn uniforms(blocks: &[[u32; BLOCKS * LANES]; WORDS], half: usize) -> [Row; DRAWS] {
    /// 2^-53.
    const UNIT: f64 = 1.0 / (1_u64 << 53) as f64;
    let (block, first) = (half / 2 * LANES, half % 2 * (WORDS / 2));
    let mut draws = [[0.0; LANES]; DRAWS];
    for draw in 0..DRAWS {
        let [low, high] = [&blocks[first + 2 * draw], &blocks[first + 2 * draw + 1]];
        for lane in 0..LANES {
            let bits = (u64::from(high[block + lane]) << 32) | u64::from(low[block + lane]);
            draws[draw][lane] = UNIT * (bits >> 11) as f64;
        }
    }
    draws
}

/// Fills `draws` with what as many calls of [`normal`](super::normal) give.
pub fn fill_normal(draws: &mut [f64], rng: &mut impl Rng) {
    for draws in draws.chunks_mut(LANES) {
        let [mut of_radius, mut of_angle] = [[0.0; LANES]; 2];
        for lane in 0..draws.len() {
            (of_radius[lane], of_angle[lane]) = (uniform(rng), uniform(rng));
        }
        draws.copy_from_slice(&dispatch(Normal { of_radius, of_angle })[..draws.len()]);
    }
}

/// [`normal`] as a kernel.
struct Normal {
    of_radius: Row,
    of_angle: Row,
}

impl Kernel for Normal {
    type Result = Row;

    #[inline(always)]
    fn run(self) -> Row {
        normal(&self.of_radius, &self.of_angle)
    }
}

/// [`normal`](super::normal) of all lanes, from its two uniform draws.
#[inline(always)]
pub fn normal(of_radius: &Row, of_angle: &Row) -> Row {
    let mut angle = [0.0; LANES];
    for lane in 0..LANES {
        angle[lane] = TAU * of_angle[lane];
    }
    let cos = math::cos(Lanes(angle)).0;
    let ln = math::ln(Lanes(of_radius.map(|share| 1.0 - share))).0;
    let mut result = [0.0; LANES];
    for lane in 0..LANES {
        result[lane] = (-2.0 * ln[lane]).sqrt() * cos[lane];
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{self, Purpose};

    #[test]
    fn streams_side_by_side_have_the_bits_of_each() {
        for count in 0..12 {
            let mut streams = Streams::new();
            let mut plain = Vec::new();
            for lane in 0..LANES {
                let mut rng = random::stream(7, Purpose::SegmentNoise, lane as u64 + (1 << 40));
                // The counters of some pass 2^32.
                rng.set_word_pos((1 << 36) - 40 + 8 * lane as u128);
                plain.push(rng.clone());
                streams.take(lane, &mut rng, count);
                let mut after = plain[lane].clone();
                (0..DRAWS * count).for_each(|_| _ = random::uniform(&mut after));
                assert_eq!(random::uniform(&mut rng), random::uniform(&mut after));
            }
            let mut halves = vec![[[0.0; LANES]; DRAWS]; count];
            streams.draw(&mut halves);
            for draws in halves.as_flattened() {
                assert_eq!(*draws, core::array::from_fn(|lane| random::uniform(&mut plain[lane])));
            }
        }
    }

    #[test]
    fn normal_draws_side_by_side_have_the_bits_of_each() {
        let mut rng = random::stream(7, Purpose::Camera, 0);
        for count in [0, 1, 7, 8, 18, 2000] {
            let mut same = rng.clone();
            let mut draws = vec![0.0; count];
            fill_normal(&mut draws, &mut rng);
            assert!(draws.iter().all(|draw| *draw == random::normal(&mut same)));
            assert_eq!(rng.get_word_pos(), same.get_word_pos());
        }
    }
}
