//! What tolerances and loads do to a pattern.

use std::str::FromStr;

use glam::{DMat3, DVec2, DVec3};

use super::super::*;
use super::spec;
use crate::spec::sections::TolerancesSection;
use domecast_optics::camera::LensModel;
use domecast_optics::numeric::Rigid;

/// No tolerance but those of `change`.
fn tolerances(change: serde_json::Value) -> TolerancesSection {
    let mut json = serde_json::json!({
        "pupil_mm": [0.0, 0.0, 0.0], "camera_rotation_deg": [0.0, 0.0, 0.0], "dome_radius_mm": 0.0,
        "layer_thickness_mm": 0.0, "index": 0.0, "white_marker_mm": 0.0, "black_dot_mm": 0.0,
        "print_registration_mm": 0.0, "print_rotation_deg": 0.0, "print_scatter_mm": 0.0,
        "wire_diameter_mm": 0.0, "spring_diameter_mm": 0.0, "active_coils": 0.0, "modulus_percent": 0.0,
        "camera_drift_mm": 0.0, "camera_drift_deg": 0.0, "samples": 40, "seed": 5,
    });
    for (key, value) in change.as_object().unwrap() {
        json[key] = value.clone();
    }
    serde_json::from_value(json).unwrap()
}

/// Each pass is registered by itself: an offset on its plate and a turn about its own axis. What they do to the distance
/// of two neighbours of different passes is computed here from the plates alone.
#[test]
fn each_print_pass_has_its_own_registration() {
    let mut spec =
        spec(LensModel::KannalaBrandt, serde_json::json!({"polar_angle_deg": 75.0, "pitch_px": 18.0}));
    spec.print.wrap_limit_deg = 80.0;
    let one = Layout::new(&spec).unwrap();
    spec.print.wrap_limit_deg = 45.0;
    spec.print.hits = crate::spec::sections::PrintPasses::Split;
    let split = Layout::new(&spec).unwrap();
    assert!(one.passes.len() == 1 && split.passes.len() > 3 && one.dots.len() == split.dots.len());
    let added = |layout: &Layout, change: serde_json::Value, name: &str| {
        let report = tolerances::under_tolerances(&spec, layout, &tolerances(change)).unwrap();
        assert_eq!(report.blind, 0);
        report.ranking.iter().find(|share| share.tolerance == name).unwrap().clone()
    };
    let offset = |layout: &Layout| {
        added(layout, serde_json::json!({"print_registration_mm": 0.02}), "print_registration_mm")
    };
    let turn =
        |layout: &Layout| added(layout, serde_json::json!({"print_rotation_deg": 0.3}), "print_rotation_deg");
    // One pass moves as a whole; several come apart at their borders.
    assert!(offset(&split).added_variation > 2.0 * offset(&one).added_variation);
    assert!(turn(&split).added_variation > 2.0 * turn(&one).added_variation);
    // A turn moves a dot by its distance from the pass's axis: E|angle| = sd sqrt(2 / pi).
    for layout in [&one, &split] {
        let step = 1e-4;
        let moved = |dot: &Dot| {
            let plate = DVec2::from_angle(step).rotate(dot.plate_mm);
            let on_pass = layout.transfer.dome_from_plate(plate).unwrap();
            let surface = layout.passes[dot.pass].pass_from_sensor.transpose() * on_pass;
            spec.optics.project(surface).unwrap().distance(dot.image_px) / step
        };
        let lever_px = layout.dots.iter().map(moved).sum::<f64>() / layout.dots.len() as f64;
        let want_px = lever_px * 0.3_f64.to_radians() * (2.0 / std::f64::consts::PI).sqrt();
        // 40 sensors know a mean of |angle| to 0.6 / sqrt(40) of the spread for one pass
        let found_px = turn(layout).mean_shift_px;
        assert!((found_px / want_px - 1.0).abs() < 0.3, "{found_px} {want_px}");
    }
}

#[test]
fn tolerances_show_what_they_do() {
    let spec = spec(LensModel::KannalaBrandt, serde_json::json!({"polar_angle_deg": 50.0}));
    let layout = Layout::new(&spec).unwrap();
    // Without tolerances nothing moves.
    let none = tolerances::under_tolerances(&spec, &layout, &tolerances(serde_json::json!({}))).unwrap();
    assert!(none.nearest_variation_p95 < 1e-9 && none.mean_shift_px < 1e-9, "{none:?}");
    // A turn of the camera about its axis turns the image and leaves it even.
    let turned = tolerances(serde_json::json!({"camera_rotation_deg": [0.0, 0.0, 1.0]}));
    let turned = tolerances::under_tolerances(&spec, &layout, &turned).unwrap();
    assert!(turned.nearest_variation_p95 < 1e-9 && turned.mean_shift_px > 0.3, "{turned:?}");
    // Scatter on the plate shows in the image at about 13 px per mm, and is named first.
    let scatter = tolerances(serde_json::json!({"print_scatter_mm": 0.05, "dome_radius_mm": 0.01}));
    let scatter = tolerances::under_tolerances(&spec, &layout, &scatter).unwrap();
    assert_eq!(scatter.ranking[0].tolerance, "print_scatter_mm");
    assert!((0.4..1.2).contains(&scatter.mean_shift_px), "{scatter:?}");
    assert_eq!(scatter.blind, 0);
    assert_eq!(
        Some(&scatter),
        tolerances::under_tolerances(
            &spec,
            &layout,
            &tolerances(serde_json::json!({"print_scatter_mm": 0.05, "dome_radius_mm": 0.01}))
        )
        .as_ref()
    );
}

#[test]
fn coverage_shrinks_as_the_camera_comes_closer() {
    let spec = spec(LensModel::BrownConrady, serde_json::json!({}));
    let layout = Layout::new(&spec).unwrap();
    let rest = coverage::coverage(&spec, &layout, &spec.optics, None);
    assert_eq!((rest.seen_by_lens, rest.on_raster, rest.in_mask), (1.0, 1.0, 1.0));
    assert_eq!(rest.whole_to_deg, 90.0);
    assert!(rest.unseen_dots.is_empty());
    let pressed = Rigid::from_translation(DVec3::new(0.0, 0.0, -7.5));
    let pressed = spec.optics.at_pose(&pressed).unwrap();
    let under = coverage::coverage(&spec, &layout, &pressed, None);
    assert!(under.seen_by_lens < 0.9 && under.whole_to_deg < 80.0, "{under:?}");
    assert!(under.in_mask <= under.on_raster && under.on_raster <= under.seen_by_lens);
}

#[test]
fn a_load_that_hides_dots_says_which_and_why() {
    // A marker beside the dots at rest; as the sheet comes nearer, it moves outwards faster than they do.
    let mut spec = spec(LensModel::KannalaBrandt, serde_json::json!({"unseen": "drop"}));
    spec.white_markers = vec![domecast_optics::pose::Marker {
        id: 2,
        position_mm: DVec3::new(3.1, 2.8, 0.0),
        diameter_mm: 1.0,
    }];
    let layout = Layout::new(&spec).unwrap();
    let rest = coverage::coverage(&spec, &layout, &spec.optics, None);
    assert!(rest.unseen_dots.is_empty(), "{:?}", rest.unseen_dots);
    assert!(rest.in_sight < rest.in_mask);
    let pressed = Rigid::from_translation(DVec3::new(0.0, 0.0, -4.0));
    let pressed = spec.optics.at_pose(&pressed).unwrap();
    let under = coverage::coverage(&spec, &layout, &pressed, None);
    assert!(!under.unseen_dots.is_empty());
    let seen: Vec<u32> = under.unseen_dots.iter().map(|dot| dot.id).collect();
    // By brute force: every dot's outline, carried over point by point, against the marker's disc.
    let marker: Vec<DVec2> = (0..360)
        .map(|k| DVec2::from_angle(f64::from(k).to_radians()) * 0.5)
        .map(|out| pressed.project(DVec3::new(3.1 + out.x, 2.8 + out.y, 0.0)).unwrap())
        .collect();
    let middle = marker.iter().sum::<DVec2>() / 360.0;
    let reach = |p: DVec2| {
        let towards = p - middle;
        let near = marker.iter().min_by(|a, b| {
            let off = |m: DVec2| (m - middle).angle_to(towards).abs();
            off(**a).total_cmp(&off(**b))
        });
        towards.length() / near.unwrap().distance(middle)
    };
    for dot in &layout.dots {
        let hidden = (0..90)
            .map(|k| DVec2::from_angle(f64::from(k).to_radians() * 4.0) * 3.5)
            .map(|out| spec.optics.trace(dot.image_px + out).unwrap().surface_mm)
            .map(|point| reach(pressed.project(point).unwrap()))
            .fold(f64::INFINITY, f64::min);
        if (hidden - 1.0).abs() > 0.02 {
            let listed = under
                .unseen_dots
                .iter()
                .any(|unseen| unseen.id == dot.id && unseen.reason == "hidden_by_white_marker");
            assert_eq!(listed, hidden < 1.0, "dot {}: {hidden}; {seen:?}", dot.id);
        }
    }
}

#[test]
fn no_window_hides_a_dot_at_a_position_that_it_is_made_for() {
    let design = crate::Design::from_str(include_str!("../../../../designs/thumb24.json")).unwrap();
    let spec = LayoutSpec::of_design(&design).unwrap();
    let layout = Layout::new(&spec).unwrap();
    let at = |pose: Rigid| spec.optics.at_pose(&pose).unwrap();
    let tilted = Rigid::new(DMat3::from_rotation_x(0.06), DVec3::new(0.1, -0.2, -1.0));
    let positions =
        [at(Rigid::identity()), at(Rigid::from_translation(DVec3::new(0.0, 0.0, -2.0))), at(tilted)];
    let window = window::Window::of_design(&design, positions.iter()).unwrap();
    for optics in &positions {
        let seen = coverage::coverage(&spec, &layout, optics, Some(&window));
        assert!(seen.unseen_dots.is_empty(), "{:?}", seen.unseen_dots);
        assert!(seen.window_gap_mm.unwrap() > 0.0);
    }
    // A window that is made for rest only stands in the way of a platform that has moved aside.
    let narrow = window::Window::of_design(&design, positions[..1].iter()).unwrap();
    let aside = at(Rigid::from_translation(DVec3::new(3.0, 0.0, -1.0)));
    let seen = coverage::coverage(&spec, &layout, &aside, Some(&narrow));
    let rest = coverage::coverage(&spec, &layout, &positions[0], Some(&narrow));
    assert!(seen.window_gap_mm < rest.window_gap_mm, "{seen:?} {rest:?}");
    assert_eq!(rest.in_sight, rest.in_mask);
    assert!(seen.in_sight < seen.in_mask);
}
