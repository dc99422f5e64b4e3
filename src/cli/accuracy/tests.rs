#[path = "../../design/parts/tests/random_designs.rs"]
mod random_designs;

use std::str::FromStr;

use super::clock::{RunTime, TimeLimit};
use super::files::{accuracy_files, csv};
use super::measure::{STEPS, measure};
use super::sweep::{Law, Sweep, SweepSample, sizes};
use super::{meshes, outline, placement};
use domecast_design::layout::{Layout, LayoutSpec};
use domecast_design::{Design, DesignError, parts};

fn design_from(change: impl FnOnce(&mut serde_json::Value)) -> Result<Design, DesignError> {
    let mut value: serde_json::Value =
        serde_json::from_str(include_str!("../../../designs/thumb24.json")).unwrap();
    change(&mut value);
    Design::from_str(&value.to_string())
}

fn timing(median_s: f64) -> RunTime {
    RunTime { median_s, lower_quartile_s: median_s, upper_quartile_s: median_s, runs: 1 }
}

fn sweep(law: Law, samples: &[(&'static str, f64, f64, f64)]) -> Sweep {
    let sample = |&(method, setting, error, seconds): &(&'static str, f64, f64, f64)| SweepSample {
        method,
        label: format!("{setting}"),
        setting,
        max_error: error,
        rms_error: error,
        time: timing(seconds),
        per_item_s: seconds,
        notes: Vec::new(),
        dominated: false,
    };
    Sweep {
        name: "made",
        title: "Made up".into(),
        setting: "setting",
        error: "error",
        unit: "mm",
        item: "thing",
        items: 1,
        reference: "none".into(),
        floor: 1e-18,
        law,
        observed: None,
        samples: samples.iter().map(sample).collect(),
        in_use: Some(0),
        asked: Some(0.02),
        meets: None,
        conclusion: String::new(),
    }
    .finish()
}

#[test]
fn orders_fronts_and_choices_follow_from_the_samples() {
    // error ~ setting^3, and one sample that is slower and worse than its neighbour
    let cubic = sweep(
        Law::Power { exponent: 3.0 },
        &[
            ("", 1.0, 1.0, 1.0),
            ("", 0.5, 0.125, 5.0),
            ("", 0.25, 0.015_625, 4.0),
            ("", 0.125, 0.001_953, 8.0),
        ],
    );
    assert!((cubic.observed.unwrap() - 3.0).abs() < 1e-3);
    assert_eq!(cubic.samples.iter().map(|r| r.dominated).collect::<Vec<_>>(), [false, true, false, false]);
    assert_eq!(cubic.meets, Some(2));
    // Newton: each error is the square of the one before; the rounding at the end means nothing
    let newton = sweep(
        Law::Steps { order: 2.0 },
        &[
            ("n", 0.0, 0.1, 1.0),
            ("n", 1.0, 1e-2, 2.0),
            ("n", 2.0, 1e-4, 3.0),
            ("n", 3.0, 1e-8, 4.0),
            ("n", 4.0, 1e-17, 5.0),
        ],
    );
    assert!((newton.observed.unwrap() - 2.0).abs() < 1e-9);
    // what nobody reaches is not reached
    let mut short = cubic.clone();
    short.asked = Some(1e-9);
    assert_eq!(short.finish().meets, None);
    let (max, rms, failed) = sizes([3.0, f64::NAN, 4.0].into_iter());
    assert_eq!((max, failed), (4.0, 1));
    assert!((rms - 12.5_f64.sqrt()).abs() < 1e-12);
}

/// What is wrong with a sweep that should fall from sample to sample of one method, but for rounding, by the order that
/// theory gives.
fn faults_of(sweep: &Sweep) -> Vec<String> {
    let mut faults = Vec::new();
    let noise_floor = sweep.noise_floor();
    let name = sweep.name;
    for two in sweep.samples.windows(2).filter(|two| two[0].method == two[1].method) {
        let scatter = if name == "chance" { 1.25 } else { 1.0 + 1e-9 };
        if two[1].rms_error > two[0].rms_error * scatter + noise_floor {
            let errors = two.iter().map(|sample| format!("{} leaves {:e}", sample.label, sample.rms_error));
            faults.push(format!("{name}: {}", errors.collect::<Vec<_>>().join(", ")));
        }
    }
    let (theory, slack) = match sweep.law {
        Law::Power { exponent } => (exponent, 0.25 * exponent.abs().max(0.6)),
        Law::Steps { order } => (order, 0.5),
        Law::Within => {
            let passed =
                |sample: &&SweepSample| sample.max_error > sample.setting * (1.0 + 1e-6) + noise_floor;
            let passed = sweep.samples.iter().filter(passed);
            faults.extend(
                passed.map(|sample| format!("{name}: {} leaves {:e}", sample.label, sample.max_error)),
            );
            return faults;
        }
        Law::Falls => return faults,
    };
    match sweep.observed {
        Some(seen) if (seen - theory).abs() <= slack => {}
        seen => faults.push(format!("{name}: order {seen:?}, by theory {theory}")),
    }
    faults
}

#[test]
fn long_sweeps_fall_at_their_orders() {
    sweeps_of("thumb24", include_str!("../../../designs/thumb24.json"), 0);
}

#[test]
fn long_sweeps_of_the_twins_fall_at_their_orders() {
    sweeps_of("thumb24-pinhole", include_str!("../../../designs/thumb24-pinhole.json"), 1);
    sweeps_of("thumb24-fisheye", include_str!("../../../designs/thumb24-fisheye.json"), 0);
}

/// `left_out` settings are not of this design.
fn sweeps_of(name: &str, text: &str, left_out: usize) {
    let design = Design::from_str(text).unwrap();
    let mut steps = Vec::new();
    let measured = measure(&design, None, true, &mut |done, _| steps.push(done)).unwrap();
    assert_eq!(steps, (0..STEPS).collect::<Vec<_>>(), "{name}");
    let mut faults = Vec::new();
    for sweep in &measured.sweeps {
        faults.extend(faults_of(sweep));
        // a quick look at contact stops short of the elements that the simulator starts from
        assert!(sweep.in_use.is_some() || sweep.name == "contact", "{name}: {}", sweep.name);
        for sample in &sweep.samples {
            assert!(sample.time.median_s > 0.0 && sample.max_error.is_finite(), "{}", sample.label);
        }
        if let (Some(asked), Some(index)) = (sweep.asked, sweep.meets) {
            assert!(sweep.samples[index].max_error <= asked);
        }
    }
    assert!(faults.is_empty(), "{name}: {faults:#?}");
    // without noise the refracting solver is exact, and the runtime that knows no layers is not
    let pose = measured.sweeps.iter().find(|sweep| sweep.name == "pose").unwrap();
    let refined = pose.samples.last().unwrap();
    assert!(refined.max_error < 1e-6, "{:e} N", refined.max_error);
    assert!(pose.samples.iter().all(|sample| sample.max_error >= refined.max_error));
    assert_eq!(measured.left_out.len(), left_out, "{:?}", measured.left_out);
    assert_eq!(measured.budgets.len(), 2);
    for budget in &measured.budgets {
        let squares: f64 = budget.shares.iter().map(|share| share.amount.powi(2)).sum();
        assert!((squares.sqrt() / budget.total - 1.0).abs() < 1e-12);
        // what is computed is not what a sensor suffers from
        assert!(budget.computed < 0.5 * budget.total, "{}", budget.title);
    }
    let files = accuracy_files(&measured);
    let file = |name: &str| {
        let found = files.iter().find(|(path, _)| path == name);
        &found.unwrap_or_else(|| panic!("{name}")).1
    };
    assert_eq!(
        csv(&measured).lines().count(),
        1 + measured.sweeps.iter().map(|l| l.samples.len()).sum::<usize>()
    );
    let json: serde_json::Value = serde_json::from_slice(file("accuracy.json")).unwrap();
    assert_eq!(json["design"], name);
    for sweep in &measured.sweeps {
        assert!(file(&format!("{}.svg", sweep.name)).starts_with(b"<svg"));
        let png = domecast_runtime::frames::Gray::from_png(file(&format!("{}.png", sweep.name))).unwrap();
        assert_eq!((png.width(), png.height()), (1280, 860));
    }
    assert!(String::from_utf8_lossy(file("index.html")).contains("What accuracy costs"));
}

#[test]
fn refraction_is_what_placement_is_about() {
    let design = design_from(|_| ()).unwrap();
    let spec = LayoutSpec::of_design(&design).unwrap();
    let layout = Layout::new(&spec).unwrap();
    let sweep = placement::sweep(design.optics(), &layout, Some(0.01), TimeLimit::QUICK).unwrap();
    let [pinhole, refraction, dispersion] = [0, 1, 2].map(|i| sweep.samples[i].max_error);
    // as the layout's own report computes it, by another route
    let report = domecast_design::layout::evenness::by_pinhole(&spec, &layout).unwrap();
    assert!((pinhole - report.max_shift_mm).abs() < 0.02, "{pinhole} {}", report.max_shift_mm);
    assert!(refraction < 0.01 && dispersion < 0.1 * refraction, "{refraction} {dispersion}");
}

#[test]
fn settings_are_chosen_where_the_file_leaves_them_open() {
    let design = design_from(|d| {
        d["accuracy"] = serde_json::json!(
            { "dot_placement_mm": 0.004, "image_px": 0.5, "mesh_mm": 0.05, "force_n": 0.02 }
        );
        d["tolerances"].as_object_mut().unwrap().remove("samples");
    })
    .unwrap();
    let settings = design.settings();
    assert_eq!(settings.outline_tolerance_mm.value, 0.002);
    assert_eq!(settings.chord_tolerance_mm.value, 0.02);
    assert!(settings.samples.chosen && settings.samples.value.is_power_of_two());
    assert!(
        settings.lines().iter().all(|line| line.contains("safety factor of 2")),
        "{:?}",
        settings.lines()
    );
    // what the file gives stands, whatever is asked
    let explicit = design_from(|d| d["mesh"]["chord_tolerance_mm"] = 0.3.into()).unwrap();
    assert_eq!(explicit.settings().chord_tolerance_mm.value, 0.3);
    assert!(!explicit.settings().chord_tolerance_mm.chosen);
    // and what neither gives follows from the rules' accuracy, which `explain` names
    let ruled = design_from(|d| drop(d.as_object_mut().unwrap().remove("accuracy"))).unwrap();
    assert!(ruled.settings().outline_tolerance_mm.chosen);
    assert!(ruled.derived().iter().any(|field| field.field == "accuracy.dot_placement_mm"));
}

/// The bounds by which settings are chosen hold for designs that nobody has seen.
#[test]
fn long_chosen_settings_keep_what_is_asked_of_random_designs() {
    let mut seed = 11_u32;
    let mut random = |low: f64, high: f64| {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        low + (high - low) * f64::from(seed >> 8) / f64::from(1_u32 << 24)
    };
    let mut done = 0;
    for _ in 0..36 {
        let asked = [
            10_f64.powf(random(-3.5, -1.5)),
            10_f64.powf(random(-1.0, 0.5)),
            10_f64.powf(random(-2.0, -0.5)),
        ];
        let (index, shift, turn) = (random(1.3, 1.6), random(-0.3, 0.3), random(-2.0, 2.0));
        let made = design_from(|d| {
            d["accuracy"] = serde_json::json!(
                { "dot_placement_mm": asked[0], "image_px": asked[1], "mesh_mm": asked[2], "force_n": 0.05 }
            );
            d["tolerances"].as_object_mut().unwrap().remove("samples");
            d["optics"]["layers"][1]["index"] = index.into();
            d["camera"]["position_mm"] = serde_json::json!([shift, -shift, -10.0]);
            d["camera"]["rotation_deg"] = serde_json::json!([turn, 0.0, 0.0]);
            d["pattern"]["unseen"] = "drop".into();
            d["pattern"]["unprintable"] = "drop".into();
        });
        // a design that cannot be is not what is tested here
        done += usize::from(made.is_ok_and(|design| keeps_what_is_asked(&design, asked, 256)));
    }
    assert!(done > 24, "{done}");
}

/// As above, over the random designs that the parts are tried on, whose parts are measured too.
#[test]
fn long_chosen_settings_keep_what_is_asked_over_the_sweep_of_the_parts() {
    let (mut done, mut measured) = (0, 0);
    for (index, mut d) in random_designs::random_designs(60).enumerate() {
        // all three in turn from crude to fine, each in its own step
        let step = |period: usize| (index % period) as f64 / (period - 1) as f64;
        let asked = [
            10_f64.powf(-3.5 + 2.0 * step(7)),
            10_f64.powf(-1.0 + 1.5 * step(5)),
            10_f64.powf(-1.7 + 1.2 * step(3)),
        ];
        d["accuracy"] = serde_json::json!(
            { "dot_placement_mm": asked[0], "image_px": asked[1], "mesh_mm": asked[2], "force_n": 0.05 }
        );
        for (section, field) in [
            ("tolerances", "samples"),
            ("print", "outline_tolerance_mm"),
            ("mesh", "chord_tolerance_mm"),
            ("mesh", "optical_chord_tolerance_mm"),
        ] {
            d[section].as_object_mut().unwrap().remove(field);
        }
        d["pattern"]["unseen"] = "drop".into();
        d["pattern"]["unprintable"] = "drop".into();
        let Ok(design) = Design::from_str(&d.to_string()) else { continue };
        done += usize::from(keeps_what_is_asked(&design, asked, 32));
        // not of those that a real printer's limits mostly refuse
        if index % 6 != 1 {
            continue;
        }
        let built = parts::Measures::of(&design).and_then(|m| parts::build(&m, &[]));
        let Ok(built) = built else { continue };
        measured += 1;
        for part in &built {
            let worst = meshes::deviations(&part.mesh, &part.construction).fold(0.0, f64::max);
            assert!(worst <= asked[2], "{index}: {} is {worst} mm off", part.name);
        }
    }
    assert!(done > 40 && measured >= 2, "{done} {measured}");
}

/// Whether the design can be laid out; where it can, its chosen settings must keep what is asked: dots mm, image px,
/// meshes mm. Drawn sensors are tried up to `most` at a time.
fn keeps_what_is_asked(design: &Design, asked: [f64; 3], max: usize) -> bool {
    let Ok(spec) = LayoutSpec::of_design(design) else { return false };
    let Ok(layout) = Layout::new(&spec) else { return false };
    let settings = design.settings();
    let in_use_mm = settings.outline_tolerance_mm.value;
    let Some(outlines) = outline::sweep(&spec, &layout, in_use_mm, Some(asked[0]), TimeLimit::QUICK) else {
        return false;
    };
    let sample = &outlines.samples[outlines.in_use.unwrap()];
    assert!(sample.max_error <= asked[0], "{} of {}", sample.max_error, asked[0]);
    // a dome that is too large or too small by the chord: dots stay within what is asked
    let chord_mm = settings.optical_chord_tolerance_mm.value;
    assert!(chord_mm <= asked[2] && settings.chord_tolerance_mm.value <= asked[2]);
    for dot in &layout.dots {
        let off = dot.surface_mm + dot.normal * chord_mm;
        if let Ok(pixel) = design.optics().project(off) {
            assert!(pixel.distance(dot.image_px) <= asked[1], "{} px", pixel.distance(dot.image_px));
        }
    }
    // the drawn sensors' mean is as certain as asked: by batches of that size
    let count = settings.samples.value as usize;
    if count <= max {
        let tolerances = &design.sections().tolerances;
        let shifts = domecast_design::layout::tolerances::drawn_shifts_px(
            &spec,
            &layout,
            tolerances,
            20 * count as u32,
        );
        let shifts: Vec<f64> = shifts.into_iter().flatten().collect();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let all = mean(&shifts);
        let batches: Vec<f64> = shifts.chunks_exact(count).map(|batch| (mean(batch) - all).powi(2)).collect();
        assert!(mean(&batches).sqrt() <= asked[1], "{count} sensors");
    }
    true
}
