//! One video: contact solved, frames drawn, what is true of them.

use glam::DVec3;

use crate::check::Dataset;
use crate::draw::PairDraw;
use crate::scene::{Course, video_scene};
use crate::sensor::BuiltSensor;
use domecast_contact::PressStatus;
use domecast_sim::{Around, FrameTruth, Renderer, Scene, Scratch, SimError, Touch};
use domecast_springs::Displacement;

/// A force that only just touches, N: where the hand is then is where the contact begins.
const TOUCH_N: f64 = 2e-4;

/// A video as the simulator made it.
#[derive(Debug, Clone)]
pub struct Video {
    /// When its frames are, and the force in each.
    pub course: Course,
    /// Its frames, and the last one at rest: rows from the top, red, green, blue.
    pub frames: Vec<Vec<u8>>,
    /// What is true of each frame, the one at rest left out.
    pub truth: Vec<FrameTruth>,
    /// Travel of the hand along its direction since the first frame, mm.
    pub travel_mm: Vec<f64>,
    /// Where each dot would be seen on the undeformed dome at the frame's pose, px of the small picture.
    pub undeformed_px: Vec<Vec<Option<[f64; 2]>>>,
    /// Displacement of the platform about the springs' point, mm and rad.
    pub platform: Vec<[f64; 6]>,
    /// Radius of a disc of the contact's area, mm.
    pub radius_mm: Vec<f64>,
}

/// A video that is not taken, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused(pub String);

/// Why there is no video.
pub enum NoVideo {
    /// Another draw may do.
    Refused(Refused),
    /// No draw will.
    Fault(SimError),
}

impl From<SimError> for NoVideo {
    fn from(error: SimError) -> Self {
        Self::Refused(Refused(error.to_string()))
    }
}

/// Simulates a video of a pair with an object of a modulus; `full` draws at the design's own size.
///
/// # Errors
/// [`NoVideo`].
pub fn simulate(
    dataset: &Dataset,
    sensor: &BuiltSensor,
    draw: &PairDraw,
    (young_mpa, seed): (f64, u64),
) -> Result<Video, NoVideo> {
    let file = video_scene(dataset, sensor.scene.file(), draw, (young_mpa, seed, dataset.scale()));
    let scene = sensor.scene.with_file(file)?;
    let touched = touches(dataset, sensor, &scene, draw)?;
    let renderer = Renderer::new(&scene, &sensor.plan).map_err(NoVideo::Fault)?;
    let mut scratch = Scratch::default();
    let (mut frames, mut truth) = (Vec::new(), Vec::new());
    for number in 0..=touched.touches.len() {
        // after the last frame one more of the first touch: nothing touches there
        let at = if number < touched.touches.len() { number } else { 0 };
        let around = Around::of(&touched.touches, at);
        let drawn = renderer.frame_around(number as u32, around.as_ref(), &mut scratch)?;
        frames.push(drawn.image.map(|image| image.bytes).unwrap_or_default());
        if number < touched.touches.len() {
            truth.push(drawn.truth);
        }
    }
    let undeformed_px = touched.touches.iter().map(|touch| undeformed(&scene, touch)).collect();
    let at_mm = scene.reference_mm();
    let platform = touched.touches.iter().map(|t| Displacement::of_pose(&t.state.pose, at_mm).to_array());
    let radius = |touch: &Touch| touch.contact.as_ref().map_or(0.0, |contact| contact.contact_radius_mm);
    Ok(Video {
        frames,
        truth,
        undeformed_px,
        platform: platform.collect(),
        radius_mm: touched.touches.iter().map(radius).collect(),
        travel_mm: touched.travel_mm,
        course: touched.course,
    })
}

/// The contact of each frame of a video.
pub struct Touched {
    /// When, and how hard.
    pub course: Course,
    /// The contacts.
    pub touches: Vec<Touch>,
    /// Travel of the hand since the first frame, mm.
    pub travel_mm: Vec<f64>,
}

/// Solves the contacts of a video's frames.
///
/// # Errors
/// A contact that is not solved, springs that bind, or an object that gives way by too much: another draw may do.
pub fn touches(
    dataset: &Dataset,
    sensor: &BuiltSensor,
    scene: &Scene,
    draw: &PairDraw,
) -> Result<Touched, NoVideo> {
    let course = Course::of(dataset, draw);
    let young_mpa = sensor.dome.elastomer().young_mpa;
    let dome = sensor.dome.with_material(draw.friction, young_mpa);
    let dome = dome.map_err(|error| NoVideo::Refused(Refused(error.to_string())))?;
    let gel = match &scene.file().slow_gel {
        Some(gel) => Some(gel.resolved(young_mpa).map_err(|e| NoVideo::Refused(Refused(e.to_string())))?),
        None => None,
    };
    let mut stepper = domecast_sim::Stepper::on(scene, &dome, gel.as_ref())?;
    let mut work = domecast_sim::Work::default();
    let mut touches = Vec::with_capacity(course.times_s.len());
    for (frame, time_s) in course.times_s.iter().enumerate() {
        let touch = stepper.next(frame as u32, *time_s, &mut work)?;
        sound(&touch, frame, course.first_contact)?;
        touches.push(touch);
    }
    let begin = begins(scene, &dome, draw)?;
    let travel_mm = travel(&course, &touches, draw, begin);
    gives_way(dataset, scene, &touches, (&course, &travel_mm), (draw, young_mpa))?;
    Ok(Touched { course, touches, travel_mm })
}

/// Refuses what is not solved as it should.
fn sound(touch: &Touch, frame: usize, first: u32) -> Result<(), NoVideo> {
    let refused = |why: String| Err(NoVideo::Refused(Refused(format!("frame {frame}: {why}"))));
    if let Some(held) = &touch.state.held {
        return refused(held.note());
    }
    match touch.solved.status {
        "converged" if frame >= first as usize => Ok(()),
        "free" if frame < first as usize => Ok(()),
        status => refused(format!("the contact is {status}")),
    }
}

/// Where the object is along its way when it begins to touch, mm.
fn begins(scene: &Scene, dome: &domecast_contact::Contact, draw: &PairDraw) -> Result<f64, NoVideo> {
    let refused = |why: String| NoVideo::Refused(Refused(format!("first touch: {why}")));
    let object = scene.objects().first().ok_or_else(|| refused("no object".into()))?;
    let from = object.pose_at(0.0);
    let pressed = match scene.suspension() {
        Some(springs) => dome.press_with_force(&object.indenter, springs, &from, draw.way, TOUCH_N, None),
        None => dome.press_held_with_force(&object.indenter, &from, draw.way, TOUCH_N, None),
    };
    let pressed = pressed.map_err(|error| refused(error.to_string()))?;
    if pressed.status != PressStatus::Balanced {
        return Err(refused("it is not balanced".into()));
    }
    Ok(pressed.rest_from_object.translation_mm.dot(draw.way))
}

/// Travel of the hand since the first frame: before the contact at its speed, then as the force has it.
fn travel(course: &Course, touches: &[Touch], draw: &PairDraw, begin_mm: f64) -> Vec<f64> {
    let touch_s = course.times_s.get(course.first_contact.saturating_sub(1) as usize).copied().unwrap_or(0.0);
    let first_mm = -draw.approach_mm_s * touch_s;
    let mut out = Vec::with_capacity(touches.len());
    for (touch, time_s) in touches.iter().zip(&course.times_s) {
        let place = touch.rest_from_objects.first().copied().flatten();
        let at_mm = match (place, touch.contact.is_some()) {
            (Some(place), true) => place.translation_mm.dot(draw.way) - begin_mm,
            _ => draw.approach_mm_s * (time_s - touch_s),
        };
        out.push(at_mm - first_mm);
    }
    out
}

/// Refuses an object that is pressed flat: a half-space is what its surface is taken for.
fn gives_way(
    dataset: &Dataset,
    scene: &Scene,
    touches: &[Touch],
    (course, travel_mm): (&Course, &[f64]),
    (draw, young_mpa): (&PairDraw, f64),
) -> Result<(), NoVideo> {
    let Some((object, touch)) = scene.objects().first().zip(touches.last()) else { return Ok(()) };
    let elastomer = domecast_contact::Elastomer { young_mpa, ..domecast_sim::elastomer_of(scene.design()) };
    let ratio = object.indenter.yield_ratio(&elastomer);
    let touch_s = course.times_s.get(course.first_contact.saturating_sub(1) as usize).copied().unwrap_or(0.0);
    let moved = travel_mm.last().copied().unwrap_or(0.0) - draw.approach_mm_s * touch_s;
    let platform = Displacement::of_pose(&touch.state.pose, draw.place_mm).translation_mm;
    let depth_mm = moved - platform.dot(draw.way);
    let object_mm = depth_mm * ratio / (1.0 + ratio);
    let turned = object.pose_at(0.0);
    let down = turned.inverse().vector(draw.way);
    let solid = &object.indenter.solid;
    let thick_mm = (solid.support(down) - solid.support(-down)).dot(down);
    let max = dataset.spec().press.max_object_strain;
    if object_mm <= max * thick_mm {
        return Ok(());
    }
    let why = format!("the object gives way by {object_mm:.2} mm of {thick_mm:.1} mm, more than {max} of it");
    Err(NoVideo::Refused(Refused(why)))
}

/// Where each dot would be seen on the undeformed dome.
fn undeformed(scene: &Scene, touch: &Touch) -> Vec<Option<[f64; 2]>> {
    let optics = scene.optics().at_pose(&touch.state.pose).ok();
    let seen = |center_mm: DVec3| optics.as_ref()?.project(center_mm).ok().map(|px| px.to_array());
    scene.dots().iter().map(|dot| seen(dot.center_mm)).collect()
}
