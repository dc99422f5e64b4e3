//! Walls: what is left between two cuts, and between a cut and the outside.

use glam::DVec3;

use super::{Blueprint, Feature, Measures, PartError};
use crate::mesh::{Chord, Construction, MeshError, RayTarget, Solid};

/// Walls are looked for on meshes this coarse, in parts of the limit.
const CHORD_SHARE: f64 = 0.05;
/// Two faces bound a wall if their normals are opposite to within about 18
/// degrees; where faces meet at a blunter angle the material ends in an edge.
const OPPOSITE: f64 = -0.95;
/// A wall is refused if it is thinner than the limit by more than this share:
/// the chords of two circles may eat so much of it.
const SLACK: f64 = 2.5 * CHORD_SHARE;

/// Checks every wall of a printed part against the process.
///
/// Pairs of cuts that are not meant to meet keep their distance (measured
/// between the tools, inside the part), and from points all over the surface
/// the thickness of the material behind is measured.
///
/// # Errors
/// The thinnest wall below the limit: where, between what, which field.
pub(super) fn check(b: &Blueprint, m: &Measures) -> Result<(), PartError> {
    let limit = m.process.min_wall_mm;
    if !b.printed || limit <= 0.0 {
        return Ok(());
    }
    let failed = |error: MeshError| PartError::Mesh { part: b.name.clone(), error };
    let chord = Chord::new((CHORD_SHARE * limit).max(b.chord.tolerance_mm())).map_err(failed)?;
    distances(b, chord, limit, &failed)?;
    thicknesses(b, chord, limit, &failed)
}

fn distances(
    b: &Blueprint,
    chord: Chord,
    limit: f64,
    failed: &dyn Fn(MeshError) -> PartError,
) -> Result<(), PartError> {
    // A coarse tolerance of its own would make fine cavities slow here.
    let coarse = |f: &Feature| {
        let mut piece = f.piece.clone();
        piece.chord = None;
        piece.solid(chord)
    };
    let body = Solid::union(b.added.iter().map(coarse).collect::<Result<_, _>>().map_err(failed)?)
        .map_err(failed)?;
    let mut tools = Vec::with_capacity(b.cut.len());
    for feature in &b.cut {
        let tool = coarse(feature).map_err(failed)?;
        // Only what is inside the part counts; a cut that misses it is a
        // mistake in the design.
        let Some(inside) = tool.intersection(&body).map_err(failed)? else {
            return Err(b.infeasible(
                format!("{} misses the part: cuts", feature.piece.name),
                0.0,
                limit,
                feature.field,
            ));
        };
        let bounds = inside.to_mesh().bounds();
        tools.push((feature, inside, bounds));
    }
    for (i, (one, solid, bounds)) in tools.iter().enumerate() {
        for (two, other, other_bounds) in &tools[i + 1..] {
            if meant_to_meet(b, one, two) {
                continue;
            }
            if let (Some(p), Some(q)) = (bounds, other_bounds)
                && ((p.min_mm - q.max_mm).max(q.min_mm - p.max_mm)).max_element() > limit
            {
                continue;
            }
            let gap = solid.gap_mm(other, limit);
            if gap < limit * (1.0 - SLACK) {
                let place = format!("wall between {} and {}", one.piece.name, two.piece.name);
                return Err(b.infeasible(place, gap, limit, fields(one, two)));
            }
        }
    }
    Ok(())
}

fn meant_to_meet(b: &Blueprint, one: &Feature, two: &Feature) -> bool {
    let listed = |x: &str, y: &str| b.may_meet.contains(&(x, y)) || b.may_meet.contains(&(y, x));
    // A magnet's pocket and its own push-out hole stand on one axis.
    let same_axis = one.piece.part_from_shape == two.piece.part_from_shape;
    listed(one.kind, two.kind) || same_axis
}

fn fields(one: &Feature, two: &Feature) -> String {
    if one.field == two.field { one.field.to_owned() } else { format!("{} or {}", one.field, two.field) }
}

fn thicknesses(
    b: &Blueprint,
    chord: Chord,
    limit: f64,
    failed: &dyn Fn(MeshError) -> PartError,
) -> Result<(), PartError> {
    let mut construction: Construction = b.construction();
    for piece in construction.added.iter_mut().chain(&mut construction.cut) {
        piece.chord = None;
    }
    let solid = construction.solid(chord).map_err(failed)?;
    let mesh = solid.to_mesh();
    let target = RayTarget::new(&mesh);
    let skin = 1e-3 * limit;
    let mut thinnest: Option<(f64, DVec3, DVec3)> = None;
    for corners in mesh.iter_mm() {
        let [p, q, r] = corners;
        let cross = (q - p).cross(r - p);
        let Some(normal) = cross.try_normalize() else { continue };
        for point in samples(corners, cross.length(), limit) {
            let from = point - normal * skin;
            let Some((fraction, other)) = target.first_hit(from, point - normal * limit) else { continue };
            if normal.dot(other) > OPPOSITE {
                continue;
            }
            let thickness = skin + fraction * (limit - skin);
            if thinnest.is_none_or(|(least, ..)| thickness < least) {
                thinnest = Some((thickness, point, point - normal * thickness));
            }
        }
    }
    let Some((thickness, from, to)) = thinnest else { return Ok(()) };
    if thickness >= limit * (1.0 - SLACK) {
        return Ok(());
    }
    let (one, two) = (face_at(b, from), face_at(b, to));
    let place = format!(
        "wall between {} and {} at ({:.2}, {:.2}, {:.2})",
        one.piece.name, two.piece.name, from.x, from.y, from.z
    );
    Err(b.infeasible(place, thickness, limit, fields(one, two)))
}

/// Points inside a triangle about as far apart as the limit, at most some hundred;
/// a sliver gets a single row of them.
fn samples(corners: [DVec3; 3], twice_area: f64, limit: f64) -> Vec<DVec3> {
    let [p, q, r] = corners;
    let edges = [(p, q, r), (q, r, p), (r, p, q)];
    let length = |&(a, b, _): &(DVec3, DVec3, DVec3)| (b - a).length();
    let longest = edges.iter().map(length).fold(0.0, f64::max);
    let short = twice_area / longest.max(f64::MIN_POSITIVE);
    let n = ((longest / limit).ceil() as u32).clamp(1, 10);
    let at = |i: u32, n: u32| (f64::from(i) + 1.0 / 3.0) / f64::from(n);
    if short < 0.5 * limit {
        let shortest = edges.iter().min_by(|x, y| length(x).total_cmp(&length(y)));
        let (a, b, tip) = *shortest.unwrap_or(&edges[0]);
        let foot = 0.5 * (a + b);
        return (0..n).map(|i| foot + (tip - foot) * at(i, n)).collect();
    }
    (0..n).flat_map(|i| (0..n - i).map(move |j| p + (q - p) * at(i, n) + (r - p) * at(j, n))).collect()
}

/// The feature whose exact surface is nearest to a point.
fn face_at(b: &Blueprint, point: DVec3) -> &Feature {
    let distance = |f: &Feature| f.piece.signed_distance_mm(point).abs();
    let all = b.cut.iter().chain(&b.added);
    // A part has at least one piece of material.
    all.min_by(|x, y| distance(x).total_cmp(&distance(y))).unwrap_or(&b.added[0])
}
