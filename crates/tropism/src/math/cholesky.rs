//! Cholesky factors of symmetric positive definite matrices of any size.
//!
//! # References
//! Golub and Van Loan 2013, *Matrix Computations*, section 4.2.

use crate::math::vector::dot_slices;

/// The lower triangle `L` with `L L^T` the matrix it was made of.
///
/// ```
/// use tropism::math::cholesky::Cholesky;
/// let factor = Cholesky::of(vec![4.0, 2.0, 2.0, 3.0], 2).unwrap();
/// let found = factor.solve(&[8.0, 7.0]);
/// assert!((found[0] - 1.25).abs() < 1e-12 && (found[1] - 1.5).abs() < 1e-12);
/// assert!((factor.ln_determinant() - 8_f64.ln()).abs() < 1e-12);
/// ```
#[derive(Clone, Debug)]
pub struct Cholesky {
    /// Row by row; what stands above the diagonal is not used.
    lower: Vec<f64>,
    size: usize,
}

impl Cholesky {
    /// The factor of a symmetric matrix given row by row, of which the lower triangle is read; `None` if the matrix is not
    /// positive definite.
    ///
    /// # Panics
    /// If the matrix has not `size` rows and columns.
    #[must_use]
    pub fn of(mut matrix: Vec<f64>, size: usize) -> Option<Self> {
        assert_eq!(
            matrix.len(),
            size * size,
            "found {} numbers, wanted {size} rows and columns",
            matrix.len()
        );
        for row in 0..size {
            let (above, rest) = matrix.split_at_mut(row * size);
            let current = &mut rest[..=row];
            for column in 0..row {
                let other = &above[column * size..=column * size + column];
                current[column] =
                    (current[column] - dot_slices(&current[..column], &other[..column])) / other[column];
            }
            let square = current[row] - dot_slices(&current[..row], &current[..row]);
            // Not a number fails as well.
            if !(square > 0.0 && square.is_finite()) {
                return None;
            }
            current[row] = square.sqrt();
        }
        Some(Self { lower: matrix, size })
    }

    /// The natural logarithm of the determinant.
    #[must_use]
    pub fn ln_determinant(&self) -> f64 {
        2.0 * (0..self.size).map(|row| crate::math::ln(self.lower[row * self.size + row])).sum::<f64>()
    }

    /// `L^-1 right`.
    #[must_use]
    pub fn solve_lower(&self, right: &[f64]) -> Vec<f64> {
        let mut solution = right.to_vec();
        for row in 0..self.size {
            let line = &self.lower[row * self.size..=row * self.size + row];
            solution[row] = (solution[row] - dot_slices(&line[..row], &solution[..row])) / line[row];
        }
        solution
    }

    /// The solution of the system of equations with this matrix.
    #[must_use]
    pub fn solve(&self, right: &[f64]) -> Vec<f64> {
        let mut solution = self.solve_lower(right);
        for row in (0..self.size).rev() {
            let line = &self.lower[row * self.size..=row * self.size + row];
            solution[row] /= line[row];
            let value = solution[row];
            for (other, factor) in solution[..row].iter_mut().zip(line) {
                *other -= factor * value;
            }
        }
        solution
    }

    /// The product `L vector`: standard normal draws become draws with the matrix as their covariance.
    #[must_use]
    pub fn times(&self, vector: &[f64]) -> Vec<f64> {
        let row =
            |row: usize| dot_slices(&self.lower[row * self.size..=row * self.size + row], &vector[..=row]);
        (0..self.size).map(row).collect()
    }

    /// The inverse of the matrix, row by row.
    #[must_use]
    pub fn inverse(&self) -> Vec<f64> {
        let size = self.size;
        // Rows of the inverse of the lower triangle, transposed: row c holds column c, from c on.
        let mut columns = vec![0.0; size * size];
        for column in 0..size {
            let values = &mut columns[column * size..(column + 1) * size];
            values[column] = 1.0 / self.lower[column * size + column];
            for row in column + 1..size {
                let line = &self.lower[row * size..=row * size + row];
                values[row] = -dot_slices(&line[column..row], &values[column..row]) / line[row];
            }
        }
        let mut inverse = vec![0.0; size * size];
        for row in 0..size {
            for column in 0..=row {
                let (one, other) =
                    (&columns[row * size..(row + 1) * size], &columns[column * size..(column + 1) * size]);
                let value = dot_slices(&one[row..], &other[row..]);
                inverse[row * size + column] = value;
                inverse[column * size + row] = value;
            }
        }
        inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_no_factor() {
        assert!(Cholesky::of(vec![1.0, 2.0, 2.0, 1.0], 2).is_none());
        assert!(Cholesky::of(vec![f64::NAN], 1).is_none());
    }

    proptest! {
        #[test]
        fn the_inverse_times_the_matrix_is_the_identity(values in prop::collection::vec(-1.0..1.0, 49)) {
            let size = 7;
            let square = |row: usize, column: usize| -> f64 {
                let sum: f64 = (0..size).map(|k| values[row * size + k] * values[column * size + k]).sum();
                sum + f64::from(u8::from(row == column))
            };
            let matrix: Vec<f64> = (0..size * size).map(|at| square(at / size, at % size)).collect();
            let factor = Cholesky::of(matrix.clone(), size).unwrap();
            let inverse = factor.inverse();
            for row in 0..size {
                let unit: Vec<f64> = (0..size).map(|at| f64::from(u8::from(at == row))).collect();
                let solution = factor.solve(&unit);
                for column in 0..size {
                    prop_assert!((solution[column] - inverse[row * size + column]).abs() < 1e-9);
                    let product: f64 = (0..size).map(|k| inverse[row * size + k] * matrix[k * size + column]).sum();
                    prop_assert!((product - unit[column]).abs() < 1e-9);
                }
            }
        }
    }
}
