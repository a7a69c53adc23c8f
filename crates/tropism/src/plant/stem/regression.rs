//! Ridge regression: least squares whose weights are drawn to a prior.
//!
//! # References
//! Hoerl and Kennard 1970, doi:10.1080/00401706.1970.10488634 (ridge regression).

use crate::math::matrix;

/// Weights of least squares over `rows` of terms and their value, and over the mirror images of the rows, drawn to `prior` by
/// a `ridge` of each weight, above 0.
///
/// In a mirror all terms and the value change sign, so the products stay: each row counts twice.
pub(super) fn ridge_regression<'r, const TERMS: usize>(
    rows: impl Iterator<Item = (&'r [f64; TERMS], f64)>,
    prior: &[f64; TERMS],
    ridge: &[f64; TERMS],
) -> [f64; TERMS] {
    let mut products = [[0.0; TERMS]; TERMS];
    let mut right = [0.0; TERMS];
    for (at, row) in products.iter_mut().enumerate() {
        row[at] = ridge[at];
        right[at] = ridge[at] * prior[at];
    }
    for (terms, value) in rows {
        for (at, one) in terms.iter().enumerate() {
            for (product, other) in products[at].iter_mut().zip(terms) {
                *product += 2.0 * one * other;
            }
            right[at] += 2.0 * one * value;
        }
    }
    matrix::solve(products, right).expect("a ridge above 0 makes the matrix positive definite")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn little_ridge_finds_the_line_and_much_ridge_the_prior() {
        let rows: Vec<([f64; 2], f64)> =
            (0..20).map(f64::from).map(|row| ([row, row * row], 3.0 * row - 0.1 * row * row)).collect();
        let fit = |ridge: f64| {
            ridge_regression(rows.iter().map(|(terms, value)| (terms, *value)), &[1.0, 2.0], &[ridge; 2])
        };
        let (free, held) = (fit(1e-9), fit(1e12));
        assert!((free[0] - 3.0).abs() < 1e-6 && (free[1] + 0.1).abs() < 1e-6, "{free:?}");
        assert!((held[0] - 1.0).abs() < 1e-3 && (held[1] - 2.0).abs() < 1e-3, "{held:?}");
    }
}
