use glam::{DMat3, DVec2, DVec3};
use std::str::FromStr;

use super::frame::Undistorted;
use super::*;
use crate::spec::sections::{PatternSection, PrintSection};
use domecast_optics::camera::{LensSpec, Model};
use domecast_optics::numeric::Rigid;
use domecast_optics::{Layer, OpticsSpec, SensorOptics};

const MODELS: [Model; 3] = [Model::Pinhole, Model::BrownConrady, Model::KannalaBrandt];
const KINDS: [&str; 4] = ["square", "hexagonal", "rings", "fill"];

fn optics(model: Model, pupil_mm: DVec3, rotation: DMat3) -> SensorOptics {
    let distortion = match model {
        Model::Pinhole => vec![],
        Model::BrownConrady => vec![-0.2917, 0.0878, 0.0, 0.0, -0.01156],
        Model::KannalaBrandt => vec![0.0; 4],
    };
    let layer =
        |name: &str, index: f64, thickness_mm| Layer { name: name.into(), index: [index; 3], thickness_mm };
    SensorOptics::new(&OpticsSpec {
        lens: LensSpec {
            model,
            width: 640,
            height: 480,
            matrix: [[229.18, 0.0, 319.5], [0.0, 229.18, 239.5], [0.0, 0.0, 1.0]],
            distortion,
            field_of_view_rad: 160f64.to_radians(),
            pupil_shift_mm: vec![],
        },
        sensor_from_camera: Rigid::new(rotation, pupil_mm),
        layers: vec![layer("acrylic", 1.491, Some(1.0)), layer("silicone", 1.41, None)],
        dome_radius_mm: 10.0,
    })
    .unwrap()
}

/// A design's part, with the fields of `change` set in its pattern.
fn spec(model: Model, change: serde_json::Value) -> LayoutSpec {
    let mut json = serde_json::json!({
        "kind": "hexagonal", "pitch_px": 16.0, "dot_diameter_px": 7.0, "polar_angle_deg": 60.0,
    });
    for (key, value) in change.as_object().unwrap() {
        json[key] = value.clone();
    }
    let pattern: PatternSection = serde_json::from_value(json).unwrap();
    let print: PrintSection = serde_json::from_value(serde_json::json!({
        "min_dot_mm": 0.2, "min_gap_mm": 0.1, "wrap_warn_deg": 50.0, "wrap_limit_deg": 65.0,
        "pad_over_image": 1.3, "dpi": 2400, "outline_tolerance_mm": 0.0005,
    }))
    .unwrap();
    let focal = 138.56;
    LayoutSpec {
        optics: optics(model, DVec3::new(0.0, 0.0, -10.0), DMat3::IDENTITY),
        undistorted: Undistorted::new(&[[focal, 0.0, 319.5], [0.0, focal, 239.5], [0.0, 0.0, 1.0]]).unwrap(),
        mask: Some(Mask { center_px: DVec2::new(319.5, 239.5), radius_px: 240.0 }),
        white_markers: vec![],
        pattern,
        print,
    }
}

fn nearest_px(points: &[DVec2]) -> Vec<f64> {
    let others = |i: usize| points.iter().enumerate().filter(move |(j, _)| *j != i);
    (0..points.len())
        .map(|i| others(i).map(|(_, p)| p.distance(points[i])).fold(f64::INFINITY, f64::min))
        .collect()
}

#[test]
fn lattices_are_even_in_the_image() {
    for model in MODELS {
        for (kind, side) in [("square", 4), ("hexagonal", 6)] {
            let layout = Layout::new(&spec(model, serde_json::json!({"kind": kind}))).unwrap();
            assert!(layout.dots.len() > 200, "{} dots", layout.dots.len());
            let points: Vec<DVec2> = layout.dots.iter().map(|dot| dot.image_px).collect();
            for nearest in nearest_px(&points) {
                assert!((nearest / 16.0 - 1.0).abs() < 1e-12);
            }
            let inner = layout.dots.iter().filter(|dot| dot.neighbors.len() == side).count();
            assert!(inner * 10 > layout.dots.len() * 7, "{inner} dots have {side} neighbours");
            for dot in &layout.dots {
                assert!((1..=side).contains(&dot.neighbors.len()));
                for other in &dot.neighbors {
                    let other = &layout.dots[*other as usize];
                    assert!(other.neighbors.contains(&dot.id));
                    assert!((other.image_px.distance(dot.image_px) - 16.0).abs() < 1e-9);
                }
            }
        }
    }
}

#[test]
fn dots_agree_with_the_optics_and_the_map() {
    for model in MODELS {
        for kind in KINDS {
            let spec = spec(model, serde_json::json!({"kind": kind, "centred_on": "dot"}));
            let layout = Layout::new(&spec).unwrap();
            for dot in &layout.dots {
                assert!((dot.surface_mm.length() - 10.0).abs() < 1e-9);
                let seen = spec.optics.project(dot.surface_mm).unwrap();
                assert!((seen - dot.image_px).length() < 1e-9, "{kind} {:?}", dot.id);
                let back = layout.transfer.dome_from_plate(dot.plate_mm).unwrap();
                assert!((back - dot.surface_mm).length() < 1e-12);
                assert!(dot.polar_rad() < 60f64.to_radians());
                assert_eq!(dot.wrap_rad, dot.polar_rad());
            }
        }
    }
}

#[test]
fn equal_apparent_size_is_equal_in_the_image_and_grows_on_the_dome() {
    let layout = Layout::new(&spec(Model::KannalaBrandt, serde_json::json!({}))).unwrap();
    for dot in &layout.dots {
        // A circle's cubics enclose 1.00028 of its area in four pieces.
        assert!((dot.image_outline.equivalent_diameter() / 7.0 - 1.0).abs() < 2e-4);
        assert!((dot.image_outline.centroid() - dot.image_px).length() < 1e-9);
    }
    let diameters = layout.dots.iter().map(|dot| dot.diameter_mm);
    let (low, high) = diameters.fold((f64::INFINITY, 0.0), |(l, h): (f64, f64), d| (l.min(d), h.max(d)));
    assert!(low > 0.4 && high < 0.6 && high > low * 1.01, "{low} {high}");
}

#[test]
fn equal_size_on_the_dome_is_a_circle_on_the_dome() {
    let change =
        serde_json::json!({"dot_diameter_px": null, "dot_diameter_mm": 0.5, "polar_angle_deg": 45.0});
    let layout = Layout::new(&spec(Model::KannalaBrandt, change)).unwrap();
    for dot in &layout.dots {
        assert_eq!(dot.diameter_mm, 0.5);
        for corner in dot.plate_outline.polygon(8) {
            let on_dome = layout.transfer.dome_from_plate(corner).unwrap();
            let from_center = on_dome.angle_between(dot.surface_mm);
            assert!((10.0 * from_center.sin() - 0.25).abs() < 5e-4, "{from_center}");
        }
        // Orthographic: the disc's flat area, seen from above.
        let flat = std::f64::consts::PI * 0.25 * 0.25 * dot.normal.z;
        assert!((dot.plate_outline.signed_area() / flat - 1.0).abs() < 1e-3);
        let reach = dot.polar_rad() + 0.025f64.asin();
        assert!(reach <= 45f64.to_radians() + 1e-9);
    }
}

#[test]
fn outlines_on_the_plate_follow_the_exact_curve() {
    for even_in in ["raw", "undistorted"] {
        let change = serde_json::json!({"even_in": even_in, "polar_angle_deg": 58.0, "dot_diameter_px": 6.0});
        let spec = spec(Model::BrownConrady, change);
        let layout = Layout::new(&spec).unwrap();
        let frame = frame::EvenFrame::new(spec.optics.lens(), spec.pattern.even_in, spec.undistorted);
        for dot in &layout.dots {
            let exact: Vec<DVec2> = (0..720)
                .map(|k| DVec2::from_angle(f64::from(k).to_radians() / 2.0) * 3.0)
                .map(|out| frame.raw_from_even(dot.even_px + out).unwrap())
                .map(|px| spec.optics.trace(px).unwrap().surface_mm)
                .map(|point| layout.transfer.plate_from_dome(point).unwrap())
                .collect();
            for corner in dot.plate_outline.polygon(16) {
                let off = exact.iter().map(|p| p.distance(corner)).fold(f64::INFINITY, f64::min);
                // The samples of the exact curve are 0.003 mm apart.
                assert!(off < 0.0015 + 0.0005, "{off}");
            }
            let area = 0.5
                * exact.iter().zip(exact.iter().cycle().skip(1)).map(|(a, b)| a.perp_dot(*b)).sum::<f64>();
            // The image's y runs down, the plate's y up: the outline turns over on its way.
            assert!((dot.plate_outline.signed_area().abs() / area.abs() - 1.0).abs() < 2e-3);
        }
    }
}

#[test]
fn undistorted_patterns_are_even_there_and_not_in_the_raw_image() {
    let spec = spec(Model::KannalaBrandt, serde_json::json!({"even_in": "undistorted", "kind": "square"}));
    let layout = Layout::new(&spec).unwrap();
    let lens = spec.optics.lens();
    let flat: Vec<DVec2> =
        layout.dots.iter().map(|dot| spec.undistorted.from_raw(lens, dot.image_px).unwrap()).collect();
    for nearest in nearest_px(&flat) {
        assert!((nearest / 16.0 - 1.0).abs() < 1e-9);
    }
    let raw: Vec<DVec2> = layout.dots.iter().map(|dot| dot.image_px).collect();
    let nearest = nearest_px(&raw);
    let (low, high) = nearest.iter().fold((f64::INFINITY, 0.0f64), |(l, h), d| (l.min(*d), h.max(*d)));
    assert!(high > 1.05 * low);
}

#[test]
fn rings_and_fill_keep_their_distance_up_to_the_edge() {
    for centred_on in ["dot", "gap"] {
        let rings =
            spec(Model::KannalaBrandt, serde_json::json!({"kind": "rings", "centred_on": centred_on}));
        let rings = Layout::new(&rings).unwrap();
        let points: Vec<DVec2> = rings.dots.iter().map(|dot| dot.image_px).collect();
        for nearest in nearest_px(&points) {
            assert!((15.999..17.5).contains(&nearest), "{nearest}");
        }
        let fill = spec(Model::KannalaBrandt, serde_json::json!({"kind": "fill", "centred_on": centred_on}));
        let fill = Layout::new(&fill).unwrap();
        let points: Vec<DVec2> = fill.dots.iter().map(|dot| dot.even_px).collect();
        let nearest = nearest_px(&points);
        let mean = nearest.iter().sum::<f64>() / nearest.len() as f64;
        let variance = nearest.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / nearest.len() as f64;
        assert!(variance.sqrt() < 0.05 * mean, "{}", variance.sqrt() / mean);
        // The row along the edge lies on the edge, and has no hole.
        let edge = fill.edge.largest_px();
        let on_edge = points.iter().filter(|p| p.distance(fill.center_px) > edge - 1e-6).count() as f64;
        assert!((on_edge * mean / (std::f64::consts::TAU * edge) - 1.0).abs() < 0.12);
        let at_centre = points.iter().map(|p| p.distance(fill.center_px)).fold(f64::INFINITY, f64::min);
        if centred_on == "dot" {
            assert_eq!(at_centre, 0.0);
        } else {
            assert!(at_centre > 7.0, "{at_centre}");
        }
    }
}

#[test]
fn wanted_numbers_are_met() {
    for kind in KINDS {
        for wanted in [7, 100, 300, 1000] {
            let change = serde_json::json!({
                "kind": kind, "pitch_px": null, "count": wanted, "dot_diameter_px": 2.0,
            });
            let mut spec = spec(Model::KannalaBrandt, change);
            spec.print.min_dot_mm = 0.01;
            let layout = Layout::new(&spec).unwrap();
            let off = layout.dots.len().abs_diff(wanted);
            // Lattices gain dots in groups of up to twelve.
            let most = if kind == "rings" || kind == "fill" { 0 } else { 6.max(wanted / 50) };
            assert!(off <= most, "{kind}: {} for {wanted}", layout.dots.len());
        }
    }
}

#[test]
fn a_dot_that_the_lens_cannot_see_is_refused_by_name() {
    let mut wide =
        spec(Model::BrownConrady, serde_json::json!({"image_radius_px": 260.0, "polar_angle_deg": null}));
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
    let mut narrow = spec(Model::BrownConrady, serde_json::json!({"polar_angle_deg": 80.0}));
    narrow.optics = optics(Model::BrownConrady, DVec3::new(0.0, 0.0, -3.0), DMat3::IDENTITY);
    let error = Layout::new(&narrow).unwrap_err();
    assert_eq!(error.field, "pattern.polar_angle_deg");
    assert!(error.problem.contains("beyond_fold"), "{error}");
}

#[test]
fn dots_that_touch_are_refused() {
    let error = Layout::new(&spec(Model::Pinhole, serde_json::json!({"dot_diameter_px": 16.0}))).unwrap_err();
    assert_eq!(error.field, "pattern.dot_diameter_px");
    let change = serde_json::json!({"dot_diameter_px": null, "dot_diameter_mm": 1.1});
    let error = Layout::new(&spec(Model::Pinhole, change)).unwrap_err();
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
    let mut spec = spec(Model::KannalaBrandt, change);
    spec.white_markers =
        vec![WhiteMarker { id: 3, position_mm: DVec3::new(3.0, 3.0, 0.0), diameter_mm: 1.0 }];
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
fn a_camera_off_the_axis_still_gives_an_even_image() {
    let mut spec = spec(Model::KannalaBrandt, serde_json::json!({"kind": "fill"}));
    let tilt = DMat3::from_rotation_x(0.05) * DMat3::from_rotation_y(-0.03);
    spec.optics = optics(Model::KannalaBrandt, DVec3::new(0.4, -0.3, -10.0), tilt);
    let layout = Layout::new(&spec).unwrap();
    assert!(layout.edge.largest_px() > layout.edge.smallest_px() + 0.2);
    assert!(layout.lost.is_empty());
    for dot in &layout.dots {
        assert!(dot.polar_rad() < 60f64.to_radians());
        assert!((spec.optics.project(dot.surface_mm).unwrap() - dot.image_px).length() < 1e-9);
    }
    let furthest = layout.dots.iter().map(Dot::polar_rad).fold(0.0, f64::max);
    assert!(furthest > 57f64.to_radians());
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
        match Layout::new(&spec(Model::KannalaBrandt, change.clone())) {
            Err(error) => assert_eq!(error.field, field, "{change}: {error}"),
            Ok(layout) => panic!("{change}: {} dots", layout.dots.len()),
        }
    }
}

#[test]
fn hits_are_few_and_reach_everything() {
    for limit_deg in [30.0, 40.0, 50.0] {
        let mut spec =
            spec(Model::KannalaBrandt, serde_json::json!({"polar_angle_deg": 75.0, "pitch_px": 18.0}));
        spec.print.wrap_limit_deg = limit_deg;
        spec.print.min_dot_mm = 0.1;
        spec.print.hits = crate::spec::sections::Hits::Split;
        spec.print.max_tilt_deg = 80.0;
        let layout = Layout::new(&spec).unwrap();
        assert!(layout.hits.len() > 1 && layout.lost.is_empty());
        let mut shares = vec![0; layout.hits.len()];
        for dot in &layout.dots {
            shares[dot.hit] += 1;
            let hit = &layout.hits[dot.hit];
            assert!(dot.wrap_rad < limit_deg.to_radians());
            let on_hit = layout.transfer.dome_from_plate(dot.plate_mm).unwrap();
            assert!((hit.hit_from_sensor.transpose() * on_hit - dot.surface_mm).length() < 1e-12);
            // Nearer to its own stroke than to any other.
            for other in &layout.hits {
                let z = (other.hit_from_sensor * dot.normal).z;
                assert!(z.clamp(-1.0, 1.0).acos() >= dot.wrap_rad - 1e-12);
            }
        }
        assert!(shares.iter().all(|share| *share > 0), "{shares:?}");
        // One sector less would not reach: some point between the sectors is further than the limit from all.
        let sectors = layout.hits.len() - 1;
        let own = 0.03;
        let reach = limit_deg.to_radians() - own;
        let reached = |count: usize, tilt: f64| {
            let axis = region::dome_point(1.0, tilt, 0.0);
            [reach, 75f64.to_radians() - own].iter().all(|polar| {
                let between = region::dome_point(1.0, *polar, std::f64::consts::PI / count as f64);
                axis.angle_between(between) <= reach
            })
        };
        if sectors > 2 {
            assert!(!(0..900).any(|k| reached(sectors - 1, f64::from(k).to_radians() / 10.0)), "{sectors}");
        }
    }
    // The stroke's axis, in the hit's frame, is its +z; the azimuth keeps its direction.
    let hit = Hit::new(0.7, 2.0);
    let axis = region::dome_point(1.0, 0.7, 2.0);
    assert!((hit.hit_from_sensor * axis - DVec3::Z).length() < 1e-15);
    let further = hit.hit_from_sensor * region::dome_point(1.0, 0.9, 2.0);
    assert!((further - region::dome_point(1.0, 0.2, 2.0)).length() < 1e-15);
}

#[test]
fn the_pinhole_alone_misses_by_what_is_known() {
    // Published for a dome of 10 mm radius, 1 mm of acrylic and the pupil 8 mm under the sheet's top: a dot laid
    // out by the pinhole alone lies 1.1, 1.6 and 1.1 mm off at 20, 40 and 50 degrees of field.
    let mut spec = spec(Model::KannalaBrandt, serde_json::json!({"polar_angle_deg": 60.0}));
    spec.optics = optics(Model::KannalaBrandt, DVec3::new(0.0, 0.0, -8.0), DMat3::IDENTITY);
    let layout = Layout::new(&spec).unwrap();
    let comparison = evenness::by_pinhole(&spec, &layout).unwrap();
    assert!((1.3..1.75).contains(&comparison.max_shift_mm), "{comparison:?}");
    let own = evenness::by_design(&layout).unwrap();
    assert!(own.image_px.nearest.variation < 1e-6);
    assert!(comparison.image_px.nearest.variation > 0.03, "{comparison:?}");
    assert_eq!(own.image_px, own.even_frame_px);
}

#[test]
fn tolerances_show_what_they_do() {
    let spec = spec(Model::KannalaBrandt, serde_json::json!({"polar_angle_deg": 50.0}));
    let layout = Layout::new(&spec).unwrap();
    let tolerances = |change: serde_json::Value| {
        let mut json = serde_json::json!({
            "pupil_mm": [0.0, 0.0, 0.0], "camera_rotation_deg": [0.0, 0.0, 0.0], "dome_radius_mm": 0.0,
            "layer_thickness_mm": 0.0, "index": 0.0, "white_marker_mm": 0.0, "black_dot_mm": 0.0,
            "print_registration_mm": 0.0, "print_rotation_deg": 0.0, "print_scatter_mm": 0.0,
            "wire_diameter_mm": 0.0, "spring_diameter_mm": 0.0, "samples": 40, "seed": 5,
        });
        for (key, value) in change.as_object().unwrap() {
            json[key] = value.clone();
        }
        serde_json::from_value(json).unwrap()
    };
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
    let spec = spec(Model::BrownConrady, serde_json::json!({}));
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
    let mut spec = spec(Model::KannalaBrandt, serde_json::json!({"unseen": "drop"}));
    spec.white_markers =
        vec![WhiteMarker { id: 2, position_mm: DVec3::new(3.1, 2.8, 0.0), diameter_mm: 1.0 }];
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
    let design = crate::Design::from_str(include_str!("../../../designs/thumb24.json")).unwrap();
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

#[test]
fn what_a_dot_holds_does_not_grow_with_their_number() {
    let held = |count: u32| {
        let change =
            serde_json::json!({"count": count, "pitch_px": null, "dot_diameter_px": 0.5, "kind": "fill"});
        let mut spec = spec(Model::KannalaBrandt, change);
        spec.print.min_dot_mm = 1e-4;
        spec.print.min_gap_mm = 1e-4;
        let layout = Layout::new(&spec).unwrap();
        assert_eq!(layout.dots.len(), count as usize);
        let numbers = |dot: &Dot| {
            dot.image_outline.pieces().len() + dot.plate_outline.pieces().len() + dot.neighbors.len()
        };
        layout.dots.iter().map(numbers).sum::<usize>() as f64 / layout.dots.len() as f64
    };
    let (few, many) = (held(300), held(6000));
    assert!(many < 1.1 * few, "{few} {many}");
}

#[test]
fn outlines_measure_themselves_exactly() {
    // An ellipse, traced; its area and centroid are known.
    let (half, center) = (DVec2::new(3.0, 1.5), DVec2::new(10.0, -7.0));
    let curve = |angle: f64| -> Result<outline::CurvePoint, ()> {
        let (sin, cos) = angle.sin_cos();
        let at = center + DVec2::new(half.x * cos, half.y * sin);
        Ok(outline::CurvePoint { at, slope: DVec2::new(-half.x * sin, half.y * cos) })
    };
    for tolerance in [1e-2, 1e-4, 1e-6] {
        let (outline, fit) = outline::Outline::of_curve(curve, tolerance).unwrap();
        assert!(fit.reached && fit.error <= tolerance);
        let area = std::f64::consts::PI * half.x * half.y;
        assert!((outline.signed_area() / area - 1.0).abs() < tolerance);
        assert!((outline.centroid() - center).length() < 1e-12);
        // Against a fine polygon of the cubics themselves.
        let polygon = outline.polygon(2000);
        let next = polygon.iter().cycle().skip(1);
        let flat =
            0.5 * polygon.iter().zip(next).map(|(a, b)| (*a - center).perp_dot(*b - center)).sum::<f64>();
        assert!((outline.signed_area() / flat - 1.0).abs() < 1e-6);
        let (narrow, wide) = outline.widths();
        assert!((narrow - 3.0).abs() < 0.01 && (wide - 6.0).abs() < 0.01, "{narrow} {wide}");
        for corner in outline.polygon_within(tolerance) {
            let on = ((corner - center) / half).length();
            assert!((on - 1.0).abs() < tolerance);
        }
    }
    // A failure of the curve is the failure of the outline.
    assert_eq!(outline::Outline::of_curve(|_| Err("no"), 1.0), Err("no"));
}
