//! Pictures of the lit dome: what is filled in between the nodes, and where dots are seen under lights.

use std::path::Path;

use glam::DVec2;

use super::coverage::{Coverage, LEAST_SHARE, clip_to_image};
use super::eye::Eye;
use super::field::{LensField, cap_box, rim_polygon};
use super::instant::dent_step_mm;
use super::lit::{Lit, LitSlice, LitSurface};
use super::shapes::Shape;
use super::touch::Between;
use super::*;
use crate::design;

/// A ball rolled into the dome of thumb24 under its lights, at a level of contact; five frames, without noise.
fn rolled(level: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("designs/scenes");
    let text = format!(
        r#"{{
        "version": 1, "name": "t", "design": "../thumb24.json", "frames": {{ "count": 5, "rate_hz": 10 }},
        "tolerance": {{ "px": 1e-9, "grey": 1e-9 }}, "contact": {{ "level": "{level}", "element_mm": 1 }},
        "objects": [{{ "name": "ball", "shape": {{ "kind": "sphere", "radius_mm": 4 }}, "path": [
            {{ "time_s": 0, "position_mm": [0, 0, 14.1] }},
            {{ "time_s": 0.4, "position_mm": [1.5, 0.5, 13.1], "rotation_deg": [0, 9, 0] }} ]}}],
        "light": {{ "surround_level": 0.02,
            "leds": {{ "level_per_mw_mm2": 450, "stray_level": 0.005, "crosstalk": 0.08 }} }} }}"#
    );
    Scene::from_text(&text, &folder).unwrap_or_else(|error| panic!("{error}"))
}

/// Levels of every pixel of the dome, each from its own ray or filled in within a tolerance, and the rays traced.
fn levels(scene: &Scene, frame: u32, tolerance: f32) -> (Vec<[f32; 3]>, u64, Vec<(usize, usize)>) {
    let mut work = Work::default();
    let plan = Plan::everything(scene).unwrap();
    let pipeline = plan.pipeline(scene, &mut work).unwrap();
    let eye = Eye::new(scene, pipeline.geometry).unwrap();
    let level = pipeline.contact.unwrap();
    let mut stepper = Stepper::new(scene, level).unwrap();
    let touches: Vec<Touch> =
        (0..=frame).map(|k| stepper.next(k, scene.time_s(k), &mut work).unwrap()).collect();
    let around = Between::at_frame(touches.last().unwrap().clone());
    let state = around.state(scene.suspension().at_mm());
    let step = Some(dent_step_mm(Some(level)));
    let shape = Shape::of(Some(around), scene.optics().dome_radius_mm(), step, &mut work);
    let time_s = scene.time_s(frame);
    let instant = Instant::new(&eye, pipeline.geometry, time_s, state, shape, &mut work).unwrap();
    let optics = instant.eye.optics(1).unwrap();
    let (width, height) = scene.image_size();
    let mut coverage = Coverage::default();
    coverage.fill(&clip_to_image(&rim_polygon(optics), width, height));
    let field = LensField::new(optics.lens(), width, height);
    let mut spans = vec![0..0; height];
    coverage.spans(width, height, &(0..height), &mut spans);
    for (y, span) in spans.iter_mut().enumerate() {
        *span = span.start.max(field.row(y).start)..span.end.min(field.row(y).end);
    }
    let shading = pipeline.shading.as_deref().unwrap();
    let slices = [LitSlice { end: height, optics, dent: instant.shape.dent.as_ref() }];
    let surface = LitSurface { slices: &slices, rays: Some(field.rays()), shading, channel: 0, tolerance };
    let pressed = instant.shape.touch.as_ref().unwrap().pressed_cap();
    let dented = pressed.map(|(middle, angle)| cap_box(optics, middle, angle + 0.06, width, height));
    let mut lit = Lit::<3>::default();
    let mut spent = Work::default();
    lit.fill(&surface, (width, height), &spans, dented, &mut spent);
    let rays = spent.of(EffectName::Fresnel) / light::shade::LEAVING_UNITS;
    let (mut out, mut places) = (Vec::new(), Vec::new());
    let center = DVec2::new(width as f64, height as f64) * 0.5;
    for (y, x, part) in coverage.rows(width, height) {
        let columns = spans[y].clone();
        let shares = &part[columns.start - x..columns.end - x];
        lit.complete(y, columns.clone(), shares, center);
        let lanes = [0, 1, 2].map(|lane| lit.row(lane, y, columns.clone()));
        for k in 0..columns.len() {
            if shares[k] > LEAST_SHARE {
                out.push([lanes[0][k], lanes[1][k], lanes[2][k]]);
                places.push((columns.start + k, y));
            }
        }
    }
    (out, rays, places)
}

#[test]
fn what_is_filled_in_is_what_each_ray_shows() {
    for (level, most) in [("geometric", 6.0), ("closed_form", 6.0), ("linear", 6.0)] {
        let scene = rolled(level);
        let (filled, few, _) = levels(&scene, 3, 2.0 / 255.0);
        let (exact, all, places) = levels(&scene, 3, 0.0);
        assert_eq!(filled.len(), exact.len());
        let off: Vec<f32> = filled
            .iter()
            .zip(&exact)
            .map(|(a, b)| (0..3).map(|c| 255.0 * (a[c] - b[c]).abs()).fold(0.0, f32::max))
            .collect();
        let worst = off.iter().copied().fold(0.0, f32::max);
        let above = |grey: f32| off.iter().filter(|off| **off > grey).count();
        for (at, off) in places.iter().zip(&off).filter(|(_, off)| **off > 3.0).take(10) {
            println!("{at:?}: {off}");
        }
        let mean = off.iter().sum::<f32>() / off.len() as f32;
        let [one, three] = [1.0, 3.0].map(above);
        println!(
            "{level}: {few} rays of {all}, {} px; mean {mean} grey levels off, {one} px by more than 1, {three} by more \
             than 3, at most {worst}",
            off.len()
        );
        assert!(few * 6 < all, "{level}: {few} {all}");
        // Along the edges of shadows and of the dent a square may miss a corner.
        assert!(
            mean < 0.15 && one * 100 < off.len() && three * 2000 < off.len(),
            "{level}: {mean} {one} {three}"
        );
        assert!(worst < most, "{level}: {worst}");
    }
}

/// Centroid of the ink in a channel: each pixel's covered part is what it lacks of the same picture without dots. Pixels
/// that lack no more than rounding takes are none of the dot's.
fn inked(image: &Image8, bare: &Image8, channel: usize, near: [f64; 2]) -> (DVec2, [f64; 2]) {
    let (x0, y0) = (near[0].round() as i64, near[1].round() as i64);
    let (mut sum, mut moment, mut least, mut most) = (0.0, DVec2::ZERO, f64::INFINITY, 0.0_f64);
    for y in y0 - REACH..=y0 + REACH {
        for x in x0 - REACH..=x0 + REACH {
            let at = (y as usize * image.width + x as usize) * image.channels + channel;
            let (value, ground) = (f64::from(image.bytes[at]), f64::from(bare.bytes[at]));
            (least, most) = (least.min(ground), most.max(ground));
            if ground - value > 1.0 {
                let part = 1.0 - value / ground;
                sum += part;
                moment += DVec2::new(x as f64, y as f64) * part;
            }
        }
    }
    (moment / sum, [least, most])
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
        bare.effects = design::from_value(&serde_json::json!({ "dots": "never" })).unwrap();
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
                for (channel, told) in dot.centroid_rgb_px.unwrap().into_iter().enumerate() {
                    let Some(told) = told else { continue };
                    let (found, [darkest, brightest]) = inked(&image, &ground, channel, told);
                    // Where the picture is at its end, nobody knows what it lacks.
                    if darkest < DARKEST || brightest > 254.0 {
                        continue;
                    }
                    worst = worst.max((found - DVec2::from(told)).length());
                    seen += 1;
                }
            }
            println!("{level} {frame}: {seen} centroids, at most {worst} px off");
            assert!(seen > 150 && worst < 0.02, "{level} {frame}: {worst} px in {seen}");
        }
    }
}
