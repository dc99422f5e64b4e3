//! What a build says of its lit sensor, tried: the noise of the markers against the tracker on noisy frames, and sensors
//! that are dark, unlit or cut off.

use std::path::PathBuf;

use domecast::Design;
use domecast::light::LightCheck;
use domecast::sim::scene::SceneFile;
use domecast::sim::{Plan, Renderer, Scene, Scratch};
use domecast::track::{CameraFrame, TrackOptions, Tracker};
use serde_json::{Value, json};

fn designs() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("designs")
}

fn thumb24() -> Value {
    let text = std::fs::read_to_string(designs().join("thumb24.json")).expect("the design");
    serde_json::from_str(&text).expect("its JSON")
}

/// The check of thumb24 with some fields changed.
fn checked(changes: &[(&str, Value)]) -> Result<LightCheck, String> {
    checked_with(thumb24(), changes)
}

fn checked_with(mut tree: Value, changes: &[(&str, Value)]) -> Result<LightCheck, String> {
    for (field, value) in changes {
        match tree.pointer_mut(field) {
            Some(place) => *place = value.clone(),
            None => {
                let (section, key) = field[1..].split_once('/').expect("a section and a key");
                tree[section][key] = value.clone();
            }
        }
    }
    let design: Design = tree.to_string().parse().map_err(|error| format!("{error}"))?;
    LightCheck::of(&design).map_err(|error| error.to_string())
}

// The bound comes from contrast and outline alone; the tracker reads frames that were drawn and given noise pixel by pixel.
#[test]
fn markers_are_tracked_as_well_as_the_lit_frame_says() {
    // Equal read noise in the three colours; their weighted mean is the grey that is read.
    let channel_levels = 1.5_f64;
    let grey_levels = channel_levels * [0.299_f64, 0.587, 0.114].iter().map(|w| w * w).sum::<f64>().sqrt();
    let check = checked(&[("/exposure/pixel_noise_levels", json!(grey_levels))]).unwrap();
    let full = 1e6;
    let file: SceneFile = serde_json::from_value(json!({
        "version": 1, "name": "noise", "design": "thumb24.json",
        "frames": { "count": 80, "rate_hz": 30 },
        "tolerance": { "px": 0.05, "grey": 1 },
        "light": { "surround_level": 0.02, "leds": {
            "level_per_mw_mm2": check.report.level_per_mw_mm2, "stray_level": 0.005, "crosstalk": 0.08 } },
        "electronics": { "noise": {
            "full_scale_electrons": full, "read_electrons": channel_levels / 255.0 * full } },
    }))
    .unwrap();
    let design = Design::load(&designs().join("thumb24.json")).unwrap();
    let constants = domecast::constants::of(&design, &design.layout().unwrap()).unwrap();
    let scene = Scene::new(file, &designs(), design).unwrap();
    let renderer = Renderer::new(&scene, &Plan::everything(&scene).unwrap()).unwrap();
    let mut tracker = Tracker::new(&constants, TrackOptions::default()).unwrap();
    let (mut sums, mut scratch) = (vec![[0.0; 4]; 4], Scratch::default());
    for number in 0..scene.frame_count() {
        let image = renderer.frame_around(number, None, &mut scratch).unwrap().image.unwrap();
        let frame = CameraFrame::new(image.width, image.height, image.channels, &image.bytes).unwrap();
        let tracked = tracker.track(number.into(), &frame);
        for (sum, marker) in sums.iter_mut().zip(&tracked.white_markers) {
            let at = marker.centroid_px.unwrap();
            *sum = [sum[0] + at.x, sum[1] + at.y, sum[2] + at.x * at.x, sum[3] + at.y * at.y];
        }
    }
    let count = f64::from(scene.frame_count());
    for (marker, [x, y, xx, yy]) in check.report.markers.iter().zip(sums) {
        let variance = |sum: f64, square: f64| square / count - (sum / count).powi(2);
        let found_px = (0.5 * (variance(x, xx) + variance(y, yy))).sqrt();
        let ratio = found_px / marker.centroid_sd_px;
        assert!(
            (0.75..1.25).contains(&ratio),
            "marker {}: {found_px} of {}",
            marker.id,
            marker.centroid_sd_px
        );
    }
}

/// A dome of 20 mm over a Raspberry Pi camera, left to rules, whose dots end at a polar angle.
fn over_picam(polar_deg: f64) -> Design {
    let design = json!({
        "version": 1, "name": "over-picam", "camera": { "from": "picam2" }, "camera_body": { "from": "picam2" },
        "dome": { "radius_mm": 20 }, "pattern": { "polar_angle_deg": polar_deg },
    });
    design.to_string().parse().expect("a design by rules")
}

/// Markers of 1.6 mm are 40 px wide there; dots on the edges of the lights' shadows were tracked up to 0.75 px off.
#[test]
fn wide_markers_and_dots_inside_of_the_shadows_are_tracked() {
    let wide = LightCheck::of(&over_picam(60.0)).unwrap();
    let edges = wide.report.edges.unwrap();
    let polar_deg = edges.from_polar_deg.unwrap().floor();
    assert!(edges.dots > 5 && polar_deg > 20.0, "{edges:?}");
    assert!(wide.warnings.iter().any(|(field, _)| field == "pattern.polar_angle_deg"), "{:?}", wide.warnings);
    let design = over_picam(polar_deg);
    let check = LightCheck::of(&design).unwrap();
    assert_eq!(check.report.edges.map(|edges| edges.dots), Some(0));
    let file: SceneFile = serde_json::from_value(json!({
        "version": 1, "name": "rest", "design": "", "frames": { "count": 1, "rate_hz": 30 },
        "tolerance": { "px": 0.05, "grey": 1 },
        "light": { "surround_level": 0.02, "leds": {
            "level_per_mw_mm2": check.report.level_per_mw_mm2, "stray_level": 0.005, "crosstalk": 0.08 } },
    }))
    .unwrap();
    let constants = domecast::constants::of(&design, &design.layout().unwrap()).unwrap();
    let scene = Scene::new(file, &designs(), design).unwrap();
    let renderer = Renderer::new(&scene, &Plan::everything(&scene).unwrap()).unwrap();
    let drawn = renderer.frame_around(0, None, &mut Scratch::default()).unwrap();
    let image = drawn.image.unwrap();
    let frame = CameraFrame::new(image.width, image.height, image.channels, &image.bytes).unwrap();
    let mut tracker = Tracker::new(&constants, TrackOptions::default()).unwrap();
    let tracked = tracker.track(0, &frame);
    assert!(tracked.white_markers.iter().all(|marker| marker.centroid_px.is_some()), "{}", tracked.status());
    for (dot, truth) in tracked.black_dots.iter().zip(&drawn.truth.black_dots) {
        let off_px = dot.centroid_px.map(|at| at.distance(truth.centroid_px.unwrap().into()));
        assert!(off_px.is_some_and(|off| off < 0.3), "dot {}: {off_px:?}", dot.id);
    }
}

/// The tracker follows the dim scene, and says of every frame of one with a fifth of its light that it does not.
#[test]
fn the_dim_scene_is_tracked_and_the_one_that_is_too_dim_is_named() {
    let design = Design::load(&designs().join("thumb24.json")).unwrap();
    let constants = domecast::constants::of(&design, &design.layout().unwrap()).unwrap();
    for (name, is_tracked) in [("dim", true), ("too-dim", false)] {
        let scene = Scene::load(&designs().join(format!("scenes/{name}.json"))).unwrap();
        let renderer = Renderer::new(&scene, &Plan::of(&scene).unwrap()).unwrap();
        let mut tracker = Tracker::new(&constants, TrackOptions::default()).unwrap();
        let mut scratch = Scratch::default();
        for number in 0..8 {
            let drawn = renderer.frame_around(number, None, &mut scratch).unwrap();
            let image = drawn.image.unwrap();
            let frame = CameraFrame::new(image.width, image.height, image.channels, &image.bytes).unwrap();
            let tracked = tracker.track(number.into(), &frame);
            assert_eq!(tracked.status() == "ok", is_tracked, "{name} {number}: {}", tracked.status());
            if is_tracked {
                let off_n = tracked.wrench.unwrap().force_n.z - drawn.truth.wrench[2];
                assert!(off_n.abs() < 0.3, "{name} {number}: {off_n} N");
            }
        }
    }
}

#[test]
fn a_sensor_without_light_is_refused_with_the_field() {
    let dark = checked(&[("/leds/list", json!([]))]).unwrap_err();
    assert!(dark.contains("leds.list"), "{dark}");
    let off = checked(&[("/leds/radiant_flux_mw", json!({ "r": 0, "g": 0, "b": 0 }))]).unwrap_err();
    assert!(off.contains("leds.list") && off.contains("flux"), "{off}");
}

#[test]
fn a_dark_dome_is_refused_and_the_named_flux_cures_it() {
    let weak = checked(&[("/leds/radiant_flux_mw", json!({ "r": 0.02, "g": 0.02, "b": 0.02 }))]).unwrap_err();
    assert!(weak.starts_with("`leds.radiant_flux_mw`"), "{weak}");
    let named =
        weak.split("leds.radiant_flux_mw = ").nth(1).and_then(|rest| rest.split(" would").next()).unwrap();
    let cured = checked(&[("/leds/radiant_flux_mw", named.parse().unwrap())]);
    // The dome is then bright enough; the markers, dimmer than it, may still be named.
    assert!(!matches!(&cured, Err(error) if error.starts_with("`leds.radiant_flux_mw`")), "{cured:?}");
}

#[test]
fn a_key_in_the_edge_of_a_shadow_is_refused_and_the_named_pattern_cures_it() {
    let mut tree = json!({
        "version": 1, "name": "small", "camera": { "from": "uvc38" }, "camera_body": { "from": "uvc38" },
        "dome": { "radius_mm": 4.06 }, "pattern": { "kind": "rings" }, "mount": { "kind": "rigid" },
        "process": { "min_wall_mm": 1 }, "mould": { "fill": { "diameter_mm": 1.07 } }
    });
    let judged = |tree: &Value| LightCheck::of(&tree.to_string().parse::<Design>().expect("the design"));
    let hidden = judged(&tree).unwrap_err();
    assert!(hidden.to_string().contains("left out as the pattern's key"), "{hidden}");
    let cure = hidden.cure.expect("a change");
    assert_eq!(cure.field, "pattern.polar_angle_deg");
    tree["pattern"]["polar_angle_deg"] = cure.value.clone();
    assert!(judged(&tree).is_ok());
}

#[test]
fn what_is_cut_off_in_shadow_or_dim_is_a_warning_with_its_number() {
    let warned = |check: &LightCheck, field: &str, word: &str| {
        check.warnings.iter().any(|(at, message)| at == field && message.contains(word))
    };
    let near_lights: Value = serde_json::from_str(include_str!("common/near-lights.json")).expect("its JSON");
    let shadowed = checked_with(near_lights, &[]).unwrap();
    assert!(warned(&shadowed, "leds.lip_top_z_mm", "shadow"), "{:?}", shadowed.warnings);
    let usual = checked(&[]).unwrap();
    assert!(!warned(&usual, "leds.lip_top_z_mm", "shadow"), "{:?}", usual.warnings);
    assert!(warned(&usual, "white_markers.reflectance", "threshold"), "{:?}", usual.warnings);
    assert_eq!(usual.report.dome.saturated_share, 0.0);
    let bright = checked(&[("/exposure/level_per_mw_mm2", json!(1200))]).unwrap();
    assert!(warned(&bright, "exposure.level_per_mw_mm2", "full scale"), "{:?}", bright.warnings);
    assert!(bright.report.dome.saturated_share > 0.1);
    // The exposure is a factor on everything.
    let double =
        checked(&[("/exposure/level_per_mw_mm2", json!(2.0 * usual.report.level_per_mw_mm2))]).unwrap();
    let ratio =
        (double.report.dome.median_level - 255.0 * 0.005) / (usual.report.dome.median_level - 255.0 * 0.005);
    assert!((ratio - 2.0).abs() < 1e-6, "{ratio}");
}
