//! Readings as `track` says them of frames at the design's own size.

use crate::check::Dataset;
use crate::draw::PairDraw;
use crate::readings::{Readings, row, written};
use crate::scene::video_scene;
use crate::sensor::{BuiltSensor, FullSensor};
use crate::video::{NoVideo, Refused, Video, touches};
use domecast_hardness::{SeenDot, TrackedRest};
use domecast_optics::numeric::SeededRandom;
use domecast_runtime::track::CameraFrame;
use domecast_sim::{Around, Renderer, Scratch};

/// Stream of the noise of what is not tracked.
const STREAM_TRACKED: u64 = 0x7eac;

/// The readings of a video: the tracker has the design's constants, not those of the sensor as built, and counts from its frame at rest.
/// The hand's travel is not tracked.
///
/// # Errors
/// [`NoVideo`].
pub fn tracked(
    dataset: &Dataset,
    (sensor, full): (&BuiltSensor, &FullSensor),
    draw: &PairDraw,
    (young_mpa, seed): (f64, u64),
    video: &Video,
) -> Result<Readings, NoVideo> {
    let refused = |why: String| NoVideo::Refused(Refused(why));
    let file = video_scene(dataset, full.scene.file(), draw, (young_mpa, seed, 1.0));
    let scene = full.scene.with_file(file)?;
    let touched = touches(dataset, sensor, &scene, draw)?;
    let renderer = Renderer::new(&scene, &full.plan).map_err(NoVideo::Fault)?;
    let mut reader = full.reader.clone();
    let at_mm = scene.reference_mm();
    let mut random = SeededRandom::stream(seed, STREAM_TRACKED);
    let mut scratch = Scratch::default();
    let count = touched.touches.len();
    let mut rest: Option<TrackedRest> = None;
    let (mut rows, mut dots) = (Vec::new(), Vec::new());
    // the frame at rest first
    for order in 0..=count {
        let (number, at) = if order == 0 { (count, 0) } else { (order - 1, order - 1) };
        let around = Around::of(&touched.touches, at);
        let drawn = renderer.frame_around(number as u32, around.as_ref(), &mut scratch)?;
        let Some(image) = drawn.image else { continue };
        let frame = CameraFrame::new(image.width, image.height, image.channels, &image.bytes);
        let frame = frame.map_err(|fault| refused(format!("{fault:?}")))?;
        let said = reader.track(order as u64, &frame).clone();
        let Some(rest) = &rest else {
            if said.black_dots.iter().all(|dot| dot.reference.is_none()) {
                return Err(refused(format!("the frame at rest is {}", said.status())));
            }
            reader.set_rest(&frame, &said).map_err(|error| refused(error.to_string()))?;
            rest = Some(TrackedRest::new(&said, at_mm));
            scratch.give_back(image);
            continue;
        };
        let [wrench, platform] = rest.rigid(&said);
        let seen: Vec<Option<SeenDot>> = rest.dots(&said).collect();
        let travel_mm = match dataset.spec().readings.robot_travel_sd_mm {
            Some(sd_mm) => video.travel_mm[at] + sd_mm * random.normal(),
            None => f64::NAN,
        };
        let height = f64::from(dataset.design.sections().camera.height);
        let radius_mm = reader.radius_mm(&frame, &said);
        scratch.give_back(image);
        rows.push(row(touched.course.times_s[at], &wrench, &platform, travel_mm, &seen, radius_mm, height));
        dots.push(seen.into_iter().map(written).collect());
    }
    Ok(Readings { rows, dots })
}
