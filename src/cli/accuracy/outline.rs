//! The outlines of dots on the film.

use std::f64::consts::TAU;

use super::clock::{TimeLimit, time};
use super::sweep::{Law, Sweep, SweepSample, sizes};
use domecast_design::layout::dot::DotProjector;
use domecast_design::layout::frame::EvenFrame;
use domecast_design::layout::outline::{CurvePoint, Outline};
use domecast_design::layout::{Layout, LayoutSpec};
use domecast_fab::numbers::significant;

/// Tolerances, mm.
const TOLERANCES_MM: [f64; 8] = [0.1, 0.03, 0.01, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
/// Places of a piece at which it is held against the exact curve; the fit itself looks at three others.
const SHARES: [f64; 9] = [0.07, 0.16, 0.27, 0.38, 0.5, 0.62, 0.73, 0.84, 0.93];

/// The sweep of outline tolerances; `None` where no dot is printed.
pub fn sweep(
    spec: &LayoutSpec,
    layout: &Layout,
    in_use_mm: f64,
    asked_mm: Option<f64>,
    time_limit: TimeLimit,
) -> Option<Sweep> {
    let frame = EvenFrame::new(spec.optics.lens(), spec.pattern.even_in, spec.undistorted);
    let projector = DotProjector {
        optics: &spec.optics,
        frame,
        transfer: &layout.transfer,
        size: layout.size,
        outline_tolerance_mm: in_use_mm,
    };
    let mut tolerances = TOLERANCES_MM.to_vec();
    if !tolerances.contains(&in_use_mm) {
        tolerances.push(in_use_mm);
    }
    tolerances.sort_by(|a, b| b.total_cmp(a));
    let mut samples = Vec::new();
    for &tolerance_mm in &tolerances {
        let (mut errors, mut pieces) = (Vec::new(), 0);
        for dot in &layout.dots {
            let Some(pass) = layout.passes.get(dot.pass) else { continue };
            let Ok(outline) = projector.plate_outline(dot, pass.pass_from_sensor, tolerance_mm) else {
                errors.push(f64::NAN);
                continue;
            };
            pieces += outline.pieces().len();
            errors.push(deviation_mm(&outline, |angle| {
                projector.plate_point(dot, pass.pass_from_sensor, angle).ok()
            }));
        }
        let (max_error, rms_error, failed) = sizes(errors.iter().copied());
        let time = time(time_limit, || {
            let made = |dot: &&domecast_design::layout::Dot| {
                let pass = layout.passes.get(dot.pass).map(|pass| pass.pass_from_sensor).unwrap_or_default();
                projector.plate_outline(dot, pass, tolerance_mm).is_ok()
            };
            layout.dots.iter().filter(made).count()
        });
        let mut notes = vec![("curves".to_owned(), pieces as f64)];
        if failed > 0 {
            notes.push(("dots without an outline".into(), failed as f64));
        }
        samples.push(SweepSample {
            method: "",
            label: format!("tolerance {} mm", significant(tolerance_mm)),
            setting: tolerance_mm,
            max_error,
            rms_error,
            time,
            per_item_s: time.median_s / layout.dots.len().max(1) as f64,
            notes,
            dominated: false,
        });
    }
    Some(sweep_of(samples, spec, layout, in_use_mm, asked_mm))
}

/// Largest distance of an outline from the exact curve by angle, across it, mm.
fn deviation_mm(outline: &Outline, exact: impl Fn(f64) -> Option<CurvePoint>) -> f64 {
    let count = outline.pieces().len() as f64;
    let mut from = outline.start();
    let mut max = 0.0_f64;
    for (k, &[a, b, to]) in outline.pieces().iter().enumerate() {
        for t in SHARES {
            let u = 1.0 - t;
            let at = from * (u * u * u) + a * (3.0 * u * u * t) + b * (3.0 * u * t * t) + to * (t * t * t);
            if let Some(CurvePoint { at: curve, slope }) = exact(TAU * (k as f64 + t) / count) {
                max = max.max((at - curve).perp_dot(slope.normalize_or_zero()).abs());
            }
        }
        from = to;
    }
    max
}

/// The sweep of its samples.
fn sweep_of(
    samples: Vec<SweepSample>,
    spec: &LayoutSpec,
    layout: &Layout,
    in_use_mm: f64,
    asked_mm: Option<f64>,
) -> Sweep {
    let in_use = samples.iter().position(|sample| sample.setting == in_use_mm);
    let film_mm = 25.4 / f64::from(spec.print.dpi);
    Sweep {
        name: "outline",
        title: "A dot's outline on the film".into(),
        setting: "tolerance, mm",
        error: "distance across between outline and exact curve, nine places a piece",
        unit: "mm",
        item: "dot",
        items: layout.dots.len(),
        reference: "the exact curve through lens, layers and pad".into(),
        floor: 4.0 * f64::EPSILON * layout.transfer.dome_radius_mm(),
        law: Law::Within,
        observed: None,
        samples,
        in_use,
        asked: asked_mm,
        meets: None,
        conclusion: format!(
            "A pixel of the film is {} mm; an outline closer than a tenth of that is lost on it.",
            significant(film_mm)
        ),
    }
    .finish()
}
