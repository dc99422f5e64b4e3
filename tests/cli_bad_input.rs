//! What a person is told when the input is at fault: exit code 1, one message that names file, field,
//! value and what is allowed, nothing written, and an earlier result left whole.

mod common;

use std::fs;
use std::path::Path;
use std::process::Command;

use common::domecast;
use serde_json::{Value, json};

const DESIGN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/designs/thumb24.json");

fn design() -> Value {
    serde_json::from_str(&fs::read_to_string(DESIGN).expect("the design is there")).expect("it is JSON")
}

/// Builds a design text that is at fault and returns the one line of the message.
fn refused(text: &str) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("bad.json"), text).expect("written");
    // an earlier result stands where the new one would go
    fs::create_dir(folder.path().join("out")).expect("made");
    fs::write(folder.path().join("out/manifest.json"), r#"{"files":[{"path":"kept.txt"}]}"#)
        .expect("written");
    fs::write(folder.path().join("out/kept.txt"), "an earlier result").expect("written");
    let before = listing(folder.path());

    let output = domecast(&["build", "bad.json", "--out", "out"], folder.path());
    let message = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(1), "exit code; message: {message}");
    assert_eq!(message.trim_end().lines().count(), 1, "one message: {message}");
    assert!(output.stdout.is_empty(), "nothing on standard output");
    assert!(message.starts_with("error: bad.json"), "the file is named: {message}");
    assert_eq!(listing(folder.path()), before, "nothing is written");
    assert_eq!(fs::read_to_string(folder.path().join("out/kept.txt")).expect("kept"), "an earlier result");
    message
}

fn listing(folder: &Path) -> Vec<String> {
    domecast::build::list_files(folder).expect("the folder can be read")
}

/// The message for the design with the value at `pointer` replaced (or added).
fn refused_with(pointer: &str, value: Value) -> String {
    let mut design = design();
    set(&mut design, pointer, value);
    refused(&design.to_string())
}

fn set(design: &mut Value, pointer: &str, value: Value) {
    let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
    match design.pointer_mut(parent).expect("the parent exists") {
        Value::Object(map) => {
            map.insert(key.to_owned(), value);
        }
        Value::Array(list) => {
            let index: usize = key.parse().expect("an index");
            list[index] = value;
        }
        other => panic!("{other} has no members"),
    }
}

#[track_caller]
fn assert_names(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "\"{part}\" is missing in: {message}");
    }
}

#[test]
fn a_missing_file_and_a_folder_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = domecast(&["build", "nowhere.json"], folder.path());
    assert_eq!(output.status.code(), Some(1));
    assert_names(&String::from_utf8_lossy(&output.stderr), &["nowhere.json", "no such file"]);
    fs::create_dir(folder.path().join("designs")).expect("made");
    let output = domecast(&["build", "designs"], folder.path());
    assert_eq!(output.status.code(), Some(1));
    assert_names(&String::from_utf8_lossy(&output.stderr), &["designs", "folder", "design file"]);
    assert_eq!(listing(folder.path()), Vec::<String>::new());
}

#[test]
fn broken_json_is_placed_by_line_and_column() {
    assert_names(&refused("{\n  \"name\": \"x\",\n  oops\n}"), &["bad.json:3:3", "not valid JSON"]);
    assert_names(&refused("{\n  \"name\": \"x\""), &["bad.json:2:", "not valid JSON"]);
    assert_names(&refused(""), &["bad.json:1:", "not valid JSON"]);
    assert_names(&refused("{\"a\": 1,\n\"a\": 2}"), &["bad.json:2:", "\"a\"", "twice"]);
    assert_names(&refused("{\"radius_mm\": 10,5}"), &["bad.json:1:", "decimal comma"]);
    assert_names(&refused("[]"), &["a list does not belong here", "an object"]);
}

#[test]
fn nan_and_infinity_are_refused() {
    for word in ["NaN", "Infinity", "-Infinity"] {
        let text = format!("{{\"dome\": {{\"radius_mm\": {word}}}}}");
        assert_names(&refused(&text), &["bad.json:1:", "finite"]);
    }
    assert_names(&refused("{\"dome\": {\"radius_mm\": 1e999}}"), &["bad.json:1:", "out of range"]);
}

#[test]
fn an_unknown_key_names_the_nearest_known_one() {
    let message = refused_with("/dome/raduis_mm", json!(10));
    assert_names(&message, &["`dome.raduis_mm` is 10", "unknown key", "\"radius_mm\""]);
    assert_names(&refused_with("/cammera", json!({})), &["`cammera`", "did you mean \"camera\""]);
    let message = refused_with("/optics/layers/0/thickness", json!(1.0));
    assert_names(&message, &["`optics.layers[0].thickness`", "\"thickness_mm\""]);
    assert_names(&refused_with("/dome/why", json!({"radius": "r"})), &["`dome.why.radius`", "\"radius_mm\""]);
}

#[test]
fn a_missing_field_is_named() {
    let mut design = design();
    design["camera"].as_object_mut().expect("an object").remove("matrix");
    assert_names(&refused(&design.to_string()), &["`camera.matrix`", "missing"]);
    assert_names(&refused("{}"), &["missing"]);
}

#[test]
fn a_wrong_type_is_named() {
    assert_names(&refused_with("/dome/radius_mm", json!("10")), &["`dome.radius_mm` is \"10\"", "a number"]);
    assert_names(
        &refused_with("/camera/width", json!(640.5)),
        &["`camera.width` is 640.5", "a whole number"],
    );
    assert_names(&refused_with("/camera/matrix", json!(5)), &["`camera.matrix` is 5", "a list"]);
    assert_names(&refused_with("/dome", json!(null)), &["`dome` is null", "an object"]);
    assert_names(
        &refused_with("/camera/model", json!("fish")),
        &["`camera.model` is \"fish\"", "kannala_brandt"],
    );
    assert_names(
        &refused_with("/optics/layers/1/index", json!("1.4")),
        &["`optics.layers[1].index`", "a number"],
    );
}

#[test]
fn values_out_of_range_are_refused() {
    let cases = [
        ("/dome/radius_mm", json!(-10), "dome.radius_mm"),
        ("/dome/radius_mm", json!(0), "dome.radius_mm"),
        ("/optics/layers/0/thickness_mm", json!(-1), "optics.layers[0].thickness_mm"),
        ("/optics/layers/0/index", json!(0.9), "optics.layers[0].index"),
        ("/camera/width", json!(0), "camera.width"),
        ("/camera/field_of_view_deg", json!(0), "camera.field_of_view_deg"),
        ("/camera_body/diameter_mm", json!(0), "camera_body.diameter_mm"),
        ("/envelope/size_mm", json!([24, 24, -26]), "envelope.size_mm"),
        ("/camera/matrix/0", json!([-229.18, 0, 319.5]), "camera.matrix"),
        ("/camera/matrix/2", json!([0, 0, 2]), "camera.matrix"),
    ];
    for (pointer, value, field) in cases {
        let message = refused_with(pointer, value);
        assert_names(&message, &[field, "allowed: "]);
    }
}

#[test]
fn geometry_that_cannot_be_is_refused() {
    assert_names(&refused_with("/dome/radius_mm", json!(13)), &["dome.radius_mm", "13"]);
    assert_names(&refused_with("/camera/position_mm", json!([0, 0, -0.5])), &["camera.position_mm", "sheet"]);
    assert_names(
        &refused_with("/camera/distortion", json!([0.1, 0.2, 0.0])),
        &["camera.distortion", "5 or 8"],
    );
    assert_names(&refused_with("/name", json!("../elsewhere")), &["`name`", "letters"]);
    assert_names(&refused_with("/name", json!("")), &["`name`", "letters"]);
    assert_names(&refused_with("/version", json!(2)), &["`version` is 2", "1"]);
}

#[test]
fn dots_that_cannot_be_are_refused() {
    assert_names(
        &refused_with("/pattern/dot_diameter_px", json!(18)),
        &["pattern.dot_diameter_px", "18", "pitch"],
    );
    // under the rim and beyond: the rays of such pixels miss the dome
    let mut design = design();
    design["pattern"].as_object_mut().expect("an object").remove("polar_angle_deg");
    design["pattern"]["image_radius_px"] = json!(220);
    assert_names(&refused(&design.to_string()), &["pattern", "dot 0", "pixel", "misses_dome", "drop"]);
    assert_names(&refused_with("/print/min_dot_mm", json!(0.5)), &["unprintable", "0.5 mm", "drop"]);
}

#[test]
fn markers_and_loads_that_cannot_be_seen_are_refused() {
    let message = refused_with("/camera/position_mm", json!([0, 0, -6.5]));
    assert_names(
        &message,
        &["white_markers.positions_mm[0]", "the lens cannot see the marker", "beyond_fold"],
    );
    assert_names(
        &refused_with("/white_markers/positions_mm/2", json!([-6, -6])),
        &["positions_mm[2]", "under the dome"],
    );
    assert_names(
        &refused_with("/white_markers/positions_mm/1", json!([-11, 7.5])),
        &["positions_mm[1]", "edge"],
    );
    assert_names(
        &refused_with("/loads/claims/0/force_n", json!([0, 0, -25])),
        &["loads.claims[0]", "\"press\"", "wire_over_stressed", "allowed: at most 1180.000 MPa"],
    );
    assert_names(&refused_with("/camera/rotation_deg", json!([40, 0, 0])), &["white_markers", "beyond_fold"]);
    assert_names(
        &refused_with("/runtime/mask_field_angle_deg", json!(45)),
        &["white_markers", "mask", "at most"],
    );
}

#[cfg(unix)]
#[test]
fn a_disk_that_is_full_leaves_the_earlier_result() {
    let folder = tempfile::tempdir().expect("a folder");
    assert!(domecast(&["build", DESIGN, "--out", "out"], folder.path()).status.success());
    let before = listing(folder.path());
    // a limit on the size of files (in blocks of 512 bytes or 1 KiB) fails writes as a full disk does, without one
    let program = env!("CARGO_BIN_EXE_domecast");
    let script = format!("trap '' XFSZ; ulimit -f 40; exec '{program}' build '{DESIGN}' --out out");
    let output =
        Command::new("sh").args(["-c", &script]).current_dir(folder.path()).output().expect("it runs");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert_names(&message, &["out", "cannot write the file", "room on the disk"]);
    assert_eq!(listing(folder.path()), before, "nothing is left behind");
    assert!(domecast(&["check", "out"], folder.path()).status.success(), "the earlier result is whole");
}

#[test]
fn an_output_folder_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("file"), "in the way").expect("written");
    for out in ["file", "file/below", "/proc/none/out"] {
        let output = domecast(&["build", DESIGN, "--out", out], folder.path());
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert_names(&message, &["folder", "allowed: "]);
        assert_eq!(listing(folder.path()), ["file"], "nothing is left behind");
    }
}

#[test]
fn a_folder_with_other_work_is_not_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir(folder.path().join("out")).expect("made");
    fs::write(folder.path().join("out/thesis.tex"), "three years").expect("written");
    let output = domecast(&["build", DESIGN, "--out", "out"], folder.path());
    assert_eq!(output.status.code(), Some(1));
    assert_names(&String::from_utf8_lossy(&output.stderr), &["out", "thesis.tex", "--out"]);
    assert_eq!(listing(folder.path()), ["out/thesis.tex"]);
}

#[test]
fn usage_errors_are_told_apart_from_input_errors() {
    let folder = tempfile::tempdir().expect("a folder");
    assert_eq!(domecast(&["bake"], folder.path()).status.code(), Some(2));
    assert_eq!(domecast(&["build"], folder.path()).status.code(), Some(2));
    assert_eq!(domecast(&["--help"], folder.path()).status.code(), Some(0));
    assert_eq!(domecast(&["--version"], folder.path()).status.code(), Some(0));
}

#[test]
fn failures_are_told_as_json_on_request() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("bad.json"), "{\"version\": 7}").expect("written");
    let output = domecast(&["build", "bad.json", "--json"], folder.path());
    assert_eq!(output.status.code(), Some(1));
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON on standard output");
    assert_eq!(told["error"]["file"], "bad.json");
    assert_eq!(told["error"]["field"], "version");
    assert_eq!(told["error"]["value"], "7");
}
