//! Dots and patterns that are left out or refused, each by name.

use glam::{DMat3, DVec2, DVec3};

use super::super::*;
use super::{optics, spec};
use domecast_optics::camera::LensModel;

#[test]
fn a_dot_that_the_lens_cannot_see_is_refused_by_name() {
    let mut wide =
        spec(LensModel::BrownConrady, serde_json::json!({"image_radius_px": 260.0, "polar_angle_deg": null}));
    wide.mask = None;
    let error = Layout::new(&wide).unwrap_err();
    assert_eq!(error.field, "pattern.unseen");
    assert!(error.problem.contains("misses_dome") && error.problem.contains("pixel ("), "{error}");
    wide.pattern.unseen = crate::spec::sections::OnLost::Drop;
    wide.pattern.unprintable = crate::spec::sections::OnLost::Drop;
    let layout = Layout::new(&wide).unwrap();
    assert!(!layout.lost.is_empty());
    let names: std::collections::BTreeSet<&str> = layout.lost.iter().map(|dot| dot.reason.as_str()).collect();
    assert!(names.contains("misses_dome") && names.contains("beyond_wrap_limit"), "{names:?}");
    for (id, dot) in (layout.dots.len() as u32..).zip(&layout.lost) {
        assert_eq!(dot.id, id);
    }
    // A parallel that the lens does not reach is an error of the field that asks for it.
    let mut narrow = spec(LensModel::BrownConrady, serde_json::json!({"polar_angle_deg": 80.0}));
    narrow.optics = optics(LensModel::BrownConrady, DVec3::new(0.0, 0.0, -3.0), DMat3::IDENTITY);
    let error = Layout::new(&narrow).unwrap_err();
    assert_eq!(error.field, "pattern.polar_angle_deg");
    assert!(error.problem.contains("beyond_fold"), "{error}");
}

#[test]
fn dots_that_touch_are_refused() {
    let error =
        Layout::new(&spec(LensModel::Pinhole, serde_json::json!({"dot_diameter_px": 16.0}))).unwrap_err();
    assert_eq!(error.field, "pattern.dot_diameter_px");
    let change = serde_json::json!({"dot_diameter_px": null, "dot_diameter_mm": 1.1});
    let error = Layout::new(&spec(LensModel::Pinhole, change)).unwrap_err();
    assert_eq!(error.field, "pattern.unprintable");
    assert!(error.problem.contains("gap"), "{error}");
}

#[test]
fn white_markers_and_zones_take_dots_away() {
    let change = serde_json::json!({
        "unseen": "drop",
        "keep_out": {"pole_deg": 10.0, "rim_deg": 40.0, "white_marker_margin_px": 4.0,
                     "image_discs": [{"center_px": [250.0, 240.0], "radius_px": 20.0}]},
    });
    let mut spec = spec(LensModel::KannalaBrandt, change);
    spec.white_markers = vec![domecast_optics::pose::Marker {
        id: 3,
        position_mm: DVec3::new(3.0, 3.0, 0.0),
        diameter_mm: 1.0,
    }];
    let layout = Layout::new(&spec).unwrap();
    let reasons: std::collections::BTreeSet<&str> =
        layout.lost.iter().map(|dot| dot.reason.as_str()).collect();
    let expected = [
        "hidden_by_white_marker",
        "keep_out_image_disc",
        "keep_out_pole",
        "keep_out_rim",
        "keep_out_white_marker",
    ];
    assert_eq!(reasons.into_iter().collect::<Vec<_>>(), expected);
    let marker_px = spec.optics.project(DVec3::new(3.0, 3.0, 0.0)).unwrap();
    for dot in &layout.dots {
        assert!(dot.polar_rad() > 10f64.to_radians() && dot.polar_rad() < 50f64.to_radians());
        assert!(dot.image_px.distance(DVec2::new(250.0, 240.0)) > 20.0);
        assert!(dot.image_px.distance(marker_px) > 12.0);
    }
}

#[test]
fn nonsense_gets_a_named_error() {
    for (change, field) in [
        (serde_json::json!({"pitch_px": f64::MAX}), "pattern.pitch_px"),
        (serde_json::json!({"pitch_px": 1e-9, "dot_diameter_px": 1e-10}), "pattern.pitch_px"),
        (serde_json::json!({"count": 5}), "pattern.pitch_px"),
        (serde_json::json!({"pitch_px": null}), "pattern.pitch_px"),
        (serde_json::json!({"dot_diameter_px": null}), "pattern.dot_diameter_px"),
        (serde_json::json!({"dot_diameter_px": -1.0}), "pattern.dot_diameter_px"),
        (serde_json::json!({"polar_angle_deg": null}), "pattern.polar_angle_deg"),
    ] {
        match Layout::new(&spec(LensModel::KannalaBrandt, change.clone())) {
            Err(error) => assert_eq!(error.field, field, "{change}: {error}"),
            Ok(layout) => panic!("{change}: {} dots", layout.dots.len()),
        }
    }
}
