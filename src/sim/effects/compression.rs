//! The camera's lossy code; the pass is [`crate::electronics::compression`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::electronics::compression::{Jpeg, VALUE_UNITS};
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Compression;

impl Effect for Compression {
    fn name(&self) -> EffectName {
        EffectName::Compression
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let electronics = &scene.file().electronics;
        let quality = electronics.jpeg_quality.filter(|_| scene.draws())?;
        Some(format!(
            "JPEG of quality {quality}, {}; the tolerance holds before it",
            electronics.jpeg_chroma.as_str()
        ))
    }

    fn bound(&self, _scene: &Scene) -> Result<Bound, SimError> {
        // What a lossy code makes of a picture is what the scene asks it for. The tolerance holds before it.
        Ok(Bound::UNBOUNDED)
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let (width, height) = scene.image_size();
        Cost { once: 0, per_frame: (width * height * scene.planes()) as u64 * VALUE_UNITS }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        let electronics = &scene.file().electronics;
        if let Some(quality) = electronics.jpeg_quality {
            pipeline.coded_passes.push(Box::new(Jpeg { quality, chroma: electronics.jpeg_chroma }));
        }
        Ok(())
    }
}
