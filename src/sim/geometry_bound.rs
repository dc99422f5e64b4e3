//! What geometric effects shift, on the scene's own points and frames.

use glam::DVec2;

use super::SimError;
use super::eye::Eye;
use super::instant::{Points, at_time};
use super::pipeline::Geometry;
use super::scene::Scene;
use super::work::Work;

/// Frames at which shifts are looked at; a longer sequence is sampled.
const MOST_FRAMES: u32 = 33;

/// All geometric effects that the scene calls for.
pub fn called_for(scene: &Scene) -> Geometry {
    let lens = scene.optics().lens();
    let moves = scene.motion().moves();
    let layers = scene.optics().layers();
    let bends = layers.iter().any(|layer| layer.index != [1.0; 3]);
    Geometry {
        lens_distortion: !lens.spec().distortion.is_empty(),
        pupil_shift: !lens.is_central(),
        refraction: bends,
        dispersion: scene.planes() == 3
            && layers.iter().any(|layer| layer.index.iter().any(|n| *n != layer.index[0])),
        sheet_motion: moves,
        gap_change: moves && bends,
    }
}

/// The frames that stand for the scene's.
fn frames(scene: &Scene) -> Vec<u32> {
    let count = scene.frame_count();
    if count <= MOST_FRAMES {
        return (0..count).collect();
    }
    let last = u64::from(count - 1);
    (0..MOST_FRAMES).map(|k| (u64::from(k) * last / u64::from(MOST_FRAMES - 1)) as u32).collect()
}

/// Largest distance between the images of any dot or marker, in any colour, with two sets of geometric effects, px.
///
/// Exact for sequences of up to 33 frames: the points and frames are the scene's own. A longer one is looked at in
/// 33 frames, and each point's largest change from one of them to the next is added, which a motion that is smooth
/// between them cannot pass. A point that is seen with one set only has no distance: infinite.
///
/// # Errors
/// A frame whose load has no balance.
pub fn shift_px(scene: &Scene, with: Geometry, without: Geometry) -> Result<f64, SimError> {
    let mut uncounted = Work::default();
    let side = |geometry: Geometry, work: &mut Work| -> Result<(Eye, Points), SimError> {
        let eye = Eye::new(scene, geometry)?;
        let solves = geometry.gap_change || !geometry.refraction || !geometry.sheet_motion;
        let points = Points::new(scene, &eye, solves, 0.1, work);
        Ok((eye, points))
    };
    let (a_eye, a_points) = side(with, &mut uncounted)?;
    let (b_eye, b_points) = side(without, &mut uncounted)?;
    let frames = frames(scene);
    let sampled = (frames.len() as u32) < scene.frame_count();
    let mut last: Vec<DVec2> = Vec::new();
    let (mut worst, mut change): (f64, f64) = (0.0, 0.0);
    for frame in frames {
        let time_s = scene.time_s(frame);
        let a = at_time(scene, &a_eye, with, frame, time_s, &mut uncounted)?;
        let b = at_time(scene, &b_eye, without, frame, time_s, &mut uncounted)?;
        let mut now = Vec::new();
        let dots = scene.dots().len();
        for channel in 0..scene.planes() {
            // A colour without rays of its own is seen with those of the reference.
            let (ca, cb) = (channel.min(a_eye.channels() - 1), channel.min(b_eye.channels() - 1));
            for item in 0..dots + scene.markers().len() {
                let see = |points: &Points, instant, channel| match item.checked_sub(dots) {
                    None => points.dot(scene, instant, channel, item),
                    Some(marker) => points.marker(scene, instant, channel, marker),
                };
                match (see(&a_points, &a, ca), see(&b_points, &b, cb)) {
                    (Some(a), Some(b)) => {
                        let off = b.centroid_px - a.centroid_px;
                        worst = worst.max(off.length()).max((b.center_px - a.center_px).length());
                        now.push(off);
                    }
                    (None, None) => now.push(DVec2::ZERO),
                    _ => return Ok(f64::INFINITY),
                }
            }
            if a_eye.channels() == 1 && b_eye.channels() == 1 {
                break;
            }
        }
        for (before, off) in last.iter().zip(&now) {
            change = change.max((*off - *before).length());
        }
        last = now;
    }
    Ok(if sampled { worst + change } else { worst })
}
