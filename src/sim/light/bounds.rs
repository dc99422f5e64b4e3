//! How much light there can be, and how much of it each effect is: bounds that hold before anything is drawn.
//!
//! A coarse picture of the same physics: the light at 200 patches of the dome, what faces each light, the pole and the white
//! markers, from lights of four places each, with and without the tape, the faces' losses and the platform's shadow; and the dome
//! as a room of those patches. Only what the camera sees in some frame counts. So any set of effects can be left out and the
//! change of every place be looked up, which is then taken somewhat larger than found, for what lies between the places.

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::bound_samples::{RINGS, Sample, Samples, View, samples, views};
use super::coarse_ground::CoarseGround;
use super::parts::LightUse;
use super::setup::{self, Channels};
use super::shade::leaves;
use super::shelf::Shelf;
use crate::SimError;
use crate::scene::Scene;
use domecast_optics::SensorOptics;
use domecast_optics::numeric::Rigid;

/// What stands between two samples may pass them by this factor.
const MARGIN: f64 = 1.3;

/// The largest change of a code, in grey levels of 8 bits, that a change of light by `change` (full scales) makes,
/// wherever on the scale: for gamma of 1 and more the code `x^(1/gamma)` is concave and changes most from dark, for
/// less it is steepest at full scale.
///
/// It ends at 255, whatever the change: a picture holds no code outside its scale, so where both pictures are bright enough
/// to saturate they differ by less, and by no more than the whole scale anywhere.
pub fn grey_of_change(gamma: f64, change: f64) -> f64 {
    grey_of_change_from(gamma, 0.0, change)
}

/// [`grey_of_change`] where the light is at least `darkest`, full scales.
pub fn grey_of_change_from(gamma: f64, darkest: f64, change: f64) -> f64 {
    let (low, clear) = (darkest.clamp(0.0, 1.0), change.clamp(0.0, 1.0));
    let power = 1.0 / gamma;
    let code =
        if power <= 1.0 { (low + clear).powf(power) - low.powf(power) } else { (power * clear).min(1.0) };
    255.0 * code.clamp(0.0, 1.0)
}

/// The code of a level, grey levels of 8 bits.
pub fn grey_of_level(gamma: f64, level: f64) -> f64 {
    255.0 * level.clamp(0.0, 1.0).powf(1.0 / gamma)
}

/// The largest fall of a code, in grey levels, where light that is at most `brightest` full scales loses the part `part`
/// of itself. Above full scale more light is no more code, so nothing there falls by more than full scale does.
pub fn grey_of_loss(gamma: f64, brightest: f64, part: f64) -> f64 {
    grey_of_level(gamma, brightest) * (1.0 - (1.0 - part.clamp(0.0, 1.0)).powf(1.0 / gamma))
}

/// Light at a place, by one channel.
#[derive(Debug, Clone, Copy, Default)]
struct Light {
    still: f64,
    /// With what the membrane throws on itself; `None` where the normal does not count.
    vector: Option<DVec3>,
    own: f64,
}

/// The light of a scene, coarsely.
#[derive(Debug)]
pub struct CoarseLight {
    samples: Arc<Samples>,
    views: Vec<Option<View>>,
    optics: [SensorOptics; 3],
    seen_mw: Vec<Channels>,
    /// Level for each mW/mm^2, of membrane and markers.
    gains: [Channels; 2],
    albedo: Channels,
    stray: f64,
    gamma: f64,
}

impl CoarseLight {
    /// The light of a scene whose platform stands in some poses; `None` without lights. It is kept for the next question.
    ///
    /// # Errors
    /// Lights that do not fit the design.
    pub fn of(scene: &Scene, poses: &[Rigid]) -> Result<Option<Arc<Self>>, SimError> {
        if scene.file().light.leds.is_none() {
            return Ok(None);
        }
        // numbers, strings and lists only: nothing here can fail to be written
        let file = serde_json::to_string(scene.file()).unwrap_or_default();
        static SHELF: Shelf<OnceLock<Arc<CoarseLight>>> = Shelf::new();
        let kept = SHELF.get(&format!("{file} {}", scene.design().text()));
        if let Some(found) = kept.get() {
            return Ok(Some(Arc::clone(found)));
        }
        let made = Arc::new(Self::new(scene, poses)?);
        Ok(Some(Arc::clone(kept.get_or_init(|| made))))
    }

    fn new(scene: &Scene, poses: &[Rigid]) -> Result<Self, SimError> {
        let samples = samples(scene)?;
        let ways =
            setup::ways(scene, &LightUse { diffuser: false, platform_shadow: false, ..LightUse::ALL })?;
        let optics = ways.optics.clone();
        let light = scene.file().light.leds.as_ref();
        let (per_mw, stray) = light.map_or((0.0, 0.0), |light| (light.level_per_mw_mm2, light.stray_level));
        let sections = scene.design().sections();
        let reflectance = sections.elastomer.membrane_reflectance.to_array();
        let squared = |c: usize, beside: bool| setup::index_at(&optics[c], beside).powi(2);
        let gains = [
            std::array::from_fn(|c| per_mw * reflectance[c] / squared(c, false)),
            std::array::from_fn(|c| per_mw * sections.white_markers.reflectance / squared(c, true)),
        ];
        Ok(Self {
            views: views(scene, &samples, poses),
            seen_mw: ways.sources.iter().map(|source| source.seen_mw).collect(),
            samples,
            optics,
            gains,
            albedo: setup::mean_reflectance(scene),
            stray,
            gamma: scene.file().electronics.gamma,
        })
    }

    /// Light of every place, by channel.
    fn light(&self, used: &LightUse) -> Vec<[Light; 3]> {
        let case = usize::from(used.diffuser) * 4
            + usize::from(used.fresnel) * 2
            + usize::from(used.platform_shadow);
        let direct = |sample: &Sample| -> [Light; 3] {
            std::array::from_fn(|c| {
                let mut light = Light::default();
                let mut vector = DVec3::ZERO;
                for (flux, seen) in sample.flux.iter().zip(&self.seen_mw) {
                    let along = sample.normal.map_or(flux[case].length(), |normal| flux[case].dot(normal));
                    light.still += seen[c] * along.max(0.0);
                    vector += seen[c] * flux[case];
                }
                light.vector = sample.normal.is_none().then_some(vector);
                light
            })
        };
        let mut all: Vec<[Light; 3]> = self.samples.list.iter().map(direct).collect();
        if !used.falloff {
            let pole = all.get(RINGS.count()).copied().unwrap_or_default().map(|light| light.still);
            for (light, sample) in all.iter_mut().zip(&self.samples.list) {
                if sample.beside.is_none() {
                    *light = pole.map(|still| Light { still, vector: None, own: 0.0 });
                }
            }
        }
        if used.interreflection {
            for c in 0..3 {
                let Some(room) = self.samples.rooms[usize::from(used.fresnel)].get(c) else { continue };
                let patches: Vec<f64> = all.iter().take(RINGS.count()).map(|light| light[c].still).collect();
                let balance = room.solve(&patches, self.albedo[c]);
                let mean = balance.exitance.iter().sum::<f64>() / RINGS.count() as f64;
                let vectors = room.vector_irradiance(&balance.exitance);
                for (light, sample) in all.iter_mut().zip(&self.samples.list) {
                    light[c].own = match sample.beside {
                        Some(beside) => {
                            if used.fresnel {
                                beside[c] * mean
                            } else {
                                0.0
                            }
                        }
                        None => balance.indirect.get(sample.patch).copied().unwrap_or(0.0),
                    };
                    if let (None, Some(own)) = (sample.normal, vectors.get(sample.patch)) {
                        light[c].own = light[c].own.max(own.length());
                        light[c].vector = light[c].vector.map(|vector| vector + *own);
                    }
                }
            }
        }
        all
    }

    /// Places that are seen: their light, the level of it, and the share that leaves towards the camera at either end.
    fn seen(&self) -> impl Iterator<Item = (usize, &Sample, View)> {
        let all = self.samples.list.iter().zip(&self.views).enumerate();
        all.filter_map(|(i, (sample, view))| view.map(|view| (i, sample, view)))
    }

    fn gain(&self, sample: &Sample, c: usize) -> f64 {
        self.gains[usize::from(sample.beside.is_some())][c]
    }

    fn passed(&self, used: &LightUse, sample: &Sample, c: usize, momentum: f64) -> f64 {
        if used.fresnel { leaves(&self.optics[c], momentum, sample.beside.is_some()) } else { 1.0 }
    }

    /// A bound on the change of any pixel, grey levels of a code of some gamma, between two sets of effects of the light.
    pub fn change_grey(&self, with: &LightUse, without: &LightUse, gamma: f64) -> f64 {
        let (a_light, b_light) = (self.light(with), self.light(without));
        let mut largest = 0.0_f64;
        for (i, sample, view) in self.seen() {
            for c in 0..3 {
                let (a, b) = (a_light[i][c], b_light[i][c]);
                let gain = self.gain(sample, c);
                for momentum in view.momentum {
                    let [pa, pb] = [with, without].map(|used| self.passed(used, sample, c, momentum));
                    let by_code = if sample.normal.is_some() {
                        let code = |light: Light, passed: f64| {
                            (gain * (light.still + light.own) * passed + self.stray).powf(1.0 / gamma)
                        };
                        255.0 * (code(a, pa) - code(b, pb)).abs()
                    } else {
                        let [a_still, b_still] = [(a.still + a.own) * pa, (b.still + b.own) * pb];
                        let change = match (a.vector, b.vector) {
                            (Some(a), Some(b)) => (a * pa - b * pb).length(),
                            (Some(v), None) => (v.length() * pa).max(b_still),
                            (None, Some(v)) => (v.length() * pb).max(a_still),
                            (None, None) => (a_still - b_still).abs(),
                        };
                        grey_of_change_from(gamma, self.stray, gain * change)
                    };
                    largest = largest.max(by_code);
                }
            }
        }
        (MARGIN * largest).min(255.0)
    }

    /// No level is above this, full scales.
    pub fn brightest(&self, used: &LightUse) -> f64 {
        let light = self.light(used);
        let level = |(i, sample, view): (usize, &Sample, View)| {
            let of = |c: usize| {
                let passed = view.momentum.map(|momentum| self.passed(used, sample, c, momentum));
                self.gain(sample, c) * (light[i][c].still + light[i][c].own) * passed[0].max(passed[1])
            };
            of(0).max(of(1)).max(of(2))
        };
        MARGIN * self.seen().map(level).fold(0.0, f64::max) + self.stray
    }

    /// The membrane as it rests, or as bright as it can be where objects turn and move it, and the white markers.
    pub fn ground(&self, used: &LightUse, moved: bool) -> CoarseGround {
        let light = self.light(used);
        let mut patches = vec![Channels::default(); RINGS.count()];
        let mut markers = Vec::new();
        for ((sample, view), light) in self.samples.list.iter().zip(&self.views).zip(&light) {
            let level: Channels = std::array::from_fn(|c| {
                // Of what is seen beside the picture alone, the way straight up.
                let passed = self.passed(used, sample, c, view.map_or(0.0, |view| view.momentum[0]));
                self.gain(sample, c) * (light[c].still + light[c].own) * passed + self.stray
            });
            if sample.beside.is_some() {
                markers.push((sample.place, level));
            } else if let Some(patch) = patches.get_mut(sample.patch)
                && sample.normal.is_none() == moved
            {
                patch.iter_mut().zip(level).for_each(|(known, level)| *known = known.max(level));
            }
        }
        CoarseGround { dome: *self.optics[1].dome(), patches, markers }
    }

    /// The most that a loss by field angle takes of any pixel, grey levels: `left` tells what it leaves of the light.
    pub fn darkening_grey(&self, used: &LightUse, left: impl Fn(f64) -> f64) -> f64 {
        let light = self.light(used);
        let mut largest = 0.0_f64;
        for (i, sample, view) in self.seen() {
            for (c, light) in light[i].iter().enumerate() {
                let passed = self.passed(used, sample, c, view.momentum[0]);
                let level = MARGIN * self.gain(sample, c) * (light.still + light.own) * passed;
                let lost = 1.0 - left(view.field_rad).powf(1.0 / self.gamma);
                largest = largest.max(grey_of_level(self.gamma, level + self.stray) * lost);
            }
        }
        largest
    }
}
