//! Each effect of light and electronics against its own bound, and against what it counts.

use std::path::Path;

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::output::render::Renderer;
use crate::plan::Plan;
use crate::{Image8, Scene, Work};

const ELECTRONICS: &str = r#", "electronics": { "vignetting_exponent": 0.4,
    "focus": { "pupil_diameter_mm": 0.3, "distance_mm": 15.5 } }"#;

fn scene(level: f64, more: &str) -> Scene {
    let text = format!(
        r#"{{ "version": 1, "name": "bounded", "design": "thumb24.json",
        "frames": {{ "count": 1, "rate_hz": 30 }}, "tolerance": {{ "px": 0.001, "grey": 0.001 }},
        "light": {{ "surround_level": 0, "leds": {{ "level_per_mw_mm2": {level} }} }} {more} }}"#
    );
    Scene::from_text(&text, &Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs"))
        .unwrap()
}

/// The first frame by all effects of the scene, but one.
fn picture(scene: &Scene, without: Option<EffectName>) -> (Image8, Work, Option<Bound>) {
    let mut plan = Plan::everything(scene).unwrap();
    let mut bound = None;
    for entry in &mut plan.entries {
        if Some(entry.effect) == without {
            entry.used = false;
            bound = entry.bound;
        }
    }
    let renderer = Renderer::new(scene, &plan).unwrap();
    let drawn = renderer.frame(0).unwrap();
    let mut work = *renderer.setup();
    work.merge(&drawn.work);
    (drawn.image.unwrap(), work, bound)
}

fn largest_difference(a: &Image8, b: &Image8) -> f64 {
    f64::from(a.bytes.iter().zip(&b.bytes).map(|(a, b)| a.abs_diff(*b)).max().unwrap())
}

#[test]
fn what_an_effect_of_brightness_changes_stays_within_its_bound() {
    for level in [450.0, 45.0] {
        let scene = scene(level, ELECTRONICS);
        let (all, ..) = picture(&scene, None);
        for effect in [
            EffectName::Falloff,
            EffectName::Diffuser,
            EffectName::Fresnel,
            EffectName::PlatformShadow,
            EffectName::Interreflection,
            EffectName::Vignetting,
            EffectName::Defocus,
        ] {
            let (without, work, bound) = picture(&scene, Some(effect));
            let bound = bound.expect("called for").grey;
            let found = largest_difference(&all, &without);
            println!("{effect} at {level}: {found} of {bound:.1}");
            // Both pictures are rounded to whole levels.
            assert!(found <= bound + 1.0, "{effect}: {found} {bound}");
            assert_eq!(work.of(effect), 0, "{effect} was left out");
            if level > 100.0 {
                assert!(found >= 1.0, "{effect} does something");
            }
        }
    }
}

#[test]
fn a_scene_without_lights_and_electronics_runs_none_of_it() {
    let text = r#"{ "version": 1, "name": "plain", "design": "thumb24.json",
        "frames": { "count": 1, "rate_hz": 30 }, "tolerance": { "px": 0.01, "grey": 0.5 } }"#;
    let scene =
        Scene::from_text(text, &Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs"))
            .unwrap();
    let (_, work, _) = picture(&scene, None);
    for effect in EffectName::ALL.into_iter().filter(|effect| *effect >= EffectName::DirectLight) {
        assert_eq!(work.of(effect), 0, "{effect}");
    }
    let plan = Plan::everything(&scene).unwrap();
    let pipeline = plan.pipeline(&scene, &mut Work::default()).unwrap();
    assert!(pipeline.shading.is_none() && pipeline.passes.is_empty() && pipeline.coded_passes.is_empty());
    assert!(pipeline.timing.exposure.is_none() && pipeline.timing.rolling.is_none());
}

#[test]
fn one_effect_of_the_electronics_alone_runs_alone() {
    for (more, effect) in [
        (r#", "electronics": { "vignetting_exponent": 2 }"#, EffectName::Vignetting),
        (
            r#", "electronics": { "focus": { "pupil_diameter_mm": 0.2, "distance_mm": 12 } }"#,
            EffectName::Defocus,
        ),
        (r#", "electronics": { "bayer": "grbg" }"#, EffectName::Bayer),
        (
            r#", "electronics": { "defects": { "hot_per_million": 1000, "hot_level": [0.2, 0.4] } }"#,
            EffectName::Defects,
        ),
        (r#", "electronics": { "noise": { "full_scale_electrons": 5000 } }"#, EffectName::Noise),
        (r#", "electronics": { "sharpening": { "amount": 0.5, "radius_px": 1.2 } }"#, EffectName::Sharpening),
        (r#", "electronics": { "jpeg_quality": 80 }"#, EffectName::Compression),
    ] {
        let text = format!(
            r#"{{ "version": 1, "name": "one", "design": "thumb24.json",
            "frames": {{ "count": 1, "rate_hz": 30 }}, "tolerance": {{ "px": 0.01, "grey": 0.5 }} {more} }}"#
        );
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
        let scene = Scene::from_text(&text, &folder).unwrap();
        let (image, work, _) = picture(&scene, None);
        for other in EffectName::ALL.into_iter().filter(|other| *other >= EffectName::DirectLight) {
            assert_eq!(work.of(other) > 0, other == effect, "{effect}: {other}");
        }
        let (plain, ..) = picture(&scene, Some(effect));
        assert!(largest_difference(&image, &plain) >= 1.0, "{effect} does something");
        let predicted = Plan::everything(&scene).unwrap().entries.into_iter().find(|e| e.effect == effect);
        let predicted = predicted.and_then(|entry| entry.cost).expect("called for").total(1);
        let ratio = work.of(effect) as f64 / predicted as f64;
        assert!((0.9..1.1).contains(&ratio), "{effect}: counted {}, predicted {predicted}", work.of(effect));
    }
}
