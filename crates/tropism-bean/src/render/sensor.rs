//! Lens blur and sensor noise, in integer arithmetic: they touch every pixel of every photograph.

use rand::Rng;
use tropism::math;
use tropism::random::{Purpose, normal, stream};

/// A Gaussian kernel in 256ths.
#[derive(Clone, Debug)]
pub(super) struct Blur {
    /// Weights from the centre outwards.
    weights: Vec<u16>,
}

impl Blur {
    /// A blur of standard deviation `sigma`, in pixels.
    pub(super) fn new(sigma: f64) -> Self {
        let reach = (2.5 * sigma).ceil() as usize;
        let bell: Vec<f64> = (0..=reach)
            .map(|far| math::exp(-0.5 * (far as f64 / sigma.max(1e-3)) * (far as f64 / sigma.max(1e-3))))
            .collect();
        let whole = bell[0] + 2.0 * bell[1..].iter().sum::<f64>();
        let mut weights: Vec<u16> =
            bell.iter().map(|weight| (256.0 * weight / whole).round() as u16).collect();
        weights[0] = 256 - 2 * weights[1..].iter().sum::<u16>();
        while weights.len() > 1 && weights.last() == Some(&0) {
            weights.pop();
        }
        Self { weights }
    }

    /// How far a pixel spreads, in pixels.
    pub(super) fn reach(&self) -> usize {
        self.weights.len() - 1
    }

    /// Blurs rows of `width` pixels of `channels` bytes each, in place; the edge is continued outwards.
    pub(super) fn apply(&self, bytes: &mut [u8], width: usize, channels: usize) {
        if self.reach() == 0 || bytes.is_empty() {
            return;
        }
        let (stride, reach) = (width * channels, self.reach());
        let mut wide = vec![0; stride + 2 * reach * channels];
        let mut sums = vec![0_u16; stride];
        for row in bytes.chunks_exact_mut(stride) {
            for step in 0..reach {
                wide[step * channels..(step + 1) * channels].copy_from_slice(&row[..channels]);
                let end = (reach + width + step) * channels;
                wide[end..end + channels].copy_from_slice(&row[stride - channels..]);
            }
            wide[reach * channels..reach * channels + stride].copy_from_slice(row);
            let shifted = |step: usize| &wide[step * channels..step * channels + stride];
            self.weigh(&mut sums, row, |offset| shifted((reach as isize + offset) as usize));
        }
        let height = bytes.len() / stride;
        let source = bytes.to_vec();
        for (y, row) in bytes.chunks_exact_mut(stride).enumerate() {
            self.weigh(&mut sums, row, |offset| {
                let from = (y as isize + offset).clamp(0, height as isize - 1) as usize;
                &source[from * stride..(from + 1) * stride]
            });
        }
    }

    fn weigh<'a>(&self, sums: &mut [u16], out: &mut [u8], line: impl Fn(isize) -> &'a [u8]) {
        // Half, for rounding; the weights' sum of 256 leaves room for it below 65 536.
        sums.fill(128);
        let mut add = |weight: u16, line: &[u8]| {
            for (sum, &byte) in sums.iter_mut().zip(line) {
                *sum += weight * u16::from(byte);
            }
        };
        for (far, &weight) in (0_isize..).zip(&self.weights) {
            add(weight, line(far));
            if far > 0 {
                add(weight, line(-far));
            }
        }
        for (byte, &sum) in out.iter_mut().zip(sums.iter()) {
            *byte = (sum >> 8) as u8;
        }
    }
}

/// Sensor noise: each row takes a random section of a precomputed sequence.
///
/// Noise affects luma alone: chroma subsampling removes that of colour.
#[derive(Clone, Debug)]
pub(super) struct Noise {
    seed: u64,
    tape: Vec<i8>,
}

/// Pixels on the tape beyond one row. Chosen: rows rarely begin at the same place.
const TAPE: usize = 1 << 14;

/// Standard deviation of the brightness over that of one colour, where two thirds of the variance are common to all.
pub(super) const GREY: f64 = 0.90;

impl Noise {
    /// Noise of standard deviation `sigma` grey levels, for rows of `width` bytes.
    pub(super) fn new(seed: u64, sigma: f64, width: usize) -> Self {
        if sigma == 0.0 {
            return Self { seed, tape: Vec::new() };
        }
        let mut rng = stream(seed, Purpose::Camera, u64::MAX);
        let level = |_| (sigma * normal(&mut rng)).round().clamp(-127.0, 127.0) as i8;
        Self { seed, tape: (0..TAPE + width).map(level).collect() }
    }

    /// Adds the noise of photograph `frame` to rows of `width` bytes. What the sensor clipped stays clipped.
    pub(super) fn add(&self, bytes: &mut [u8], width: usize, frame: u64) {
        if self.tape.is_empty() {
            return;
        }
        let mut rng = stream(self.seed, Purpose::Camera, frame);
        for row in bytes.chunks_exact_mut(width) {
            let start = rng.next_u32() as usize % TAPE;
            for (byte, &noise) in row.iter_mut().zip(&self.tape[start..]) {
                let noisy = byte.saturating_add_signed(noise);
                *byte = if *byte == u8::MAX { u8::MAX } else { noisy };
            }
        }
    }
}
