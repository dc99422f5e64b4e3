//! The lights mirrored in the sheet's faces; the ways are [`crate::light::gloss`].

use crate::bound::Bound;
use crate::effect_name::EffectName;
use crate::effects::effect::{Cost, Effect};
use crate::effects::geometry_bound::{called_for, solved_frames};
use crate::light::gloss::Gloss;
use crate::light::{bounds, is_lit_by_leds};
use crate::raster::coverage::Coverage;
use crate::raster::glints::WAY_UNITS;
use crate::{Pipeline, Scene, SimError};

/// See the module.
pub struct GlossEffect;

/// The images of a light in several faces may fall together.
const MARGIN: f64 = 1.2;

impl Effect for GlossEffect {
    fn name(&self) -> EffectName {
        EffectName::Gloss
    }

    fn calls_for(&self, scene: &Scene) -> Option<String> {
        let light = scene.file().light.leds.as_ref().filter(|_| is_lit_by_leds(scene))?;
        let count = scene.design().sections().leds.list.len();
        light
            .gloss
            .then(|| format!("{count} lights, and faces that throw back some of what falls on them aslant"))
    }

    fn bound(&self, scene: &Scene) -> Result<Bound, SimError> {
        let Some(gloss) = Gloss::of(scene)? else { return Ok(Bound::default()) };
        let (width, height) = scene.image_size();
        let mut coverage = Coverage::default();
        let mut brightest = 0.0_f64;
        let solved = solved_frames(scene)?;
        for (frame, touch) in solved.touches() {
            let optics = scene.optics().at_pose(&touch.state.pose).map_err(|fault| SimError::Frame {
                frame,
                problem: format!("{} = {}: the platform cannot be there", fault.field, fault.value),
            })?;
            // A pixel gets at most the sum of what covers it; images of neighbouring pieces share what they cover.
            let mut sums = vec![0.0_f32; width * height];
            for glint in gloss.glints(&optics) {
                let level = glint.level.into_iter().fold(0.0, f32::max);
                coverage.fill(&glint.corners_px);
                for (y, x, part) in coverage.rows(width, height) {
                    let row = sums.get_mut(y * width + x..y * width + x + part.len()).unwrap_or_default();
                    row.iter_mut().zip(part).for_each(|(sum, share)| *sum += share * level);
                }
                // Where things move, a pixel may see more of it in another frame.
                if called_for(scene).sheet_motion {
                    brightest = brightest.max(f64::from(level));
                }
            }
            brightest = sums.into_iter().map(f64::from).fold(brightest, f64::max);
        }
        Ok(Bound::grey(bounds::grey_of_change(scene.file().electronics.gamma, MARGIN * brightest)))
    }

    fn cost(&self, scene: &Scene) -> Cost {
        let ways = Gloss::of(scene).ok().flatten().map_or(0, |gloss| gloss.way_count());
        Cost { once: 0, per_frame: ways * WAY_UNITS }
    }

    fn apply(&self, scene: &Scene, pipeline: &mut Pipeline) -> Result<(), SimError> {
        pipeline.gloss = Gloss::of(scene)?;
        Ok(())
    }
}
