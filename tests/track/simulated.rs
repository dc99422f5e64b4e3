//! The scenes of `designs/scenes`, drawn by the simulator in memory: what the tracker says beside what is true.

use std::path::PathBuf;

use domecast::sim::scene::SceneFile;
use domecast::sim::{Around, Drawn, Plan, Renderer, Scene, Scratch};
use domecast::track::{CameraFrame, MarkState, Reference, TrackOptions, Tracked};
use glam::DVec2;
use rayon::prelude::*;
use serde_json::{Value, json};

use super::{names, tracker};
use crate::sequences::frames_or;

pub fn scenes() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("designs/scenes")
}

/// What came of a sequence.
#[derive(Default)]
struct Told {
    frames: usize,
    /// Squared errors of centroids and how many; the largest error.
    square: f64,
    dots: usize,
    wanted: usize,
    worst_px: f64,
    markers_px: f64,
    /// Sums of wrench errors, of their squares, and of the variances that were said.
    wrench: [[f64; 3]; 6],
    wrenches: f64,
}

impl Told {
    fn add(&mut self, tracked: &Tracked, drawn: &Drawn) {
        self.frames += 1;
        for (dot, truth) in tracked.black_dots.iter().zip(&drawn.truth.black_dots) {
            assert_eq!(dot.id, truth.id);
            let Some(at) = truth.centroid_px.filter(|_| truth.visible) else { continue };
            self.wanted += 1;
            if let Some(found) = dot.centroid_px {
                let miss = found.distance(DVec2::from_array(at));
                self.square += miss * miss;
                self.dots += 1;
                self.worst_px = self.worst_px.max(miss);
            }
        }
        for (marker, truth) in tracked.white_markers.iter().zip(&drawn.truth.white_markers) {
            if let (Some(found), Some(at)) = (marker.centroid_px, truth.centroid_px) {
                self.markers_px = self.markers_px.max(found.distance(DVec2::from_array(at)));
            }
        }
        if let (Some(wrench), Some(sd)) = (tracked.wrench, tracked.wrench_sd_random) {
            let (wrench, sd) = (wrench.to_array(), sd.to_array());
            self.wrenches += 1.0;
            for axis in 0..6 {
                let miss = wrench[axis] - drawn.truth.wrench[axis];
                let sums = &mut self.wrench[axis];
                *sums = [sums[0] + miss, sums[1] + miss * miss, sums[2] + sd[axis] * sd[axis]];
            }
        }
    }

    fn join(&mut self, other: &Self) {
        self.frames += other.frames;
        self.square += other.square;
        self.dots += other.dots;
        self.wanted += other.wanted;
        self.worst_px = self.worst_px.max(other.worst_px);
        self.markers_px = self.markers_px.max(other.markers_px);
        self.wrenches += other.wrenches;
        for (sums, more) in self.wrench.iter_mut().zip(&other.wrench) {
            for (sum, more) in sums.iter_mut().zip(more) {
                *sum += more;
            }
        }
    }

    /// On each axis.
    fn rms_px(&self) -> f64 {
        (0.5 * self.square / self.dots.max(1) as f64).sqrt()
    }

    /// Mean error of the wrench, its standard deviation, and the one that was said.
    fn wrench(&self) -> [[f64; 3]; 6] {
        self.wrench.map(|[sum, square, said]| {
            let mean = sum / self.wrenches;
            let n = (self.wrenches - 1.0).max(1.0);
            [
                mean,
                ((square - self.wrenches * mean * mean) / n).max(0.0).sqrt(),
                (said / self.wrenches).sqrt(),
            ]
        })
    }

    fn line(&self) -> String {
        let wrench: Vec<String> = self
            .wrench()
            .iter()
            .map(|[mean, sd, said]| format!("{mean:+.4} ({sd:.4}, said {said:.4})"))
            .collect();
        format!(
            "{} frames, dots {}/{} rms {:.4} worst {:.3}, markers {:.3}, wrench {}",
            self.frames,
            self.dots,
            self.wanted,
            self.rms_px(),
            self.worst_px,
            self.markers_px,
            wrench.join(" ")
        )
    }
}

fn frames_of(scene: &Scene, plan: &Plan, numbers: impl IntoParallelIterator<Item = u32>) -> Vec<Drawn> {
    let renderer = Renderer::new(scene, plan).expect("the plan's effects");
    let mut drawn: Vec<Drawn> =
        numbers.into_par_iter().map(|number| renderer.frame(number).expect("a frame")).collect();
    drawn.sort_by_key(|drawn| drawn.truth.frame);
    drawn
}

fn track_all(drawn: &[Drawn], options: TrackOptions) -> Told {
    let mut tracker = tracker(options);
    let mut told = Told::default();
    for drawn in drawn {
        let image = drawn.image.as_ref().expect("a picture");
        let frame =
            CameraFrame::new(image.width, image.height, image.channels, &image.bytes).expect("a frame");
        let number = drawn.truth.frame;
        let tracked = tracker.track(number.into(), &frame);
        assert!(tracked.pose.is_some(), "frame {number}: {:?}", names(tracked));
        assert_eq!(tracked.count(MarkState::Merged), 0, "frame {number}");
        told.add(tracked, drawn);
    }
    told
}

#[test]
fn scenes_of_the_tree_are_tracked() {
    for (name, frames) in [("still", 2), ("push", 30), ("twist", 30), ("lit", 1)] {
        let path = scenes().join(name).with_extension("json");
        let scene = Scene::load(&path).expect("a scene");
        let plan = Plan::of(&scene).expect("a plan");
        let count = scene.frame_count();
        let drawn = frames_of(&scene, &plan, 0..count.min(frames));
        let told = track_all(&drawn, TrackOptions::default());
        println!("{}: {}", scene.name(), told.line());
        assert!(told.rms_px() < 0.05 && told.worst_px < 1.0, "{}: {}", scene.name(), told.line());
        assert!(told.dots as f64 > 0.99 * told.wanted as f64, "{}: {}", scene.name(), told.line());
    }
}

/// Frames of one touch.
const TOUCH: u32 = 60;

/// A ball that comes down somewhere near the pole, presses, shears, twists and lets go, under the sensor's own lights
/// and before a camera with everything that a camera does.
fn touch(seed: u64) -> Value {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut random = |low: f64, high: f64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        low + (high - low) * (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let radius = random(4.0, 8.0);
    let (azimuth, polar) = (random(0.0, std::f64::consts::TAU), random(0.0, 0.35));
    let depth = random(0.3, 0.9);
    let (shear, way, twist) = (random(0.0, 0.8), random(0.0, std::f64::consts::TAU), random(-12.0, 12.0));
    let normal = DVec2::from_angle(azimuth).extend(0.0) * polar.sin() + glam::DVec3::Z * polar.cos();
    let aside = DVec2::from_angle(way).extend(0.0) * shear;
    let key = |time_s: f64, in_mm: f64, shear: f64, twist_deg: f64| {
        let at = normal * (10.0 + radius - in_mm) + aside * shear;
        json!({ "time_s": time_s, "position_mm": at.to_array(), "rotation_deg": [0.0, 0.0, twist_deg] })
    };
    json!({
        "version": 1, "name": format!("touch-{seed}"), "design": "../thumb24.json",
        "frames": { "count": TOUCH, "rate_hz": 30, "colour": true },
        "tolerance": { "px": 0.25, "grey": 1 },
        "contact": { "level": "linear", "element_mm": 1.0 },
        "objects": [{ "name": "ball", "shape": { "kind": "sphere", "radius_mm": radius }, "path": [
            key(0.0, -0.3, 0.0, 0.0), key(0.4, -0.1, 0.0, 0.0), key(0.8, depth, 0.0, 0.0), key(1.2, depth, 1.0, 0.0),
            key(1.6, depth, 0.6, twist), key(2.0, -0.2, 0.6, twist),
        ]}],
        "light": {
            "surround_level": 0.02,
            "leds": { "level_per_mw_mm2": 450, "stray_level": 0.005, "crosstalk": 0.08 },
        },
        "ink": { "edge_mm": 0.03 },
        "electronics": {
            "vignetting_exponent": 1.0, "focus": { "pupil_diameter_mm": 0.15, "distance_mm": 15.5 },
            "shutter": { "exposure_s": 0.004, "readout_s": 0.008 }, "bayer": "rggb",
            "noise": { "full_scale_electrons": 8000, "read_electrons": 4 }, "jpeg_quality": 95,
        },
        "seed": seed,
    })
}

/// Every frame of a touch with every effect that there is.
fn drawn_with_everything(file: &Value) -> Vec<Drawn> {
    let file: SceneFile = domecast::design::from_value(file).expect("a scene's fields");
    let design = domecast::design::Design::load(&scenes().join("../thumb24.json")).expect("the design");
    let scene = Scene::new(file, &scenes(), design).expect("a scene");
    let plan = Plan::everything(&scene).expect("a plan");
    let renderer = Renderer::new(&scene, &plan).expect("its effects");
    let mut touches = Vec::new();
    if let Some(mut stepper) = renderer.stepper().expect("a contact") {
        for number in 0..scene.frame_count() {
            let time_s = scene.time_s(number);
            touches.push(stepper.next(number, time_s, &mut Default::default()).expect("a solved touch"));
        }
    }
    (0..scene.frame_count())
        .into_par_iter()
        .map_init(Scratch::default, |scratch, number| {
            let around = Around::of(&touches, number as usize);
            renderer.frame_around(number, around.as_ref(), scratch).expect("a frame")
        })
        .collect()
}

// Everything that the simulator can do, noise included. Also run over 10,000 frames.
#[test]
fn long_everything_at_once_is_tracked() {
    let (mut all, mut untared) = (Told::default(), Told::default());
    for seed in 0..frames_or(60).div_ceil(TOUCH.into()) {
        let drawn = drawn_with_everything(&touch(seed));
        // As a robot does: what it reads before it touches anything counts as nothing.
        let options = TrackOptions { reference: Reference::Frames(12), ..TrackOptions::default() };
        let told = track_all(&drawn, options);
        println!("touch {seed}: {}", told.line());
        all.join(&told);
        untared.join(&track_all(&drawn, TrackOptions::default()));
    }
    println!("all: {}", all.line());
    println!("untared: {}", untared.line());
    for told in [&all, &untared] {
        assert!(told.rms_px() < 0.05 && told.worst_px < 1.0, "{}", told.line());
        assert!(told.dots as f64 > 0.99 * told.wanted as f64, "{}", told.line());
        for (axis, [mean, sd, said]) in told.wrench().into_iter().enumerate() {
            let limit = if axis < 3 { 0.02 } else { 0.2 };
            assert!(mean.abs() < limit && sd < 1.5 * said, "axis {axis}: {mean} {sd} {said}");
        }
    }
}
