//! How even a pattern is: in the image, on the dome and on the plate; and the image of the same pattern if it is laid
//! out without refraction.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//! use domecast_design::layout::evenness::by_design;
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let layout = Design::load(THUMB24.as_ref())?.layout()?;
//! let evenness = by_design(&layout).ok_or("no dot has a neighbour")?;
//! assert!(evenness.image_px.nearest.variation < 0.1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use glam::{DVec2, DVec3};
use serde::Serialize;

use super::plan::Layout;
use super::spec::LayoutSpec;
use domecast_optics::SensorOptics;

/// A length's spread over a pattern.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// How many lengths.
    pub count: usize,
    /// The smallest.
    pub min: f64,
    /// The largest.
    pub max: f64,
    /// The mean.
    pub mean: f64,
    /// Standard deviation over mean.
    pub variation: f64,
}

/// Distances between neighbours in one place.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Evenness {
    /// From each dot to the nearest of its neighbours.
    pub nearest: Spread,
    /// Between all neighbours.
    pub edges: Spread,
}

/// How even a layout is by design.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EvennessReport {
    /// In the frame in which the pattern is defined, px.
    pub even_frame_px: Evenness,
    /// In the raw image, px.
    pub image_px: Evenness,
    /// Along the dome, mm.
    pub dome_mm: Evenness,
    /// On the plate, between dots of one print pass, mm.
    pub plate_mm: Option<Evenness>,
}

/// The same pattern laid out without refraction, seen through the real layers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PinholeComparison {
    /// Evenness that the camera would see, px.
    pub image_px: Evenness,
    /// Mean and largest distance between where a dot would be seen and where it was wanted, px.
    pub mean_shift_px: f64,
    /// The largest of them, px.
    pub max_shift_px: f64,
    /// Mean distance on the dome between the two places of a dot, mm.
    pub mean_shift_mm: f64,
    /// The largest of them, mm.
    pub max_shift_mm: f64,
    /// Dots that would not be seen, or whose ray misses the dome.
    pub lost: usize,
}

fn spread(lengths: impl Iterator<Item = f64>) -> Option<Spread> {
    let (mut count, mut sum, mut squares) = (0usize, 0.0, 0.0);
    let (mut min, mut max) = (f64::INFINITY, 0.0f64);
    let mut first = None;
    for length in lengths {
        // Sums about the first length keep their digits when all are nearly equal.
        let off = length - *first.get_or_insert(length);
        count += 1;
        sum += off;
        squares += off * off;
        min = min.min(length);
        max = max.max(length);
    }
    let off = sum / count as f64;
    let mean = first? + off;
    let variance = (squares / count as f64 - off * off).max(0.0);
    Some(Spread { count, min, max, mean, variation: variance.sqrt() / mean })
}

/// Distances over the layout's own neighbours, between whatever places the dots have; dots without a place are
/// passed over.
fn evenness<P: Copy>(
    layout: &Layout,
    places: &[Option<P>],
    distance: impl Fn(P, P) -> f64,
    together: impl Fn(usize, usize) -> bool,
) -> Option<Evenness> {
    evenness_of(layout, 0..layout.dots.len(), places, distance, together)
}

/// [`evenness`] around some of the dots.
pub(super) fn evenness_of<P: Copy>(
    layout: &Layout,
    chosen: impl Iterator<Item = usize>,
    places: &[Option<P>],
    distance: impl Fn(P, P) -> f64,
    together: impl Fn(usize, usize) -> bool,
) -> Option<Evenness> {
    let lengths = |i: usize| {
        let near = layout.dots[i].neighbors.iter().map(|j| *j as usize).filter(move |j| *j != i);
        let near = near.filter(|j| together(i, *j));
        near.filter_map(|j| Some((j, distance(places[i]?, places[j]?)))).collect::<Vec<_>>()
    };
    let all: Vec<(usize, Vec<(usize, f64)>)> = chosen.map(|i| (i, lengths(i))).collect();
    let nearest = all.iter().filter(|(_, list)| !list.is_empty());
    let nearest =
        spread(nearest.map(|(_, list)| list.iter().map(|(_, d)| *d).fold(f64::INFINITY, f64::min)))?;
    // Both ends of an edge list it; it counts at the lower end, or at each if only some dots are chosen, where
    // both ends rarely are.
    let some = all.len() < layout.dots.len();
    let edges = all.iter().flat_map(|(i, list)| list.iter().filter(move |(j, _)| some || *j > *i));
    Some(Evenness { nearest, edges: spread(edges.map(|(_, d)| *d))? })
}

pub(super) fn in_plane(a: DVec2, b: DVec2) -> f64 {
    a.distance(b)
}

/// How even a layout is by design; `None` where no dot has a neighbour.
pub fn by_design(layout: &Layout) -> Option<EvennessReport> {
    let radius_mm = layout.transfer.dome_radius_mm();
    let any = |_: usize, _: usize| true;
    let dots = &layout.dots;
    let even: Vec<_> = dots.iter().map(|dot| Some(dot.even_px)).collect();
    let image: Vec<_> = dots.iter().map(|dot| Some(dot.image_px)).collect();
    let dome: Vec<_> = dots.iter().map(|dot| Some(dot.normal)).collect();
    let plate: Vec<_> = dots.iter().map(|dot| Some(dot.plate_mm)).collect();
    let arc = |a: DVec3, b: DVec3| radius_mm * a.cross(b).length().atan2(a.dot(b));
    Some(EvennessReport {
        even_frame_px: evenness(layout, &even, in_plane, any)?,
        image_px: evenness(layout, &image, in_plane, any)?,
        dome_mm: evenness(layout, &dome, arc, any)?,
        plate_mm: evenness(layout, &plate, in_plane, |i, j| dots[i].pass == dots[j].pass),
    })
}

/// The same pattern laid out without refraction: the rays of the pattern's pixels, by the same lens, go straight to
/// the dome, every index 1. The image of the dots placed there, through the real layers.
pub fn by_pinhole(spec: &LayoutSpec, layout: &Layout) -> Option<PinholeComparison> {
    let mut clear = spec.optics.spec();
    for layer in &mut clear.layers {
        layer.index = [1.0; 3];
    }
    let clear = SensorOptics::new(&clear).ok()?;
    let placed: Vec<Option<DVec3>> =
        layout.dots.iter().map(|dot| clear.trace(dot.image_px).ok().map(|point| point.surface_mm)).collect();
    let seen: Vec<Option<DVec2>> =
        placed.iter().map(|point| point.and_then(|point| spec.optics.project(point).ok())).collect();
    let image_px = evenness(layout, &seen, in_plane, |_, _| true)?;
    let shifts = |dot: usize| {
        let (seen, placed) = (seen[dot]?, placed[dot]?);
        let dot = &layout.dots[dot];
        Some((seen.distance(dot.image_px), placed.distance(dot.surface_mm)))
    };
    let shifts: Vec<(f64, f64)> = (0..layout.dots.len()).filter_map(shifts).collect();
    let count = shifts.len() as f64;
    Some(PinholeComparison {
        image_px,
        mean_shift_px: shifts.iter().map(|s| s.0).sum::<f64>() / count,
        max_shift_px: shifts.iter().map(|s| s.0).fold(0.0, f64::max),
        mean_shift_mm: shifts.iter().map(|s| s.1).sum::<f64>() / count,
        max_shift_mm: shifts.iter().map(|s| s.1).fold(0.0, f64::max),
        lost: layout.dots.len() - shifts.len(),
    })
}
