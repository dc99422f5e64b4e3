//! What a fit makes of the constants.

use super::types::{ForceFit, Pair};
use crate::constants::{
    AxisUncertainty, Constants, SpringUncertainty, StiffnessAt, WRENCH_AXES, matrix_of, rows,
};

/// Parts of the deepest press that the stiffness is given at.
const PARTS: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];
/// How far a rate that was not measured may be off, part of it, where the constants do not say it.
const RATE_PART: f64 = 0.1;
/// Terms of one axis of the wrench without its offset: the displacement, and compression times it.
const TERMS: usize = 12;

impl ForceFit {
    /// Writes what was measured, and what was left open, into the constants' springs, and fits the plain runtime anew;
    /// `through_optics`: whether the motions were seen through these constants' own optics.
    pub fn write_into(&self, constants: &mut Constants, pairs: &[Pair], through_optics: bool) {
        let tolerances = constants.tolerances.and_then(|t| t.springs);
        let Some(springs) = constants.springs.as_mut() else { return };
        let rate_part = tolerances.zip(springs.law.as_ref()).map_or(RATE_PART, |(t, law)| t.rate_part(law));
        let deepest_mm = pairs.iter().map(|pair| -pair.displacement[2]).fold(0.0, f64::max);
        springs.stiffness = self.stiffness;
        springs.source = "measured".into();
        springs.offset = self.offset;
        springs.stiffness_at = match &self.by_compression {
            Some(growth) => {
                let at = |compression_mm: f64| StiffnessAt {
                    compression_mm,
                    stiffness: rows(&(matrix_of(&self.stiffness) + matrix_of(growth) * compression_mm)),
                };
                PARTS.map(|part| at(part * deepest_mm)).to_vec()
            }
            None => Vec::new(),
        };
        springs.uncertainty = Some(SpringUncertainty {
            axes: self.left_open(rate_part),
            max_compression_mm: deepest_mm,
            through_optics,
        });
        constants.refit_plain_runtime();
    }

    /// Covariances of the coefficients; what stayed nominal is open by a part of its rate.
    fn left_open(&self, rate_part: f64) -> Vec<AxisUncertainty> {
        let open = |fit: &super::types::AxisFit| {
            let row = WRENCH_AXES.iter().position(|name| *name == fit.axis).unwrap_or(0);
            // The offset stands at 6.
            let place = |term: usize| if term < 6 { term } else { term + 1 };
            let entry = |i: usize, j: usize| {
                let (a, b) = (place(i), place(j));
                let is_measured = |term: usize| fit.half_widths.get(term).is_some_and(Option::is_some);
                if is_measured(a) && is_measured(b) {
                    0.5 * (fit.covariance[(a, b)] + fit.covariance[(b, a)])
                } else if i == j && i < 6 && !is_measured(a) {
                    (rate_part * self.stiffness[row][i]).powi(2)
                } else {
                    0.0
                }
            };
            let covariance = (0..TERMS).map(|i| (0..TERMS).map(|j| entry(i, j)).collect()).collect();
            AxisUncertainty { axis: fit.axis.into(), covariance }
        };
        self.axes.iter().map(open).collect()
    }
}
