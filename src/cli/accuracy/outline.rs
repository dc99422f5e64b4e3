//! The outlines of dots on the film.

use std::f64::consts::TAU;

use super::clock::{Patience, time};
use super::ladder::{Ladder, Law, Rung, sizes};
use domecast_design::layout::dot::DotProjector;
use domecast_design::layout::frame::EvenFrame;
use domecast_design::layout::outline::CurvePoint;
use domecast_design::layout::{Layout, LayoutSpec};

/// Tolerances, mm.
const RUNGS_MM: [f64; 8] = [0.1, 0.03, 0.01, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7];
/// Places of a piece at which it is held against the exact curve; the fit itself looks at three others.
const SHARES: [f64; 9] = [0.07, 0.16, 0.27, 0.38, 0.5, 0.62, 0.73, 0.84, 0.93];

/// The ladder of outline tolerances; `None` where no dot is printed.
pub fn ladder(
    spec: &LayoutSpec,
    layout: &Layout,
    in_use_mm: f64,
    asked_mm: Option<f64>,
    patience: Patience,
) -> Option<Ladder> {
    let frame = EvenFrame::new(spec.optics.lens(), spec.pattern.even_in, spec.undistorted);
    let projector = DotProjector {
        optics: &spec.optics,
        frame,
        transfer: &layout.transfer,
        size: layout.size,
        outline_tolerance_mm: in_use_mm,
    };
    let mut tolerances = RUNGS_MM.to_vec();
    if !tolerances.contains(&in_use_mm) {
        tolerances.push(in_use_mm);
    }
    tolerances.sort_by(|a, b| b.total_cmp(a));
    let mut rungs = Vec::new();
    for &tolerance_mm in &tolerances {
        let (mut errors, mut pieces) = (Vec::new(), 0);
        for dot in &layout.dots {
            let Some(hit) = layout.hits.get(dot.hit) else { continue };
            let Ok(outline) = projector.plate_outline(dot, hit.hit_from_sensor, tolerance_mm) else {
                errors.push(f64::NAN);
                continue;
            };
            let count = outline.pieces().len();
            pieces += count;
            let exact = |angle: f64| projector.plate_point(dot, hit.hit_from_sensor, angle).ok();
            let mut from = outline.start();
            let mut worst = 0.0_f64;
            for (k, &[a, b, to]) in outline.pieces().iter().enumerate() {
                for t in SHARES {
                    let u = 1.0 - t;
                    let at =
                        from * (u * u * u) + a * (3.0 * u * u * t) + b * (3.0 * u * t * t) + to * (t * t * t);
                    if let Some(CurvePoint { at: curve, slope }) = exact(TAU * (k as f64 + t) / count as f64)
                    {
                        worst = worst.max((at - curve).perp_dot(slope.normalize_or_zero()).abs());
                    }
                }
                from = to;
            }
            errors.push(worst);
        }
        let (max_error, rms_error, failed) = sizes(errors.iter().copied());
        let time = time(patience, || {
            let made = |dot: &&domecast_design::layout::Dot| {
                let hit = layout.hits.get(dot.hit).map(|hit| hit.hit_from_sensor).unwrap_or_default();
                projector.plate_outline(dot, hit, tolerance_mm).is_ok()
            };
            layout.dots.iter().filter(made).count()
        });
        let mut notes = vec![("curves".to_owned(), pieces as f64)];
        if failed > 0 {
            notes.push(("dots without an outline".into(), failed as f64));
        }
        rungs.push(Rung {
            way: "",
            label: format!("tolerance {} mm", super::sparse(tolerance_mm)),
            dial: tolerance_mm,
            max_error,
            rms_error,
            time,
            per_item_s: time.median_s / layout.dots.len().max(1) as f64,
            notes,
            dominated: false,
        });
    }
    let in_use = rungs.iter().position(|rung| rung.dial == in_use_mm);
    let film_mm = 25.4 / f64::from(spec.print.dpi);
    Some(
        Ladder {
            name: "outline",
            title: "A dot's outline on the film".into(),
            dial: "tolerance, mm",
            error: "distance across between outline and exact curve, nine places a piece",
            unit: "mm",
            item: "dot",
            items: layout.dots.len(),
            reference: "the exact curve, carried through lens, layers and pad".into(),
            floor: 4.0 * f64::EPSILON * layout.transfer.dome_radius_mm(),
            law: Law::Within,
            observed: None,
            rungs,
            in_use,
            asked: asked_mm,
            meets: None,
            says: format!(
                "A pixel of the film is {} mm; an outline closer than a tenth of that is lost on it.",
                super::sparse(film_mm)
            ),
        }
        .finish(),
    )
}
