//! Room for springs, lights and screws about the camera's view.

use glam::DVec2;
use serde_json::Value;

use super::geometry::{
    SWAY_MM, bore_mm, marks_mm, pit_half_mm, pocket_mm, sheet_mm, spring_from_light_rad, tilt, view_mm,
    wall_mm,
};
use super::known::{Known, up};

/// What a push-out hole keeps from the edge of the sheet's recess, mm.
pub(super) const HOLE_IN_RECESS_MM: f64 = 0.1;

/// Azimuth of the first of so many springs: half a step from the first light.
pub(super) fn first_deg(k: &Known<'_>, count: usize) -> f64 {
    let light = k.value("leds.list").and_then(|list| list.get(0)?.get("azimuth_deg")?.as_f64());
    light.unwrap_or(0.0) + 180.0 / count as f64
}

/// Smallest ring for so many springs, mm.
pub(super) fn ring_mm(k: &Known<'_>, count: usize) -> f64 {
    let (pocket, wall) = (pocket_mm(k), wall_mm(k));
    let coil = 0.5 * k.n("springs.outer_diameter_mm");
    let between = spring_from_light_rad(k, count, first_deg(k, count)).min(0.5 * std::f64::consts::PI).sin();
    let view = view_mm(k, k.n("platforms.upper.underside_z_mm")) + wall + pocket;
    let camera = (bore_mm(k) + wall + pocket).max(0.5 * k.n("camera_body.diameter_mm") + 1.0 + coil);
    let lights = (pit_half_mm(k) + wall + pocket) / between.max(0.05);
    past_markers_mm(k, count, view.max(camera).max(lights))
}

/// The smallest ring from a radius on of which no push-out hole comes near a marker's window, mm.
fn past_markers_mm(k: &Known<'_>, count: usize, from_mm: f64) -> f64 {
    const STEP_MM: f64 = 0.05;
    let hole = 0.5 * k.n("magnet_pockets.push_out_diameter_mm");
    let apart = hole + wall_mm(k) + 0.5 * k.n("white_markers.diameter_mm") + 0.7 * SWAY_MM;
    let markers = k.value("white_markers.positions_mm").and_then(Value::as_array);
    let markers: Vec<DVec2> = markers
        .into_iter()
        .flatten()
        .filter_map(|place| Some(DVec2::new(place.get(0)?.as_f64()?, place.get(1)?.as_f64()?)))
        .map(|place| place - place.normalize_or_zero() * 0.5 * sheet_mm(k))
        .collect();
    let first = first_deg(k, count).to_radians();
    let is_clear = |radius: f64| {
        (0..count).all(|i| {
            let azimuth = first + std::f64::consts::TAU * i as f64 / count as f64;
            let at = radius * DVec2::from_angle(azimuth);
            markers.iter().all(|marker| marker.distance(at) >= apart)
        })
    };
    let steps = (0..200).map(|step| from_mm + STEP_MM * f64::from(step));
    steps.into_iter().find(|radius| is_clear(*radius)).unwrap_or(from_mm)
}

/// How many springs a ring gets.
pub(super) fn ring_count(k: &Known<'_>) -> usize {
    if ring_mm(k, 6) <= 1.5 * ring_mm(k, 3) { 6 } else { 3 }
}

/// How many springs there are.
pub(super) fn spring_count(k: &Known<'_>) -> usize {
    let ring =
        k.value("springs.places.ring.count").and_then(Value::as_u64).and_then(|n| usize::try_from(n).ok());
    ring.unwrap_or_else(|| k.count("springs.places.listed"))
}

/// The farthest that a spring stands along x or y, mm.
pub(super) fn springs_reach_mm(k: &Known<'_>) -> f64 {
    if k.has("springs.places.ring.radius_mm") {
        return k.n("springs.places.ring.radius_mm");
    }
    let listed = k.value("springs.places.listed").and_then(Value::as_array);
    let numbers =
        listed.into_iter().flatten().filter_map(Value::as_array).flatten().filter_map(Value::as_f64);
    numbers.map(f64::abs).fold(0.0, f64::max)
}

/// Half of the platforms' side, mm: what must fit, and `springs_mm` for the springs.
pub(super) fn half_mm(k: &Known<'_>, springs_mm: f64) -> f64 {
    let (sin, cos) = tilt(k);
    let wall = wall_mm(k);
    let sheet =
        0.5 * k.at("sheet.size_mm", 0).max(k.at("sheet.size_mm", 1)) + k.n("sheet.clearance_mm") + 0.9;
    let deep = k.n("leds.package_height_mm") + k.n("leds.board_thickness_mm") + k.n("leds.clearance_mm");
    let lean =
        (k.n("platforms.upper.rim_height_mm") - sheet_mm(k) - k.n("leds.center_z_mm")) * cos / sin.max(0.3);
    let lights = k.n("leds.center_radius_mm") + deep / sin.max(0.3) + lean + wall;
    let camera = bore_mm(k) + wall;
    // set screws pass the mounting holes, or the wider heads of the posts' screws, 15 degrees off
    let screws = if k.is_rigid() { 12.5 } else { 8.8 };
    up(sheet.max(lights).max(springs_mm).max(camera).max(screws).max(marks_mm(k) + wall), 0.25)
}
