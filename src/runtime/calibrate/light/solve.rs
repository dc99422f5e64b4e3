//! Levenberg-Marquardt, bounded.

use nalgebra::{DMatrix, DVector};

use super::equations::{Problem, Values};
use super::physics::ShadedDome;
use super::scatter::{FIRST_LENGTHS, Group, Said, Scatter, likeliest};
use super::types::LightFitError;

/// Steps at most.
const MAX_STEPS: u32 = 30;
/// Damping at the start, and beyond which no step is looked for.
const FIRST_DAMPING: f64 = 1e-3;
const MAX_DAMPING: f64 = 1e7;
/// No number of the light goes farther in one step, prior deviations: its slope is not known any farther.
const MAX_NUMBER_STEP: f64 = 1.0;
/// Part of the predicted fall of the cost from which on the damping is lowered.
const TRUSTED: f64 = 0.7;
/// A step of so many of the unknowns' own deviations, root mean square, says nothing: there the fit has ended.
const END: f64 = 0.1;
/// By how much the cost may fall otherwise than predicted, a part, before derivatives are taken anew.
const MAX_MISPREDICTED: f64 = 0.2;

/// Where a fit begins, with what is known there.
pub(super) struct Start {
    pub values: Values,
    /// The light of these values.
    pub lit: Option<ShadedDome>,
    /// Derivatives of these places by the light's numbers, at these values or beside them.
    pub slopes: Option<DMatrix<f64>>,
}

/// Where a fit ended.
pub(super) struct Solved {
    pub values: Values,
    lit: ShadedDome,
    /// What was seen less what the fit gives, three rows to a place.
    pub off: DVector<f64>,
    slopes: DMatrix<f64>,
    /// Covariance of the whitened unknowns.
    pub covariance: DMatrix<f64>,
    /// Root mean square of the residuals of the places at rest and of the caps before and after, full scale 1.
    pub rms: [[f64; 2]; 2],
    pub steps: u32,
}

impl Solved {
    /// From here on, with the same places. What another fit predicts badly by these derivatives it takes anew.
    pub fn go_on(self) -> Start {
        Start { values: self.values, lit: Some(self.lit), slopes: Some(self.slopes) }
    }
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
pub(super) fn rms_of(problem: &Problem<'_>, off: &DVector<f64>) -> [f64; 2] {
    let first = 3 * problem.seen.rest.len();
    let known: Vec<f64> = problem.known().flat_map(|known| known.to_array()).collect();
    [(0, first), (first, off.len())].map(|(from, to)| {
        let count: f64 = known[from..to].iter().sum();
        (off.rows(from, to - from).norm_squared() / count.max(1.0)).sqrt()
    })
}

/// The groups with the factors of their covariances.
struct Weighed<'a> {
    problem: &'a Problem<'a>,
    groups: Vec<(Group, nalgebra::Cholesky<f64, nalgebra::Dyn>)>,
}

impl<'a> Weighed<'a> {
    fn new(problem: &'a Problem<'a>) -> Option<Self> {
        let with = |(i, group): (usize, Group)| {
            let factor = group.factor(&problem.scatter[usize::from(i > 0)])?;
            Some((group, factor))
        };
        let groups = problem.groups().into_iter().enumerate().map(with).collect::<Option<_>>()?;
        Some(Self { problem, groups })
    }

    fn cost(&self, values: &Values, off: &DVector<f64>) -> f64 {
        let squares: f64 = self.groups.iter().map(|(group, factor)| group.squares(factor, off)).sum();
        squares + self.problem.whitened(values).norm_squared()
    }

    /// The normal equations with the priors, of some of the groups.
    fn equations(
        &self,
        values: &Values,
        slopes: &DMatrix<f64>,
        off: &DVector<f64>,
        is_taken: impl Fn(usize) -> bool,
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let n = slopes.ncols();
        let mut matrix = DMatrix::identity(n, n);
        let mut right = -self.problem.whitened(values);
        for (_, (group, factor)) in self.groups.iter().enumerate().filter(|(i, _)| is_taken(*i)) {
            let Said { matrix: own, right: own_right, .. } = group.says(factor, slopes, off)?;
            matrix += own;
            right += own_right;
        }
        Some((matrix, right))
    }
}

/// What of the unknowns is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Open {
    /// The balls, with the light as it is.
    Balls,
    /// Light and balls.
    All,
}

/// Fits from some values.
///
/// # Errors
/// The fit does not end in the steps that are allowed, or the equations leave something open.
pub(super) fn solve(problem: &Problem<'_>, start: Start, open: Open) -> Result<Solved, LightFitError> {
    let weighed = Weighed::new(problem).ok_or_else(not_positive)?;
    let mut values = start.values;
    let mut lit = start.lit.or_else(|| problem.lit(&values)).ok_or_else(out_of_range)?;
    let mut off = problem.off(&values, &lit);
    let mut cost = weighed.cost(&values, &off);
    let before = rms_of(problem, &off);
    let number_slopes = |values: &Values| match open {
        Open::Balls => Some(DMatrix::zeros(problem.rows_count(), problem.unknowns())),
        Open::All => problem.number_slopes(values),
    };
    let mut is_fresh = start.slopes.is_none();
    let mut slopes = start.slopes.or_else(|| number_slopes(&values)).ok_or_else(out_of_range)?;
    let all = |values: &Values, lit: &ShadedDome, slopes: &mut DMatrix<f64>, off: &DVector<f64>| {
        problem.add_ball_slopes(values, lit, slopes);
        let (matrix, mut right) =
            weighed.equations(values, slopes, off, |_| true).ok_or_else(not_positive)?;
        if open == Open::Balls {
            right.rows_mut(0, problem.model.count()).fill(0.0);
        }
        Ok((matrix, right))
    };
    let (mut matrix, mut right) = all(&values, &lit, &mut slopes, &off)?;
    let (mut damping, mut steps, mut is_done) = (FIRST_DAMPING, 0, false);
    let end = END * END * problem.unknowns() as f64;
    while steps < MAX_STEPS && !is_done {
        steps += 1;
        let mut damped = matrix.clone();
        (0..damped.nrows()).for_each(|k| damped[(k, k)] *= 1.0 + damping);
        let mut step = damped.cholesky().ok_or_else(not_positive)?.solve(&right);
        let largest = step.rows(0, problem.model.count()).amax();
        let part = (MAX_NUMBER_STEP / largest.max(1e-300)).min(1.0);
        step *= part;
        // What the quadratic through here says of the step: that of a part of a step falls by less than its square.
        let predicted = step.dot(&right) * (2.0 - part);
        // The last step is taken as well, if it leads down.
        is_done = part == 1.0 && predicted <= end;
        let next = problem.moved(&values, &step);
        let tried = problem.lit(&next).map(|lit| {
            let off = problem.off(&next, &lit);
            (weighed.cost(&next, &off), off, lit)
        });
        match tried.filter(|(after, _, _)| after.is_finite() && *after <= cost) {
            Some((after, next_off, next_lit)) => {
                let fulfilled = (cost - after) / predicted.max(1e-300);
                is_done |= part == 1.0 && cost - after <= end;
                (values, lit, off, cost) = (next, next_lit, next_off, after);
                if fulfilled > TRUSTED {
                    damping = (0.1 * damping).max(1e-9);
                }
                is_fresh = !is_done && (fulfilled - 1.0).abs() > MAX_MISPREDICTED;
                if is_fresh {
                    slopes = number_slopes(&values).ok_or_else(out_of_range)?;
                }
                (matrix, right) = all(&values, &lit, &mut slopes, &off)?;
            }
            // Derivatives of another place lead nowhere.
            None if !is_done && !is_fresh => {
                is_fresh = true;
                slopes = number_slopes(&values).ok_or_else(out_of_range)?;
                (matrix, right) = all(&values, &lit, &mut slopes, &off)?;
            }
            // No step that is small beside what is known of the numbers lowers the cost any further.
            None if !is_done && damping < MAX_DAMPING => damping = (10.0 * damping).max(1e-3),
            None => is_done = true,
        }
    }
    let after = rms_of(problem, &off);
    if !is_done {
        let problem = format!(
            "the fit did not end in {MAX_STEPS} steps; {:.2} and {:.2} levels rms are left at rest and under the ball",
            255.0 * after[0],
            255.0 * after[1]
        );
        return Err(LightFitError::new(problem, "give frames of this sensor, sharp and at one exposure"));
    }
    let covariance = matrix.cholesky().ok_or_else(not_positive)?.inverse();
    Ok(Solved { values, lit, off, slopes, covariance, rms: [before, after], steps })
}

/// The most likely errors of places at rest and of caps, as a fit has left them.
pub(super) fn scatter(problem: &Problem<'_>, solved: &Solved) -> Option<[Scatter; 2]> {
    let (_, dome_mm) = problem.physics.dome();
    let mut found = problem.scatter;
    for kind in [0, 1] {
        let now = Problem { scatter: found, ..*problem };
        let weighed = Weighed::new(&now)?;
        let (slopes, off) = (&solved.slopes, &solved.off);
        let rest = weighed.equations(&solved.values, slopes, off, |i| (i > 0) != (kind > 0))?;
        let own: Vec<Group> = weighed
            .groups
            .iter()
            .enumerate()
            .filter(|(i, _)| (*i > 0) == (kind > 0))
            .map(|(_, (group, _))| group.clone())
            .collect();
        // At rest nothing smoother than was taken at first: what a camera's coding shifts beside dots and what tables leave out beside
        // shadows is no longer, however little of it a fit leaves to be seen. In a cap, nothing finer than its cells.
        let lengths_mm = if kind == 0 {
            [0.05 * dome_mm, FIRST_LENGTHS[0] * dome_mm]
        } else {
            [0.01 * dome_mm, 0.2 * dome_mm]
        };
        found[kind] = likeliest(&own, found[kind], lengths_mm, slopes, off, (&rest.0, &rest.1));
    }
    Some(found)
}
