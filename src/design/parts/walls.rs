//! Walls: what is left between two cuts, and between a cut and the outside.
//!
//! Two searches, each first on coarse meshes, whose error is known; what comes
//! within that error of the limit is measured again, so that the verdict is
//! exact to [`FINE_SHARE`] of the limit.
//!
//! * Between two cuts: the distance of the tools inside the part.
//! * Between a cut and the outside, or two sides of the material: rays from
//!   every corner of every facet along the facet's normal. Over two faces of
//!   which one is flat, the distance is least at a corner of one of them, so
//!   none can be missed but by what the facets' own angles add.

use std::collections::HashSet;

use glam::DVec3;

use super::{Blueprint, Feature, Measures, PartError};
use domecast_mesh::{BoundingBox, Chord, Construction, MeshError, Piece, RayTarget, Shape, Solid, TriMesh};

/// Walls are looked for on meshes this coarse, in parts of the limit.
const CHORD_SHARE: f64 = 0.02;
/// And measured, where it matters, on meshes this fine.
const FINE_SHARE: f64 = 0.002;
/// Two faces bound a wall if their normals are opposite to within about 18
/// degrees; where faces meet at a blunter angle the material ends in an edge.
pub(super) const OPPOSITE: f64 = -0.95;
/// How much longer the way along a normal can be than the wall is thick: two
/// faces within [`OPPOSITE`], each with its chords.
const SEARCH: f64 = 1.0 / 0.95 + 2.0 * CHORD_SHARE;
/// A mesh so many times finer than the search needs costs more to look at than a coarse one costs to make.
const MUCH_FINER: f64 = 4.0;
/// Normals that agree to one part in so many are those of one plane.
const SAME_PLANE: f64 = 1e7;

/// Checks every wall of a printed part against the process. The part's own mesh, where it is at hand, is looked at
/// if it is fine enough for the search and not much finer.
///
/// # Errors
/// All walls below the limit: where, between what, which field; of features of the same two kinds the thinnest.
pub(super) fn check(b: &Blueprint, m: &Measures, made: Option<&TriMesh>) -> Result<(), PartError> {
    let limit = m.process.min_wall_mm;
    if !b.printed || limit <= 0.0 {
        return Ok(());
    }
    let failed = |error: MeshError| PartError::Mesh { part: b.name.clone(), error };
    let mut thin = Thin::default();
    distances(b, limit, &mut thin, &failed)?;
    // Cuts that run into each other leave no material to look through.
    if thin.0.is_empty() {
        thicknesses(b, limit, made, &mut thin, &failed)?;
    }
    PartError::all(thin.0.into_iter().map(|(_, _, fault)| fault).collect())
}

/// The faults that were found, each with the kinds of its features and its thickness, mm.
#[derive(Default)]
struct Thin(Vec<([&'static str; 2], f64, PartError)>);

impl Thin {
    /// Takes in a wall; of the same two kinds of features the thinnest stays.
    fn add(&mut self, mut kinds: [&'static str; 2], thickness_mm: f64, fault: PartError) {
        kinds.sort_unstable();
        match self.0.iter_mut().find(|(other, ..)| *other == kinds) {
            Some(known) if thickness_mm < known.1 => *known = (kinds, thickness_mm, fault),
            Some(_) => {}
            None => self.0.push((kinds, thickness_mm, fault)),
        }
    }
}

/// The piece as a solid at a tolerance, whatever tolerance it has of its own.
fn solid_of(piece: &Piece, chord: Chord) -> Result<Solid, MeshError> {
    Piece { chord: None, ..piece.clone() }.solid(chord)
}

fn distances(
    b: &Blueprint,
    limit: f64,
    thin: &mut Thin,
    failed: &dyn Fn(MeshError) -> PartError,
) -> Result<(), PartError> {
    let coarse = Chord::new(CHORD_SHARE * limit).map_err(failed)?;
    let material = b.added.iter().map(|f| solid_of(&f.piece, coarse)).collect::<Result<_, _>>();
    let body = material.and_then(Solid::union).map_err(failed)?;
    let mut tools = Vec::with_capacity(b.cut.len());
    for feature in &b.cut {
        let tool = solid_of(&feature.piece, coarse).map_err(failed)?;
        // Only what is inside the part counts; a cut that misses it is a
        // mistake in the design.
        let Some(inside) = tool.intersection(&body).map_err(failed)? else {
            let place = format!("{} misses the part: cuts", feature.piece.name);
            thin.add([feature.kind; 2], 0.0, b.infeasible(place, 0.0, limit, feature.field));
            continue;
        };
        let bounds = inside.to_mesh().bounds();
        tools.push((feature, inside, bounds));
    }
    let search = limit * (1.0 + 2.0 * CHORD_SHARE);
    let mut fine = None;
    for (i, (one, solid, bounds)) in tools.iter().enumerate() {
        for (two, other, other_bounds) in &tools[i + 1..] {
            if meant_to_meet(b, one, two) {
                continue;
            }
            let (Some(p), Some(q)) = (bounds, other_bounds) else { continue };
            if apart_mm(p, q) > search || solid.gap_mm(other, search) >= search {
                continue;
            }
            let body = match &mut fine {
                Some(body) => body,
                unknown => unknown.insert(fine_solids(b.added.iter(), limit).map_err(failed)?),
            };
            // Only what lies between the two, or opens into them there, changes their distance.
            let between = [within(p, q, search), within(q, p, search)];
            let opened: Vec<&Feature> = tools
                .iter()
                .filter(|(f, ..)| ![one, two].iter().any(|x| x.piece.name == f.piece.name))
                .filter(|(f, ..)| meant_to_meet(b, one, f) || meant_to_meet(b, two, f))
                .filter(|(.., reach)| {
                    let near =
                        |space| reach.is_none_or(|reach| apart_mm(&reach, space) <= CHORD_SHARE * limit);
                    between.iter().any(near)
                })
                .map(|(f, ..)| *f)
                .collect();
            let Some(gap) = measured(body, &opened, [one, two], limit).map_err(failed)? else { continue };
            if gap < limit * (1.0 - 2.0 * FINE_SHARE) {
                let place = format!("wall between {} and {}", one.piece.name, two.piece.name);
                thin.add([one.kind, two.kind], gap, b.infeasible(place, gap, limit, fields(one, two)));
            }
        }
    }
    Ok(())
}

/// Distance of two boxes along the axis on which they are farthest apart, mm.
fn apart_mm(p: &BoundingBox, q: &BoundingBox) -> f64 {
    (p.min_mm - q.max_mm).max(q.min_mm - p.max_mm).max_element()
}

/// The part of a box that lies within a distance of another one.
fn within(p: &BoundingBox, of: &BoundingBox, reach_mm: f64) -> BoundingBox {
    BoundingBox { min_mm: p.min_mm.max(of.min_mm - reach_mm), max_mm: p.max_mm.min(of.max_mm + reach_mm) }
}

/// Features on fine meshes, as one solid.
fn fine_solids<'f>(features: impl Iterator<Item = &'f Feature>, limit: f64) -> Result<Solid, MeshError> {
    let fine = Chord::new(FINE_SHARE * limit)?;
    features.map(|f| solid_of(&f.piece, fine)).collect::<Result<Vec<_>, _>>().and_then(Solid::union)
}

/// Distance between two cuts on fine meshes, of what is cut from material that no cut which they open into has
/// taken away: a hole that starts inside a bore bounds no wall there. `None` if nothing is left of one.
fn measured(
    body: &Solid,
    opened: &[&Feature],
    [one, two]: [&Feature; 2],
    limit: f64,
) -> Result<Option<f64>, MeshError> {
    let fine = Chord::new(FINE_SHARE * limit)?;
    let away = match opened {
        [] => None,
        some => Some(fine_solids(some.iter().copied(), limit)?),
    };
    let left = |f: &Feature| {
        let inside = solid_of(&f.piece, fine)?.intersection(body)?;
        let (Some(inside), Some(away)) = (&inside, &away) else { return Ok(inside) };
        match inside.difference(away) {
            Err(MeshError::Empty { .. }) => Ok(None),
            other => other.map(Some),
        }
    };
    let search = limit * (1.0 + 2.0 * CHORD_SHARE);
    Ok(left(one)?.zip(left(two)?).map(|(p, q)| p.gap_mm(&q, search)))
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

/// A wall that may be too thin: a point on each side with the facet's normal there, its thickness, and the middle
/// of the facet that it was seen from, which tells best whose facet that is.
#[derive(Debug, Clone, Copy)]
struct Wall {
    from: (DVec3, DVec3),
    to: (DVec3, DVec3),
    thickness: f64,
    facet: DVec3,
}

fn thicknesses(
    b: &Blueprint,
    limit: f64,
    made: Option<&TriMesh>,
    thin: &mut Thin,
    failed: &dyn Fn(MeshError) -> PartError,
) -> Result<(), PartError> {
    let coarse = Chord::new(CHORD_SHARE * limit).map_err(failed)?;
    let mut construction: Construction = b.construction();
    let own = construction.added.iter().chain(&construction.cut).filter_map(|piece| piece.chord);
    let serves = |chord: Chord| {
        let share = coarse.tolerance_mm() / chord.tolerance_mm();
        (1.0..MUCH_FINER).contains(&share)
    };
    let meshed;
    let mesh = match made.filter(|_| own.chain([b.chord]).all(serves)) {
        Some(mesh) => mesh,
        None => {
            for piece in construction.added.iter_mut().chain(&mut construction.cut) {
                piece.chord = None;
            }
            meshed = construction.solid(coarse).map_err(failed)?.to_mesh();
            &meshed
        }
    };
    let target = RayTarget::new(mesh);
    // Facets of one plane share most of their corners: each is looked at from once.
    let mut looked = HashSet::new();
    let (skin, search) = (1e-3 * limit, SEARCH * limit);
    for (indices, [p, q, r]) in mesh.triangles.iter().zip(mesh.iter_mm()) {
        let Some(normal) = (q - p).cross(r - p).try_normalize() else { continue };
        let middle = (p + q + r) / 3.0;
        let facing = (normal * SAME_PLANE).to_array().map(|x| x.round() as i64);
        let corners = indices.iter().zip([p, q, r]).filter(|(index, _)| looked.insert((**index, facing)));
        for corner in corners.map(|(_, corner)| corner).chain([middle]) {
            // A little inside the facet: no ray runs along its neighbours.
            let inwards = middle - corner;
            let point = corner + inwards * (skin / inwards.length().max(skin)).min(0.25);
            let from = point - normal * skin;
            let Some((fraction, other)) = target.first_hit(from, point - normal * search) else { continue };
            if normal.dot(other) > OPPOSITE {
                continue;
            }
            let seen = skin + fraction * (search - skin);
            let to = (point - normal * seen, other);
            let wall = exact(b, Wall { from: (point, normal), to, thickness: seen, facet: middle }, limit);
            if wall.thickness >= limit * (1.0 - 2.0 * FINE_SHARE) {
                continue;
            }
            let (one, two) = (face_at(b, (wall.facet, wall.from.1)), face_at(b, wall.to));
            let at = wall.from.0;
            let place = format!(
                "wall between {} and {} at ({:.2}, {:.2}, {:.2})",
                one.piece.name, two.piece.name, at.x, at.y, at.z
            );
            let fault = b.infeasible(place, wall.thickness, limit, fields(one, two));
            thin.add([one.kind, two.kind], wall.thickness, fault);
        }
    }
    Ok(())
}

/// The same wall between the exact surfaces: each end is brought to the nearest point of its own surface, in turn
/// with the other, until they rest. Flat facets are exact as they are. Where it leads elsewhere (off the part of
/// the surface that is left), the measured wall stands.
fn exact(b: &Blueprint, seen: Wall, limit: f64) -> Wall {
    const ROUNDS: u32 = 24;
    let curved = |side: (DVec3, DVec3)| {
        let piece = &face_at(b, side).piece;
        match &piece.shape {
            Shape::Prism { corner_radius_mm, .. } if *corner_radius_mm == 0.0 => None,
            _ => Some(piece),
        }
    };
    let sides = [(seen.from, curved((seen.facet, seen.from.1))), (seen.to, curved(seen.to))];
    if sides.iter().all(|(_, piece)| piece.is_none()) {
        // From a corner straight to the other plane.
        let thickness = (seen.from.0 - seen.to.0).dot(seen.to.1).abs();
        return Wall { thickness, ..seen };
    }
    let nearest = |((at, normal), piece): ((DVec3, DVec3), Option<&Piece>), other: DVec3| match piece {
        Some(piece) => piece.nearest_mm(other),
        None => other - normal * (other - at).dot(normal),
    };
    let (mut from, mut to) = (seen.from.0, seen.to.0);
    for _ in 0..ROUNDS {
        let before = (from, to);
        from = nearest(sides[0], to);
        to = nearest(sides[1], from);
        if from.distance(before.0) + to.distance(before.1) < 1e-6 * limit {
            break;
        }
    }
    let strayed = from.distance(seen.from.0).max(to.distance(seen.to.0)) > 0.25 * limit;
    if strayed || !from.is_finite() || !to.is_finite() {
        return seen;
    }
    Wall { thickness: from.distance(to), ..seen }
}

/// The feature whose exact surface is nearest to a point, among those that face the same way there or the
/// opposite one.
fn face_at(b: &Blueprint, (point, normal): (DVec3, DVec3)) -> &Feature {
    const ALIKE: f64 = 0.85;
    let off = |f: &Feature| {
        let distance = |p: DVec3| f.piece.signed_distance_mm(p);
        let h = 1e-6 * point.abs().max_element().max(1.0);
        let along = (distance(point + normal * h) - distance(point - normal * h)).abs() / (2.0 * h);
        let penalty = if along < ALIKE { f64::MAX } else { 0.0 };
        distance(point).abs() + penalty
    };
    let all = b.cut.iter().chain(&b.added);
    // A part has at least one piece of material.
    all.min_by(|x, y| off(x).total_cmp(&off(y))).unwrap_or(&b.added[0])
}
