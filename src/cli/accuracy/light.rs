//! The light of a scene: places across each light, and how often it is followed around the dome.

use glam::DVec3;

use super::clock::{TimeLimit, time};
use super::sweep::{Law, Sweep, SweepSample};
use domecast_sim::light::direct;
use domecast_sim::light::direct::EmitterRule;
use domecast_sim::light::radiosity::{DomeRoom, Rings, Underside};
use domecast_sim::light::tables::Ways;
use domecast_sim::light::{LightUse, is_lit_by_leds, setup};
use domecast_sim::{Scene, SimError};

/// Places across an emitter, each direction, of the samples; the simulator's among them.
const PLACES: [usize; 5] = [1, 2, 3, 6, 12];
/// The reference: the error of Gauss's rule falls faster than any power where nothing stands in the way, and as a power
/// along the edge of a shadow.
const REFERENCE: usize = 96;
const QUICK_REFERENCE: usize = 24;
const QUICK_PLACES: [usize; 3] = [1, 2, 3];
/// Directions at which the light is looked at.
const LOOKED: Rings = Rings { rings: 5, patches: 9, ..Rings::USUAL };
const QUICK_LOOKED: Rings = Rings { rings: 3, patches: 5, ..Rings::USUAL };
/// Bounces that the samples sum.
const BOUNCES: [u32; 6] = [1, 2, 4, 8, 16, 32];

/// The sweeps of places across an emitter and of bounces; empty where the scene has none of the design's lights.
///
/// # Errors
/// Lights that do not fit the design.
pub fn sweeps(scene: &Scene, time_limit: TimeLimit, quick: bool) -> Result<Vec<Sweep>, SimError> {
    if !is_lit_by_leds(scene) {
        return Ok(Vec::new());
    }
    let ways = setup::ways(scene, &LightUse::ALL)?;
    Ok(vec![emitter_places(&ways, time_limit, quick), bounces(scene, &ways, time_limit)])
}

fn emitter_places(ways: &Ways, time_limit: TimeLimit, quick: bool) -> Sweep {
    let (looked, finest) = if quick { (QUICK_LOOKED, QUICK_REFERENCE) } else { (LOOKED, REFERENCE) };
    let places = directions(Rings { face: ways.face(), ..looked });
    let look = |count: usize| -> Vec<Vec<f64>> {
        let rule = EmitterRule::with_places(count);
        let by = |source| places.iter().map(|place| ways.still(source, *place, &rule)).collect();
        ways.sources.iter().map(by).collect()
    };
    let truth = look(finest);
    let items = ways.sources.len() * places.len();
    let sample = |count: &usize| {
        let found = look(*count);
        let errors = differences(&found, &truth);
        let label = format!("{count} x {count} places");
        SweepSample::of(
            ("", label),
            *count as f64,
            errors,
            (time(time_limit, || look(*count)), items),
            "dark places",
        )
    };
    // A hundredth of what the reference changes by when its places are doubled: errors up to that change are not
    // distinguished.
    let floor = (0.01 * differences(&look(finest / 2), &truth).fold(0.0, f64::max)).max(1e-16);
    let counts: &[usize] = if quick { &QUICK_PLACES } else { &PLACES };
    let samples: Vec<SweepSample> = counts.iter().map(sample).collect();
    Sweep {
        name: "light-samples",
        title: "Light straight from the LEDs".into(),
        setting: "places across an emitter",
        error: "difference of the membrane's irradiance, in parts of that light's largest",
        unit: "of the largest",
        item: "point and light",
        items,
        reference: format!("{finest} x {finest} places; their difference from half as many is not distinguished"),
        floor,
        law: Law::Falls,
        observed: None,
        samples,
        in_use: counts.iter().position(|count| *count == direct::PLACES),
        asked: None,
        meets: None,
        conclusion: "A light is small beside its distance: a few places carry all of it, and the platform's shadow is cut \
               exactly."
            .into(),
    }
    .finish()
}

/// By what the light of each source differs at each point, in parts of that source's largest.
fn differences<'a>(found: &'a [Vec<f64>], truth: &'a [Vec<f64>]) -> impl Iterator<Item = f64> + 'a {
    found.iter().zip(truth).flat_map(|(found, truth)| {
        let max = truth.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        found.iter().zip(truth).map(move |(a, b)| (a - b).abs() / max)
    })
}

fn bounces(scene: &Scene, ways: &Ways, time_limit: TimeLimit) -> Sweep {
    let room = DomeRoom::new(&ways.optics[1], Rings::usual(ways.face()), Underside::Fresnel);
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
    let max = direct.iter().zip(&truth).map(|(d, i)| d + i).fold(f64::MIN_POSITIVE, f64::max);
    let off = |found: &[f64]| found.iter().zip(&truth).map(|(a, b)| (a - b).abs() / max).collect::<Vec<_>>();
    let mut samples: Vec<SweepSample> = BOUNCES
        .iter()
        .map(|&count| {
            let label = if count == 1 { "1 bounce".to_owned() } else { format!("{count} bounces") };
            let timing = time(time_limit, || after(count));
            SweepSample::of(
                ("", label),
                f64::from(count),
                off(&after(count)).into_iter(),
                (timing, 1),
                "dark patches",
            )
        })
        .collect();
    let label = format!("until a bounce adds 1e-9 ({} of them)", solved.rounds);
    let timing = time(time_limit, || room.solve(&direct, albedo));
    let last = (timing, 1);
    let setting = f64::from(solved.rounds);
    samples.push(SweepSample::of(
        ("", label),
        setting,
        off(&solved.indirect).into_iter(),
        last,
        "dark patches",
    ));
    samples.sort_by(|a, b| a.setting.total_cmp(&b.setting));
    let in_use =
        samples.iter().position(|sample| sample.setting == setting && sample.label.starts_with("until"));
    Sweep {
        name: "light-bounces",
        title: "Light from membrane to membrane".into(),
        setting: "bounces",
        error: "difference of the membrane's own light, in parts of the largest irradiance",
        unit: "of the largest",
        item: "dome",
        items: 1,
        reference: "three times the bounces of the last sample".into(),
        floor: 1e-16,
        law: Law::Falls,
        observed: None,
        samples,
        in_use,
        asked: None,
        meets: None,
        conclusion: "A white dome keeps its light for many bounces; all of them cost less than one frame, once for a design."
            .into(),
    }
    .finish()
}

fn directions(rings: Rings) -> Vec<DVec3> {
    (0..rings.rings).flat_map(|ring| (0..rings.patches).map(move |patch| rings.place(ring, patch))).collect()
}
