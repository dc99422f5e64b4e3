//! `domecast simulate`: what it writes. What it refuses stands in `tests/cases/scenes`.

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use common::domecast;
use serde_json::{Value, json};

const FOLDER: &str = env!("CARGO_MANIFEST_DIR");

/// A scene with a ball on the pole, changed by a closure.
fn scene(change: impl Fn(&mut Value)) -> Value {
    let mut scene = json!({
        "version": 1, "name": "t", "design": format!("{FOLDER}/designs/thumb24.json"),
        "frames": { "count": 2, "rate_hz": 30 },
        "tolerance": { "px": 0.1, "grey": 4 },
        "contact": { "level": "geometric" },
        "objects": [{ "name": "ball", "shape": { "kind": "sphere", "radius_mm": 4 }, "path": [
            { "time_s": 0, "position_mm": [0, 0, 14] }, { "time_s": 0.033, "position_mm": [0, 0, 13.2] },
        ]}],
        "output": { "heights": true, "pressure": true },
    });
    change(&mut scene);
    scene
}

fn write(folder: &Path, scene: &Value) {
    fs::write(folder.join("scene.json"), scene.to_string()).expect("written");
}

#[test]
fn a_scene_becomes_frames_video_and_truth() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), &scene(|_| {}));
    let planned = domecast(&["simulate", "scene.json", "--explain"], folder.path());
    assert_eq!(planned.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&planned.stdout).contains("contact"));
    assert!(!folder.path().join("output").exists(), "--explain draws nothing");

    let output = domecast(&["simulate", "scene.json", "--out", "out", "--json"], folder.path());
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((output.status.code(), &told["frames"]), (Some(0), &json!(2)), "{told}");
    let said = told["contact"].as_array().expect("a list");
    let is_estimate = |fault: &Value| fault["status"] == "beyond_tolerance";
    assert!(said.iter().all(is_estimate), "nothing else to say of its contact: {said:?}");
    let out = folder.path().join("out");
    let mut names: Vec<String> = domecast::build::list_files(&out).expect("listed");
    names.sort();
    let expected = [
        "frame_0000.png",
        "frame_0001.png",
        "heights_0000.tif",
        "heights_0001.tif",
        "plan.json",
        "pressure_0000.json",
        "pressure_0001.json",
        "truth.jsonl",
        "video.avi",
    ];
    assert_eq!(names, expected);

    let truth = fs::read_to_string(out.join("truth.jsonl")).expect("truth");
    let lines: Vec<Value> = truth.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(lines.len(), 2);
    for (number, line) in lines.iter().enumerate() {
        assert_eq!(line["frame"], json!(number));
        assert_eq!(line["contact"]["status"], json!(["free", "converged"][number]));
        // The key is left out of 172.
        assert_eq!(line["black_dots"].as_array().map(Vec::len), Some(171));
        assert_eq!(line["white_markers"].as_array().map(Vec::len), Some(4));
        for name in ["id", "image_px", "centroid_px", "surface_mm", "visible"] {
            assert!(line["black_dots"][0].get(name).is_some(), "{name}");
        }
        for effect in line["effects"].as_array().expect("effects") {
            assert!(effect["id"].is_string() && effect["used"].is_boolean() && effect["why"].is_string());
        }
    }
    // The second frame is pressed: down, by the load that the springs bear and the pressure sums to.
    let force_n = -lines[1]["wrench"][2].as_f64().expect("Fz");
    assert!(lines[1]["pose"][2][3].as_f64().expect("z") < -0.01 && force_n > 0.1, "{force_n}");
    let pressure: Value =
        serde_json::from_str(&fs::read_to_string(out.join("pressure_0001.json")).expect("read"))
            .expect("JSON");
    let nodes = pressure["nodes"].as_array().expect("nodes");
    let sum: f64 = nodes.iter().filter_map(|node| node["force_n"][2].as_f64()).sum();
    assert!((sum + force_n).abs() < 1e-3 * force_n, "{sum} {force_n}");

    let video = fs::read(out.join("video.avi")).expect("video");
    assert_eq!((&video[..4], &video[8..12]), (&b"RIFF"[..], &b"AVI "[..]));
    let length = u32::from_le_bytes([video[4], video[5], video[6], video[7]]) as usize;
    assert!(length + 8 <= video.len());
}

#[test]
fn a_contact_that_its_level_does_not_cover_is_named() {
    // The end of a thin bar has a rim, which has no closed form.
    let thin = scene(|scene| {
        scene["contact"] = json!({ "level": "closed_form" });
        scene["objects"][0]["shape"] = json!({ "kind": "cylinder", "radius_mm": 1, "length_mm": 8 });
        scene["objects"][0]["path"][0]["position_mm"] = json!([0, 0, 16]);
        scene["frames"]["images"] = json!(false);
    });
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), &thin);
    let more = ["simulate", "scene.json", "--everything", "--out", "out"];
    let output = domecast(&more, folder.path());
    let message = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(0), "{message}");
    assert!(message.contains("contact not_applicable in 1 of 2 frames, first in frame 1: "), "{message}");
    let output = domecast(&[&more[..], &["--json"]].concat(), folder.path());
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let said = told["contact"].as_array().expect("a list");
    let fault = said.iter().find(|fault| fault["status"] == "not_applicable").unwrap_or(&Value::Null);
    assert_eq!((&fault["status"], &fault["first"]), (&json!("not_applicable"), &json!(1)), "{told}");
    assert_eq!(fault["frames"], json!(1), "{told}");
}

#[test]
fn rays_beside_a_steep_membrane_are_counted_and_named() {
    // a narrow bar two millimetres deep: beside its edges the membrane is nearly upright
    let bar = scene(|scene| {
        scene["contact"] = json!({ "level": "linear" });
        scene["light"] = json!({ "surround_level": 0.02, "leds": { "level_per_mw_mm2": 285 } });
        scene["objects"][0]["shape"] = json!({ "kind": "box", "size_mm": [2, 20, 6] });
        scene["objects"][0]["path"] = json!([{ "time_s": 0, "position_mm": [0, 0, 14] }, { "time_s": 0.033, "position_mm": [0, 0, 12] }]);
        scene["output"] = json!({});
    });
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), &bar);
    let output = domecast(&["simulate", "scene.json", "--out", "out"], folder.path());
    let message = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(0), "{message}");
    assert!(message.contains("contact rays_beside in 1 of 2 frames, first in frame 1: "), "{message}");
    let truth = fs::read_to_string(folder.path().join("out/truth.jsonl")).expect("the truth");
    let lines: Vec<Value> = truth.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let rays = |line: &Value| line.get("contact").and_then(|contact| contact.get("rays_beside")).cloned();
    let frames: Vec<&Value> = lines.iter().filter(|line| line.get("frame").is_some()).collect();
    assert_eq!(rays(frames[0]), None, "{}", frames[0]);
    let counted = rays(frames[1]).unwrap_or_default();
    let [beside, followed] = ["beside", "followed"].map(|name| counted[name].as_u64().unwrap_or(0));
    assert!(0 < beside && beside * 100 < followed, "{counted}");
}

#[test]
fn costs_are_told_in_seconds_and_decide_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), &scene(|scene| scene["electronics"] = json!({ "vignetting_exponent": 0.001 })));
    let told = || -> Value {
        let output = domecast(&["simulate", "scene.json", "--explain", "--json"], folder.path());
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    let (one, other) = (told(), told());
    assert_eq!(one["plan"], other["plan"], "the plan knows no clock");
    assert!(one["seconds"]["refraction"].as_f64().is_some_and(|s| s > 0.0 && s < 10.0), "{one}");
    assert!(!one["plan"].to_string().contains("seconds"), "{one}");
    let text = domecast(&["simulate", "scene.json", "--explain"], folder.path()).stdout;
    let text = String::from_utf8(text).expect("UTF-8");
    assert!(text.contains(" ms ") && !text.contains("work"), "{text}");
    for out in ["a", "b"] {
        let output = domecast(&["simulate", "scene.json", "--out", out], folder.path());
        assert_eq!(output.status.code(), Some(0));
    }
    for name in domecast::build::list_files(&folder.path().join("a")).expect("listed") {
        let read = |out: &str| fs::read(folder.path().join(out).join(&name)).expect("read");
        assert_eq!(read("a"), read("b"), "{name}");
    }
}

#[test]
fn what_a_lossy_code_does_is_measured_and_told() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), &scene(|scene| scene["electronics"] = json!({ "jpeg_quality": 60 })));
    let output = domecast(&["simulate", "scene.json", "--out", "out", "--json"], folder.path());
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let coded = |name: &str| told["coding"][name].as_f64().expect("a number");
    assert!(coded("max_grey") >= coded("p999_grey") && coded("p999_grey") >= 2.0, "{told}");
    assert!(coded("rms_grey") > 0.1 && coded("rms_grey") < coded("p999_grey"), "{told}");
    let output = domecast(&["simulate", "scene.json", "--out", "out"], folder.path());
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    assert!(text.contains("the tolerance holds before it") && text.contains("JPEG changes"), "{text}");
}

/// The bytes of all that a command writes, with a cache of its own.
fn drawn(folder: &Path, cache: &Path, more: &[&str]) -> Vec<(String, Vec<u8>)> {
    let arguments = [&["simulate", "scene.json", "--out", "out", "--force"], more].concat();
    let run = Command::new(env!("CARGO_BIN_EXE_domecast"))
        .args(arguments)
        .env("DOMECAST_CACHE", cache)
        .current_dir(folder)
        .output()
        .expect("it runs");
    assert_eq!(run.status.code(), Some(0), "{}", String::from_utf8_lossy(&run.stderr));
    let out = folder.join("out");
    let mut names: Vec<String> = domecast::build::list_files(&out).expect("listed");
    names.sort();
    names.into_iter().map(|name| (name.clone(), fs::read(out.join(name)).expect("read"))).collect()
}

#[test]
fn frames_are_the_same_bytes_with_a_cache_without_one_and_with_one_that_is_damaged() {
    let folder = tempfile::tempdir().expect("a folder");
    let lit = |scene: &mut Value| {
        scene["light"] = json!({ "leds": { "level_per_mw_mm2": 285, "crosstalk": 0.08 } });
        scene["contact"] = json!({ "level": "linear" });
        scene["frames"]["count"] = json!(2);
    };
    write(folder.path(), &scene(lit));
    let cache = folder.path().join("deep/cache");
    let entries = || -> Vec<PathBuf> {
        let mut listed: Vec<_> =
            fs::read_dir(&cache).expect("a cache").map(|e| e.expect("one").path()).collect();
        listed.sort();
        listed
    };
    let alone = drawn(folder.path(), &cache, &["--no-cache"]);
    assert!(!cache.exists(), "--no-cache keeps nothing");
    assert!(drawn(folder.path(), &cache, &["--threads", "1"]) == alone, "the first time");
    let kept = entries();
    assert!(kept.len() >= 4, "{kept:?}");
    let whole: Vec<Vec<u8>> = kept.iter().map(|path| fs::read(path).expect("read")).collect();
    assert!(drawn(folder.path(), &cache, &[]) == alone, "from the cache");
    for path in &kept {
        let mut bytes = fs::read(path).expect("read");
        let middle = bytes.len() / 2;
        bytes[middle] ^= 4;
        fs::write(path, bytes).expect("written");
    }
    assert!(drawn(folder.path(), &cache, &["--threads", "3"]) == alone, "damaged");
    assert_eq!(entries(), kept);
    let again: Vec<Vec<u8>> = kept.iter().map(|path| fs::read(path).expect("read")).collect();
    assert!(again == whole, "what was damaged is made anew");
    // where it cannot be
    assert!(drawn(folder.path(), &folder.path().join("scene.json"), &[]) == alone, "no folder");
}
