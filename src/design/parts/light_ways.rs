//! The lights' ways to the dome, past the hood.

use glam::{DAffine3, DVec2, DVec3};

use super::assembly::affine;
use super::error::Cure;
use super::hood::{RIM, outer_mm};
use super::{Measures, PartError};

/// Places of the sheet's underside in each direction that the ways are followed to.
const PLACES: u32 = 25;

/// The lights' ways to the dome stay clear of the hood under every claimed load: else what the dome looks like would
/// change with the springs.
///
/// # Errors
/// Which light, under which load, and the rim that would do.
pub(super) fn check(m: &Measures) -> Result<(), PartError> {
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
                    if room < 0.0 && worst.is_none_or(|(smallest, ..)| room < smallest) {
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

/// Whether a straight way into the lens goes through the hood's wall: whether it comes into the bore below the rim.
pub(super) fn hides(m: &Measures, camera_from_platform: &DAffine3, from: DVec3, lens: DVec3) -> bool {
    m.platforms.lower.hood.is_some_and(|hood| {
        over_rim_mm(camera_from_platform, [from, lens], m.bore_radius_mm()) < hood.rim_from_pupil_mm
    })
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
