//! Quantiles, and how one series follows another, whatever a tenth of wild values says.

use nalgebra::{DMatrix, DVector};

/// The value below which a part of the values lies; 0 of none.
pub(super) fn quantile(sorted: &[f64], part: f64) -> f64 {
    let at = (part * sorted.len().saturating_sub(1) as f64).round() as usize;
    sorted.get(at).copied().unwrap_or(0.0)
}

pub(super) fn sorted(values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values
}

/// Range of the values without the fiftieth at each end.
pub(super) fn spread(values: &[f64]) -> f64 {
    let values = sorted(values);
    quantile(&values, 0.98) - quantile(&values, 0.02)
}

/// Values held to where they usually lie, and 0.3 of that range beside; `None` where that is not finite.
pub(super) fn held_to_usual(values: &[f64]) -> Option<Vec<f64>> {
    let order = sorted(values);
    let (low, high) = (quantile(&order, 0.02), quantile(&order, 0.98));
    let room = 0.3 * (high - low);
    let (low, high) = (low - room, high + room);
    (low.is_finite() && high.is_finite()).then(|| values.iter().map(|v| v.clamp(low, high)).collect())
}

/// Median of absolute values to standard deviation, of normal noise.
pub(super) const MEDIAN_TO_SD: f64 = 1.4826;
/// Keeps equations definite that leave something open.
const RIDGE: f64 = 1e-10;

/// A linear fit of weighed rows, and what it leaves of the target; `None` where a number is not finite.
pub(super) fn weighed_fit(
    terms: &DMatrix<f64>,
    target: &DVector<f64>,
    weights: &DVector<f64>,
) -> Option<(DVector<f64>, DVector<f64>)> {
    if terms.iter().chain(target.iter()).any(|v| !v.is_finite()) {
        return None;
    }
    let sizes = DVector::from_fn(terms.ncols(), |j, _| terms.column(j).norm().max(1e-300));
    let scaled = DMatrix::from_fn(terms.nrows(), terms.ncols(), |i, j| terms[(i, j)] / sizes[j]);
    let weighed = DMatrix::from_fn(terms.nrows(), terms.ncols(), |i, j| scaled[(i, j)] * weights[i]);
    let gram = weighed.tr_mul(&scaled) + DMatrix::identity(terms.ncols(), terms.ncols()) * RIDGE;
    let fit = gram.cholesky()?.solve(&weighed.tr_mul(target));
    let left = target - scaled * &fit;
    Some((fit.component_div(&sizes), left))
}

/// How readings follow predictions: over pairs of rows whose predictions lie far apart, the ratio of the differences.
#[derive(Debug, Clone, Copy)]
pub(super) struct Following {
    /// Median of the ratios.
    pub slope: f64,
    /// Half the distance of their quartiles.
    pub scatter: f64,
}

/// Rows of a prediction, and the rows that each is compared with.
const MAX_STARTS: usize = 200;
const PARTNERS: usize = 8;
/// Least difference of the predictions of a pair, in parts of their range.
const MIN_APART: f64 = 0.4;

impl Following {
    /// Of readings (which may be missing) and predictions; `None` without enough pairs.
    pub fn of(readings: &[Option<f64>], predictions: &[f64]) -> Option<Self> {
        let mut rows: Vec<(f64, f64)> =
            readings.iter().zip(predictions).filter_map(|(y, p)| Some((*p, (*y)?))).collect();
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        let all: Vec<f64> = rows.iter().map(|row| row.0).collect();
        let apart = MIN_APART * (quantile(&all, 0.98) - quantile(&all, 0.02));
        if rows.len() < 6 || !(apart > 0.0 && apart.is_finite()) {
            return None;
        }
        let mut ratios = Vec::new();
        for start in (0..rows.len()).step_by(rows.len().div_ceil(MAX_STARTS)) {
            let first = rows.partition_point(|row| row.0 < rows[start].0 + apart);
            let count = rows.len() - first;
            for k in 0..PARTNERS.min(count) {
                let partner = rows[first + k * count / PARTNERS.min(count)];
                ratios.push((partner.1 - rows[start].1) / (partner.0 - rows[start].0));
            }
        }
        ratios.sort_by(f64::total_cmp);
        let slope = quantile(&ratios, 0.5);
        let scatter = 0.5 * (quantile(&ratios, 0.75) - quantile(&ratios, 0.25));
        (ratios.len() >= 6 && slope.is_finite() && scatter.is_finite()).then_some(Self { slope, scatter })
    }

    /// Whether the readings go with the predictions at all.
    pub fn is_clear(&self) -> bool {
        self.slope.abs() > self.scatter
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slope_is_found_among_wild_values_and_not_where_there_is_none() {
        let p: Vec<f64> = (0..90).map(|i| (1.7 * f64::from(i)).sin()).collect();
        let y: Vec<Option<f64>> =
            p.iter().enumerate().map(|(i, v)| Some(if i % 11 == 0 { 50.0 } else { 3.0 * v + 1.0 })).collect();
        let found = Following::of(&y, &p).unwrap();
        assert!((found.slope - 3.0).abs() < 1e-9 && found.is_clear(), "{found:?}");
        let other: Vec<Option<f64>> = (0..90).map(|i| Some((2.9 * f64::from(i)).cos())).collect();
        assert!(!Following::of(&other, &p).unwrap().is_clear());
        assert!(Following::of(&y, &[1.0; 90]).is_none());
    }
}
