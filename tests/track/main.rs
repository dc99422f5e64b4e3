//! The runtime on frames: pictures drawn from the constants, and sequences of the simulator.
// What a helper cannot do fails its test.
#![allow(clippy::unwrap_used)]

mod bad;
mod program;
mod render;
mod report;
mod rigid;
mod sequences;
mod shape;
mod simulated;
mod traction;

use std::path::Path;
use std::str::FromStr;
use std::sync::LazyLock;

use domecast::constants::{Constants, MarkerSight};
use domecast::design::Design;
use domecast::design::{limits_of, suspension_of};
use domecast::layout::Layout;
use domecast::numeric::Rigid;
use domecast::optics::SensorOptics;
use domecast::springs::{Direction, Displacement, Suspension, Wrench, reach, standard_directions, try_load};
use domecast::track::{CameraFrame, MarkState, Springs, TrackOptions, Tracked, Tracker};
use glam::{DVec2, DVec3};
use render::{draw, still};

struct Sensor {
    design: Design,
    constants: Constants,
    optics: SensorOptics,
}

static SENSOR: LazyLock<Sensor> = LazyLock::new(|| {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("designs/thumb24.json");
    let design = Design::load(&path).expect("the design");
    let layout = Layout::of_design(&design).expect("its layout");
    let constants = domecast::constants::of(&design, &layout).expect("its constants");
    // As a runtime gets them.
    let constants = Constants::from_str(&constants.to_json()).expect("its own file");
    let optics = constants.sensor().expect("its optics");
    Sensor { design, constants, optics }
});

fn suspension() -> Suspension {
    suspension_of(&SENSOR.design).expect("its springs")
}

fn pose(t: [f64; 3], r: [f64; 3]) -> Rigid {
    let d = Displacement { translation_mm: DVec3::from_array(t), rotation_rad: DVec3::from_array(r) };
    d.to_pose(suspension().at_mm())
}

fn tracker(options: TrackOptions) -> Tracker {
    Tracker::new(&SENSOR.constants, options).expect("a tracker")
}

fn frame(bytes: &[u8]) -> CameraFrame<'_> {
    let camera = &SENSOR.constants.camera;
    CameraFrame::new(camera.width as usize, camera.height as usize, 1, bytes).expect("a frame")
}

struct Score {
    ok: usize,
    wanted: usize,
    rms_px: f64,
    worst_px: f64,
    markers_px: f64,
    bias_px: DVec2,
}

fn score(tracked: &Tracked, drawn: &render::Drawn) -> Score {
    let (mut sum, mut worst, mut ok, mut wanted, mut bias) = (0.0, 0.0_f64, 0, 0, DVec2::ZERO);
    for (dot, truth) in tracked.black_dots.iter().zip(&drawn.dots) {
        let Some([center, _]) = truth else {
            assert_ne!(dot.state, MarkState::Ok, "dot {} is not printed", dot.id);
            continue;
        };
        wanted += 1;
        if let Some(at) = dot.image_px {
            let miss = at.distance(*center);
            ok += 1;
            sum += miss * miss;
            bias += at - *center;
            worst = worst.max(miss);
        }
    }
    let mut markers = 0.0_f64;
    for (marker, truth) in tracked.white_markers.iter().zip(&drawn.markers) {
        let away = marker.centroid_px.zip(*truth).map_or(f64::INFINITY, |(at, [_, c])| at.distance(c));
        markers = markers.max(away);
    }
    let n = f64::from(ok as u32).max(1.0);
    // rms on each axis
    Score {
        ok,
        wanted,
        rms_px: (sum / n / 2.0).sqrt(),
        worst_px: worst,
        markers_px: markers,
        bias_px: bias / n,
    }
}

fn drawn(picture: &render::Picture) -> render::Drawn {
    draw(&SENSOR.constants, &SENSOR.optics, picture)
}

fn names(tracked: &Tracked) -> Vec<&'static str> {
    tracked.problems.iter().map(|p| p.as_str()).collect()
}

/// Poses over the platform's reach: each axis alone, both ways, and together.
const POSES: [([f64; 3], [f64; 3]); 12] = [
    ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
    ([0.0, 0.0, -2.0], [0.0, 0.0, 0.0]),
    ([0.0, 0.0, 0.4], [0.0, 0.0, 0.0]),
    ([0.15, 0.0, 0.0], [0.0, 0.0, 0.0]),
    ([0.0, -0.15, 0.0], [0.0, 0.0, 0.0]),
    ([0.0, 0.0, 0.0], [0.04, 0.0, 0.0]),
    ([0.0, 0.0, 0.0], [0.0, -0.04, 0.0]),
    ([0.0, 0.0, 0.0], [0.0, 0.0, 0.04]),
    ([0.1, 0.1, -0.5], [0.02, -0.02, 0.02]),
    ([-0.1, 0.15, -1.0], [-0.02, -0.01, -0.02]),
    ([0.1, -0.1, -1.5], [0.01, 0.02, 0.015]),
    ([-0.15, -0.1, -2.2], [0.015, -0.015, -0.01]),
];

// The first frame may be loaded: nothing but the constants is known.
#[test]
fn any_pose_is_found_in_the_first_frame() {
    for (t, r) in POSES {
        let picture = still(pose(t, r));
        let drawn = drawn(&picture);
        let mut tracker = tracker(TrackOptions::default());
        let tracked = tracker.track(0, &frame(&drawn.bytes));
        let s = score(tracked, &drawn);
        assert_eq!(names(tracked), Vec::<&str>::new(), "{t:?} {r:?}");
        assert_eq!(s.ok, s.wanted, "{t:?} {r:?}");
        assert!(
            s.rms_px < 0.03 && s.worst_px < 0.12 && s.bias_px.length() < 0.01,
            "{} {}",
            s.rms_px,
            s.worst_px
        );
        assert!(s.markers_px < 0.1, "{}", s.markers_px);
        // The dome is undeformed: what the platform did is not the dots'.
        for dot in &tracked.black_dots {
            let moved = dot.displacement_mm.expect("a pose");
            assert!(moved.length() < 0.02, "dot {} {moved}", dot.id);
        }
        if let Ok(dir) = std::env::var("DOMECAST_PICTURES") {
            let layers = domecast::overlay::OverlayLayers::default();
            let png = domecast::overlay::overlay_png(&frame(&drawn.bytes), tracked, &SENSOR.optics, &layers);
            std::fs::write(format!("{dir}/overlay_{}.png", t[2]), png.unwrap()).unwrap();
        }
    }
}

/// Loads over the envelope: each of its directions alone and on top of a press, at parts of what the platform bears and
/// the camera sees.
fn loads(azimuths: u32, parts: &[f64]) -> Vec<(String, Wrench, Rigid)> {
    let suspension = suspension();
    let limits = limits_of(&SENSOR.design);
    let sight = MarkerSight::of(&SENSOR.design);
    let alone =
        standard_directions(suspension.at_mm(), &domecast::optics::DomeShape::hemisphere(10.0), azimuths);
    let press = alone[0].clone();
    let mut both = alone.clone();
    both.extend(alone.iter().map(|d| {
        let wrench = Wrench::from_array(std::array::from_fn(|i| {
            d.wrench.to_array()[i] * 0.2 + press.wrench.to_array()[i]
        }));
        Direction { name: format!("press and {}", d.name), wrench }
    }));
    let mut loads = Vec::new();
    for direction in both {
        let reached = reach(&suspension, &limits, &|pose| sight.checks(pose), &direction);
        for part in parts {
            let wrench = direction.wrench.scaled(reached.factor.min(1e3) * part);
            if let Ok(equilibrium) = &try_load(&suspension, &limits, &wrench).equilibrium {
                loads.push((format!("{} at {part}", direction.name), wrench, equilibrium.pose));
            }
        }
    }
    loads
}

// Bias and spread of the wrench over noise, against what each frame says of its own uncertainty.
#[test]
fn the_wrench_is_unbiased_and_knows_its_spread_over_the_envelope() {
    const SEEDS: u64 = 12;
    let (mut square, mut predicted, mut worst) = ([0.0; 6], [0.0; 6], [0.0_f64; 6]);
    let mut cases: Vec<(String, Rigid)> =
        POSES.iter().map(|(t, r)| (format!("{t:?} {r:?}"), pose(*t, *r))).collect();
    cases.extend(loads(4, &[0.5, 0.95]).into_iter().map(|(name, _, pose)| (name, pose)));
    assert!(cases.len() > 60, "{}", cases.len());
    let suspension = suspension();
    for (name, pose) in &cases {
        let picture = still(*pose);
        let mut drawn = drawn(&picture);
        let truth = Displacement::of_pose(&picture.pose, suspension.at_mm());
        let truth = suspension.wrench_at(&truth).unwrap().to_array();
        let mut tracker = tracker(TrackOptions::default());
        let (mut mean, mut spread, mut said) = ([0.0; 6], [0.0; 6], [0.0; 6]);
        for seed in 0..SEEDS {
            drawn.code(2.0, 100 + seed);
            let tracked = tracker.track(seed, &frame(&drawn.bytes));
            let wrench = tracked.wrench.unwrap().to_array();
            let sd = tracked.wrench_sd_random.unwrap().to_array();
            for axis in 0..6 {
                let miss = wrench[axis] - truth[axis];
                mean[axis] += miss / SEEDS as f64;
                spread[axis] += miss * miss;
                said[axis] += sd[axis] / SEEDS as f64;
            }
        }
        for axis in 0..6 {
            let allowed = if axis < 3 { 0.02 } else { 0.2 };
            // What the mean of so many frames may be off by chance comes on top.
            let chance = 3.0 * said[axis] / (SEEDS as f64).sqrt();
            assert!(mean[axis].abs() < allowed + chance, "{name} axis {axis}: {mean:?} said {said:?}");
            worst[axis] = worst[axis].max(mean[axis].abs());
            let n = SEEDS as f64;
            square[axis] += (spread[axis] - n * mean[axis] * mean[axis]) / (n - 1.0);
            predicted[axis] += said[axis] * said[axis];
        }
    }
    let ratio: [f64; 6] = std::array::from_fn(|axis| (square[axis] / predicted[axis]).sqrt());
    println!("{} loads: largest mean error {worst:.4?}, spread over what is said {ratio:.3?}", cases.len());
    assert!(ratio.iter().all(|r| *r < 1.5 && *r > 0.5), "spread over prediction {ratio:?}");
}

// The constants' springs against the design's own law over all that it carries.
#[test]
fn the_constants_give_the_wrench() {
    let suspension = suspension();
    let springs = Springs::new(SENSOR.constants.springs.as_ref().unwrap()).unwrap();
    let mut tried = 0;
    for (name, wrench, pose) in loads(8, &[0.25, 0.5, 0.75, 1.0]) {
        let d = Displacement::of_pose(&pose, suspension.at_mm());
        assert!(springs.can_stand(&pose, &domecast::nalgebra::Matrix6::zeros()), "{name}");
        let (found, tangent) = springs.wrench(&d).expect("a pose that the springs have");
        let exact = suspension.tangent_at(&d).expect("the same");
        assert!((tangent - exact).norm() < 1e-9 * exact.norm());
        for (axis, (found, wanted)) in found.to_array().iter().zip(wrench.to_array()).enumerate() {
            assert!((found - wanted).abs() < 1e-6, "{name} axis {axis}: {found} for {wanted}");
        }
        tried += 1;
    }
    assert!(tried > 150, "{tried}");
}
