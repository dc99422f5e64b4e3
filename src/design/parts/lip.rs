//! The lowest lip that hides the lights from the lens, from the measures alone.
//!
//! What `checks` looks at is the finished mesh, with the lip that a design gives. Here the height is what is wanted: a
//! straight way from a light to the lens leaves the light's pit and enters the opening of the camera's view; between the
//! two it is in the lip's material where it runs below the lip's top. So the lip must be higher than the lowest point of
//! that stretch, for every such way at every position of the springs that a hood does not end.

use glam::{DAffine3, DVec2, DVec3};

use super::assembly::affine;
use super::bearing::behind_lip_mm;
use super::{Measures, hood, light_ways};

/// By how much the lip is higher than it need be, mm: what chords of the mesh take away from its edge.
const HIGHER_MM: f64 = 0.03;
/// Steps in which a way is followed to the opening, and halvings of the last.
const STEPS: u32 = 10;
const HALVINGS: u32 = 10;
/// Directions in which the lens's rim is taken.
const AROUND: u32 = 8;

/// A lip that hides every light from the lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HidingLip {
    /// Least height of its top in the sensor frame, mm.
    pub top_z_mm: f64,
    /// Least distance of the lights' faces from the axis that leaves a wall behind it, mm.
    pub min_light_radius_mm: f64,
}

impl HidingLip {
    /// For the lights and the view of `m`, whatever its lip; `None` where a light stands in the opening, so that no lip
    /// hides it.
    pub fn of(m: &Measures) -> Option<Self> {
        let mut top_z_mm = f64::NEG_INFINITY;
        let lens = lens_points(m);
        let front_mm = m.leds.diffuser_thickness_mm + m.leds.clearance_mm;
        let half = 0.5 * m.leds.emitter_mm;
        for i in 0..m.leds.list.len() {
            let led = m.platform_from_led(i);
            let out = led.matrix3.z_axis;
            for (x, y) in [(-1.0, -1.0), (-1.0, 1.0), (0.0, 0.0), (0.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                let from = led.transform_point3(DVec3::new(x * half, y * half, 0.0));
                for &(to, camera_from_platform) in &lens {
                    let along = (to - from).dot(out);
                    if along <= 0.0 || light_ways::hides(m, &camera_from_platform, from, to) {
                        continue;
                    }
                    let pit_end = front_mm / along;
                    if pit_end < 1.0 {
                        top_z_mm = top_z_mm.max(lowest_in_lip_mm(m, from, to, pit_end)?);
                    }
                }
            }
            // Something stands before the package's foot too.
            let foot = led.transform_point3(DVec3::new(0.0, -0.45 * m.leds.package_mm[1], 0.0));
            let behind = foot + out * (front_mm + m.process.min_wall_mm);
            top_z_mm = top_z_mm.max(foot.z.max(behind.z));
        }
        let top_z_mm = top_z_mm + HIGHER_MM;
        Some(Self { top_z_mm, min_light_radius_mm: behind_lip_mm(m, top_z_mm) })
    }
}

/// Points of the lens's front in the platform's frame, at every position of the springs, with where the camera is then.
fn lens_points(m: &Measures) -> Vec<(DVec3, DAffine3)> {
    let camera_from_rest = m.sensor_from_camera.inverse();
    let radius = 0.5 * m.camera_body.lens_diameter_mm;
    let around = (0..AROUND).map(|k| std::f64::consts::TAU * f64::from(k) / f64::from(AROUND));
    let flat: Vec<DVec2> =
        std::iter::once(DVec2::ZERO).chain(around.map(|angle| radius * DVec2::from_angle(angle))).collect();
    let at_pose = |pose: &super::Pose| {
        let platform_from_rest = pose.rest_from_platform.inverse();
        let camera_from_platform = camera_from_rest * affine(&pose.rest_from_platform);
        let front = |at: &DVec2| {
            let point = at.extend(m.camera_body.front_from_pupil_mm);
            (platform_from_rest.point(m.sensor_from_camera.transform_point3(point)), camera_from_platform)
        };
        flat.iter().map(front).collect::<Vec<_>>()
    };
    m.poses.iter().flat_map(at_pose).collect()
}

/// Lowest height of a way between the pit's end, at a share of it, and the opening; `None` where the pit ends in the
/// opening.
fn lowest_in_lip_mm(m: &Measures, from: DVec3, to: DVec3, pit_end: f64) -> Option<f64> {
    let at = |share: f64| from.lerp(to, share);
    let room_mm = hood::room_mm(m);
    let is_open = |share: f64| {
        let point = at(share);
        point.truncate().length() <= room_mm || m.view.clearance_mm(point.truncate(), point.z) <= 0.0
    };
    if is_open(pit_end) {
        return None;
    }
    let mut before = pit_end;
    let mut opening = 1.0;
    for k in 1..=STEPS {
        let share = pit_end + (1.0 - pit_end) * f64::from(k) / f64::from(STEPS);
        if is_open(share) {
            opening = share;
            break;
        }
        before = share;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (before + opening);
        if is_open(middle) { opening = middle } else { before = middle }
    }
    Some(at(pit_end).z.min(at(before).z))
}
