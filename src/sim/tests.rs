use std::path::Path;
use std::str::FromStr;

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::*;
use crate::raster::coverage::{Coverage, area_moment, clip};
use crate::raster::outline::RimFit;

fn scene(name: &str) -> Scene {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs/scenes").join(name);
    Scene::load(&path).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// A scene of the named design's folder, from JSON text without version, name and design.
fn scene_of(text: &str) -> Result<Scene, SimError> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs/scenes");
    let whole = format!(r#"{{ "version": 1, "name": "t", "design": "../thumb24.json", {text} }}"#);
    Scene::from_text(&whole, &folder)
}

fn sum_of(coverage: &Coverage) -> (f64, DVec2) {
    let (mut area, mut moment) = (0.0, DVec2::ZERO);
    for (y, x, part) in coverage.rows(1000, 1000) {
        for (k, value) in part.iter().enumerate() {
            area += f64::from(*value);
            moment += DVec2::new((x + k) as f64, y as f64) * f64::from(*value);
        }
    }
    (area, moment / area)
}

proptest! {
    // A convex polygon's coverage sums to its area, whatever its place and direction.
    #[test]
    fn coverage_sums_to_the_area(
        x in 20.0..40.0f64, y in 20.0..40.0f64, r in 0.3..12.0f64, flat in 0.1..1.0f64, turn in 0.0..6.3f64,
        corners in 3usize..40, back in any::<bool>(),
    ) {
        let mut polygon: Vec<DVec2> = (0..corners).map(|k| {
            let p = DVec2::from_angle(std::f64::consts::TAU * k as f64 / corners as f64);
            DVec2::new(x, y) + DVec2::from_angle(turn).rotate(DVec2::new(p.x * r, p.y * r * flat))
        }).collect();
        if back { polygon.reverse(); }
        let mut coverage = Coverage::default();
        coverage.fill(&polygon);
        let (area, moment) = area_moment(&polygon);
        let (drawn, center) = sum_of(&coverage);
        prop_assert!((drawn - area.abs()).abs() < 2e-5 * (1.0 + area.abs()), "{drawn} {area}");
        // A pixel stands for what it covers up to half its diagonal away; over many pixels across, that averages out.
        let across = r * flat;
        prop_assert!((center - moment / area).length() < std::f64::consts::FRAC_1_SQRT_2 / (1.0 + across));
    }

    #[test]
    fn coverage_matches_a_fine_raster(x in 5.0..7.0f64, y in 5.0..7.0f64, r in 1.0..4.0f64, turn in 0.0..6.3f64) {
        let polygon: Vec<DVec2> = (0..5).map(|k| {
            DVec2::new(x, y) + DVec2::from_angle(turn + std::f64::consts::TAU * f64::from(k) / 5.0) * r
        }).collect();
        let mut coverage = Coverage::default();
        coverage.fill(&polygon);
        let inside = |p: DVec2| (0..5).all(|k| {
            let (a, b) = (polygon[k], polygon[(k + 1) % 5]);
            (b - a).perp_dot(p - a) >= 0.0
        });
        for (row, left, part) in coverage.rows(100, 100) {
            for (k, value) in part.iter().enumerate() {
                let count = (0..64).flat_map(|i| (0..64).map(move |j| (i, j))).filter(|(i, j)| {
                    let at = |n: i32| (f64::from(n) + 0.5) / 64.0 - 0.5;
                    inside(DVec2::new((left + k) as f64 + at(*i), row as f64 + at(*j)))
                }).count();
                prop_assert!((count as f64 / 4096.0 - f64::from(*value)).abs() < 0.015);
            }
        }
    }

    #[test]
    fn a_cut_leaves_what_lies_before_it(angle in 0.0..6.3f64, left in 0.05..0.95f64) {
        let circle: Vec<DVec2> = (0..400).map(|k| DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / 400.0)).collect();
        let normal = DVec2::from_angle(angle);
        let kept = clip(&circle, normal, 2.0 * left - 1.0);
        let half = (2.0 * left - 1.0f64).acos();
        let segment = half - half.sin() * half.cos();
        prop_assert!((area_moment(&kept).0 - (std::f64::consts::PI - segment)).abs() < 1e-3);
    }
}

#[test]
fn an_ellipse_keeps_its_area_and_centre() {
    let fit = RimFit::new(4.0, 0.003);
    let rim = std::array::from_fn(|k| {
        let a = std::f64::consts::TAU * k as f64 / 8.0;
        DVec2::new(10.0 + 4.0 * a.cos() - 0.5 * a.sin(), 7.0 + 2.0 * a.sin())
    });
    let mut polygon = Vec::new();
    fit.polygon(&rim, &mut polygon);
    let (area, moment) = area_moment(&polygon);
    assert!((area - 8.0 * std::f64::consts::PI).abs() < 1e-9, "{area}");
    assert!((moment / area - DVec2::new(10.0, 7.0)).length() < 1e-12);
}

/// Centroid of the darkness around a place of one channel.
fn measured(image: &Image8, channel: usize, near: [f64; 2], ground: f64) -> DVec2 {
    let (x0, y0) = (near[0].round() as i64, near[1].round() as i64);
    let (mut sum, mut moment) = (0.0, DVec2::ZERO);
    for y in y0 - 8..=y0 + 8 {
        for x in x0 - 8..=x0 + 8 {
            let at = (y as usize * image.width + x as usize) * image.channels + channel;
            let weight = ground - f64::from(image.bytes[at]);
            sum += weight;
            moment += DVec2::new(x as f64, y as f64) * weight;
        }
    }
    moment / sum
}

#[test]
fn the_truth_is_what_is_drawn() {
    for name in ["still.json", "push.json", "twist.json"] {
        let scene = scene(name);
        let plan = Plan::everything(&scene).unwrap();
        let renderer = Renderer::new(&scene, &plan).unwrap();
        for frame in [0, scene.frame_count() / 3, scene.frame_count() - 1] {
            let drawn = renderer.frame(frame).unwrap();
            let image = drawn.image.unwrap();
            let mut seen = 0;
            for dot in &drawn.truth.black_dots {
                for (channel, reported) in dot.centroid_rgb_px.unwrap().into_iter().enumerate() {
                    let reported = reported.unwrap();
                    let found = measured(&image, channel, reported, 153.0);
                    assert!(
                        (found - DVec2::from(reported)).length() < 0.02,
                        "{name} {frame} {} {found} {reported:?}",
                        dot.id
                    );
                    seen += 1;
                }
            }
            assert!(seen > 450);
        }
    }
}

#[test]
fn faults_are_named() {
    let fault = |text: &str, field: &str| match scene_of(text).map(|_| ()) {
        Err(SimError::Input(error)) => assert_eq!(error.field, field, "{error}"),
        other => panic!("{text}: {other:?}"),
    };
    let frames = r#""frames": { "count": 1, "rate_hz": 30 }"#;
    let tolerance = r#""tolerance": { "px": 0.1, "grey": 1 }"#;
    assert!(scene_of(&format!("{frames}, {tolerance}")).is_ok());
    fault(&format!(r#""frames": {{ "count": 0, "rate_hz": 30 }}, {tolerance}"#), "frames.count");
    fault(&format!(r#"{frames}, "tolerance": {{ "px": 0, "grey": 1 }}"#), "tolerance.px");
    fault(&format!(r#"{frames}, "tolerance": {{ "px": 1, "grey": -1 }}"#), "tolerance.grey");
    fault(
        &format!(r#"{frames}, {tolerance}, "effects": {{ "gravity_waves": "always" }}"#),
        "effects.gravity_waves",
    );
    fault(
        &format!(r#"{frames}, {tolerance}, "ink": {{ "broken": [{{ "id": 9999, "left": 0.5 }}] }}"#),
        "ink.broken[0].id",
    );
    let keys = r#"[{ "time_s": 1, "force_n": [0,0,-1] }, { "time_s": 1, "force_n": [0,0,-1] }]"#;
    fault(&format!(r#"{frames}, {tolerance}, "motion": {{ "wrench": {keys} }}"#), "motion.wrench[1].time_s");
    fault(&format!(r#"{frames}, {tolerance}, "colour": true"#), "colour");
    let beyond = r#"[{ "time_s": 0, "force_n": [6,0,0], "point_mm": [0,0,10] }]"#;
    fault(&format!(r#"{frames}, {tolerance}, "motion": {{ "wrench": {beyond} }}"#), "motion.wrench[0]");
    let ball = |path: &str| {
        format!(
            r#"{frames}, {tolerance}, "objects": [{{ "name": "o", "shape": {{ "kind": "sphere", "radius_mm": 2 }}, "path": [{path}] }}]"#
        )
    };
    assert!(scene_of(&ball(r#"{ "time_s": 0, "position_mm": [0,0,13] }"#)).is_ok());
    let mesh = |file: &str| {
        format!(
            r#"{frames}, {tolerance}, "objects": [{{ "name": "o", "shape": {{ "kind": "mesh", "file": "{file}" }}, "path": [{{ "time_s": 0, "position_mm": [0,0,30] }}] }}]"#
        )
    };
    fault(&mesh("meshes/none.stl"), "objects[0].shape.file");
    fault(&mesh("still.json"), "objects[0].shape.file");
    // The nut with one triangle less.
    let folder = tempfile::tempdir().unwrap();
    let nut = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs/scenes/meshes/nut.stl");
    let mut bytes = std::fs::read(nut).unwrap();
    bytes.truncate(bytes.len() - 50);
    bytes[80..84].copy_from_slice(&383_u32.to_le_bytes());
    let open = folder.path().join("open.stl");
    std::fs::write(&open, &bytes).unwrap();
    fault(&mesh(&open.display().to_string()), "objects[0].shape.file");
}

#[test]
fn an_object_in_the_sheet_is_named_with_its_frame() {
    let scene = scene_of(
        r#""frames": { "count": 1, "rate_hz": 30 }, "tolerance": { "px": 0.1, "grey": 1 },
           "contact": { "level": "geometric" },
           "objects": [{ "name": "o", "shape": { "kind": "sphere", "radius_mm": 3 },
                         "path": [{ "time_s": 0, "position_mm": [9, 0, 1] }] }]"#,
    )
    .unwrap();
    let plan = Plan::everything(&scene);
    let drawn = plan.and_then(|plan| Renderer::new(&scene, &plan).and_then(|r| r.frame(0)));
    match drawn.map(|_| ()) {
        Err(SimError::Input(error)) => {
            assert_eq!(error.field, "objects[0].path");
            assert!(error.problem.contains("frame 0, `o`: the object reaches 2.000 mm"), "{error}");
            assert!(error.help.as_ref().is_some_and(|help| help.contains("at least 2.000 mm")), "{error}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn bound_coils_are_said_and_the_rest_runs() {
    // Four coils bind at 20 N, before their wire is over-stressed; those of thumb24 as it is bind after it.
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
    let text = domecast_design::read_text(&folder.join("thumb24.json")).unwrap();
    let mut value = domecast_design::parse_json(&text).unwrap();
    value["springs"]["active_coils"] = serde_json::json!(4);
    let design = domecast_design::Design::from_str(&value.to_string()).unwrap();
    let file = serde_json::json!({
        "version": 1, "name": "t", "design": "four-coils.json",
        "frames": { "count": 4, "rate_hz": 1, "images": false }, "tolerance": { "px": 0.1, "grey": 1 },
        "motion": { "wrench": [{ "time_s": 0, "force_n": [0, 0, 0] }, { "time_s": 3, "force_n": [0, 0, -45] }] },
    });
    let scene = Scene::new(domecast_design::from_value(&file).unwrap(), &folder, design).unwrap();
    let renderer = Renderer::new(&scene, &Plan::everything(&scene).unwrap()).unwrap();
    let truth: Vec<FrameTruth> = (0..4).map(|k| renderer.frame(k).unwrap().truth).collect();
    let status: Vec<&str> = truth.iter().map(|t| t.status.as_str()).collect();
    assert_eq!(status, ["ok", "ok", "coil_bind", "coil_bind"]);
    assert!(truth[3].note.as_ref().is_some_and(|note| note.contains("spring")));
    // The world's load is reported whole; the platform goes no further.
    assert_eq!(truth[3].wrench[2], -45.0);
    assert!((truth[2].pose[2][3] - truth[3].pose[2][3]).abs() < 1e-9 && truth[2].pose[2][3] < -1.0);
}

/// The truth of an object's frames on the pole at some heights, as it is written, and what the run says of its contact.
fn contact_told(
    level: &str,
    shape: &str,
    heights_mm: &[f64],
) -> (Vec<serde_json::Value>, Vec<run::ContactFault>) {
    let path: Vec<String> = (0..)
        .zip(heights_mm)
        .map(|(time_s, z)| format!(r#"{{ "time_s": {time_s}, "position_mm": [0, 0, {z}] }}"#))
        .collect();
    let scene = scene_of(&format!(
        r#""frames": {{ "count": {}, "rate_hz": 1, "images": false }}, "tolerance": {{ "px": 0.1, "grey": 1 }},
           "contact": {{ "level": "{level}", "element_mm": 5 }},
           "objects": [{{ "name": "o", "shape": {{ {shape} }}, "path": [{}] }}]"#,
        heights_mm.len(),
        path.join(", "),
    ))
    .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let summary = run::run(&scene, &Plan::everything(&scene).unwrap(), &out, &mut |_| {}).unwrap();
    let truth = std::fs::read_to_string(out.join(run::TRUTH_NAME)).unwrap();
    (truth.lines().map(|line| serde_json::from_str(line).unwrap()).collect(), summary.contact)
}

#[test]
fn truth_tells_how_the_contact_was_solved() {
    for level in ["geometric", "closed_form", "linear"] {
        let (truth, faults) = contact_told(level, r#""kind": "sphere", "radius_mm": 4"#, &[16.0, 13.6, 13.2]);
        let status: Vec<_> = truth.iter().map(|line| line["contact"]["status"].as_str().unwrap()).collect();
        assert_eq!(status, ["free", "converged", "converged"], "{level}");
        // Every level says how far it may be off, and that it is more than the tolerance.
        let [fault] = &faults[..] else { panic!("{level}: {faults:?}") };
        assert_eq!((fault.status, fault.frames, fault.first), ("beyond_tolerance", 2, 1), "{level}");
        let errors: Vec<f64> = truth[1..]
            .iter()
            .map(|line| line["contact"]["estimated_error"]["px"].as_f64().unwrap())
            .collect();
        assert!(errors[0] > 0.1 && errors[1] > errors[0], "{level}: {errors:?}");
        assert!(
            fault.note.contains(&format!("frame 2 its level may be off by {:.2} px", errors[1])),
            "{fault:?}"
        );
        assert!(truth[0]["contact"]["estimated_error"].is_null());
        assert!(truth[0]["contact"]["residual_mm"].is_null(), "{level}: no object was near");
        for line in &truth[1..] {
            assert!(line["contact"]["residual_mm"].as_f64().unwrap() < 1e-6, "{level}: {}", line["contact"]);
            assert!(line["contact"]["iterations"].as_u64().unwrap() > 0, "{level}: {}", line["contact"]);
            assert!(line["contact"].get("note").is_none(), "{level}: {}", line["contact"]);
        }
    }
    // The end of a thin bar has a rim, which has no closed form.
    let bar = r#""kind": "cylinder", "radius_mm": 1, "length_mm": 8"#;
    let (truth, faults) = contact_told("closed_form", bar, &[16.0, 16.0, 13.2, 16.0, 13.0]);
    let status: Vec<_> = truth.iter().map(|line| line["contact"]["status"].as_str().unwrap()).collect();
    assert_eq!(status, ["free", "free", "not_applicable", "free", "not_applicable"]);
    let reported: Vec<_> = faults.iter().map(|fault| (fault.status, fault.frames, fault.first)).collect();
    assert_eq!(reported, [("beyond_tolerance", 2, 2), ("not_applicable", 2, 2)]);
    assert_eq!(truth[2]["contact"]["note"].as_str(), Some(faults[1].note.as_str()));
    // Without an object there is no contact to tell of.
    let still = scene("still.json");
    let renderer = Renderer::new(&still, &Plan::of(&still).unwrap()).unwrap();
    assert_eq!(renderer.frame(0).unwrap().truth.contact, None);
}

/// No known scene makes the linear level stop at its bound; what truth tells then holds for any contact that says so.
#[test]
fn a_contact_at_its_bound_is_told_with_what_is_left() {
    use domecast_contact::{Contact, ContactSolid, Indenter, Level, Status};
    use domecast_optics::numeric::Rigid;
    let still = scene("still.json");
    let contact = Contact::new(elastomer_of(still.design()), Level::Geometric).expect("a level");
    let ball = Indenter::rigid(ContactSolid::sphere(4.0).expect("a ball"));
    let at = Rigid::from_translation(DVec3::new(0.0, 0.0, 13.2));
    let mut pressed = contact.press(&ball, still.suspension().expect("springs"), &at, None).expect("pressed");
    pressed.state.status = Status::BoundReached;
    (pressed.state.residual_mm, pressed.state.penetration_mm) = (3.2e-3, 1.5e-2);
    let reported = ContactTruth::of(&pressed, 20.0);
    assert_eq!((reported.status, reported.residual_mm), ("not_converged", Some(3.2e-3)));
    let note = reported.note.expect("a note");
    assert!(note.contains("3.2e-3 mm") && note.contains("1.5e-2 mm"), "{note}");
    pressed.state.residual_mm = f64::INFINITY;
    let reported = ContactTruth::of(&pressed, 20.0);
    assert!(reported.residual_mm.is_none() && reported.note.is_some_and(|note| note.contains("no step")));
}

#[test]
fn frames_do_not_depend_on_threads() {
    for (name, count) in [("push.json", 5), ("ball.json", 12), ("worn.json", 4)] {
        check_frames_by_threads(name, count);
    }
}

fn check_frames_by_threads(name: &str, count: u32) {
    let mut scene = scene(name);
    scene.override_run(Some(count), None).unwrap();
    let plan = Plan::of(&scene).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let made = |threads: usize| {
        let out = folder.path().join(format!("{threads}"));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run::run(&scene, &plan, &out, &mut |_| {})).unwrap();
        let mut files: Vec<_> = std::fs::read_dir(&out).unwrap().map(|e| e.unwrap().path()).collect();
        files.sort();
        files
            .iter()
            .map(|f| (f.file_name().map(|n| n.to_owned()), std::fs::read(f).unwrap()))
            .collect::<Vec<_>>()
    };
    let (one, three) = (made(1), made(3));
    // Scenes may ask for height maps and pressures beside the frames.
    assert!(one.len() >= count as usize + 3);
    let differ: Vec<_> = one.iter().zip(&three).filter(|(a, b)| a != b).map(|(a, _)| &a.0).collect();
    assert!(differ.is_empty() && one.len() == three.len(), "{name}: {differ:?}");
}

/// The thumb with another dome, as a scene under its own lights.
fn scene_on(dome: serde_json::Value, more: &str) -> Result<Scene, SimError> {
    let text = include_str!("../../designs/thumb24.json");
    let mut tree: serde_json::Value = serde_json::from_str(text).unwrap();
    for (key, value) in dome.as_object().unwrap() {
        tree["dome"][key] = value.clone();
    }
    tree["envelope"]["size_mm"] = serde_json::json!([40, 40, 40]);
    tree["pattern"]["polar_angle_deg"] = 50.into();
    let design = domecast_design::Design::from_str(&tree.to_string()).unwrap();
    let file = format!(
        r#"{{ "version": 1, "name": "t", "design": "thumb24.json", "frames": {{ "count": 1, "rate_hz": 30 }},
        "tolerance": {{ "px": 0.02, "grey": 1 }},
        "light": {{ "surround_level": 0.02, "leds": {{ "level_per_mw_mm2": 450 }} }} {more} }}"#
    );
    Scene::new(serde_json::from_str(&file).unwrap(), Path::new("."), design)
}

#[test]
fn levels_that_do_not_know_a_dome_refuse_it_by_name() {
    let ball = |level: &str| {
        format!(
            r#", "contact": {{ "level": "{level}" }}, "objects": [{{ "name": "ball",
            "shape": {{ "kind": "sphere", "radius_mm": 4 }}, "path": [{{ "time_s": 0, "position_mm": [0, 0, 19] }}] }}]"#
        )
    };
    let cap = serde_json::json!({ "radius_mm": 10.6, "rim_angle_deg": 70 });
    let pillar = serde_json::json!({ "cylinder_height_mm": 2 });
    for (dome, kind) in [(&cap, "a spherical cap"), (&pillar, "a hemisphere on a cylinder")] {
        for level in ["geometric", "closed_form", "finite_strain"] {
            let error = scene_on(dome.clone(), &ball(level)).unwrap_err().to_string();
            assert!(error.contains("the dome is") && error.contains(kind), "{level}: {error}");
        }
        assert!(scene_on(dome.clone(), &ball("linear")).is_ok());
        assert!(scene_on(dome.clone(), "").is_ok());
    }
    assert!(scene_on(serde_json::json!({}), &ball("finite_strain")).is_ok());
}
