//! The light of a scene: places across each light, and how often it is followed around the dome.

use glam::DVec3;

use super::clock::{Patience, time};
use super::ladder::{Ladder, Law, Rung};
use domecast_sim::light::direct;
use domecast_sim::light::direct::EmitterRule;
use domecast_sim::light::radiosity::{DomeRoom, Rings, Underside};
use domecast_sim::light::tables::Ways;
use domecast_sim::light::{LightUse, shaded_by_leds, setup};
use domecast_sim::{Scene, SimError};

/// Places across an emitter, each way, on the rungs; the simulator's among them.
const PLACES: [usize; 5] = [1, 2, 4, 8, 16];
/// The reference: the error of Gauss's rule falls faster than any power where nothing stands in the way, and as a power
/// along the edge of a shadow.
const REFERENCE: usize = 96;
const QUICK_REFERENCE: usize = 24;
const QUICK_PLACES: [usize; 3] = [1, 2, 4];
/// Directions at which the light is looked at.
const LOOKED: Rings = Rings { rings: 5, patches: 9 };
const QUICK_LOOKED: Rings = Rings { rings: 3, patches: 5 };
/// Bounces that the rungs sum.
const BOUNCES: [u32; 6] = [1, 2, 4, 8, 16, 32];

/// The ladders of samples and of bounces; empty where the scene has none of the design's lights.
///
/// # Errors
/// Lights that do not fit the design.
pub fn ladders(scene: &Scene, patience: Patience, quick: bool) -> Result<Vec<Ladder>, SimError> {
    if !shaded_by_leds(scene) {
        return Ok(Vec::new());
    }
    let ways = setup::ways(scene, &LightUse::ALL)?;
    Ok(vec![samples(&ways, patience, quick), bounces(scene, &ways, patience)])
}

fn samples(ways: &Ways, patience: Patience, quick: bool) -> Ladder {
    let (looked, finest) = if quick { (QUICK_LOOKED, QUICK_REFERENCE) } else { (LOOKED, REFERENCE) };
    let places = directions(looked);
    let look = |count: usize| -> Vec<Vec<f64>> {
        let rule = EmitterRule::with_places(count);
        let by = |source| places.iter().map(|place| ways.still(source, *place, &rule)).collect();
        ways.sources.iter().map(by).collect()
    };
    let truth = look(finest);
    let items = ways.sources.len() * places.len();
    let rung = |count: &usize| {
        let found = look(*count);
        let errors = differences(&found, &truth);
        let label = format!("{count} x {count} places");
        Rung::of(("", label), *count as f64, errors, (time(patience, || look(*count)), items), "dark places")
    };
    // A hundredth of what the reference changes by when its places are doubled: errors up to that change are not told
    // apart.
    let floor = (0.01 * differences(&look(finest / 2), &truth).fold(0.0, f64::max)).max(1e-16);
    let counts: &[usize] = if quick { &QUICK_PLACES } else { &PLACES };
    let rungs: Vec<Rung> = counts.iter().map(rung).collect();
    Ladder {
        name: "light-samples",
        title: "Light straight from the LEDs".into(),
        dial: "places across an emitter",
        error: "difference of the membrane's irradiance, in parts of that light's largest",
        unit: "of the largest",
        item: "point and light",
        items,
        reference: format!("{finest} x {finest} places; what they differ by from half as many is not told apart"),
        floor,
        law: Law::Falls,
        observed: None,
        rungs,
        in_use: counts.iter().position(|count| *count == direct::PLACES),
        asked: None,
        meets: None,
        says: "A light is small beside its distance: a few places carry all of it, and the platform's shadow is cut \
               exactly."
            .into(),
    }
    .finish()
}

/// By what the light of each source differs at each point, in parts of that source's largest.
fn differences<'a>(found: &'a [Vec<f64>], truth: &'a [Vec<f64>]) -> impl Iterator<Item = f64> + 'a {
    found.iter().zip(truth).flat_map(|(found, truth)| {
        let most = truth.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        found.iter().zip(truth).map(move |(a, b)| (a - b).abs() / most)
    })
}

fn bounces(scene: &Scene, ways: &Ways, patience: Patience) -> Ladder {
    let room = DomeRoom::new(&ways.optics[1], Rings::USUAL, Underside::Fresnel);
    let albedo = setup::mean_reflectance(scene)[1];
    let rule = EmitterRule::with_places(1);
    let direct: Vec<f64> = directions(room.rings())
        .into_iter()
        .map(|place| ways.sources.iter().map(|s| s.seen_mw[1] * ways.still(s, place, &rule)).sum())
        .collect();
    let after = |bounces: u32| -> Vec<f64> {
        let mut indirect = vec![0.0; direct.len()];
        for _ in 0..bounces {
            let exitance: Vec<f64> = direct.iter().zip(&indirect).map(|(d, i)| albedo * (d + i)).collect();
            indirect = room.irradiance(&exitance);
        }
        indirect
    };
    let solved = room.solve(&direct, albedo);
    let truth = after(3 * solved.rounds.max(32));
    let most = direct.iter().zip(&truth).map(|(d, i)| d + i).fold(f64::MIN_POSITIVE, f64::max);
    let off = |found: &[f64]| found.iter().zip(&truth).map(|(a, b)| (a - b).abs() / most).collect::<Vec<_>>();
    let mut rungs: Vec<Rung> = BOUNCES
        .iter()
        .map(|&count| {
            let label = if count == 1 { "1 bounce".to_owned() } else { format!("{count} bounces") };
            let timing = time(patience, || after(count));
            Rung::of(
                ("", label),
                f64::from(count),
                off(&after(count)).into_iter(),
                (timing, 1),
                "dark patches",
            )
        })
        .collect();
    let label = format!("until a bounce adds 1e-9 ({} of them)", solved.rounds);
    let timing = time(patience, || room.solve(&direct, albedo));
    let last = (timing, 1);
    let dial = f64::from(solved.rounds);
    rungs.push(Rung::of(("", label), dial, off(&solved.indirect).into_iter(), last, "dark patches"));
    rungs.sort_by(|a, b| a.dial.total_cmp(&b.dial));
    let in_use = rungs.iter().position(|rung| rung.dial == dial && rung.label.starts_with("until"));
    Ladder {
        name: "light-bounces",
        title: "Light from membrane to membrane".into(),
        dial: "bounces",
        error: "difference of the membrane's own light, in parts of the largest irradiance",
        unit: "of the largest",
        item: "dome",
        items: 1,
        reference: "three times the bounces of the last rung".into(),
        floor: 1e-16,
        law: Law::Falls,
        observed: None,
        rungs,
        in_use,
        asked: None,
        meets: None,
        says: "A white dome keeps its light for many bounces; all of them cost less than one frame, once for a design."
            .into(),
    }
    .finish()
}

fn directions(rings: Rings) -> Vec<DVec3> {
    (0..rings.rings)
        .flat_map(|ring| (0..rings.patches).map(move |patch| rings.direction(ring, patch)))
        .collect()
}
