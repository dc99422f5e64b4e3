//! GMRES (Y. Saad and M. H. Schultz, SIAM J. Sci. Stat. Comput. 7, 1986), preconditioned from the right.

/// Directions that are kept.
const MAX_DIRECTIONS: usize = 80;
/// A residual that still makes a Newton step.
const MAX_RESIDUAL: f64 = 1e-2;

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Solves `times(x) = rhs` until the residual is `tolerance` of its size; `solve` nearly inverts `times` in place. `None` if that
/// is not good enough.
pub(super) fn gmres(
    times: impl Fn(&[f64]) -> Vec<f64>,
    solve: impl Fn(&mut [f64]),
    rhs: &[f64],
    tolerance: f64,
) -> Option<Vec<f64>> {
    let size = dot(rhs, rhs).sqrt();
    if size == 0.0 {
        return Some(vec![0.0; rhs.len()]);
    }
    let mut basis = vec![rhs.iter().map(|value| value / size).collect::<Vec<f64>>()];
    // Columns of the triangle, rotations that made it one, and the turned right-hand side.
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut turns: Vec<(f64, f64)> = Vec::new();
    let mut goal = vec![size];
    for _ in 0..MAX_DIRECTIONS {
        let mut next = basis.last()?.clone();
        solve(&mut next);
        next = times(&next);
        let mut column: Vec<f64> = Vec::with_capacity(basis.len() + 1);
        for direction in &basis {
            let along = dot(&next, direction);
            next.iter_mut().zip(direction).for_each(|(n, d)| *n -= along * d);
            column.push(along);
        }
        let left = dot(&next, &next).sqrt();
        for (k, (cosine, sine)) in turns.iter().enumerate() {
            let (a, b) = (column[k], column[k + 1..].first().copied().unwrap_or(0.0));
            column[k] = cosine * a + sine * b;
            if k + 1 < column.len() {
                column[k + 1] = cosine * b - sine * a;
            }
        }
        let last = column.last_mut()?;
        let length = last.hypot(left);
        if !length.is_finite() || length == 0.0 {
            return None;
        }
        let turn = (*last / length, left / length);
        *last = length;
        turns.push(turn);
        columns.push(column);
        let from = goal.pop()?;
        goal.extend([turn.0 * from, -turn.1 * from]);
        let residual = (turn.1 * from).abs() / size;
        if residual < tolerance || left <= f64::EPSILON * size {
            break;
        }
        basis.push(next.into_iter().map(|value| value / left).collect());
    }
    if goal.last()?.abs() > MAX_RESIDUAL * size {
        return None;
    }
    let count = columns.len();
    let mut weights = vec![0.0; count];
    for k in (0..count).rev() {
        let known: f64 = (k + 1..count).map(|j| columns[j][k] * weights[j]).sum();
        weights[k] = (goal[k] - known) / columns[k][k];
    }
    let mut x = vec![0.0; rhs.len()];
    for (weight, direction) in weights.iter().zip(&basis) {
        x.iter_mut().zip(direction).for_each(|(x, d)| *x += weight * d);
    }
    solve(&mut x);
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unsymmetric_system_is_solved() {
        let n = 60;
        let times = |x: &[f64]| -> Vec<f64> {
            (0..n)
                .map(|i| {
                    let next = if i + 1 < n { x[i + 1] } else { 0.0 };
                    let back = if i > 0 { x[i - 1] } else { 0.0 };
                    (2.0 + i as f64 * 0.1) * x[i] + 0.9 * next - 0.4 * back
                })
                .collect()
        };
        let wanted: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let rhs = times(&wanted);
        let nearly = |x: &mut [f64]| x.iter_mut().enumerate().for_each(|(i, x)| *x /= 2.0 + i as f64 * 0.1);
        let found = gmres(times, nearly, &rhs, 1e-8);
        let off = found.unwrap().iter().zip(&wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-7, "{off}");
    }
}
