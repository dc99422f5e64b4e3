//! Where in the image a pattern ends.
//!
//! # Example
//! ```
//! use domecast_design::Design;
//!
//! # const THUMB24: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json");
//! let design = Design::load(THUMB24.as_ref())?;
//! let point = design.optics().dome().point_mm(0.5, 1.0);
//! let pixel = design.optics().project(point)?;
//! assert!((design.optics().trace(pixel)?.surface_mm - point).length() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::boundary::Boundary;
use super::frame::EvenFrame;
use domecast_optics::{RayLimit, SensorOptics};

/// Points of a circle of the dome that are projected into the image.
const AROUND: u32 = 720;

/// Halvings of the search for the last point that the lens sees.
const HALVINGS: u32 = 52;

/// A parallel of the dome as the image shows it.
#[derive(Debug, Clone)]
pub struct DomeEdge {
    /// The edge in the even frame, around the given centre.
    pub boundary: Boundary,
    /// Where the lens sees less than the parallel: the smallest polar angle that it reaches (rad), and what
    /// stops it there.
    pub cut: Option<(f64, RayLimit)>,
}

/// The point of a sphere about the origin at a polar angle and an azimuth, mm.
pub fn sphere_point(radius_mm: f64, polar_rad: f64, azimuth_rad: f64) -> DVec3 {
    let (sin, cos) = polar_rad.sin_cos();
    let out = DVec2::from_angle(azimuth_rad) * sin;
    out.extend(cos) * radius_mm
}

/// Projects the parallel at a meridian's angle ([`domecast_optics::DomeShape::point_mm`]) into the even frame, as a boundary around `center_px`. Where the lens
/// does not reach the parallel, the boundary follows the end of what it sees.
///
/// # Errors
/// The lens does not even see the pole, or the parallel does not run around the centre.
pub fn parallel(
    optics: &SensorOptics,
    frame: &EvenFrame<'_>,
    center_px: DVec2,
    polar_rad: f64,
) -> Result<DomeEdge, RayLimit> {
    let place = |polar: f64, azimuth: f64| -> Result<DVec2, RayLimit> {
        let pixel = optics.project(optics.dome().point_mm(polar, azimuth))?;
        Ok(frame.even_from_raw(pixel)? - center_px)
    };
    place(0.0, 0.0)?;
    let mut cut: Option<(f64, RayLimit)> = None;
    let mut offsets = Vec::with_capacity(AROUND as usize);
    for k in 0..AROUND {
        let azimuth = TAU * f64::from(k) / f64::from(AROUND);
        let offset = match place(polar_rad, azimuth) {
            Ok(offset) => offset,
            Err(limit) => {
                let (mut seen, mut unseen) = (0.0, polar_rad);
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (seen + unseen);
                    if place(middle, azimuth).is_ok() { seen = middle } else { unseen = middle }
                }
                if cut.is_none_or(|(reached, _)| seen < reached) {
                    cut = Some((seen, limit));
                }
                place(seen, azimuth)?
            }
        };
        offsets.push(offset);
    }
    let boundary = around(&offsets).ok_or(RayLimit::Unreachable)?;
    Ok(DomeEdge { boundary, cut })
}

/// A boundary through offsets that run around the centre once.
fn around(offsets: &[DVec2]) -> Option<Boundary> {
    let mut polar: Vec<(f64, f64)> =
        offsets.iter().map(|p| (p.to_angle().rem_euclid(TAU), p.length())).collect();
    polar.sort_by(|a, b| a.0.total_cmp(&b.0));
    // A curve that does not run around the centre leaves a wide gap of angles.
    let (first, last) = (*polar.first()?, *polar.last()?);
    let widest = polar.windows(2).map(|pair| pair[1].0 - pair[0].0).fold(first.0 + TAU - last.0, f64::max);
    if widest > TAU / 8.0 {
        return None;
    }
    polar.push((first.0 + TAU, first.1));
    polar.insert(0, (last.0 - TAU, last.1));
    Some(Boundary::new(|direction| {
        let angle = direction.to_angle().rem_euclid(TAU);
        let next = polar.partition_point(|(at, _)| *at <= angle).clamp(1, polar.len() - 1);
        let ((from, a), (to, b)) = (polar[next - 1], polar[next]);
        let share = if to > from { (angle - from) / (to - from) } else { 0.0 };
        a + share * (b - a)
    }))
}
