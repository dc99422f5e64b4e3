//! Rows that are exposed one after the other, against whole pictures of the sensor as it is at each row's time.

use std::path::Path;

use crate::contact::between::Between;
use crate::contact::shape::{Shapes, SkinShape};
use crate::contact::stepper::{Stepper, Touch};
use crate::*;

fn scene(more: &str) -> Scene {
    let text = format!(
        r#"{{ "version": 1, "name": "rows", "design": "thumb24.json", "frames": {{ "count": 3, "rate_hz": 2 }},
        "tolerance": {{ "px": 0.5, "grey": 1 }}, "seed": 1 {more} }}"#
    );
    Scene::from_text(&text, &Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs"))
        .unwrap()
}

/// The platform on its way from rest at 0 s to the second of these at 1 s, or held at a part of the way.
fn on_the_way(part: Option<f64>) -> String {
    let (translation, rotation) = ([0.5, -0.9, 0.15], [2.0, 3.0, -5.0]);
    let key = |time_s: f64, part: f64| {
        let [t, r] = [translation, rotation].map(|v: [f64; 3]| v.map(|v| v * part));
        format!(r#"{{ "time_s": {time_s}, "translation_mm": {t:?}, "rotation_deg": {r:?} }}"#)
    };
    let (from, to) = part.map_or((0.0, 1.0), |part| (part, part));
    format!(r#", "motion": {{ "pose": [{}, {}] }}"#, key(0.0, from), key(1.0, to))
}

const READOUT_S: f64 = 0.4;

#[test]
fn each_row_shows_the_sensor_as_it_is_at_its_time() {
    let shutter =
        format!(r#", "electronics": {{ "shutter": {{ "exposure_s": 0, "readout_s": {READOUT_S} }} }}"#);
    for light in ["", r#", "light": { "leds": { "level_per_mw_mm2": 450 } }"#] {
        let moving = scene(&format!("{}{shutter}{light}", on_the_way(None)));
        let plan = Plan::everything(&moving).unwrap();
        let drawn = Renderer::new(&moving, &plan).unwrap().frame(1).unwrap();
        let (width, height) = moving.image_size();
        let rolled = drawn.image.unwrap();
        let (mut worst, mut sum, mut count, mut moved) = (0, 0, 0, 0.0_f64);
        for y in (15..height).step_by(45) {
            let time_s = 0.5 + READOUT_S * (y as f64 / (height - 1) as f64 - 0.5);
            let held = scene(&format!("{}{light}", on_the_way(Some(time_s))));
            let plan = Plan::everything(&held).unwrap();
            let still = Renderer::new(&held, &plan).unwrap().frame(0).unwrap();
            let row = y * width * rolled.channels..(y + 1) * width * rolled.channels;
            let image = still.image.unwrap();
            for (a, b) in rolled.bytes[row.clone()].iter().zip(&image.bytes[row]) {
                let off = a.abs_diff(*b);
                worst = worst.max(off);
                sum += u64::from(off);
                count += 1;
            }
            // Dots in this row are seen where they are at its time.
            for (a, b) in drawn.truth.black_dots.iter().zip(&still.truth.black_dots) {
                if let (Some(a), Some(b)) = (a.image_px, b.image_px)
                    && (a[1] - y as f64).abs() < 0.5
                {
                    let off = (a[0] - b[0]).hypot(a[1] - b[1]);
                    moved = moved.max(off);
                    assert!(off < 0.02, "{a:?} {b:?}");
                }
            }
        }
        let mean = sum as f64 / f64::from(count);
        println!("worst {worst} grey, mean {mean:.3}, dots {moved:.4} px");
        // Edges of the dome and of shadows are where they are at the middle of a slice, half of 0.3 px from their row's.
        assert!(worst <= 15 && mean < 0.1, "{worst} {mean}");
    }
}

#[test]
fn a_dome_between_frames_is_the_mean_of_both() {
    let ball = r#", "contact": { "level": "linear", "element_mm": 2.0 }, "objects": [{ "name": "ball",
        "shape": { "kind": "sphere", "radius_mm": 5 }, "path": [
        { "time_s": 0, "position_mm": [0, 0, 14.8] }, { "time_s": 1, "position_mm": [0.8, 0.3, 14.2] } ] }]"#;
    let scene = scene(ball);
    let plan = Plan::everything(&scene).unwrap();
    let renderer = Renderer::new(&scene, &plan).unwrap();
    let mut work = Work::default();
    let mut stepper = Stepper::new(&scene, renderer.pipeline().contact.unwrap()).unwrap();
    let touches: Vec<Touch> = (0..3).map(|k| stepper.next(k, scene.time_s(k), &mut work).unwrap()).collect();
    let around = Around::of(&touches, 1).unwrap();
    let dome = *scene.optics().dome();
    let shapes = Shapes::new(&around, &renderer.points().on_dome_mm(), dome, Some(0.5), &mut work).unwrap();
    let places = renderer.points().on_dome_mm();
    for (frames, from, to, part) in [(-0.7, 0, 1, 0.3), (0.0, 1, 1, 0.0), (0.25, 1, 2, 0.25)] {
        let shape = shapes.at(frames);
        let between = Between { from: touches[from].clone(), to: touches[to].clone(), part };
        let alone = SkinShape::of(Some(between.clone()), dome, Some(0.5), &mut work);
        let expected = between.displacements_mm(&places);
        let mut largest = 0.0_f64;
        for (k, (a, b)) in shape.displaced_mm.unwrap().iter().zip(&expected).enumerate() {
            assert!(a.distance(*b) < 1e-12, "{k}: {a} {b}");
            largest = largest.max(a.length());
            // A ray from the middle of the base through the point.
            let (place, out) = (places[k].as_vec3a(), places[k].normalize().as_vec3a());
            let (with, without) = (shape.map.as_ref().unwrap(), alone.map.as_ref().unwrap());
            if let (Some((at, one)), Some((_, other))) =
                (with.meet(place, out, glam::Vec3A::ZERO), without.meet(place, out, glam::Vec3A::ZERO))
            {
                let off = one.displacement_mm.distance(other.displacement_mm);
                assert!(off < 0.01 && one.normal.angle_between(other.normal) < 0.1, "{frames}: {at} {off}");
            }
        }
        assert!(largest > 0.1, "{largest}");
    }
}
