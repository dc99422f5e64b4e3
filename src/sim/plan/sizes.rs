//! Each effect's bound against its true size: the frame without it, every pixel traced and all other effects on.

use std::collections::BTreeMap;
use std::path::Path;

use domecast_optics::numeric::SeededRandom;

use super::growth::grown;
use super::pictures::Pictures;
use super::random_scenes::{apart, lit_designs, lit_scene, shipped};
use super::search::effect_of;
use crate::contact::between::Around;
use crate::contact::stepper::Touch;
use crate::output::drawn::{Drawn, Scratch};
use crate::scene::SceneFile;
use crate::*;

/// Sizes below which an effect is not distinguished from none: a code, and a tenth of what a good tracker reads.
const MIN_GREY: f64 = 1.0;
const MIN_PX: f64 = 0.005;

/// Bounds over true sizes, by effect.
type Ratios = BTreeMap<&'static str, Vec<f64>>;

/// Random scenes after which an effect is known: where a bound was half as large, half of so many would be above it. What few scenes
/// have is measured in all of them.
const MAX_RANDOM_SCENES: usize = 40;

/// Some frames of a scene by a plan; contact is solved up to the last of them.
fn frames(scene: &Scene, plan: &Plan, numbers: &[u32], touches: &[Touch]) -> Vec<Drawn> {
    let renderer = Renderer::new(scene, plan).unwrap();
    let mut scratch = Scratch::default();
    let draw = |number: &u32| {
        let contact = plan.uses(EffectName::Contact);
        let around = if contact { Around::of(touches, *number as usize) } else { None };
        renderer.frame_around(*number, around.as_ref(), &mut scratch).unwrap()
    };
    numbers.iter().map(draw).collect()
}

/// The contact of all frames, by the scene's own level.
fn touches(scene: &Scene, plan: &Plan) -> Vec<Touch> {
    let renderer = Renderer::new(scene, plan).unwrap();
    let Some(mut stepper) = renderer.stepper().unwrap() else { return Vec::new() };
    let mut work = Work::default();
    (0..scene.frame_count()).map(|k| stepper.next(k, scene.time_s(k), &mut work).unwrap()).collect()
}

/// Largest shift of a dot or marker and change of a pixel between two renderings; of what is random, the 99.9th percentile.
fn difference(scene: &Scene, random: bool, a: &[Drawn], b: &[Drawn]) -> (f64, f64) {
    let (mut px, mut grey) = (0.0_f64, 0.0_f64);
    let spec = scene.optics().lens().spec();
    let size = [f64::from(spec.width), f64::from(spec.height)];
    // What is in one picture alone has moved past the frame's edge: at least as far as it is from there.
    let apart = |a: Option<[f64; 2]>, b: Option<[f64; 2]>| match (a, b) {
        (Some(at), None) | (None, Some(at)) => {
            (0..2).map(|axis| (at[axis] + 0.5).min(size[axis] - 0.5 - at[axis])).fold(f64::INFINITY, f64::min)
        }
        both => apart(both.0, both.1),
    };
    for (a, b) in a.iter().zip(b) {
        for (a, b) in a.truth.black_dots.iter().zip(&b.truth.black_dots) {
            px = px.max(apart(a.centroid_px, b.centroid_px));
            for channel in 0..scene.planes() {
                let of = |dot: &DotTruth| dot.centroid_rgb_px.map_or(dot.centroid_px, |three| three[channel]);
                px = px.max(apart(of(a), of(b)));
            }
        }
        for (a, b) in a.truth.white_markers.iter().zip(&b.truth.white_markers) {
            px = px.max(apart(a.centroid_px, b.centroid_px));
        }
        if let (Some(a), Some(b)) = (&a.image, &b.image) {
            let mut changes: Vec<u8> = a.bytes.iter().zip(&b.bytes).map(|(a, b)| a.abs_diff(*b)).collect();
            changes.sort_unstable();
            let rank = if random { changes.len() * 999 / 1000 } else { changes.len() - 1 };
            grey = grey.max(f64::from(changes[rank]));
        }
    }
    (px, grey)
}

/// Measures every effect of a scene that a plan may leave out, in some frames, but for those that have ratios of `enough` scenes; what
/// it is worth is printed line by line.
fn measure(name: &str, scene: &Scene, numbers: &[u32], enough: usize, ratios: &mut Ratios) -> Vec<String> {
    let plan = Plan::exact(scene).unwrap();
    let touches = touches(scene, &plan);
    let pictures = Pictures::of(scene);
    // Noise hides what is smaller: effects are measured without it, and what acts on it with it as well; all before a lossy code.
    let all = |noisy: bool| {
        let mut plan = plan.clone();
        for entry in &mut plan.entries {
            entry.used &= match entry.effect {
                EffectName::Noise => noisy,
                EffectName::Compression => false,
                _ => true,
            };
        }
        plan
    };
    let all = [all(false), all(true)];
    let has_noise = all[0] != all[1];
    let with = [false, true].map(|noisy| {
        let drawn = || frames(scene, &all[usize::from(noisy)], numbers, &touches);
        if noisy && !has_noise { Vec::new() } else { drawn() }
    });
    let mut below = Vec::new();
    for entry in plan.entries.iter().filter(|entry| entry.used) {
        let bound = entry.bound.unwrap();
        let known = ratios.get(entry.effect.as_str()).map_or(0, Vec::len);
        if bound == Bound::UNBOUNDED || known >= enough {
            continue;
        }
        // A slow gel is another contact.
        let mut elastic = None;
        let (mut px, mut grey) = (0.0_f64, 0.0_f64);
        for noisy in [false, true] {
            let measured = match entry.effect {
                EffectName::Noise => noisy,
                effect if noisy => has_noise && effect >= EffectName::Bayer,
                _ => true,
            };
            if !measured {
                continue;
            }
            let mut without = all[usize::from(noisy)].clone();
            let own = without.entries.iter_mut().filter(|other| other.effect == entry.effect);
            own.for_each(|own| own.used = false);
            if entry.effect == EffectName::SlowGel {
                elastic = Some(self::touches(scene, &without));
            }
            let others = elastic.as_deref().unwrap_or(&touches);
            let without = frames(scene, &without, numbers, others);
            let found = difference(scene, noisy, &with[usize::from(noisy)], &without);
            (px, grey) = (px.max(found.0), grey.max(found.1));
        }
        let by_px = bound.px / px.max(MIN_PX);
        // What effects after it enlarge counts as in the plan.
        let own = grown(scene, entry.effect, bound.grey);
        let has_shift = effect_of(entry.effect).unwrap().is_drawn();
        let at_edges = if has_shift { 0.0 } else { pictures.shift_grey(bound.px).unwrap() };
        let whole = (own + at_edges).min(255.0);
        let by_grey = whole / grey.max(MIN_GREY);
        let ratio = if !scene.draws() || (bound.grey == 0.0 && px > MIN_PX) { by_px } else { by_grey };
        let line = format!(
            "{name} {}: {px:.4} of {:.4} px, {grey} of {whole:.2} grey, {ratio:.2} times",
            entry.effect, bound.px
        );
        println!("{line}");
        if bound.px < px || whole + 1.0 < grey {
            below.push(line);
        }
        if ratio.is_finite() {
            ratios.entry(entry.effect.as_str()).or_default().push(ratio);
        }
    }
    below
}

/// The ratios as a table: how many, the median, the 95th percentile and the largest.
fn table(ratios: &mut Ratios) -> String {
    let mut text = String::new();
    for (effect, found) in ratios {
        found.sort_by(f64::total_cmp);
        let at = |part: f64| found[((found.len() - 1) as f64 * part).round() as usize];
        text +=
            &format!("| {effect} | {} | {:.1} | {:.1} | {:.1} |\n", found.len(), at(0.5), at(0.95), at(1.0));
    }
    text
}

#[test]
fn long_sizes_of_the_shipped_scenes() {
    let mut ratios = Ratios::new();
    let mut below = Vec::new();
    for path in shipped() {
        let scene = Scene::load(&path).unwrap();
        let last = scene.frame_count() - 1;
        // two thirds in: pressed the most, or about to let go
        let numbers = [last * 2 / 3];
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        below.extend(measure(&name, &scene, &numbers, usize::MAX, &mut ratios));
    }
    println!("{}", table(&mut ratios));
    assert!(below.is_empty(), "{below:#?}");
}

#[test]
fn long_sizes_of_random_scenes() {
    let designs = lit_designs();
    let mut ratios = Ratios::new();
    let (mut below, mut compared) = (Vec::new(), 0);
    for seed in 5000..5110 {
        let mut random = SeededRandom::new(seed);
        let design = designs[(random.uniform() * designs.len() as f64) as usize].clone();
        let value = lit_scene(&mut random);
        let file: SceneFile = domecast_design::from_value(&value).unwrap();
        let scene = match Scene::new(file, Path::new(""), design) {
            Ok(scene) => scene,
            Err(SimError::Input(error)) if error.field.starts_with("motion") => continue,
            Err(error) => panic!("{error}: {value}"),
        };
        below.extend(measure(&format!("seed {seed}"), &scene, &[0, 2], MAX_RANDOM_SCENES, &mut ratios));
        compared += 1;
    }
    println!("{}", table(&mut ratios));
    assert!(compared >= 100, "{compared}");
    assert!(below.is_empty(), "{below:#?}");
}
