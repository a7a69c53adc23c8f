//! Minimises a function of several variables without its derivatives.
//!
//! In: a function and the corners of a first simplex (a triangle in the plane, a tetrahedron in space, and so on).
//! Out: the best corner found. The one idea: the corner with the greatest value is replaced by a better one on the
//! line from it through the centroid of the others; where there is none, the simplex shrinks towards its best corner.
//!
//! # References
//! Nelder and Mead 1965, *A simplex method for function minimization*, doi:10.1093/comjnl/7.4.308. Lagarias, Reeds,
//! Wright and Wright 1998, doi:10.1137/S1052623496303470, algorithm NM: which step is taken when.

use super::statistics::standard_deviation;
use super::vector::{add, along, scale, sub};

/// How far the worst corner is carried beyond the centroid (Nelder and Mead's alpha = 1, gamma = 2 and beta = 1/2),
/// and how far the simplex shrinks (1/2). The values that they recommend.
const REFLECTION: f64 = 1.0;
const EXPANSION: f64 = 2.0;
const CONTRACTION: f64 = 0.5;
const SHRINKAGE: f64 = 0.5;

/// When a search ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Termination {
    /// Steps at most; a step replaces one corner or shrinks the simplex.
    pub max_steps: u32,
    /// The search has converged when the values at the corners have a standard deviation below this.
    pub tolerance: f64,
}

/// The best point that a search found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Minimum<const N: usize> {
    /// Where it is.
    pub point: [f64; N],
    /// The function's value there.
    pub value: f64,
    /// Steps that the search took.
    pub steps: u32,
}

/// Searches for a minimum of `function` from `corners`, N + 1 points that span all dimensions.
///
/// `None` where `function` returns NaN for a reflected point, as no corner is then the worst.
///
/// ```
/// use tropism::math::simplex::{Termination, minimize};
/// let bowl = |[x, y]: [f64; 2]| (x - 3.0).powi(2) + (y + 1.0).powi(2);
/// let termination = Termination { max_steps: 200, tolerance: 1e-12 };
/// let found = minimize(bowl, &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], termination).unwrap();
/// assert!((found.point[0] - 3.0).abs() < 1e-4 && (found.point[1] + 1.0).abs() < 1e-4);
/// ```
///
/// # Panics
/// If there are not N + 1 corners.
pub fn minimize<const N: usize>(
    mut function: impl FnMut([f64; N]) -> f64,
    corners: &[[f64; N]],
    termination: Termination,
) -> Option<Minimum<N>> {
    assert_eq!(corners.len(), N + 1, "corners of a simplex in {N} dimensions");
    let corners = corners.iter().map(|&point| (point, function(point))).collect();
    let mut simplex = Simplex { corners };
    simplex.sort();
    let mut steps = 0;
    while !simplex.has_converged(termination.tolerance) && steps < termination.max_steps {
        simplex.step(&mut function)?;
        simplex.sort();
        steps += 1;
    }
    let (point, value) = simplex.corners[0];
    Some(Minimum { point, value, steps })
}

/// N + 1 points with the function's values at them, the least value first.
struct Simplex<const N: usize> {
    corners: Vec<([f64; N], f64)>,
}

impl<const N: usize> Simplex<N> {
    fn sort(&mut self) {
        self.corners.sort_by(|one, other| one.1.partial_cmp(&other.1).unwrap_or(core::cmp::Ordering::Equal));
    }

    /// Nelder and Mead's criterion, or a value that nothing can be less than.
    fn has_converged(&self, tolerance: f64) -> bool {
        let values: Vec<f64> = self.corners.iter().map(|corner| corner.1).collect();
        standard_deviation(&values) < tolerance || values[0] == f64::NEG_INFINITY
    }

    /// The mean of all corners but the worst.
    fn centroid(&self) -> [f64; N] {
        let others = &self.corners[1..N];
        let sum = others.iter().fold(self.corners[0].0, |sum, corner| add(sum, corner.0));
        scale(sum, 1.0 / N as f64)
    }

    /// Replaces the worst corner or shrinks the simplex.
    fn step(&mut self, function: &mut impl FnMut([f64; N]) -> f64) -> Option<()> {
        let centroid = self.centroid();
        let (best, second_worst, worst) = (self.corners[0].1, self.corners[N - 1].1, self.corners[N]);
        let reflected = along(centroid, sub(centroid, worst.0), REFLECTION);
        let reflected = (reflected, function(reflected));
        let beyond = |point, factor| along(centroid, sub(point, centroid), factor);
        let next = if reflected.1 < best {
            let expanded = beyond(reflected.0, EXPANSION);
            let expanded = (expanded, function(expanded));
            Some(if expanded.1 < reflected.1 { expanded } else { reflected })
        } else if reflected.1 < second_worst {
            Some(reflected)
        } else if reflected.1 < worst.1 {
            let outside = beyond(reflected.0, CONTRACTION);
            Some((outside, function(outside))).filter(|outside| outside.1 <= reflected.1)
        } else if reflected.1 >= second_worst {
            let inside = beyond(worst.0, CONTRACTION);
            Some((inside, function(inside))).filter(|inside| inside.1 < worst.1)
        } else {
            return None;
        };
        match next {
            Some(corner) => self.corners[N] = corner,
            None => self.shrink(function),
        }
        Some(())
    }

    /// Moves all corners towards the best one.
    fn shrink(&mut self, function: &mut impl FnMut([f64; N]) -> f64) {
        let best = self.corners[0].0;
        for (point, value) in &mut self.corners[1..] {
            *point = along(best, sub(*point, best), SHRINKAGE);
            *value = function(*point);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FINE: Termination = Termination { max_steps: 1000, tolerance: 1e-14 };

    /// Rosenbrock 1960, doi:10.1093/comjnl/3.3.175: a bent valley with its minimum, 0, at (1, 1).
    fn rosenbrock([x, y]: [f64; 2]) -> f64 {
        100.0 * (y - x * x).powi(2) + (1.0 - x).powi(2)
    }

    #[test]
    fn rosenbrocks_valley_is_followed_to_its_minimum() {
        let found = minimize(rosenbrock, &[[-1.2, 1.0], [-0.2, 1.0], [-1.2, 2.0]], FINE).unwrap();
        assert!((found.point[0] - 1.0).abs() < 1e-5 && (found.point[1] - 1.0).abs() < 1e-5, "{found:?}");
        assert!(found.value < 1e-10 && found.steps < 200, "{found:?}");
    }

    #[test]
    fn powells_function_of_four_variables_reaches_its_minimum() {
        // Powell 1962, doi:10.1093/comjnl/5.2.147: the Hessian is singular at the minimum, 0, at the origin.
        let powell = |[a, b, c, d]: [f64; 4]| {
            (a + 10.0 * b).powi(2) + 5.0 * (c - d).powi(2) + (b - 2.0 * c).powi(4) + 10.0 * (a - d).powi(4)
        };
        let start = [3.0, -1.0, 0.0, 1.0];
        let corner = |which: usize| core::array::from_fn(|i| start[i] + f64::from(u8::from(i + 1 == which)));
        let found = minimize(powell, &[0, 1, 2, 3, 4].map(corner), FINE).unwrap();
        assert!(found.value < 1e-10, "{found:?}");
    }

    #[test]
    fn a_search_without_steps_returns_the_best_corner() {
        let termination = Termination { max_steps: 0, tolerance: 0.0 };
        let found = minimize(rosenbrock, &[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], termination).unwrap();
        assert_eq!(found, Minimum { point: [1.0, 1.0], value: 0.0, steps: 0 });
    }

    #[test]
    fn a_function_that_is_no_number_has_no_minimum() {
        assert_eq!(minimize(|_| f64::NAN, &[[0.0], [1.0]], FINE), None);
        // Below everything there is no lower.
        let bottomless = |[x]: [f64; 1]| if x > 4.0 { f64::NEG_INFINITY } else { -x };
        assert_eq!(minimize(bottomless, &[[0.0], [1.0]], FINE).unwrap().value, f64::NEG_INFINITY);
    }
}
