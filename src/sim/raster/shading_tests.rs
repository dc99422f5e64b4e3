//! Pictures of the lit dome: what is filled in between the nodes, and where dots are seen under lights.

use std::path::Path;

use glam::DVec2;

use crate::contact::between::Between;
use crate::contact::level::{level_of, map_step_mm};
use crate::contact::shape::SkinShape;
use crate::plan::fill::{fill_grey, fill_tolerance};
use crate::raster::coverage::{Coverage, MIN_SHARE, clip_to_image};
use crate::raster::lattice::Lattice;
use crate::raster::lens_field::{LensField, rim_polygon};
use crate::raster::projector::Projector;
use crate::raster::surface::{ShadedSlice, ShadedSurface};
use crate::*;
use domecast_design;
use domecast_optics::numeric::SeededRandom;

/// A ball rolled into the dome of thumb24 under its lights, at a level of contact; five frames, without noise.
fn rolled(level: &str) -> Scene {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs/scenes");
    let text = format!(
        r#"{{
        "version": 1, "name": "t", "design": "../thumb24.json", "frames": {{ "count": 5, "rate_hz": 10 }},
        "tolerance": {{ "px": 1e-9, "grey": 2 }}, "contact": {{ "level": "{level}", "element_mm": 1 }},
        "objects": [{{ "name": "ball", "shape": {{ "kind": "sphere", "radius_mm": 4 }}, "path": [
            {{ "time_s": 0, "position_mm": [0, 0, 14.1] }},
            {{ "time_s": 0.4, "position_mm": [1.5, 0.5, 13.1], "rotation_deg": [0, 9, 0] }} ]}}],
        "light": {{ "surround_level": 0.02,
            "leds": {{ "level_per_mw_mm2": 450, "stray_level": 0.005, "crosstalk": 0.08 }} }} }}"#
    );
    Scene::from_text(&text, &folder).unwrap_or_else(|error| panic!("{error}"))
}

/// The levels of every pixel of the dome, and the rays that were traced for them.
type Levels = (Vec<[f32; 3]>, u64);

/// Levels of every pixel of the dome, filled in within some tolerances (full scales; 0: each from its own ray), and where
/// they are.
fn levels(scene: &Scene, frame: u32, tolerances: &[f32]) -> (Vec<Levels>, Vec<(usize, usize)>) {
    let mut work = Work::default();
    let plan = Plan::everything(scene).unwrap();
    let pipeline = plan.pipeline(scene, &mut work).unwrap();
    let eye = Projector::new(scene, pipeline.geometry).unwrap();
    let level = pipeline.contact.unwrap();
    let mut stepper = Stepper::new(scene, level).unwrap();
    let touches: Vec<Touch> =
        (0..=frame).map(|k| stepper.next(k, scene.time_s(k), &mut work).unwrap()).collect();
    let around = Between::at_frame(touches.last().unwrap().clone());
    let state = around.state(scene.reference_mm());
    let step = Some(map_step_mm(Some(level)));
    let shape = SkinShape::of(Some(around), *scene.optics().dome(), step, &mut work);
    let time_s = scene.time_s(frame);
    let instant = SensorState::new(&eye, pipeline.geometry, time_s, state, shape, &mut work).unwrap();
    let optics = instant.eye.optics(1).unwrap();
    let (width, height) = scene.image_size();
    let mut coverage = Coverage::default();
    coverage.fill(&clip_to_image(&rim_polygon(optics), width, height));
    let field = LensField::new(optics.lens(), (width, height), true);
    let mut spans = vec![0..0; height];
    coverage.spans(width, height, &(0..height), &mut spans);
    for (y, span) in spans.iter_mut().enumerate() {
        let start = span.start.max(field.row(y).start);
        *span = start..span.end.min(field.row(y).end).max(start);
    }
    let shading = pipeline.shading.as_deref().unwrap();
    let slices = [ShadedSlice { end: height, optics, map: instant.shape.map.as_ref() }];
    let center = DVec2::new(width as f64, height as f64) * 0.5;
    let mut lattice = Lattice::default();
    let mut places = Vec::new();
    let mut filled = |tolerance: f32| {
        let rays = field.rays().unwrap();
        let surface = ShadedSurface { slices: &slices, rays, shading, channels: 0..3, center, tolerance };
        let mut spent = Work::default();
        lattice.prepare(&surface, &spans, &mut spent);
        let mut out = Vec::new();
        places.clear();
        for (y, x, part) in coverage.rows(width, height) {
            let columns = spans[y].clone();
            if columns.is_empty() {
                continue;
            }
            let shares = &part[columns.start - x..columns.end - x];
            let found = lattice.row(&surface, y, columns.clone(), &mut spent);
            for k in (0..columns.len()).filter(|k| shares[*k] > MIN_SHARE) {
                out.push([found[k].x, found[k].y, found[k].z]);
                places.push((columns.start + k, y));
            }
        }
        let rays = spent.of(EffectName::Fresnel) / light::shade::LEAVING_UNITS;
        (out, rays)
    };
    let all = tolerances.iter().map(|tolerance| filled(*tolerance)).collect();
    (all, places)
}

/// Objects that leave edges, and how they are held against the dome.
const OBJECTS: [(&str, &str); 6] = [
    (
        "ball",
        r#""shape": { "kind": "sphere", "radius_mm": 4 }, "path": [{ "time_s": 0, "position_mm": [1, 0.4, 13.2] }]"#,
    ),
    (
        "box edge",
        r#""shape": { "kind": "box", "size_mm": [4, 6, 3] },
           "path": [{ "time_s": 0, "position_mm": [0.6, 0, 13.5], "rotation_deg": [35, 0, 20] }],
           "press": { "direction": [0, 0, -1], "force": [{ "time_s": 0, "force_n": 3 }] }"#,
    ),
    (
        "cone",
        r#""shape": { "kind": "cone", "radius_mm": 3, "height_mm": 4 },
           "path": [{ "time_s": 0, "position_mm": [1.5, 0.5, 10.5], "rotation_deg": [10, 5, 0] }],
           "press": { "direction": [0, 0, -1], "force": [{ "time_s": 0, "force_n": 1 }] }"#,
    ),
    (
        "nut",
        r#""shape": { "kind": "mesh", "file": "meshes/nut.stl" },
           "path": [{ "time_s": 0, "position_mm": [0, 0, 13] }],
           "press": { "direction": [0, 0, -1], "force": [{ "time_s": 0, "force_n": 5 }] }"#,
    ),
    (
        "USB plug",
        r#""shape": { "kind": "mesh", "file": "meshes/usb_plug.stl" },
           "path": [{ "time_s": 0, "position_mm": [0.5, 0, 11.5], "rotation_deg": [0, 12, 0] }],
           "press": { "direction": [0, 0, -1], "force": [{ "time_s": 0, "force_n": 4 }] }"#,
    ),
    (
        "bolt",
        r#""shape": { "kind": "mesh", "file": "meshes/bolt.stl" },
           "path": [{ "time_s": 0, "position_mm": [2, 0, 15], "rotation_deg": [0, 90, 0] }],
           "press": { "direction": [0, 0, -1], "force": [{ "time_s": 0, "force_n": 5 }] }"#,
    ),
];

/// An object against the dome of a design under its lights, at a level of contact.
fn pressed(design: &str, level: &str, object: &str, grey: f64) -> Scene {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs/scenes");
    let text = format!(
        r#"{{
        "version": 1, "name": "t", "design": "../{design}.json", "frames": {{ "count": 1, "rate_hz": 10 }},
        "tolerance": {{ "px": 1e-3, "grey": {grey} }}, "contact": {{ "level": "{level}", "element_mm": 1 }},
        "objects": [{{ "name": "object", {object} }}],
        "light": {{ "surround_level": 0.02,
            "leds": {{ "level_per_mw_mm2": 450, "stray_level": 0.005, "crosstalk": 0.08 }} }} }}"#
    );
    Scene::from_text(&text, &folder).unwrap_or_else(|error| panic!("{error}"))
}

/// Compares filled pictures of a scene with one whose pixels each have their own ray, at some tolerances of the scene in
/// grey levels: no pixel may be further off.
fn keeps_within(design: &str, level: &str, (name, object): (&str, &str), greys: &[f64]) {
    let scene = pressed(design, level, object, 1.0);
    let tolerance = |grey: &f64| {
        let scene = pressed(design, level, object, *grey);
        fill_tolerance(&scene, fill_grey(&scene))
    };
    let tolerances: Vec<f32> = greys.iter().map(tolerance).chain([0.0]).collect();
    let (mut all, places) = levels(&scene, 0, &tolerances);
    let (exact, every) = all.pop().unwrap();
    for ((filled, rays), grey) in all.iter().zip(greys) {
        assert_eq!(filled.len(), exact.len());
        let far =
            |a: &[f32; 3], b: &[f32; 3]| (0..3).map(|c| 255.0 * (a[c] - b[c]).abs()).fold(0.0, f32::max);
        let each = filled.iter().zip(&exact).zip(&places);
        let mut off: Vec<(f32, (usize, usize))> = each.map(|((a, b), at)| (far(a, b), *at)).collect();
        off.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mean = off.iter().map(|off| off.0).sum::<f32>() / off.len() as f32;
        let rank = |part: f64| off[(part * (off.len() - 1) as f64) as usize];
        let (worst, at) = rank(1.0);
        println!(
            "{design} {name} {level} {grey}: {rays} rays of {every}; mean {mean:.3}, 99 % {:.2}, 99.9 % {:.2}, at most \
             {worst:.2} at {at:?}, {:.2} of the tolerance",
            rank(0.99).0,
            rank(0.999).0,
            f64::from(worst) / grey
        );
        // What the plan counts on, a part of the tolerance.
        let limit = fill_grey(&pressed(design, level, object, *grey));
        assert!(f64::from(worst) <= limit, "{design} {name} {level} {grey}: {worst} at {at:?}");
    }
}

#[test]
fn what_is_filled_in_is_what_each_ray_shows() {
    for level in ["geometric", "closed_form", "linear"] {
        keeps_within("thumb24", level, OBJECTS[0], &[1.0, 4.0]);
    }
    keeps_within("thumb24-pinhole", "geometric", OBJECTS[2], &[1.0, 2.0]);
    keeps_within("thumb24", "linear", OBJECTS[1], &[1.0, 2.0]);
}

#[test]
fn long_objects_are_filled_in_as_each_ray_shows_them() {
    for design in ["thumb24", "thumb24-pinhole", "thumb24-fisheye"] {
        for object in OBJECTS {
            for level in ["geometric", "closed_form", "linear"] {
                // The closed form knows balls.
                if level != "closed_form" || object.0 == "ball" {
                    keeps_within(design, level, object, &[1.0, 2.0, 4.0]);
                }
            }
        }
    }
}

/// A random object against the dome, as a scene says it: a ball, a block, a cone or a bar, held or pressed on somewhere.
fn random_object(random: &mut SeededRandom) -> (&'static str, String) {
    let (x, y) = (random.between(-3.5, 3.5), random.between(-3.5, 3.5));
    let turn = [0; 3].map(|_| random.between(-60.0, 60.0));
    let size = [0; 3].map(|_| random.between(1.5, 6.0));
    let force_n = random.between(0.3, 5.0);
    let place = |height: f64| format!(r#""path": [{{ "time_s": 0, "position_mm": [{x}, {y}, {height}]"#);
    let turned = |height: f64| format!("{}, \"rotation_deg\": {turn:?} }}]", place(height));
    let pressed = format!(
        r#""press": {{ "direction": [0, 0, -1], "force": [{{ "time_s": 0, "force_n": {force_n} }}] }}"#
    );
    match (random.uniform() * 4.0) as u32 {
        0 => {
            let radius = random.between(1.5, 6.0);
            let height = (10.0_f64 + radius).powi(2) - x * x - y * y;
            let height = height.sqrt() - random.between(0.05, 1.0);
            (
                "ball",
                format!(r#""shape": {{ "kind": "sphere", "radius_mm": {radius} }}, {} }}]"#, place(height)),
            )
        }
        1 => {
            let shape = format!(r#""shape": {{ "kind": "box", "size_mm": {size:?} }}"#);
            ("box", format!("{shape}, {}, {pressed}", turned(16.0)))
        }
        2 => {
            let tip =
                format!("{}, \"rotation_deg\": [{}, {}, 0] }}]", place(12.0), 0.3 * turn[0], 0.3 * turn[1]);
            let shape = format!(
                r#""shape": {{ "kind": "cone", "radius_mm": {}, "height_mm": {} }}"#,
                size[0], size[1]
            );
            ("cone", format!("{shape}, {tip}, {pressed}"))
        }
        _ => {
            let shape = format!(
                r#""shape": {{ "kind": "cylinder", "radius_mm": {}, "length_mm": {} }}"#,
                0.5 * size[0],
                2.0 * size[1]
            );
            ("bar", format!("{shape}, {}, {pressed}", turned(16.0)))
        }
    }
}

/// The estimate of the lattice's error is put to random scenes, of which every pixel is traced as well.
fn random_scenes_keep_within(first: u64, count: u64) {
    let mut compared = 0;
    for seed in first..first + count {
        let mut random = SeededRandom::new(seed);
        let design = ["thumb24", "thumb24-pinhole", "thumb24-fisheye"][(random.uniform() * 3.0) as usize];
        let (name, object) = random_object(&mut random);
        let level = if random.uniform() < 0.5 { "geometric" } else { "linear" };
        let name = format!("{seed} {name}");
        // Some objects reach into the sheet or beyond the level.
        let scene = pressed(design, level, &object, 1.0);
        let contact = level_of(&scene);
        if Stepper::new(&scene, contact).unwrap().next(0, 0.0, &mut Work::default()).is_err() {
            continue;
        }
        compared += 1;
        keeps_within(design, level, (&name, &object), &[1.0, 2.0, 4.0]);
    }
    assert!(4 * compared >= 3 * count, "only {compared} of {count} can be");
}

#[test]
fn random_dents_are_drawn_as_every_ray_shows_them() {
    random_scenes_keep_within(1, 12);
}

#[test]
fn long_random_dents_are_drawn_as_every_ray_shows_them() {
    random_scenes_keep_within(100, 60);
}

/// Centroid of the ink in a channel: each pixel's covered part is what it lacks of the same picture without dots. Pixels
/// that lack no more than rounding takes are none of the dot's.
fn inked(image: &Image8, bare: &Image8, channel: usize, near: [f64; 2]) -> (DVec2, [f64; 2]) {
    let (x0, y0) = (near[0].round() as i64, near[1].round() as i64);
    let (mut sum, mut moment, mut smallest, mut largest) = (0.0, DVec2::ZERO, f64::INFINITY, 0.0_f64);
    for y in y0 - REACH..=y0 + REACH {
        for x in x0 - REACH..=x0 + REACH {
            let at = (y as usize * image.width + x as usize) * image.channels + channel;
            let (value, ground) = (f64::from(image.bytes[at]), f64::from(bare.bytes[at]));
            (smallest, largest) = (smallest.min(ground), largest.max(ground));
            if ground - value > 1.0 {
                let part = 1.0 - value / ground;
                sum += part;
                moment += DVec2::new(x as f64, y as f64) * part;
            }
        }
    }
    (moment / sum, [smallest, largest])
}

/// Pixels about a dot that are looked at: a dot is 7 px wide, and under the ball its neighbours come nearer than 18.
const REACH: i64 = 6;

/// Where it is darker than this, grey levels, rounding alone moves a measured centroid too far.
const DARKEST: f64 = 40.0;

#[test]
fn dots_under_lights_are_where_the_truth_says() {
    for level in ["geometric", "closed_form", "linear"] {
        let scene = rolled(level);
        let mut bare = scene.file().clone();
        bare.effects = domecast_design::from_value(&serde_json::json!({ "dots": "never" })).unwrap();
        let bare = Scene::new(bare, scene.folder(), scene.design().clone()).unwrap();
        let drawn = |scene: &Scene, frame: u32| {
            let renderer = Renderer::new(scene, &Plan::everything(scene).unwrap()).unwrap();
            renderer.frame(frame).unwrap()
        };
        for frame in [0, 3] {
            let (with, without) = (drawn(&scene, frame), drawn(&bare, frame));
            let (image, ground) = (with.image.unwrap(), without.image.unwrap());
            let (mut worst, mut seen): (f64, usize) = (0.0, 0);
            for dot in with.truth.black_dots.iter().filter(|dot| dot.visible) {
                for (channel, truth_px) in dot.centroid_rgb_px.unwrap().into_iter().enumerate() {
                    let Some(truth_px) = truth_px else { continue };
                    let (found, [darkest, brightest]) = inked(&image, &ground, channel, truth_px);
                    // Where the picture is at its end, nobody knows what it lacks.
                    if darkest < DARKEST || brightest > 254.0 {
                        continue;
                    }
                    worst = worst.max((found - DVec2::from(truth_px)).length());
                    seen += 1;
                }
            }
            println!("{level} {frame}: {seen} centroids, at most {worst} px off");
            assert!(seen > 150 && worst < 0.02, "{level} {frame}: {worst} px in {seen}");
        }
    }
}
