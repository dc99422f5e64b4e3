//! Zones of the raw image without dots: discs of the design, and the images of the white markers.
//!
//! Boxes are compared first: of a hundred thousand dots only those beside a zone are measured corner by corner.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::lost::{Reason, Zone};
use super::outline::Outline;
use super::spec::LayoutSpec;
use domecast_optics::SensorOptics;
use domecast_optics::pose::Marker;

/// Points on the rim of a white marker.
const RIM_POINTS: u32 = 48;

/// A convex zone in the raw image with a margin around it.
#[derive(Debug, Clone)]
pub(super) struct ImageZone {
    reason: Reason,
    /// Corners in order; a single one is a disc's centre.
    corners: Vec<DVec2>,
    margin_px: f64,
    /// Lowest and highest coordinates that the zone reaches, margin included.
    bounds: (DVec2, DVec2),
}

impl ImageZone {
    fn new(reason: Reason, corners: Vec<DVec2>, margin_px: f64) -> Self {
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (low, high) = corners.iter().fold(start, |(low, high), p| (low.min(*p), high.max(*p)));
        let bounds = (low - DVec2::splat(margin_px), high + DVec2::splat(margin_px));
        Self { reason, corners, margin_px, bounds }
    }

    /// Why a dot with these corners may not stand here, if it may not.
    fn refuses(&self, dot: &[DVec2], (low, high): (DVec2, DVec2)) -> Option<Reason> {
        let apart = low.cmpgt(self.bounds.1).any() || high.cmplt(self.bounds.0).any();
        let near = !apart && gap(dot, &self.corners) < self.margin_px.max(f64::MIN_POSITIVE);
        near.then_some(self.reason)
    }
}

/// The images of the white markers at the pose of `optics`. A marker that the lens does not see makes
/// none.
pub(super) fn marker_zones(optics: &SensorOptics, markers: &[Marker]) -> Vec<ImageZone> {
    let zone = |marker: &Marker| {
        let reason = Reason::HiddenByMarker { marker: marker.id };
        Some(ImageZone::new(reason, rim_px(optics, marker)?, 0.0))
    };
    markers.iter().filter_map(zone).collect()
}

/// The rim of a white marker in the raw image, px; `None` if the lens does not see all of it.
fn rim_px(optics: &SensorOptics, marker: &Marker) -> Option<Vec<DVec2>> {
    (0..RIM_POINTS)
        .map(|k| DVec2::from_angle(TAU * f64::from(k) / f64::from(RIM_POINTS)) * (0.5 * marker.diameter_mm))
        .map(|out| optics.project(marker.position_mm + DVec3::new(out.x, out.y, 0.0)).ok())
        .collect()
}

/// The zones of a design at rest. A white marker that the lens does not see makes none.
pub(super) fn image_zones(spec: &LayoutSpec) -> Vec<ImageZone> {
    let keep_out = &spec.pattern.keep_out;
    let mut zones = marker_zones(&spec.optics, &spec.white_markers);
    if let Some(margin_px) = keep_out.white_marker_margin_px {
        zones.extend(spec.white_markers.iter().filter_map(|marker| {
            let reason = Reason::KeepOut(Zone::WhiteMarker(marker.id));
            Some(ImageZone::new(reason, rim_px(&spec.optics, marker)?, margin_px))
        }));
    }
    for (index, disc) in (0u32..).zip(&keep_out.image_discs) {
        let reason = Reason::KeepOut(Zone::ImageDisc(index));
        zones.push(ImageZone::new(reason, vec![DVec2::from_array(disc.center_px)], disc.radius_px));
    }
    zones
}

/// Whether a dot's outline keeps clear of all zones.
pub(super) fn check(zones: &[ImageZone], outline: &Outline) -> Result<(), Reason> {
    if zones.is_empty() {
        return Ok(());
    }
    check_corners(zones, &outline.polygon(4))
}

/// Whether a dot, given by the corners of its outline in the raw image, keeps clear of all zones.
pub(super) fn check_corners(zones: &[ImageZone], dot: &[DVec2]) -> Result<(), Reason> {
    let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let bounds = dot.iter().fold(start, |(low, high), p| (low.min(*p), high.max(*p)));
    zones.iter().find_map(|zone| zone.refuses(dot, bounds)).map_or(Ok(()), Err)
}

/// Distance between two polygons; zero where they overlap. A polygon of one corner is a point.
pub(super) fn gap(a: &[DVec2], b: &[DVec2]) -> f64 {
    // Every corner is checked: polygons that cross may have one corner in each other, and it need not be the first.
    if a.iter().any(|p| inside(*p, b)) || b.iter().any(|p| inside(*p, a)) {
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
