//! Dots that are not all alike: each has its own diameter and its own ink.

use crate::bound::Bound;
use crate::contact::between::Between;
use crate::contact::shape::SkinShape;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::geometry_bound::{called_for, solved_frames};
use crate::effects::light_bound;
use crate::light::bounds;
use crate::light::random_field::PLACE_UNITS;
use crate::raster::printed::{PrintedDot, printed_dots};
use crate::raster::projector::Projector;
use crate::raster::sensor_state::SensorState;
use crate::raster::settings::Ink;
use crate::raster::spots::{Points, Spots};
use crate::{Pipeline, Scene, SimError, Work};

/// See the module.
pub struct UnevenInk;

/// Frames at which centroids are looked at.
const MAX_FRAMES: usize = 5;
/// Between those frames a centroid may differ by this much more, and under an object, where the states of the bound are
/// those of another level of contact.
const BETWEEN: f64 = 1.3;
const UNDER_OBJECT: f64 = 2.0;
/// The image of a dot may be this much wider than at rest where something moves.
const WIDER: f64 = 1.5;

impl Effect for UnevenInk {
    fn name(&self) -> EffectName {
        EffectName::UnevenInk
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let uneven =
            scene.file().ink.uneven.as_ref().filter(|_| scene.draws() && !scene.dots().is_empty())?;
        (uneven.reflectance > 0.0 || uneven.diameter > 0.0).then(|| {
            format!(
                "the dots' diameters spread by {:.1} %, their reflectances by {}",
                100.0 * uneven.diameter,
                uneven.reflectance
            )
        })
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let dots = printed_dots(scene);
        let even = scene.file().ink.reflectance;
        let widths = scene.layout().dots.iter().map(|dot| 0.5 * dot.image_outline.widths().1);
        let wider = if called_for(scene).sheet_motion { WIDER } else { 1.0 };
        // An edge that moves by d changes what a pixel is covered by at most d times its diagonal.
        let change = |(dot, radius_px): (&PrintedDot, f64)| {
            let moved_px = wider * radius_px * (dot.scale - 1.0).abs();
            let covered = (std::f64::consts::SQRT_2 * moved_px * dot.scale.max(1.0)).min(1.0);
            covered * (1.0 - even) + (dot.reflectance - even).abs()
        };
        let change = dots.iter().zip(widths).map(change).fold(0.0, f64::max).min(1.0);
        let darkest = dots.iter().map(|dot| dot.reflectance).fold(even, f64::min);
        let power = 1.0 / scene.file().electronics.gamma;
        // The code rises most from the darkest ink, or ends with the steepest slope.
        let rise = ((darkest + change).min(1.0).powf(power) - darkest.powf(power))
            .max(1.0 - (1.0 - change).powf(power));
        let [_, ground] = light_bound::brightest_membrane(scene)?;
        let grey = bounds::grey_of_level(scene.file().electronics.gamma, ground) * rise;
        let grey = light_bound::lifted_grey(scene, ground * change, grey);
        Ok(Bound { px: centroids_apart_px(scene)?, grey })
    }

    fn cost(&self, scene: &Scene) -> Cost {
        Cost { once: scene.dots().len() as u64 * PLACE_UNITS, per_frame: 0 }
    }

    fn needs(&self) -> &'static [EffectName] {
        &[EffectName::Dots]
    }

    fn apply(&self, _scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.ink.uneven = true;
        Ok(())
    }
}

/// How far apart the centroids of a dot and of its even one can be, px.
fn centroids_apart_px(scene: &Scene) -> Result<f64, SimError> {
    let geometry = called_for(scene);
    let mut uncounted = Work::default();
    let eye = Projector::new(scene, geometry)?;
    let mut points = |uneven: bool| {
        let ink = Ink { uneven, ..Ink::default() };
        Points::new(scene, (geometry, ink), &eye, 0.1, &mut uncounted)
    };
    let (even, uneven) = (points(false), points(true));
    let solved = solved_frames(scene)?;
    let last = solved.touches().count().saturating_sub(1);
    let step = last.div_ceil(MAX_FRAMES - 1).max(1);
    let mut apart_px = 0.0_f64;
    for (frame, touch) in solved.touches().step_by(step).chain(solved.touches().skip(last)) {
        let touched = SkinShape { touch: Some(Between::at_frame(touch.clone())), ..SkinShape::default() };
        let time_s = scene.time_s(frame);
        let instant =
            SensorState::new(&eye, geometry, time_s, touch.state.clone(), touched, &mut Work::default())?;
        let (a, b) = (even.see(scene, &instant), uneven.see(scene, &instant));
        for dot in 0..scene.dots().len() {
            for channel in 0..eye.channels() {
                let seen = |spots: &Spots| {
                    spots.dot(dot, channel).filter(|spot| spot.area_px2 > 0.0).map(|spot| spot.centroid_px)
                };
                match (seen(&a), seen(&b)) {
                    (Some(a), Some(b)) => apart_px = apart_px.max(a.distance(b)),
                    (None, None) => {}
                    _ => return Ok(f64::INFINITY),
                }
            }
        }
    }
    let margin = if scene.objects().is_empty() { BETWEEN } else { UNDER_OBJECT };
    Ok(margin * apart_px)
}
