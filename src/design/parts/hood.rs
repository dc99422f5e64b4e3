//! The hood: the camera's bore continued as a tube above the lower platform. It hides the lights from the lens at every
//! position of the springs, so that they may stand far below the sheet; where the upper platform comes near it, its window
//! is widened; and it must leave both the camera's view and the lights' way to the dome alone.

use glam::{DAffine3, DVec2, DVec3};

use super::assembly::affine;
use super::error::Cure;
use super::{Blueprint, Feature, Measures, PartError};
use domecast_mesh::{Fit, Shape};

/// Places of the sheet's underside in each direction that the lights' ways are followed to.
const PLACES: u32 = 25;
/// The design field of its rim.
const RIM: &str = "platforms.lower.hood.rim_from_pupil_mm";

/// Outer radius of the hood, mm; `None` where there is none.
fn outer_mm(m: &Measures) -> Option<f64> {
    m.platforms.lower.hood.map(|hood| m.bore_radius_mm() + hood.wall_mm)
}

/// Radius of what the upper platform leaves open round it at rest, mm; 0 where there is no hood.
pub(super) fn room_mm(m: &Measures) -> f64 {
    let (Some(hood), Some(outer)) = (&m.platforms.lower.hood, outer_mm(m)) else { return 0.0 };
    outer + hood.gap_mm + m.pupil_mm().truncate().length()
}

/// Whether a straight way into the lens goes through its wall: whether it comes into the bore below the rim.
pub(super) fn hides(m: &Measures, camera_from_platform: &DAffine3, from: DVec3, lens: DVec3) -> bool {
    m.platforms.lower.hood.is_some_and(|hood| {
        over_rim_mm(camera_from_platform, [from, lens], m.bore_radius_mm()) < hood.rim_from_pupil_mm
    })
}

/// How far a hood's rim can stand above the pupil before it stands in the camera's view, mm, for measures of a hood that is
/// higher than that; `None` where the view leaves room for any.
pub(super) fn highest_rim_mm(m: &Measures) -> Option<f64> {
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
        return Err(b.infeasible("rim of the hood above the block", rim, top - pupil_z, RIM));
    }
    if let Some(view) = &m.lower_view {
        let highest = view.highest_within(m.bore_radius_mm()) - pupil_z;
        if rim > highest {
            let place = "rim of the hood, which stands in the camera's view: height above the pupil, at most";
            return Err(b.infeasible(place, rim, (100.0 * highest).floor() / 100.0, RIM));
        }
    }
    // From the middle of the block, so that no faces coincide.
    let low = 0.5 * (top + m.platforms.lower.underside_z_mm) - pupil_z;
    let tube = Shape::cylinder(outer, low, rim, Fit::Outside);
    b.added.push(Feature::new("hood", "platforms.lower.hood", tube).placed(m.sensor_from_camera));
    Ok(())
}

/// Widens the upper platform's window where the hood would come nearer to it than its gap.
pub(super) fn make_room(m: &Measures, b: &mut Blueprint) {
    let (Some(hood), Some(outer)) = (&m.platforms.lower.hood, outer_mm(m)) else { return };
    let (radius, bottom) = (outer + hood.gap_mm, m.platforms.upper.underside_z_mm);
    let at = m.pupil_mm().truncate();
    // As high as the window itself is wide enough.
    let needed = radius + at.length();
    let (mut low, mut high) = (bottom, m.seat_z_mm());
    if m.view.radius_mm(low) >= needed {
        return;
    }
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if m.view.radius_mm(middle) < needed { low = middle } else { high = middle }
    }
    let room = Shape::cylinder(radius, bottom - m.overcut_mm, high, Fit::Outside);
    b.cut.push(Feature::new("hood room", "platforms.lower.hood.gap_mm", room).at(at.x, at.y));
}

/// The lights' ways to the dome stay clear of the hood under every claimed load: else what the dome looks like would
/// change with the springs.
///
/// # Errors
/// Which light, under which load, and the rim that would do.
pub(super) fn keeps_light(m: &Measures) -> Result<(), PartError> {
    let (Some(hood), Some(outer)) = (&m.platforms.lower.hood, outer_mm(m)) else { return Ok(()) };
    let camera_from_rest = m.sensor_from_camera.inverse();
    let half = 0.5 * m.leds.emitter_mm;
    // The lowest of an emitter's light, and what is farthest from it of the sheet under the dome.
    let mut worst: Option<(f64, usize, &str)> = None;
    for pose in m.poses.iter().filter(|pose| pose.is_claimed) {
        let camera_from_platform = camera_from_rest * affine(&pose.rest_from_platform);
        for i in 0..m.leds.list.len() {
            let led = m.platform_from_led(i);
            for (x, y) in [(0.0, -1.0), (-1.0, -1.0), (1.0, -1.0), (0.0, 0.0)] {
                let from = led.transform_point3(DVec3::new(x * half, y * half, 0.0));
                for to in under_dome(m).filter(|to| passes_lip(m, from, *to)) {
                    let room = over_rim_mm(&camera_from_platform, [from, to], outer) - hood.rim_from_pupil_mm;
                    if room < 0.0 && worst.is_none_or(|(least, ..)| room < least) {
                        worst = Some((room, i, &pose.name));
                    }
                }
            }
        }
    }
    let Some((room, i, when)) = worst else { return Ok(()) };
    let fault = PartError::Infeasible {
        part: "lower_platform".into(),
        place: format!("the hood stands between LED {i} and the dome {when}; room over its rim"),
        value_mm: room,
        limit_mm: 0.0,
        field: RIM.into(),
    };
    let (from, to) = (hood.rim_from_pupil_mm, hood.rim_from_pupil_mm + room);
    Err(PartError::Cured { fault: Box::new(fault), cure: Cure::length(RIM, from, to) })
}

/// Places of the sheet's underside below the dome's foot.
fn under_dome(m: &Measures) -> impl Iterator<Item = DVec3> + use<> {
    let (rim, z) = (m.dome.rim_radius_mm(), m.seat_z_mm());
    let at = move |k: u32| rim * (2.0 * f64::from(k) / f64::from(PLACES - 1) - 1.0);
    (0..PLACES)
        .flat_map(move |x| (0..PLACES).map(move |y| DVec2::new(at(x), at(y))))
        .filter(move |p| p.length() <= rim)
        .map(move |p| p.extend(z))
}

/// Whether a way from a light goes over the lip, where it leaves the light's pit.
fn passes_lip(m: &Measures, from: DVec3, to: DVec3) -> bool {
    let inner = m.view.radius_mm(m.leds.lip_top_z_mm);
    let far = from.truncate().length();
    // Where the way has come as far inwards as the lip's inner edge; its height there.
    let share = ((far - inner) / (far - to.truncate().length()).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    from.lerp(to, share).z >= m.leds.lip_top_z_mm
}

/// Height above the pupil at which a way comes into the hood's outer radius, camera's frame, mm; infinite where it does not.
fn over_rim_mm(camera_from_platform: &DAffine3, ends: [DVec3; 2], outer_mm: f64) -> f64 {
    let [from, to] = ends.map(|end| camera_from_platform.transform_point3(end));
    let (p, d) = (from.truncate(), to.truncate() - from.truncate());
    let (a, b, c) = (d.length_squared(), p.dot(d), p.length_squared() - outer_mm * outer_mm);
    let root = b * b - a * c;
    if a <= 0.0 || root < 0.0 {
        return f64::INFINITY;
    }
    let enters = ((-b - root.sqrt()) / a).max(0.0);
    let leaves = (-b + root.sqrt()) / a;
    // Ways rise, so that they are lowest where they come in.
    if leaves <= 0.0 || enters >= 1.0 { f64::INFINITY } else { from.lerp(to, enters).z }
}
