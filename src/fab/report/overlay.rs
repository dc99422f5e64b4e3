//! What the 3D view can show beside the parts: dots, rays as they run, the lens' field of view, claimed loads. Places are in
//! the sensor frame, mm.

use glam::DVec3;
use serde_json::{Value, json};

use super::section::ray_points;
use super::subject::ReportSubject;
use domecast_design::Design;

/// Rays that are shown, at most.
const MAX_RAYS: usize = 40;
/// Lines of the field of view around the axis.
const FIELD_LINES: u32 = 24;
/// The largest claimed force is drawn as long as this part of the dome's height.
const LONGEST_LOAD: f64 = 0.8;

/// Points and lines by name.
pub(super) fn overlay(subject: &ReportSubject<'_>) -> Value {
    let dots = &subject.layout.dots;
    let every = dots.len().div_ceil(MAX_RAYS).max(1);
    let rays = dots.iter().step_by(every).filter_map(|dot| ray_points(subject.design.optics(), dot.image_px));
    json!({
        "dots": dots.iter().map(|dot| point(dot.surface_mm)).collect::<Vec<_>>(),
        "rays": rays.map(|ray| ray.into_iter().map(point).collect::<Vec<_>>()).collect::<Vec<_>>(),
        "field of view": field_of_view(subject.design),
        "loads": loads(subject.design),
    })
}

fn point(place_mm: DVec3) -> [f64; 3] {
    place_mm.to_array().map(|v| (1e3 * v).round() / 1e3)
}

/// Lines from the pupil to the sheet at the largest field angle that the lens model reaches, and the circle that they end on.
fn field_of_view(design: &Design) -> Vec<Vec<[f64; 3]>> {
    let optics = design.optics();
    let pose = optics.sensor_from_camera();
    let pupil_mm = pose.translation_mm;
    let angle_rad = optics.lens().max_field_angle_rad().min(80_f64.to_radians());
    let ends: Vec<[f64; 3]> = (0..=FIELD_LINES)
        .map(|k| std::f64::consts::TAU * f64::from(k) / f64::from(FIELD_LINES))
        .map(|azimuth| {
            pose.vector(DVec3::new(azimuth.cos(), azimuth.sin(), 0.0) * angle_rad.tan() + DVec3::Z)
        })
        .filter(|along| along.z > 0.0)
        .map(|along| point(pupil_mm + along * (optics.air_gap_mm() / along.z)))
        .collect();
    let lines = ends.iter().map(|end| vec![point(pupil_mm), *end]);
    lines.chain([ends.clone()]).collect()
}

/// An arrow to each claimed load's point, with two barbs.
fn loads(design: &Design) -> Vec<Vec<[f64; 3]>> {
    let claims = &design.sections().loads.claims;
    let forces = claims.iter().map(|claim| DVec3::from_array(claim.force_n));
    let max_n = forces.clone().map(DVec3::length).fold(f64::MIN_POSITIVE, f64::max);
    let mm_per_n = LONGEST_LOAD * design.sections().dome.shape().height_mm() / max_n;
    let arrow = |(force_n, claim): (DVec3, &domecast_design::sections::LoadClaim)| {
        let (tip, shaft) = (DVec3::from_array(claim.point_mm), force_n * mm_per_n);
        let side = shaft.try_normalize().map_or(DVec3::X, |along| along.any_orthonormal_vector());
        let barb = |sign: f64| tip - 0.15 * shaft + side * (sign * 0.06 * shaft.length());
        vec![tip - shaft, tip, barb(1.0), tip, barb(-1.0)].into_iter().map(point).collect()
    };
    forces.zip(claims).map(arrow).collect()
}
