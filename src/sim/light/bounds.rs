//! How much light there can be, and how much of it each effect can be: bounds that hold before anything is drawn.
//!
//! Light straight from the lights is smooth over the dome where nothing throws a shadow. So it is sampled there, with
//! and without the tape and with and without the faces' losses, and taken somewhat larger than found. What the platform can hide
//! and what the membrane can give itself follow from that in closed form: with the reflectance `a`, and `k` of the
//! membrane's light coming back to it, the membrane's own light is at most `a k / (1 - a k)` of the lights', and what
//! changes the lights' light changes all of it by at most `1 / (1 - a k)` of that.

use std::sync::OnceLock;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::direct::EmitterRule;
use super::parts::LightUse;
use super::random_field::MAX_DEVIATIONS;
use super::setup::{self, Channels};
use super::shade::leaves;
use super::shelf::Shelf;
use super::tables::{SHELLS, Ways};
use crate::scene::Scene;
use crate::{Bound, SimError};
use domecast_optics::SensorOptics;

/// What stands between two samples may pass them by this factor.
const MARGIN: f64 = 1.3;

/// Heights of the rings of samples, parts of the radius: close where the lights are near.
const RINGS: [f64; 9] = [0.0, 0.04, 0.1, 0.18, 0.28, 0.4, 0.55, 0.72, 0.88];

/// Samples of a ring, beside those that face a light.
const AROUND: usize = 36;

/// The largest change of a code, in grey levels of 8 bits, that a change of light by `change` (full scales) makes,
/// wherever on the scale: for gamma of 1 and more the code `x^(1/gamma)` is concave and changes most from dark, for
/// less it is steepest at full scale.
///
/// It ends at 255, whatever the change: a picture holds no code outside its scale, so where both pictures are bright enough
/// to saturate they differ by less, and by no more than the whole scale anywhere.
pub fn grey_of_change(gamma: f64, change: f64) -> f64 {
    let clear = change.clamp(0.0, 1.0);
    let power = 1.0 / gamma;
    let code = if power <= 1.0 { clear.powf(power) } else { (power * clear).min(1.0) };
    255.0 * code
}

/// The largest fall of a code, in grey levels, where light that is at most `brightest` full scales loses the part `part`
/// of itself. Above full scale more light is no more code, so nothing there falls by more than full scale does.
pub fn grey_of_loss(gamma: f64, brightest: f64, part: f64) -> f64 {
    let power = 1.0 / gamma;
    255.0 * brightest.clamp(0.0, 1.0).powf(power) * (1.0 - (1.0 - part.clamp(0.0, 1.0)).powf(power))
}

/// No level of a scene's picture is above this before the camera's gain, full scales.
///
/// # Errors
/// Lights that do not fit the design.
pub fn brightest(scene: &Scene) -> Result<f64, SimError> {
    let light = &scene.file().light;
    // Mirrored lights may be as bright as they are.
    let mirrored = if light.leds.as_ref().is_some_and(|leds| leds.gloss) { f64::INFINITY } else { 0.0 };
    Ok(brightest_membrane(scene)?.max(light.marker_level).max(light.surround_level).max(mirrored))
}

/// The same of the membrane alone.
///
/// # Errors
/// As [`brightest`].
pub fn brightest_membrane(scene: &Scene) -> Result<f64, SimError> {
    let light = &scene.file().light;
    let lit = if light.leds.is_some() { LightBounds::of(scene)?.brightest } else { 0.0 };
    let even = lit.max(light.membrane_level);
    // No place of an uneven membrane is brighter than its mean by more than this.
    let uneven =
        scene.file().uneven_membrane.as_ref().map_or(0.0, |uneven| MAX_DEVIATIONS * uneven.amplitude);
    Ok(even * (1.0 + uneven))
}

/// Bounds on levels of membrane and white markers under the design's lights, parts of full scale. Each holds whichever
/// other effects take part.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LightBounds {
    /// No level is above this.
    pub brightest: f64,
    /// What falloff and slant can change.
    pub falloff: f64,
    /// What the tape can change.
    pub diffuser: f64,
    /// What the sheet's faces can change.
    pub fresnel: f64,
    /// What the platform can hide.
    pub platform_shadow: f64,
    /// What the membrane can give itself.
    pub interreflection: f64,
}

impl LightBounds {
    /// The bounds of a scene.
    ///
    /// # Errors
    /// Lights that do not fit the design.
    pub fn of(scene: &Scene) -> Result<Self, SimError> {
        let Some(light) = &scene.file().light.leds else { return Ok(Self::default()) };
        let ways = ways(scene, false, false)?;
        let moved = !scene.file().objects.is_empty();
        let key = format!("bounds {moved} {}", scene.design().text());
        static SHELF: Shelf<OnceLock<Samples>> = Shelf::new();
        let kept = SHELF.get(&key);
        let samples = match kept.get() {
            Some(samples) => samples,
            None => {
                let made = Samples::new(scene, moved)?;
                kept.get_or_init(|| made)
            }
        };
        let sections = scene.design().sections();
        let shaded = sections.leds.through_platform < 1.0;
        // What the platform's window shows may tilt against the camera; only at rest is its loss known.
        let still = scene.file().motion.is_none() && !moved;
        let mut out = Self::default();
        for c in 0..3 {
            let seen: Vec<f64> = ways.sources.iter().map(|source| source.seen_mw[c]).collect();
            let albedo = sections.elastomer.membrane_reflectance.to_array()[c];
            let found = samples.channel(c, &seen, still);
            // Half of the membrane's light meets the dome again; the rest meets the underside, which may send it back.
            let comes_back = if has_faces(&ways.optics[c]) { albedo } else { 0.5 * albedo };
            let more = 1.0 / (1.0 - comes_back);
            let own = comes_back * more * found.membrane.max;
            let index = |beside: bool| setup::index_at(&ways.optics[c], beside).powi(2);
            let white = sections.white_markers.reflectance / index(true);
            for (part, gain, own_share) in
                [(found.membrane, albedo / index(false), more), (found.markers, white, 1.0)]
            {
                let level = |irradiance: f64| light.level_per_mw_mm2 * gain * irradiance;
                // A marker's light from the membrane changes as the membrane's does.
                let with_own = |change: f64, of_membrane: f64| {
                    level(change * own_share).max(level(change + comes_back * more * of_membrane))
                };
                let hidden = 1.0 - sections.leds.through_platform.clamp(0.0, 1.0);
                // Where the platform throws shadows, the tape moves their edges.
                let by_tape = |part: Part| if shaded && part.tape > 0.0 { part.max } else { part.tape };
                raise(&mut out.brightest, with_own(part.max, found.membrane.max) + light.stray_level);
                raise(&mut out.falloff, with_own(part.max, found.membrane.max));
                raise(&mut out.diffuser, with_own(by_tape(part), by_tape(found.membrane)));
                raise(&mut out.platform_shadow, with_own(hidden * part.max, hidden * found.membrane.max));
                raise(&mut out.interreflection, level(own));
                // Without the faces there is more light, and less of it comes back.
                raise(
                    &mut out.fresnel,
                    if has_faces(&ways.optics[c]) { level(part.faces + own) } else { 0.0 },
                );
            }
        }
        Ok(out)
    }
}

/// What a change of light by some full scales can do to a pixel.
pub fn grey(scene: &Scene, change: f64) -> Bound {
    Bound::grey(grey_of_change(scene.file().electronics.gamma, change))
}

fn raise(bound: &mut f64, value: f64) {
    *bound = bound.max(value);
}

fn has_faces(optics: &SensorOptics) -> bool {
    let index = |i: usize| optics.layers().get(i).map(|layer| layer.index_for(optics.channel()));
    (1..optics.layers().len()).any(|i| index(i) != index(0))
}

fn ways(scene: &Scene, diffuser: bool, fresnel: bool) -> Result<Ways, SimError> {
    let used = LightUse {
        direct: true,
        falloff: true,
        diffuser,
        fresnel,
        platform_shadow: false,
        interreflection: false,
    };
    setup::ways(scene, &used)
}

/// Light of every source at one place, for a flux of one: bare, bare through the faces, behind the tape, and behind
/// tape and faces.
#[derive(Debug)]
struct Sample {
    /// The normal that counts: a marker's and a resting membrane's; `None` where it may be any.
    normal: Option<DVec3>,
    /// What leaves towards the camera at rest, by channel.
    leaving: Channels,
    flux: Vec<[DVec3; 4]>,
}

/// Places of the membrane, and the white markers.
#[derive(Debug)]
struct Samples {
    membrane: Vec<Sample>,
    markers: Vec<Sample>,
}

/// Largest light, and changes of it, of one channel, 1/mm^2 times mW.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    max: f64,
    tape: f64,
    faces: f64,
}

struct Found {
    membrane: Part,
    markers: Part,
}

impl Samples {
    fn new(scene: &Scene, moved: bool) -> Result<Self, SimError> {
        let [bare, taped] = [ways(scene, false, false)?, ways(scene, true, false)?];
        let through = |ways: &Ways| Ways { fresnel: true, ..ways.clone() };
        let cases = [bare.clone(), through(&bare), taped.clone(), through(&taped)];
        let optics = &cases[0].optics;
        let rule = EmitterRule::default();
        let sample = |place: DVec3, normal: Option<DVec3>, beside: bool| Sample {
            normal,
            leaving: std::array::from_fn(|c| {
                leaves(&optics[c], setup::momentum_to_camera(&optics[c], place), beside)
            }),
            flux: (0..cases[0].sources.len())
                .map(|i| std::array::from_fn(|k| cases[k].flux(&cases[k].sources[i], place, &rule)))
                .collect(),
        };
        let shells: &[f64] = if moved { &SHELLS } else { &SHELLS[..1] };
        let mut places = Vec::new();
        for direction in directions(&cases[0]) {
            // The rim is bonded: a point moves by less than it stands above the sheet.
            let lowest = 1.0 - direction.z;
            places.extend(shells.iter().map(|p| (cases[0].point(direction, p.max(lowest)), direction)));
        }
        let membrane = places
            .into_par_iter()
            .map(|(place, direction)| sample(place, (!moved).then_some(direction), false))
            .collect();
        let markers = scene.markers().iter().map(|m| sample(m.position_mm, Some(DVec3::Z), true)).collect();
        Ok(Self { membrane, markers })
    }

    fn channel(&self, c: usize, seen: &[f64], still: bool) -> Found {
        let largest = |samples: &[Sample]| {
            samples.iter().map(|sample| sample.part(c, seen, still)).fold(Part::default(), |a, b| Part {
                max: a.max.max(b.max),
                tape: a.tape.max(b.tape),
                faces: a.faces.max(b.faces),
            })
        };
        Found { membrane: largest(&self.membrane), markers: largest(&self.markers) }
    }
}

impl Sample {
    fn part(&self, c: usize, seen: &[f64], still: bool) -> Part {
        let sum = |k: usize| self.flux.iter().zip(seen).map(|(flux, seen)| flux[k] * *seen).sum::<DVec3>();
        let light = [sum(0), sum(1), sum(2), sum(3)];
        let size = |v: DVec3| MARGIN * self.normal.map_or(v.length(), |normal| v.dot(normal).abs());
        let leaving = if still { self.leaving[c] } else { 0.0 };
        Part {
            max: light.iter().map(|v| size(*v)).fold(0.0, f64::max),
            tape: size(light[2] - light[0]).max(size(light[3] - light[1])),
            faces: size(light[0] - light[1] * leaving).max(size(light[2] - light[3] * leaving)),
        }
    }
}

/// Rings, the pole, and what faces each light on every ring.
fn directions(ways: &Ways) -> Vec<DVec3> {
    let mut out = vec![DVec3::Z];
    let lights = ways.sources.iter().map(|source| {
        let at = source.emitter.platform_from_emitter.translation;
        at.y.atan2(at.x)
    });
    let around = (0..AROUND).map(|k| std::f64::consts::TAU * k as f64 / AROUND as f64);
    let azimuths: Vec<f64> = around.chain(lights).collect();
    for z in RINGS {
        let aside = (1.0_f64 - z * z).sqrt();
        out.extend(azimuths.iter().map(|azimuth| (DVec2::from_angle(*azimuth) * aside).extend(z)));
    }
    out
}
