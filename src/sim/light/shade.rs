//! Levels of the membrane and the white markers, from the light on them.

use glam::{DVec3, Vec3A, Vec4};

use super::field::{FieldParts, LightField};
use super::setup::{self, Channels};
use super::{fresnel, tables};
use crate::SimError;
use crate::effect_name::EffectName;
use crate::light::parts::LightUse;
use crate::light::shading::{Shading, SurfaceSample};
use crate::scene::Scene;
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
/// The same for the shadow: looks, halvings, and each of them past the hollow that stopped the last one, seldom past all.
pub const SHADOW_UNITS: u64 = 4 * 14 * 170;
/// The same for what the sheet's faces take.
pub const FRESNEL_UNITS: u64 = 16 * 25;
/// Work of a diffuser's table.
pub const DIFFUSER_UNITS: u64 = 6_000_000;
/// Work of the dome's balance with itself.
pub const ROOM_UNITS: u64 = 15_000_000;

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
pub struct ShadedDome {
    field: LightField,
    per_mm: f32,
    center_mm: Vec3A,
    /// Level for each mW/mm^2.
    gain: Vec4,
    stray: f32,
    /// By the squared sine of a way in the dome, what passes to the camera.
    leaving: Option<Vec<Vec4>>,
    /// Places of that table for a squared sine of 1.
    leaving_scale: f32,
    markers: Vec<(DVec3, [f32; 3])>,
}

/// Counts what the light's effects cost, of so many exact evaluations.
fn count(work: &mut Work, used: &LightUse, exact: u64, lights: u64) {
    work.add(EffectName::DirectLight, EXACT_UNITS * lights);
    work.add(EffectName::Falloff, EXACT_UNITS * exact.saturating_sub(lights));
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
}

impl ShadedDome {
    /// Computes the light of a scene.
    ///
    /// # Errors
    /// Lights that do not fit the design, or a platform that cannot be made.
    pub fn new(scene: &Scene, used: &LightUse, work: &mut Work) -> Result<Option<Self>, SimError> {
        let Some(light) = &scene.file().light.leds else { return Ok(None) };
        let design = scene.design();
        let ways = setup::ways(scene, used)?;
        let optics = &ways.optics;
        let lights = ways.sources.len() as u64;
        let moved = serde_json::json!(light.moved);
        let key =
            format!("{} {} {} {moved} {}", used.diffuser, used.fresnel, used.platform_shadow, design.text());
        let prepared = tables::prepared(&key);
        let parts = FieldParts {
            falloff: used.falloff,
            albedo: used.interreflection.then(|| setup::mean_reflectance(scene)),
            moved: !scene.file().objects.is_empty(),
        };
        if let Some(cache) = scene.cache() {
            prepared.fill(&ways, &parts, &|key, count, make| cache.numbers(key, count, make));
        }
        let field = LightField::new(&ways, &prepared, &parts);
        count(work, used, field.evaluations() * lights, lights);

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
        let max_sine_squared = 1.0 / in_dome.into_iter().fold(f64::INFINITY, f64::min);
        let leaving = used.fresnel.then(|| {
            let at = |i: usize| {
                let sine_squared = i as f64 / LEAVING as f64 * max_sine_squared;
                wide(std::array::from_fn(|c| {
                    leaves(&optics[c], (sine_squared * in_dome[c]).sqrt().min(1.0), false)
                }))
            };
            // What comes after the last counts nothing.
            (0..=LEAVING + 1).map(at).collect()
        });
        Ok(Some(Self {
            per_mm: (1.0 / scene.optics().dome_radius_mm()) as f32,
            center_mm: scene.optics().dome().center_mm().as_vec3a(),
            field,
            gain: wide(gain),
            stray: light.stray_level as f32,
            leaving,
            leaving_scale: (LEAVING as f64 / max_sine_squared) as f32,
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
}

/// Share of the light that leaves through the sheet into the air of the camera.
pub(super) fn leaves(optics: &domecast_optics::SensorOptics, momentum: f64, beside: bool) -> f64 {
    let layers = optics.layers();
    let count = if beside && layers.len() > 2 { layers.len() - 1 } else { layers.len() };
    let indices: Vec<f64> = layers[..count].iter().map(|l| l.index_for(optics.channel())).collect();
    fresnel::through(&indices, momentum.min(1.0))
}

impl Shading for ShadedDome {
    fn level(&self, sample: &SurfaceSample) -> Vec4 {
        let light = if sample.is_moved {
            self.field.moved(sample.point_mm, sample.normal)
        } else {
            self.field.still((sample.point_mm - self.center_mm) * self.per_mm)
        };
        self.gain * light * self.passed(sample.to_camera.z) + Vec4::splat(self.stray)
    }

    fn count(&self, still: u64, moved: u64, work: &mut Work) {
        work.add(EffectName::DirectLight, STILL_UNITS * still + MOVED_UNITS * moved);
        if self.leaving.is_some() {
            work.add(EffectName::Fresnel, LEAVING_UNITS * (still + moved));
        }
    }

    fn marker_level(&self, _scene: &Scene, position_mm: DVec3) -> [f32; 3] {
        let nearest = self
            .markers
            .iter()
            .min_by(|a, b| a.0.distance_squared(position_mm).total_cmp(&b.0.distance_squared(position_mm)));
        nearest.map_or([0.0; 3], |(_, level)| *level)
    }
}

/// The shading of a scene, `None` where the membrane is evenly lit.
///
/// # Errors
/// Lights that cannot be computed.
pub fn shading_of(
    scene: &Scene,
    used: &LightUse,
    work: &mut Work,
) -> Result<Option<Box<dyn Shading>>, SimError> {
    if !used.direct {
        return Ok(None);
    }
    Ok(ShadedDome::new(scene, used, work)?.map(|dome| Box::new(dome) as Box<dyn Shading>))
}
