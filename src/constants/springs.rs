//! The springs' part of the constants: the 6x6 at rest and under compression, and the plain runtime's.

use glam::DVec3;
use nalgebra::Matrix6;

use super::law::SpringLaw;
use super::loads::{PosedLoad, loads_over};
use super::model::{Constants, PlainRuntime, SpringConstants, StiffnessAt};
use super::plain::{PlainFit, PlainInput};
use super::sight::{MarkerSight, markers_of};
use crate::design::{Design, DesignError};
use crate::mechanics::{Displacement, Suspension, Wrench, limits_of, suspension_of, try_load};

/// Compressions (mm) that the stiffness is given at are this far apart.
const COMPRESSION_STEP_MM: f64 = 0.5;

/// The springs of a design for its constants, and the fit for the plain runtime where the claimed loads allow one.
#[derive(Debug, Clone)]
pub struct DesignSprings {
    /// What goes into the constants.
    pub constants: SpringConstants,
    /// The fit behind `plain_runtime`.
    pub plain: Option<PlainFit>,
    /// What the camera sees of the markers; it costs to compute, so it is passed on.
    pub sight: MarkerSight,
}

/// Rows of a matrix, as the constants carry it.
pub fn rows(matrix: &Matrix6<f64>) -> [[f64; 6]; 6] {
    std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)]))
}

/// A matrix from its rows.
pub fn matrix_of(rows: &[[f64; 6]; 6]) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| rows[i][j])
}

/// Every load that [`loads_over`] makes of the design's claims, with its pose, where springs and sight allow it.
pub fn claimed_loads(design: &Design, suspension: &Suspension, sight: &MarkerSight) -> Vec<PosedLoad> {
    let limits = limits_of(design);
    let at_mm = suspension.at_mm();
    let claims: Vec<[f64; 6]> = design
        .sections()
        .loads
        .claims
        .iter()
        .map(|claim| {
            let [force, moment, point] =
                [claim.force_n, claim.moment_nmm, claim.point_mm].map(DVec3::from_array);
            Wrench::of_load(force, moment, point, at_mm).to_array()
        })
        .collect();
    loads_over(&claims, |wrench| {
        let case = try_load(suspension, &limits, &Wrench::from_array(wrench));
        let pose = case.equilibrium.as_ref().ok()?.pose;
        let held = case.passed().next().is_none();
        (held && sight.checks(&pose).iter().all(|check| !check.is_passed())).then_some(pose)
    })
}

/// The springs of a design; `sight` watches its white markers.
///
/// # Errors
/// [`DesignError`] where the springs have no stiffness at rest.
pub fn springs_of(design: &Design, sight: MarkerSight) -> Result<DesignSprings, DesignError> {
    let suspension = suspension_of(design)?;
    let fault = |error: crate::mechanics::MechanicsError| {
        DesignError::at("springs", "", error.to_string(), "springs that stand at rest")
    };
    let stiffness = suspension.stiffness().map_err(fault)?;
    let at_mm = suspension.at_mm();
    let room = suspension.spec().spring.solid_compression_mm() - suspension.rest_compression_mm();
    let steps = (room / COMPRESSION_STEP_MM).floor().clamp(0.0, 1000.0) as u32;
    let mut stiffness_at = Vec::new();
    for compression_mm in (0..=steps).map(|i| f64::from(i) * COMPRESSION_STEP_MM) {
        // Past the point where the law ends there is nothing to tell.
        let Ok(matrix) = suspension.stiffness_at(compression_mm) else { break };
        stiffness_at.push(StiffnessAt { compression_mm, stiffness: rows(&matrix) });
    }
    let input = PlainInput {
        optics: design.optics(),
        markers: &markers_of(design),
        undistorted_matrix: design.undistorted_matrix(),
        at_mm,
        stiffness,
        stiffness_at: &stiffness_at,
    };
    // Without enough loads the plain runtime gets no constants of its own: their absence says so.
    let plain = PlainFit::over(&input, &claimed_loads(design, &suspension, &sight)).ok();
    let plain_runtime = plain.as_ref().map(PlainFit::constants);
    let constants = SpringConstants {
        stiffness: rows(&stiffness),
        at_mm: at_mm.to_array(),
        source: "nominal".into(),
        stiffness_at,
        law: Some(SpringLaw::of(&suspension, limits_of(design).grip_force_n)),
        offset: None,
        plain_runtime,
    };
    Ok(DesignSprings { constants, plain, sight })
}

/// The wrench of a displacement by the constants: the 6x6 interpolated at the compression (linearly between the
/// tabulated ones, the nearest beyond them), or the one at rest where there is no table.
pub fn wrench_by_table(springs: &SpringConstants, displacement: &Displacement) -> [f64; 6] {
    let d = nalgebra::Vector6::from(displacement.to_array());
    let at_rest = matrix_of(&springs.stiffness);
    (stiffness_between(&springs.stiffness_at, &at_rest, -displacement.translation_mm.z) * d).into()
}

/// The 6x6 of a table at a compression (mm): linear between two entries, the nearest beyond them, `at_rest` where
/// there is no table.
pub fn stiffness_between(table: &[StiffnessAt], at_rest: &Matrix6<f64>, compression_mm: f64) -> Matrix6<f64> {
    let above = table.partition_point(|entry| entry.compression_mm <= compression_mm);
    match (above.checked_sub(1).and_then(|i| table.get(i)), table.get(above)) {
        (Some(low), Some(high)) => {
            let part = (compression_mm - low.compression_mm) / (high.compression_mm - low.compression_mm);
            matrix_of(&low.stiffness) * (1.0 - part) + matrix_of(&high.stiffness) * part
        }
        (Some(end), None) | (None, Some(end)) => matrix_of(&end.stiffness),
        (None, None) => *at_rest,
    }
}

impl PlainFit {
    /// What goes into the constants.
    fn constants(&self) -> PlainRuntime {
        PlainRuntime {
            stiffness: rows(&self.stiffness),
            stiffness_at: self.stiffness_at.clone(),
            rest_pose: self.rest_pose.to_rows_4x4(),
        }
    }
}

impl Constants {
    /// Fits the apparent positions and the plain runtime anew to what the constants now say of optics and springs,
    /// over presses, shifts, tilts and twists inside the table of compressions; takes them out where no fit exists.
    pub fn refit_plain_runtime(&mut self) {
        let fit = self.plain_fit();
        for (index, marker) in self.white_markers.iter_mut().enumerate() {
            marker.apparent_position_mm =
                fit.as_ref().and_then(|f| f.apparent_mm.get(index)).map(|p| p.to_array());
        }
        if let Some(springs) = self.springs.as_mut() {
            springs.plain_runtime = fit.as_ref().map(PlainFit::constants);
        }
    }

    fn plain_fit(&self) -> Option<PlainFit> {
        let springs = self.springs.as_ref()?;
        let optics = self.sensor().ok()?;
        let markers = self.markers();
        let at_mm = DVec3::from_array(springs.at_mm);
        let deepest = springs.stiffness_at.last().map_or(1.0, |entry| entry.compression_mm);
        let mut loads = Vec::new();
        for step in 0..5 {
            let down = 0.6 * deepest * f64::from(step) / 4.0;
            for turn in 0..8 {
                let angle = f64::from(turn) * std::f64::consts::FRAC_PI_4;
                let (cos, sin) = (angle.cos(), angle.sin());
                for (shift, tilt, twist) in [
                    (0.0, 0.0, 0.0),
                    (0.1, 0.0, 0.01),
                    (0.1, 0.0, -0.01),
                    (0.0, 0.03, 0.01),
                    (0.0, 0.03, -0.01),
                    (0.1, 0.03, 0.02),
                    (0.1, 0.03, -0.02),
                ] {
                    let displacement = Displacement {
                        translation_mm: DVec3::new(shift * cos, shift * sin, -down),
                        rotation_rad: DVec3::new(-tilt * sin, tilt * cos, twist),
                    };
                    let pose = displacement.to_pose(at_mm);
                    let placed = optics.at_pose(&pose);
                    if placed.is_ok_and(|o| markers.iter().all(|m| m.image(&o).is_ok())) {
                        loads.push(PosedLoad { pose, wrench: wrench_by_table(springs, &displacement) });
                    }
                }
            }
        }
        let input = PlainInput {
            optics: &optics,
            markers: &markers,
            undistorted_matrix: self.camera.undistorted_matrix,
            at_mm,
            stiffness: matrix_of(&springs.stiffness),
            stiffness_at: &springs.stiffness_at,
        };
        PlainFit::over(&input, &loads).ok()
    }
}
