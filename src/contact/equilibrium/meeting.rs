//! Whether two objects lie in each other.

use glam::DVec3;

use crate::object::Placed;

/// Steps of the search for a place inside both.
const MAX_STEPS: u32 = 200;
/// Objects that touch lie in each other by rounding; this part of the dome's radius is more.
const MIN_DEPTH: f64 = 1e-4;

/// How deep two objects lie in each other at least, mm; `None` where no place was found inside both. The search goes from
/// places that are asked about into whichever object is farther, in turn (projections onto convex sets, L. M. Bregman,
/// Sov. Math. Dokl. 6, 1965): for convex objects it finds such a place where there is one.
pub(super) fn common_depth_mm(a: &Placed, b: &Placed, from_mm: &[DVec3], radius_mm: f64) -> Option<f64> {
    if let (Some((p, r)), Some((q, s))) = (a.ball(), b.ball()) {
        let depth_mm = r + s - p.distance(q);
        return (depth_mm > MIN_DEPTH * radius_mm).then_some(depth_mm);
    }
    let ball_of = |placed: &Placed| {
        let (center, reach_mm) = placed.solid.bounding_sphere();
        (placed.sensor_from_object().point(center), reach_mm)
    };
    let ((p, r), (q, s)) = (ball_of(a), ball_of(b));
    if p.distance(q) >= r + s {
        return None;
    }
    let starts = [p, q, p.lerp(q, r / (r + s))];
    let deepest = |start: DVec3| {
        let (mut at, mut deepest) = (start, f64::NEG_INFINITY);
        for step in 0..MAX_STEPS {
            let (to_a, to_b) = (a.distance(at), b.distance(at));
            let (far, outward) = if to_a.0 > to_b.0 { to_a } else { to_b };
            deepest = deepest.max(-far);
            // Onto the surface of the farther one, then deeper by less and less.
            let deeper_mm = 0.5 * radius_mm / f64::from(step + 2);
            at -= outward * if far > 0.0 { far } else { deeper_mm };
        }
        deepest
    };
    let depth_mm =
        starts.iter().chain(from_mm).map(|start| deepest(*start)).fold(f64::NEG_INFINITY, f64::max);
    (depth_mm > MIN_DEPTH * radius_mm).then_some(depth_mm)
}
