//! A ball pressed onto the dome, by every level of contact.

use std::time::Instant;

use glam::DVec3;

use super::clock::{TimeLimit, time};
use super::sweep::{Law, Sweep, SweepSample, sizes};
use domecast_contact::{Contact, ContactError, ContactSolid, ContactState, Indenter, Level, OnPole};
use domecast_design::Design;
use domecast_design::layout::Layout;
use domecast_fab::numbers::significant;
use domecast_optics::numeric::Rigid;

/// Elements along the meridian of the reference.
const FINEST: usize = 512;
const QUICK_FINEST: usize = 256;
/// Elements along the meridian of the linear samples.
const ELEMENTS: [u32; 3] = [8, 16, 32];
const QUICK_ELEMENTS: [u32; 2] = [8, 16];
/// The ball, in parts of the dome's radius, and how deep it goes, in parts of the dome's height: a fingertip on a pea.
const BALL: f64 = 0.5;
const DEPTH: f64 = 0.05;

/// The sweep of levels.
///
/// # Errors
/// An elastomer or a dome that no level takes.
pub fn sweep(
    design: &Design,
    layout: &Layout,
    asked_mm: Option<f64>,
    time_limit: TimeLimit,
    quick: bool,
) -> Result<Sweep, ContactError> {
    let elastomer = domecast_sim::elastomer_of(design);
    let (dome, radius_mm) = (elastomer.dome(), elastomer.dome_radius_mm);
    let depth_mm = DEPTH * elastomer.depth_scale_mm();
    let ball = Indenter { solid: ContactSolid::sphere(BALL * radius_mm)?, young_mpa: None, poisson: 0.3 };
    let at = Rigid::from_translation(DVec3::Z * (dome.height_mm() + BALL * radius_mm - depth_mm));
    let places: Vec<DVec3> = layout.dots.iter().map(|dot| dot.surface_mm).collect();
    let arc_mm = dome.meridian_end_rad() * radius_mm;
    let linear = |elements: u32| Level::Linear { element_mm: arc_mm / f64::from(elements) };
    let moved = |state: &ContactState| -> Vec<DVec3> {
        places.iter().map(|place| state.displacement_mm(*place)).collect()
    };
    let (counts, finest): (&[u32], usize) =
        if quick { (&QUICK_ELEMENTS, QUICK_FINEST) } else { (&ELEMENTS, FINEST) };
    // Straight onto the pole everything is the same at every azimuth: there elements may be as fine as one likes.
    let fine = |elements: usize| OnPole::new(&elastomer, BALL * radius_mm, depth_mm, elements);
    let (solved, coarser) = (fine(finest)?, fine(finest / 2)?);
    let truth: Vec<DVec3> = places.iter().map(|place| solved.displacement_mm(*place)).collect();
    let true_force_n = solved.force_n.abs();
    // The last halving of the elements moved it by this; its own error, of the second order, is a third of that.
    let halved =
        places.iter().zip(&truth).map(|(place, fine)| coarser.displacement_mm(*place).distance(*fine));
    let (_, floor, _) = sizes(halved.map(|off| off / 3.0));

    let mut levels = Vec::new();
    // They know hemispheres only.
    if dome.is_hemisphere() {
        levels.push((Level::Geometric, "pushed out of the object".to_owned(), 1.0));
        levels.push((Level::ClosedForm, "Hertz, with the bonded base".to_owned(), 2.0));
    }
    for &count in counts {
        let size_mm = significant(arc_mm / f64::from(count));
        levels.push((linear(count), format!("linear elements of {size_mm} mm"), f64::from(count)));
    }
    let mut samples = Vec::new();
    for (level, label, setting) in levels {
        let began = Instant::now();
        let contact = Contact::new(elastomer, level)?;
        let once_s = began.elapsed().as_secs_f64();
        let state = contact.solve(&ball, &at, None)?;
        let off = moved(&state).into_iter().zip(&truth).map(|(a, b)| a.distance(*b)).collect::<Vec<_>>();
        let (max_error, rms_error, _) = sizes(off.into_iter());
        let timing =
            time(time_limit, || contact.solve(&ball, &at, None).map(|s| s.iterations).unwrap_or_default());
        samples.push(SweepSample {
            method: if matches!(level, Level::Linear { .. }) { "linear" } else { "local" },
            label,
            setting,
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
    Ok(sweep_of(samples, arc_mm / finest as f64, floor, asked_mm))
}

/// The sweep of its samples; the reference has elements of `finest_mm`, and its own error is `floor`.
fn sweep_of(samples: Vec<SweepSample>, finest_mm: f64, floor: f64, asked_mm: Option<f64>) -> Sweep {
    let in_use = samples.iter().position(|sample| sample.method == "linear" && sample.setting == 32.0);
    Sweep {
        name: "contact",
        title: "Where a touch moves the dots".into(),
        setting: "elements along the meridian",
        error: "distance between where a dot goes and where it should, under a ball half as wide as the dome",
        unit: "mm",
        item: "solve",
        items: 1,
        reference: format!(
            "the same ball and dome by linear elements of {} mm, which a load that is the same at every azimuth allows; \
             known to {} mm",
            significant(finest_mm),
            significant(floor)
        ),
        floor,
        law: Law::Falls,
        observed: None,
        samples,
        in_use,
        asked: asked_mm,
        meets: None,
        conclusion: "The simulator's plan takes the cheapest level whose bound keeps the scene's tolerance.".into(),
    }
    .finish()
}
