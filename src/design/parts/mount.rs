//! A rigid mount: posts on the lower platform carry the upper one, screws from below hold it.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::error::{Cure, infeasible};
use super::measures::Measures;
use super::screws::{THREADS, Thread};
use super::{Blueprint, Feature, PartError};
use domecast_mesh::{Fit, Profile, RayTarget, Shape, TriMesh};

/// A screw that cuts its thread into plastic is sunk by this many of its diameters where the platform lets it, and holds
/// from this many on.
const SCREW_DIAMETERS: f64 = 2.5;
const MIN_THREAD_DIAMETERS: f64 = 2.0;
/// A head lies in its pocket with this much room round it, mm.
const HEAD_ROOM_MM: f64 = 0.2;
/// Directions round a post, heights along a screw, and shares of them that must bear.
const AROUND: u32 = 24;
const HEIGHTS: u32 = 64;
const MIN_BACKED: f64 = 0.5;
const ROUND_SHARE: f64 = 2.0 / 3.0;

/// The screws of the mount; `None` if none is as thin as the holes.
pub(super) fn thread(m: &Measures) -> Option<Thread> {
    Thread::through(m.mount.hole_diameter_mm)
}

/// Material above the upper platform's underside that a screw may go into, mm.
fn depth_mm(m: &Measures, thread: &Thread) -> f64 {
    let room = m.seat_z_mm() - m.platforms.upper.underside_z_mm - m.process.min_wall_mm;
    (SCREW_DIAMETERS * thread.nominal_mm).min(room)
}

/// Adds the posts to the lower platform and cuts their screws' holes, with pockets for the heads from below.
pub(super) fn lower(m: &Measures, b: &mut Blueprint) {
    let Some(thread) = thread(m).filter(|_| m.mount.is_rigid()) else { return };
    let (top, bottom, over) = (m.lower_top_z_mm, m.platforms.lower.underside_z_mm, m.overcut_mm);
    let under = m.platforms.upper.underside_z_mm;
    let root = top - 0.25 * (top - bottom);
    let (hole, head) = (0.5 * m.mount.hole_diameter_mm, 0.5 * thread.head_mm + HEAD_ROOM_MM);
    let step = bottom + thread.nominal_mm + HEAD_ROOM_MM;
    for (i, at) in m.mount.at_mm.iter().enumerate() {
        let post = Shape::cylinder(0.5 * m.mount.post_diameter_mm, root, under, Fit::Area);
        b.added.push(Feature::new("post", "mount.post_diameter_mm", post).numbered(i).at(at[0], at[1]));
        let profile =
            Profile::lines(&[(head, bottom - over), (head, step), (hole, step), (hole, under + over)]);
        let shape = Shape::Turned { profile, fit: Fit::Outside };
        b.cut.push(Feature::new("post screw hole", "mount.at_mm", shape).numbered(i).at(at[0], at[1]));
        b.genus += 1;
    }
}

/// Cuts the screws' holes into the upper platform.
pub(super) fn upper(m: &Measures, b: &mut Blueprint) {
    let Some(thread) = thread(m).filter(|_| m.mount.is_rigid()) else { return };
    let (under, depth) = (m.platforms.upper.underside_z_mm, depth_mm(m, &thread));
    if depth <= 0.0 {
        return;
    }
    for (i, at) in m.mount.at_mm.iter().enumerate() {
        let hole = Shape::cylinder(0.5 * thread.tap_mm, under - m.overcut_mm, under + depth, Fit::Area);
        b.cut.push(Feature::new("post screw hole", "mount.at_mm", hole).numbered(i).at(at[0], at[1]));
    }
}

fn unheld(problem: String, values_mm: [f64; 2], cure: Cure) -> PartError {
    PartError::Unheld {
        part: "upper_platform".into(),
        by: "lower_platform".into(),
        problem,
        value_mm: values_mm[0],
        limit_mm: values_mm[1],
        cure,
    }
}

/// Dimensions of the mount that contradict each other.
pub(super) fn faults(m: &Measures) -> Vec<PartError> {
    if !m.mount.is_rigid() {
        return Vec::new();
    }
    let hole = m.mount.hole_diameter_mm;
    let Some(thread) = thread(m) else {
        let needed = THREADS[0].clearance_mm;
        let cure = Cure::length("mount.hole_diameter_mm", hole, needed);
        return vec![unheld(
            "no screw is as thin as the posts' holes; their diameter".into(),
            [hole, needed],
            cure,
        )];
    };
    let mut found = Vec::new();
    let (wall, post) = (m.process.min_wall_mm, m.mount.post_diameter_mm);
    if 0.5 * (post - hole) < wall * (1.0 - 1e-9) {
        let cure = Cure::length("mount.post_diameter_mm", post, hole + 2.0 * wall);
        found.push(unheld("wall of a post round its screw".into(), [0.5 * (post - hole), wall], cure));
    }
    let (depth, needed) = (depth_mm(m, &thread), MIN_THREAD_DIAMETERS * thread.nominal_mm);
    if depth < needed * (1.0 - 1e-9) {
        let under = m.platforms.upper.underside_z_mm;
        let cure = Cure::length("platforms.upper.underside_z_mm", under, under - (needed - depth));
        let problem = format!("material under the sheet that an {} screw goes into; depth", thread.name);
        found.push(unheld(problem, [depth, needed], cure));
    }
    found
}

/// What the finished upper platform lacks above the posts: a face that bears, material round the screws.
pub(super) fn bearing(m: &Measures, upper: Option<&TriMesh>) -> Vec<PartError> {
    let Some((thread, upper)) = thread(m).zip(upper).filter(|_| m.mount.is_rigid()) else {
        return Vec::new();
    };
    let upper = RayTarget::new(upper);
    let (under, tap) = (m.platforms.upper.underside_z_mm, 0.5 * thread.tap_mm);
    let skin = 2.0 * m.chord.tolerance_mm() + 0.01;
    let round = |at: DVec2, radius: f64| {
        (0..AROUND)
            .map(move |k| at + radius * DVec2::from_angle(TAU * (f64::from(k) + 0.5) / f64::from(AROUND)))
    };
    let mut found = Vec::new();
    for (i, at) in m.mount.at_mm.iter().enumerate() {
        let at = DVec2::from_array(*at);
        let (inner, outer) = (0.5 * m.mount.hole_diameter_mm, 0.5 * m.mount.post_diameter_mm);
        let ring = round(at, 0.5 * (inner + outer));
        let lies = |p: &DVec2| upper.is_hit(p.extend(under - skin), p.extend(under + skin));
        let share = ring.filter(lies).count() as f64 / f64::from(AROUND);
        if share < MIN_BACKED {
            let place = format!(
                "underside above post {i}, {:.0} % of a ring of it is there; width of the ring",
                100.0 * share
            );
            let width = outer - inner;
            found.push(infeasible("upper_platform", place, share * width, MIN_BACKED * width, "mount.at_mm"));
            continue;
        }
        let step = depth_mm(m, &thread) / f64::from(HEIGHTS);
        let is_round = |h: &u32| {
            let axis: DVec3 = at.extend(under + step * (f64::from(*h) + 0.5));
            let met = round(at, tap + skin).filter(|p| upper.is_hit(axis, p.extend(axis.z))).count();
            met as f64 >= ROUND_SHARE * f64::from(AROUND)
        };
        let length = step * (0..HEIGHTS).filter(is_round).count() as f64;
        let needed = MIN_THREAD_DIAMETERS * thread.nominal_mm;
        // One height of the search is not known.
        if length + step < needed {
            let place = format!("material round the {} screw of post {i}; length", thread.name);
            found.push(infeasible("upper_platform", place, length, needed, "mount.at_mm"));
        }
    }
    found
}
