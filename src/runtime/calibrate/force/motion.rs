//! The noise of the displacements where nobody stated it: from what the readings scatter beyond the reference's own.

use nalgebra::{Matrix6, Vector6};

use super::statistics::spread;
use super::types::{ForceFit, Pair};
use crate::constants::WRENCH_AXES;

/// A reference whose noise is not stated holds to this part of the range of its readings.
const REFERENCE_PART: f64 = 0.01;
/// A fitted stiffness within this factor of the nominal one is taken as it is.
const MAX_NEAR: f64 = 1.5;
const ROUNDS: usize = 200;

/// The pairs with the covariance of the displacements that explains the scatter about a fit; `None` where the reference's
/// own noise explains it. `nominal` stands in for a fitted stiffness that is far from it: terms that go together share
/// what is one stiffness.
///
/// Of axis i the readings scatter by `sum_j K_ij^2 s_j^2` beyond the reference: least squares for `s_j^2 >= 0`.
pub(super) fn with_scatter(pairs: &[Pair], found: &ForceFit, nominal: &Matrix6<f64>) -> Option<Vec<Pair>> {
    let (mut matrix, mut right) = (Matrix6::zeros(), Vector6::zeros());
    for axis in &found.axes {
        let i = WRENCH_AXES.iter().position(|name| *name == axis.axis)?;
        let readings: Vec<f64> = pairs.iter().filter_map(|pair| pair.wrench[i]).collect();
        let own = REFERENCE_PART * spread(&readings);
        // In parts of what the axis's own displacement does, so that forces and moments count alike.
        let (fitted, expected) = (axis.coefficients[i], nominal[(i, i)]);
        let is_near = (expected / MAX_NEAR..=expected * MAX_NEAR).contains(&fitted);
        let stiffness = if is_near { fitted } else { expected };
        if axis.half_widths[i].is_none() || stiffness <= 0.0 {
            continue;
        }
        right[i] = (axis.sd * axis.sd - own * own).max(0.0) / (stiffness * stiffness);
        for j in 0..6 {
            if axis.half_widths[j].is_some() {
                let across = if i == j { stiffness } else { axis.coefficients[j] };
                matrix[(i, j)] = (across / stiffness).powi(2);
            }
        }
    }
    if right == Vector6::zeros() {
        return None;
    }
    // Columns in units of their own axis, so that mm and rad are alike; then steps that keep the signs.
    let size: [f64; 6] = std::array::from_fn(|j| if right[j] > 0.0 { right[j] } else { 0.0 });
    let scaled =
        Matrix6::from_fn(|i, j| if right[i] > 0.0 { matrix[(i, j)] * size[j] / right[i] } else { 0.0 });
    let target = right.map(|v| f64::from(u8::from(v > 0.0)));
    let mut parts = target;
    for _ in 0..ROUNDS {
        let up = scaled.transpose() * target;
        let down = scaled.transpose() * (scaled * parts);
        parts = Vector6::from_fn(|j, _| if down[j] > 0.0 { parts[j] * up[j] / down[j] } else { 0.0 });
    }
    let covariance = Matrix6::from_diagonal(&Vector6::from_fn(|j, _| parts[j] * size[j]));
    let usable = covariance.iter().all(|v| v.is_finite());
    usable.then(|| pairs.iter().map(|p| Pair { displacement_covariance: covariance, ..*p }).collect())
}

/// Whether motion or reference scatters is a guess: the truth lies between the two fits, and the intervals say so (evenly
/// spread between them, a standard deviation of the distance over the root of twelve).
pub(super) fn split_half_width(found: &mut ForceFit, exact: &ForceFit) {
    for (axis, other) in found.axes.iter_mut().zip(&exact.axes) {
        let apart: Vec<f64> = axis.coefficients.iter().zip(&other.coefficients).map(|(a, b)| a - b).collect();
        let is_known: Vec<bool> = axis.half_widths.iter().map(Option::is_some).collect();
        for (i, j) in (0..apart.len()).flat_map(|i| (0..apart.len()).map(move |j| (i, j))) {
            if is_known[i] && is_known[j] {
                axis.covariance[(i, j)] += apart[i] * apart[j] / 12.0;
            }
        }
        let numbers = axis.coefficients.iter().zip(&other.coefficients);
        for (half, (a, b)) in axis.half_widths.iter_mut().zip(numbers) {
            if let Some(half) = half {
                *half = half.hypot(1.96 * (a - b) / 12.0_f64.sqrt());
            }
        }
    }
}
