//! What the rows say of a table without any springs: repeats, an order that does not fit, a zero that drifts.

use std::collections::HashSet;

use nalgebra::{DMatrix, DVector};

use super::lag::lag_of;
use super::statistics::{held_to_usual, quantile, sorted, spread, weighed_fit};
use super::types::Pair;
use crate::constants::WRENCH_AXES;

/// More of the rows than this may not repeat another one digit for digit.
const MAX_REPEATED: f64 = 0.5;
/// Fewer rows are not judged.
const MIN_ROWS: usize = 24;
/// A residual that shrinks by this factor when the zero drifts says that it does.
const CLEAR_FACTOR: f64 = 3.0;
/// A drift below this part of the readings' range is left to the fit's noise.
const MIN_DRIFT: f64 = 0.03;
/// Rounds of reweighting.
const ROUNDS: usize = 4;
/// Rows that an order is judged by.
const MAX_ROWS: usize = 2000;

/// Median residual of a linear fit of readings clipped to their usual range, and the coefficients; `None` where the rows
/// do not determine it.
fn residual(terms: &[Vec<f64>], readings: &[f64]) -> Option<(f64, DVector<f64>)> {
    let width = terms.first()?.len();
    if readings.len() < 2 * width + 4 {
        return None;
    }
    let design = DMatrix::from_fn(readings.len(), width, |i, j| terms[i][j]);
    let target = DVector::from_vec(held_to_usual(readings)?);
    // Wild readings are let go in a few rounds of the biweight.
    let mut weights = DVector::from_element(readings.len(), 1.0);
    let mut found = None;
    for _ in 0..ROUNDS {
        let (fit, left) = weighed_fit(&design, &target, &weights)?;
        let left = left.abs();
        let median = quantile(&sorted(left.as_slice()), 0.5);
        weights = left.map(|v| (1.0 - (v / (7.0 * median).max(1e-300)).powi(2)).max(0.0).powi(2));
        found = Some((median, fit));
    }
    found
}

/// How far the zero of one axis drifts over the table, where the row's number explains far more than noise.
fn drift_of(pairs: &[Pair], axis: usize) -> Option<f64> {
    let (mut plain, mut with, mut readings) = (Vec::new(), Vec::new(), Vec::new());
    for (row, pair) in pairs.iter().enumerate() {
        if let Some(reading) = pair.wrench[axis] {
            plain.push(pair.affine_terms());
            let number = row as f64 / pairs.len() as f64;
            with.push(pair.affine_terms().into_iter().chain([number]).collect());
            readings.push(reading);
        }
    }
    if readings.len() < MIN_ROWS {
        return None;
    }
    let ((before, _), (after, found)) = (residual(&plain, &readings)?, residual(&with, &readings)?);
    let drift = *found.as_slice().last()?;
    (after * CLEAR_FACTOR < before && drift.abs() > MIN_DRIFT * spread(&readings)).then_some(drift)
}

/// What is wrong with the rows, in words; `lines`: the line of each in its file.
pub(super) fn implausible_rows(pairs: &[Pair], lines: &[usize]) -> Option<String> {
    let mut known = HashSet::with_capacity(pairs.len());
    let mut first_repeat = None;
    for (row, pair) in pairs.iter().enumerate() {
        let bits: Vec<Option<u64>> = pair
            .displacement
            .iter()
            .map(|v| Some(v.to_bits()))
            .chain(pair.wrench.iter().map(|w| w.map(f64::to_bits)))
            .collect();
        if !known.insert(bits) {
            first_repeat = first_repeat.or(Some(row));
        }
    }
    let distinct = known.len();
    if pairs.len() >= MIN_ROWS && (distinct as f64) < (1.0 - MAX_REPEATED) * pairs.len() as f64 {
        let line = first_repeat.map_or(0, |row| lines.get(row).copied().unwrap_or(row + 1));
        return Some(format!(
            "line {line} and others repeat a row digit for digit: only {distinct} of {} rows differ; a copied row is \
             no further measurement",
            pairs.len()
        ));
    }
    for (a, b) in (0..6).flat_map(|a| (a + 1..6).map(move |b| (a, b))) {
        let both: Vec<(f64, f64)> = pairs.iter().filter_map(|p| Some((p.wrench[a]?, p.wrench[b]?))).collect();
        let first: Vec<f64> = both.iter().map(|v| v.0).collect();
        if both.len() >= MIN_ROWS && both.iter().all(|(a, b)| a == b) && spread(&first) > 0.0 {
            return Some(format!(
                "{} and {} are the same numbers in every row",
                WRENCH_AXES[a], WRENCH_AXES[b]
            ));
        }
    }
    // The first rows keep the order, which every so many-th would not.
    let pairs = &pairs[..pairs.len().min(MAX_ROWS)];
    let counters: Vec<usize> = (0..6).filter(|axis| is_counter(pairs, *axis)).collect();
    if let Some(axis) = counters.first() {
        return Some(format!(
            "{} rises by the same step from row to row whatever the displacement does: a time or a row number",
            WRENCH_AXES[*axis]
        ));
    }
    if let Some(by) = lag_of(pairs) {
        let way = if by > 0 { "later" } else { "earlier" };
        return Some(format!(
            "looks like unpaired rows: the readings stand {} row(s) {way} than the displacements they belong to; pair them by time, or \
             read while nothing moves",
            by.abs()
        ));
    }
    let drifts = (0..6).filter_map(|axis| Some((axis, drift_of(pairs, axis)?)));
    let worst = drifts.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    worst.map(|(axis, drift)| {
        format!(
            "looks like a zero that drifts (temperature, creep): {} moves by {drift:.3} over the table at the same \
             displacement; let it warm up, take the zero again, or measure in a random order",
            WRENCH_AXES[axis]
        )
    })
}

/// Whether readings are a counter: equal steps, while the displacements do anything but that.
fn is_counter(pairs: &[Pair], axis: usize) -> bool {
    let readings: Vec<f64> = pairs.iter().map_while(|pair| pair.wrench[axis]).collect();
    if readings.len() < MIN_ROWS.min(pairs.len()) || readings.len() < 8 {
        return false;
    }
    let step = (readings[readings.len() - 1] - readings[0]) / (readings.len() - 1) as f64;
    let even = |(row, reading): (usize, &f64)| {
        (reading - readings[0] - step * row as f64).abs() <= 0.05 * step.abs()
    };
    let is_even = step != 0.0 && readings.iter().enumerate().all(even);
    // Dead weights rise by equal steps too: then the displacements follow them.
    let terms: Vec<Vec<f64>> = pairs[..readings.len()].iter().map(Pair::affine_terms).collect();
    let follows = residual(&terms, &readings).is_none_or(|(left, _)| left < 0.1 * spread(&readings));
    is_even && !follows
}
