//! Are the white markers seen, at rest and under every load that the design claims?

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use serde_json::json;

use crate::design::{Design, DesignError};
use crate::numeric::Rigid;
use crate::optics::SensorOptics;

/// Points on a marker's edge that are followed: a disc of 1 mm is then missed by less than 2 um.
const EDGE_POINTS: u32 = 48;

/// The white markers at one pose of the platform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// Largest field angle of any point of a marker's edge, degrees.
    pub field_angle_deg: f64,
    /// Largest distance of such a point from the mask's centre in the undistorted frame, px.
    pub mask_px: f64,
}

/// Follows every marker's edge at the pose `rest_from_platform`.
///
/// # Errors
/// The first point that leaves the lens, the frame or the mask; `field` names the load (or "at rest").
pub fn markers(design: &Design, rest_from_platform: &Rigid, when: &str) -> Result<Sight, DesignError> {
    let optics = design.optics().at_pose(rest_from_platform).map_err(|error| {
        DesignError::at(
            "camera.position_mm",
            error.value.clone(),
            format!("{when}, the sheet meets the camera"),
            error.allowed,
        )
    })?;
    let radius_mm = design.sections().white_markers.diameter_mm / 2.0;
    let mask_radius_px = design.sections().runtime.mask_radius_px;
    let mut sight = Sight { field_angle_deg: 0.0, mask_px: 0.0 };
    for (id, center) in design.white_markers_mm().into_iter().enumerate() {
        for index in 0..EDGE_POINTS {
            let turn = DVec2::from_angle(TAU * f64::from(index) / f64::from(EDGE_POINTS));
            let point = center + (radius_mm * turn).extend(0.0);
            let fault = |problem: String, allowed: String| {
                DesignError::at(
                    format!("white_markers.positions_mm[{id}]"),
                    json!([center.x, center.y]),
                    format!("{when}, {problem}"),
                    allowed,
                )
                .with_help(
                    "move the markers inwards, the camera deeper, stiffen the springs, or claim less load",
                )
            };
            let seen = see(design, &optics, point).map_err(|problem| {
                fault(problem, "markers inside lens and frame under every claimed load".into())
            })?;
            if seen.mask_px > mask_radius_px {
                return Err(fault(
                    format!("the marker's edge is {:.2} px from the mask's centre", seen.mask_px),
                    format!("at most runtime.mask_radius_px, {mask_radius_px}, under every claimed load"),
                ));
            }
            sight.field_angle_deg = sight.field_angle_deg.max(seen.field_angle_deg);
            sight.mask_px = sight.mask_px.max(seen.mask_px);
        }
    }
    Ok(sight)
}

/// Where one point of a marker is seen, or why it is not.
fn see(design: &Design, optics: &SensorOptics, point: DVec3) -> Result<Sight, String> {
    let pixel =
        optics.project(point).map_err(|limit| format!("the lens cannot see the marker's edge ({limit})"))?;
    let lens = optics.lens();
    let (width, height) = (f64::from(lens.spec().width), f64::from(lens.spec().height));
    if pixel.x < -0.5 || pixel.y < -0.5 || pixel.x > width - 0.5 || pixel.y > height - 0.5 {
        return Err(format!(
            "the marker's edge is at pixel ({:.1}, {:.1}), outside the frame",
            pixel.x, pixel.y
        ));
    }
    let ray =
        lens.unproject(pixel).map_err(|limit| format!("the lens cannot see the marker's edge ({limit})"))?;
    if ray.z <= 0.0 {
        return Err("the marker's edge is at 90 degrees or more, where an undistorted frame ends".into());
    }
    let [[focal_px, ..], ..] = design.undistorted_matrix();
    let slope = ray.truncate().length() / ray.z;
    Ok(Sight { field_angle_deg: slope.atan().to_degrees(), mask_px: focal_px * slope })
}
