//! Designs and scenes that plans are tried on.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use domecast_design::Design;
use domecast_optics::numeric::SeededRandom;
use serde_json::{Value, json};

/// From a seed: even in the logarithm between two bounds.
pub(super) fn log_between(random: &mut SeededRandom, low: f64, high: f64) -> f64 {
    random.between(low.ln(), high.ln()).exp()
}

/// thumb24 through a quarter of its pixels, changed by a closure.
pub(super) fn small_design(change: &dyn Fn(&mut Value)) -> Design {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs/thumb24.json");
    let mut value = domecast_design::parse_json(&domecast_design::read_text(&path).unwrap()).unwrap();
    let camera = &mut value["camera"];
    camera["width"] = json!(160);
    camera["height"] = json!(120);
    camera["matrix"] = json!([[57.295, 0, 79.5], [0, 57.295, 59.5], [0, 0, 1]]);
    value["runtime"]["mask_radius_px"] = json!(60);
    value["pattern"]["pitch_px"] = json!(10);
    value["pattern"]["dot_diameter_px"] = json!(4);
    change(&mut value);
    Design::from_str(&value.to_string()).unwrap_or_else(|error| panic!("{error}"))
}

/// Each part of a real camera now and then, from hardly any to a lot of it.
pub(super) fn camera_of(random: &mut SeededRandom, scene: &mut Value) {
    let colour = scene["frames"]["colour"] == json!(true);
    let electronics = &mut scene["electronics"];
    if random.uniform() < 0.25 {
        electronics["vignetting_exponent"] = json!(log_between(random, 1e-4, 3.0));
    }
    if random.uniform() < 0.2 {
        let focus = json!({ "pupil_diameter_mm": log_between(random, 0.003, 0.3), "distance_mm": random.between(10.0, 20.0) });
        electronics["focus"] = focus;
    }
    if random.uniform() < 0.25 {
        let readout = if random.uniform() < 0.5 { log_between(random, 1e-5, 0.02) } else { 0.0 };
        electronics["shutter"] =
            json!({ "exposure_s": log_between(random, 1e-5, 0.02), "readout_s": readout });
    }
    if colour && random.uniform() < 0.2 {
        electronics["bayer"] = json!("grbg");
    }
    if random.uniform() < 0.2 {
        let noise = json!({ "full_scale_electrons": log_between(random, 1e3, 1e7), "read_electrons": log_between(random, 0.1, 20.0) });
        electronics["noise"] = noise;
    }
    if random.uniform() < 0.15 {
        electronics["jpeg_quality"] = json!(50 + (random.uniform() * 50.0) as u32);
    }
}

pub(super) fn apart(a: Option<[f64; 2]>, b: Option<[f64; 2]>) -> f64 {
    match (a, b) {
        (Some(a), Some(b)) => (a[0] - b[0]).hypot(a[1] - b[1]),
        (None, None) => 0.0,
        _ => f64::INFINITY,
    }
}

/// The shipped scenes.
pub(super) fn shipped() -> Vec<PathBuf> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs/scenes");
    let mut found: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    found.retain(|path| path.extension().is_some_and(|end| end == "json"));
    found.sort();
    found
}

/// thumb24 with other lights, tapes, reflectances.
pub(super) fn lit_designs() -> Vec<Design> {
    (0..8)
        .map(|seed| {
            let mut random = SeededRandom::new(seed + 77);
            let [lobe, lambert, width, passes] = [(1.0, 4.0), (0.1, 0.9), (10.0, 50.0), (0.4, 0.9)]
                .map(|(low, high)| random.between(low, high));
            let reflectance = log_between(&mut random, 0.02, 0.7);
            small_design(&|value: &mut Value| {
                value["leds"]["lobe_exponent"] = json!(lobe);
                value["leds"]["diffuser"]["lambert_fraction"] = json!(lambert);
                value["leds"]["diffuser"]["lobe_width_deg"] = json!(width);
                value["leds"]["diffuser"]["transmittance"] = json!(passes);
                let tint = |part: f64| json!(reflectance * part);
                value["elastomer"]["membrane_reflectance"] =
                    json!({ "r": tint(1.0), "g": tint(0.9), "b": tint(0.8) });
            })
        })
        .collect()
}

/// A scene under the lights, in motion or touched now and then, with parts of a real camera.
pub(super) fn lit_scene(random: &mut SeededRandom) -> Value {
    let mut scene = json!({
        "version": 1, "name": "random", "design": "thumb24.json",
        "frames": { "count": 3, "rate_hz": 30, "colour": random.uniform() < 0.8 },
        "tolerance": { "px": log_between(random, 1e-2, 0.5), "grey": log_between(random, 0.5, 60.0) },
        "light": { "surround_level": random.between(0.0, 0.1) },
        "electronics": { "gamma": if random.uniform() < 0.2 { random.between(1.0, 2.2) } else { 1.0 } },
        "ink": {
            "reflectance": random.between(0.02, 0.2),
            "edge_mm": if random.uniform() < 0.3 { log_between(random, 0.01, 0.2) } else { 0.0 },
        },
        "seed": (random.uniform() * 1e6) as u64,
    });
    if random.uniform() < 0.8 {
        scene["light"]["leds"] = json!({
            "level_per_mw_mm2": log_between(random, 40.0, 1500.0),
            "stray_level": random.between(0.0, 0.02),
            "crosstalk": random.between(0.0, 0.15),
        });
    }
    camera_of(random, &mut scene);
    if random.uniform() < 0.15 {
        scene["electronics"]["sharpening"] =
            json!({ "amount": random.between(0.1, 1.5), "radius_px": random.between(0.5, 3.0) });
    }
    if random.uniform() < 0.15 {
        let level = log_between(random, 1e-3, 1.0);
        scene["electronics"]["defects"] = json!({
            "hot_per_million": log_between(random, 100.0, 1e4), "hot_level": [0.1 * level, level],
        });
    }
    let kind = random.uniform();
    if kind < 0.35 {
        let depth_mm = random.between(0.05, 1.5);
        let aside_mm = random.between(-3.0, 3.0);
        let radius_mm = random.between(2.5, 6.0);
        scene["contact"] = json!({ "level": "geometric" });
        let height_mm = (100.0 - aside_mm * aside_mm).sqrt() + radius_mm;
        scene["objects"] = json!([{ "name": "ball", "shape": { "kind": "sphere", "radius_mm": radius_mm }, "path": [
            { "time_s": 0, "position_mm": [aside_mm, 0, height_mm + 0.5] },
            { "time_s": 0.06, "position_mm": [aside_mm, 0, height_mm - depth_mm] },
        ]}]);
    } else if kind < 0.7 {
        let size = log_between(random, 0.02, 1.0);
        let mut three = |scale: f64| json!([0, 1, 2].map(|_| scale * size * random.between(-1.0, 1.0)));
        let (shift, turn) = (three(0.4), three(1.5));
        scene["motion"] = json!({ "pose": [
            { "time_s": 0 }, { "time_s": 0.06, "translation_mm": shift, "rotation_deg": turn },
        ]});
    }
    scene
}
