//! The ink fades out at a dot's edge: evenly, over a width about the outline, as six nested outlines of a sixth of the
//! ink each.

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::light_bound;
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
            // Half of the ramp's width, px, and what the nested outlines' unlike areas do to the centroid: its
            // distance from the centre times two thirds of the square of the share. A whole dot's lies near its
            // centre, but that of one that is broken, or ends at the picture's edge, may lie at its rim.
            (share * radius_px, radius_px * share * share)
        };
        let edges = scene.layout().dots.iter().map(edge);
        let (width_px, shift_px) = edges.fold((0.0_f64, 0.0_f64), |(w, s), (a, b)| (w.max(a), s.max(b)));
        // A ramp of half width w about an edge is the mean over edges up to w to either side. Where an edge lies on that of a
        // pixel, half of them cover w / 2 of it in the mean. An aslant edge is up to sqrt(2) long in a pixel, but only where it
        // lies well inside. Never does it cover more than half.
        let covered = (0.25 * width_px * (1.0 + width_px).min(std::f64::consts::SQRT_2)).min(0.5);
        Ok(Bound { px: shift_px, grey: light_bound::inked_grey(scene, covered)? })
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
