//! The hood: the camera's bore continued as a tube above the lower platform. It hides the lights from the lens at every
//! position of the springs, so that they may stand far below the sheet; where the upper platform comes near it, its window
//! is widened; and it must leave the camera's view alone.

use super::error::Cure;
use super::{Blueprint, Feature, Measures, PartError};
use domecast_mesh::{Fit, Shape};

/// The design field of its rim.
pub(super) const RIM: &str = "platforms.lower.hood.rim_from_pupil_mm";

/// Outer radius of the hood, mm; `None` where there is none.
pub(super) fn outer_mm(m: &Measures) -> Option<f64> {
    m.platforms.lower.hood.map(|hood| m.bore_radius_mm() + hood.wall_mm)
}

/// Radius of what the upper platform leaves open round it at rest, mm; 0 where there is no hood.
pub(super) fn room_mm(m: &Measures) -> f64 {
    let (Some(hood), Some(outer)) = (&m.platforms.lower.hood, outer_mm(m)) else { return 0.0 };
    outer + hood.gap_mm + m.pupil_mm().truncate().length()
}

/// How far a hood's rim can stand above the pupil before it stands in the camera's view, mm, for measures of a hood that is
/// higher than that; `None` where the view leaves room for any.
pub fn highest_hood_rim_mm(m: &Measures) -> Option<f64> {
    let view = m.lower_view.as_ref()?;
    Some(view.highest_within(m.bore_radius_mm()) - m.pupil_mm().z)
}

/// Adds the tube to the lower platform.
///
/// # Errors
/// A rim that ends in the block, or stands in the camera's view.
pub(super) fn add(m: &Measures, b: &mut Blueprint) -> Result<(), PartError> {
    let (Some(hood), Some(outer)) = (&m.platforms.lower.hood, outer_mm(m)) else { return Ok(()) };
    let (top, pupil_z) = (m.lower_top_z_mm, m.pupil_mm().z);
    let rim = hood.rim_from_pupil_mm;
    if pupil_z + rim <= top {
        let needed = top - pupil_z + m.process.min_wall_mm;
        return Err(refused(b, "rim of the hood above the block", rim, (100.0 * needed).ceil() / 100.0));
    }
    if let Some(highest) = highest_hood_rim_mm(m).filter(|highest| rim > *highest) {
        let place = "rim of the hood, which stands in the camera's view: height above the pupil, at most";
        return Err(refused(b, place, rim, (100.0 * highest).floor() / 100.0));
    }
    // From the middle of the block, so that no faces coincide.
    let low = 0.5 * (top + m.platforms.lower.underside_z_mm) - pupil_z;
    let tube = Shape::cylinder(outer, low, rim, Fit::Outside);
    b.added.push(Feature::new("hood", "platforms.lower.hood", tube).placed(m.sensor_from_camera));
    Ok(())
}

/// A rim that has to be elsewhere, and where.
fn refused(b: &Blueprint, place: &str, rim_mm: f64, limit_mm: f64) -> PartError {
    let fault = Box::new(b.infeasible(place, rim_mm, limit_mm, RIM));
    PartError::Cured { fault, cure: Cure::value(RIM, limit_mm.into()) }
}

/// Widens the upper platform's window where the hood would come nearer to it than its gap.
pub(super) fn make_room(m: &Measures, b: &mut Blueprint) {
    let (Some(hood), Some(outer)) = (&m.platforms.lower.hood, outer_mm(m)) else { return };
    let (radius, bottom) = (outer + hood.gap_mm, m.platforms.upper.underside_z_mm);
    let at = m.pupil_mm().truncate();
    // As high as the window itself is wide enough.
    let needed = room_mm(m);
    let (mut low, mut high) = (bottom, m.seat_z_mm());
    if m.view.radius_mm(low) >= needed {
        return;
    }
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if m.view.radius_mm(middle) < needed { low = middle } else { high = middle }
    }
    // It ends well inside of the window, so that its corners leave no sliver there or at the lights' floor.
    let top = (high + m.process.min_wall_mm).min(m.upper_top_z_mm());
    let room = Shape::cylinder(radius, bottom - m.overcut_mm, top, Fit::Outside);
    b.cut.push(Feature::new("hood room", "platforms.lower.hood.gap_mm", room).at(at.x, at.y));
}
