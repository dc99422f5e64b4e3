//! Levenberg-Marquardt, bounded.

use nalgebra::DMatrix;

use super::equations::{Equations, Problem, Residuals, Values};
use super::types::LightFitError;

/// Steps at most.
const MAX_STEPS: u32 = 30;
/// Damping at the start, and beyond which no step is looked for.
const FIRST_DAMPING: f64 = 1e-3;
const MAX_DAMPING: f64 = 1e7;
/// Change of the cost, a part, below which the fit has ended.
const END: f64 = 1e-4;

/// Where a fit ended.
pub(super) struct Solved {
    pub values: Values,
    pub residuals: Residuals,
    /// Covariance of the whitened unknowns.
    pub covariance: DMatrix<f64>,
    /// Root mean square of the residuals of the places at rest and of the caps before and after, full scale 1.
    pub rms: [[f64; 2]; 2],
    pub steps: u32,
}

fn not_positive() -> LightFitError {
    let cure = "give frames of this sensor with another ball or at other places";
    LightFitError::new("the equations of the light are not positive definite", cure)
}

fn out_of_range() -> LightFitError {
    LightFitError::new(
        "the light of these constants cannot be computed",
        "give constants written by `domecast build`",
    )
}

/// Root mean squares at rest and in the caps; places that say nothing are left out.
pub(super) fn rms_of(problem: &Problem<'_>, residuals: &Residuals) -> [f64; 2] {
    let first = problem.seen.still.len();
    [(0, first), (first, residuals.off.len())].map(|(from, to)| {
        let all = residuals.off[from..to].iter().zip(&residuals.sd[from..to]);
        let used = all.flat_map(|(off, sd)| off.to_array().into_iter().zip(sd.to_array()));
        let used: Vec<f64> = used.filter(|(_, sd)| *sd < 1e3).map(|(off, _)| off * off).collect();
        (used.iter().sum::<f64>() / used.len().max(1) as f64).sqrt()
    })
}

/// Fits from some values.
///
/// # Errors
/// The fit does not end in the steps that are allowed, or the equations leave something open.
pub(super) fn solve(problem: &Problem<'_>, start: Values) -> Result<Solved, LightFitError> {
    let mut values = start;
    let mut lit = problem.lit(&values, true).ok_or_else(out_of_range)?;
    let mut residuals = problem.residuals(&values, &lit);
    // The lights' shapes change little on the way: their derivatives are taken once.
    let slopes = problem.slopes(&values).ok_or_else(out_of_range)?;
    let before = rms_of(problem, &residuals);
    let (mut damping, mut steps, mut is_done) = (FIRST_DAMPING, 0, false);
    let mut equations: Equations = problem.equations(&values, &lit, &residuals, &slopes);
    while steps < MAX_STEPS && !is_done {
        steps += 1;
        let mut damped = equations.matrix.clone();
        (0..damped.nrows()).for_each(|k| damped[(k, k)] *= 1.0 + damping);
        let step = damped.cholesky().ok_or_else(not_positive)?.solve(&equations.right);
        let next = problem.moved(&values, &step);
        let tried = problem.lit(&next, true).map(|lit| (problem.residuals(&next, &lit), lit));
        match tried.filter(|(after, _)| after.cost.is_finite() && after.cost <= residuals.cost) {
            Some((after, next_lit)) => {
                is_done = residuals.cost - after.cost <= END * (1.0 + residuals.cost);
                (values, lit, residuals) = (next, next_lit, after);
                damping = (0.1 * damping).max(1e-9);
                equations = problem.equations(&values, &lit, &residuals, &slopes);
            }
            // No step that is small beside what is known of the numbers lowers the cost any further.
            None if damping < MAX_DAMPING && step.amax() > 1e-3 => damping = (10.0 * damping).max(1e-3),
            None => is_done = true,
        }
    }
    let after = rms_of(problem, &residuals);
    if !is_done {
        let problem = format!(
            "the fit did not end in {MAX_STEPS} steps; {:.2} and {:.2} levels rms are left at rest and under the ball",
            255.0 * after[0],
            255.0 * after[1]
        );
        return Err(LightFitError::new(problem, "give frames of this sensor, sharp and at one exposure"));
    }
    let covariance = equations.matrix.cholesky().ok_or_else(not_positive)?.inverse();
    Ok(Solved { values, residuals, covariance, rms: [before, after], steps })
}
