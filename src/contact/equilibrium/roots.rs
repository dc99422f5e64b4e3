//! Roots of equations whose values are contact solves: Broyden's method from a tangent by differences.

use nalgebra::{DMatrix, DVector};

use crate::error::ContactError;

/// Trials that one search may take.
const MAX_TRIALS: u32 = 160;
/// Trials without any gain after which a search ends.
const MAX_WITHOUT_GAIN: u32 = 30;
/// Starts that are tried where the first has no value, each nearer to rest.
const MAX_STARTS: u32 = 6;
/// Shorter parts of a step are not tried.
const MIN_PART: f64 = 1e-4;

/// Equations of as many unknowns; values in N.
pub(super) trait Equations {
    /// What a trial finds besides the residual.
    type Found: Clone;

    /// Values at a place, from those found near it; `off_n` is what the last trial was off by.
    fn at(
        &self,
        x: &DVector<f64>,
        near: Option<&Self::Found>,
        off_n: f64,
    ) -> Result<(Self::Found, DVector<f64>), ContactError>;

    /// Below this a residual is a root.
    fn wanted_n(&self, found: &Self::Found) -> f64;

    /// How often a step is as long as one that may be gone at once.
    fn longest_step(&self, step: &DVector<f64>) -> f64;

    /// How far an unknown is moved for the tangent.
    fn probe(&self, unknown: usize) -> f64;
}

/// Where a search ended.
pub(super) struct Root<F> {
    pub x: DVector<f64>,
    pub found: F,
    /// Norm of the residual, N.
    pub size: f64,
}

/// Looks for a root from a start.
pub(super) fn root<E: Equations>(equations: &E, start: DVector<f64>) -> Result<Root<E::Found>, ContactError> {
    let mut x = start;
    let mut trials = 1;
    let (mut found, mut residual) = loop {
        match equations.at(&x, None, 0.0) {
            Ok(first) => break first,
            Err(error) if trials >= MAX_STARTS => return Err(error),
            Err(_) => x *= 0.7,
        }
        trials += 1;
    };
    let mut size = residual.norm();
    let (mut best_size, mut best_trial) = (size, trials);
    let mut tangent: Option<DMatrix<f64>> = None;
    let mut fresh = false;
    while trials < MAX_TRIALS.min(best_trial + MAX_WITHOUT_GAIN) && !x.is_empty() {
        if size <= 0.3 * equations.wanted_n(&found) {
            break;
        }
        let jacobian = match tangent.take() {
            Some(jacobian) => jacobian,
            None => {
                fresh = true;
                trials += x.len() as u32;
                by_differences(equations, &x, (&found, &residual))?
            }
        };
        let step = jacobian.clone().lu().solve(&-&residual).filter(|step| step.iter().all(|s| s.is_finite()));
        let mut next = None;
        if let Some(step) = &step {
            let mut part = 1.0 / equations.longest_step(step).max(1.0);
            while part > MIN_PART && trials < MAX_TRIALS {
                trials += 1;
                let there = &x + step * part;
                if let Ok((there_found, value)) = equations.at(&there, Some(&found), size.min(best_size))
                    && value.norm() < 1.5 * best_size.max(0.3 * size)
                {
                    next = Some((there, there_found, value));
                    break;
                }
                if !fresh {
                    break;
                }
                part *= 0.4;
            }
        }
        let Some((there, there_found, value)) = next else {
            if fresh {
                break;
            }
            continue;
        };
        let moved = &there - &x;
        let miss = &value - &residual - &jacobian * &moved;
        tangent = Some(&jacobian + &miss * moved.transpose() / moved.norm_squared().max(f64::MIN_POSITIVE));
        fresh = false;
        (x, found, residual) = (there, there_found, value);
        size = residual.norm();
        if size < best_size {
            (best_size, best_trial) = (size, trials);
        }
    }
    Ok(Root { x, found, size })
}

/// The derivative of the residual, unknown by unknown.
fn by_differences<E: Equations>(
    equations: &E,
    x: &DVector<f64>,
    (found, residual): (&E::Found, &DVector<f64>),
) -> Result<DMatrix<f64>, ContactError> {
    let mut jacobian = DMatrix::zeros(x.len(), x.len());
    for unknown in 0..x.len() {
        let mut there = x.clone();
        let step = equations.probe(unknown);
        there[unknown] += step;
        let (_, value) = equations.at(&there, Some(found), 0.0)?;
        jacobian.set_column(unknown, &((value - residual) / step));
    }
    Ok(jacobian)
}
