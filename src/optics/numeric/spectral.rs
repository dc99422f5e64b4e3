//! Eigenvalues and singular values with a bound on their iterations: those of `nalgebra` without one go on for ever on some matrices.

use nalgebra::{DMatrix, Dyn, SVD, SymmetricEigen};

/// Sweeps of QR for each row; two or three are usual.
const MAX_SWEEPS: usize = 100;

/// Eigenvalues and vectors of a symmetric matrix; `None` where it is not finite or does not converge.
#[must_use]
pub fn symmetric_eigen(matrix: DMatrix<f64>) -> Option<SymmetricEigen<f64, Dyn>> {
    let bound = MAX_SWEEPS * (1 + matrix.nrows());
    let is_finite = matrix.iter().all(|v| v.is_finite());
    let found = is_finite.then(|| SymmetricEigen::try_new(matrix, f64::EPSILON, bound))??;
    (found.eigenvalues.iter().chain(&found.eigenvectors).all(|v| v.is_finite())).then_some(found)
}

/// Singular values, largest first, with the right vectors; `None` where the matrix is not finite or does not converge.
#[must_use]
pub fn singular_values(matrix: DMatrix<f64>) -> Option<SVD<f64, Dyn, Dyn>> {
    decomposed(matrix, false)
}

fn decomposed(matrix: DMatrix<f64>, is_whole: bool) -> Option<SVD<f64, Dyn, Dyn>> {
    let bound = MAX_SWEEPS * (1 + matrix.nrows().min(matrix.ncols()));
    let is_finite = matrix.iter().all(|v| v.is_finite());
    is_finite.then(|| SVD::try_new(matrix, is_whole, true, 5.0 * f64::EPSILON, bound))?
}

/// The inverse, but for singular values up to `eps`; `None` as of [`singular_values`].
#[must_use]
pub fn pseudo_inverse(matrix: DMatrix<f64>, eps: f64) -> Option<DMatrix<f64>> {
    decomposed(matrix, true)?.pseudo_inverse(eps).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_has_no_values_and_all_else_comes_to_an_end() {
        let not_finite = DMatrix::from_element(3, 3, f64::NAN);
        assert!(symmetric_eigen(not_finite.clone()).is_none());
        assert!(pseudo_inverse(not_finite, 1e-12).is_none());
        let found = symmetric_eigen(DMatrix::from_diagonal_element(4, 4, 2.0)).unwrap();
        assert!(found.eigenvalues.iter().all(|v| (v - 2.0).abs() < 1e-15));
        let inverse = pseudo_inverse(DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 0.0, 0.0]), 1e-12).unwrap();
        assert!((inverse[(0, 0)] - 0.5).abs() < 1e-15 && inverse[(1, 1)] == 0.0);
    }
}
