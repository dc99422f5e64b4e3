//! A pattern that follows its boundary: even spacing up to the edge, with no row cut and none crowded.
//!
//! The dots push each other along the edges of their Delaunay triangulation like bars under pressure, and
//! the boundary holds them in (P.-O. Persson and G. Strang, "A Simple Mesh Generator in MATLAB", SIAM Review
//! 46(2), 2004, with a uniform size). The start is a hexagonal lattice inside and an evenly divided row on
//! the boundary, so that only the zone between the two has to find its places.
//!
//! A lattice does not fit into a round edge: between the two some strain is left, which the pressure spreads. How much
//! depends on where the rest is found, so that small patterns are started in several ways and the most even one is
//! kept. Dots pressed until they touch like coins would have equal nearest distances, but holes as wide as 1.4
//! spacings between them; the pressure here keeps them below 1.2, and the nearest distances within 4 to 5 %.

use std::f64::consts::TAU;

use glam::DVec2;
use rayon::prelude::*;

use super::boundary::Boundary;
use super::neighbors::delaunay_edges;
use super::pattern::Pattern;
use crate::spec::sections::CentredOn;

/// Bars are under pressure up to this multiple of the length that would fill the area.
const PRESSURE: f64 = 1.2;
/// Share of the force by which a dot moves in one step; stable up to about 0.3.
const STEP: f64 = 0.2;
/// Bound on the steps. The motion has died down to the tolerance after 50 to 200.
const MAX_STEPS: u32 = 400;
/// The dots are at rest when none moves by more than this share of the pitch in a step.
const AT_REST: f64 = 2e-4;
/// The triangulation is updated when a dot has moved by this share of the pitch since the last one.
const RETRIANGULATE: f64 = 0.1;
/// Ways to start: lattice places nearer to the boundary than this share of the pitch give way to the boundary's own
/// row, which has so many dots fewer than fit. Half a row's distance (0.433) on both sides would be even; the pressure
/// evens out the rest.
const STARTS: [Start; 5] = [
    Start { margin: 0.5, fewer: 0 },
    Start { margin: 0.5, fewer: 1 },
    Start { margin: 0.35, fewer: 0 },
    Start { margin: 0.35, fewer: 1 },
    Start { margin: 0.65, fewer: 1 },
];
/// Larger patterns are started in the first way only: their rim is a small part of them.
const MAX_RESTARTED: usize = 2000;

/// A way to start.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Start {
    margin: f64,
    fewer: usize,
}

/// The places of a relaxed filling of the edge, px from the centre.
pub(super) fn relaxed(pattern: &Pattern, edge: &Boundary) -> Vec<DVec2> {
    let pitch = pattern.pitch_px;
    let first = seeds(pattern, edge);
    let mut starts = vec![first];
    if starts[0].len() <= MAX_RESTARTED {
        for start in &STARTS[1..] {
            let places = seeds_of(pattern, edge, *start);
            // A number that is wanted is kept.
            let fits = pattern.wanted.is_none() || places.len() == starts[0].len();
            if fits && !places.is_empty() && !starts.contains(&places) {
                starts.push(places);
            }
        }
    }
    let rest = |mut places: Vec<DVec2>| {
        // The dot at the centre stays there.
        let held = match pattern.centred_on {
            CentredOn::Dot => places.iter().position(|place| place.length() < 1e-9 * pitch),
            CentredOn::Gap => None,
        };
        relax(&mut places, held, edge, pitch);
        let uneven = if places.len() <= MAX_RESTARTED { unevenness(&places) } else { 0.0 };
        (uneven, places)
    };
    let relaxed: Vec<(f64, Vec<DVec2>)> = starts.into_par_iter().map(rest).collect();
    // The first of equals, whichever was ready first.
    let best = relaxed.into_iter().reduce(|best, next| if next.0 < best.0 { next } else { best });
    best.map_or(Vec::new(), |(_, places)| places)
}

/// Standard deviation over mean of the distances to the nearest place.
fn unevenness(places: &[DVec2]) -> f64 {
    let mut nearest = vec![f64::INFINITY; places.len()];
    for [a, b] in delaunay_edges(places) {
        let (a, b) = (a as usize, b as usize);
        let length = places[a].distance(places[b]);
        nearest[a] = nearest[a].min(length);
        nearest[b] = nearest[b].min(length);
    }
    let mean = nearest.iter().sum::<f64>() / nearest.len() as f64;
    let variance = nearest.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / nearest.len() as f64;
    // Two places or fewer are as even as can be.
    if variance.is_finite() { variance.sqrt() / mean } else { 0.0 }
}

/// Where the relaxation starts, in the first way.
pub(super) fn seeds(pattern: &Pattern, edge: &Boundary) -> Vec<DVec2> {
    seeds_of(pattern, edge, STARTS[0])
}

fn seeds_of(pattern: &Pattern, edge: &Boundary, start: Start) -> Vec<DVec2> {
    let pitch = pattern.pitch_px;
    let inner = edge.inset(start.margin * pitch);
    let mut places: Vec<DVec2> = pattern
        .unit_lattice(edge.largest_px() / pitch)
        .into_iter()
        .map(|place| place * pitch)
        .filter(|place| inner.contains(*place) && inner.largest_px() > 0.0)
        .collect();
    let row = row_on(edge, pitch, pattern.rotation_rad, start.fewer);
    if let Some(wanted) = pattern.wanted {
        thin_edge(&mut places, (wanted.saturating_sub(row.len())).max(1), edge);
    }
    places.extend(row);
    places
}

/// Leaves `wanted` places, taking every third from those nearest to the edge, where the lattice meets the
/// boundary's row and has to find new places anyway.
fn thin_edge(places: &mut Vec<DVec2>, wanted: usize, edge: &Boundary) {
    let surplus = places.len().saturating_sub(wanted);
    let from_edge = |place: &DVec2| (1e6 * (edge.radius_px(*place) - place.length())).round() as i64;
    places.sort_by_cached_key(from_edge);
    let step = if 3 * surplus <= places.len() { 3 } else { 1 };
    let mut index = 0;
    places.retain(|_| {
        index += 1;
        index > step * surplus || index % step != 0
    });
}

/// Places on the boundary, evenly divided along it, as many as the pitch asks for or a few less.
fn row_on(edge: &Boundary, pitch: f64, start_rad: f64, fewer: usize) -> Vec<DVec2> {
    let polygon: Vec<DVec2> = (0..=1440)
        .map(|k| DVec2::from_angle(start_rad + TAU * f64::from(k) / 1440.0))
        .map(|direction| direction * edge.radius_px(direction))
        .collect();
    let mut reached = Vec::with_capacity(polygon.len());
    let mut length = 0.0;
    for (i, corner) in polygon.iter().enumerate() {
        length += if i == 0 { 0.0 } else { corner.distance(polygon[i - 1]) };
        reached.push(length);
    }
    // Two dots face each other on an edge too short for three.
    let count = (length / pitch).round() - fewer as f64;
    if count < 2.0 {
        return Vec::new();
    }
    (0..count as usize)
        .map(|k| {
            let at = length * k as f64 / count;
            let i = reached.partition_point(|r| *r <= at).clamp(1, polygon.len() - 1);
            let share = (at - reached[i - 1]) / (reached[i] - reached[i - 1]).max(f64::MIN_POSITIVE);
            let direction = polygon[i - 1].lerp(polygon[i], share).normalize_or(DVec2::X);
            direction * edge.radius_px(direction)
        })
        .collect()
}

fn relax(places: &mut [DVec2], held: Option<usize>, edge: &Boundary, pitch: f64) {
    let mut bars: Vec<[u32; 2]> = Vec::new();
    let mut triangulated: Vec<DVec2> = Vec::new();
    let mut force = vec![DVec2::ZERO; places.len()];
    for _ in 0..MAX_STEPS {
        let moved = |(now, then): (&DVec2, &DVec2)| now.distance(*then) > RETRIANGULATE * pitch;
        if triangulated.is_empty() || places.iter().zip(&triangulated).any(moved) {
            bars = delaunay_edges(places);
            triangulated = places.to_vec();
        }
        if bars.is_empty() {
            return;
        }
        let squares: f64 =
            bars.iter().map(|[a, b]| places[*a as usize].distance_squared(places[*b as usize])).sum();
        let wanted = PRESSURE * (squares / bars.len() as f64).sqrt();
        force.fill(DVec2::ZERO);
        for [a, b] in &bars {
            let bar = places[*a as usize] - places[*b as usize];
            let length = bar.length();
            if length < wanted && length > 0.0 {
                let push = bar * ((wanted - length) / length);
                force[*a as usize] += push;
                force[*b as usize] -= push;
            }
        }
        let mut furthest: f64 = 0.0;
        for (i, place) in places.iter_mut().enumerate() {
            if held == Some(i) {
                continue;
            }
            let mut next = *place + force[i] * STEP;
            let radius = edge.radius_px(next);
            if next.length() > radius {
                next = next.normalize_or(DVec2::X) * radius;
            }
            furthest = furthest.max(next.distance(*place));
            *place = next;
        }
        if furthest < AT_REST * pitch {
            return;
        }
    }
}
