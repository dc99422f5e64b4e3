//! Where the undeformed dome lies deepest in an object.

use std::sync::LazyLock;

use glam::{DVec2, DVec3};

use super::placed::Placed;
use domecast_optics::DomeShape;

/// Places scattered evenly over the dome (a golden-angle spiral), for the first look, mm.
pub(crate) fn first_looks(dome: DomeShape) -> impl Iterator<Item = DVec3> {
    static SPIRAL: LazyLock<Vec<DVec2>> = LazyLock::new(|| {
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        (0..FIRST_LOOK).map(|i| DVec2::from_angle(golden * i as f64)).collect()
    });
    let below = 1.0 - dome.rim_level();
    SPIRAL.iter().enumerate().map(move |(i, aside)| {
        // Equal steps of the height bound equal areas.
        let level = 1.0 - below * ((i as f64 + 0.5) / FIRST_LOOK as f64);
        let out = if level < 0.0 { 1.0 } else { (1.0 - level * level).sqrt() };
        dome.center_mm() + (*aside * out).extend(level) * dome.radius_mm()
    })
}

/// How many of them.
pub(crate) const FIRST_LOOK: usize = 400;

/// Distance of the first looks: side of a look's share of the dome, mm.
pub(crate) fn look_spacing_mm(dome: DomeShape) -> f64 {
    (dome.area_mm2() / FIRST_LOOK as f64).sqrt()
}
/// Looks from which the search goes on.
const STARTS: usize = 3;
/// Distances that one search may ask for; a search takes some two hundred, one along an edge of the object more.
const MAX_QUERIES: usize = 1_500;
/// Looks from which the search goes on are no nearer to each other than this part of the radius.
const APART: f64 = 0.245;
/// Turn of the searched directions from step to step, rad: the golden angle, so that one of them soon lies along an
/// edge on which the others only creep.
const SEARCH_TURN: f64 = 2.399_963_229_728_653;

/// Deepest point of the dome in the object: first look, then a pattern search from the best looks.
pub(crate) fn deepest(placed: &Placed, dome: DomeShape) -> (DVec3, f64, usize) {
    let (center, reach) = placed.solid.bounding_sphere();
    let center = placed.sensor_from_object().point(center);
    let nearest_possible = dome.distance_mm(center) - reach;
    let towards_mm = dome.nearest_mm(center);
    let mut queries = 1;
    if nearest_possible > 0.0 {
        return (towards_mm, nearest_possible, queries);
    }
    if placed.solid.is_ball() {
        return (towards_mm, placed.distance(towards_mm).0, queries);
    }
    // The deepest place lies within a look's own room of one of them, and no distance changes by more than the way.
    let room = look_spacing_mm(dome);
    let mut best = placed.distance(towards_mm).0;
    let mut looks = vec![(best, towards_mm)];
    for at_mm in first_looks(dome) {
        if at_mm.distance(center) - reach < best + room {
            let value = placed.distance(at_mm).0;
            best = best.min(value);
            looks.push((value, at_mm));
            queries += 1;
        }
    }
    looks.retain(|look| look.0 <= best + room);
    looks.sort_by(|a, b| a.0.total_cmp(&b.0));
    let apart_mm = APART * dome.radius_mm();
    let mut starts: Vec<(f64, DVec3)> = Vec::new();
    for look in looks {
        if starts.len() < STARTS && starts.iter().all(|other| other.1.distance(look.1) > apart_mm) {
            starts.push(look);
        }
    }
    let mut best = (f64::INFINITY, dome.pole_mm());
    for start in starts {
        let (value, at_mm, asked) = descend(placed, dome, start, 0.08);
        queries += asked;
        if value < best.0 {
            best = (value, at_mm);
        }
    }
    (best.1, best.0, queries)
}

/// The deepest point near another one.
pub(crate) fn deepest_from(placed: &Placed, dome: DomeShape, near_mm: DVec3) -> (DVec3, f64, usize) {
    let (value, at_mm, queries) = descend(placed, dome, (placed.distance(near_mm).0, near_mm), 0.02);
    (at_mm, value, queries + 1)
}

/// Pattern search on the dome, from a step in parts of the radius: distance, place, distances asked for.
fn descend(
    placed: &Placed,
    dome: DomeShape,
    (mut value, mut at_mm): (f64, DVec3),
    mut step: f64,
) -> (f64, DVec3, usize) {
    let mut queries = 0;
    while step > 1e-7 && queries < MAX_QUERIES {
        let (u, v) = dome.normal(at_mm).any_orthonormal_pair();
        let (sine, cosine) = (SEARCH_TURN * (queries / 4) as f64).sin_cos();
        let (u, v) = (u * cosine + v * sine, v * cosine - u * sine);
        let tries = [u, v, -u, -v].map(|way| {
            let there_mm = dome.nearest_mm(at_mm + way * (step * dome.radius_mm()));
            (placed.distance(there_mm).0, there_mm)
        });
        queries += 4;
        let found = tries.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        match found {
            Some((lower, there_mm)) if lower < value => (value, at_mm) = (lower, there_mm),
            _ => step *= 0.5,
        }
    }
    (value, at_mm, queries)
}
