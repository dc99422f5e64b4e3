//! Rows whose readings belong to displacements some rows off: two clocks, or one line too many at the top of one file.
//!
//! Each axis is fitted to the displacements of its own row and to those of the rows before and after, always of the same rows. Shifted
//! rows fit worse on all axes together, by far more than noise makes: the logarithm of the ratio of the likelihoods is half the number of
//! rows times that of the variances, summed over the axes. Springs that stick lag too, by the sign of their motion alone, which is fitted beside.

use nalgebra::{DMatrix, DVector};

use super::rows::terms_of;
use super::statistics::spread;
use super::types::Pair;

/// Rows that a shift is looked for over.
const MAX_SHIFT: isize = 10;
/// Rows that must be left beside those that a shift may lose.
const MIN_ROWS: usize = 20;
/// Rows go together otherwise where that is likelier by this logarithm, and the variances, in their geometric mean, fall by this factor.
const MIN_LOG_LIKELIHOOD: f64 = 30.0;
const MIN_GAIN: f64 = 1.2;
/// An axis by itself is for the shift from this logarithm on; most of them must be.
const MIN_OWN: f64 = 2.0;
/// Residuals below this part of the readings' range say nothing of the order.
const MIN_RESIDUAL: f64 = 1e-3;
/// Readings so many deviations off are let go, in so many rounds.
const WILD_SDS: f64 = 4.0;
const ROUNDS: usize = 3;
/// Changes below this part of the largest have no sign.
const STILL: f64 = 1e-3;
/// Keeps equations definite that leave something open.
const RIDGE: f64 = 1e-12;

/// By how many rows the readings stand later than their displacements (below 0: earlier), where that is clear; axes with missing
/// readings say nothing.
pub(super) fn lag_of(pairs: &[Pair]) -> Option<isize> {
    let count = pairs.len().checked_sub(2 * MAX_SHIFT.unsigned_abs()).filter(|count| *count >= MIN_ROWS)?;
    let axes: Vec<Vec<f64>> = (0..6).filter_map(|axis| log_variances(pairs, axis)).collect();
    let now = MAX_SHIFT.unsigned_abs();
    // for a shift of each axis: how much likelier it is than none
    let likelier = |k: usize| axes.iter().map(move |axis| 0.5 * count as f64 * (axis[now] - axis[k]));
    let best = (0..=2 * now).max_by(|a, b| likelier(*a).sum::<f64>().total_cmp(&likelier(*b).sum()))?;
    let sum: f64 = likelier(best).sum();
    let of_it = likelier(best).filter(|own| *own > MIN_OWN).count();
    let gain = 2.0 * sum / (count * axes.len().max(1)) as f64;
    let is_clear =
        sum > MIN_LOG_LIKELIHOOD && gain > MIN_GAIN.ln() && axes.len() > 1 && 2 * of_it > axes.len();
    is_clear.then_some(best as isize - MAX_SHIFT)
}

/// Logarithm of the residuals' variance for each shift; `None` of an axis that is not read in every row.
fn log_variances(pairs: &[Pair], axis: usize) -> Option<Vec<f64>> {
    let read: Option<Vec<f64>> = pairs.iter().map(|pair| pair.wrench[axis]).collect();
    let readings = DVector::from_vec(read?);
    let rows: Vec<Vec<f64>> = pairs.iter().map(|pair| terms_of(pair, None)).collect();
    let width = rows.first()?.len();
    let plain = DMatrix::from_fn(rows.len(), width, |i, j| rows[i][j]);
    let (fit, _) = fitted(&plain, &readings)?;
    let level = &plain * fit;
    let last = level.len() - 1;
    let change = DVector::from_fn(level.len(), |i, _| level[(i + 1).min(last)] - level[i.saturating_sub(1)]);
    let still = STILL * change.amax();
    let mut terms = plain.insert_column(width, 0.0);
    terms.set_column(width, &change.map(|v| if v.abs() > still { v.signum() } else { 0.0 }));
    let first = MAX_SHIFT.unsigned_abs();
    let count = level.len() - 2 * first;
    let terms = terms.rows(first, count).into_owned();
    let least = (MIN_RESIDUAL * spread(readings.as_slice())).powi(2).max(1e-300);
    let shifted = |k: usize| Some(fitted(&terms, &readings.rows(k, count).into_owned())?.1.max(least).ln());
    (0..=2 * first).map(shifted).collect()
}

/// A linear fit without the wildest readings, and the variance that it leaves; `None` where the rows do not determine it.
fn fitted(terms: &DMatrix<f64>, readings: &DVector<f64>) -> Option<(DVector<f64>, f64)> {
    if terms.nrows() <= 2 * terms.ncols() || terms.iter().chain(readings.iter()).any(|v| !v.is_finite()) {
        return None;
    }
    let sizes = DVector::from_fn(terms.ncols(), |j, _| terms.column(j).norm().max(1e-300));
    let mut kept = DVector::from_element(terms.nrows(), 1.0);
    let mut found = None;
    for _ in 0..ROUNDS {
        let scaled =
            DMatrix::from_fn(terms.nrows(), terms.ncols(), |i, j| terms[(i, j)] * kept[i] / sizes[j]);
        let gram = scaled.tr_mul(&scaled) + DMatrix::identity(terms.ncols(), terms.ncols()) * RIDGE;
        let fit = gram.cholesky()?.solve(&scaled.tr_mul(readings)).component_div(&sizes);
        let squares = (readings - terms * &fit).map(|v| v * v);
        let variance = squares.dot(&kept) / kept.sum().max(1.0);
        kept = squares.map(|square| if square <= WILD_SDS * WILD_SDS * variance { 1.0 } else { 0.0 });
        found = Some((fit, variance));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use domecast_optics::numeric::SeededRandom;
    use nalgebra::Matrix6;

    /// Each axis by itself, up and down, with readings that stand so many rows later, noise, and springs that stick.
    fn swept(later: i32, noise: f64, sticks: f64) -> Vec<Pair> {
        let mut random = SeededRandom::new(7);
        let moved = |row: f64| -> [f64; 6] {
            let (axis, at) = ((row / 25.0).floor(), (row % 25.0) / 25.0);
            std::array::from_fn(|k| if axis == k as f64 { (std::f64::consts::TAU * at).sin() } else { 0.0 })
        };
        let of = |row: i32| {
            let (there, next) = (moved(f64::from(row - later)), moved(f64::from(row - later) + 0.1));
            let wrench = std::array::from_fn(|k| {
                let stuck = if next[k] == there[k] { 0.0 } else { sticks * (next[k] - there[k]).signum() };
                Some(2.0 * there[k] + stuck + noise * random.normal())
            });
            let displacement = moved(f64::from(row)).map(|v| v + 0.3 * noise * random.normal());
            Pair { displacement, displacement_covariance: Matrix6::zeros(), wrench }
        };
        (0..150).map(of).collect()
    }

    #[test]
    fn readings_that_stand_beside_their_rows_are_found() {
        for later in [-7, -2, -1, 1, 3] {
            for noise in [0.001, 0.1, 0.2] {
                assert_eq!(lag_of(&swept(later, noise, 0.0)), Some(later as isize), "{later} {noise}");
            }
        }
    }

    #[test]
    fn noise_and_springs_that_stick_are_no_lag() {
        for (noise, sticks) in [(0.0, 0.0), (0.001, 0.0), (0.1, 0.0), (0.5, 0.0), (0.02, 0.02), (0.02, 0.1)] {
            assert_eq!(lag_of(&swept(0, noise, sticks)), None, "{noise} {sticks}");
        }
        assert_eq!(lag_of(&[]), None);
    }
}
