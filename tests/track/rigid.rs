//! A sensor on a rigid mount: the dots at the one pose there is, no pose, no wrench.

use std::path::PathBuf;
use std::str::FromStr;

use domecast::constants::Constants;
use domecast::design::Design;
use domecast::layout::Layout;
use domecast::sim::scene::SceneFile;
use domecast::sim::{Around, Drawn, Plan, Renderer, Scene, Scratch};
use domecast::track::{CameraFrame, MarkState, TrackOptions, Tracked, Tracker, write_csv, write_json};
use glam::{DVec2, DVec3};
use serde_json::{Value, json};

use super::names;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("designs")
}

/// digit-rigid with a hemisphere for its cap: contact is computed on hemispheres.
fn design() -> Design {
    let text = std::fs::read_to_string(folder().join("digit-rigid.json")).expect("the file");
    let mut file: Value = serde_json::from_str(&text).expect("its fields");
    file["dome"] = json!({ "radius_mm": 10 });
    file["envelope"]["size_mm"] = json!([27, 27, 26]);
    file["pattern"]["polar_angle_deg"] = json!(60);
    Design::from_str(&file.to_string()).expect("the design")
}

fn constants(design: &Design) -> Constants {
    let layout = Layout::of_design(design).expect("its layout");
    let constants = domecast::constants::of(design, &layout).expect("its constants");
    Constants::from_str(&constants.to_json()).expect("its own file")
}

/// A ball comes down beside the pole, presses, shears and lets go.
fn held() -> Value {
    let key = |time_s: f64, in_mm: f64, aside_mm: f64| {
        let normal = DVec3::new(0.3, 0.1, 1.0).normalize();
        let at = normal * (15.0 - in_mm) + DVec3::X * aside_mm;
        json!({ "time_s": time_s, "position_mm": at.to_array() })
    };
    json!({ "shape": { "kind": "sphere", "radius_mm": 5 }, "name": "ball", "path": [
        key(0.0, -0.3, 0.0), key(0.2, -0.1, 0.0), key(0.6, 0.8, 0.0), key(0.9, 0.8, 0.6), key(1.2, -0.2, 0.6),
    ]})
}

/// The same ball pressed on by a force that rises.
fn pressed() -> Value {
    json!({
        "shape": { "kind": "sphere", "radius_mm": 5 }, "name": "ball",
        "path": [{ "time_s": 0, "position_mm": [1.0, 0.5, 18.0] }],
        "press": { "direction": [0, 0, -1], "force": [
            { "time_s": 0, "force_n": 0.0 }, { "time_s": 0.8, "force_n": 1.2 },
        ]},
    })
}

fn scene(object: &Value) -> Scene {
    let file = json!({
        "version": 1, "name": "rigid", "design": "digit-rigid.json",
        "frames": { "count": 30, "rate_hz": 25 }, "tolerance": { "px": 0.02, "grey": 1 },
        "contact": { "level": "linear", "element_mm": 1.0 }, "objects": [object],
        "electronics": { "noise": { "full_scale_electrons": 8000, "read_electrons": 4 } }, "seed": 5,
    });
    let file: SceneFile = domecast::design::from_value(&file).expect("a scene's fields");
    Scene::new(file, &folder(), design()).expect("a scene")
}

fn drawn(scene: &Scene) -> Vec<Drawn> {
    let plan = Plan::of(scene).expect("a plan");
    let renderer = Renderer::new(scene, &plan).expect("its effects");
    let mut stepper = renderer.stepper().expect("tables").expect("a contact");
    let touches: Vec<_> = (0..scene.frame_count())
        .map(|n| stepper.next(n, scene.time_s(n), &mut Default::default()).expect("a touch"))
        .collect();
    let mut scratch = Scratch::default();
    (0..scene.frame_count())
        .map(|n| renderer.frame_around(n, Around::of(&touches, n as usize).as_ref(), &mut scratch).unwrap())
        .collect()
}

/// What a frame's dots are off: squares of centroids (px) and displacements (mm), how many, the worst of each.
#[derive(Default, Debug)]
struct Misses {
    square: [f64; 2],
    worst: [f64; 2],
    found: usize,
    wanted: usize,
    beyond_three_sd: usize,
}

fn compare(tracked: &Tracked, drawn: &Drawn, constants: &Constants, to: &mut Misses) {
    let optics = constants.sensor().unwrap();
    for ((dot, truth), rest) in
        tracked.black_dots.iter().zip(&drawn.truth.black_dots).zip(&constants.black_dots)
    {
        assert_eq!((dot.id, rest.id), (truth.id, truth.id as usize));
        let (Some(centroid), Some(image)) = (truth.centroid_px, truth.image_px) else { continue };
        if dot.state == MarkState::Hidden {
            continue;
        }
        to.wanted += 1;
        let Some(found) = dot.centroid_px else { continue };
        to.found += 1;
        let off_px = found.distance(DVec2::from_array(centroid));
        let hit = optics.trace(DVec2::from_array(image)).expect("a dot that is seen");
        let moved_mm = hit.surface_mm - DVec3::from_array(rest.surface_mm);
        let off_mm = dot.displacement_mm.expect("the pose is known").distance(moved_mm);
        to.square[0] += off_px * off_px;
        to.square[1] += off_mm * off_mm;
        to.worst = [to.worst[0].max(off_px), to.worst[1].max(off_mm)];
        // On two axes; quantisation is not in the frame's own noise.
        to.beyond_three_sd +=
            usize::from(off_px > 3.0 * std::f64::consts::SQRT_2 * dot.sd_px.unwrap().hypot(0.02));
    }
}

#[test]
fn a_touch_is_followed_without_pose_or_wrench() {
    let constants = constants(&design());
    assert!(constants.springs.is_none() && constants.white_markers.is_empty());
    for object in [held(), pressed()] {
        let scene = scene(&object);
        let frames = drawn(&scene);
        let mut tracker = Tracker::new(&constants, TrackOptions::default()).expect("a tracker");
        let mut misses = Misses::default();
        let mut largest_mm = 0.0_f64;
        for drawn in &frames {
            let image = drawn.image.as_ref().expect("a picture");
            let frame =
                CameraFrame::new(image.width, image.height, image.channels, &image.bytes).expect("a frame");
            let tracked = tracker.track(drawn.truth.frame.into(), &frame);
            assert_eq!(names(tracked), Vec::<&str>::new(), "frame {}", drawn.truth.frame);
            assert_eq!((tracked.pose, tracked.wrench, tracked.wrench_sd), (None, None, None));
            assert!(tracked.pose_sd.is_none() && tracked.white_markers.is_empty());
            // The platform is held: what the ball pushes with does not move it.
            for (row, expected) in drawn.truth.pose.iter().zip(glam::DMat4::IDENTITY.to_cols_array_2d()) {
                assert_eq!(*row, expected);
            }
            compare(tracked, drawn, &constants, &mut misses);
            let moved = tracked.black_dots.iter().filter_map(|dot| Some(dot.displacement_mm?.length()));
            largest_mm = moved.fold(largest_mm, f64::max);
        }
        let rms = misses.square.map(|square| (0.5 * square / misses.found as f64).sqrt());
        println!("{misses:?}, rms {rms:?}, largest displacement {largest_mm}");
        assert!(rms[0] < 0.05 && misses.worst[0] < 1.0, "{misses:?} {rms:?}");
        assert!(rms[1] < 0.005 && misses.worst[1] < 0.1, "{misses:?} {rms:?}");
        assert!(misses.found as f64 > 0.99 * misses.wanted as f64, "{misses:?}");
        assert!(largest_mm > 0.05, "{largest_mm}");
        assert!(misses.beyond_three_sd < misses.found / 50, "{misses:?}");
    }
}

// What a force-driven press says of its force is what the ball was asked to push with.
#[test]
fn a_force_is_pressed_without_springs() {
    let scene = scene(&pressed());
    for drawn in drawn(&scene) {
        let asked_n = 1.2 * (drawn.truth.time_s / 0.8).min(1.0);
        assert_eq!(drawn.truth.status, "ok");
        assert!((drawn.truth.wrench[2] + asked_n).abs() < 1e-5, "{asked_n}: {:?}", drawn.truth.wrench);
        let sheet = drawn.truth.effects.iter().find(|effect| effect.id.as_str() == "sheet_motion").unwrap();
        assert!(!sheet.used, "{}", sheet.why);
    }
}

#[test]
fn lines_keep_their_names_with_nulls() {
    let constants = constants(&design());
    let mut tracker = Tracker::new(&constants, TrackOptions::default()).expect("a tracker");
    let (width, height) = (constants.camera.width as usize, constants.camera.height as usize);
    let grey = vec![128; width * height];
    let frame = CameraFrame::new(width, height, 1, &grey).unwrap();
    let tracked = tracker.track(0, &frame);
    assert_eq!(tracked.status(), "no_marks");
    let mut line = Vec::new();
    write_json(&mut line, tracked).unwrap();
    let told: Value = serde_json::from_slice(&line).unwrap();
    for field in ["pose", "pose_sd", "wrench", "wrench_sd"] {
        assert_eq!(told.get(field), Some(&Value::Null), "{field}");
    }
    assert_eq!(told["white_markers"], json!([]));
    assert_eq!(told["black_dots"].as_array().unwrap().len(), constants.black_dots.len());
    let mut line = Vec::new();
    write_csv(&mut line, tracked, DVec3::ZERO).unwrap();
    assert_eq!(
        String::from_utf8(line).unwrap(),
        format!("0,no_marks{},0{}\n", ",".repeat(18), ",".repeat(6))
    );
    // A fresh start forgets nothing that is fixed.
    tracker.restart();
    assert_eq!(tracker.track(0, &frame).status(), "no_marks");
}

#[test]
fn constants_that_promise_neither_are_refused() {
    let rigid = constants(&design());
    let mut empty = rigid.clone();
    empty.black_dots.clear();
    let fault = Tracker::new(&empty, TrackOptions::default()).unwrap_err();
    assert_eq!(fault.field, "black_dots");
    let mut blind = super::SENSOR.constants.clone();
    blind.white_markers.clear();
    let fault = Tracker::new(&blind, TrackOptions::default()).unwrap_err();
    assert_eq!(fault.field, "white_markers");
    assert!(fault.problem.contains("springs"), "{fault}");
}
