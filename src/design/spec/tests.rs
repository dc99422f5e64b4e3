//! The check of design texts, in memory; what a person sees is in `tests/cli_bad_input.rs`.

use super::*;
use std::str::FromStr;

const THUMB24: &str = include_str!("../../../designs/thumb24.json");

#[test]
fn thumb24_resolves() {
    let design = Design::from_str(THUMB24).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(design.name(), "thumb24");
    let [low, high] = design.bounds_mm();
    assert!(((high - low) - glam::DVec3::new(24.0, 24.0, 26.0)).length() < 1e-9);
    assert_eq!(design.springs_at_mm().len(), 6);
    assert!((design.lower_top_z_mm() - (-7.3 - 5.0)).abs() < 1e-12, "one free spring length below");
    // the lens model ends beyond the mask: a fact; inside of it: a fault to look at
    assert!(design.warnings().is_empty(), "{:?}", design.warnings());
    assert!(design.notes()[0].contains("up to 61.1 degrees, where it folds"), "{:?}", design.notes());
    let wide = THUMB24.replacen("\"mask_field_angle_deg\": 60", "\"mask_field_angle_deg\": 62", 1);
    let wide = Design::from_str(&wide).unwrap_or_else(|error| panic!("{error}"));
    assert!(wide.notes().is_empty());
    assert_eq!(wide.warnings()[0].field, "camera.distortion");
}

#[test]
fn other_sections_do_not_matter_to_the_optics() {
    let minimal = r#"{
        "name": "x",
        "camera": { "model": "pinhole", "width": 640, "height": 480, "distortion": [],
                    "matrix": [[300, 0, 320], [0, 300, 240], [0, 0, 1]],
                    "field_of_view_deg": 160, "position_mm": [0, 0, -5], "rotation_deg": [0, 0, 0] },
        "optics": { "layers": [ { "name": "acrylic", "index": 1.49, "thickness_mm": 1.0 },
                                { "name": "silicone", "index": 1.41 } ] },
        "dome": { "radius_mm": 10 },
        "pattern": { "anything": 1 }, "springs": null
    }"#;
    let optics = optics_from_text(minimal).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(optics.air_gap_mm(), 4.0);
    assert_eq!(optics.dome_radius_mm(), 10.0);
    let fault = optics_from_text(&minimal.replace("\"radius_mm\"", "\"radius\"")).unwrap_err();
    assert_eq!(fault.field, "dome.radius");
}

#[test]
fn rotation_is_rz_ry_rx() {
    let turned = THUMB24.replace("\"rotation_deg\": [0, 0, 0]", "\"rotation_deg\": [1, 2, 3]");
    let design = Design::from_str(&turned).unwrap_or_else(|error| panic!("{error}"));
    let [a, b, c] = [1.0_f64, 2.0, 3.0].map(f64::to_radians);
    // the third column of Rz(c) Ry(b) Rx(a), multiplied out by hand
    let axis = glam::DVec3::new(
        c.cos() * b.sin() * a.cos() + c.sin() * a.sin(),
        c.sin() * b.sin() * a.cos() - c.cos() * a.sin(),
        b.cos() * a.cos(),
    );
    assert!((design.sensor_from_camera().vector(glam::DVec3::Z) - axis).length() < 1e-15);
}
