//! The suspension, its limits and its claimed loads, from a design.

use glam::DVec3;

use domecast_springs::{
    EndType, Limit, Limits, LoadCase, MagnetPair, N_PER_G_MPS2, SpecError, Spring, SpringSpec, Stop,
    StopShape, Suspension, SuspensionSpec, Wrench, try_load,
};

use crate::spec::sections::{MagnetFacing, SpringEnds};
use crate::spec::{Design, DesignError};

fn fault(section: &str, error: &SpecError) -> DesignError {
    DesignError::at(
        format!("{section}.{}", error.field),
        error.value,
        "the springs cannot be",
        error.allowed.clone(),
    )
}

/// The platform on its springs.
///
/// # Errors
/// Numbers that make no spring, no magnet or no stable platform; a rigid mount.
pub fn suspension_of(design: &Design) -> Result<Suspension, DesignError> {
    let sections = design.sections();
    if design.is_rigid() {
        let problem = "rigid mount: no springs carry the platform, and no net wrench is promised";
        return Err(DesignError::at(
            "mount.kind",
            "rigid",
            problem,
            "\"springs\" for what works with loads and poses",
        ));
    }
    let (springs, magnets) = (&sections.springs, &sections.magnets);
    let spring = Spring::new(SpringSpec {
        wire_diameter_mm: springs.wire_diameter_mm,
        outer_diameter_mm: springs.outer_diameter_mm,
        free_length_mm: springs.free_length_mm,
        active_coils: springs.active_coils,
        ends: match springs.ends {
            SpringEnds::Open => EndType::Open,
            SpringEnds::OpenGround => EndType::OpenGround,
            SpringEnds::Closed => EndType::Closed,
            SpringEnds::ClosedGround => EndType::ClosedGround,
        },
        shear_modulus_mpa: springs.wire.shear_modulus_mpa,
        elastic_modulus_mpa: springs.wire.elastic_modulus_mpa,
        allowable_shear_mpa: springs.wire.allowable_shear_mpa,
    })
    .map_err(|error| fault("springs", &error))?;
    let pair = |attract| {
        MagnetPair::new(magnets.diameter_mm, magnets.thickness_mm, magnets.remanence_t, attract)
            .map_err(|error| fault("magnets", &error))
    };
    let underside_z_mm = sections.platforms.upper.underside_z_mm;
    let (weight_n, center_of_mass_mm) =
        sections.gravity.as_ref().map_or((DVec3::ZERO, DVec3::ZERO), |gravity| {
            let acceleration = DVec3::from_array(gravity.acceleration_mps2);
            (
                acceleration * gravity.moving_mass_g * N_PER_G_MPS2,
                DVec3::from_array(gravity.center_of_mass_mm),
            )
        });
    Suspension::new(SuspensionSpec {
        spring,
        upper_ends_mm: design.springs_at_mm().into_iter().map(|at| at.extend(underside_z_mm)).collect(),
        magnets: match magnets.facing {
            MagnetFacing::Attract => Some(pair(true)?),
            MagnetFacing::Repel => Some(pair(false)?),
            MagnetFacing::Ignore => None,
        },
        weight_n,
        center_of_mass_mm,
        at_mm: springs.reference_point_mm.map(DVec3::from_array),
    })
    .map_err(|error| fault("springs", &error))
}

/// What ends a load besides the springs themselves: the magnets' grip, the platforms, the camera under the sheet.
pub fn limits_of(design: &Design) -> Limits {
    let sections = design.sections();
    let body = &sections.camera_body;
    let underside_z_mm = sections.platforms.upper.underside_z_mm;
    let half_mm = sections.platforms.outer_mm.map(|side| side / 2.0);
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .map(|[x, y]| DVec3::new(x * half_mm[0], y * half_mm[1], underside_z_mm));
    let sheet_z_mm = design.sheet_underside_z_mm();
    let stop_z_mm = match sections.springs.stop_clearance_mm {
        Some(clearance_mm) => underside_z_mm - clearance_mm,
        None => design.lower_top_z_mm(),
    };
    Limits {
        grip_force_n: Some(sections.magnets.grip_force_n),
        stops: vec![
            Stop {
                name: "corner".into(),
                limit: Limit::PlatformsTouch,
                shape: StopShape::Points(corners.to_vec()),
                floor_z_mm: stop_z_mm,
            },
            Stop {
                name: "sheet over the camera".into(),
                limit: Limit::CameraGapCloses,
                shape: StopShape::Disc {
                    center_mm: DVec3::new(0.0, 0.0, sheet_z_mm),
                    radius_mm: body.diameter_mm / 2.0,
                },
                floor_z_mm: sections.camera.position_mm[2] + body.front_from_pupil_mm + body.min_sheet_gap_mm,
            },
        ],
    }
}

/// Every claimed load on the suspension, in the order of the file.
pub fn claims_of(design: &Design, suspension: &Suspension) -> Vec<LoadCase> {
    let limits = limits_of(design);
    let case = |claim: &crate::spec::sections::LoadClaim| {
        let wrench = Wrench::of_load(
            DVec3::from_array(claim.force_n),
            DVec3::from_array(claim.moment_nmm),
            DVec3::from_array(claim.point_mm),
            suspension.at_mm(),
        );
        try_load(suspension, &limits, &wrench)
    };
    design.sections().loads.claims.iter().map(case).collect()
}
