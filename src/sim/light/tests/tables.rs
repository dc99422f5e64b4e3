//! Tables of light over the dome, and bounds of its effects.

use super::*;
use crate::scene::light::MovedLed;
use domecast_optics::DomeShape;

fn scene(more: &str) -> crate::Scene {
    let text = format!(
        r#"{{ "version": 1, "name": "lit", "design": "thumb24.json",
        "frames": {{ "count": 1, "rate_hz": 30 }}, "tolerance": {{ "px": 0.01, "grey": 0.5 }},
        "light": {{ "leds": {{ "level_per_mw_mm2": 450 }} }} {more} }}"#
    );
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
    crate::Scene::from_text(&text, &folder).unwrap()
}

const ALL: LightUse = LightUse::ALL;

pub(super) fn ways_of(optics: &SensorOptics, source: Emitter) -> Ways {
    Ways {
        sources: vec![Source { emitter: source, optics: optics.clone(), seen_mw: [1.0, 0.5, 0.0] }],
        optics: [optics.clone(), optics.clone(), optics.clone()],
        cavities: None,
        through_platform: 0.0,
        sheet_half_mm: WIDE,
        fresnel: false,
    }
}

#[test]
fn the_table_of_direct_light_matches_closed_forms_to_a_thousandth() {
    let optics = sensor(&[1.0], 1.0);
    let parts = FieldParts { falloff: true, albedo: None, moved: true };
    // A point on the sphere: even light.
    let at = DVec3::new(6.0, 0.0, -8.0);
    let ways = ways_of(&optics, emitter(at, -at, 1e-4, 1.0));
    let field = LightField::new(&ways, &Prepared::default(), &parts);
    for direction in directions(300) {
        let light = field.still(direction.as_vec3a()).to_array().map(f64::from);
        let exact = 1.0 / PI / 400.0;
        assert!((light[0] / exact - 1.0).abs() < 1e-3 && (light[1] / exact - 0.5).abs() < 1e-3);
        assert_eq!(light[2], 0.0);
    }
    // A square that faces the dome: Lambert's contour integral.
    let source = emitter(DVec3::new(4.0, -3.0, -3.3), DVec3::new(-0.4, 0.3, 1.0), 1.0, 1.0);
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
        .map(|(x, y)| source.platform_from_emitter.transform_point3(DVec3::new(x, y, 0.0)));
    let facing = source.platform_from_emitter.matrix3.z_axis;
    let field = LightField::new(&ways_of(&optics, source), &Prepared::default(), &parts);
    let brightest = field.brightest()[0];
    for direction in directions(300) {
        let point = direction * 10.0;
        if corners.iter().any(|c| (point - *c).dot(facing) < 0.0) {
            continue;
        }
        let exact = lambert_polygon(&corners, 1.0 / PI, point, -direction);
        let found = f64::from(field.still(direction.as_vec3a())[0]);
        assert!((found - exact).abs() < 1e-3 * brightest, "{direction}: {found} {exact}");
        // Moved points, with normals of their own.
        let moved = direction * 9.2;
        let normal = (direction + DVec3::new(0.1, -0.2, 0.1)).normalize();
        let exact = lambert_polygon(&corners, 1.0 / PI, moved, -normal);
        let found = f64::from(field.moved(moved.as_vec3a(), normal.as_vec3a())[0]);
        assert!((found - exact).abs() < 2e-2 * brightest, "moved {direction}: {found} {exact}");
    }
}

/// What a task waits for takes up other tasks: one that waited for a table that it was itself computing would never end.
#[test]
fn tables_that_many_tasks_of_a_pool_ask_for_at_once_are_made() {
    use rayon::prelude::*;
    let optics = sensor(&[1.0], 1.0);
    let ways = ways_of(&optics, emitter(DVec3::new(4.0, -3.0, -3.3), DVec3::new(-0.4, 0.3, 1.0), 1.0, 1.0));
    let (done, ended) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build().unwrap();
        let prepared = Prepared::default();
        let nodes = |_| {
            let [dome, shells] = [prepared.dome(&ways).sources.len(), prepared.shells(&ways).len()];
            dome + shells + prepared.rooms(&ways).len()
        };
        let counts: Vec<usize> = pool.install(|| (0..64).into_par_iter().map(nodes).collect());
        done.send(counts).unwrap();
    });
    let counts =
        ended.recv_timeout(std::time::Duration::from_secs(240)).expect("the tasks wait for each other");
    assert!(counts.iter().all(|count| *count == counts[0]));
}

#[test]
fn moved_points_of_caps_and_cylinders_are_lit_as_the_closed_form_has_it() {
    let parts = FieldParts { falloff: true, albedo: None, moved: true };
    for dome in [DomeShape::new(11.5, -5.75), DomeShape::new(14.0, -9.9), DomeShape::on_cylinder(8.0, 4.0)] {
        let optics = sensor_with(&[1.0], 1.0, dome);
        let source = emitter(DVec3::new(4.0, -3.0, -3.3), DVec3::new(-0.4, 0.3, 1.0), 1.0, 1.0);
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
            .map(|(x, y)| source.platform_from_emitter.transform_point3(DVec3::new(x, y, 0.0)));
        let facing = source.platform_from_emitter.matrix3.z_axis;
        let field = LightField::new(&ways_of(&optics, source), &Prepared::default(), &parts);
        let brightest = field.brightest()[0];
        let deep = 0.1 * dome.height_mm().min(dome.radius_mm());
        for k in 0..200 {
            let k = f64::from(k);
            let at = dome.point_mm(k / 210.0 * dome.meridian_end_rad(), 2.4 * k);
            let outward = dome.normal(at);
            // As far from the rim as it is pressed in: below the sheet's top there is no dome.
            for depth_mm in [0.0, deep].into_iter().filter(|depth_mm| at.z > 2.0 * depth_mm) {
                let moved = at - outward * depth_mm;
                let normal = (outward + DVec3::new(0.1, -0.2, 0.1)).normalize();
                if corners.iter().any(|c| (moved - *c).dot(facing) < 0.0) {
                    continue;
                }
                let exact = lambert_polygon(&corners, 1.0 / PI, moved, -normal);
                let found = f64::from(field.moved(moved.as_vec3a(), normal.as_vec3a())[0]);
                assert!((found - exact).abs() < 2e-2 * brightest, "{dome:?} {moved}: {found} {exact}");
            }
        }
    }
}

#[test]
fn the_rule_across_the_emitter_is_fine_enough() {
    let scene = scene("");
    let ways = setup::ways(&scene, &ALL).unwrap();
    let open = Ways { cavities: None, ..ways.clone() };
    let source = &ways.sources[0];
    let brightest = open.still(source, DVec3::Z, &EmitterRule::default());
    for direction in directions(12) {
        let rough = open.still(source, direction, &EmitterRule::default());
        let fine = open.still(source, direction, &EmitterRule::with_places(24));
        assert!((rough - fine).abs() < 1e-3 * brightest, "{direction}: {rough} {fine}");
        // With the shadow's edge across the emitter: against the same rule, and many more lines.
        let rough = ways.still(source, direction, &EmitterRule::default());
        let fine = ways.still(source, direction, &EmitterRule::with_places(24));
        assert!((rough - fine).abs() < 1e-2 * brightest, "shadow {direction}: {rough} {fine}");
    }
}

#[test]
fn shadows_only_darken_and_a_clear_platform_throws_none() {
    let scene = scene("");
    let shaded = setup::ways(&scene, &ALL).unwrap();
    let open = Ways { cavities: None, ..shaded.clone() };
    let clear = Ways { through_platform: 1.0, ..shaded.clone() };
    let rule = EmitterRule::default();
    let mut darkened = 0;
    for direction in directions(20) {
        for (i, source) in shaded.sources.iter().enumerate() {
            let (dark, light) =
                (shaded.still(source, direction, &rule), open.still(source, direction, &rule));
            assert!(dark <= light * (1.0 + 1e-2) + 1e-9, "{direction}: {dark} {light}");
            darkened += usize::from(dark < 0.9 * light);
            let through = clear.still(&clear.sources[i], direction, &rule);
            assert!((through - light).abs() <= 1e-9 * light.max(1e-9), "{through} {light}");
        }
    }
    assert!(darkened > 20, "the lip hides most of the emitter: {darkened}");
}

#[test]
fn the_sensor_is_lit_from_three_sides() {
    let scene = scene("");
    let mut work = Work::default();
    let dome = ShadedDome::new(&scene, &ALL, &mut work).unwrap().unwrap();
    let field = dome.field();
    assert!(field.error() < 0.02, "{}", field.error());
    assert!(work.of(EffectName::PlatformShadow) > work.of(EffectName::DirectLight));
    // Across from the lights of a colour, that colour is the weakest.
    for (light, azimuth_deg) in [210.0_f64, 330.0, 90.0].into_iter().enumerate() {
        let aside = DVec2::from_angle(azimuth_deg.to_radians()) * 65_f64.to_radians().sin();
        let seen = field.still(aside.extend(65_f64.to_radians().cos()).as_vec3a()).to_array();
        let weakest = (0..3).min_by(|a, b| seen[*a].total_cmp(&seen[*b])).unwrap();
        assert_eq!(weakest, light, "{seen:?}");
    }
    // A point that was not moved has the same light by either table.
    let sample = |direction: DVec3, deformed| SurfaceSample {
        point_mm: (direction * 10.0).as_vec3a(),
        material_mm: (direction * 10.0).as_vec3a(),
        normal: direction.as_vec3a(),
        to_camera: Vec3A::NEG_Z,
        is_moved: deformed,
    };
    let moved_scene = self::scene(
        r#", "objects": [ { "name": "ball", "shape": { "kind": "sphere", "radius_mm": 4 },
             "path": [ { "time_s": 0, "position_mm": [0, 0, 40] } ] } ]"#,
    );
    let dome = ShadedDome::new(&moved_scene, &ALL, &mut work).unwrap().unwrap();
    let brightest = 450.0 * 0.55 / 2.0 * dome.field().brightest()[1];
    for direction in directions(60).filter(|d| d.z > 0.15) {
        let levels = [false, true].map(|is_moved| dome.level(&sample(direction, is_moved)));
        for c in 0..3 {
            let off = f64::from(levels[0][c] - levels[1][c]).abs();
            assert!(off < 0.03 * brightest, "{direction}: {levels:?}");
        }
    }
}

#[test]
fn numbers_for_lights_that_are_not_there_are_refused() {
    let text = scene("").file().clone();
    let mut file = text;
    file.light.leds.as_mut().unwrap().each = vec![1.0, 1.0];
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
    let design = domecast_design::Design::load(&folder.join("thumb24.json")).unwrap();
    let scene = crate::Scene::new(file, &folder, design).unwrap();
    let error = setup::sources(&scene, &ALL).unwrap_err().to_string();
    assert!(error.contains("light.leds.each"), "{error}");
}

#[test]
fn lights_that_stand_aside_move_alone() {
    let file = scene("").file().clone();
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
    let design = domecast_design::Design::load(&folder.join("thumb24.json")).unwrap();
    let with = |moved: Vec<MovedLed>| {
        let mut file = file.clone();
        file.light.leds.as_mut().unwrap().moved = moved;
        let scene = crate::Scene::new(file, &folder, design.clone()).unwrap();
        setup::sources(&scene, &ALL)
    };
    let (before, mut moved) = (with(Vec::new()).unwrap(), vec![MovedLed::default(); 6]);
    moved[2] = MovedLed { out_mm: 0.1, along_mm: -0.2, up_mm: 0.05, tilt_deg: 2.0, turn_deg: 0.0 };
    let after = with(moved).unwrap();
    for (i, (a, b)) in before.iter().zip(&after).enumerate() {
        let [a, b] = [a, b].map(|source| source.emitter.platform_from_emitter);
        let out = a.translation.with_z(0.0).normalize();
        let expected =
            if i == 2 { out * 0.1 - DVec3::Z.cross(out) * 0.2 + DVec3::Z * 0.05 } else { DVec3::ZERO };
        assert!((b.translation - a.translation - expected).length() < 1e-12, "light {i}");
        let turned = b.matrix3.z_axis.angle_between(a.matrix3.z_axis).to_degrees();
        assert!((turned - if i == 2 { 2.0 } else { 0.0 }).abs() < 1e-6, "light {i}: {turned}");
    }
    let error = with(vec![MovedLed::default(); 2]).unwrap_err().to_string();
    assert!(error.contains("light.leds.moved"), "{error}");
}

/// Largest change of a code between two light fields, of what the camera sees: of the resting membrane, or of one that lies
/// deeper by a twentieth, with normals up to half a radian aside.
fn largest_change(scene: &crate::Scene, a: &ShadedDome, b: &ShadedDome, moved: bool) -> f64 {
    let mut worst = 0.0_f64;
    let gamma = scene.file().electronics.gamma as f32;
    let (width, height) = scene.image_size();
    for (i, direction) in directions(3_000).enumerate() {
        let part = if moved { (1.0 - direction.z).max(0.95) } else { 1.0 };
        let point = direction * (scene.optics().dome_radius_mm() * part);
        let Ok(pixel) = scene.optics().project(point) else { continue };
        let (aside, last) = (pixel.max(DVec2::ZERO), DVec2::new(width as f64 - 1.0, height as f64 - 1.0));
        let (Ok((_, inside)), true) = (scene.optics().trace_continued(pixel), aside.min(last) == pixel)
        else {
            continue;
        };
        let tilt =
            if moved { direction.any_orthonormal_vector() * 0.5 * (i as f64).sin() } else { DVec3::ZERO };
        let sample = SurfaceSample {
            point_mm: point.as_vec3a(),
            material_mm: (direction * scene.optics().dome_radius_mm()).as_vec3a(),
            normal: (direction + tilt).normalize().as_vec3a(),
            to_camera: Vec3A::from(-inside.as_vec3()),
            is_moved: moved,
        };
        let code = |dome: &ShadedDome| dome.level(&sample).max(glam::Vec4::ZERO).powf(1.0 / gamma);
        worst = worst.max(255.0 * f64::from((code(a) - code(b)).abs().truncate().max_element()));
    }
    worst
}

/// Each set of effects of the light, left out together.
#[test]
fn no_effects_of_light_pass_their_bound() {
    let object = r#", "objects": [ { "name": "ball", "shape": { "kind": "sphere", "radius_mm": 4 },
             "path": [ { "time_s": 0, "position_mm": [0, 0, 40] } ] } ]"#;
    for more in ["", r#", "electronics": { "gamma": 2.2 }"#, object] {
        let mut file = scene(more).file().clone();
        // Dim, so that no change ends at full scale.
        file.light.leds.as_mut().unwrap().power = 0.1;
        let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
        let design = domecast_design::Design::load(&folder.join("thumb24.json")).unwrap();
        let scene = crate::Scene::new(file, &folder, design).unwrap();
        let coarse = CoarseLight::of(&scene, &[Rigid::identity()]).unwrap().expect("lights");
        let lit = |used: LightUse| ShadedDome::new(&scene, &used, &mut Work::default()).unwrap().unwrap();
        let moved = more.contains("objects");
        let all = lit(ALL);
        let mut tightest = 0.0_f64;
        for set in 1..32 {
            let keeps = |bit: u32| set & (1 << bit) == 0;
            let used = LightUse {
                direct: true,
                falloff: keeps(0),
                diffuser: keeps(1),
                fresnel: keeps(2),
                platform_shadow: keeps(3),
                interreflection: keeps(4),
            };
            let bound = coarse.change_grey(&ALL, &used, scene.file().electronics.gamma);
            let found = largest_change(&scene, &all, &lit(used), moved);
            println!("{set:05b}: {found:.1} of {bound:.1}");
            assert!(found <= bound, "{used:?}: {found} {bound}");
            // A membrane that objects move may have any normal anywhere.
            assert!(moved || bound <= 6.0 * found, "{used:?}: {found} {bound}");
            tightest = tightest.max(found / bound);
        }
        println!("tightest: {tightest:.2}");
    }
}

#[test]
fn codes_change_most_from_dark() {
    assert_eq!(bounds::grey_of_change(1.0, 2.0), 255.0);
    assert!((bounds::grey_of_change(2.0, 0.01) - 25.5).abs() < 1e-9);
    assert!((bounds::grey_of_change(0.5, 0.01) - 5.1).abs() < 1e-9);
}

#[test]
fn a_change_of_light_changes_no_code_by_more_than_its_bound_and_none_by_more_than_the_scale() {
    for gamma in [0.5, 1.0, 2.2] {
        let code = |light: f64| 255.0 * light.clamp(0.0, 1.0).powf(1.0 / gamma);
        for i in 0..60 {
            for j in 0..60 {
                let (before, after) = (f64::from(i) * 0.05, f64::from(j) * 0.05);
                let bound = super::bounds::grey_of_change(gamma, (after - before).abs());
                let found = (code(after) - code(before)).abs();
                assert!(found <= bound + 1e-9 && bound <= 255.0, "{gamma} {before} {after}: {found} {bound}");
            }
        }
    }
}
