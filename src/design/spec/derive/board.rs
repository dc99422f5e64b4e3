//! Room for a camera's board in the lower platform.

use glam::{DVec2, dvec2};
use serde_json::Value;

use super::geometry::wall_mm;
use super::known::Known;

/// What a board's screws hold over, in diameters of their holes.
const THREAD_DIAMETERS: f64 = 2.0;
/// The gap round a board where none is given, mm; the section's own default.
const CLEARANCE_MM: f64 = 0.3;
/// Thinnest holes for screws that hold the sensor, mm.
pub(super) const SCREW_HOLE_MM: f64 = 2.2;
/// Half of the head of a post's screw and its room, in diameters of the screw's hole.
pub(super) const HEAD_PART: f64 = 1.05;
/// What a post keeps from the sides, mm.
const INSET_MM: f64 = 0.2;
/// What the cable's exit is wider than the cable, mm.
pub(super) const EXIT_MM: f64 = 0.7;

/// Whether the camera is a board.
pub(super) fn has_board(k: &Known<'_>) -> bool {
    k.has("camera_body.board")
}

fn clearance_mm(k: &Known<'_>) -> f64 {
    if k.has("camera_body.board.clearance_mm") { k.n("camera_body.board.clearance_mm") } else { CLEARANCE_MM }
}

/// Turn of the camera about its axis, rad.
fn turn_rad(k: &Known<'_>) -> f64 {
    if k.has("camera.rotation_deg") { k.at("camera.rotation_deg", 2).to_radians() } else { 0.0 }
}

/// Lowest and highest corner of what the board's pocket takes of the lower platform, mm.
pub(super) fn pocket_mm(k: &Known<'_>) -> [DVec2; 2] {
    let axes = DVec2::from_angle(turn_rad(k));
    let pair = |field: &str| dvec2(k.at(field, 0), k.at(field, 1));
    let half = 0.5 * pair("camera_body.board.size_mm") + clearance_mm(k);
    let half =
        dvec2(axes.x.abs() * half.x + axes.y.abs() * half.y, axes.y.abs() * half.x + axes.x.abs() * half.y);
    let center = -axes.rotate(pair("camera_body.board.lens_offset_mm"));
    [center - half, center + half]
}

/// A strip of a recess narrower than this stays full, mm, as the board's seat is made.
const MAX_STRIP_MM: f64 = 1.0;

/// What the board's seat takes of the lower platform, read once.
pub(super) struct Pocket {
    corners: [DVec2; 2],
    /// Where the posts that the board bears on stand, and half of their sides, mm.
    posts: Vec<DVec2>,
    post_mm: f64,
    wall_mm: f64,
}

impl Pocket {
    pub(super) fn of(k: &Known<'_>) -> Self {
        let corners = pocket_mm(k);
        let screw = k.n("camera_body.board.hole_diameter_mm");
        let axes = DVec2::from_angle(turn_rad(k));
        let middle = 0.5 * (corners[0] + corners[1]);
        let holes = k.value("camera_body.board.holes_mm").and_then(Value::as_array);
        let holes: Vec<DVec2> = holes
            .into_iter()
            .flatten()
            .filter_map(|hole| Some(dvec2(hole.get(0)?.as_f64()?, hole.get(1)?.as_f64()?)))
            .collect();
        // posts stand where any hole's column meets any hole's row
        let at = |column: &DVec2, row: &DVec2| middle + axes.rotate(dvec2(column.x, row.y));
        let posts = holes.iter().flat_map(|column| holes.iter().map(move |row| at(column, row))).collect();
        Self { corners, posts, post_mm: 0.5 * screw + wall_mm(k).max(0.5 * screw), wall_mm: wall_mm(k) }
    }

    /// Whether a hole at a place leaves no thin wall beside the pocket: it lies a wall beside it, or wholly in it and
    /// clear of the posts.
    pub(super) fn is_clear(&self, at: DVec2, hole_mm: f64) -> bool {
        let [low, high] = self.corners;
        let needed = hole_mm + self.wall_mm;
        if at.distance(at.clamp(low, high)) >= needed {
            return true;
        }
        let inside = (at - low).min(high - at).min_element();
        let past = |post: &DVec2| (at - *post).abs().max_element() >= self.post_mm + needed;
        inside >= MAX_STRIP_MM + needed && self.posts.iter().all(past)
    }
}

/// Half of each of the platforms' sides that a board asks for, mm: a wall round its pocket, and beside it, along one side,
/// holes and posts in the corners.
pub(super) fn half_mm(k: &Known<'_>, half_mm: f64) -> DVec2 {
    let [low, high] = pocket_mm(k);
    let pocket = low.abs().max(high.abs());
    let diameter = k.n("process.min_hole_diameter_mm").max(SCREW_HOLE_MM);
    // holes in the corners: from the side, and to what is beside them
    let mut hole = diameter + 3.0 * wall_mm(k);
    if k.is_rigid() {
        hole = hole.max(post_inset_mm(k) + HEAD_PART * k.n("mount.hole_diameter_mm") + wall_mm(k));
    }
    let exit = 0.5 * (cable_mm(k) + EXIT_MM);
    let walls = DVec2::splat(half_mm.max(exit + hole)).max(pocket + wall_mm(k));
    let beside = pocket + hole;
    if beside.cmple(walls).any() {
        return walls;
    }
    // the side that grows by less area
    let (wider, longer) = (dvec2(beside.x, walls.y), dvec2(walls.x, beside.y));
    let rounded = |half: DVec2| (half * 4.0 - 1e-9).ceil() / 4.0;
    rounded(if wider.x * wider.y <= longer.x * longer.y { wider } else { longer })
}

/// How far from the sides a post stands in a corner, with a wall beside its screw's head, mm.
pub(super) fn post_inset_mm(k: &Known<'_>) -> f64 {
    let head = HEAD_PART * k.n("mount.hole_diameter_mm") + wall_mm(k);
    (0.5 * k.n("mount.post_diameter_mm") + INSET_MM).max(head)
}

/// Width of the cable, mm.
pub(super) fn cable_mm(k: &Known<'_>) -> f64 {
    let flat = k.has("camera_body.cable_width_mm");
    k.n(if flat { "camera_body.cable_width_mm" } else { "camera_body.cable_diameter_mm" })
}

/// What must be above the board's face: a roof over what stands on its front, material for its screws, mm.
pub(super) fn above_mm(k: &Known<'_>) -> f64 {
    let front = if k.has("camera_body.board.front_components_height_mm") {
        k.n("camera_body.board.front_components_height_mm")
    } else {
        0.0
    };
    let recess = if front > 0.0 { front + clearance_mm(k) } else { 0.0 };
    recess.max(THREAD_DIAMETERS * k.n("camera_body.board.hole_diameter_mm")) + wall_mm(k)
}

/// Where the cable leaves the board, degrees; `None` where the board does not say.
pub(super) fn cable_deg(k: &Known<'_>) -> Option<f64> {
    let field = "camera_body.board.cable_azimuth_deg";
    let given = k.value(field).is_some_and(|value| value.is_number());
    given.then(|| (k.n(field) + turn_rad(k).to_degrees()).rem_euclid(360.0))
}
