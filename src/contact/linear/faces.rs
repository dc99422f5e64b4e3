//! Objects finer than the nodes of the dome: walls, edges and tips.
//!
//! A node sees the mean of the gap about it, and the plane that it may not pass is the object's nearest face where the
//! node is now. Neither does for a wall thinner than the nodes' distance, or beside an edge: the wall is met by some
//! nodes and missed by others, and its nearest face is a flank. Where that is so, the object is taken as the faces that
//! a look along its way into the dome shows, each place keeps the face that has come over it, and places between the
//! nodes take part ([`domecast_elastic::Compliance::places`]). The task is then convex: it has one answer, which follows the pose smoothly.
//! Flanks steeper than [`FACING`] do not push. Forces are those of the surface that the nodes carry: a pressure is a force
//! over a node's area, and less than that of an edge.

use std::collections::BTreeMap;

use glam::DVec3;

use super::candidate::{Face, hat_places};
use crate::object::Placed;
use domecast_elastic::Compliance;

/// A place between the nodes takes part where the object reaches deeper than the nodes tell by more than this part of
/// their distance. A ball does so where its radius is below 1.25 of them.
const UNSEEN: f64 = 0.1;
/// Balls of so many of the nodes' distances are looked at no closer.
const ROUND: f64 = 2.0;
/// Faces this far ahead of the dome take part as well, as a part of the nodes' distance: more than a pose may move
/// before all is looked at anew.
const AHEAD: f64 = 0.75;
/// Least cosine between a face's outward normal and the way into the dome.
const FACING: f64 = 0.3;

/// What takes part where an object is finer than the nodes: nodes and places by number, each with its face.
pub(crate) type Faces = BTreeMap<usize, Face>;

/// A face over a place: a point of it, its outward normal, and the place's signed distance.
#[derive(Clone, Copy)]
struct Over {
    at_mm: DVec3,
    normal: DVec3,
    gap_mm: f64,
}

/// Places no farther from an object than `ahead_mm`, with their numbers; the way into it, of no unit length; and the
/// distances asked for.
fn near_places(placed: &Placed, compliance: &Compliance, ahead_mm: f64) -> (Vec<(usize, DVec3)>, DVec3, f64) {
    let (grid, places) = (&compliance.grid, &compliance.places);
    let (mut near, mut queries) = (Vec::new(), 0.0);
    let mut inward = DVec3::ZERO;
    for row in places.rows(grid) {
        let mut k = 0;
        while k < row.count {
            let at_mm = places.place(grid, row.first + k);
            let (distance_mm, _) = placed.distance(at_mm);
            queries += 1.0;
            if distance_mm < 0.0 {
                inward -= grid.dome.outward_mm(at_mm) * row.area_mm2;
            }
            if distance_mm < ahead_mm {
                near.push((row.first + k, at_mm));
                k += 1;
            } else {
                // No place nearer than that is nearer to the object than asked for.
                k += (((distance_mm - ahead_mm) / row.step_mm) as usize).max(1);
            }
        }
    }
    (near, inward, queries)
}

/// The faces of an object over the dome, if it is finer than the nodes there; and the distances asked for.
pub(crate) fn fine(placed: &Placed, compliance: &Compliance) -> (Option<Faces>, f64) {
    let (grid, places) = (&compliance.grid, &compliance.places);
    let spacing_mm = grid.spacing_mm();
    if placed.ball().is_some_and(|(_, radius_mm)| radius_mm > ROUND * spacing_mm) {
        return (None, 0.0);
    }
    let ahead_mm = AHEAD * spacing_mm;
    let (near, inward, mut queries) = near_places(placed, compliance, ahead_mm);
    let Some(inward) = inward.try_normalize() else { return (None, queries) };
    let over = |at_mm: DVec3| -> Option<Over> {
        let start_mm = at_mm - inward * ahead_mm;
        let (walked_mm, normal) = placed.walk_out(start_mm, inward, grid.dome.radius_mm())?;
        let exit_mm = start_mm + inward * walked_mm;
        (walked_mm > 0.0 && normal.dot(inward) >= FACING).then(|| Over {
            at_mm: exit_mm,
            normal,
            gap_mm: normal.dot(at_mm - exit_mm),
        })
    };
    let mut nodes: BTreeMap<usize, Option<Over>> = BTreeMap::new();
    let mut faces: BTreeMap<usize, (DVec3, Over)> = BTreeMap::new();
    for (number, at_mm) in near {
        let (mut interpolated_mm, mut shares) = (0.0, 0.0);
        for &(node, share) in places.parts(grid, number).as_slice() {
            let seen = nodes.entry(node).or_insert_with(|| {
                queries += 8.0;
                over(grid.place(grid.node(node)))
            });
            interpolated_mm += share * seen.map_or(ahead_mm, |over| over.gap_mm);
            shares += share;
        }
        queries += 8.0;
        let Some(over) = over(at_mm) else { continue };
        if shares > 0.0 && interpolated_mm / shares - over.gap_mm > UNSEEN * spacing_mm {
            faces.insert(number, (at_mm, over));
        }
    }
    let mut is_fine = faces.values().any(|(_, over)| over.gap_mm < 0.0);
    for (number, seen) in nodes {
        let Some(seen) = seen else { continue };
        let node = grid.node(number);
        let hat = hat_places(grid.dome, grid.place(node), grid.spread(node));
        // What its hat tells of a node, a wall that runs over it does not show in.
        let interpolated_mm: f64 =
            hat.iter().map(|at_mm| over(*at_mm).map_or(0.25 * ahead_mm, |over| 0.25 * over.gap_mm)).sum();
        queries += 32.0;
        is_fine |= seen.gap_mm < 0.0 && interpolated_mm - seen.gap_mm > UNSEEN * spacing_mm;
        let middle_mm = hat.iter().map(|at_mm| *at_mm * 0.25).sum();
        faces.insert(number, (middle_mm, seen));
    }
    // What only lies ahead may not come to touch.
    if !is_fine {
        return (None, queries);
    }
    let object_from_sensor = placed.object_from_sensor();
    let face = |(from_mm, over): (DVec3, Over)| Face {
        at_object_mm: object_from_sensor.point(over.at_mm),
        normal_object: object_from_sensor.vector(over.normal),
        from_mm,
    };
    (Some(faces.into_iter().map(|(number, seen)| (number, face(seen))).collect()), queries)
}
