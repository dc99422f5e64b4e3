//! The membrane's reflectance varies from place to place: a smooth random field that the scene's seed draws.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::direct_light::SAMPLES;
use crate::effects::effect::{Cost, Effect};
use crate::effects::light_bound;
use crate::light::bounds;
use crate::light::random_field::{MAX_DEVIATIONS, PLACE_UNITS, RandomField};
use crate::light::uneven::Unevenness;
use crate::{Pipeline, Scene, SimError};
use glam::DVec2;

/// See the module.
pub struct UnevenMembrane;

/// Number of the stream of random numbers, beside others of the seed.
const STREAM: u64 = 0x6d65_6d62;

/// Places at which the field is looked at, along each side of the dome's square.
const ALONG: usize = 96;

impl Effect for UnevenMembrane {
    fn name(&self) -> EffectName {
        EffectName::UnevenMembrane
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let uneven = scene.file().uneven_membrane.as_ref().filter(|_| scene.draws())?;
        (uneven.amplitude > 0.0).then(|| {
            format!(
                "a reflectance that varies by {:.1} % over {} mm",
                100.0 * uneven.amplitude,
                uneven.correlation_mm
            )
        })
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let Some(uneven) = &scene.file().uneven_membrane else { return Ok(Bound::default()) };
        let field = field_of(scene, uneven.correlation_mm);
        let dome = scene.optics().dome();
        let radius_mm = dome.radius_mm();
        let spacing = 2.0 / ALONG as f64;
        let at = |k: usize| (k as f64 + 0.5) * spacing - 1.0;
        let mut largest = 0.0_f64;
        for aside in (0..ALONG * ALONG).map(|k| DVec2::new(at(k % ALONG), at(k / ALONG))) {
            // Pictures show the dome's continuation below its foot for a pixel or two: its rim stands for that.
            let meridian_rad = aside.length().min(1.0) * dome.meridian_end_rad();
            let azimuth_rad = aside.y.atan2(aside.x);
            largest = largest.max(field.at(dome.point_mm(meridian_rad, azimuth_rad)).abs());
        }
        // Between two places, and where the slope of the dome is steep, the field may be larger.
        let between = 1.1 + 0.5 * spacing * dome.meridian_end_rad() * radius_mm / uneven.correlation_mm;
        let part = uneven.amplitude * (largest * between).min(MAX_DEVIATIONS);
        let power = 1.0 / scene.file().electronics.gamma;
        let [brightest, _] = light_bound::brightest_membrane(scene)?;
        let full = brightest.min(1.0).powf(power);
        let rise = 255.0 * full * ((1.0 + part).powf(power) - 1.0).min(1.0);
        let grey = rise.max(bounds::grey_of_loss(scene.file().electronics.gamma, brightest, part));
        Ok(Bound::grey(light_bound::lifted_grey(scene, brightest * part, grey)))
    }

    fn cost(&self, _scene: &Scene) -> Cost {
        Cost { once: 0, per_frame: SAMPLES * PLACE_UNITS }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        if let Some(uneven) = &scene.file().uneven_membrane {
            pipeline.unevenness = Some(Unevenness {
                level: scene.file().light.membrane_level as f32,
                amplitude: uneven.amplitude as f32,
                field: field_of(scene, uneven.correlation_mm),
            });
        }
        Ok(())
    }
}

fn field_of(scene: &Scene, correlation_mm: f64) -> RandomField {
    RandomField::new(scene.file().seed, STREAM, correlation_mm)
}
