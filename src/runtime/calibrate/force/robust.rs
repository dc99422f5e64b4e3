//! One axis of the wrench by Tukey's biweight, with confidence intervals.

use nalgebra::{DMatrix, DVector};

use super::{ForceModel, Pair};

/// Tukey's constant: full efficiency of 95 % for normal noise.
const TUKEY: f64 = 4.685;
/// Median absolute deviation to standard deviation for normal noise.
const MAD_TO_SD: f64 = 1.4826;
const MOST_ROUNDS: usize = 60;
/// A coefficient whose term varies by less than this part of the others, once scaled, is not determined.
const LEAST_SINGULAR: f64 = 1e-3;

/// The fit of one axis.
pub(super) struct Solved {
    pub coefficients: Vec<f64>,
    pub half_widths: Vec<Option<f64>>,
    pub sd: f64,
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Iteratively reweighted least squares of one wrench axis; terms of axes that do not move are left at zero.
pub(super) fn robust(
    pairs: &[Pair],
    axis: usize,
    rows: &[usize],
    model: ForceModel,
    moved: &[usize],
) -> Solved {
    let all: Vec<Vec<f64>> = rows.iter().map(|row| model.terms(&pairs[*row].displacement)).collect();
    let count = all.first().map_or(0, Vec::len);
    // The offset stands at 6; a product term belongs to the axis that it multiplies.
    let belongs = |term: usize| match term {
        0..6 => moved.contains(&term),
        6 => true,
        _ => moved.contains(&(term - 7)) && moved.contains(&2),
    };
    let used: Vec<usize> = (0..count).filter(|term| belongs(*term)).collect();
    let scale: Vec<f64> = used
        .iter()
        .map(|term| {
            (all.iter().map(|t| t[*term] * t[*term]).sum::<f64>() / rows.len() as f64).sqrt().max(1e-300)
        })
        .collect();
    let design = DMatrix::from_fn(rows.len(), used.len(), |i, j| all[i][used[j]] / scale[j]);
    let target = DVector::from_fn(rows.len(), |i, _| pairs[rows[i]].wrench[axis].unwrap_or(0.0));
    let mut weights = DVector::from_element(rows.len(), 1.0);
    let mut found = DVector::zeros(used.len());
    let mut sd = 0.0;
    let mut inverse = DMatrix::zeros(used.len(), used.len());
    let mut determined = vec![true; used.len()];
    for round in 0..MOST_ROUNDS {
        let root = weights.map(f64::sqrt);
        let weighted = DMatrix::from_fn(rows.len(), used.len(), |i, j| design[(i, j)] * root[i]);
        let svd = weighted.clone().svd(false, true);
        let Some(v_t) = svd.v_t.as_ref() else { break };
        let largest = svd.singular_values.max();
        // Directions that the data do not show are left out, and so is every coefficient that they reach.
        inverse.fill(0.0);
        determined.fill(true);
        for (k, s) in svd.singular_values.iter().enumerate() {
            let direction = v_t.row(k).transpose();
            if *s > LEAST_SINGULAR * largest {
                inverse += &direction * direction.transpose() / (s * s);
            } else {
                for (flag, part) in determined.iter_mut().zip(direction.iter()) {
                    *flag &= part.abs() < 0.05;
                }
            }
        }
        let right = weighted.transpose() * target.component_mul(&root);
        let next = &inverse * right;
        let left = &target - &design * &next;
        let mut sizes: Vec<f64> = left.iter().map(|v| v.abs()).collect();
        let range = target.amax();
        sd = (MAD_TO_SD * median(&mut sizes)).max(1e-13 * range);
        // The first round's scale is that of plain least squares, which outliers widen: it only lets them go
        // more slowly.
        let change = (&next - &found).amax();
        found = next;
        weights = left.map(|r| {
            let u = r / (TUKEY * sd.max(f64::MIN_POSITIVE));
            if u.abs() < 1.0 { (1.0 - u * u).powi(2) } else { 0.0 }
        });
        if round > 3 && change <= 1e-10 * found.amax() {
            break;
        }
    }
    // Huber's asymptotic covariance of an M-estimate: sd^2 E[psi^2] / E[psi']^2 (X^T X)^-1.
    let n = rows.len() as f64;
    let left = &target - &design * &found;
    let (mut psi2, mut slope) = (0.0, 0.0);
    for r in left.iter() {
        let u = r / (TUKEY * sd.max(f64::MIN_POSITIVE));
        if u.abs() < 1.0 {
            psi2 += (r * (1.0 - u * u).powi(2)).powi(2);
            slope += (1.0 - u * u) * (1.0 - 5.0 * u * u);
        }
    }
    let freedom = (n - used.len() as f64).max(1.0);
    let variance = (psi2 / freedom) / (slope / n).max(0.05).powi(2);
    let gram = design.transpose() * &design;
    let covariance = gram.pseudo_inverse(1e-12).unwrap_or_else(|_| DMatrix::zeros(used.len(), used.len()));
    let mut coefficients = vec![0.0; count];
    let mut half_widths = vec![None; count];
    for (k, term) in used.iter().enumerate() {
        coefficients[*term] = found[k] / scale[k];
        if determined[k] {
            half_widths[*term] = Some(1.96 * (variance * covariance[(k, k)]).max(0.0).sqrt() / scale[k]);
        }
    }
    Solved { coefficients, half_widths, sd }
}
