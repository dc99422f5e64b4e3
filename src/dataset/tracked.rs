//! Readings as `track` says them of frames at the design's own size.

use crate::check::Dataset;
use crate::draw::PairDraw;
use crate::readings::{Readings, SeenDot, row, written};
use crate::rest::TrackedRest;
use crate::scene::video_scene;
use crate::sensor::{BuiltSensor, FullSensor};
use crate::video::{NoVideo, Refused, Video, touches};
use domecast_optics::numeric::SeededRandom;
use domecast_runtime::track::{CameraFrame, TrackOptions, Tracker};
use domecast_sim::{Around, Renderer, Scratch};

/// Stream of the noise of what is not tracked.
const STREAM_TRACKED: u64 = 0x7eac;

/// The readings of a video: the tracker has the design's constants, not those of the sensor as built, and what it says of the
/// frame at rest is taken off. The contact's radius is not tracked, nor is the hand's travel.
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
    let layout = domecast_design::layout::Layout::of_design(&dataset.design);
    let layout = layout.map_err(|error| refused(error.to_string()))?;
    let constants = domecast_fab::constants::of(&dataset.design, &layout);
    let constants = constants.map_err(|error| refused(error.to_string()))?;
    let tracker = Tracker::new(&constants, TrackOptions::default());
    let mut tracker = tracker.map_err(|error| refused(error.to_string()))?;
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
        let said = tracker.track(order as u64, &frame);
        scratch.give_back(image);
        let Some(rest) = &rest else {
            rest = Some(TrackedRest::new(said, at_mm));
            continue;
        };
        let [wrench, platform] = rest.rigid(said);
        let seen: Vec<Option<SeenDot>> = rest.dots(said).collect();
        let travel_mm = match dataset.spec().readings.robot_travel_sd_mm {
            Some(sd_mm) => video.travel_mm[at] + sd_mm * random.normal(),
            None => f64::NAN,
        };
        let height = f64::from(dataset.design.sections().camera.height);
        rows.push(row(touched.course.times_s[at], &wrench, &platform, travel_mm, &seen, f64::NAN, height));
        dots.push(seen.into_iter().map(written).collect());
    }
    Ok(Readings { rows, dots })
}
