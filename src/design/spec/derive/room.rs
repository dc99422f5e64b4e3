//! Room for springs, lights and screws about the camera's view.

use glam::DVec2;
use serde_json::Value;

use super::board::{Pocket, has_board};
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

/// How far a ring is turned from the middle between the lights where a board's pocket asks for it, degrees, in the order in
/// which they are tried.
const TURNS_DEG: [f64; 13] = [0.0, 2.5, -2.5, 5.0, -5.0, 7.5, -7.5, 10.0, -10.0, 15.0, -15.0, 20.0, -20.0];
/// How much wider a ring may become to come clear of a board's pocket, mm, and the step at which it is tried.
const MAX_WIDER_MM: f64 = 12.0;
pub(super) const RING_STEP_MM: f64 = 0.05;

/// Azimuth of the first of so many springs, degrees, and the smallest ring for them, mm: half a step from the lights; over a
/// board, whose pocket their push-out holes must leave a wall to, turned to where that ring is smallest.
pub(super) fn ring(k: &Known<'_>, count: usize) -> (f64, f64) {
    let first = first_deg(k, count);
    let plain = (first, ring_from_mm(k, count, first));
    if !has_board(k) {
        return plain;
    }
    let pocket = Pocket::of(k);
    let hole = 0.5 * k.n("magnet_pockets.push_out_diameter_mm");
    let found = TURNS_DEG.iter().filter_map(|turn| {
        let first = first + turn;
        let smallest = up(ring_from_mm(k, count, first), 0.01);
        let steps = (0..).map(|i| up(smallest + RING_STEP_MM * f64::from(i), 0.01));
        let radius = steps
            .take_while(|radius| *radius <= smallest + MAX_WIDER_MM)
            .find(|radius| is_clear(&pocket, count, first, *radius, hole))?;
        Some((first, radius))
    });
    found.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(plain)
}

/// Whether all push-out holes of a ring leave no thin wall beside a board's pocket.
pub(super) fn is_clear(pocket: &Pocket, count: usize, first_deg: f64, radius_mm: f64, hole_mm: f64) -> bool {
    (0..count).all(|i| {
        let azimuth_deg = first_deg + 360.0 * i as f64 / count as f64;
        pocket.is_clear(radius_mm * DVec2::from_angle(azimuth_deg.to_radians()), hole_mm)
    })
}

/// Smallest ring for so many springs from an azimuth on, whatever stands below, mm.
fn ring_from_mm(k: &Known<'_>, count: usize, first_deg: f64) -> f64 {
    let (pocket, wall) = (pocket_mm(k), wall_mm(k));
    let coil = 0.5 * k.n("springs.outer_diameter_mm");
    let between = spring_from_light_rad(k, count, first_deg).min(0.5 * std::f64::consts::PI).sin();
    let view = view_mm(k, k.n("platforms.upper.underside_z_mm")) + wall + pocket;
    let camera = (bore_mm(k) + wall + pocket).max(0.5 * k.n("camera_body.diameter_mm") + 1.0 + coil);
    let lights = (pit_half_mm(k) + wall + pocket) / between.max(0.05);
    past_markers_mm(k, count, first_deg, view.max(camera).max(lights))
}

/// The smallest ring from a radius on of which no push-out hole comes near a marker's window, mm.
fn past_markers_mm(k: &Known<'_>, count: usize, first_deg: f64, from_mm: f64) -> f64 {
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
    let first = first_deg.to_radians();
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
    let smallest = |count: usize| ring_from_mm(k, count, first_deg(k, count));
    if smallest(6) <= 1.5 * smallest(3) { 6 } else { 3 }
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
