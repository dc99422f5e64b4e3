//! The positions of the platform that parts are made and checked for.

use glam::DVec3;
use rayon::prelude::*;

use super::PartError;
use super::sight::MarkerView;
use crate::spec::Design;
use crate::suspension::{claims_of, limits_of, suspension_of};
use domecast_optics::numeric::Rigid;
use domecast_springs::{Suspension, reach, standard_directions};

/// Steps of the straight way down.
const STEPS: u32 = 4;
/// Directions around the axis in which the load envelope's corners are taken.
const AZIMUTHS: u32 = 8;

/// A position of the platform, with its name for messages.
#[derive(Debug, Clone, PartialEq)]
pub struct Pose {
    /// "at rest", "under the load \"press\"", ..
    pub name: String,
    /// Where the platform is.
    pub rest_from_platform: Rigid,
    /// At rest or under a load that the design claims.
    pub is_claimed: bool,
}

/// How far the upper platform can go straight down: until the springs are
/// solid, the stop is met, or the sheet is as near to the camera as it may come.
fn axial_travel_mm(design: &Design, suspension: &Suspension) -> f64 {
    let sections = design.sections();
    let solid_mm = suspension.spec().spring.solid_height_mm();
    let clear_mm = sections.springs.stop_clearance_mm.unwrap_or(sections.springs.free_length_mm);
    let body = &sections.camera_body;
    let front_mm = design.sensor_from_camera().translation_mm.z + body.front_from_pupil_mm;
    let above_camera_mm = design.sheet_underside_z_mm() - front_mm - body.min_sheet_gap_mm;
    (sections.springs.free_length_mm - solid_mm).min(clear_mm).min(above_camera_mm).max(0.0)
}

/// Rest first, then straight down to the end of the travel, the balance under every load that the design claims,
/// and the corners of the load envelope: presses, pulls, pushes, tilts and twists, each driven until the first
/// limit of the springs, the stops, the lens or the mask ends it. The window is no such limit here, for it is cut
/// for all of these. A rigid mount has rest alone.
pub(super) fn poses(design: &Design) -> Result<Vec<Pose>, PartError> {
    if design.is_rigid() {
        let rest_from_platform = Rigid::identity();
        return Ok(vec![Pose { name: "at rest".to_owned(), rest_from_platform, is_claimed: true }]);
    }
    let fault = |problem: String| PartError::View { problem, field: "loads.claims".into() };
    let suspension = suspension_of(design).map_err(|error| fault(error.to_string()))?;
    let travel_mm = axial_travel_mm(design, &suspension);
    let mut out: Vec<Pose> = (0..=STEPS)
        .map(|i| {
            let name = match i {
                0 => "at rest".to_owned(),
                STEPS => "at full travel".to_owned(),
                _ => format!("at {i}/{STEPS} of the travel"),
            };
            let down_mm = travel_mm * f64::from(i) / f64::from(STEPS);
            let rest_from_platform = Rigid::from_translation(DVec3::NEG_Z * down_mm);
            Pose { name, rest_from_platform, is_claimed: i == 0 }
        })
        .collect();
    for (claim, case) in design.sections().loads.claims.iter().zip(claims_of(design, &suspension)) {
        let balance = case.equilibrium.map_err(|error| fault(format!("load \"{}\": {error}", claim.name)))?;
        let name = format!("under the load \"{}\"", claim.name);
        let rest_from_platform = balance.displacement.to_pose(suspension.at_mm());
        out.push(Pose { name, rest_from_platform, is_claimed: true });
    }
    let (limits, sight) = (limits_of(design), MarkerView::of(design));
    let more = |pose: &Rigid| sight.checks(pose, |_, _| {});
    let dome = design.sections().dome.shape();
    let corners: Vec<Pose> = standard_directions(suspension.at_mm(), &dome, AZIMUTHS)
        .into_par_iter()
        .filter_map(|direction| {
            let reached = reach(&suspension, &limits, &more, &direction);
            let balance = reached.case.equilibrium.ok()?;
            Some(Pose {
                name: format!("at the end of the load envelope, {} x {:.3}", direction.name, reached.factor),
                rest_from_platform: balance.displacement.to_pose(suspension.at_mm()),
                is_claimed: false,
            })
        })
        .collect();
    out.extend(corners);
    Ok(out)
}
