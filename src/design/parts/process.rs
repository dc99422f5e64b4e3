//! Lengths that the process limits: holes, pins, gaps, and the printer's room.

use super::error::infeasible;
use super::measures::Measures;
use super::{Part, PartError};

/// Lengths that the process limits, and the printer's room.
pub(super) fn check(m: &Measures, parts: &[Part]) -> Result<(), PartError> {
    holes(m)?;
    gaps(m)?;
    for part in parts {
        // A part may lie on any of its sides in the printer.
        let mut size = part.bounds.size_mm().to_array();
        let mut room = m.process.build_volume_mm;
        size.sort_by(f64::total_cmp);
        room.sort_by(f64::total_cmp);
        for (length, limit) in size.into_iter().zip(room) {
            if length > limit {
                let place = "side length, at most the printer's".to_owned();
                return Err(infeasible(&part.name, place, length, limit, "process.build_volume_mm"));
            }
        }
    }
    Ok(())
}

/// Smallest diameters of holes and of pins.
fn holes(m: &Measures) -> Result<(), PartError> {
    let p = &m.process;
    let holes = [
        (
            "upper_platform",
            "push-out hole",
            m.pockets.push_out_diameter_mm,
            "magnet_pockets.push_out_diameter_mm",
        ),
        ("upper_platform", "LED wire hole", m.leds.wire_hole_diameter_mm, "leds.wire_hole_diameter_mm"),
        (
            "lower_platform",
            "wire hole",
            m.platforms.lower.wire_hole_diameter_mm,
            "platforms.lower.wire_hole_diameter_mm",
        ),
        (
            "lower_platform",
            "clamp hole",
            m.platforms.lower.clamp.hole_diameter_mm,
            "platforms.lower.clamp.hole_diameter_mm",
        ),
        (
            "lower_platform",
            "mounting hole",
            m.platforms.lower.mounting.hole_diameter_mm,
            "platforms.lower.mounting.hole_diameter_mm",
        ),
        ("mould_base", "fill hole", m.mould.fill.diameter_mm, "mould.fill.diameter_mm"),
        ("mould_base", "vent", m.mould.vents.diameter_mm, "mould.vents.diameter_mm"),
        ("marker_stencil", "marker hole", 2.0 * m.marker_radius_mm, "white_markers.diameter_mm"),
    ];
    for (part, what, diameter, field) in holes {
        // Zero stands for no such hole.
        if diameter > 0.0 && diameter < p.min_hole_diameter_mm {
            return Err(infeasible(
                part,
                format!("diameter of the {what}"),
                diameter,
                p.min_hole_diameter_mm,
                field,
            ));
        }
    }
    let pins = &m.mould.pins;
    if pins.diameter_mm < p.min_pin_diameter_mm {
        let place = "diameter of the register pins".to_owned();
        return Err(infeasible(
            "mould_base",
            place,
            pins.diameter_mm,
            p.min_pin_diameter_mm,
            "mould.pins.diameter_mm",
        ));
    }
    Ok(())
}

/// Smallest gaps between parts that move into each other.
fn gaps(m: &Measures) -> Result<(), PartError> {
    let limit = m.process.min_gap_mm;
    let gaps = [
        ("mould_base", "gap round the register pins", m.mould.pins.clearance_mm, "mould.pins.clearance_mm"),
        (
            "lower_platform",
            "gap round the camera",
            m.camera_body.bore_clearance_mm,
            "camera_body.bore_clearance_mm",
        ),
        ("upper_platform", "gap round the sheet", m.sheet.clearance_mm, "sheet.clearance_mm"),
        ("upper_platform", "gap round the LED boards", m.leds.clearance_mm, "leds.clearance_mm"),
        ("print_jig", "gap round the sheet", m.jig.clearance_mm, "jig.clearance_mm"),
        (
            "mould_cavity",
            "gap under the register pins",
            m.mould.pins.depth_clearance_mm,
            "mould.pins.depth_clearance_mm",
        ),
    ];
    for (part, place, gap, field) in gaps {
        if gap < limit * (1.0 - 1e-9) {
            return Err(infeasible(part, place.to_owned(), gap, limit, field));
        }
    }
    Ok(())
}
