//! What springs that are not quite as the constants say do to the wrench.
//!
//! Before a calibration each spring is one of its own: its coil and number of turns are off by themselves, its wire as all
//! others' are. After it the coefficients have their covariance.

use nalgebra::{DMatrix, Vector6};

use super::optics_errors::root_of;
use crate::constants::{Constants, SpringConstants, SpringLaw, SpringTolerances, WRENCH_AXES};
use crate::track::error::TrackError;
use domecast_springs::{Displacement, Suspension};

/// A number is stepped by this part of its deviation.
const STEP_PART: f64 = 0.25;
/// Coefficients of a measured axis: of the displacement, and of compression times it.
const TERMS: usize = 12;

/// One spring as it should be, and with one number a step off.
#[derive(Debug, Clone)]
struct OneSpring {
    nominal: Suspension,
    stiffer: Suspension,
    wider: Option<Suspension>,
    thicker: Option<Suspension>,
}

/// Errors of the wrench by the springs' numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct SpringErrors {
    springs: Vec<OneSpring>,
    /// Part of its moduli by which `stiffer` is off, and what the tolerances of moduli and coils are in parts of it.
    stiffer_part: f64,
    moduli: f64,
    coils: f64,
    /// Axes that were measured: a root of the covariance of what multiplies the terms.
    measured: [Option<DMatrix<f64>>; 6],
    max_compression_mm: f64,
}

impl SpringErrors {
    /// By the calibration's covariance; axes that it does not have by the tolerances.
    ///
    /// # Errors
    /// [`TrackError`] for covariances of another size, or that are none, and tolerances that make no spring.
    pub fn new(constants: &Constants) -> Result<Self, TrackError> {
        let mut made = Self::default();
        let Some(springs) = &constants.springs else { return Ok(made) };
        if let Some(open) = &springs.uncertainty {
            made.max_compression_mm = open.max_compression_mm;
            for (index, axis) in open.axes.iter().enumerate() {
                let fault = |problem: &str| {
                    TrackError::at(format!("springs.uncertainty.axes[{index}]"), problem.to_owned())
                };
                let row = WRENCH_AXES.iter().position(|name| *name == axis.axis);
                let row = row.ok_or_else(|| fault("is none of Fx to Mz"))?;
                let rows = &axis.covariance;
                if rows.len() != TERMS || rows.iter().any(|row| row.len() != TERMS) {
                    return Err(fault("has a covariance that is not 12 x 12"));
                }
                let covariance = DMatrix::from_fn(TERMS, TERMS, |i, j| rows[i][j]);
                made.measured[row] =
                    Some(root_of(&covariance).ok_or_else(|| fault("has a covariance that is none"))?);
            }
        }
        let tolerances = constants.tolerances.and_then(|t| t.springs);
        if let Some((tolerances, law)) = tolerances.zip(springs.law.as_ref())
            && made.measured.iter().any(Option::is_none)
        {
            made.take_tolerances(springs, law, &tolerances)?;
        }
        Ok(made)
    }

    fn take_tolerances(
        &mut self,
        constants: &SpringConstants,
        law: &SpringLaw,
        t: &SpringTolerances,
    ) -> Result<(), TrackError> {
        let sizes = [t.wire_diameter_mm, t.outer_diameter_mm, t.active_coils, t.modulus_part];
        if sizes.iter().any(|v| !(v.is_finite() && *v >= 0.0)) {
            return Err(TrackError::at("tolerances.springs", "are not deviations"));
        }
        let coils_part = t.active_coils / law.active_coils;
        self.stiffer_part = STEP_PART * t.modulus_part.hypot(coils_part);
        if self.stiffer_part > 0.0 {
            (self.moduli, self.coils) = (t.modulus_part / self.stiffer_part, coils_part / self.stiffer_part);
        }
        let share = 1.0 / law.upper_ends_mm.len().max(1) as f64;
        for end in &law.upper_ends_mm {
            let alone = SpringLaw {
                upper_ends_mm: vec![*end],
                weight_n: law.weight_n.map(|v| v * share),
                ..law.clone()
            };
            let made = |change: &dyn Fn(&mut SpringLaw)| {
                let mut law = alone.clone();
                change(&mut law);
                law.suspension(constants.at_mm).map_err(|error| {
                    TrackError::at("tolerances.springs", format!("make springs that cannot be: {error}"))
                })
            };
            let factor = 1.0 + self.stiffer_part;
            let optional =
                |size: f64, change: &dyn Fn(&mut SpringLaw)| (size > 0.0).then(|| made(change)).transpose();
            self.springs.push(OneSpring {
                nominal: made(&|_| ())?,
                stiffer: made(&|law| {
                    law.shear_modulus_mpa *= factor;
                    law.elastic_modulus_mpa *= factor;
                })?,
                wider: optional(t.outer_diameter_mm, &|law| {
                    law.outer_diameter_mm += STEP_PART * t.outer_diameter_mm;
                })?,
                thicker: optional(t.wire_diameter_mm, &|law| {
                    law.wire_diameter_mm += STEP_PART * t.wire_diameter_mm;
                })?,
            });
        }
        Ok(())
    }

    /// Appends the wrench's error by each independent number of deviation one; `None` at a displacement that such springs
    /// do not have.
    pub fn append(&self, displacement: &Displacement, columns: &mut Vec<Vector6<f64>>) -> Option<()> {
        let d = displacement.to_array();
        let compression_mm = (-d[2]).clamp(0.0, self.max_compression_mm.max(0.0));
        for (row, root) in self.measured.iter().enumerate() {
            let Some(root) = root else { continue };
            for column in root.column_iter() {
                let error: f64 = (0..6).map(|i| (column[i] + compression_mm * column[6 + i]) * d[i]).sum();
                let mut to = Vector6::zeros();
                to[row] = error;
                columns.push(to);
            }
        }
        let is_nominal = Vector6::from_fn(|i, _| f64::from(u8::from(self.measured[i].is_none())));
        let (mut all_stiffer, mut all_thicker) = (Vector6::zeros(), Vector6::zeros());
        for spring in &self.springs {
            let at = |law: &Suspension| Some(law.wrench_at(displacement).ok()?.to_vector());
            let nominal = at(&spring.nominal)?;
            let by = |law: &Suspension| Some((at(law)? - nominal).component_mul(&is_nominal));
            let stiffer = by(&spring.stiffer)?;
            all_stiffer += stiffer * self.moduli;
            columns.push(stiffer * self.coils);
            if let Some(wider) = &spring.wider {
                columns.push(by(wider)? / STEP_PART);
            }
            if let Some(thicker) = &spring.thicker {
                all_thicker += by(thicker)? / STEP_PART;
            }
        }
        if !self.springs.is_empty() {
            columns.extend([all_stiffer, all_thicker]);
        }
        columns.iter().all(|c| c.iter().all(|v| v.is_finite())).then_some(())
    }
}
