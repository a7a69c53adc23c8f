//! How a tip moves, and where it was all along.
//!
//! In: tips and their times. Out: where the next is to be expected; and, when all is over, where the tip was at each time,
//! seen or not. The one idea: a tip keeps its velocity but for chance, so what came before and what comes after tell
//! together where it was.
//!
//! # References
//! Kalman 1960, doi:10.1115/1.3662552: the filter. Rauch, Tung and Striebel 1965, doi:10.2514/3.3166: the way back.

use crate::geometry::Point;

/// A tip farther than this from where it was expected has jumped, in cm a period.
pub(super) const STEADY: f64 = 0.8;

/// Deviation of a measured tip, in cm, and of what its velocity gains in a period, in cm per period.
const NOISE: (f64, f64) = (0.05, 0.06);

/// One of a point's coordinates.
type Axis = fn(&Point) -> f64;

/// A tip that moves at a constant velocity but for chance, the same for both axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct KalmanState {
    pub(super) tip: Point,
    /// cm per period.
    velocity: Point,
    /// Covariances: place, place with velocity, velocity.
    pub(super) covariance: [f64; 3],
}

impl KalmanState {
    pub(super) fn initial(tip: Point) -> Self {
        Self { tip, velocity: Point::default(), covariance: [NOISE.0 * NOISE.0, 0.0, 0.1] }
    }

    pub(super) const fn tip(&self) -> Point {
        self.tip
    }

    /// Where the tip is to be expected after so many periods. Far ahead the velocity says nothing any more.
    pub(super) fn extrapolate(&self, periods: f64) -> Point {
        let ahead = periods.min(2.0);
        Point::new(self.tip.x + ahead * self.velocity.x, self.tip.y + ahead * self.velocity.y)
    }

    /// What is known of it after so many periods without a look.
    pub(super) fn predict(&self, periods: f64) -> Self {
        let [pp, pv, vv] = self.covariance;
        let gain = NOISE.1 * NOISE.1 * periods;
        let pp = pp + 2.0 * periods * pv + periods * periods * vv + gain * periods * periods / 3.0;
        let (pv, vv) = (pv + periods * vv + gain * periods / 2.0, vv + gain);
        let tip = Point::new(self.tip.x + periods * self.velocity.x, self.tip.y + periods * self.velocity.y);
        Self { tip, velocity: self.velocity, covariance: [pp, pv, vv] }
    }

    /// What is known of it once it is seen at `tip`.
    fn update(&self, tip: Point) -> Self {
        let [pp, pv, vv] = self.covariance;
        let sum = pp + NOISE.0 * NOISE.0;
        let (place, speed) = (pp / sum, pv / sum);
        let (dx, dy) = (tip.x - self.tip.x, tip.y - self.tip.y);
        Self {
            tip: Point::new(self.tip.x + place * dx, self.tip.y + place * dy),
            velocity: Point::new(self.velocity.x + speed * dx, self.velocity.y + speed * dy),
            covariance: [pp * (1.0 - place), pv * (1.0 - place), vv - speed * pv],
        }
    }

    pub(super) fn predict_and_update(&self, tip: Point, periods: f64) -> Self {
        self.predict(periods).update(tip)
    }

    /// What is known of it now that it is known what became of it: `expected` was what followed from this, `became` is
    /// what was.
    pub(super) fn rts_smooth(&self, periods: f64, expected: &Self, became: &Self) -> Self {
        let ([pp, pv, vv], [ep, epv, ev]) = (self.covariance, expected.covariance);
        let (along, across) = (pp + periods * pv, pv + periods * vv);
        let determinant = ep * ev - epv * epv;
        // The gain: this covariance, moved on, over the covariance that was expected.
        let place = [(along * ev - pv * epv) / determinant, (pv * ep - along * epv) / determinant];
        let speed = [(across * ev - vv * epv) / determinant, (vv * ep - across * epv) / determinant];
        let moved = |[from_place, from_speed]: [f64; 2], axis: Axis| {
            from_place * (axis(&became.tip) - axis(&expected.tip))
                + from_speed * (axis(&became.velocity) - axis(&expected.velocity))
        };
        let change: [f64; 3] = std::array::from_fn(|i| became.covariance[i] - expected.covariance[i]);
        let carried = |[a, b]: [f64; 2], [c, d]: [f64; 2]| {
            a * c * change[0] + (a * d + b * c) * change[1] + b * d * change[2]
        };
        let (x, y): (Axis, Axis) = (|at| at.x, |at| at.y);
        Self {
            tip: Point::new(self.tip.x + moved(place, x), self.tip.y + moved(place, y)),
            velocity: Point::new(self.velocity.x + moved(speed, x), self.velocity.y + moved(speed, y)),
            covariance: [pp + carried(place, place), pv + carried(place, speed), vv + carried(speed, speed)],
        }
    }
}
