//! Lengths that several rules share.

use std::f64::consts::PI;

use super::super::lens::lens_spec;
use super::super::sections::{CameraSection, DomeSection, MIN_BEND_DIAMETERS};
use super::known::Known;
use domecast_optics::DomeShape;
use domecast_optics::camera::Lens;
use glam::{DVec2, DVec3};

/// Steepest ray that a default asks the lens for: beyond it the undistorted frame spends its pixels on the edge.
const MAX_FIELD_RAD: f64 = 62.0 * PI / 180.0;
/// Share of the lens's reach that is used: the rest is for tolerances.
const REACH: f64 = 0.97;
/// Sideways room for the platform on its springs, beside the claimed loads' travel, mm.
pub(super) const SWAY_MM: f64 = 1.2;

/// Thickness of the sheet, mm.
pub(super) fn sheet_mm(k: &Known<'_>) -> f64 {
    let layers = k.value("optics.layers").and_then(|layers| layers.as_array());
    layers.into_iter().flatten().filter_map(|layer| layer.get("thickness_mm")?.as_f64()).sum()
}

/// Refractive index of the sheet's first layer.
fn sheet_index(k: &Known<'_>) -> f64 {
    let index = k.value("optics.layers").and_then(|layers| layers.get(0)?.get("index"));
    index.and_then(|index| index.as_f64().or_else(|| index.get("g")?.as_f64())).unwrap_or(1.49).max(1.0)
}

/// The lens, wherever it stands.
pub(super) fn lens(k: &Known<'_>) -> Option<Lens> {
    let mut section = k.value("camera")?.clone();
    let map = section.as_object_mut()?;
    map.entry("position_mm").or_insert_with(|| serde_json::json!([0, 0, -1]));
    map.entry("field_of_view_deg").or_insert_with(|| serde_json::json!(359.9));
    let camera: CameraSection =
        serde_json::from_value(section).map_err(|error| k.wrong(format!("camera: {error}"))).ok()?;
    Lens::new(lens_spec(&camera))
        .map_err(|fault| k.wrong(format!("camera.{}: {} is not {}", fault.field, fault.value, fault.allowed)))
        .ok()
}

/// Field angle at the nearest edge of the image, as far as the lens model goes, rad.
pub(super) fn image_angle_rad(k: &Known<'_>, lens: &Lens) -> f64 {
    let (width, height) = (k.n("camera.width"), k.n("camera.height"));
    let spec = lens.spec();
    let center = DVec2::new(spec.matrix[0][2], spec.matrix[1][2]);
    let edges = [
        DVec2::new(-0.5, center.y),
        DVec2::new(width - 0.5, center.y),
        DVec2::new(center.x, -0.5),
        DVec2::new(center.x, height - 0.5),
    ];
    let reach = lens.max_field_angle_rad();
    let angle = |pixel: DVec2| lens.unproject(pixel).map_or(reach, Lens::field_angle_rad);
    edges.into_iter().map(angle).fold(reach, f64::min)
}

/// The steepest ray that defaults use: what image and lens model show, less a margin, rad.
pub(super) fn usable_angle_rad(k: &Known<'_>) -> Option<f64> {
    let lens = lens(k)?;
    Some((REACH * image_angle_rad(k, &lens)).min(MAX_FIELD_RAD))
}

/// How far off the axis the outermost mark lies: the outer edge of the markers, mm.
pub(super) fn marks_mm(k: &Known<'_>) -> f64 {
    let places = k.value("white_markers.positions_mm").and_then(|list| list.as_array());
    let far = places
        .into_iter()
        .flatten()
        .filter_map(|place| Some(place.get(0)?.as_f64()?.hypot(place.get(1)?.as_f64()?)))
        .fold(0.0, f64::max);
    (far + 0.5 * k.n("white_markers.diameter_mm")).max(rim_mm(k))
}

/// How far the claimed loads press the platform down, with what they tilt it by, mm.
pub(super) fn press_mm(k: &Known<'_>) -> f64 {
    if k.is_rigid() { 0.0 } else { 0.46 * k.n("springs.free_length_mm") }
}

/// How far the upper platform can come down at all, mm.
pub(super) fn travel_mm(k: &Known<'_>) -> f64 {
    if k.is_rigid() { 0.0 } else { 0.7 * k.n("springs.free_length_mm") }
}

/// Distance between the platforms, mm.
pub(super) fn between_mm(k: &Known<'_>) -> f64 {
    k.n(if k.is_rigid() { "mount.height_mm" } else { "springs.free_length_mm" })
}

/// Distance off the axis at which a ray that leaves the pupil at an angle meets the sheet's top, mm; `gap_mm` is the
/// air between pupil and sheet.
fn meets_mm(k: &Known<'_>, angle_rad: f64, gap_mm: f64) -> f64 {
    let within = (angle_rad.sin() / sheet_index(k)).asin();
    gap_mm * angle_rad.tan() + sheet_mm(k) * within.tan()
}

/// Depth of the pupil at which the marks are seen at an angle under the claimed loads, mm.
pub(super) fn depth_for_mm(k: &Known<'_>, angle_rad: f64) -> f64 {
    let off_axis = marks_mm(k) + 0.4 * SWAY_MM;
    let in_sheet = meets_mm(k, angle_rad, 0.0);
    sheet_mm(k) + press_mm(k) + (off_axis - in_sheet).max(0.0) / angle_rad.tan()
}

/// The field angle at which the marks are seen under the claimed loads, from a depth, rad.
pub(super) fn marks_angle_rad(k: &Known<'_>, depth_mm: f64) -> f64 {
    let off_axis = marks_mm(k) + 0.4 * SWAY_MM;
    let gap = (depth_mm - sheet_mm(k) - press_mm(k)).max(0.0);
    let (mut low, mut high) = (0.0, 0.499 * PI);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if meets_mm(k, middle, gap) < off_axis { low = middle } else { high = middle }
    }
    high
}

/// Depth of the pupil below the sheet's top, mm.
pub(super) fn depth_mm(k: &Known<'_>) -> f64 {
    -k.at("camera.position_mm", 2)
}

/// Radius within which the camera's view of dome and markers stays at a height, on whatever the springs allow, mm.
pub(super) fn view_mm(k: &Known<'_>, z_mm: f64) -> f64 {
    // the platform rises by about half a millimetre when it is pulled
    let gap = depth_mm(k) - sheet_mm(k) + 0.5;
    let share = ((-sheet_mm(k) - z_mm) / gap.max(1e-3)).clamp(0.0, 1.0);
    let slope = marks_mm(k) / gap.max(1e-3);
    let margin = k.n("platforms.window_margin_mm") * (1.0 + slope * slope).sqrt();
    marks_mm(k) * (1.0 - share) + share * SWAY_MM + margin
}

/// Radius of a magnet's pocket, mm.
pub(super) fn pocket_mm(k: &Known<'_>) -> f64 {
    0.5 * (k.n("magnets.diameter_mm") + k.n("magnet_pockets.diameter_clearance_mm"))
}

/// Radius of the hole that holds the camera, mm.
pub(super) fn bore_mm(k: &Known<'_>) -> f64 {
    0.5 * k.n("camera_body.diameter_mm") + k.n("camera_body.bore_clearance_mm")
}

/// Thinnest wall of the process, and a little margin, mm.
pub(super) fn wall_mm(k: &Known<'_>) -> f64 {
    k.n("process.min_wall_mm") + 0.02
}

/// Half width of a light's pit, and of the wider channel before it, mm.
pub(super) fn pit_half_mm(k: &Known<'_>) -> f64 {
    let wide = k.at("leds.board_mm", 0).max(k.at("leds.package_mm", 0));
    1.04 * (0.5 * wide + k.n("leds.clearance_mm"))
}

/// Sine and cosine of the boards' tilt.
pub(super) fn tilt(k: &Known<'_>) -> (f64, f64) {
    k.n("leds.tilt_deg").to_radians().sin_cos()
}

/// Height of the lower platform's top, mm.
pub(super) fn lower_top_mm(k: &Known<'_>) -> f64 {
    k.n("platforms.upper.underside_z_mm") - between_mm(k)
}

/// Height of the camera's back, mm.
pub(super) fn back_mm(k: &Known<'_>) -> f64 {
    k.n("camera_body.front_from_pupil_mm") - k.n("camera_body.length_mm") - depth_mm(k)
}

/// Smallest angle between a spring and a light, as seen from the axis, rad.
pub(super) fn spring_from_light_rad(k: &Known<'_>, count: usize, first_deg: f64) -> f64 {
    let lights = k.value("leds.list").and_then(|list| list.as_array());
    let azimuths = lights.into_iter().flatten().filter_map(|led| led.get("azimuth_deg")?.as_f64());
    let step = 360.0 / count.max(1) as f64;
    let off = azimuths.map(|azimuth| {
        let turn = (azimuth - first_deg).rem_euclid(step);
        turn.min(step - turn)
    });
    off.fold(180.0 / count.max(1) as f64, f64::min).to_radians()
}

/// A place on the sphere about its centre, mm.
pub(super) fn sphere_place(radius_mm: f64, polar_rad: f64, azimuth_rad: f64) -> DVec3 {
    (radius_mm * polar_rad.sin() * DVec2::from_angle(azimuth_rad)).extend(radius_mm * polar_rad.cos())
}

/// The dome's outer face.
pub(super) fn dome(k: &Known<'_>) -> DomeShape {
    let optional = |field: &str| k.value(field).and_then(serde_json::Value::as_f64);
    DomeSection {
        radius_mm: k.n("dome.radius_mm"),
        rim_angle_deg: optional("dome.rim_angle_deg"),
        cylinder_height_mm: optional("dome.cylinder_height_mm"),
        why: None,
    }
    .shape()
}

/// Radius of the circle in which the dome meets the sheet, mm.
pub(super) fn rim_mm(k: &Known<'_>) -> f64 {
    dome(k).rim_radius_mm()
}

/// What a round cable takes to turn into its channel, mm; none where there is no channel.
pub(super) fn bend_mm(k: &Known<'_>) -> f64 {
    let cable = k.n("camera_body.cable_diameter_mm");
    let radius = match k.has("camera_body.cable_bend_radius_mm") {
        true => k.n("camera_body.cable_bend_radius_mm"),
        false => MIN_BEND_DIAMETERS * cable,
    };
    let exit = |side: &str| k.n(&format!("platforms.lower.cable_exit.{side}_mm")) > 0.0;
    if exit("width") && exit("height") { radius + 0.5 * cable } else { 0.0 }
}

/// Where a given envelope ends below the dome, mm.
pub(super) fn lowest_mm(k: &Known<'_>) -> f64 {
    if !k.has("envelope.size_mm") {
        return f64::NEG_INFINITY;
    }
    dome(k).height_mm() + k.n("elastomer.membrane_thickness_mm") - k.at("envelope.size_mm", 2)
}
