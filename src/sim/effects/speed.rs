//! How fast anything moves in the image, at most: for the effects of a camera that takes its time.

use glam::{DVec2, DVec3};

use crate::SimError;
use crate::contact::level::largest_px_per_mm_at;
use crate::effects::geometry_bound::px_per_touched_frame;
use crate::scene::Scene;
use crate::scene::file::{MotionSection, PoseKey, WrenchKey};
use domecast_springs::{Displacement, Wrench};

/// A load's way between two keys is curved; the speed on it is at most this often that of the straight line. The
/// springs stiffen towards the end of their way by less than that.
const CURVED: f64 = 2.0;

/// A dot under an object moves with it, or less; the platform, on its springs behind the dome, less still.
const DRAGGED: f64 = 2.0;

/// A bound on the speed of any dot or marker in the image, px/s; `None` where nothing moves.
pub fn fastest_px_per_s(scene: &Scene) -> Option<f64> {
    let speed = platform_mm_per_s(scene).max(objects_mm_per_s(scene));
    (speed > 0.0).then(|| speed * largest_px_per_mm(scene))
}

/// Frames about which a motion is looked at; of a longer sequence the bound on the speed is taken.
const MAX_FRAMES: u32 = 128;
/// Every so many dots are looked at, and all markers.
const DOTS_APART: usize = 5;
/// What no point that is looked at shows, others may pass it by.
const BETWEEN: f64 = 1.3;

/// A bound on how far the image of any dot or marker lies, within some time before and after a frame's, from where it is
/// at that frame's time, px.
///
/// # Errors
/// A frame whose load has no balance.
pub fn farthest_px(scene: &Scene, within_s: f64) -> Result<f64, SimError> {
    let max_px = within_s * fastest_px_per_s(scene).unwrap_or(0.0);
    if !scene.objects().is_empty() {
        // Between two frames all goes evenly.
        let per_frame = px_per_touched_frame(scene)?;
        return Ok(per_frame.map_or(max_px, |px| max_px.min(px * within_s * scene.file().frames.rate_hz)));
    }
    if scene.frame_count() > MAX_FRAMES {
        return Ok(max_px);
    }
    let pixels = |time_s: f64| -> Option<Vec<Option<DVec2>>> {
        let state = scene.motion().at(scene.suspension(), time_s).ok()?;
        let optics = scene.optics().at_pose(&state.pose).ok()?;
        let dots = scene.dots().iter().step_by(DOTS_APART).map(|dot| dot.center_mm);
        let points = dots.chain(scene.markers().iter().map(|marker| marker.position_mm));
        Some(points.map(|point| optics.project(point).ok()).collect())
    };
    let mut farthest = 0.0_f64;
    for frame in 0..scene.frame_count() {
        let time_s = scene.time_s(frame);
        let Some(now) = pixels(time_s) else { return Ok(max_px) };
        for part in [-1.0, -0.5, 0.5, 1.0] {
            let Some(then) = pixels(time_s + part * within_s) else { return Ok(max_px) };
            for pair in now.iter().zip(&then) {
                if let (Some(a), Some(b)) = pair {
                    farthest = farthest.max(a.distance(*b));
                }
            }
        }
    }
    Ok(max_px.min(BETWEEN * farthest))
}

fn platform_mm_per_s(scene: &Scene) -> f64 {
    let Some(motion) = &scene.file().motion else { return 0.0 };
    let curved = match motion {
        MotionSection::Wrench(_) => CURVED,
        MotionSection::Pose(_) => 1.0,
    };
    let at_mm = scene.reference_mm();
    let dome = scene.optics().dome();
    let lever_mm = dome.height_mm().max(dome.rim_radius_mm()) + at_mm.length() + 1.0;
    let keys = key_displacements(scene, motion);
    let speed = |a: &(f64, Displacement), b: &(f64, Displacement)| {
        let moved = (b.1.translation_mm - a.1.translation_mm).length();
        let turned = (b.1.rotation_rad - a.1.rotation_rad).length();
        (moved + turned * lever_mm) / (b.0 - a.0)
    };
    curved * keys.windows(2).map(|pair| speed(&pair[0], &pair[1])).fold(0.0, f64::max)
}

/// Displacements of the platform at the keys of a motion; of a load without a balance the last before it.
fn key_displacements(scene: &Scene, motion: &MotionSection) -> Vec<(f64, Displacement)> {
    // A rigid mount has no motion.
    let Some(suspension) = scene.suspension() else { return Vec::new() };
    match motion {
        MotionSection::Pose(motion) => motion.pose.iter().map(pose_key).collect(),
        MotionSection::Wrench(motion) => {
            let mut last = Displacement::default();
            let mut out = Vec::new();
            for WrenchKey { time_s, force_n, moment_nmm, point_mm } in &motion.wrench {
                let [force, moment, point] = [force_n, moment_nmm, point_mm].map(|v| DVec3::from_array(*v));
                let wrench = Wrench::of_load(force, moment, point, suspension.at_mm());
                last = suspension.equilibrium(&wrench).map_or(last, |balance| balance.displacement);
                out.push((*time_s, last));
            }
            out
        }
    }
}

fn pose_key(key: &PoseKey) -> (f64, Displacement) {
    let displacement = Displacement {
        translation_mm: DVec3::from_array(key.translation_mm),
        rotation_rad: DVec3::from_array(key.rotation_deg.map(f64::to_radians)),
    };
    (key.time_s, displacement)
}

fn objects_mm_per_s(scene: &Scene) -> f64 {
    let dome = scene.optics().dome();
    let reach_mm = 2.0 * dome.height_mm().max(dome.radius_mm());
    let mut fastest = 0.0_f64;
    for (object, resolved) in scene.file().objects.iter().zip(scene.objects()) {
        // No point of it is farther from its origin than this.
        let (center, radius_mm) = resolved.indenter.solid.bounding_sphere();
        let size_mm = center.length() + radius_mm;
        for pair in object.path.windows(2) {
            let ([from, to], [turn_from, turn_to]) = (
                [pair[0].position_mm, pair[1].position_mm].map(DVec3::from_array),
                [pair[0].rotation_deg, pair[1].rotation_deg].map(DVec3::from_array),
            );
            // Where it touches the dome is at most this far from its origin: on it, and near the dome.
            let lever_mm = size_mm.min(reach_mm + from.length().max(to.length()));
            let turned = (turn_to - turn_from).length().to_radians();
            let way_mm = (to - from).length() + turned * lever_mm;
            fastest = fastest.max(way_mm / (pair[1].time_s - pair[0].time_s));
        }
        for pair in object.press.iter().flat_map(|press| press.force.windows(2)) {
            // Neither springs nor dome give way by more than the dome's diameter together, whatever the force.
            if pair[0].force_n != pair[1].force_n {
                fastest = fastest.max(reach_mm / (pair[1].time_s - pair[0].time_s));
            }
        }
    }
    DRAGGED * fastest
}

/// Largest motion in the image for a millimetre of any dot or marker, near rest.
fn largest_px_per_mm(scene: &Scene) -> f64 {
    let dots = scene.dots().iter().map(|dot| dot.center_mm);
    let markers = scene.markers().iter().map(|marker| marker.position_mm);
    largest_px_per_mm_at(scene, dots.chain(markers))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(name: &str) -> Scene {
        let folder =
            std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs/scenes");
        Scene::load(&folder.join(name)).unwrap()
    }

    /// Pixels of all markers and some dots at a time.
    fn pixels(scene: &Scene, time_s: f64) -> Vec<Option<DVec2>> {
        let state = scene.motion().at(scene.suspension(), time_s).unwrap();
        let optics = scene.optics().at_pose(&state.pose).unwrap();
        let dots = scene.dots().iter().step_by(7).map(|dot| dot.center_mm);
        let points = dots.chain(scene.markers().iter().map(|marker| marker.position_mm));
        points.map(|point| optics.project(point).ok()).collect()
    }

    #[test]
    fn nothing_is_faster_than_the_bound() {
        for name in ["push.json", "twist.json", "dim.json"] {
            let scene = scene(name);
            let bound = fastest_px_per_s(&scene).unwrap();
            let (step, end) = (0.01, scene.time_s(scene.frame_count()));
            let mut fastest = 0.0_f64;
            let mut before = pixels(&scene, 0.0);
            for k in 1..=(end / step) as u32 {
                let now = pixels(&scene, f64::from(k) * step);
                for (a, b) in before.iter().zip(&now) {
                    if let (Some(a), Some(b)) = (a, b) {
                        fastest = fastest.max(a.distance(*b) / step);
                    }
                }
                before = now;
            }
            println!("{name}: {fastest:.1} px/s, bound {bound:.1}");
            assert!(fastest <= bound && fastest > 0.02 * bound, "{name}: {fastest} {bound}");
        }
    }

    #[test]
    fn a_sensor_at_rest_has_no_speed() {
        assert_eq!(fastest_px_per_s(&scene("still.json")), None);
    }
}
