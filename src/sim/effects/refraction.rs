//! Sheet and silicone bend the rays: without it, they are straight.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::geometry_bound::{called_for, shift_px};
use crate::raster::sensor_state::units;
use crate::raster::settings::Geometry;
use crate::raster::spots::Points;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct Refraction;

impl Effect for Refraction {
    fn name(&self) -> EffectName {
        EffectName::Refraction
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let names: Vec<String> = scene
            .optics()
            .layers()
            .iter()
            .filter(|layer| layer.index != [1.0; 3])
            .map(|layer| format!("{} {:.3}", layer.name, layer.index[1]))
            .collect();
        called_for(scene).refraction.then(|| format!("layers of index {}", names.join(", ")))
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let with = called_for(scene);
        Ok(Bound::px(shift_px(
            scene,
            with,
            Geometry { refraction: false, gap_change: false, dispersion: false, ..with },
        )?))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let points = Points::count(scene) * units::BEND;
        // Where the platform moves, solving in each frame is the gap's change.
        if called_for(scene).sheet_motion {
            Cost { once: points, per_frame: 0 }
        } else {
            Cost { once: 0, per_frame: points }
        }
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.geometry.refraction = true;
        Ok(())
    }
}
