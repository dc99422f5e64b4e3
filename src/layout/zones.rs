//! Zones of the raw image without dots: discs of the design, and the images of the white markers.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::lost::{Reason, Zone};
use super::outline::Outline;
use super::spec::LayoutSpec;

/// Points on the rim of a white marker.
const RIM_POINTS: u32 = 48;

/// A convex zone in the raw image with a margin around it.
#[derive(Debug, Clone)]
pub(super) struct ImageZone {
    reason: Reason,
    /// Corners in order; a single one is a disc's centre.
    corners: Vec<DVec2>,
    margin_px: f64,
}

/// The zones of a design. A white marker that the lens does not see makes none.
pub(super) fn image_zones(spec: &LayoutSpec) -> Vec<ImageZone> {
    let keep_out = &spec.pattern.keep_out;
    let mut zones = Vec::new();
    for marker in &spec.white_markers {
        let rim: Result<Vec<DVec2>, _> = (0..RIM_POINTS)
            .map(|k| {
                DVec2::from_angle(TAU * f64::from(k) / f64::from(RIM_POINTS)) * (0.5 * marker.diameter_mm)
            })
            .map(|out| spec.optics.project(marker.position_mm + DVec3::new(out.x, out.y, 0.0)))
            .collect();
        let Ok(corners) = rim else { continue };
        zones.push(ImageZone {
            reason: Reason::HiddenByMarker { marker: marker.id },
            corners: corners.clone(),
            margin_px: 0.0,
        });
        if let Some(margin_px) = keep_out.white_marker_margin_px {
            let reason = Reason::KeepOut(Zone::WhiteMarker(marker.id));
            zones.push(ImageZone { reason, corners, margin_px });
        }
    }
    for (index, disc) in (0u32..).zip(&keep_out.image_discs) {
        zones.push(ImageZone {
            reason: Reason::KeepOut(Zone::ImageDisc(index)),
            corners: vec![DVec2::from_array(disc.center_px)],
            margin_px: disc.radius_px,
        });
    }
    zones
}

/// Whether a dot's outline keeps clear of all zones.
pub(super) fn check(zones: &[ImageZone], outline: &Outline) -> Result<(), Reason> {
    if zones.is_empty() {
        return Ok(());
    }
    let dot = outline.polygon(4);
    match zones.iter().find(|zone| gap(&dot, &zone.corners) < zone.margin_px.max(f64::MIN_POSITIVE)) {
        None => Ok(()),
        Some(zone) => Err(zone.reason),
    }
}

/// Distance between two polygons; zero where they overlap. A polygon of one corner is a point.
pub(super) fn gap(a: &[DVec2], b: &[DVec2]) -> f64 {
    let overlap = a.first().is_some_and(|p| inside(*p, b)) || b.first().is_some_and(|p| inside(*p, a));
    if overlap {
        return 0.0;
    }
    let from_to = |points: &[DVec2], polygon: &[DVec2]| {
        let distances = points.iter().map(|p| distance(*p, polygon));
        distances.fold(f64::INFINITY, f64::min)
    };
    // The nearest places of two polygons that do not cross: a corner of one and a side of the other.
    from_to(a, b).min(from_to(b, a))
}

fn sides(polygon: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> + '_ {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().copied().zip(next.copied())
}

fn inside(point: DVec2, polygon: &[DVec2]) -> bool {
    let crossings = sides(polygon).filter(|(a, b)| {
        (a.y > point.y) != (b.y > point.y) && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x)
    });
    crossings.count() % 2 == 1
}

fn distance(point: DVec2, polygon: &[DVec2]) -> f64 {
    let to_side = |(a, b): (DVec2, DVec2)| {
        let side = b - a;
        let length2 = side.length_squared();
        let share = if length2 > 0.0 { ((point - a).dot(side) / length2).clamp(0.0, 1.0) } else { 0.0 };
        point.distance(a + side * share)
    };
    sides(polygon).map(to_side).fold(f64::INFINITY, f64::min)
}
