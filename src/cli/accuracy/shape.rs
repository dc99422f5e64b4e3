//! Shape from colour: what its resolution and its passes cost in time and give in exactness, on touches with noise.

use std::cell::RefCell;
use std::collections::BTreeMap;

use glam::DVec3;

use super::clock::{TimeLimit, time_again};
use super::frames::{Sequence, draw, with_tolerance};
use super::sweep::{Law, Sweep, SweepSample, sizes};
use domecast_design::Design;
use domecast_optics::numeric::SeededRandom;
use domecast_runtime::constants::Constants;
use domecast_runtime::shape::{ShapeFromColor, ShapeOptions};
use domecast_runtime::track::{CameraFrame, TrackOptions, Tracked, Tracker};
use domecast_sim::{Plan, Renderer, Scene, Scratch, SimError};

/// Resolution, px along a cell, and passes: as it runs is the last.
const SETTINGS: [(&str, usize, usize); 6] = [
    ("6 px", 6, 2),
    ("4 px", 4, 2),
    ("1 px", 1, 2),
    ("one pass", 2, 1),
    ("three passes", 2, 3),
    ("default", 2, 2),
];
/// The camera's noise, levels of 255; its seed.
const NOISE_LEVELS: f64 = 2.0;
const SEED: u64 = 27;
/// What is drawn is this exact, px and grey levels, far below the noise.
const DRAWN: (f64, f64) = (0.02, 0.5);
const FRAMES: u32 = 4;
const QUICK_FRAMES: u32 = 2;
/// Heights count to this angle from the pole, and the share of them that keeps to the error that is stated.
const POLAR_ANGLE_DEG: f64 = 45.0;
const SHARE: f64 = 0.99;

/// A frame as the camera gives it, and the heights that were drawn: `(pixel, mm)`.
struct Press {
    bytes: Vec<u8>,
    heights_mm: Vec<(usize, f64)>,
}

/// The sweep; `None` where the scene has no light, or the constants' light or the picture says no shape.
///
/// # Errors
/// Errors of the simulator on the scene.
pub fn sweep(
    design: &Design,
    constants: &Constants,
    scene: &Scene,
    time_limit: TimeLimit,
    quick: bool,
) -> Result<Option<Sweep>, SimError> {
    let pressed = drawn(&with_depth(scene, if quick { QUICK_FRAMES } else { FRAMES }, true)?)?;
    let rest = drawn(&with_depth(scene, 1, false)?)?;
    let Some(image) = rest.drawn.first().and_then(|frame| frame.image.as_ref()) else { return Ok(None) };
    let Some(presses) = presses(design, &pressed) else { return Ok(None) };
    let at_rest = noisy(&image.bytes, SEED);
    Ok(measured(constants, (image.width, image.height, image.channels), &at_rest, &presses, time_limit))
}

/// The scene with few frames and what each pixel sees; without its touch, the frame at rest.
fn with_depth(scene: &Scene, frames: u32, is_touched: bool) -> Result<Scene, SimError> {
    let few = with_tolerance(scene, DRAWN.0, DRAWN.1, frames)?;
    let mut file = few.file().clone();
    file.output.depth = true;
    if !is_touched {
        file.objects.clear();
        file.motion = None;
    }
    Scene::new(file, few.folder(), few.design().clone())
}

fn drawn(scene: &Scene) -> Result<Sequence, SimError> {
    let plan = Plan::of(scene)?;
    draw(scene, &Renderer::new(scene, &plan)?, &mut Scratch::default())
}

fn noisy(bytes: &[u8], seed: u64) -> Vec<u8> {
    let mut random = SeededRandom::new(seed);
    let value =
        |byte: &u8| (f64::from(*byte) + NOISE_LEVELS * random.normal()).round().clamp(0.0, 255.0) as u8;
    bytes.iter().map(value).collect()
}

fn presses(design: &Design, frames: &Sequence) -> Option<Vec<Press>> {
    let dome = design.sections().dome.shape();
    let mut all = Vec::new();
    for (number, frame) in (1_u64..).zip(&frames.drawn) {
        let (image, depth) = (frame.image.as_ref()?, frame.depth.as_ref()?);
        let mut heights_mm = Vec::new();
        for (pixel, at) in depth.surface_mm.iter().enumerate() {
            let at = DVec3::from_array(at.map(f64::from));
            let from_center = at - dome.center_z_mm() * DVec3::Z;
            let height_mm = dome.distance_mm(at);
            if height_mm.is_finite() && from_center.angle_between(DVec3::Z).to_degrees() <= POLAR_ANGLE_DEG {
                heights_mm.push((pixel, height_mm));
            }
        }
        all.push(Press { bytes: noisy(&image.bytes, SEED + number), heights_mm });
    }
    Some(all)
}

fn measured(
    constants: &Constants,
    (width, height, channels): (usize, usize, usize),
    at_rest: &[u8],
    presses: &[Press],
    time_limit: TimeLimit,
) -> Option<Sweep> {
    let rest = CameraFrame::new(width, height, channels, at_rest).ok()?;
    let mut tracker = Tracker::new(constants, TrackOptions::default()).ok()?;
    let seen_at_rest = tracker.track(0, &rest).clone();
    let mut frames: Vec<(CameraFrame<'_>, Tracked)> = Vec::new();
    for (number, press) in (1_u64..).zip(presses) {
        let frame = CameraFrame::new(width, height, channels, &press.bytes).ok()?;
        let tracked = tracker.track(number, &frame).clone();
        frames.push((frame, tracked));
    }
    // The light is the same for all settings.
    let kept = RefCell::new(BTreeMap::new());
    let tables = |key: &str, _: usize, make: &dyn Fn() -> Vec<f64>| -> Vec<f64> {
        kept.borrow_mut().entry(key.to_owned()).or_insert_with(make).clone()
    };
    let mut samples = Vec::new();
    for (index, (method, cell_px, max_passes)) in SETTINGS.into_iter().enumerate() {
        let options = ShapeOptions { cell_px, max_passes };
        let mut shape = ShapeFromColor::with_tables(constants, &tracker, options, &tables).ok()?;
        if shape.set_rest(&rest, &seen_at_rest).is_err() {
            // too few cells for what the frame at rest has to say
            continue;
        }
        let (mut errors, mut asked) = (Vec::new(), 0_usize);
        for ((frame, tracked), press) in frames.iter().zip(presses) {
            let map = shape.measure(frame, tracked).ok()?;
            asked += press.heights_mm.len();
            let off = |&(pixel, mm): &(usize, f64)| Some((f64::from(*map.height_mm.get(pixel)?) - mm).abs());
            errors.extend(press.heights_mm.iter().filter_map(off).filter(|off| off.is_finite()));
        }
        errors.sort_by(f64::total_cmp);
        let kept = errors.get(((errors.len() as f64 * SHARE) as usize).min(errors.len().checked_sub(1)?))?;
        let (_, rms_error, _) = sizes(errors.iter().copied());
        let time = time_again(time_limit, || {
            for (frame, tracked) in &frames {
                let _ = shape.measure(frame, tracked);
            }
        });
        samples.push(SweepSample {
            method,
            label: format!("cells of {cell_px} px, passes: {max_passes} at most"),
            setting: index as f64 + 1.0,
            max_error: *kept,
            rms_error,
            time,
            per_item_s: time.median_s / frames.len().max(1) as f64,
            notes: vec![("share of pixels known".into(), errors.len() as f64 / asked.max(1) as f64)],
            dominated: false,
        });
    }
    let is_whole = samples.last().is_some_and(|sample| sample.method == "default");
    is_whole.then(|| sweep_of(samples, frames.len()))
}

fn sweep_of(samples: Vec<SweepSample>, items: usize) -> Sweep {
    let in_use = samples.len() - 1;
    Sweep {
        name: "shape",
        title: "Shape from colour".into(),
        setting: "resolution and passes",
        error: "height to 45 degrees from the pole that 99 of 100 pixels keep to, noise of 2 levels",
        unit: "mm",
        item: "frame",
        items,
        reference: "the heights that were drawn".into(),
        floor: 1e-6,
        law: Law::Falls,
        observed: None,
        samples,
        in_use: Some(in_use),
        asked: None,
        meets: None,
        conclusion: "Cells of two pixels lose nothing that noise and colour leave; a pass more follows the light at the moved skin.".into(),
    }
    .finish()
}
