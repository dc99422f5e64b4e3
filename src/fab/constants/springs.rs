//! The springs' part of the constants: the 6x6 at rest and under compression, and the plain runtime's.

use glam::DVec3;

use super::moving::moving_mass;
use super::sight::{MarkerSight, markers_of};
use domecast_design::{Design, DesignError};
use domecast_design::{limits_of, suspension_of};
use domecast_runtime::constants::{
    PlainFit, PlainInput, PosedLoad, SpringConstants, SpringLaw, SpringTemperature, StiffnessAt, loads_over,
    rows,
};
use domecast_springs::{Suspension, Wrench, try_load};

/// Compressions (mm) that the stiffness is given at are this far apart.
const COMPRESSION_STEP_MM: f64 = 0.5;

/// The springs of a design for its constants, and the fit for the plain runtime where the claimed loads allow one.
#[derive(Debug, Clone)]
pub struct DesignSprings {
    /// What goes into the constants; `None` of a rigid mount.
    pub constants: Option<SpringConstants>,
    /// The fit behind `plain_runtime`.
    pub plain: Option<PlainFit>,
    /// What the camera sees of the markers; it costs to compute, so it is passed on.
    pub sight: MarkerSight,
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
    if design.is_rigid() {
        return Ok(DesignSprings { constants: None, plain: None, sight });
    }
    let suspension = suspension_of(design)?;
    let fault = |error: domecast_springs::MechanicsError| {
        DesignError::at("springs", "", error.to_string(), "springs that stand at rest")
    };
    let stiffness = suspension.stiffness().map_err(fault)?;
    let at_mm = suspension.at_mm();
    let room = suspension.spec().spring.solid_compression_mm() - suspension.rest_compression_mm();
    let steps = (room / COMPRESSION_STEP_MM).floor().clamp(0.0, 1000.0) as u32;
    let mut stiffness_at = Vec::new();
    for compression_mm in (0..=steps).map(|i| f64::from(i) * COMPRESSION_STEP_MM) {
        // Past the point where the law ends there is no stiffness.
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
    // Without enough loads the plain runtime gets no constants of its own: the field is left out.
    let plain = PlainFit::over(&input, &claimed_loads(design, &suspension, &sight)).ok();
    let plain_runtime = plain.as_ref().map(PlainFit::constants);
    let constants = SpringConstants {
        stiffness: rows(&stiffness),
        at_mm: at_mm.to_array(),
        source: "nominal".into(),
        stiffness_at,
        law: Some(SpringLaw::of(&suspension, limits_of(design).grip_force_n)),
        offset: None,
        uncertainty: None,
        temperature: design.sections().springs.wire.temperature.as_ref().map(|wire| SpringTemperature {
            at_c: wire.at_c,
            modulus_per_k: wire.modulus_per_k,
            modulus_per_k_sd: wire.modulus_per_k_sd,
        }),
        moving: moving_mass(design),
        plain_runtime,
    };
    Ok(DesignSprings { constants: Some(constants), plain, sight })
}
