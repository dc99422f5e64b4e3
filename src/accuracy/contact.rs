//! A ball pressed onto the dome, by every level of contact.

use std::time::Instant;

use glam::DVec3;

use super::clock::{Patience, time};
use super::ladder::{Ladder, Law, Rung, sizes};
use crate::design::Design;
use crate::layout::Layout;
use crate::mechanics::contact::{Contact, ContactError, ContactState, Elastomer, Indenter, Level, Solid};
use crate::numeric::Rigid;

/// Elements along the meridian of the linear rungs, and of their reference.
const ELEMENTS: [u32; 3] = [8, 16, 32];
const QUICK_ELEMENTS: [u32; 2] = [8, 16];
/// The ball and how deep it goes, in parts of the dome's radius: a fingertip on a pea.
const BALL: f64 = 0.5;
const DEPTH: f64 = 0.05;

/// The ladder of levels.
///
/// # Errors
/// An elastomer or a dome that no level takes.
pub fn ladder(
    design: &Design,
    layout: &Layout,
    asked_mm: Option<f64>,
    patience: Patience,
    quick: bool,
) -> Result<Ladder, ContactError> {
    let elastomer = Elastomer::of_design(design);
    let radius_mm = elastomer.dome_radius_mm;
    let ball = Indenter { solid: Solid::sphere(BALL * radius_mm)?, young_mpa: None, poisson: 0.3 };
    let at = Rigid::from_translation(DVec3::Z * radius_mm * (1.0 + BALL - DEPTH));
    let places: Vec<DVec3> = layout.dots.iter().map(|dot| dot.surface_mm).collect();
    let arc_mm = std::f64::consts::FRAC_PI_2 * radius_mm;
    let linear = |elements: u32| Level::Linear { element_mm: arc_mm / f64::from(elements) };
    let moved = |state: &ContactState| -> Vec<DVec3> {
        places.iter().map(|place| state.displacement_mm(*place)).collect()
    };
    let counts: &[u32] = if quick { &QUICK_ELEMENTS } else { &ELEMENTS };
    let finest = 2 * counts.last().copied().unwrap_or(8);
    let solved = Contact::new(elastomer, linear(finest))?.solve(&ball, &at, None)?;
    let (truth, true_force_n) = (moved(&solved), solved.wrench.force_n.length());

    let mut levels = vec![(Level::Geometric, "pushed out of the object".to_owned(), 1.0)];
    levels.push((Level::ClosedForm, "Hertz, with the bonded base".to_owned(), 2.0));
    for &count in counts {
        let size_mm = super::sparse(arc_mm / f64::from(count));
        levels.push((linear(count), format!("linear elements of {size_mm} mm"), f64::from(count)));
    }
    let mut rungs = Vec::new();
    for (level, label, dial) in levels {
        let began = Instant::now();
        let contact = Contact::new(elastomer, level)?;
        let once_s = began.elapsed().as_secs_f64();
        let state = contact.solve(&ball, &at, None)?;
        let off = moved(&state).into_iter().zip(&truth).map(|(a, b)| a.distance(*b)).collect::<Vec<_>>();
        let (max_error, rms_error, _) = sizes(off.into_iter());
        let timing =
            time(patience, || contact.solve(&ball, &at, None).map(|s| s.iterations).unwrap_or_default());
        rungs.push(Rung {
            way: if matches!(level, Level::Linear { .. }) { "linear" } else { "local" },
            label,
            dial,
            max_error,
            rms_error,
            time: timing,
            per_item_s: timing.median_s,
            notes: vec![
                ("seconds once for a design".into(), once_s),
                ("share of the force".into(), (state.wrench.force_n.length() / true_force_n - 1.0).abs()),
            ],
            dominated: false,
        });
    }
    // two halvings of the elements leave what the last one changed, by half or less
    let last = rungs.last().map_or(0.0, |rung: &Rung| rung.rms_error);
    let in_use = rungs.iter().position(|rung| rung.way == "linear" && rung.dial == 32.0);
    Ok(Ladder {
        name: "contact",
        title: "Where a touch moves the dots".into(),
        dial: "elements along the meridian",
        error: "distance between where a dot goes and where it should, under a ball half as wide as the dome",
        unit: "mm",
        item: "solve",
        items: 1,
        reference: format!(
            "linear elements of {} mm; that is twice as fine as the last rung, no more: the tables grow with the cube",
            super::sparse(arc_mm / f64::from(finest))
        ),
        floor: 0.005 * last,
        law: Law::Falls,
        observed: None,
        rungs,
        in_use,
        asked: asked_mm,
        meets: None,
        says: "The simulator's plan takes the cheapest level whose bound keeps the scene's tolerance.".into(),
    }
    .finish())
}
