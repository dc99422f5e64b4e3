//! What a new user does in the first hour: start a design, ask what a field means, make the likeliest mistakes,
//! compare, watch.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use common::domecast;
use serde_json::{Value, json};

const DESIGN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/designs/thumb24.json");
const FISHEYE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/designs/thumb24-fisheye.json");

fn said(arguments: &[&str], folder: &Path) -> String {
    let output = domecast(arguments, folder);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[test]
fn a_new_design_builds_like_the_one_it_starts_from() {
    let folder = tempfile::tempdir().expect("a folder");
    said(&["new", "mine"], folder.path());
    let text = fs::read_to_string(folder.path().join("mine.json")).expect("written");
    let schema: Value = serde_json::from_str(
        &fs::read_to_string(folder.path().join("domecast.schema.json")).expect("beside it"),
    )
    .expect("JSON");
    assert!(text.contains("\"$schema\": \"domecast.schema.json\"") && text.contains("\"why\""));
    assert!(schema["properties"]["dome"].is_object());
    let told: Value = serde_json::from_str(&said(&["compare", "mine.json", DESIGN, "--json"], folder.path()))
        .expect("JSON");
    let fields: Vec<&str> = told["fields"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|field| field["name"].as_str())
        .collect();
    assert_eq!(fields, ["name"]);
    assert_eq!(told["dots"]["surface_mm"], json!([0.0, 0.0]));
    // a second one of that name is refused, and the first is whole
    let again = domecast(&["new", "mine"], folder.path());
    assert_eq!(again.status.code(), Some(1));
    assert_eq!(fs::read_to_string(folder.path().join("mine.json")).expect("kept"), text);
    // a name that is no folder's name is refused before anything is written
    assert_eq!(domecast(&["new", "a/b"], folder.path()).status.code(), Some(1));
    // another start
    said(&["new", "wide", "--from", FISHEYE], folder.path());
    assert!(fs::read_to_string(folder.path().join("wide.json")).expect("written").contains("kannala_brandt"));
}

#[test]
fn a_sensor_of_ones_own_has_the_shape_that_is_asked_for_and_its_dots_in_the_light() {
    let folder = tempfile::tempdir().expect("a folder");
    let start = |name: &str, flags: &[&str]| -> Value {
        let own = ["new", name, "--camera", "picam2", "--out", "own.json", "--force"];
        said(&[&own, flags].concat(), folder.path());
        let text = fs::read_to_string(folder.path().join("own.json")).expect("written");
        serde_json::from_str(&text).expect("JSON")
    };
    let cap = start("cap", &["--radius", "16", "--rim-angle", "70"]);
    assert_eq!([&cap["dome"]["radius_mm"], &cap["dome"]["rim_angle_deg"]], [&json!(16.0), &json!(70.0)]);
    let pillar = start("pillar", &["--radius", "10", "--cylinder-height", "3"]);
    assert_eq!(pillar["dome"]["cylinder_height_mm"], json!(3.0));
    // The outline follows the board.
    assert_eq!(pillar["camera_body"]["kind"], json!("board"));
    let wide = start("wide", &["--radius", "20"]);
    let polar_deg = wide["pattern"]["polar_angle_deg"].as_f64().expect("inside of the shadows");
    assert!((20.0..60.0).contains(&polar_deg), "{polar_deg}");
    assert!(wide["pattern"]["why"].as_str().is_some_and(|why| why.contains("shadows")), "{wide}");
    for wrong in [["--rim-angle", "120"], ["--rim-angle", "0"]] {
        let own = ["new", "wrong", "--radius", "10", "--camera", "picam2", "--json"];
        let refused = domecast(&[&own[..], &wrong].concat(), folder.path());
        assert_eq!(refused.status.code(), Some(1), "{wrong:?}");
    }
}

#[test]
fn fields_are_explained() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = said(&["explain", "springs.wire_diameter_mm"], folder.path());
    for part in ["0.3", "paper: 0.3 mm wire", "unit: mm", "may be left out; then by a rule: "] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let needed = said(&["explain", "dome.radius_mm"], folder.path());
    assert!(needed.contains("must be there"), "{needed}");
    assert!(said(&["explain"], folder.path()).contains("white_markers"));
    let wrong = domecast(&["explain", "spring.wire"], folder.path());
    assert_eq!(wrong.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("\"springs\""));
}

#[test]
fn two_designs_are_compared() {
    let folder = tempfile::tempdir().expect("a folder");
    let told: Value =
        serde_json::from_str(&said(&["compare", DESIGN, FISHEYE, "--json"], folder.path())).expect("JSON");
    let changed = told["fields"].as_array().expect("a list");
    assert!(changed.iter().any(|field| field["name"] == "camera.model" && field["b"] == "kannala_brandt"));
    // the same pattern in the image, elsewhere on the dome
    assert!(told["dots"]["image_px"][1].as_f64().expect("px") < 1e-9);
    let on_dome_mm = told["dots"]["surface_mm"][0].as_f64().expect("mm");
    assert!((0.005..0.2).contains(&on_dome_mm), "{on_dome_mm}");
    assert!(!told["wrench_sd"].as_array().expect("a list").is_empty());
    // a folder that is no build is named
    let wrong = domecast(&["compare", ".", DESIGN], folder.path());
    assert_eq!(wrong.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("design.json"));
}

/// Ends the watching program even if a test fails.
struct Watching(Child);

impl Drop for Watching {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Waits until `holds`; gives up only where something is broken.
fn wait_until(what: &str, holds: impl Fn() -> bool) {
    for _ in 0..2400 {
        if holds() {
            return;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    panic!("{what} did not happen");
}

#[test]
fn a_watched_design_is_built_again_when_it_is_saved() {
    let folder = tempfile::tempdir().expect("a folder");
    let design = folder.path().join("d.json");
    let text = fs::read_to_string(DESIGN).expect("there");
    fs::write(&design, &text).expect("written");
    let child = Command::new(env!("CARGO_BIN_EXE_domecast"))
        .args(["build", "d.json", "--out", "out", "--watch", "--quiet"])
        .current_dir(folder.path())
        .stderr(Stdio::null())
        .spawn()
        .expect("it runs");
    let _watching = Watching(child);
    let stamp = || fs::read_to_string(folder.path().join("out/report/fresh-stamp.js")).unwrap_or_default();
    wait_until("the first build", || !stamp().is_empty());
    let first = stamp();
    let page = fs::read_to_string(folder.path().join("out/report/index.html")).expect("a page");
    assert!(page.contains("fresh-stamp.js"));
    // a fault in between leaves the result and does not end the watching
    fs::write(&design, "{ not JSON").expect("written");
    std::thread::sleep(Duration::from_millis(600));
    assert_eq!(stamp(), first);
    fs::write(&design, text.replacen("\"pitch_px\": 18", "\"pitch_px\": 19", 1)).expect("written");
    wait_until("the second build", || !stamp().is_empty() && stamp() != first);
    assert!(domecast(&["check", "out"], folder.path()).status.success());
    // a calibration that the design names is watched too
    let lens = fs::read_to_string(folder.path().join("out/constants/opencv.yaml")).expect("a calibration");
    let calibration = folder.path().join("lens.yaml");
    fs::write(&calibration, &lens).expect("written");
    let mut tree: Value = serde_json::from_str(&text).expect("JSON");
    let camera = tree["camera"].as_object_mut().expect("a camera");
    camera.retain(|key, _| ["field_of_view_deg", "position_mm", "rotation_deg"].contains(&key.as_str()));
    camera.insert("calibration".into(), "lens.yaml".into());
    let second = stamp();
    fs::write(&design, tree.to_string()).expect("written");
    wait_until("the third build", || !stamp().is_empty() && stamp() != second);
    let third = stamp();
    let moved = lens.replace("319.5", "319.75");
    assert_ne!(moved, lens);
    fs::write(&calibration, moved).expect("written");
    wait_until("the build after the calibration changed", || !stamp().is_empty() && stamp() != third);
}

#[test]
fn shells_and_manuals_get_their_text() {
    let folder = tempfile::tempdir().expect("a folder");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let text = said(&["completions", shell], folder.path());
        assert!(text.contains("domecast") && text.contains("calibrate-optics"), "{shell}");
    }
    let man = said(&["man"], folder.path());
    assert!(man.contains(".TH") && man.contains("calibrate"));
}

/// Takes as long as a quick measurement does.
#[test]
fn long_a_measurement_goes_into_the_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let told = said(&["accuracy", DESIGN, "--quick", "--out", "measured"], folder.path());
    assert!(told.contains("--accuracy measured"), "{told}");
    said(&["build", DESIGN, "--accuracy", "measured", "--out", "built"], folder.path());
    said(&["check", "built"], folder.path());
    let page = fs::read_to_string(folder.path().join("built/report/index.html")).expect("the page");
    let measured: Value = serde_json::from_str(
        &fs::read_to_string(folder.path().join("built/accuracy/accuracy.json")).expect("carried along"),
    )
    .expect("JSON");
    let chapter = page.split("<section id=\"accuracy\">").nth(1).expect("a chapter");
    let chapter = chapter.split("</section>").next().expect("its end");
    let sweeps = measured["sweeps"].as_array().expect("a list").len();
    assert!(sweeps >= 9, "{sweeps}");
    assert_eq!(chapter.matches("<img ").count(), sweeps);
    assert!(page.contains("href=\"#accuracy\"") && page.len() < 5_000_000, "{} bytes", page.len());

    let refused = |arguments: &[&str], part: &str| {
        let output = domecast(arguments, folder.path());
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert!(text.contains(part) && text.contains("domecast accuracy"), "{text}");
    };
    refused(&["build", FISHEYE, "--accuracy", "measured"], "another design");
    refused(&["build", DESIGN, "--accuracy", "built"], "not a build");
    refused(&["build", DESIGN, "--accuracy", "nowhere"], "nowhere");
    fs::write(folder.path().join("measured/lens.svg"), "<svg/>").expect("written");
    refused(&["build", DESIGN, "--accuracy", "measured"], "lens.svg");
}

/// From a shipped design by its name alone: the program carries it. Fewer frames than the scene asks for show all of it.
#[test]
fn a_scene_of_ones_own_is_drawn_from_its_start_to_its_end() {
    let folder = tempfile::tempdir().expect("a folder");
    said(&["new", "mine", "--from", "endoscope-r5"], folder.path());
    said(&["new", "press", "--scene", "mine.json"], folder.path());
    let scene: Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("press.json")).expect("written"))
            .expect("JSON");
    assert_eq!(scene["design"], "mine.json");
    let number = |field: &str| scene["frames"][field].as_f64().expect("a number");
    let (count, rate_hz) = (number("count"), number("rate_hz"));
    assert!(count > 3.0, "{scene}");
    said(&["simulate", "press.json", "--frames", "3", "--out", "out"], folder.path());
    let truth = fs::read_to_string(folder.path().join("out/truth.jsonl")).expect("truth");
    let times_s: Vec<f64> = truth
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("JSON")["time_s"].as_f64().expect("s"))
        .collect();
    let last_s = (count - 1.0) / rate_hz;
    let wanted_s = [0.0, 0.5 * last_s, last_s];
    assert_eq!(times_s.len(), 3);
    assert!(times_s.iter().zip(wanted_s).all(|(found, wanted)| (found - wanted).abs() < 1e-9), "{times_s:?}");
}
