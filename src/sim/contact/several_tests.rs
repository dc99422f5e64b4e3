//! Several objects, and a slow gel, through a whole scene.

use std::path::Path;

use serde_json::{Value, json};

use crate::{FrameTruth, Plan, Renderer, Scene, SimError};

fn scene_with(more: &Value) -> Result<Scene, SimError> {
    let mut scene = json!({
        "version": 1, "name": "t", "design": "thumb24.json", "contact": { "element_mm": 1 },
        "frames": { "count": 3, "rate_hz": 20, "images": false }, "tolerance": { "px": 0.01, "grey": 1 },
    });
    for (key, value) in more.as_object().unwrap() {
        scene[key] = value.clone();
    }
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
    Scene::from_text(&scene.to_string(), &folder)
}

fn truth_of(scene: &Scene) -> Result<Vec<FrameTruth>, SimError> {
    let plan = Plan::of(scene)?;
    let renderer = Renderer::new(scene, &plan)?;
    (0..scene.frame_count()).map(|k| Ok(renderer.frame(k)?.truth)).collect()
}

fn ball(name: &str, x_mm: f64, press: Value) -> Value {
    json!({ "name": name, "shape": { "kind": "sphere", "radius_mm": 3 }, "press": press,
            "path": [{ "time_s": 0, "position_mm": [x_mm, 0, 15] }] })
}

#[test]
fn the_truth_of_several_objects_adds_up() {
    let press = |force_n: f64| {
        json!({ "direction": [0, 0, -1],
                "force": [{ "time_s": 0, "force_n": 0 }, { "time_s": 0.1, "force_n": force_n }] })
    };
    let objects = json!([ball("a", 3.5, press(0.8)), ball("b", -3.5, press(0.5))]);
    let truth = truth_of(&scene_with(&json!({ "objects": objects })).unwrap()).unwrap();
    assert!(truth[0].contact.as_ref().unwrap().objects.is_empty(), "nothing touches yet");
    let contact = truth[2].contact.as_ref().unwrap();
    assert_eq!((truth[2].status.as_str(), contact.status), ("ok", "converged"));
    let names: Vec<&str> = contact.objects.iter().map(|object| object.name.as_str()).collect();
    assert_eq!(names, ["a", "b"]);
    for k in 0..6 {
        let sum: f64 = contact.objects.iter().map(|object| object.wrench[k]).sum();
        assert!((sum - truth[2].wrench[k]).abs() < 1e-9, "{k}");
    }
    assert!((contact.objects[0].wrench[2] + 0.8).abs() < 1e-6);
    assert!((contact.objects[1].wrench[2] + 0.5).abs() < 1e-6);
    let said = contact.estimated_error.expect("how far two contacts may be off");
    assert!(said.force_n > 0.01 && said.px > 0.1, "{said:?}");
}

#[test]
fn objects_in_each_other_are_named_with_their_frame() {
    let held = |name: &str, x_mm: f64| {
        json!({ "name": name, "shape": { "kind": "sphere", "radius_mm": 3 },
                "path": [{ "time_s": 0, "position_mm": [x_mm, 0, 12.3] }] })
    };
    let scene = scene_with(&json!({ "objects": [held("a", 2.0), held("b", -2.0)] })).unwrap();
    match truth_of(&scene) {
        Err(SimError::Input(error)) => {
            assert_eq!(error.field, "objects[1].path");
            assert!(error.problem.contains("frame 0: `a` and `b` lie"), "{error}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_slow_gel_loses_force_and_needs_its_level() {
    let held = json!([{ "name": "o", "shape": { "kind": "sphere", "radius_mm": 4 },
                        "path": [{ "time_s": 0, "position_mm": [0, 0, 13.2] }] }]);
    let gel = json!({ "terms": [{ "part": 0.3, "time_s": 0.1 }] });
    let slow = truth_of(&scene_with(&json!({ "objects": held, "slow_gel": gel })).unwrap()).unwrap();
    let force_n: Vec<f64> = slow.iter().map(|line| -line.wrench[2]).collect();
    assert!(force_n[0] > 1.03 * force_n[1] && force_n[1] > 1.01 * force_n[2], "{force_n:?}");
    let left_out =
        scene_with(&json!({ "objects": held, "slow_gel": gel, "effects": { "slow_gel": "never" } }));
    let elastic = truth_of(&left_out.unwrap()).unwrap();
    assert!((elastic[0].wrench[2] - elastic[2].wrench[2]).abs() < 1e-5);
    let level = json!({ "level": "closed_form" });
    match scene_with(&json!({ "objects": held, "slow_gel": gel, "contact": level })).map(|_| ()) {
        Err(SimError::Input(error)) => assert_eq!(error.field, "contact.level"),
        other => panic!("{other:?}"),
    }
}
