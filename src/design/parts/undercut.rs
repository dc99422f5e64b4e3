//! Can the mould be opened? The base plate is lifted off, then the cast comes out of the cavity, both straight
//! along z. That works if no vertical line leaves the material of a half and meets it again on the way out.
//!
//! Silicone in the fill hole and the vents goes with the base plate: they must be narrowest where they meet the
//! cast, for that is where it tears.

use glam::DVec3;

use super::error::infeasible;
use super::measures::Measures;
use super::{Part, PartError};
use domecast_mesh::{RayTarget, TriMesh};

/// A face that leans less than this (the sine of its angle to the vertical) is upright: rounding of `f32`
/// coordinates turns upright facets by about a hundredth of it.
const UPRIGHT: f64 = 1e-4;

/// Material that hangs over a gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Undercut {
    /// A point of the face that hangs over, mm.
    pub at_mm: DVec3,
    /// How far the material below is, mm.
    pub gap_mm: f64,
}

/// Looks for material that meets a body which leaves the solid straight along `way` (+1: up, -1: down): for every
/// triangle that faces against it, whether the solid goes on behind the gap that it bounds. Of several the widest
/// is returned.
pub(super) fn undercut(mesh: &TriMesh, way: f64) -> Option<Undercut> {
    let bounds = mesh.bounds()?;
    let size = bounds.size_mm().length();
    let far_end = if way > 0.0 { bounds.min_mm.z } else { bounds.max_mm.z };
    // Behind the face that the solid stands on there is nothing.
    let hangs_over = |[a, b, c]: &[DVec3; 3]| {
        let lean = (b - a).cross(c - a).try_normalize().map_or(0.0, |normal| normal.z * way);
        lean <= -UPRIGHT && [a, b, c].iter().any(|p| (p.z - far_end).abs() > 1e-6 * size)
    };
    let suspects: Vec<[DVec3; 3]> = mesh.iter_mm().filter(hangs_over).collect();
    if suspects.is_empty() {
        return None;
    }
    let target = RayTarget::new(mesh);
    let mut worst: Option<Undercut> = None;
    for [a, b, c] in suspects {
        // The middle, and near each corner: what is behind may be narrower than the triangle.
        let middle = (a + b + c) / 3.0;
        for point in [middle, middle.lerp(a, 0.95), middle.lerp(b, 0.95), middle.lerp(c, 0.95)] {
            let from = point - DVec3::Z * (way * 1e-6 * size);
            let Some((fraction, _)) = target.first_hit(from, from - DVec3::Z * (way * 2.0 * size)) else {
                continue;
            };
            let gap_mm = fraction * 2.0 * size;
            if worst.is_none_or(|w| gap_mm > w.gap_mm) {
                worst = Some(Undercut { at_mm: point, gap_mm });
            }
        }
    }
    worst
}

/// Checks both halves of the mould, and that fill hole and vents lead into the cavity's rim.
pub(super) fn check(m: &Measures, parts: &[Part]) -> Result<(), PartError> {
    for (name, way, field) in
        [("mould_cavity", 1.0, "mould.sealer_thickness_mm"), ("mould_base", -1.0, "mould.pins")]
    {
        let Some(part) = parts.iter().find(|part| part.name == name) else { continue };
        // Holes of the base may be wider above, where they are filled; seen from below nothing hangs over.
        if let Some(Undercut { at_mm: p, gap_mm }) = undercut(&part.mesh, way) {
            let place = format!("undercut at ({:.2}, {:.2}, {:.2}); gap that it locks", p.x, p.y, p.z);
            return Err(infeasible(name, place, gap_mm, 0.0, field));
        }
    }
    let rim = m.cast_rim_mm();
    let fill = &m.mould.fill;
    let reach = fill.radius_mm + 0.5 * fill.diameter_mm;
    if reach > rim {
        let place = "reach of the fill hole, at most the cavity's rim".to_owned();
        return Err(infeasible("mould_base", place, reach, rim, "mould.fill.radius_mm"));
    }
    let vents = &m.mould.vents;
    // The vent's outer edge stands this far inside the rim, where the last air is.
    if vents.count > 0 && (vents.inset_mm < 0.0 || vents.inset_mm > 0.5 * vents.diameter_mm) {
        let place = "distance of the vents from the rim, at least 0 and at most their radius".to_owned();
        let limit = 0.5 * vents.diameter_mm;
        return Err(infeasible("mould_base", place, vents.inset_mm, limit, "mould.vents.inset_mm"));
    }
    Ok(())
}
