//! What real frames have besides: each against its own bound, against what it counts, and against closed forms.

use std::path::Path;

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::output::render::Renderer;
use crate::plan::Plan;
use crate::{Image8, Scene, Work};
use domecast_optics::numeric::SeededRandom;

/// The effects of these tests.
const EFFECTS: [EffectName; 8] = [
    EffectName::UnevenInk,
    EffectName::UnevenMembrane,
    EffectName::Dust,
    EffectName::Defects,
    EffectName::Sharpening,
    EffectName::AutoExposure,
    EffectName::WhiteBalance,
    EffectName::Gloss,
];

fn scene_of(more: &str) -> Scene {
    let text = format!(
        r#"{{ "version": 1, "name": "worn", "design": "thumb24.json",
        "frames": {{ "count": 1, "rate_hz": 30 }}, "tolerance": {{ "px": 0.001, "grey": 0.001 }} {more} }}"#
    );
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("designs");
    Scene::from_text(&text, &folder).unwrap_or_else(|error| panic!("{error}: {text}"))
}

struct Shown {
    image: Image8,
    centroids: Vec<[f64; 2]>,
    work: Work,
    bound: Option<Bound>,
    predicted: u64,
}

/// The first frame, each pixel traced, by all effects of the scene but one.
fn shown(scene: &Scene, without: Option<EffectName>) -> Shown {
    let mut plan = Plan::exact(scene).unwrap();
    let (mut bound, mut predicted) = (None, 0);
    for entry in plan.entries.iter_mut().filter(|entry| Some(entry.effect) == without) {
        entry.used = false;
        bound = entry.bound;
        predicted = entry.cost.map_or(0, |cost| cost.total(1));
    }
    let renderer = Renderer::new(scene, &plan).unwrap();
    let drawn = renderer.frame(0).unwrap();
    let mut work = *renderer.setup();
    work.merge(&drawn.work);
    let centroids = drawn.truth.black_dots.iter().filter_map(|dot| dot.centroid_px).collect();
    Shown { image: drawn.image.unwrap(), centroids, work, bound, predicted }
}

fn largest_difference(a: &Image8, b: &Image8) -> f64 {
    f64::from(a.bytes.iter().zip(&b.bytes).map(|(a, b)| a.abs_diff(*b)).max().unwrap())
}

fn log_between(random: &mut SeededRandom, low: f64, high: f64) -> f64 {
    random.between(low.ln(), high.ln()).exp()
}

/// Everything at once, of random size.
fn random_scene(seed: u64, effect: EffectName) -> Scene {
    let random = &mut SeededRandom::new(seed);
    let gamma = if random.uniform() < 0.3 { random.between(0.8, 2.2) } else { 1.0 };
    let (width, length) = (log_between(random, 0.005, 0.1), log_between(random, 0.2, 5.0));
    let (small, opacity, level) = (log_between(random, 0.01, 0.2), random.uniform(), random.uniform());
    let level = if random.uniform() < 0.5 { 0.0 } else { level };
    let count = (random.uniform() * 12.0) as u32;
    let on = if random.uniform() < 0.3 { r#"{ "lens": 2.0 }"# } else { r#""sheet""# };
    let part = match effect {
        EffectName::UnevenInk => format!(
            r#""ink": {{ "edge_mm": 0.05, "uneven": {{ "reflectance": {}, "diameter": {} }} }}"#,
            log_between(random, 1e-3, 0.1),
            log_between(random, 1e-3, 0.1)
        ),
        EffectName::UnevenMembrane => format!(
            r#""uneven_membrane": {{ "amplitude": {}, "correlation_mm": {} }}"#,
            log_between(random, 3e-3, 0.2),
            log_between(random, 0.5, 20.0)
        ),
        EffectName::Dust => format!(
            r#""dust": {{ "specks": [{{ "on": {on}, "diameter_mm": [{small}, {}], "opacity": {opacity},
                "level": {level}, "random": {} }}],
                "scratches": [{{ "width_mm": {width}, "length_mm": [{length}, {length}], "random": {count},
                "opacity": {opacity} }}] }}"#,
            2.0 * small,
            1 + count
        ),
        _ => String::new(),
    };
    let camera = match effect {
        EffectName::Defects => format!(
            r#", "defects": {{ "hot": [[320, 240]], "hot_level": [{level_low}, {level_low}], "dead_per_million": {} }}"#,
            if random.uniform() < 0.5 { 30.0 } else { 0.0 },
            level_low = log_between(random, 0.01, 0.5)
        ),
        EffectName::Sharpening => format!(
            r#", "sharpening": {{ "radius_px": {}, "amount": {} }}"#,
            log_between(random, 0.4, 6.0),
            log_between(random, 0.02, 1.0)
        ),
        _ => String::new(),
    };
    let gain = log_between(random, 0.4, 2.5);
    let camera = match effect {
        EffectName::AutoExposure => {
            format!(r#", "auto_exposure": {{ "target_level": 0.3, "speed": 0, "first_gain": {gain} }}"#)
        }
        EffectName::WhiteBalance => {
            format!(r#", "white_balance": {{ "speed": 0, "first": [{gain}, 1, 1] }}"#)
        }
        _ => camera,
    };
    let focus = if random.uniform() < 0.6 {
        format!(
            r#", "focus": {{ "pupil_diameter_mm": {}, "distance_mm": {} }}"#,
            log_between(random, 0.02, 0.5),
            random.between(12.0, 18.0)
        )
    } else {
        String::new()
    };
    let comma = if part.is_empty() { "" } else { ", " };
    let membrane = random.between(0.3, 0.9);
    let leds =
        format!(r#", "leds": {{ "level_per_mw_mm2": {}, "gloss": true }}"#, log_between(random, 0.05, 500.0));
    let leds = if effect == EffectName::Gloss { leds } else { String::new() };
    scene_of(&format!(
        r#"{comma}{part}, "seed": {seed}, "light": {{ "membrane_level": {membrane} {leds} }},
           "electronics": {{ "gamma": {gamma} {focus} {camera} }}"#
    ))
}

fn within_bounds(seeds: std::ops::Range<u64>) {
    for effect in EFFECTS {
        let (mut ratios, mut counted) = (Vec::new(), Vec::new());
        for seed in seeds.clone() {
            let scene = random_scene(seed, effect);
            let (with, without) = (shown(&scene, None), shown(&scene, Some(effect)));
            let bound = without.bound.unwrap_or_else(|| panic!("{effect} is called for: seed {seed}"));
            let found = largest_difference(&with.image, &without.image);
            assert!(found <= bound.grey + 1.0, "{effect}, seed {seed}: {found} {bound:?}");
            let moved = with.centroids.iter().zip(&without.centroids);
            let px = moved.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max);
            assert!(
                px <= bound.px && with.centroids.len() == without.centroids.len(),
                "{effect}: {px} {bound:?}"
            );
            assert_eq!(without.work.of(effect), 0, "{effect} was left out");
            counted.push(with.work.of(effect) as f64 / without.predicted.max(1) as f64);
            if found >= 3.0 {
                ratios.push(bound.grey / found);
            }
        }
        ratios.sort_by(f64::total_cmp);
        counted.sort_by(f64::total_cmp);
        let middle = ratios.get(ratios.len() / 2).copied().unwrap_or(1.0);
        let largest = ratios.last().copied().unwrap_or(1.0);
        println!(
            "{effect}: bound over size: median {middle:.2}, largest {largest:.2} of {}; counted over predicted {:.2} to {:.2}",
            ratios.len(),
            counted.first().unwrap(),
            counted.last().unwrap()
        );
        assert!(middle <= 3.0 && largest <= 10.0, "{effect}: {ratios:?}");
    }
}

#[test]
fn what_real_frames_have_stays_within_its_bound() {
    within_bounds(1..7);
}

#[test]
fn long_what_real_frames_have_stays_within_its_bound() {
    within_bounds(100..120);
}

#[test]
fn defects_are_where_they_are_said_and_as_large() {
    let more = r#", "electronics": { "defects": { "hot": [[320, 240], [10, 20]], "dead": [[320, 250]], "hot_level": [0.2, 0.2] } }"#;
    let scene = scene_of(more);
    let (with, without) = (shown(&scene, None), shown(&scene, Some(EffectName::Defects)));
    let at = |image: &Image8, x: usize, y: usize| image.bytes[3 * (y * 640 + x)];
    let differ =
        with.image.bytes.chunks(3).zip(without.image.bytes.chunks(3)).filter(|(a, b)| a != b).count();
    assert_eq!(differ, 3);
    assert_eq!(at(&with.image, 320, 240), at(&without.image, 320, 240) + 51);
    assert_eq!(at(&with.image, 320, 250), 0);
    assert_eq!(at(&with.image, 10, 20), at(&without.image, 10, 20) + 51);
    assert_eq!(with.work.of(EffectName::Defects), without.predicted);
}

#[test]
fn a_scratch_takes_its_share_of_light_however_much_it_is_blurred() {
    // A square of 0.2 mm in the middle of the sheet; a wider pupil spreads what it takes, which stays the same.
    let taken = |pupil: f64| {
        let focus = format!(r#""focus": {{ "pupil_diameter_mm": {pupil}, "distance_mm": 16 }}"#);
        let scene = scene_of(&format!(
            r#", "effects": {{ "dots": "never", "defocus": "never" }},
            "dust": {{ "scratches": [{{ "width_mm": 0.2, "between_mm": [[[-0.1, 0], [0.1, 0]]] }}] }},
            "electronics": {{ {focus} }}"#
        ));
        let (with, without) = (shown(&scene, None), shown(&scene, Some(EffectName::Dust)));
        let pairs = with.image.bytes.iter().zip(&without.image.bytes);
        pairs.filter(|(_, b)| **b > 0).map(|(a, b)| 1.0 - f64::from(*a) / f64::from(*b)).sum::<f64>()
    };
    let [sharp, blurred] = [0.001, 0.3].map(taken);
    // 0.2 mm at the distance of the underside through the focal length, squared, for each of three planes.
    let scene = scene_of("");
    let far_mm = scene.design().sheet_underside_z_mm() - scene.optics().sensor_from_camera().translation_mm.z;
    let focal = scene.optics().lens().spec().matrix[0][0];
    let expected = 3.0 * (0.2 / far_mm * focal).powi(2);
    println!("{sharp} {blurred} {expected}");
    assert!((sharp / expected - 1.0).abs() < 0.03, "{sharp} {expected}");
    assert!((blurred / expected - 1.0).abs() < 0.03, "{blurred} {expected}");
}

#[test]
fn the_sheets_dust_moves_with_it_and_the_lenses_does_not() {
    let dark = |on: &str, scene_more: &str| {
        let scene = scene_of(&format!(
            r#", "effects": {{ "dots": "never" }},
            "dust": {{ "specks": [{{ "on": {on}, "diameter_mm": [0.15, 0.15], "at_mm": [[0.02, 0.01]] }}] }} {scene_more}"#
        ));
        let (with, without) = (shown(&scene, None), shown(&scene, Some(EffectName::Dust)));
        let (mut sum, mut x) = (0.0, 0.0);
        for (i, (a, b)) in with.image.bytes.iter().zip(&without.image.bytes).enumerate().step_by(3) {
            let taken = f64::from(*b) - f64::from(*a);
            sum += taken;
            x += taken * ((i / 3) % 640) as f64;
        }
        x / sum
    };
    let moved = r#", "motion": { "pose": [{ "time_s": 0, "translation_mm": [0.3, 0, 0] }] }"#;
    let scene = scene_of("");
    let far_mm = scene.design().sheet_underside_z_mm() - scene.optics().sensor_from_camera().translation_mm.z;
    let focal = scene.optics().lens().spec().matrix[0][0];
    let shift = dark(r#""sheet""#, moved) - dark(r#""sheet""#, "");
    assert!((shift.abs() - 0.3 / far_mm * focal).abs() < 0.4, "{shift} {}", 0.3 / far_mm * focal);
    let lens = r#"{ "lens": 2 }"#;
    let stays = dark(lens, moved) - dark(lens, "");
    assert!(stays.abs() < 0.05, "{stays}");
}

#[test]
fn an_uneven_membrane_keeps_to_its_field_under_lights_and_without() {
    for light in ["", r#", "light": { "leds": { "level_per_mw_mm2": 300 } }"#] {
        let scene = scene_of(&format!(
            r#", "seed": 5, "effects": {{ "dots": "never" }}, "uneven_membrane": {{ "amplitude": 0.05, "correlation_mm": 3 }} {light}"#
        ));
        let (with, without) = (shown(&scene, None), shown(&scene, Some(EffectName::UnevenMembrane)));
        let field = crate::light::random_field::RandomField::new(5, 0x6d65_6d62, 3.0);
        let mut seen = 0;
        for (y, x) in (100..380).step_by(20).flat_map(|y| (200..440).step_by(20).map(move |x| (y, x))) {
            let Ok(hit) = scene.optics().trace(glam::DVec2::new(x as f64, y as f64)) else { continue };
            let at = 3 * (y * 640 + x) + 1;
            let (a, b) = (f64::from(with.image.bytes[at]), f64::from(without.image.bytes[at]));
            // Green is the reference; under lights the stray level and saturation stay away from here.
            if b > 30.0 && a < 255.0 && b < 255.0 {
                let expected = b * (1.0 + 0.05 * field.at(hit.surface_mm));
                assert!((a - expected).abs() < 1.2, "{x} {y}: {a} {expected}");
                seen += 1;
            }
        }
        assert!(seen > 50, "{seen}");
    }
}

/// Frames of a scene under a light that grows stronger, whose camera follows.
fn followed(threads: usize) -> (Vec<Vec<u8>>, Vec<serde_json::Value>) {
    let mut scene = scene_of(
        r#", "light": { "membrane_level": 0.2, "surround_level": 0.1 },
        "motion": { "pose": [{ "time_s": 0 }, { "time_s": 0.2, "translation_mm": [0, 0, -0.4] }] },
        "electronics": { "auto_exposure": { "target_level": 0.3, "speed": 0.5 },
            "white_balance": { "speed": 0.5, "first": [0.8, 1, 1.3] },
            "noise": { "full_scale_electrons": 5000 } }"#,
    );
    scene.override_run(Some(6), None).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let plan = Plan::of(&scene).unwrap();
    pool.install(|| crate::run::run(&scene, &plan, &out, &mut |_| {})).unwrap();
    let truth = std::fs::read_to_string(out.join(crate::run::TRUTH_NAME)).unwrap();
    let frames = (0..6).map(|k| std::fs::read(out.join(format!("frame_{k:04}.png"))).unwrap()).collect();
    let renderer = Renderer::new(&scene, &plan).unwrap();
    let alone = renderer.frame(4).unwrap();
    let lines: Vec<serde_json::Value> =
        truth.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(
        serde_json::to_value(alone.truth.exposure).unwrap(),
        lines[4]["exposure"],
        "a frame drawn alone"
    );
    (frames, lines)
}

#[test]
fn gains_follow_the_frames_before_and_not_the_threads() {
    let (frames, truth) = followed(1);
    assert!(followed(3) == (frames, truth.clone()));
    let gains: Vec<f64> = truth.iter().map(|line| line["exposure"]["gain"].as_f64().unwrap()).collect();
    let reds: Vec<f64> =
        truth.iter().map(|line| line["exposure"]["white_balance"][0].as_f64().unwrap()).collect();
    println!("{gains:?} {reds:?}");
    assert!(gains[0] == 1.0 && gains.windows(2).all(|pair| pair[1] > pair[0]), "{gains:?}");
    assert!(reds[0] == 0.8 && reds.windows(2).all(|pair| pair[1] > pair[0] && pair[1] < 1.001), "{reds:?}");
    // Halfway in the logarithm of what is left, with each frame: grey light has balanced colours.
    for pair in reds.windows(2) {
        assert!((pair[1] / pair[0].sqrt() - 1.0).abs() < 0.01, "{reds:?}");
    }
}
