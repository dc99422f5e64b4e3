//! Rows whose readings belong to displacements some rows off: two clocks, or one line too many at the top of one file.
//!
//! The readings of each axis are fitted to the displacements of their own rows and to those of the rows before and after, always the same
//! readings. Where a shift is right all axes together fit better, be the motion ever so slow beside its noise: by the likelihood of
//! Student's t, in which wild readings count little. Springs that stick lag too, by the sign of their motion alone, which is fitted beside.

use nalgebra::{DMatrix, DVector};

use super::statistics::{MEDIAN_TO_SD, held_to_usual, quantile, sorted, spread, weighed_fit};
use super::types::Pair;

/// Rows that a shift is looked for over, and of how many rows one at most.
const MAX_SHIFT: usize = 10;
const MAX_SHIFT_PART: usize = 15;
/// Rows go together otherwise where that is likelier by this logarithm, and by this one for each reading.
const MIN_LIKELIER: f64 = 30.0;
const MIN_LIKELIER_EACH: f64 = 0.05;
/// An axis by itself is for the shift from this logarithm on; most of them must be.
const MIN_OWN: f64 = 2.0;
/// Degrees of freedom of Student's t.
const FREEDOM: f64 = 4.0;
/// Residuals below this part of the readings' range say nothing of the order.
const MIN_RESIDUAL: f64 = 1e-3;
/// Changes below this part of the largest have no sign.
const STILL: f64 = 1e-3;

/// By how many rows the readings stand later than their displacements (below 0: earlier), where that is clear.
pub(super) fn lag_of(pairs: &[Pair]) -> Option<isize> {
    let max_shift = MAX_SHIFT.min(pairs.len() / MAX_SHIFT_PART);
    let rows: Vec<Vec<f64>> = pairs.iter().map(Pair::affine_terms).collect();
    let terms = DMatrix::from_fn(rows.len(), rows.first()?.len(), |i, j| rows[i][j]);
    let of_axis = |axis| AxisShifts::of(pairs, &terms, axis, max_shift);
    let axes: Vec<AxisShifts> = (0..6).filter_map(of_axis).collect();
    // for a shift: how much likelier it is than none, of each axis
    let likelier =
        |k: usize| axes.iter().map(move |axis| axis.log_likelihoods[k] - axis.log_likelihoods[max_shift]);
    let best = (0..=2 * max_shift).max_by(|a, b| likelier(*a).sum::<f64>().total_cmp(&likelier(*b).sum()))?;
    let sum: f64 = likelier(best).sum();
    let for_it = likelier(best).filter(|own| *own > MIN_OWN).count();
    let readings: usize = axes.iter().map(|axis| axis.readings).sum();
    let is_clear = sum > MIN_LIKELIER.max(MIN_LIKELIER_EACH * readings as f64) && 2 * for_it > axes.len();
    is_clear.then_some(best as isize - max_shift as isize)
}

/// What one axis says of shifts.
struct AxisShifts {
    /// For each shift from the largest one earlier to the largest one later.
    log_likelihoods: Vec<f64>,
    /// Readings that say it.
    readings: usize,
}

impl AxisShifts {
    /// `None` of an axis that too few rows read.
    fn of(pairs: &[Pair], plain: &DMatrix<f64>, axis: usize, max_shift: usize) -> Option<Self> {
        let read: Vec<(usize, f64)> =
            pairs.iter().enumerate().filter_map(|(row, pair)| Some((row, pair.wrench[axis]?))).collect();
        let all: Vec<f64> = read.iter().map(|(_, reading)| *reading).collect();
        let read: Vec<(usize, f64)> =
            read.into_iter().zip(held_to_usual(&all)?).map(|((row, _), held)| (row, held)).collect();
        let (fit, _) = fitted(plain, &read, 0)?;
        let level = plain * fit;
        let last = level.len() - 1;
        let change =
            DVector::from_fn(level.len(), |i, _| level[(i + 1).min(last)] - level[i.saturating_sub(1)]);
        let still = STILL * change.amax();
        let mut terms = plain.clone().insert_column(plain.ncols(), 0.0);
        let sign = change.map(|v| if v.abs() > still { v.signum() } else { 0.0 });
        terms.set_column(plain.ncols(), &sign);
        // always the same readings
        let middle = max_shift..pairs.len() - max_shift;
        let read: Vec<(usize, f64)> = read.into_iter().filter(|(row, _)| middle.contains(row)).collect();
        let max_shift = max_shift as isize;
        let shifted = |by: isize| Some(fitted(&terms, &read, by)?.1);
        let left: Vec<DVector<f64>> = (-max_shift..=max_shift).map(shifted).collect::<Option<_>>()?;
        let median = |left: &DVector<f64>| quantile(&sorted(left.abs().as_slice()), 0.5);
        let noise = MEDIAN_TO_SD * left.iter().map(median).fold(f64::INFINITY, f64::min);
        let noise = noise.max(MIN_RESIDUAL * spread(&all)).max(1e-300);
        let of = |v: f64| -0.5 * (FREEDOM + 1.0) * ((v / noise).powi(2) / FREEDOM).ln_1p();
        let log_likelihoods = left.iter().map(|left| left.iter().map(|v| of(*v)).sum()).collect();
        Some(Self { log_likelihoods, readings: read.len() })
    }
}

/// A linear fit of readings, each with its row, by the terms of rows so many before them, and what it leaves; `None` where they do not
/// determine it.
fn fitted(terms: &DMatrix<f64>, read: &[(usize, f64)], later: isize) -> Option<(DVector<f64>, DVector<f64>)> {
    if read.len() <= 2 * terms.ncols() {
        return None;
    }
    let rows: Vec<usize> =
        read.iter().map(|(row, _)| row.checked_add_signed(-later)).collect::<Option<_>>()?;
    let readings = DVector::from_iterator(read.len(), read.iter().map(|(_, reading)| *reading));
    weighed_fit(&terms.select_rows(&rows), &readings, &DVector::from_element(read.len(), 1.0))
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
                let mut pairs = swept(later, noise, 0.0);
                assert_eq!(lag_of(&pairs), Some(later as isize), "{later} {noise}");
                // cells that are empty, and an axis that is never read
                pairs.iter_mut().step_by(7).for_each(|pair| pair.wrench[1] = None);
                pairs.iter_mut().for_each(|pair| pair.wrench[3] = None);
                assert_eq!(lag_of(&pairs), Some(later as isize), "{later} {noise}, with gaps");
            }
        }
    }

    #[test]
    fn noise_and_springs_that_stick_are_no_lag() {
        for (noise, sticks) in [(0.0, 0.0), (0.001, 0.0), (0.1, 0.0), (0.5, 0.0), (0.02, 0.02), (0.02, 0.1)] {
            assert_eq!(lag_of(&swept(0, noise, sticks)), None, "{noise} {sticks}");
        }
        assert_eq!(lag_of(&[]), None);
        let mut wild = swept(0, 0.1, 0.0);
        wild.iter_mut().step_by(3).for_each(|pair| pair.wrench = [Some(f64::INFINITY); 6]);
        assert_eq!(lag_of(&wild), None);
        wild.iter_mut().step_by(2).for_each(|pair| pair.wrench = [Some(f64::NAN); 6]);
        assert_eq!(lag_of(&wild), None);
    }
}
