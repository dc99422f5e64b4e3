//! Levels of the membrane and the white markers, from the light on them.

use glam::{DVec3, Vec3A, Vec4};

use super::field::{FieldParts, LightField};
use super::setup::{self, Channels};
use super::{LightUse, fresnel, tables};
use crate::SimError;
use crate::effect::EffectName;
use crate::scene::Scene;
use crate::shading::{Moved, MovedBend, PlainSample, Shading, SurfaceSample, Turned};
use crate::work::Work;
use domecast_design::sections::LedColor;

/// Work of one look-up in the table of the undeformed membrane.
pub const STILL_UNITS: u64 = 25;
/// Work of one point that was moved.
pub const MOVED_UNITS: u64 = 90;
/// Work of the way out to the camera, a point.
pub const LEAVING_UNITS: u64 = 6;
/// Work of one exact evaluation of one light at one point without shadow: sixteen ways.
pub const EXACT_UNITS: u64 = 16 * 150;
/// The same for the shadow: looks, halvings, and each of them past all hollows.
pub const SHADOW_UNITS: u64 = 4 * 14 * 600;
/// The same for what the sheet's faces take.
pub const FRESNEL_UNITS: u64 = 16 * 25;
/// Work of a diffuser's table.
pub const DIFFUSER_UNITS: u64 = 20_000_000;
/// Work of the dome's balance with itself.
pub const ROOM_UNITS: u64 = 40_000_000;

/// Places of the table of what leaves towards the camera.
const LEAVING: usize = 512;

/// Lights of a scene, each colour of a white one counted for itself.
pub fn source_count(scene: &Scene) -> u64 {
    let lights = &scene.design().sections().leds.list;
    lights.iter().map(|led| if led.color == LedColor::White { 3 } else { 1 }).sum()
}

/// Exact evaluations, over all lights, that the tables of a scene take if the first resolution is enough.
pub fn predicted_evaluations(scene: &Scene) -> u64 {
    tables::predicted_evaluations(!scene.file().objects.is_empty()) * source_count(scene)
}

/// The dome under the design's lights.
pub struct LitDome {
    field: LightField,
    radius_mm: f64,
    /// Level for each mW/mm^2.
    gain: Vec4,
    stray: f32,
    /// By the squared sine of a way in the dome, what passes to the camera.
    leaving: Option<Vec<Vec4>>,
    /// Places of that table for a squared sine of 1.
    leaving_scale: f32,
    markers: Vec<(DVec3, [f32; 3])>,
    steepest_per_mm: f64,
}

impl LitDome {
    /// Works out the light of a scene.
    ///
    /// # Errors
    /// Lights that do not fit the design, or a platform that cannot be made.
    pub fn new(scene: &Scene, used: &LightUse, work: &mut Work) -> Result<Option<Self>, SimError> {
        let Some(light) = &scene.file().light.leds else { return Ok(None) };
        let design = scene.design();
        let ways = setup::ways(scene, used)?;
        let optics = &ways.optics;
        let lights = ways.sources.len() as u64;
        let key = format!("{} {} {} {}", used.diffuser, used.fresnel, used.platform_shadow, design.text());
        let prepared = tables::prepared(&key);
        let parts = FieldParts {
            falloff: used.falloff,
            albedo: used.interreflection.then(|| setup::mean_reflectance(scene)),
            moved: !scene.file().objects.is_empty(),
        };
        let field = LightField::new(&ways, &prepared, &parts);
        let exact = field.evaluations() * lights;
        let falloff_exact = exact.saturating_sub(lights);
        work.add(EffectName::DirectLight, EXACT_UNITS * lights);
        work.add(EffectName::Falloff, EXACT_UNITS * falloff_exact);
        if used.platform_shadow {
            work.add(EffectName::PlatformShadow, SHADOW_UNITS * exact);
        }
        if used.fresnel {
            work.add(EffectName::Fresnel, FRESNEL_UNITS * exact);
        }
        if used.diffuser {
            work.add(EffectName::Diffuser, DIFFUSER_UNITS);
        }
        if used.interreflection {
            work.add(EffectName::Interreflection, ROOM_UNITS);
        }

        let sections = design.sections();
        let reflectance = sections.elastomer.membrane_reflectance.to_array();
        // Radiance falls by the square of the index on the way out into air.
        let squared = |beside: bool| -> Channels {
            std::array::from_fn(|c| setup::index_at(&optics[c], beside).powi(2))
        };
        let (in_dome, in_sheet) = (squared(false), squared(true));
        let gain: Channels = std::array::from_fn(|c| light.level_per_mw_mm2 * reflectance[c] / in_dome[c]);
        let markers = scene
            .markers()
            .iter()
            .map(|marker| {
                let lit = field.beside(&ways, &prepared, marker.position_mm);
                let level = std::array::from_fn(|c| {
                    let momentum = setup::momentum_to_camera(&optics[c], marker.position_mm);
                    let passed = if used.fresnel { leaves(&optics[c], momentum, true) } else { 1.0 };
                    let white = sections.white_markers.reflectance / in_sheet[c];
                    (light.level_per_mw_mm2 * white * lit[c] * passed + light.stray_level) as f32
                });
                (marker.position_mm, level)
            })
            .collect();
        let wide = |[r, g, b]: Channels| Vec4::new(r as f32, g as f32, b as f32, 0.0);
        // From there on nothing leaves, in any channel.
        let most_sine_squared = 1.0 / in_dome.into_iter().fold(f64::INFINITY, f64::min);
        let leaving = used.fresnel.then(|| {
            let at = |i: usize| {
                let sine_squared = i as f64 / LEAVING as f64 * most_sine_squared;
                wide(std::array::from_fn(|c| {
                    leaves(&optics[c], (sine_squared * in_dome[c]).sqrt().min(1.0), false)
                }))
            };
            // What comes after the last counts nothing.
            (0..=LEAVING + 1).map(at).collect()
        });
        let brightest_gain = gain.iter().copied().fold(0.0, f64::max);
        Ok(Some(Self {
            steepest_per_mm: 1.5 * field.steepest_per_mm() * brightest_gain,
            radius_mm: scene.optics().dome_radius_mm(),
            field,
            gain: wide(gain),
            stray: light.stray_level as f32,
            leaving,
            leaving_scale: (LEAVING as f64 / most_sine_squared) as f32,
            markers,
        }))
    }

    /// The light on the membrane.
    pub fn field(&self) -> &LightField {
        &self.field
    }

    /// What passes to the camera along a direction in the dome, for each channel.
    #[inline]
    fn passed(&self, cosine: f32) -> Vec4 {
        let Some(table) = &self.leaving else { return Vec4::ONE };
        let at = (1.0 - cosine * cosine) * self.leaving_scale;
        let at = if at > 0.0 { if at < LEAVING as f32 { at } else { LEAVING as f32 } } else { 0.0 };
        let i = at as i32;
        let Some([low, high]) = table.get(i as usize..i as usize + 2) else { return Vec4::ZERO };
        *low + (*high - *low) * (at - i as f32)
    }

    /// What a surface of some light shows.
    #[inline]
    fn level(&self, light: Vec4, change: Vec4, cosine: f32) -> Vec4 {
        (self.gain * light + change).max(Vec4::ZERO) * self.passed(cosine) + Vec4::splat(self.stray)
    }
}

/// Share of the light that leaves through the sheet into the air of the camera.
pub(super) fn leaves(optics: &domecast_optics::SensorOptics, momentum: f64, beside: bool) -> f64 {
    let layers = optics.layers();
    let count = if beside && layers.len() > 2 { layers.len() - 1 } else { layers.len() };
    let indices: Vec<f64> = layers[..count].iter().map(|l| l.index_for(optics.channel())).collect();
    fresnel::through(&indices, momentum.min(1.0))
}

impl Shading for LitDome {
    fn levels(&self, samples: &[SurfaceSample], levels: &mut Vec<Vec4>, work: &mut Work) {
        let per_mm = 1.0 / self.radius_mm as f32;
        let mut moved = 0_u64;
        levels.extend(samples.iter().map(|sample| {
            let (light, change) = match sample.moved {
                Moved::Not => (self.field.still(sample.point_mm * per_mm), Vec4::ZERO),
                Moved::Little(change) => {
                    (self.field.still(sample.point_mm.normalize_or(Vec3A::Z)), change.extend(0.0))
                }
                Moved::Far => {
                    moved += 1;
                    (self.field.moved(sample.point_mm, sample.normal), Vec4::ZERO)
                }
            };
            self.level(light, change, sample.to_camera.z)
        }));
        let still = samples.len() as u64 - moved;
        work.add(EffectName::DirectLight, STILL_UNITS * still + MOVED_UNITS * moved);
        if self.leaving.is_some() {
            work.add(EffectName::Fresnel, LEAVING_UNITS * samples.len() as u64);
        }
    }

    fn plain_levels(&self, samples: &[PlainSample], levels: &mut Vec<Vec4>, work: &mut Work) {
        levels.extend(samples.iter().map(|sample| {
            self.level(self.field.still(sample.direction), sample.change.extend(0.0), sample.cosine)
        }));
        work.add(EffectName::DirectLight, STILL_UNITS * samples.len() as u64);
        if self.leaving.is_some() {
            work.add(EffectName::Fresnel, LEAVING_UNITS * samples.len() as u64);
        }
    }

    fn change(&self, point_mm: Vec3A, normal: Vec3A) -> Vec3A {
        Vec3A::from_vec4(self.gain) * self.field.change(point_mm, normal)
    }

    fn bend(&self, directions: &[Vec3A]) -> f32 {
        self.gain.max_element() * self.field.bend(directions)
    }

    fn moved_bend(&self, directions: &[Vec3A], turned: Turned) -> MovedBend {
        let gain = self.gain.max_element();
        let bend = self.field.moved_bend(directions, turned);
        MovedBend { table: gain * bend.table, tilt: gain * bend.tilt }
    }

    fn marker_level(&self, _scene: &Scene, position_mm: DVec3) -> [f32; 3] {
        let nearest = self
            .markers
            .iter()
            .min_by(|a, b| a.0.distance_squared(position_mm).total_cmp(&b.0.distance_squared(position_mm)));
        nearest.map_or([0.0; 3], |(_, level)| *level)
    }

    fn steepest_per_mm(&self) -> f64 {
        self.steepest_per_mm
    }
}
