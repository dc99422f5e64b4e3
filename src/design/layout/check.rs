//! Whether a dot of the pattern can be seen and printed, and the dot if so.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};

use super::dot::{Dot, DotProjector, plate_outline};
use super::lost::{LostDot, Reason, Zone};
use super::outline::Outline;
use super::passes::PrintPass;
use super::spec::LayoutSpec;
use super::zones::{self, ImageZone};

/// Projects one dot from its place in the pattern to the dome, and on to the plate of the nearest print pass.
pub(super) fn check_dot(
    spec: &LayoutSpec,
    projector: &DotProjector<'_>,
    passes: &[PrintPass],
    zones: &[ImageZone],
    even_px: DVec2,
) -> Result<Dot, LostDot> {
    let image_px = projector.frame.raw_from_even(even_px);
    let lose = |reason: Reason| LostDot { id: 0, even_px, image_px: image_px.ok(), reason };
    let image_px = image_px.map_err(|limit| lose(Reason::Unseen(limit.into())))?;
    let surface = spec.optics.trace(image_px).map_err(|limit| lose(Reason::Unseen(limit)))?;
    let curve = projector.curve(even_px, surface.surface_mm);
    let image_outline = projector.image_outline(&curve).map_err(lose)?;
    let diameter_mm = projector.dome_diameter_mm(&curve).map_err(lose)?;
    check_seen(spec, &image_outline).map_err(lose)?;
    zones::check(zones, &image_outline).map_err(lose)?;
    let (pass, wrap_rad) = nearest_pass(passes, surface.normal);
    let own_rad = (0.5 * diameter_mm / spec.optics.dome_radius_mm()).min(1.0).asin();
    let reach_rad = wrap_rad + own_rad;
    let limit_rad = spec.print.wrap_limit_deg.to_radians();
    let polar_rad = surface.normal.truncate().length().atan2(surface.normal.z);
    let keep_out = &spec.pattern.keep_out;
    let (center_mm, end_rad) = (spec.optics.dome().center_mm(), spec.optics.dome().sphere_end_rad());
    // A cap ends before the pad does: no dot hangs over its rim.
    if polar_rad + own_rad > end_rad && end_rad < FRAC_PI_2 {
        return Err(lose(Reason::KeepOut(Zone::Rim)));
    }
    if polar_rad - own_rad < keep_out.pole_deg.to_radians() && keep_out.pole_deg > 0.0 {
        return Err(lose(Reason::KeepOut(Zone::Pole)));
    }
    if polar_rad + own_rad > (end_rad.to_degrees() - keep_out.rim_deg).to_radians() && keep_out.rim_deg > 0.0
    {
        return Err(lose(Reason::KeepOut(Zone::Rim)));
    }
    if reach_rad > limit_rad {
        return Err(lose(Reason::BeyondWrap { wrap_rad: reach_rad, limit_rad }));
    }
    let pass_from_sensor = passes[pass].pass_from_sensor;
    let plate_mm = projector
        .transfer
        .plate_from_dome(pass_from_sensor * (surface.surface_mm - center_mm))
        .map_err(|limit| lose(Reason::BeyondTransfer(limit)))?;
    let plate_outline =
        plate_outline(&curve, projector.transfer, pass_from_sensor, projector.outline_tolerance_mm)
            .map_err(lose)?;
    let (width_mm, _) = plate_outline.widths();
    if width_mm < spec.print.min_dot_mm {
        return Err(lose(Reason::TooSmall { width_mm, min_mm: spec.print.min_dot_mm }));
    }
    Ok(Dot {
        id: 0,
        image_px,
        even_px,
        surface_mm: surface.surface_mm,
        normal: surface.normal,
        field_angle_rad: surface.field_angle_rad,
        pass,
        wrap_rad,
        plate_mm,
        diameter_mm,
        image_outline,
        plate_outline,
        neighbors: Vec::new(),
    })
}

fn nearest_pass(passes: &[PrintPass], normal: DVec3) -> (usize, f64) {
    let mut best = (0, f64::INFINITY);
    for (index, pass) in passes.iter().enumerate() {
        let local = pass.pass_from_sensor * normal;
        let wrap_rad = local.truncate().length().atan2(local.z);
        if wrap_rad < best.1 {
            best = (index, wrap_rad);
        }
    }
    best
}

/// Whether all of the dot is inside the image and the mask.
fn check_seen(spec: &LayoutSpec, outline: &Outline) -> Result<(), Reason> {
    let lens = spec.optics.lens();
    let (low, high) = outline.bounds();
    let size = DVec2::new(f64::from(lens.spec().width), f64::from(lens.spec().height));
    if low.min_element() < -0.5 || (high - size).max_element() > -0.5 {
        return Err(Reason::OutsideImage);
    }
    if let Some(mask) = &spec.mask {
        for corner in outline.polygon(2) {
            let inside = spec
                .undistorted
                .from_raw(lens, corner)
                .is_ok_and(|place| place.distance(mask.center_px) <= mask.radius_px);
            if !inside {
                return Err(Reason::OutsideMask);
            }
        }
    }
    Ok(())
}
