//! The simulator's frames: what a scene's tolerance costs, and what it leaves.

use std::time::Instant;

use super::clock;
use super::sweep::{Law, Sweep, SweepSample};
use domecast_design::Design;
use domecast_fab::numbers::significant;
use domecast_sim::Scene;
use domecast_sim::scene::SceneFile;
use domecast_sim::{Around, Drawn, Plan, Renderer, Scratch, SimError, Work};

/// Tolerances of the sweep, in parts of the scene's own.
const PARTS: [f64; 5] = [64.0, 16.0, 4.0, 1.0, 0.25];
const QUICK_PARTS: [f64; 2] = [16.0, 1.0];
/// Grey tolerances of the pair that stands side by side, levels; the tolerance in px is the scene's own.
const PAIR: [f64; 2] = [1.0, 20.0];
/// Frames that are drawn, spread over the scene.
const FRAMES: u32 = 6;
const QUICK_FRAMES: u32 = 2;
/// The share of pixels whose largest difference counts: the rest is noise.
const SHARE: f64 = 0.999;

/// The scene with few frames over its whole time, and its tolerances times a factor.
fn changed(scene: &Scene, factor: f64, frames: u32) -> Result<Scene, SimError> {
    let own = scene.file().tolerance;
    with_tolerance(scene, own.px * factor, own.grey * factor, frames)
}

/// The scene with few frames over its whole time, and other tolerances.
pub fn with_tolerance(scene: &Scene, px: f64, grey: f64, frames: u32) -> Result<Scene, SimError> {
    let mut file: SceneFile = scene.file().clone();
    let whole = file.frames.count.max(1);
    let count = frames.min(whole);
    if count > 1 {
        file.frames.rate_hz *= f64::from(count - 1) / f64::from((whole - 1).max(1));
    }
    file.frames.count = count;
    file.tolerance.px = px.min(1e6);
    file.tolerance.grey = grey.min(255.0);
    let design: Design = scene.design().clone();
    Scene::new(file, scene.folder(), design)
}

/// Frames of a scene by a plan, each with its time.
pub struct Sequence {
    /// The frames.
    pub drawn: Vec<Drawn>,
    /// What each took, contact and all, s.
    pub seconds: Vec<f64>,
}

/// Draws all frames in turn, on one thread.
///
/// # Errors
/// Errors of the simulator.
pub fn draw(scene: &Scene, renderer: &Renderer<'_>, scratch: &mut Scratch) -> Result<Sequence, SimError> {
    let count = scene.frame_count();
    let mut seconds = vec![0.0; count as usize];
    let mut touches = Vec::new();
    if let Some(mut stepper) = renderer.stepper()? {
        let mut work = Work::default();
        for (number, seconds) in (0..count).zip(&mut seconds) {
            let start = Instant::now();
            touches.push(stepper.next(number, scene.time_s(number), &mut work)?);
            *seconds += start.elapsed().as_secs_f64();
        }
    }
    let mut drawn = Vec::with_capacity(count as usize);
    for (number, seconds) in (0..count).zip(&mut seconds) {
        let start = Instant::now();
        let around = Around::of(&touches, number as usize);
        drawn.push(renderer.frame_around(number, around.as_ref(), scratch)?);
        *seconds += start.elapsed().as_secs_f64();
    }
    Ok(Sequence { drawn, seconds })
}

/// The difference that [`SHARE`] of the pixels keep to, and the root mean square, grey levels.
fn difference(one: &Sequence, other: &Sequence) -> (f64, f64) {
    let mut counts = [0_u64; 256];
    for (a, b) in one.drawn.iter().zip(&other.drawn) {
        let (Some(a), Some(b)) = (&a.image, &b.image) else { continue };
        for (x, y) in a.bytes.iter().zip(&b.bytes) {
            counts[usize::from(x.abs_diff(*y))] += 1;
        }
    }
    let total: u64 = counts.iter().sum();
    let squares: f64 = (0_u32..).zip(counts).map(|(level, n)| f64::from(level).powi(2) * n as f64).sum();
    let mut left = ((1.0 - SHARE) * total as f64) as u64;
    let mut worst = 0;
    for (level, n) in counts.iter().enumerate().rev() {
        if *n > left {
            worst = level;
            break;
        }
        left -= n;
    }
    (worst as f64, (squares / total.max(1) as f64).sqrt())
}

/// The sweep of tolerances of a scene.
///
/// # Errors
/// Errors of the simulator on the scene.
pub fn sweep(scene: &Scene, quick: bool) -> Result<(Sweep, Sequence), SimError> {
    let frames = if quick { QUICK_FRAMES } else { FRAMES };
    let own = changed(scene, 1.0, frames)?;
    let count = own.frame_count();
    let everything = Plan::exact(&own)?;
    let mut scratch = Scratch::default();
    let renderer = Renderer::new(&own, &everything)?;
    // To warm up: the reference is a sample, too.
    renderer.frame_around(0, None, &mut scratch)?;
    let truth = draw(&own, &renderer, &mut scratch)?;
    let sample = |label: String, setting: f64, plan: &Plan, sequence: &Sequence| {
        let (max_error, rms_error) = difference(sequence, &truth);
        // the tables were made with the renderer; what frames differ by is the spread
        let mut time = clock::of(sequence.seconds.clone());
        let per_item_s = time.median_s;
        for seconds in [&mut time.median_s, &mut time.lower_quartile_s, &mut time.upper_quartile_s] {
            *seconds *= f64::from(count);
        }
        let used = plan.entries.iter().filter(|entry| entry.used).count();
        let notes = vec![("effects used".into(), used as f64)];
        SweepSample {
            method: "",
            label,
            setting,
            max_error,
            rms_error,
            time,
            per_item_s,
            notes,
            dominated: false,
        }
    };
    let mut samples = Vec::new();
    let parts: &[f64] = if quick { &QUICK_PARTS } else { &PARTS };
    for &part in parts {
        let scene = changed(scene, part, frames)?;
        let tolerance = &scene.file().tolerance;
        let label = format!("{} px, {} grey levels", significant(tolerance.px), significant(tolerance.grey));
        let plan = Plan::of(&scene)?;
        let sequence = draw(&scene, &Renderer::new(&scene, &plan)?, &mut scratch)?;
        samples.push(sample(label, tolerance.grey, &plan, &sequence));
    }
    for grey in PAIR {
        let scene = with_tolerance(scene, scene.file().tolerance.px, grey, frames)?;
        let plan = Plan::of(&scene)?;
        let sequence = draw(&scene, &Renderer::new(&scene, &plan)?, &mut scratch)?;
        let label = format!("the same at {grey} grey levels");
        samples.push(SweepSample { method: "pair", ..sample(label, grey, &plan, &sequence) });
    }
    // The reference itself, with what it took.
    samples.push(sample("every effect".into(), 0.0, &everything, &truth));
    let tolerance = &own.file().tolerance;
    let sweep = Sweep {
        name: "frames",
        title: format!("Frames of the scene {}", scene.name()),
        setting: "tolerance, grey levels",
        error: "difference from the frame with every effect that 999 of 1000 values keep to",
        unit: "grey levels",
        item: "frame",
        items: count as usize,
        reference: "the same frames with every effect that the scene calls for".into(),
        // a code is rounded: one level means nothing
        floor: 0.01,
        law: Law::Falls,
        observed: None,
        samples,
        in_use: parts.iter().position(|part| *part == 1.0),
        asked: Some(tolerance.grey),
        meets: None,
        conclusion: "An effect that the tolerance spares costs nothing.".into(),
    };
    Ok((sweep.finish(), truth))
}
