//! How fast the simulator is on one core: frames a second, the cost of each effect, and how time grows with the size
//! of the task. Contact is solved and pictures are drawn; coding and writing them is not counted. Prints tables;
//! `cargo bench --bench sim`, or a part of it: `cargo bench --bench sim -- frames` (`effects`, `slopes`).

use std::path::Path;
use std::str::FromStr;
use std::sync::LazyLock;
use std::time::Instant;

use domecast::design::{self, Design};
use domecast::sim::scene::SceneFile;
use domecast::sim::{Around, EffectName, Plan, Renderer, Scene, Scratch};
use serde_json::{Value, json};

/// Repetitions of what takes microseconds.
const AGAIN: u32 = 200;

/// A task is repeated for so long, s.
const MIN_S: f64 = 0.1;

/// Each figure is the median of so many rounds.
const ROUNDS: usize = 7;

fn design_with(change: impl Fn(&mut Value)) -> Option<Design> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("designs/thumb24.json");
    let mut value = design::parse_json(&design::read_text(&path).ok()?).ok()?;
    change(&mut value);
    match Design::from_str(&value.to_string()) {
        Ok(design) => Some(design),
        Err(error) => {
            println!("design: {error}");
            None
        }
    }
}

fn scene_of(design: &Design, value: &Value) -> Option<Scene> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("designs/scenes");
    let file: Result<SceneFile, _> = design::from_value(value);
    let scene = file
        .map_err(|e| e.to_string())
        .and_then(|file| Scene::new(file, &folder, design.clone()).map_err(|e| e.to_string()));
    scene.map_err(|error| println!("scene: {error}")).ok()
}

/// A sideways push under a press; 20 frames.
fn push(images: bool, colour: bool) -> Value {
    json!({
        "version": 1, "name": "bench", "design": "",
        "frames": { "count": 20, "rate_hz": 30, "images": images, "colour": colour },
        "tolerance": { "px": 1e-9, "grey": 1e-9 },
        "motion": { "wrench": [
            { "time_s": 0, "force_n": [0, 0, 0], "point_mm": [0, 0, 10] },
            { "time_s": 0.7, "force_n": [0.5, 0.2, -4], "point_mm": [0, 0, 10] },
        ]},
    })
}

fn lit() -> Value {
    json!({ "surround_level": 0.02, "leds": { "level_per_mw_mm2": 450, "stray_level": 0.005, "crosstalk": 0.08 } })
}

/// A ball pressed into the dome and rolled, under the design's lights; to so many grey levels, within which
/// pixels are interpolated between rays.
fn ball(level: &str, element_mm: f64, grey: f64) -> Value {
    json!({
        "version": 1, "name": "bench", "design": "",
        "frames": { "count": 8, "rate_hz": 30, "colour": true },
        "tolerance": { "px": 0.05, "grey": grey },
        "contact": { "level": level, "element_mm": element_mm },
        "objects": [{ "name": "ball", "shape": { "kind": "sphere", "radius_mm": 5 }, "path": [
            { "time_s": 0, "position_mm": [0, 0, 14.6] },
            { "time_s": 0.25, "position_mm": [0.6, 0, 14.0], "rotation_deg": [0, 7, 0] },
        ]}],
        "light": lit(),
        "effects": { "dispersion": "never" },
    })
}

/// Grey levels that lit scenes are drawn to: what the scenes that come with the program ask for.
const GREY: f64 = 4.0;

static BEGAN: LazyLock<Instant> = LazyLock::new(Instant::now);

/// Seconds that all threads of this program have spent computing, where the system reports it; else seconds gone by.
/// Others may load the machine while it is measured.
fn clock_s() -> f64 {
    let spent_ns = |task: std::io::Result<std::fs::DirEntry>| -> Option<f64> {
        let statistics = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        statistics.split_whitespace().next()?.parse().ok()
    };
    let tasks = std::fs::read_dir("/proc/self/task").ok();
    let sum_ns = tasks.and_then(|tasks| tasks.map(spent_ns).sum::<Option<f64>>());
    sum_ns.map_or_else(|| BEGAN.elapsed().as_secs_f64(), |ns| 1e-9 * ns)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Seconds for a frame: solving the contact, and drawing.
fn frame_s(scene: &Scene, rounds: usize) -> Option<[f64; 2]> {
    let plan = Plan::everything(scene).map_err(|error| println!("plan: {error}")).ok()?;
    let renderer = Renderer::new(scene, &plan).map_err(|error| println!("renderer: {error}")).ok()?;
    let mut scratch = Scratch::default();
    let count = scene.frame_count();
    // The tables are made once for a design, and what a stepper begins with once for a run.
    let (mut touches, mut spent_s, mut times) = (Vec::new(), 0.0, 0.0);
    while let Ok(Some(mut stepper)) = renderer.stepper() {
        let began = clock_s();
        let step = |k| stepper.next(k, scene.time_s(k), &mut Default::default());
        let solved: Result<Vec<_>, _> = (0..count).map(step).collect();
        touches = solved.map_err(|error| println!("contact: {error}")).ok()?;
        (spent_s, times) = (spent_s + clock_s() - began, times + 1.0);
        if spent_s > MIN_S {
            break;
        }
    }
    let solving = if times > 0.0 { spent_s / times / f64::from(count) } else { 0.0 };
    let drawing = (0..rounds).map(|_| drawing_s(&renderer, &touches, count, &mut scratch)).collect();
    Some([solving, median(drawing)])
}

/// Seconds for a task that is done as often as the system's clock, which counts in some milliseconds, asks for.
fn again_s(mut task: impl FnMut()) -> f64 {
    let (began, mut times) = (clock_s(), 0_u32);
    loop {
        task();
        times += 1;
        let spent = clock_s() - began;
        if spent > MIN_S {
            return spent / f64::from(times);
        }
    }
}

fn drawing_s(
    renderer: &Renderer<'_>,
    touches: &[domecast::sim::Touch],
    count: u32,
    scratch: &mut Scratch,
) -> f64 {
    let all = || {
        for k in 0..count {
            let around = Around::of(touches, k as usize);
            match renderer.frame_around(k, around.as_ref(), scratch) {
                Ok(drawn) => drawn.image.into_iter().for_each(|image| scratch.give_back(image)),
                Err(error) => println!("frame {k}: {error}"),
            }
        }
    };
    again_s(all) / f64::from(count)
}

fn line(what: &str, seconds: [f64; 2]) {
    let whole = seconds[0] + seconds[1];
    println!(
        "{what:<56} {:>9.1} frames/s  ({:.3} ms contact, {:.3} ms picture)",
        1.0 / whole,
        1e3 * seconds[0],
        1e3 * seconds[1]
    );
}

fn main() {
    // What is done on other threads counts as well: there is one, as there is one core.
    if let Err(error) = rayon::ThreadPoolBuilder::new().num_threads(1).build_global() {
        println!("threads: {error}");
    }
    let Some(design) = design_with(|_| {}) else { return };
    let wanted: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let is_wanted = |name: &str| wanted.is_empty() || wanted.iter().any(|word| word == name);
    if is_wanted("frames") {
        frames(&design);
    }
    if is_wanted("effects") {
        effects(&design);
    }
    if is_wanted("slopes") {
        slopes(&design);
    }
}

fn frames(design: &Design) {
    if let Some(scene) = scene_of(design, &push(false, false)) {
        println!("== frames a second, one core, 640 x 480, {} dots", scene.dots().len());
        let plan = Plan::everything(&scene).and_then(|plan| Ok((Renderer::new(&scene, &plan)?, plan)));
        if let Ok((renderer, _)) = plan {
            let all = || {
                for k in 0..AGAIN * scene.frame_count() {
                    std::hint::black_box(renderer.centers(k % scene.frame_count(), None).ok());
                }
            };
            let round = |_| again_s(all) / f64::from(AGAIN * scene.frame_count());
            line("positions of dots and markers, no image", [0.0, median((0..ROUNDS).map(round).collect())]);
        }
    }
    for (what, value) in [
        ("truth with centroids, no image", push(false, false)),
        ("dots, lens, refraction: grey picture", push(true, false)),
        ("dots, lens, refraction, dispersion: colour picture", push(true, true)),
        ("direct light, geometric contact, 4 grey levels", ball("geometric", 1.0, GREY)),
        ("direct light, geometric contact, 2 grey levels", ball("geometric", 1.0, 2.0)),
        ("direct light, closed-form contact, 4 grey levels", ball("closed_form", 1.0, GREY)),
        ("direct light, closed-form contact, 2 grey levels", ball("closed_form", 1.0, 2.0)),
        ("direct light, linear finite elements, 4 grey levels", ball("linear", 1.0, GREY)),
        ("direct light, linear finite elements, 2 grey levels", ball("linear", 1.0, 2.0)),
    ] {
        if let Some(seconds) = scene_of(design, &value).and_then(|scene| frame_s(&scene, ROUNDS)) {
            line(what, seconds);
        }
    }
}

/// A lit scene under a ball with every effect that a picture at one instant has, and those of time on request.
fn whole(with: Option<EffectName>) -> Value {
    let mut scene = ball("geometric", 1.0, GREY);
    scene["effects"] = json!({});
    scene["frames"]["count"] = json!(4);
    scene["ink"] = json!({ "edge_mm": 0.05 });
    scene["electronics"] = json!({
        "vignetting_exponent": 1.5, "focus": { "pupil_diameter_mm": 0.2, "distance_mm": 15.5 }, "bayer": "rggb",
        "noise": { "full_scale_electrons": 4000, "read_electrons": 4 }, "jpeg_quality": 90,
    });
    match with {
        Some(EffectName::MotionBlur) => {
            scene["electronics"]["shutter"] = json!({ "exposure_s": 0.005, "readout_s": 0.0 });
        }
        Some(EffectName::RollingShutter) => {
            scene["electronics"]["shutter"] = json!({ "exposure_s": 0.0, "readout_s": 0.01 });
        }
        _ => {}
    }
    scene
}

fn effects(design: &Design) {
    /// Pairs of drawings, one right after the other and in turn: others may load the machine now more, now less.
    const PAIRS: usize = 7;
    println!(
        "\n== cost of each effect: a picture with it, less one without it, and the quartiles of {PAIRS} pairs"
    );
    let all = whole(None);
    for effect in EffectName::ALL {
        // Effects of time draw the picture many times over: they are added instead.
        let added = matches!(effect, EffectName::MotionBlur | EffectName::RollingShutter);
        let mut less = all.clone();
        if !added {
            less["effects"][effect.as_str()] = json!("never");
        }
        let more = if added { whole(Some(effect)) } else { all.clone() };
        let (Some(more), Some(less)) = (scene_of(design, &more), scene_of(design, &less)) else { continue };
        let Some(mut costs_ms) = pair_costs_ms(&more, &less, PAIRS) else { continue };
        costs_ms.sort_by(f64::total_cmp);
        let at = |part: usize| costs_ms.get(part * (PAIRS - 1) / 4).copied().unwrap_or(f64::NAN);
        let [low, cost, high] = [1, 2, 3].map(at);
        let note = if low < 0.0 && high > 0.0 { "  below the scatter" } else { "" };
        println!("{:<20} {cost:>9.2} ms  ({low:.2} to {high:.2}){note}", effect.as_str());
    }
}

/// What a picture of one scene takes more than one of another, drawn in turn; the contact is solved beforehand.
fn pair_costs_ms(more: &Scene, less: &Scene, pairs: usize) -> Option<Vec<f64>> {
    let plans = [Plan::everything(more).ok()?, Plan::everything(less).ok()?];
    let renderers = [Renderer::new(more, &plans[0]).ok()?, Renderer::new(less, &plans[1]).ok()?];
    let touches = [0, 1].map(|k| {
        let mut stepper = renderers[k].stepper().ok().flatten();
        let count = more.frame_count();
        let next = |frame| stepper.as_mut()?.next(frame, more.time_s(frame), &mut Default::default()).ok();
        (0..count).map_while(next).collect::<Vec<_>>()
    });
    let mut scratch = Scratch::default();
    let mut took = |k: usize| drawing_s(&renderers[k], &touches[k], more.frame_count(), &mut scratch);
    // Tables and buffers are made the first time.
    let _ = [0, 1].map(&mut took);
    let pair = |i: usize| {
        let (first, second) = (took(i % 2), took(1 - i % 2));
        1e3 * if i.is_multiple_of(2) { first - second } else { second - first }
    };
    Some((0..pairs).map(pair).collect())
}

fn slopes(design: &Design) {
    println!("\n== slopes");
    for share in [0.5, 1.0, 2.0] {
        let grown = design_with(|value| {
            let camera = &mut value["camera"];
            camera["width"] = json!((640.0 * share) as u32);
            camera["height"] = json!((480.0 * share) as u32);
            let middle = |n: f64| (n * share - 1.0) / 2.0;
            let f = 229.18 * share;
            camera["matrix"] = json!([[f, 0, middle(640.0)], [0, f, middle(480.0)], [0, 0, 1]]);
            value["runtime"]["mask_radius_px"] = json!(240.0 * share);
            value["pattern"]["pitch_px"] = json!(18.0 * share);
            value["pattern"]["dot_diameter_px"] = json!(7.0 * share);
        });
        let Some(grown) = grown else { continue };
        for (what, value) in [("dots", push(true, true)), ("lit, contact", ball("geometric", 1.0, GREY))] {
            if let Some(seconds) = scene_of(&grown, &value).and_then(|scene| frame_s(&scene, ROUNDS)) {
                line(&format!("{} x {} px, {what}", 640.0 * share, 480.0 * share), seconds);
            }
        }
    }
    for pitch in [26.0, 18.0, 13.0] {
        let Some(grown) = design_with(|value| value["pattern"]["pitch_px"] = json!(pitch)) else { continue };
        if let Some(scene) = scene_of(&grown, &push(true, true))
            && let Some(seconds) = frame_s(&scene, ROUNDS)
        {
            line(&format!("{} dots", scene.dots().len()), seconds);
        }
    }
    for count in [1_usize, 2, 3] {
        let Some(grown) = design_with(|value| {
            if let Some(list) = value["leds"]["list"].as_array_mut() {
                list.truncate(count);
            }
        }) else {
            continue;
        };
        if let Some(scene) = scene_of(&grown, &ball("geometric", 1.0, GREY)) {
            let began = clock_s();
            let made = Plan::everything(&scene).and_then(|plan| Renderer::new(&scene, &plan).map(|_| ()));
            let setup = clock_s() - began;
            if let (Ok(()), Some(seconds)) = (made, frame_s(&scene, ROUNDS)) {
                line(&format!("{count} lights (tables {setup:.2} s once)"), seconds);
            }
        }
    }
    for element_mm in [2.0, 1.0, 0.5] {
        if let Some(seconds) =
            scene_of(design, &ball("linear", element_mm, GREY)).and_then(|scene| frame_s(&scene, ROUNDS))
        {
            line(&format!("elements of {element_mm} mm"), seconds);
        }
    }
}
