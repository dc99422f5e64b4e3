//! Stand-ins for what is purchased or cast, for pictures and interference checks.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec2, DVec3};

use super::board::BoardSeat;
use super::measures::Measures;
use super::screws::Thread;
use domecast_mesh::{Chord, Construction, Fit, MeshError, Piece, Profile, ProfileEdge, Shape, TriMesh};
use domecast_optics::DomeShape;
use domecast_optics::numeric::Rigid;

/// The camera, about its axis, in the sensor frame at rest.
pub(super) fn camera(m: &Measures) -> Construction {
    let alone = || Construction { added: vec![barrel(m)], cut: Vec::new() };
    BoardSeat::of(m).map_or_else(alone, |seat| seat.stand_in(m))
}

/// The camera's mesh, sensor frame at rest.
pub(super) fn camera_mesh(m: &Measures) -> Result<TriMesh, MeshError> {
    if m.camera_body.board.is_some() {
        return camera(m).solid(m.chord).map(|solid| solid.to_mesh());
    }
    let piece = barrel(m);
    piece.shape.triangulate(&piece.name, m.chord).map(|mesh| mesh.transformed(&piece.part_from_shape))
}

/// The cylinder about the camera's axis: its housing, or the lens barrel of a board.
fn barrel(m: &Measures) -> Piece {
    let body = &m.camera_body;
    let front = body.front_from_pupil_mm;
    let shape = Shape::cylinder(0.5 * body.diameter_mm, front - body.length_mm, front, Fit::Inside);
    Piece::new("camera", shape).placed(m.sensor_from_camera)
}

/// The camera's housing as a ray from its pupil meets it: open within the front glass. `None` where the glass is as
/// wide as the housing.
pub(super) fn camera_housing(m: &Measures) -> Option<Construction> {
    let body = &m.camera_body;
    if body.lens_diameter_mm >= body.diameter_mm {
        return None;
    }
    let (front, over) = (body.front_from_pupil_mm, 0.1 * body.length_mm);
    let back = front - body.length_mm - over;
    let glass = Shape::cylinder(0.5 * body.lens_diameter_mm, back, front + over, Fit::Outside);
    let cut = Piece::new("front glass", glass).placed(m.sensor_from_camera);
    Some(Construction { added: vec![barrel(m)], cut: vec![cut] })
}

/// How deep the heads of the mounting screws lie in their counterbores, mm; 0 without any.
pub(super) fn sunk_mm(m: &Measures) -> f64 {
    let mounting = &m.platforms.lower.mounting;
    let is_sunk = mounting.counterbore_diameter_mm > mounting.hole_diameter_mm;
    if is_sunk { mounting.counterbore_depth_mm } else { 0.0 }
}

/// The cap heads of the mounting screws, on the lower platform's top or in their counterbores, rest frame.
pub(super) fn screw_heads(m: &Measures) -> Vec<Piece> {
    let mounting = &m.platforms.lower.mounting;
    let Some(thread) = Thread::through(mounting.hole_diameter_mm) else { return Vec::new() };
    let floor = m.lower_top_z_mm - sunk_mm(m);
    let head = |i: usize, at: &[f64; 2]| {
        let shape = Shape::cylinder(0.5 * thread.head_mm, floor, floor + thread.nominal_mm, Fit::Inside);
        Piece::new(format!("mounting screw {i}"), shape).at(at[0], at[1])
    };
    mounting.at_mm.iter().enumerate().map(|(i, at)| head(i, at)).collect()
}

/// The elastomer dome, in the sensor frame.
pub(super) fn dome(m: &Measures) -> Piece {
    turned("dome", &m.dome)
}

/// The dome with its membrane, in the sensor frame: its outer face.
pub(super) fn membrane(m: &Measures) -> Piece {
    turned("membrane", &m.dome.with_radius_mm(m.dome.radius_mm() + m.membrane_mm))
}

fn turned(name: &str, dome: &DomeShape) -> Piece {
    let mut points_mm = vec![DVec2::new(dome.rim_radius_mm(), 0.0)];
    let mut edges = Vec::new();
    if dome.center_z_mm() > 0.0 {
        points_mm.push(DVec2::new(dome.radius_mm(), dome.center_z_mm()));
        edges.push(ProfileEdge::Line);
    }
    points_mm.push(DVec2::new(0.0, dome.height_mm()));
    edges.push(ProfileEdge::Arc { center_z_mm: dome.center_z_mm() });
    Piece::new(name, Shape::Turned { profile: Profile { points_mm, edges }, fit: Fit::Inside })
}

/// Both magnets of spring `i`: the upper one in the sensor frame, the lower in
/// the rest frame.
pub(super) fn magnets(m: &Measures, i: usize) -> [Piece; 2] {
    let (radius, t) = (0.5 * m.magnets.diameter_mm, m.magnets.thickness_mm);
    let axis = m.spring_axes_mm.get(i).copied().unwrap_or_default();
    let (under, top) = (m.platforms.upper.underside_z_mm, m.lower_top_z_mm);
    [("upper magnet", under, under + t), ("lower magnet", top - t, top)].map(|(name, low, high)| {
        Piece::new(format!("{name} {i}"), Shape::cylinder(radius, low, high, Fit::Inside)).at(axis.x, axis.y)
    })
}

/// Board and LED of seat `i`, in the sensor frame.
pub(super) fn led(m: &Measures, i: usize) -> [Piece; 2] {
    let leds = &m.leds;
    let pose = m.platform_from_led(i);
    let (w, h) = (0.5 * leds.package_mm[0], 0.5 * leds.package_mm[1]);
    let package = Shape::cuboid(DVec3::new(-w, -h, -leds.package_height_mm), DVec3::new(w, h, 0.0));
    let (w, h) = (0.5 * leds.board_mm[0], 0.5 * leds.board_mm[1]);
    let back = -leds.package_height_mm - leds.board_thickness_mm;
    let board = Shape::cuboid(
        DVec3::new(-w, leds.board_offset_mm - h, back),
        DVec3::new(w, leds.board_offset_mm + h, -leds.package_height_mm),
    );
    [
        Piece::new(format!("LED {i}"), package).placed(pose),
        Piece::new(format!("LED board {i}"), board).placed(pose),
    ]
}

/// Ends of spring `i` at a pose of the platform: lower and upper, rest frame.
pub(super) fn spring_ends_mm(m: &Measures, i: usize, rest_from_platform: &Rigid) -> [DVec3; 2] {
    let axis = m.spring_axes_mm.get(i).copied().unwrap_or_default();
    let upper = rest_from_platform.point(axis.extend(m.platforms.upper.underside_z_mm));
    [axis.extend(m.lower_top_z_mm), upper]
}

/// Outer radius of a spring that is pressed to `length_mm`: the wire keeps its
/// length, so coils grow as their pitch sinks (one end free to turn).
fn outer_radius_mm(m: &Measures, length_mm: f64) -> f64 {
    let mean = m.spring_outer_mm - m.spring_wire_mm;
    // The dead coils at both ends rise by the wire's thickness each.
    let dead = 3.0 * m.spring_wire_mm;
    let pitch = |length: f64| ((length - dead) / m.spring_coils.max(1.0)).max(m.spring_wire_mm) / PI;
    let grown = mean * mean + pitch(m.spring_length_mm).powi(2) - pitch(length_mm).powi(2);
    0.5 * (grown.max(mean * mean).sqrt() + m.spring_wire_mm)
}

/// What spring `i` sweeps at a pose: a tube round the line that a column
/// clamped to both seats bends to (the cubic with the seats' normals as its
/// ends' directions), as wide as the pressed coils. It is shortened by a little
/// at both ends: springs bear on the magnets and would touch them.
pub(super) fn spring_tube(
    m: &Measures,
    i: usize,
    rest_from_platform: &Rigid,
    chord: Chord,
) -> Result<(TriMesh, usize), MeshError> {
    const RINGS: u32 = 12;
    const SKIN: f64 = 0.02;
    let [low, high] = spring_ends_mm(m, i, rest_from_platform);
    let length = (high - low).length();
    let ends = [DVec3::Z * length, rest_from_platform.vector(DVec3::Z) * length];
    let radius = outer_radius_mm(m, length);
    let around = chord.circle_segments(radius, Fit::Outside)?;
    let corner = Fit::Outside.corner_radius_mm(radius, PI / f64::from(around));
    let mut mesh = TriMesh::default();
    for k in 0..=RINGS {
        let t = SKIN + (1.0 - 2.0 * SKIN) * f64::from(k) / f64::from(RINGS);
        let (t2, t3) = (t * t, t * t * t);
        let at = low * (2.0 * t3 - 3.0 * t2 + 1.0)
            + ends[0] * (t3 - 2.0 * t2 + t)
            + high * (3.0 * t2 - 2.0 * t3)
            + ends[1] * (t3 - t2);
        let along = (high - low) * (6.0 * t - 6.0 * t2)
            + ends[0] * (3.0 * t2 - 4.0 * t + 1.0)
            + ends[1] * (3.0 * t2 - 2.0 * t);
        let turn = DQuat::from_rotation_arc(DVec3::Z, along.normalize_or(DVec3::Z));
        let step = TAU / f64::from(around);
        let ring = (0..around).map(|a| DVec2::from_angle(step * f64::from(a)) * corner);
        mesh.vertices_mm.extend(ring.map(|p| at + turn * p.extend(0.0)));
    }
    mesh.close_tube(RINGS, around);
    Ok((mesh, around as usize))
}

/// A spring as its wire, between its ends at any length: a helix with one coil
/// flat at either end. For pictures; the wire is followed by a polygon.
pub(super) fn spring_wire(
    m: &Measures,
    i: usize,
    rest_from_platform: &Rigid,
    chord: Chord,
) -> Result<TriMesh, MeshError> {
    let [low, high] = spring_ends_mm(m, i, rest_from_platform);
    let wire = 0.5 * m.spring_wire_mm;
    let radius = 0.5 * m.spring_outer_mm - wire;
    let along = high - low;
    let length = along.length();
    let turn = DQuat::from_rotation_arc(DVec3::Z, along.normalize_or(DVec3::Z));
    // One dead coil at each end lies flat on the magnet.
    let coils = m.spring_coils + 2.0;
    let around = chord.circle_segments(wire, Fit::Inside)?;
    let per_coil = f64::from(chord.circle_segments(radius, Fit::Inside)?.max(24));
    let steps = (coils * per_coil).ceil() as u32;
    let height = |turns: f64| {
        let rise = ((turns - 1.0) / m.spring_coils).clamp(0.0, 1.0);
        // Each dead coil rises by the wire's own thickness, the rest by the pitch.
        let dead = turns.min(1.0) + (turns - 1.0 - m.spring_coils).max(0.0);
        wire + dead * 2.0 * wire + rise * (length - 6.0 * wire)
    };
    let mut mesh = TriMesh::default();
    for k in 0..=steps {
        let turns = coils * f64::from(k) / f64::from(steps);
        let (sin, cos) = (TAU * turns).sin_cos();
        let outward = DVec3::new(cos, sin, 0.0);
        for a in 0..around {
            let (s, c) = (TAU * f64::from(a) / f64::from(around)).sin_cos();
            let p = outward * (radius + wire * c) + DVec3::Z * (height(turns) + wire * s);
            mesh.vertices_mm.push(low + turn * p);
        }
    }
    mesh.close_tube(steps, around);
    // The tube runs with its sections turned from outward to up: wound
    // outwards if its volume is positive.
    if mesh.volume_mm3() < 0.0 {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    Ok(mesh)
}
