//! Random designs, from tiny to large: for tests of this crate and of those above it.

use proptest::prelude::RngExt;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use serde_json::{Value, json};

/// Multiplies every length of a section tree by `scale`.
pub fn scale_lengths(value: &mut Value, scale: f64, is_length: bool) {
    match value {
        Value::Object(map) => {
            for (key, inner) in map.iter_mut() {
                let named = key.ends_with("_mm");
                scale_lengths(inner, scale, named || (is_length && inner.is_array()));
            }
        }
        Value::Array(list) => list.iter_mut().for_each(|inner| scale_lengths(inner, scale, is_length)),
        Value::Number(number) if is_length => *value = json!(number.as_f64().unwrap() * scale),
        _ => {}
    }
}

/// Stiffness grows with the size, forces with its square.
pub fn scale_grip(design: &mut Value, scale: f64) {
    let grip = &mut design["magnets"]["grip_force_n"];
    *grip = json!(grip.as_f64().unwrap() * scale * scale);
}

fn random_design(rng: &mut TestRng, index: usize) -> Value {
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/common/near-lights.json"))
            .unwrap();
    let mut d: Value = serde_json::from_str(&text).unwrap();
    // thumb24 has no room for a cable's channel and set screws all round: most designs have the one and two of the others
    d["platforms"]["lower"]["cable_exit"] = json!({ "azimuth_deg": 180, "width_mm": 3.2, "height_mm": 2.5 });
    let size_mm = rng.random_range(12.0..60.0_f64);
    let scale = size_mm / 24.0;
    scale_lengths(&mut d, scale, false);
    d["name"] = json!(format!("random-{index}"));
    // Loads that press the springs as far as the scaled original's, magnets that hold as far.
    scale_grip(&mut d, scale);
    for claim in d["loads"]["claims"].as_array_mut().unwrap() {
        for x in claim["force_n"].as_array_mut().unwrap() {
            *x = json!(x.as_f64().unwrap() * scale * scale * 0.8);
        }
        claim.as_object_mut().unwrap().remove("moment_nmm");
    }
    let n = rng.random_range(3..=8_u32);
    let step = 360.0 / f64::from(n);
    // Gaps between springs at multiples of the step; with four springs off
    // the markers' diagonals half of the time.
    let first = if n == 4 && rng.random_bool(0.5) { 0.0 } else { 0.5 * step };
    d["springs"]["places"]["ring"]["count"] = json!(n);
    d["springs"]["places"]["ring"]["first_azimuth_deg"] = json!(first);
    let gaps: Vec<f64> = (0..n).map(|k| (first + step * (f64::from(k) + 0.5)) % 360.0).collect();
    // LEDs where there is room behind them, clamps and cable in other gaps.
    let (mut used, mut free): (Vec<f64>, Vec<f64>) = gaps.iter().partition(|gap| {
        n <= 6 && [0.0, 90.0, 120.0, 180.0, 240.0, 270.0].iter().any(|good| (*gap - good).abs() < 1e-9)
    });
    while used.len() > rng.random_range(0..5_usize) {
        free.extend(used.pop());
    }
    let colors = ["red", "green", "blue", "white"];
    d["leds"]["list"] =
        used.iter().enumerate().map(|(k, gap)| json!({"color": colors[k % 4], "azimuth_deg": gap})).collect();
    d["leds"]["tilt_deg"] = json!(rng.random_range(84.0..88.0_f64));
    let lower = &mut d["platforms"]["lower"];
    match free.pop() {
        Some(gap) => lower["cable_exit"]["azimuth_deg"] = json!(gap),
        None => lower["cable_exit"]["width_mm"] = json!(0.0),
    }
    free.truncate(rng.random_range(0..3_usize));
    lower["clamp"]["azimuth_deg"] = json!(free);
    if rng.random_bool(0.3) {
        lower["cable_exit"]["width_mm"] = json!(0.0);
    }
    if rng.random_bool(0.3) {
        lower["wire_hole_diameter_mm"] = json!(0.0);
        d["leds"]["wire_hole_diameter_mm"] = json!(0.0);
    }
    if rng.random_bool(0.3) {
        d["magnet_pockets"]["push_out_diameter_mm"] = json!(0.0);
    }
    if rng.random_bool(0.2) {
        d["platforms"]["upper"]["rim_height_mm"] = json!(0.0);
    }
    d["mould"]["vents"]["count"] = json!(rng.random_range(0..9_u32));
    d["mould"]["vents"]["first_azimuth_deg"] = json!(rng.random_range(0.0..90.0_f64));
    d["coupon"]["steps"] = json!(rng.random_range(1..5_u32));
    d["mesh"]["chord_tolerance_mm"] = json!(rng.random_range(0.01..0.1_f64));
    d["mesh"]["optical_chord_tolerance_mm"] = json!(rng.random_range(0.01..0.1_f64));
    // Every third keeps the real printer's limits, which small ones must fail.
    if index.is_multiple_of(3) {
        d["process"]["min_wall_mm"] = json!(0.6);
        d["process"]["min_hole_diameter_mm"] = json!(0.5);
    }
    d["process"]["build_volume_mm"] = json!([400.0, 400.0, 200.0]);
    d
}

/// The first designs of the sweep, always the same.
pub fn random_designs(count: usize) -> impl Iterator<Item = Value> {
    let mut runner =
        TestRunner::new_with_rng(Config::default(), TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]));
    let mut rng = runner.new_rng();
    (0..count).map(move |index| random_design(&mut rng, index))
}
