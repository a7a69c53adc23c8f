//! Kalman filter of a tip with nearly constant velocity, and one step of its smoother.
//!
//! In: measured tips and the intervals between them. Out: the state (position, velocity and their covariance),
//! predicted, updated, or smoothed backwards in time. The one idea: a tip keeps its velocity but for random
//! accelerations, which are the same for both axes.
//!
//! # References
//! - Kalman 1960, *A new approach to linear filtering and prediction problems*, doi:10.1115/1.3662552.
//! - Rauch, Tung and Striebel 1965, *Maximum likelihood estimates of linear dynamic systems*, doi:10.2514/3.3166.
//! - Bar-Shalom, Li and Kirubarajan 2001, *Estimation with Applications to Tracking and Navigation*, section 6.2: the
//!   covariance of continuous white-noise acceleration.

use crate::math::vector::{Vec2, along, sub};

/// Standard deviation of a measured coordinate, in cm. Chosen by hand.
const MEASUREMENT_DEVIATION: f64 = 0.05;

/// Standard deviation of the velocity's change over one period, in cm per period. Chosen by hand.
const VELOCITY_DEVIATION: f64 = 0.06;

/// Initial variance of the velocity, in squared centimetres per squared period. Chosen by hand.
const INITIAL_VELOCITY_VARIANCE: f64 = 0.1;

/// Longest extrapolation for gating, in periods: far ahead the velocity says nothing. Chosen by hand.
const MAX_EXTRAPOLATION: f64 = 2.0;

/// Distance from the extrapolated tip, in cm per period, above which a tip has jumped. Chosen by hand.
pub(super) const MAX_STEADY_MOTION: f64 = 0.8;

/// State of a tip: position and velocity, whose covariance is the same for both axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct KalmanState {
    /// Position, in the unit of the measurements: cm, or pixels where only ratios of the deviations count.
    pub(super) tip: Vec2,
    /// Velocity, in that unit per period.
    velocity: Vec2,
    /// Variance of the position, covariance of position and velocity, variance of the velocity.
    covariance: [f64; 3],
}

impl KalmanState {
    /// The state after a first measurement.
    pub(super) fn initial(tip: Vec2) -> Self {
        let variance = MEASUREMENT_DEVIATION * MEASUREMENT_DEVIATION;
        Self { tip, velocity: [0.0; 2], covariance: [variance, 0.0, INITIAL_VELOCITY_VARIANCE] }
    }

    /// Standard deviation of each coordinate of the position, in cm.
    pub(super) fn deviation(&self) -> f64 {
        self.covariance[0].max(0.0).sqrt()
    }

    /// The position that a gate expects after an interval, in periods: extrapolated by at most [`MAX_EXTRAPOLATION`].
    pub(super) fn extrapolate(&self, periods: f64) -> Vec2 {
        self.moved(periods.min(MAX_EXTRAPOLATION))
    }

    /// The position after an interval at the present velocity.
    fn moved(&self, periods: f64) -> Vec2 {
        along(self.tip, self.velocity, periods)
    }

    /// Prediction after an interval without a measurement, in periods.
    pub(super) fn predict(&self, periods: f64) -> Self {
        let [pp, pv, vv] = self.covariance;
        let noise = VELOCITY_DEVIATION * VELOCITY_DEVIATION * periods;
        let pp = pp + 2.0 * periods * pv + periods * periods * vv + noise * periods * periods / 3.0;
        let (pv, vv) = (pv + periods * vv + noise * periods / 2.0, vv + noise);
        Self { tip: self.moved(periods), velocity: self.velocity, covariance: [pp, pv, vv] }
    }

    /// Update by a measured tip.
    pub(super) fn update(&self, tip: Vec2) -> Self {
        let [pp, pv, vv] = self.covariance;
        let innovation_variance = pp + MEASUREMENT_DEVIATION * MEASUREMENT_DEVIATION;
        let (position_gain, velocity_gain) = (pp / innovation_variance, pv / innovation_variance);
        let innovation = sub(tip, self.tip);
        Self {
            tip: along(self.tip, innovation, position_gain),
            velocity: along(self.velocity, innovation, velocity_gain),
            covariance: [pp * (1.0 - position_gain), pv * (1.0 - position_gain), vv - velocity_gain * pv],
        }
    }

    /// One backward step of the Rauch-Tung-Striebel smoother. `predicted` is this state's prediction of the next one,
    /// after `periods`; `smoothed` is the smoothed next state.
    pub(super) fn rts_smooth(&self, periods: f64, predicted: &Self, smoothed: &Self) -> Self {
        let ([pp, pv, vv], [next_pp, next_pv, next_vv]) = (self.covariance, predicted.covariance);
        // The smoother gain: covariance of this state with the next one, times the inverse of the predicted
        // covariance.
        let (cross_p, cross_v) = (pp + periods * pv, pv + periods * vv);
        let determinant = next_pp * next_vv - next_pv * next_pv;
        let position_gain = [
            (cross_p * next_vv - pv * next_pv) / determinant,
            (pv * next_pp - cross_p * next_pv) / determinant,
        ];
        let velocity_gain = [
            (cross_v * next_vv - vv * next_pv) / determinant,
            (vv * next_pp - cross_v * next_pv) / determinant,
        ];
        let (position, velocity) =
            (sub(smoothed.tip, predicted.tip), sub(smoothed.velocity, predicted.velocity));
        let corrected = |before, [of_position, of_velocity]: [f64; 2]| {
            along(along(before, position, of_position), velocity, of_velocity)
        };
        let change: [f64; 3] = std::array::from_fn(|i| smoothed.covariance[i] - predicted.covariance[i]);
        let covariance_change = |[a, b]: [f64; 2], [c, d]: [f64; 2]| {
            a * c * change[0] + (a * d + b * c) * change[1] + b * d * change[2]
        };
        Self {
            tip: corrected(self.tip, position_gain),
            velocity: corrected(self.velocity, velocity_gain),
            covariance: [
                pp + covariance_change(position_gain, position_gain),
                pv + covariance_change(position_gain, velocity_gain),
                vv + covariance_change(velocity_gain, velocity_gain),
            ],
        }
    }
}
