//! How even a pattern is: in the image, on the dome, on the plate; and what is left of it when the sensor is
//! not as designed, or the layout was made by the pinhole alone.

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use serde::Serialize;

use super::Layout;
use super::chance::Chance;
use super::spec::LayoutSpec;
use crate::design::sections::TolerancesSection;
use crate::numeric::Rigid;
use crate::optics::{OpticsSpec, SensorOptics};

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
    /// On the plate, between dots of one hit, mm.
    pub plate_mm: Option<Evenness>,
}

/// The same pattern laid out as if nothing refracted, seen through the real stack.
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
    /// Dots that would not be seen, or not hit the dome.
    pub lost: usize,
}

/// What tolerances do to a pattern.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ToleranceReport {
    /// Sensors drawn.
    pub samples: usize,
    /// Sensors of which a dot could not be seen; they count in no figure.
    pub blind: usize,
    /// Variation of the nearest distances in the image that half of the sensors keep to.
    pub nearest_variation_median: f64,
    /// The one that 19 of 20 keep to.
    pub nearest_variation_p95: f64,
    /// Mean distance of a dot from its place in the image, px: over dots and sensors.
    pub mean_shift_px: f64,
    /// Each tolerance alone, the worst first.
    pub ranking: Vec<ToleranceShare>,
}

/// What one tolerance does alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ToleranceShare {
    /// Its field in the design's `tolerances`.
    pub tolerance: &'static str,
    /// Mean variation of the nearest distances in the image beyond the design's own, as the root of the
    /// difference of squares.
    pub added_variation: f64,
    /// Mean distance of a dot from its place, px.
    pub mean_shift_px: f64,
}

/// The tolerances in a fixed order.
const TOLERANCES: [&str; 8] = [
    "pupil_mm",
    "camera_rotation_deg",
    "dome_radius_mm",
    "layer_thickness_mm",
    "index",
    "print_registration_mm",
    "print_rotation_deg",
    "print_scatter_mm",
];

/// Sensors for each entry of the ranking, at most.
const RANKING_SAMPLES: u32 = 48;

/// A gap between layers that would be negative is closed; the pupil stays this far under the sheet, mm.
const LEAST_AIR_MM: f64 = 1e-6;

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
    let lengths = |i: usize| {
        let near = layout.dots[i].neighbors.iter().map(|j| *j as usize).filter(move |j| *j != i);
        let near = near.filter(|j| together(i, *j));
        near.filter_map(|j| Some((j, distance(places[i]?, places[j]?)))).collect::<Vec<_>>()
    };
    let all: Vec<Vec<(usize, f64)>> = (0..layout.dots.len()).map(lengths).collect();
    let nearest = all.iter().filter(|list| !list.is_empty());
    let nearest = spread(nearest.map(|list| list.iter().map(|(_, d)| *d).fold(f64::INFINITY, f64::min)))?;
    let edges = all.iter().enumerate().flat_map(|(i, list)| list.iter().filter(move |(j, _)| *j > i));
    Some(Evenness { nearest, edges: spread(edges.map(|(_, d)| *d))? })
}

fn in_plane(a: DVec2, b: DVec2) -> f64 {
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
        plate_mm: evenness(layout, &plate, in_plane, |i, j| dots[i].hit == dots[j].hit),
    })
}

/// The same pattern laid out by the pinhole alone: the rays of the pattern's pixels, by the same lens, go
/// straight to the dome as if every index were 1. What the real stack shows of dots placed there.
pub fn by_pinhole(spec: &LayoutSpec, layout: &Layout) -> Option<PinholeComparison> {
    let mut clear = spec_of(&spec.optics);
    for layer in &mut clear.layers {
        layer.index = [1.0; 3];
    }
    let clear = SensorOptics::new(&clear).ok()?;
    let placed: Vec<Option<DVec3>> =
        layout.dots.iter().map(|dot| clear.trace(dot.image_px).ok().map(|hit| hit.surface_mm)).collect();
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

/// Draws sensors within the tolerances and tells what evenness to expect, and which tolerance hurts most.
pub fn under_tolerances(
    spec: &LayoutSpec,
    layout: &Layout,
    tolerances: &TolerancesSection,
) -> Option<ToleranceReport> {
    let image: Vec<_> = layout.dots.iter().map(|dot| Some(dot.image_px)).collect();
    let own = evenness(layout, &image, in_plane, |_, _| true)?.nearest.variation;
    let draw = |only: Option<usize>, count: u32| -> Vec<Option<(f64, f64)>> {
        let stream = only.map_or(0, |index| index as u64 + 1) << 32;
        (0..count)
            .into_par_iter()
            .map(|sample| {
                let mut chance = Chance::new(tolerances.seed, stream + u64::from(sample));
                sensor(spec, layout, tolerances, only, &mut chance)
            })
            .collect()
    };
    let drawn = draw(None, tolerances.samples);
    let mut variations: Vec<f64> = drawn.iter().flatten().map(|(variation, _)| *variation).collect();
    variations.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = (share * variations.len() as f64) as usize;
        variations.get(index.min(variations.len().saturating_sub(1))).copied()
    };
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| (sum + value, count + 1));
        sum / count.max(1) as f64
    };
    let mut ranking: Vec<ToleranceShare> = (0..TOLERANCES.len())
        .map(|index| {
            let alone = draw(Some(index), tolerances.samples.min(RANKING_SAMPLES));
            let squares = mean(&mut alone.iter().flatten().map(|(variation, _)| variation * variation));
            ToleranceShare {
                tolerance: TOLERANCES[index],
                added_variation: (squares - own * own).max(0.0).sqrt(),
                mean_shift_px: mean(&mut alone.iter().flatten().map(|(_, shift)| *shift)),
            }
        })
        .collect();
    ranking.sort_by(|a, b| b.added_variation.total_cmp(&a.added_variation));
    Some(ToleranceReport {
        samples: drawn.len(),
        blind: drawn.iter().filter(|sample| sample.is_none()).count(),
        nearest_variation_median: at(0.5)?,
        nearest_variation_p95: at(0.95)?,
        mean_shift_px: mean(&mut drawn.iter().flatten().map(|(_, shift)| *shift)),
        ranking,
    })
}

/// One sensor: variation of the nearest distances in its image, and the mean shift of its dots, px. All
/// tolerances are drawn in the same order whether they count or not.
fn sensor(
    spec: &LayoutSpec,
    layout: &Layout,
    tolerances: &TolerancesSection,
    only: Option<usize>,
    chance: &mut Chance,
) -> Option<(f64, f64)> {
    let counts = |index: usize| f64::from(u8::from(only.is_none_or(|only| only == index)));
    let mut made = spec_of(&spec.optics);
    let shift = DVec3::from_array(tolerances.pupil_mm.map(|sd| sd * chance.normal())) * counts(0);
    let [a, b, c] = tolerances.camera_rotation_deg.map(|sd| sd.to_radians() * chance.normal() * counts(1));
    let turn = DMat3::from_rotation_z(c) * DMat3::from_rotation_y(b) * DMat3::from_rotation_x(a);
    let nominal_radius_mm = made.dome_radius_mm;
    made.dome_radius_mm = (nominal_radius_mm + tolerances.dome_radius_mm * chance.normal() * counts(2))
        .max(0.5 * nominal_radius_mm);
    let mut sheet_mm = 0.0;
    for layer in &mut made.layers {
        let thicker = tolerances.layer_thickness_mm * chance.normal() * counts(3);
        let denser = tolerances.index * chance.normal() * counts(4);
        if let Some(thickness) = &mut layer.thickness_mm {
            *thickness = (*thickness + thicker).max(0.0);
            sheet_mm += *thickness;
        }
        layer.index = layer.index.map(|index| (index + denser).max(1.0));
    }
    let place = &made.sensor_from_camera;
    let mut pupil_mm = place.translation_mm + shift;
    pupil_mm.z = pupil_mm.z.min(-sheet_mm - LEAST_AIR_MM);
    made.sensor_from_camera = Rigid::new(turn * place.rotation, pupil_mm);
    let optics = SensorOptics::new(&made).ok()?;

    // Each hit is registered anew.
    let moved: Vec<(DVec2, DVec2)> = layout
        .hits
        .iter()
        .map(|_| {
            let shift_mm = chance.normal_pair() * tolerances.print_registration_mm * counts(5);
            let turn = tolerances.print_rotation_deg.to_radians() * chance.normal() * counts(6);
            (shift_mm, DVec2::from_angle(turn))
        })
        .collect();
    let larger = made.dome_radius_mm / nominal_radius_mm;
    let seen: Option<Vec<Option<DVec2>>> = layout
        .dots
        .iter()
        .map(|dot| {
            let (shift_mm, turn) = *moved.get(dot.hit)?;
            let scatter_mm = chance.normal_pair() * tolerances.print_scatter_mm * counts(7);
            let plate_mm = turn.rotate(dot.plate_mm) + shift_mm + scatter_mm;
            let on_hit = layout.transfer.dome_from_plate(plate_mm).ok()?;
            let surface = layout.hits.get(dot.hit)?.hit_from_sensor.transpose() * on_hit * larger;
            Some(Some(optics.project(surface).ok()?))
        })
        .collect();
    let seen = seen?;
    let variation = evenness(layout, &seen, in_plane, |_, _| true)?.nearest.variation;
    let shifts =
        layout.dots.iter().zip(&seen).filter_map(|(dot, place)| Some(place.as_ref()?.distance(dot.image_px)));
    Some((variation, shifts.sum::<f64>() / layout.dots.len() as f64))
}

/// What a sensor's optics were made from.
fn spec_of(optics: &SensorOptics) -> OpticsSpec {
    OpticsSpec {
        lens: optics.lens().spec().clone(),
        sensor_from_camera: *optics.rest_from_camera(),
        layers: optics.layers()[1..].to_vec(),
        dome_radius_mm: optics.dome_radius_mm(),
    }
}
