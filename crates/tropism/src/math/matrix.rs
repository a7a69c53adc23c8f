//! Small matrices as arrays of rows: products, inverses, and systems of linear equations.
//!
//! Sums run from the first term to the last, so that every machine gives the same bits.
//!
//! # References
//! Golub and Van Loan 2013, *Matrix Computations*, 4th edition: sections 3.4 (pivoting), 5.5 (least squares of
//! deficient rank), 8.5 (Jacobi methods) and 8.6 (Jacobi SVD procedures).

use super::vector::{Vec3, dot};

/// A 3 x 3 matrix.
pub type Matrix3 = [Vec3; 3];

/// The identity.
#[must_use]
pub fn identity<const N: usize>() -> [[f64; N]; N] {
    core::array::from_fn(|row| core::array::from_fn(|column| if row == column { 1.0 } else { 0.0 }))
}

/// The product of a matrix and a column vector.
///
/// ```
/// use tropism::math::matrix::transform;
/// assert_eq!(transform(&[[1.0, 2.0], [3.0, 4.0]], [10.0, 1.0]), [12.0, 34.0]);
/// ```
#[must_use]
#[inline]
pub fn transform<const R: usize, const C: usize>(matrix: &[[f64; C]; R], vector: [f64; C]) -> [f64; R] {
    core::array::from_fn(|row| dot(matrix[row], vector))
}

/// The product of two matrices.
#[must_use]
pub fn multiply<const R: usize, const N: usize, const C: usize>(
    a: &[[f64; N]; R],
    b: &[[f64; C]; N],
) -> [[f64; C]; R] {
    core::array::from_fn(|row| {
        core::array::from_fn(|column| dot(a[row], core::array::from_fn(|inner| b[inner][column])))
    })
}

/// The determinant of a 3 x 3 matrix.
#[must_use]
pub fn determinant(&[[a, b, c], [d, e, f], [g, h, i]]: &Matrix3) -> f64 {
    a * (e * i - h * f) - b * (d * i - g * f) + c * (d * h - g * e)
}

/// The inverse of a 3 x 3 matrix, its adjugate over its determinant; `None` where the determinant is 0.
#[must_use]
pub fn inverse(matrix: &Matrix3) -> Option<Matrix3> {
    let &[[a, b, c], [d, e, f], [g, h, i]] = matrix;
    let determinant = determinant(matrix);
    let adjugate = [
        [e * i - h * f, c * h - i * b, b * f - e * c],
        [-(d * i - g * f), a * i - g * c, c * d - f * a],
        [d * h - g * e, b * g - h * a, a * e - d * b],
    ];
    (determinant != 0.0).then(|| adjugate.map(|row| row.map(|cofactor| cofactor / determinant)))
}

/// The inverse of a symmetric, positive definite matrix by Gauss-Jordan elimination, which needs no pivoting there.
#[must_use]
pub fn inverse_positive_definite<const N: usize>(mut matrix: [[f64; N]; N]) -> [[f64; N]; N] {
    let mut inverse = identity::<N>();
    for pivot in 0..N {
        let diagonal = matrix[pivot][pivot];
        for column in 0..N {
            matrix[pivot][column] /= diagonal;
            inverse[pivot][column] /= diagonal;
        }
        for row in (0..N).filter(|&row| row != pivot) {
            let factor = matrix[row][pivot];
            for column in 0..N {
                matrix[row][column] -= factor * matrix[pivot][column];
                inverse[row][column] -= factor * inverse[pivot][column];
            }
        }
    }
    inverse
}

/// Solves `matrix x = right` by Gaussian elimination with partial pivoting; `None` where the matrix is singular.
///
/// ```
/// use tropism::math::matrix::solve;
/// assert_eq!(solve([[0.0, 2.0], [4.0, 0.0]], [6.0, 4.0]), Some([1.0, 3.0]));
/// assert_eq!(solve([[1.0, 2.0], [2.0, 4.0]], [1.0, 2.0]), None);
/// ```
#[must_use]
pub fn solve<const N: usize>(mut matrix: [[f64; N]; N], mut right: [f64; N]) -> Option<[f64; N]> {
    for pivot in 0..N {
        let largest = (pivot..N).max_by(|&one, &other| {
            matrix[one][pivot].abs().total_cmp(&matrix[other][pivot].abs()).then(other.cmp(&one))
        })?;
        matrix.swap(pivot, largest);
        right.swap(pivot, largest);
        let diagonal = matrix[pivot][pivot];
        if diagonal == 0.0 || !diagonal.is_finite() {
            return None;
        }
        let above = matrix[pivot];
        for row in pivot + 1..N {
            let factor = matrix[row][pivot] / diagonal;
            for (value, above) in matrix[row].iter_mut().zip(above).skip(pivot) {
                *value -= factor * above;
            }
            right[row] -= factor * right[pivot];
        }
    }
    for row in (0..N).rev() {
        let known: f64 = (row + 1..N).map(|column| matrix[row][column] * right[column]).sum();
        right[row] = (right[row] - known) / matrix[row][row];
    }
    Some(right)
}

/// Solves `matrix x = right` by Cramer's rule for the symmetric 3 x 3 matrix of the elements (xx, yy, zz, xy, xz,
/// yz). A singular matrix gives numbers that are not finite.
#[must_use]
pub fn solve_symmetric([xx, yy, zz, xy, xz, yz]: [f64; 6], [x, y, z]: Vec3) -> Vec3 {
    let (a, b, c) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
    let (d, e, f) = (xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy);
    let determinant = xx * a + xy * b + xz * c;
    [a * x + b * y + c * z, b * x + d * y + e * z, c * x + e * y + f * z].map(|sum| sum / determinant)
}

/// The x with the least squares of `rows x - right`; `None` where the least singular value of `rows` is below `rank`
/// of the greatest: another x would do as well.
///
/// Singular values by one-sided Jacobi rotations (Hestenes 1958, doi:10.1137/0106005).
///
/// # Panics
/// If there are not as many rows as numbers in `right`.
#[must_use]
pub fn least_squares<const N: usize>(rows: &[[f64; N]], right: &[f64], rank: f64) -> Option<[f64; N]> {
    assert_eq!(rows.len(), right.len(), "a number on the right for each row");
    let column = |column: usize| rows.iter().map(|row| row[column]).collect();
    // rows v = u: the rotations in v turn the columns of u until they stand at right angles.
    let mut u: [Vec<f64>; N] = core::array::from_fn(column);
    let mut v = identity::<N>();
    orthogonalize(&mut u, &mut v);
    let product = |one: &[f64], other: &[f64]| -> f64 { one.iter().zip(other).map(|(a, b)| a * b).sum() };
    let squares: [f64; N] = core::array::from_fn(|at| product(&u[at], &u[at]));
    let greatest = squares.iter().copied().fold(0.0, f64::max);
    // Not `<`: NaN is refused, too.
    if !squares.iter().all(|&square| square >= rank * rank * greatest && square > 0.0) {
        return None;
    }
    let shares: [f64; N] = core::array::from_fn(|at| product(&u[at], right) / squares[at]);
    Some(core::array::from_fn(|row| (0..N).map(|at| v[at][row] * shares[at]).sum()))
}

/// Rotates pairs of the columns `u`, and the rows of `v` with them, until all columns stand at right angles.
fn orthogonalize<const N: usize>(u: &mut [Vec<f64>; N], v: &mut [[f64; N]; N]) {
    /// Quadratic convergence: well-conditioned columns need five or six sweeps (Golub and Van Loan, section 8.6).
    const SWEEPS: usize = 30;
    for _ in 0..SWEEPS {
        let mut is_done = true;
        for p in 0..N {
            for q in p + 1..N {
                let (mut pp, mut qq, mut pq) = (0.0, 0.0, 0.0);
                for (a, b) in u[p].iter().zip(&u[q]) {
                    (pp, qq, pq) = (pp + a * a, qq + b * b, pq + a * b);
                }
                if pq.abs() <= f64::EPSILON * (pp * qq).sqrt() {
                    continue;
                }
                is_done = false;
                let zeta = (qq - pp) / (2.0 * pq);
                let tangent = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
                let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
                let sine = cosine * tangent;
                let (head, tail) = u.split_at_mut(q);
                rotate(&mut head[p], &mut tail[0], cosine, sine);
                let (head, tail) = v.split_at_mut(q);
                rotate(&mut head[p], &mut tail[0], cosine, sine);
            }
        }
        if is_done {
            return;
        }
    }
}

/// The eigenvalues of a symmetric matrix, and its eigenvectors of length 1 as rows in the same order.
///
/// Only the symmetric part matters.
///
/// ```
/// use tropism::math::matrix::eigen_symmetric;
/// let (values, vectors) = eigen_symmetric([[2.0, 1.0], [1.0, 2.0]]);
/// assert!((values[0] - 1.0).abs() < 1e-12 && (values[1] - 3.0).abs() < 1e-12);
/// assert!((vectors[1][0] - vectors[1][1]).abs() < 1e-12);
/// ```
#[must_use]
pub fn eigen_symmetric<const N: usize>(mut matrix: [[f64; N]; N]) -> ([f64; N], [[f64; N]; N]) {
    let mut vectors = identity::<N>();
    diagonalize(&mut matrix, &mut vectors);
    (core::array::from_fn(|at| matrix[at][at]), vectors)
}

/// Turns a symmetric `matrix` of any size into the diagonal one of its eigenvalues, and the rows of `vectors`, which are those of
/// the identity before, into its eigenvectors of length 1 in the same order.
///
/// Cyclic Jacobi rotations (Golub and Van Loan, section 8.5).
///
/// # Panics
/// If `matrix` or `vectors` is not square, or if they differ in size.
pub fn diagonalize<R: AsRef<[f64]> + AsMut<[f64]>>(matrix: &mut [R], vectors: &mut [R]) {
    /// Quadratic convergence: ten sweeps suffice for matrices of any practical size (Golub and Van Loan, section 8.5).
    const SWEEPS: usize = 30;
    let size = matrix.len();
    for _ in 0..SWEEPS {
        let pairs = || (0..size).flat_map(|p| (p + 1..size).map(move |q| (p, q)));
        let element = |row: usize, column: usize| matrix[row].as_ref()[column];
        let off_diagonal: f64 = pairs().map(|(p, q)| element(p, q) * element(p, q)).sum();
        let diagonal: f64 = (0..size).map(|at| element(at, at) * element(at, at)).sum();
        if off_diagonal.is_nan() || off_diagonal <= f64::EPSILON * f64::EPSILON * diagonal {
            break;
        }
        for (p, q) in pairs() {
            let element = |row: usize, column: usize| matrix[row].as_ref()[column];
            if element(p, q) == 0.0 {
                continue;
            }
            let theta = (element(q, q) - element(p, p)) / (2.0 * element(p, q));
            let sign = if theta < 0.0 { -1.0 } else { 1.0 };
            let tangent = sign / (theta.abs() + (1.0 + theta * theta).sqrt());
            let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
            let sine = cosine * tangent;
            for row in matrix.iter_mut().map(AsMut::as_mut) {
                (row[p], row[q]) = (cosine * row[p] - sine * row[q], sine * row[p] + cosine * row[q]);
            }
            for rows in [&mut *matrix, &mut *vectors] {
                let (head, tail) = rows.split_at_mut(q);
                rotate(head[p].as_mut(), tail[0].as_mut(), cosine, sine);
            }
        }
    }
}

fn rotate(p: &mut [f64], q: &mut [f64], cosine: f64, sine: f64) {
    for (a, b) in p.iter_mut().zip(q) {
        (*a, *b) = (cosine * *a - sine * *b, sine * *a + cosine * *b);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn is_near<const R: usize, const C: usize>(a: &[[f64; C]; R], b: &[[f64; C]; R]) -> bool {
        a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    #[test]
    fn a_known_inverse() {
        let matrix = [[2.0, 0.0, 1.0], [0.0, 3.0, 0.0], [1.0, 0.0, 1.0]];
        assert_eq!(determinant(&matrix), 3.0);
        let known = [[1.0, 0.0, -1.0], [0.0, 1.0 / 3.0, 0.0], [-1.0, 0.0, 2.0]];
        assert!(is_near(&inverse(&matrix).unwrap(), &known));
        assert!(is_near(&inverse_positive_definite(matrix), &known));
        assert_eq!(inverse(&[[1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [0.0, 1.0, 0.0]]), None);
    }

    #[test]
    fn the_inverse_of_blocks_is_the_blocks_inverse() {
        let mut matrix = [[0.0; 4]; 4];
        for (row, values) in matrix.iter_mut().enumerate() {
            values[row] = 2.0;
        }
        (matrix[0][1], matrix[1][0]) = (1.0, 1.0);
        let inverse = inverse_positive_definite(matrix);
        for (at, wanted) in [2.0 / 3.0, 2.0 / 3.0, 0.5, 0.5].into_iter().enumerate() {
            assert!((inverse[at][at] - wanted).abs() < 1e-12, "{inverse:?}");
        }
    }

    #[test]
    fn hilberts_matrix_is_solved_by_all_ways() {
        // Badly conditioned (500), with whole numbers as inverse: the sum of its rows is (3, -24, 30).
        let hilbert = [
            [1.0, 1.0 / 2.0, 1.0 / 3.0],
            [1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0],
            [1.0 / 3.0, 1.0 / 4.0, 1.0 / 5.0],
        ];
        let known = [[3.0, -24.0, 30.0]];
        assert!(is_near(&[solve(hilbert, [1.0; 3]).unwrap()], &known));
        assert!(is_near(&[least_squares(&hilbert, &[1.0; 3], 1e-9).unwrap()], &known));
        let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = hilbert;
        assert!(is_near(&[solve_symmetric([xx, yy, zz, xy, xz, yz], [1.0; 3])], &known));
    }

    #[test]
    fn a_line_through_points_has_the_least_squares() {
        // Four points about 1 + 2x: the normal equations give 1.3 + 1.8x.
        let rows = [[1.0, 0.0], [1.0, 1.0], [1.0, 2.0], [1.0, 3.0]];
        let [offset, slope] = least_squares(&rows, &[1.0, 4.0, 4.0, 7.0], 1e-9).unwrap();
        assert!((offset - 1.3).abs() < 1e-12 && (slope - 1.8).abs() < 1e-12, "{offset} {slope}");
        let parallel = [[1.0, 2.0], [2.0, 4.0], [3.0, 6.0]];
        assert_eq!(least_squares(&parallel, &[1.0, 2.0, 3.0], 1e-9), None);
        assert_eq!(least_squares(&[[f64::NAN], [1.0]], &[1.0, 1.0], 1e-9), None);
    }

    proptest! {
        #[test]
        fn what_is_solved_solves(
            matrix in prop::array::uniform5(prop::array::uniform5(-1.0..1.0)),
            right in prop::array::uniform5(-1.0..1.0),
        ) {
            let mut matrix = matrix;
            (0..5).for_each(|at| matrix[at][at] += 6.0);
            let exact = solve(matrix, right).unwrap();
            prop_assert!(is_near(&[transform(&matrix, exact)], &[right]));
            let fitted = least_squares(&matrix, &right, 1e-9).unwrap();
            prop_assert!(is_near(&[fitted], &[exact]));
        }

        #[test]
        fn eigenvectors_rebuild_the_matrix(matrix in prop::array::uniform5(prop::array::uniform5(-1.0..1.0))) {
            let symmetric: [[f64; 5]; 5] =
                core::array::from_fn(|row| core::array::from_fn(|column| matrix[row][column] + matrix[column][row]));
            let (values, vectors) = eigen_symmetric(symmetric);
            let transposed = core::array::from_fn(|row| core::array::from_fn(|column| vectors[column][row]));
            prop_assert!(is_near(&multiply(&vectors, &transposed), &identity()));
            let scaled: [[f64; 5]; 5] = core::array::from_fn(|at| vectors[at].map(|value| values[at] * value));
            prop_assert!(is_near(&multiply(&transposed, &scaled), &symmetric));
        }

        #[test]
        fn an_inverse_undoes(matrix in prop::array::uniform3(prop::array::uniform3(-1.0..1.0))) {
            let mut matrix = matrix;
            (0..3).for_each(|at| matrix[at][at] += 4.0);
            prop_assert!(is_near(&multiply(&matrix, &inverse(&matrix).unwrap()), &identity()));
        }
    }
}
