//! Symmetric positive systems in room that is there.

/// Factors the lower triangle of a symmetric matrix in place, row by row with this stride; false where it is not positive.
pub(crate) fn factor(matrix: &mut [f64], size: usize, stride: usize) -> bool {
    for i in 0..size {
        let (above, rest) = matrix.split_at_mut(i * stride);
        let Some(row) = rest.get_mut(..size) else { return false };
        for j in 0..i {
            let Some(other) = above.get(j * stride..j * stride + j + 1) else { return false };
            let sum: f64 = row.iter().zip(other).take(j).map(|(a, b)| a * b).sum();
            row[j] = (row[j] - sum) / other[j];
        }
        let sum: f64 = row.iter().take(i).map(|a| a * a).sum();
        let left = row[i] - sum;
        if !(left > 0.0 && left.is_finite()) {
            return false;
        }
        row[i] = left.sqrt();
    }
    true
}

/// Solves `L x = b` in place.
pub(crate) fn forward(matrix: &[f64], stride: usize, b: &mut [f64]) {
    for i in 0..b.len() {
        let Some(row) = matrix.get(i * stride..i * stride + i + 1) else { return };
        let sum: f64 = row.iter().zip(b.iter()).take(i).map(|(a, b)| a * b).sum();
        b[i] = (b[i] - sum) / row[i];
    }
}

/// Solves `L L^T x = b` in place.
pub(crate) fn solve(matrix: &[f64], stride: usize, b: &mut [f64]) {
    forward(matrix, stride, b);
    for i in (0..b.len()).rev() {
        let Some(row) = matrix.get(i * stride..i * stride + i + 1) else { return };
        b[i] /= row[i];
        let value = b[i];
        for (b, a) in b.iter_mut().zip(row).take(i) {
            *b -= a * value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_solved_solves() {
        let (size, stride) = (5, 7);
        let part =
            |i: usize, j: usize| if i == j { 3.0 } else { 1.0 / (1.0 + (i + 2 * j).min(j + 2 * i) as f64) };
        let mut matrix = vec![0.0; size * stride];
        for i in 0..size {
            for j in 0..size {
                matrix[i * stride + j] = part(i, j);
            }
        }
        assert!(factor(&mut matrix, size, stride));
        let mut x = [1.0, -2.0, 0.5, 3.0, 0.0];
        let b = x;
        solve(&matrix, stride, &mut x);
        for (i, wanted) in b.into_iter().enumerate() {
            let sum: f64 = (0..size).map(|j| part(i, j) * x[j]).sum();
            assert!((sum - wanted).abs() < 1e-12);
        }
        assert!(!factor(&mut [1.0, 2.0, 2.0, 1.0], 2, 2), "not positive");
    }
}
