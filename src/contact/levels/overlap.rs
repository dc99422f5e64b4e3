//! The part of the dome that lies inside an object, sampled.

use glam::DVec3;

use crate::object::{FIRST_LOOK, Placed, deepest, first_looks, look_spacing_mm};
use crate::outcome::TouchedNode;
use domecast_optics::DomeShape;

/// The foundation's constant, 4 sqrt 2 / (3 pi): see the module.
pub(crate) const FOUNDATION: f64 = 4.0 * std::f64::consts::SQRT_2 / (3.0 * std::f64::consts::PI);

/// The touched region, sampled.
#[derive(Debug, Clone, Default)]
pub(crate) struct Overlap {
    /// Deepest point of the undeformed dome, and the signed distance there.
    pub deepest_mm: DVec3,
    pub distance_mm: f64,
    /// Samples inside the object: place, area, push-out, the object's outward direction.
    pub samples: Vec<(DVec3, f64, f64, DVec3)>,
    /// Touched area by the push-out's moments, mm2.
    pub area_mm2: f64,
    /// Half angle of the cap about the deepest point that holds the samples, rad.
    pub angle_rad: f64,
    /// Distances asked for.
    pub queries: usize,
    /// Whether every sample found its way out.
    pub all_out: bool,
}

/// Samples of the touched cap.
const RINGS: usize = 24;
const SPOKES: usize = 48;

/// Samples the part of the dome that lies inside the object.
pub(crate) fn overlap(placed: &Placed, radius: f64) -> Overlap {
    let (deepest_mm, distance_mm, queries) = deepest(placed, DomeShape::hemisphere(radius));
    let mut found = Overlap { deepest_mm, distance_mm, queries, all_out: true, ..Default::default() };
    if distance_mm >= 0.0 {
        return found;
    }
    if placed.solid.is_mesh() {
        found.deepest_mm = pressed_middle(placed, radius);
        found.queries += FIRST_LOOK;
    }
    let axis = found.deepest_mm / radius;
    let (u, v) = axis.any_orthonormal_pair();
    let azimuths: [(f64, f64); SPOKES] =
        std::array::from_fn(|k| ((k as f64 + 0.5) * std::f64::consts::TAU / SPOKES as f64).sin_cos());
    let spokes = azimuths.map(|(sine, cosine)| u * cosine + v * sine);
    let high = touched_edge_rad(placed, radius, deepest_mm, axis, &spokes);
    let cap = (1.02 * high).min(std::f64::consts::PI);
    found.queries += FIRST_LOOK + (RINGS + 30) * (SPOKES / 2);
    let (mut first, mut second) = (0.0, 0.0);
    for ring in 0..RINGS {
        // Rings of equal width; each sample stands for its exact share of the sphere.
        let (low, high) = (cap * ring as f64 / RINGS as f64, cap * (ring + 1) as f64 / RINGS as f64);
        let area = radius * radius * (low.cos() - high.cos()) * std::f64::consts::TAU / SPOKES as f64;
        let (sine, cosine) = (0.5 * (low + high)).sin_cos();
        for spoke in &spokes {
            let direction = axis * cosine + *spoke * sine;
            if direction.z < 0.0 {
                continue;
            }
            let at = direction * radius;
            found.queries += 1;
            let here = placed.distance(at);
            let inside_mm = -here.0;
            if inside_mm <= 0.0 {
                continue;
            }
            found.queries += 4;
            match placed.walk_on(here, at, -direction, radius) {
                Some((way, outward)) => {
                    let way = way.min(STEEPEST * inside_mm);
                    found.samples.push((at, area, way, outward));
                    first += way * area;
                    second += way * way * area;
                    found.angle_rad = high;
                }
                None => found.all_out = false,
            }
        }
    }
    if second > 0.0 {
        found.area_mm2 = 4.0 / 3.0 * first * first / second;
    }
    if placed.solid.is_mesh() {
        found.distance_mm = -found.samples.iter().map(|(_, _, way, _)| *way).fold(0.0, f64::max);
    }
    found
}

/// Angle about an axis of the cap that holds every touched look, to the last bit of a bisection.
fn touched_edge_rad(
    placed: &Placed,
    radius: f64,
    deepest_mm: DVec3,
    axis: DVec3,
    spokes: &[DVec3; SPOKES],
) -> f64 {
    // The cap that holds every touched look, then the same cap looked at closely.
    let (center, reach) = placed.solid.bounding_sphere();
    let center = placed.sensor_from_object().point(center);
    let dome = DomeShape::hemisphere(radius);
    let coarse = first_looks(dome)
        .filter(|at_mm| at_mm.distance(center) < reach && placed.distance(*at_mm).0 < 0.0)
        .chain([deepest_mm])
        .map(|at_mm| at_mm.dot(axis) / radius)
        .fold(1.0, f64::min)
        .clamp(-1.0, 1.0)
        .acos()
        + 1.5 * look_spacing_mm(dome) / radius;
    let touched = |angle: f64| {
        let (sine, cosine) = angle.sin_cos();
        spokes.iter().step_by(2).any(|spoke| {
            let d = axis * cosine + *spoke * sine;
            d.z >= 0.0 && placed.distance(d * radius).0 < 0.0
        })
    };
    let rings = (1..=RINGS).rev().find(|ring| touched(coarse * *ring as f64 / RINGS as f64)).unwrap_or(0);
    // The edge by bisection, so that the samples move smoothly with the object.
    let (mut low, mut high) =
        (coarse * rings as f64 / RINGS as f64, coarse * (rings + 1) as f64 / RINGS as f64);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if touched(middle) { low = middle } else { high = middle }
    }
    high
}

/// What presses on a sample is at most this often its distance from the object's surface. A face that is met head on
/// never comes near that; beside a steep wall, where a sample would enter the object at its whole depth, the
/// pressure rises over a quarter of the depth instead: forces then have no steps in the object's pose, on which no
/// search for a balance could end.
const STEEPEST: f64 = 4.0;

/// Middle of what is pressed by a body with edges. Its deepest point may jump from edge to edge with the least turn, and
/// the samples about it would with it; this one moves smoothly: the looks' mean, the deeper ones
/// counted more.
fn pressed_middle(placed: &Placed, radius: f64) -> DVec3 {
    /// Depth over which a look loses its weight, as a part of the radius.
    const SOFTNESS: f64 = 0.02;
    let looks: Vec<(f64, DVec3)> = first_looks(DomeShape::hemisphere(radius))
        .map(|at_mm| (placed.distance(at_mm).0 / (SOFTNESS * radius), at_mm))
        .collect();
    let smallest = looks.iter().map(|look| look.0).fold(f64::INFINITY, f64::min);
    let mean: DVec3 = looks.iter().map(|(value, d)| *d * (smallest - value).exp()).sum();
    mean.normalize_or(DVec3::Z) * radius
}

/// Pressures on the samples for a foundation of the modulus `k_mpa_per_mm`.
pub(crate) fn nodes_of(overlap: &Overlap, k_mpa_per_mm: f64) -> Vec<TouchedNode> {
    overlap
        .samples
        .iter()
        .map(|&(at_mm, area_mm2, way, outward)| {
            let pressure_mpa = k_mpa_per_mm * way;
            // Across a side wall the way out is not along the object's normal; the push still is.
            let force_n = outward * (pressure_mpa * area_mm2);
            TouchedNode {
                at_mm,
                area_mm2,
                force_n,
                pressure_mpa,
                place_mm: at_mm,
                inward: outward,
                sticks: false,
            }
        })
        .collect()
}
