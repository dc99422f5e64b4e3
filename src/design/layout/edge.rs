//! Where a pattern has its middle and its end.

use glam::{DVec2, DVec3};

use super::boundary::Boundary;
use super::dot::{DotProjector, DotSize};
use super::error::LayoutError;
use super::frame::EvenFrame;
use super::region;
use super::spec::LayoutSpec;
use crate::spec::sections::{OnLost, PatternCentre, PatternKind};
use domecast_optics::RayLimit;

/// The pattern's middle in the even frame, px.
pub(super) fn center(spec: &LayoutSpec, frame: &EvenFrame<'_>) -> Result<DVec2, LayoutError> {
    let raw = match spec.pattern.centre {
        PatternCentre::Pole => spec.optics.project(spec.optics.dome().pole_mm()),
        PatternCentre::PrincipalPoint => Ok(spec.optics.lens().project(DVec3::Z).unwrap_or_default()),
    };
    let lost = |limit: RayLimit| {
        LayoutError::new(
            "pattern.centre",
            "the dome's pole",
            format!("the lens cannot see it ({limit})"),
            "a camera that looks at the dome",
        )
    };
    let raw = raw.map_err(lost)?;
    frame.even_from_raw(raw).map_err(|limit| lost(limit.into()))
}

/// Where the dots' centres may lie: the pattern's edge, drawn in so that no dot is cut.
pub(super) fn edge(
    spec: &LayoutSpec,
    projector: &DotProjector<'_>,
    center_px: DVec2,
    warnings: &mut Vec<String>,
) -> Result<Boundary, LayoutError> {
    let pattern = &spec.pattern;
    if pattern.polar_angle_deg.is_none() && pattern.image_radius_px.is_none() {
        return Err(LayoutError::new(
            "pattern.polar_angle_deg",
            "missing",
            "the pattern has no edge",
            "polar_angle_deg, image_radius_px, or both",
        ));
    }
    let radius_mm = spec.optics.dome_radius_mm();
    let mut edge: Option<Boundary> = None;
    if let Some(polar_deg) = pattern.polar_angle_deg {
        // A dot of equal size on the dome reaches over its centre by its own angle, one of equal apparent
        // size by its radius in the image.
        let (own_rad, inset_px) = match projector.size {
            DotSize::OnDome(mm) => ((0.5 * mm / radius_mm).asin(), 0.0),
            DotSize::Apparent(px) => (0.0, 0.5 * px),
        };
        let polar_rad = (polar_deg.to_radians() - own_rad).clamp(0.0, spec.optics.dome().sphere_end_rad());
        let parallel =
            region::parallel(&spec.optics, &projector.frame, center_px, polar_rad).map_err(|limit| {
                LayoutError::new(
                    "pattern.polar_angle_deg",
                    polar_deg,
                    format!("this parallel of the dome has no image around the pattern's centre ({limit})"),
                    "a camera that looks at the dome",
                )
            })?;
        if let Some((reached_rad, limit)) = parallel.cut {
            let reached = format!("{:.3} deg", (reached_rad + own_rad).to_degrees());
            if pattern.unseen == OnLost::Refuse {
                return Err(LayoutError::new(
                    "pattern.polar_angle_deg",
                    polar_deg,
                    format!("the lens sees the dome only to {reached} ({limit})"),
                    format!("up to {reached}, or pattern.unseen = \"drop\""),
                ));
            }
            warnings.push(format!(
                "pattern.polar_angle_deg is {polar_deg}, but the lens sees the dome only to {reached} ({limit})"
            ));
        }
        edge = Some(parallel.boundary.inset(inset_px));
    }
    if let Some(radius_px) = pattern.image_radius_px {
        let inset = |direction: DVec2| match projector.size {
            DotSize::Apparent(px) => 0.5 * px,
            DotSize::OnDome(_) => apparent_radius_px(projector, center_px + direction * radius_px),
        };
        let inner = edge.take();
        edge = Some(Boundary::new(|direction| {
            let radius = radius_px - inset(direction);
            inner.as_ref().map_or(radius, |inner| radius.min(inner.radius_px(direction)))
        }));
    }
    edge.filter(|edge| edge.largest_px() > 0.0 || pattern.kind != PatternKind::Fill).ok_or_else(|| {
        LayoutError::new("pattern", "too narrow", "no dot fits inside the pattern's edge", "a wider pattern")
    })
}

/// How far a dot of equal size on the dome reaches in the even frame, px; zero where it is not seen, since
/// then it is lost for that reason.
fn apparent_radius_px(projector: &DotProjector<'_>, even_px: DVec2) -> f64 {
    let reach = || -> Result<f64, RayLimit> {
        let point = projector.optics.trace(projector.frame.raw_from_even(even_px)?)?;
        let curve = projector.curve(even_px, point.surface_mm);
        let outline = projector.image_outline(&curve).map_err(|_| RayLimit::Unreachable)?;
        let mut furthest: f64 = 0.0;
        for corner in outline.polygon(4) {
            furthest = furthest.max(projector.frame.even_from_raw(corner)?.distance(even_px));
        }
        Ok(furthest)
    };
    reach().unwrap_or(0.0)
}
