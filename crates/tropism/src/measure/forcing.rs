//! The forcing of a plant by itself: circumnutation and slow drift, as a Gaussian process.
//!
//! Its covariance over the lag t is `s1^2 exp(-t / t1) + s2^2 exp(-t / t2) cos(2 pi t / T)`: an Ornstein-Uhlenbeck process, and an
//! oscillation whose phase wanders.

use core::f64::consts::TAU;

use crate::math::cholesky::Cholesky;
use crate::math::{cos, exp, ln};

/// Amplitudes, correlation times and period of the forcing, and the noise of the points; all as natural logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Forcing(pub(super) [f64; 6]);

/// Places in [`Forcing`].
pub(super) const DRIFT: usize = 0;
pub(super) const DRIFT_H: usize = 1;
pub(super) const SWING: usize = 2;
pub(super) const PERIOD: usize = 3;
pub(super) const COHERENCE: usize = 4;
pub(super) const NOISE: usize = 5;

impl Forcing {
    /// Standard deviation of the noise of the points across the stem, in cm.
    pub(super) fn noise_cm(&self) -> f64 {
        exp(self.0[NOISE])
    }

    /// Covariance of the forcing at two times `lag_h` apart.
    fn covariance(&self, lag_h: f64) -> f64 {
        let [drift, drift_h, swing, period, coherence, _] = self.0.map(exp);
        drift * drift * exp(-lag_h / drift_h)
            + swing * swing * exp(-lag_h / coherence) * cos(TAU * lag_h / period)
    }

    /// The inverse of the covariance of `knots` values `knot_h` apart, row by row, and the logarithm of the covariance's
    /// determinant; `None` if it is singular.
    ///
    /// [`durbin`] and the formula of Gohberg and Semencul for Toeplitz matrices (Golub and Van Loan 2013, section 4.7).
    pub(super) fn precision(&self, knots: usize, knot_h: f64) -> Option<(Vec<f64>, f64)> {
        let mut lags: Vec<f64> = (0..knots).map(|lag| self.covariance(lag as f64 * knot_h)).collect();
        // The rounding of a nearly singular matrix.
        lags[0] *= 1.0 + 1e-6;
        let (mut predictor, mut variance) = (Vec::new(), 0.0);
        let ln_determinant = durbin(&lags, |order, weights, error| {
            if order + 1 == knots {
                (predictor, variance) = (weights.to_vec(), error);
            }
        })?;
        let mut inverse = vec![0.0; knots * knots];
        let later = |at: usize| if at == 0 { 0.0 } else { predictor[knots - at] };
        for row in 0..knots {
            for column in 0..=row {
                let before = if column == 0 { 0.0 } else { inverse[(row - 1) * knots + column - 1] };
                let value =
                    before + (predictor[row] * predictor[column] - later(row) * later(column)) / variance;
                inverse[row * knots + column] = value;
                inverse[column * knots + row] = value;
            }
        }
        Some((inverse, ln_determinant))
    }

    /// A draw of the forcing at `knots` times `knot_h` apart, from as many standard normal draws.
    pub(super) fn draw(&self, knot_h: f64, normal: &[f64]) -> Option<Vec<f64>> {
        let knots = normal.len();
        let at = |number: usize| self.covariance((number / knots).abs_diff(number % knots) as f64 * knot_h);
        let mut matrix: Vec<f64> = (0..knots * knots).map(at).collect();
        (0..knots).for_each(|knot| matrix[knot * knots + knot] *= 1.0 + 1e-6);
        Some(Cholesky::of(matrix, knots)?.times(normal))
    }

    /// Twice the negative logarithm of the prior density of amplitudes and times, up to a constant.
    ///
    /// Wide: two thirds within a factor of 3 of a drift that is correlated over a twelfth of the record and of an oscillation that
    /// stays in phase for three periods. They keep a direction that the data do not decide from running away.
    pub(super) fn penalty(&self, duration_h: f64) -> f64 {
        let apart = |at: usize, middle: f64, width: f64| ((self.0[at] - middle) / width).powi(2);
        let period = self.0[PERIOD];
        apart(DRIFT_H, ln(duration_h / 12.0), ln(3.0))
            + apart(PERIOD, ln(duration_h / 8.0), ln(3.0))
            + apart(COHERENCE, period + ln(3.0), ln(3.0))
    }
}

/// Durbin's recursion: for each value of a stationary series with these covariances, passes its place, the weights with which it
/// and those before it (the latest first, its own is 1) make the error of its prediction, and the variance of that error. Returns
/// the logarithm of the determinant of the covariance; `None` if it is singular.
pub(super) fn durbin(lags: &[f64], mut with: impl FnMut(usize, &[f64], f64)) -> Option<f64> {
    let mut predictor = vec![1.0];
    let mut variance = lags[0];
    let mut ln_determinant = 0.0;
    let mut backwards = Vec::new();
    for order in 0..lags.len() {
        if !(variance > 0.0 && variance.is_finite()) {
            return None;
        }
        ln_determinant += ln(variance);
        with(order, &predictor, variance);
        if order + 1 < lags.len() {
            let missed: f64 =
                predictor.iter().zip(lags[1..=order + 1].iter().rev()).map(|(a, lag)| a * lag).sum();
            let reflection = -missed / variance;
            predictor.push(0.0);
            backwards.clear();
            backwards.extend(predictor.iter().rev());
            predictor.iter_mut().zip(&backwards).for_each(|(a, back)| *a += reflection * back);
            variance *= 1.0 - reflection * reflection;
        }
    }
    Some(ln_determinant)
}

/// Minimises a function of `N` numbers from `start` with first steps of `step`, in at most `calls` calls.
///
/// Nelder and Mead 1965, doi:10.1093/comjnl/7.4.308.
pub(super) fn minimised<const N: usize>(
    start: [f64; N],
    step: f64,
    calls: usize,
    mut function: impl FnMut([f64; N]) -> f64,
) -> [f64; N] {
    // Not a number is never the least.
    let mut value_of =
        |at: [f64; N]| (Some(function(at)).filter(|value| !value.is_nan()).unwrap_or(f64::INFINITY), at);
    let mut corners = vec![value_of(start)];
    for axis in 0..N {
        let mut corner = start;
        corner[axis] += step;
        corners.push(value_of(corner));
    }
    let mut called = N + 1;
    while called < calls {
        corners.sort_by(|one, other| one.0.total_cmp(&other.0));
        let (best, worst, next_to_worst) = (corners[0].0, corners[N], corners[N - 1].0);
        if worst.0 - best < 1e-2 {
            break;
        }
        let centre: [f64; N] = core::array::from_fn(|axis| {
            corners[..N].iter().map(|corner| corner.1[axis]).sum::<f64>() / N as f64
        });
        let toward =
            |share: f64| core::array::from_fn(|axis| centre[axis] + share * (worst.1[axis] - centre[axis]));
        let reflected = value_of(toward(-1.0));
        called += 1;
        if reflected.0 < best {
            let expanded = value_of(toward(-2.0));
            called += 1;
            corners[N] = if expanded.0 < reflected.0 { expanded } else { reflected };
        } else if reflected.0 < next_to_worst {
            corners[N] = reflected;
        } else {
            let contracted = value_of(toward(if reflected.0 < worst.0 { -0.5 } else { 0.5 }));
            called += 1;
            if contracted.0 < worst.0.min(reflected.0) {
                corners[N] = contracted;
            } else {
                let nearest = corners[0].1;
                for corner in &mut corners[1..] {
                    *corner = value_of(core::array::from_fn(|axis| 0.5 * (nearest[axis] + corner.1[axis])));
                }
                called += N;
            }
        }
    }
    corners.sort_by(|one, other| one.0.total_cmp(&other.0));
    corners[0].1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_minimum_of_a_bent_valley_is_found() {
        let valley = |[x, y]: [f64; 2]| (1.0 - x).powi(2) + 100.0 * (y - x * x).powi(2) / (1.0 + x * x);
        let [x, y] = minimised([-1.0, 1.0], 0.5, 400, valley);
        assert!(valley([x, y]) < 0.02, "{x} {y}");
    }

    #[test]
    fn an_oscillation_is_anticorrelated_half_a_period_later() {
        let forcing = Forcing([0.001, 1.0, 0.2, 2.0, 20.0, 0.01].map(ln));
        assert!(forcing.covariance(1.0) < -0.9 * forcing.covariance(0.0));
    }

    #[test]
    fn the_precision_of_the_forcing_is_the_inverse_of_its_covariance() {
        let forcing = Forcing([0.1, 1.0, 0.2, 2.0, 5.0, 0.01].map(ln));
        let (precision, ln_determinant) = forcing.precision(20, 0.2).unwrap();
        let at = |number: usize| forcing.covariance((number / 20).abs_diff(number % 20) as f64 * 0.2);
        let mut matrix: Vec<f64> = (0..400).map(at).collect();
        (0..20).for_each(|knot| matrix[knot * 21] *= 1.0 + 1e-6);
        let factor = Cholesky::of(matrix, 20).unwrap();
        assert!((factor.ln_determinant() - ln_determinant).abs() < 1e-6);
        for (one, other) in factor.inverse().iter().zip(&precision) {
            assert!((one - other).abs() < 1e-6 * (1.0 + one.abs()), "{one} {other}");
        }
    }
}
