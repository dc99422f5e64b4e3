//! What geometric effects shift, on the scene's own points and frames.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::SimError;
use crate::contact::between::Between;
use crate::contact::level::level_named;
use crate::contact::shape::SkinShape;
use crate::contact::stepper::SolvedFrames;
use crate::raster::projector::Projector;
use crate::raster::sensor_state::SensorState;
use crate::raster::settings::{Geometry, Ink};
use crate::raster::spots::Points;
use crate::scene::Scene;
use crate::scene::file::LevelName;
use crate::work::Work;
use domecast_contact::Level;
use domecast_optics::numeric::Rigid;

/// Frames at which shifts are looked at; a longer sequence is sampled.
const MAX_FRAMES: u32 = 17;

/// Poses in which the light's way to the camera is looked at.
const MAX_POSES: usize = 5;

/// All geometric effects that the scene calls for.
pub fn called_for(scene: &Scene) -> Geometry {
    let lens = scene.optics().lens();
    // A rigid mount does not give way to what touches the dome.
    let moves = scene.suspension().is_some() && (scene.motion().moves() || !scene.objects().is_empty());
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
    if count <= MAX_FRAMES {
        return (0..count).collect();
    }
    let last = u64::from(count - 1);
    (0..MAX_FRAMES).map(|k| (u64::from(k) * last / u64::from(MAX_FRAMES - 1)) as u32).collect()
}

/// Poses in which the platform stands over the frames, some of them, and at rest.
///
/// # Errors
/// A frame whose load has no balance.
pub(super) fn poses(scene: &Scene) -> Result<Vec<Rigid>, SimError> {
    let mut out = vec![Rigid::identity()];
    if called_for(scene).sheet_motion {
        let solved = solved_frames(scene)?;
        let all: Vec<Rigid> = solved.touches().map(|(_, touch)| touch.state.pose).collect();
        let step = all.len().div_ceil(MAX_POSES).max(1);
        out.extend(all.iter().step_by(step).chain(all.last()).copied());
    }
    Ok(out)
}

/// The most that any dot or marker moves in the image from one frame to the next where objects press, px; `None` where not
/// every frame is looked at.
///
/// # Errors
/// A frame whose load has no balance.
pub(super) fn px_per_touched_frame(scene: &Scene) -> Result<Option<f64>, SimError> {
    let frames = frames(scene);
    if (frames.len() as u32) < scene.frame_count() {
        return Ok(None);
    }
    let mut uncounted = Work::default();
    let geometry = called_for(scene);
    let eye = Projector::new(scene, geometry)?;
    let points = Points::new(scene, (geometry, Ink::default()), &eye, 0.1, &mut uncounted);
    let solved = solved_frames(scene)?;
    let (mut last, mut fastest): (Vec<Option<DVec2>>, f64) = (Vec::new(), 0.0);
    for (frame, touch) in solved.touches() {
        let shape = SkinShape { touch: Some(Between::at_frame(touch.clone())), ..SkinShape::default() };
        let time_s = scene.time_s(frame);
        let state = SensorState::new(&eye, geometry, time_s, touch.state.clone(), shape, &mut uncounted)?;
        let now = points.centers(&state, eye.reference());
        for (before, now) in last.iter().zip(&now) {
            if let (Some(before), Some(now)) = (before, now) {
                fastest = fastest.max(before.distance(*now));
            }
        }
        last = now;
    }
    Ok(Some(UNDER_OBJECT * fastest))
}

/// The most that any place of the dome moves under the scene's objects, in its frame or with the platform, mm.
///
/// # Errors
/// A frame whose load has no balance.
pub(super) fn dome_moved_mm(scene: &Scene) -> Result<f64, SimError> {
    let solved = solved_frames(scene)?;
    let pole_mm = scene.optics().dome().pole_mm();
    let mut max_mm = 0.0_f64;
    for (_, touch) in solved.touches() {
        let pose = &touch.state.pose;
        let platform_mm = [DVec3::ZERO, pole_mm].map(|at| pose.point(at).distance(at));
        let own_mm = touch.contact.iter().flat_map(|contact| {
            contact.nodes.iter().map(|node| contact.displacement_mm(node.at_mm).length())
        });
        max_mm = max_mm.max(own_mm.fold(0.0, f64::max) + platform_mm[0].max(platform_mm[1]));
    }
    Ok(UNDER_OBJECT * max_mm)
}

/// A level of contact that answers at once: the geometric one. Under a body with edges its forces have steps, on which a
/// balance is long in coming, if it comes; there the finite elements are quicker, and where the scene asks for
/// them anyway they cost nothing more to prepare.
fn quickest_level(scene: &Scene) -> Level {
    let edged = scene.objects().iter().any(|object| object.indenter.solid.is_mesh());
    match scene.file().contact.level {
        LevelName::Linear if edged => level_named(scene, LevelName::Linear),
        // The others take contacts one by one, and may refuse some.
        name if scene.objects().len() > 1 => level_named(scene, name),
        // It knows hemispheres only.
        name if !scene.objects().is_empty() && !scene.optics().dome().is_hemisphere() => {
            level_named(scene, name)
        }
        _ => Level::Geometric,
    }
}

/// The frames that stand for the scene's, solved.
///
/// # Errors
/// A frame whose load has no balance.
pub fn solved_frames(scene: &Scene) -> Result<Arc<SolvedFrames>, SimError> {
    scene.keep(|| SolvedFrames::new(scene, quickest_level(scene), &frames(scene)))
}

/// A dot's centroid moves with the mean of its surroundings: no more than this often the largest motion of a centre.
const CENTROID: f64 = 1.1;
/// The same under an object, where the states of the bound are those of another level of contact.
const UNDER_OBJECT: f64 = 1.5;

/// A bound on the distance between the images of any dot or marker, in any colour, with two sets of geometric
/// effects, px.
///
/// The points and frames are the scene's own. A sequence of more than 17 frames is looked at in 17, and each point's
/// largest change from one of them to the next is added, which a motion that is smooth between them cannot pass. A
/// point that is seen with one set only has no distance: infinite.
///
/// # Errors
/// A frame whose load has no balance.
pub fn shift_px(scene: &Scene, with: Geometry, without: Geometry) -> Result<f64, SimError> {
    let mut uncounted = Work::default();
    let side = |geometry: Geometry, work: &mut Work| -> Result<(Projector, Points), SimError> {
        let eye = Projector::new(scene, geometry)?;
        let points = Points::new(scene, (geometry, Ink::default()), &eye, 0.1, work);
        Ok((eye, points))
    };
    let (a_eye, a_points) = side(with, &mut uncounted)?;
    let (b_eye, b_points) = side(without, &mut uncounted)?;
    // The same points on both sides, in all colours.
    let on_dome_mm = a_points.on_dome_mm();
    let frames = frames(scene);
    let sampled = (frames.len() as u32) < scene.frame_count();
    let colours = if a_eye.channels() == 1 && b_eye.channels() == 1 { 1 } else { scene.planes() };
    let mut last: Vec<DVec2> = Vec::new();
    let (mut worst, mut change): (f64, f64) = (0.0, 0.0);
    let solved = solved_frames(scene)?;
    for (frame, touch) in solved.touches() {
        let time_s = scene.time_s(frame);
        let between = Between::at_frame(touch.clone());
        let displaced_mm = between.is_deformed().then(|| between.displacements_mm(&on_dome_mm));
        let mut at = |eye: &Projector, geometry: Geometry| {
            let displaced_mm = displaced_mm.clone();
            let shape = SkinShape { touch: Some(between.clone()), displaced_mm, map: None };
            SensorState::new(eye, geometry, time_s, touch.state.clone(), shape, &mut uncounted)
        };
        let (a, b) = (at(&a_eye, with)?, at(&b_eye, without)?);
        let mut now = Vec::new();
        for colour in 0..colours {
            // A colour without rays of its own is seen with those of the reference.
            let (ca, cb) = (colour.min(a_eye.channels() - 1), colour.min(b_eye.channels() - 1));
            for pair in a_points.centers(&a, ca).into_iter().zip(b_points.centers(&b, cb)) {
                match pair {
                    (Some(a), Some(b)) => {
                        worst = worst.max((b - a).length());
                        now.push(b - a);
                    }
                    (None, None) => now.push(DVec2::ZERO),
                    _ => return Ok(f64::INFINITY),
                }
            }
        }
        for (before, off) in last.iter().zip(&now) {
            change = change.max((*off - *before).length());
        }
        last = now;
    }
    let margin = if scene.objects().is_empty() { CENTROID } else { UNDER_OBJECT };
    Ok(margin * if sampled { worst + change } else { worst })
}
