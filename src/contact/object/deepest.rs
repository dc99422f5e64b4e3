//! Where the undeformed dome lies deepest in an object.

use std::sync::LazyLock;

use glam::DVec3;

use super::placed::Placed;

/// Scattered directions over the hemisphere (a golden-angle spiral), for the first look.
pub(crate) fn first_looks() -> impl Iterator<Item = DVec3> {
    static SPIRAL: LazyLock<Vec<DVec3>> = LazyLock::new(|| {
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let place = |i: usize| {
            let z = 1.0 - (i as f64 + 0.5) / FIRST_LOOK as f64;
            let (sine, cosine) = (golden * i as f64).sin_cos();
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * cosine, r * sine, z)
        };
        (0..FIRST_LOOK).map(place).collect()
    });
    SPIRAL.iter().copied()
}

/// How many of them.
pub(crate) const FIRST_LOOK: usize = 400;

/// Distance of the first looks, rad: side of a look's share of the hemisphere.
pub(crate) fn look_spacing() -> f64 {
    (std::f64::consts::TAU / FIRST_LOOK as f64).sqrt()
}
/// Looks from which the search goes on.
const STARTS: usize = 3;
/// Distances that one search may ask for; a search takes some two hundred, one along an edge of the object more.
const MAX_QUERIES: usize = 1_500;
/// Turn of the searched directions from step to step, rad: the golden angle, so that one of them soon lies along an
/// edge on which the others only creep.
const SEARCH_TURN: f64 = 2.399_963_229_728_653;

/// Deepest point of the dome in the object: first look, then a pattern search from the best looks.
pub(crate) fn deepest(placed: &Placed, radius: f64) -> (DVec3, f64, usize) {
    let (center, reach) = placed.solid.bounding_sphere();
    let center = placed.sensor_from_object().point(center);
    let nearest_possible = center.length() - reach - radius;
    let towards = {
        let d = center.normalize_or(DVec3::Z);
        DVec3::new(d.x, d.y, d.z.max(0.0)).normalize_or(DVec3::Z)
    };
    let mut queries = 1;
    if nearest_possible > 0.0 {
        return (towards * radius, nearest_possible, queries);
    }
    if placed.solid.is_ball() {
        return (towards * radius, placed.distance(towards * radius).0, queries);
    }
    // The deepest place lies within a look's own room of one of them, and no distance changes by more than the way.
    let room = radius * look_spacing();
    let mut best = placed.distance(towards * radius).0;
    let mut looks = vec![(best, towards)];
    for direction in first_looks() {
        let at = direction * radius;
        if at.distance(center) - reach < best + room {
            let value = placed.distance(at).0;
            best = best.min(value);
            looks.push((value, direction));
            queries += 1;
        }
    }
    looks.retain(|look| look.0 <= best + room);
    looks.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut starts: Vec<(f64, DVec3)> = Vec::new();
    for look in looks {
        if starts.len() < STARTS && starts.iter().all(|other| other.1.dot(look.1) < 0.97) {
            starts.push(look);
        }
    }
    let mut best = (f64::INFINITY, DVec3::Z);
    for start in starts {
        let (value, direction, asked) = descend(placed, radius, start, 0.08);
        queries += asked;
        if value < best.0 {
            best = (value, direction);
        }
    }
    (best.1 * radius, best.0, queries)
}

/// The deepest point near another one.
pub(crate) fn deepest_from(placed: &Placed, radius: f64, near_mm: DVec3) -> (DVec3, f64, usize) {
    let start = (placed.distance(near_mm).0, near_mm / radius);
    let (value, direction, queries) = descend(placed, radius, start, 0.02);
    (direction * radius, value, queries + 1)
}

/// Pattern search on the dome: distance, direction, distances asked for.
fn descend(
    placed: &Placed,
    radius: f64,
    (mut value, mut direction): (f64, DVec3),
    mut step: f64,
) -> (f64, DVec3, usize) {
    let mut queries = 0;
    while step > 1e-7 && queries < MAX_QUERIES {
        let (u, v) = direction.any_orthonormal_pair();
        let (sine, cosine) = (SEARCH_TURN * (queries / 4) as f64).sin_cos();
        let (u, v) = (u * cosine + v * sine, v * cosine - u * sine);
        let tries = [u, v, -u, -v].map(|way| {
            let mut d = direction + way * step;
            d.z = d.z.max(0.0);
            let d = d.normalize_or(direction);
            (placed.distance(d * radius).0, d)
        });
        queries += 4;
        let found = tries.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        match found {
            Some((lower, d)) if lower < value => (value, direction) = (lower, d),
            _ => step *= 0.5,
        }
    }
    (value, direction, queries)
}
