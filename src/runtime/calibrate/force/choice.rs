//! The choice of the model by cross-validation, and what its residuals say of the springs.

use super::robust::{dot, median, robust};
use super::types::{ForceModel, Pair};

const FOLDS: usize = 5;

/// Error of each model in cross-validation, and the standard error of its difference from the best: readings
/// are dealt out in turn.
pub(super) fn validate(pairs: &[Pair], axis: usize, rows: &[usize], moved: &[usize]) -> Vec<(f64, f64)> {
    let mut squares: Vec<Vec<f64>> = vec![Vec::new(); ForceModel::ALL.len()];
    for fold in 0..FOLDS {
        let (test, train): (Vec<usize>, Vec<usize>) = (0..rows.len()).partition(|i| i % FOLDS == fold);
        let train: Vec<usize> = train.into_iter().map(|i| rows[i]).collect();
        for (model, into) in ForceModel::ALL.into_iter().zip(&mut squares) {
            let solved = robust(pairs, axis, &train, model, moved);
            for i in &test {
                let pair = &pairs[rows[*i]];
                let predicted = dot(&model.terms(&pair.displacement), &solved.coefficients);
                into.push((pair.wrench[axis].unwrap_or(predicted) - predicted).powi(2));
            }
        }
    }
    // Outliers tell nothing of a model: a reading counts up to sixteen times the median square.
    let caps: Vec<f64> = squares.iter().map(|s| 16.0 * median(&mut s.clone())).collect();
    let cap = caps.iter().copied().fold(f64::INFINITY, f64::min);
    let n = rows.len().max(1) as f64;
    // Differences below a billionth of the readings are rounding, not a better model.
    let size = rows.iter().filter_map(|row| pairs[*row].wrench[axis]).fold(0.0_f64, |m, w| m.max(w.abs()));
    squares
        .iter()
        .map(|s| {
            let mean = s.iter().map(|v| v.min(cap)).sum::<f64>() / n;
            let spread = s.iter().map(|v| (v.min(cap) - mean).powi(2)).sum::<f64>() / n;
            let error = (spread / n).sqrt() / (2.0 * mean.sqrt()).max(f64::MIN_POSITIVE);
            (mean.sqrt(), error + 1e-9 * size)
        })
        .collect()
}

/// The simplest model whose error on every axis is within one standard error of that axis's best.
pub(super) fn choose(scores: &[Vec<(f64, f64)>]) -> ForceModel {
    let good = |k: usize| {
        scores.iter().all(|axis| {
            let best = axis.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 0.0));
            axis.get(k).is_none_or(|s| s.0 <= best.0 + best.1)
        })
    };
    ForceModel::ALL
        .into_iter()
        .enumerate()
        .find(|(k, _)| good(*k))
        .map_or(ForceModel::Compressing, |(_, m)| m)
}

/// Mean residual on rising load less that on falling load, over the range of the readings; `None` without enough
/// of both.
pub(super) fn hysteresis(
    pairs: &[Pair],
    axis: usize,
    rows: &[usize],
    outliers: &[usize],
    left: impl Fn(usize) -> f64,
) -> Option<f64> {
    let value = |row: usize| pairs[row].wrench[axis].unwrap_or(0.0);
    let range = rows.iter().map(|r| value(*r)).fold(f64::NEG_INFINITY, f64::max)
        - rows.iter().map(|r| value(*r)).fold(f64::INFINITY, f64::min);
    let (mut rising, mut falling) = (Vec::new(), Vec::new());
    for pair in rows.windows(2) {
        if outliers.contains(&pair[0]) || outliers.contains(&pair[1]) {
            continue;
        }
        let change = value(pair[1]).abs() - value(pair[0]).abs();
        if change > 0.0 {
            rising.push(left(pair[1]));
        } else if change < 0.0 {
            falling.push(left(pair[1]));
        }
    }
    if rising.len() < 5 || falling.len() < 5 || range <= 0.0 {
        return None;
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    Some((mean(&rising) - mean(&falling)) / range)
}
