//! The ink fades out at a dot's edge: evenly, over a width about the outline, as six nested outlines of a sixth of the
//! ink each.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::raster::sensor_state::units;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct InkEdge;

/// Outlines more than the sharp edge has.
const MORE_RINGS: u64 = 5;
/// Corners of an outline, predicted.
const CORNERS: u64 = 50;
/// The image of a dot may be this much wider than at rest where anything moves.
const WIDER: f64 = 1.5;

impl Effect for InkEdge {
    fn name(&self) -> EffectName {
        EffectName::InkEdge
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let edge_mm = scene.file().ink.edge_mm;
        let called = scene.draws() && edge_mm > 0.0 && !scene.dots().is_empty();
        called.then(|| format!("the ink fades out over {edge_mm} mm"))
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let ink = &scene.file().ink;
        let moves = scene.motion().moves() || !scene.objects().is_empty();
        let wider = if moves { WIDER } else { 1.0 };
        let edge = |dot: &domecast_design::layout::Dot| {
            let share = ink.edge_mm / dot.diameter_mm;
            let radius_px = wider * 0.5 * dot.image_outline.widths().1;
            // What the nested outlines' unlike areas do to the centroid: its distance from the centre times two thirds of
            // the square of the share. A whole dot's lies near its centre, but that of one that is broken, or ends at the
            // picture's edge, may lie at its rim.
            radius_px * share * share
        };
        let shift_px = scene.layout().dots.iter().map(edge).fold(0.0, f64::max);
        Ok(Bound::px(shift_px))
    }

    fn is_drawn(&self) -> bool {
        true
    }

    fn cost(&self, scene: &Scene) -> Cost {
        Cost { once: 0, per_frame: scene.dots().len() as u64 * MORE_RINGS * CORNERS * units::CORNER }
    }

    fn needs(&self) -> &'static [EffectName] {
        &[EffectName::Dots]
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.ink.soft_edge = true;
        Ok(())
    }
}
