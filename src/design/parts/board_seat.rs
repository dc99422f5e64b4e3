//! Is a camera's board held? What the dimensions tell, and what the finished lower platform tells.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use serde_json::json;

use super::board::BoardSeat;
use super::error::{Cure, infeasible};
use super::screws::{THREADS, Thread};
use super::seats::unheld;
use super::{Assembly, Measures, PartError};
use crate::spec::DesignWarning;
use domecast_mesh::RayTarget;

/// A screw that cuts its thread into plastic holds over this many of its diameters.
const MIN_THREAD_DIAMETERS: f64 = 2.0;
/// Directions round a screw, heights along it.
const AROUND: u32 = 24;
const HEIGHTS: u32 = 64;
/// Share of a ring on a post that the board must bear on, and of a screw's way round that must be material.
const MIN_BACKED: f64 = 0.5;
const ROUND_SHARE: f64 = 2.0 / 3.0;
/// A cable that leaves the board this far beside its exit has to turn within the pocket, degrees.
const MAX_ASIDE_DEG: f64 = 45.0;

/// Every dimension of a board's seat that contradicts another.
pub(super) fn faults(m: &Measures) -> Vec<PartError> {
    let Some(seat) = BoardSeat::of(m) else { return Vec::new() };
    let mut found = Vec::new();
    let Some(thread) = seat.thread else {
        let (hole, needed) = (seat.board.hole_diameter_mm, THREADS[0].clearance_mm);
        let cure = Cure::length("camera_body.board.hole_diameter_mm", hole, needed);
        let problem = "no screw is as thin as the board's holes; their diameter";
        return vec![unheld(["board screws", "camera"], problem, [hole, needed], cure)];
    };
    found.extend(walls_beside(m, &seat));
    found.extend(roof(m, &seat, &thread));
    found.extend(room_below(m, &seat, &thread));
    for (i, at) in seat.holes_mm.iter().enumerate() {
        let [low, high] = seat.pocket_mm();
        let wall = (*at - low).min(high - *at).min_element();
        if wall < 0.5 * thread.head_mm {
            let from = seat.board.clearance_mm;
            let cure =
                Cure::length("camera_body.board.clearance_mm", from, from + 0.5 * thread.head_mm - wall);
            let problem = "its head meets the wall of the board's pocket; way to the wall";
            let name = format!("board screw {i}");
            found.push(unheld([&name, "lower_platform"], problem, [wall, 0.5 * thread.head_mm], cure));
            break;
        }
    }
    found
}

/// What a maker should know of a board that is held.
pub(super) fn notes(m: &Measures) -> Vec<DesignWarning> {
    let exit = &m.platforms.lower.cable_exit;
    let leaves = BoardSeat::of(m).and_then(|seat| seat.board.cable_azimuth_deg);
    let Some(leaves) = leaves.filter(|_| exit.width_mm > 0.0 && exit.height_mm > 0.0) else {
        return Vec::new();
    };
    let way = m.sensor_from_camera.transform_vector3(DVec2::from_angle(leaves.to_radians()).extend(0.0));
    let leaves = way.truncate().to_angle().to_degrees();
    let aside = (exit.azimuth_deg - leaves + 180.0).rem_euclid(360.0) - 180.0;
    if aside.abs() <= MAX_ASIDE_DEG {
        return Vec::new();
    }
    vec![DesignWarning {
        field: "platforms.lower.cable_exit.azimuth_deg".into(),
        message: format!(
            "the cable leaves the board towards {leaves:.0} degrees and has to turn by {:.0} in the pocket to its exit; an exit \
             at {leaves:.0} lets it out straight",
            aside.abs()
        ),
    }]
}

/// The block stands round the pocket.
fn walls_beside(m: &Measures, seat: &BoardSeat) -> Option<PartError> {
    let [low, high] = seat.pocket_mm();
    let corners = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
    let reach = corners
        .map(|at| m.sensor_from_camera.transform_point3(at.extend(seat.face_z_mm)).truncate().abs())
        .into_iter()
        .fold(DVec2::ZERO, DVec2::max);
    let limit = m.process.min_wall_mm;
    let wall = (0.5 * m.outer_mm - reach).min_element();
    if wall >= limit * (1.0 - 1e-9) {
        return None;
    }
    let needed = (2.0 * (reach + limit)).max(m.outer_mm);
    let cure = Cure::value(
        "platforms.outer_mm",
        json!(needed.to_array().map(|side| (100.0 * side - 1e-6).ceil() / 100.0)),
    );
    Some(unheld(["camera", "lower_platform"], "wall beside the board's pocket", [wall, limit], cure))
}

/// The block goes on above the board: a roof over the recess, and material for the screws.
fn roof(m: &Measures, seat: &BoardSeat, thread: &Thread) -> Option<PartError> {
    let above = m.lower_top_z_mm - m.pupil_mm().z - seat.face_z_mm;
    let needed = seat.recess_mm.max(MIN_THREAD_DIAMETERS * thread.nominal_mm) + m.process.min_wall_mm;
    if above >= needed * (1.0 - 1e-9) {
        return None;
    }
    let z = m.pupil_mm().z;
    let cure = Cure::length("camera.position_mm[2]", z, z - (needed - above));
    let problem = format!(
        "block above the board, for what stands on its front, {} and a wall; height",
        format_args!("{} diameters of an {} screw", MIN_THREAD_DIAMETERS, thread.name)
    );
    Some(unheld(["camera", "lower_platform"], problem, [above, needed], cure))
}

/// What is below the board ends within the block, and the cable leaves beside it.
fn room_below(m: &Measures, seat: &BoardSeat, thread: &Thread) -> Option<PartError> {
    let underside = m.platforms.lower.underside_z_mm;
    let below = m.pupil_mm().z + seat.back_z_mm - underside;
    // A cap head is as high as its screw is thick.
    let needed = seat.board.components_height_mm.max(thread.nominal_mm);
    if below < needed * (1.0 - 1e-9) {
        let field = "platforms.lower.underside_z_mm";
        let cure = Cure::length(field, underside, underside - (needed - below));
        let problem = "room below the board for its parts and the screws' heads";
        return Some(unheld(["camera", "lower_platform"], problem, [below, needed], cure));
    }
    let exit = &m.platforms.lower.cable_exit;
    let height = below + seat.board.thickness_mm;
    if exit.width_mm > 0.0 && exit.height_mm > height {
        let cure = Cure::length("platforms.lower.cable_exit.height_mm", exit.height_mm, height);
        let problem = "the cable's exit would cut the posts that the board bears on; height";
        return Some(unheld(["camera", "lower_platform"], problem, [exit.height_mm, height], cure));
    }
    None
}

/// What the finished lower platform lacks: posts under the board, material round its screws.
pub(super) fn bearing(m: &Measures, assembly: &Assembly) -> Vec<PartError> {
    let Some((seat, thread)) =
        BoardSeat::of(m).and_then(|seat| Some((seat.thread?, seat)).map(|(t, s)| (s, t)))
    else {
        return Vec::new();
    };
    let Some(lower) = assembly.items.iter().find(|item| item.name == "lower_platform") else {
        return Vec::new();
    };
    let lower = RayTarget::new(&lower.mesh);
    let skin = 2.0 * m.chord.tolerance_mm() + 0.01;
    let hit = |from: DVec3, to: DVec3| {
        lower.is_hit(m.sensor_from_camera.transform_point3(from), m.sensor_from_camera.transform_point3(to))
    };
    let round = |at: DVec2, radius: f64| {
        (0..AROUND)
            .map(move |k| at + radius * DVec2::from_angle(TAU * (f64::from(k) + 0.5) / f64::from(AROUND)))
    };
    let (face, tap) = (seat.face_z_mm, 0.5 * thread.tap_mm);
    let mut found = Vec::new();
    for (i, &at) in seat.holes_mm.iter().enumerate() {
        let ring = 0.5 * (tap + seat.post_mm);
        let backed = round(at, ring).filter(|p| hit(p.extend(face - skin), p.extend(face + skin))).count();
        let share = backed as f64 / f64::from(AROUND);
        if share < MIN_BACKED {
            let place = format!(
                "ring of the post at hole {i} that the board bears on, {:.0} % of it is there; its width",
                100.0 * share
            );
            let width = seat.post_mm - tap;
            let field = "camera_body.board.holes_mm";
            found.push(infeasible("lower_platform", place, share * width, MIN_BACKED * width, field));
            continue;
        }
        let step = seat.hole_depth_mm / f64::from(HEIGHTS);
        let engaged = (0..HEIGHTS)
            .filter(|&h| {
                let z = face + step * (f64::from(h) + 0.5);
                let met = round(at, tap + skin).filter(|p| hit(at.extend(z), p.extend(z))).count();
                met as f64 >= ROUND_SHARE * f64::from(AROUND)
            })
            .count();
        let (length, needed) = (step * engaged as f64, MIN_THREAD_DIAMETERS * thread.nominal_mm);
        // One height of the search is not known.
        if length + step < needed {
            let place = format!("material round the {} screw in hole {i}; length", thread.name);
            let field = "camera_body.board.holes_mm";
            found.push(infeasible("lower_platform", place, length, needed, field));
        }
    }
    found
}
