//! How far pixels of a lit membrane that are filled in between rays may be off.

use crate::effect_name::EffectName;
use crate::plan::growth::{growth, is_sharpened};
use crate::scene::Scene;

/// Part of a scene's grey tolerance that the filling takes; the rest is for the effects that are left out.
const PART: f64 = 0.9;
/// More than this, grey levels, the nodes of a square of the largest size would hardly tell.
const MAX_GREY: f64 = 3.6;
/// Light below which codes are not distinguished, full scales: a tenth of the first code of a linear picture.
const DARKEST: f64 = 0.0004;

/// How far a pixel that is filled in may be from what its own ray shows, grey levels: nine tenths of the scene's
/// tolerance, but so much less that both round to codes within the tolerance, and 3.6 at most; 0 where the tolerance is below
/// one level, finer than which codes are not: then each pixel has its own ray.
pub(crate) fn fill_grey(scene: &Scene) -> f64 {
    let grey = scene.file().tolerance.grey;
    if grey < 1.0 { 0.0 } else { (PART * grey).min(0.999 * grey.floor()).min(MAX_GREY) }
}

/// So many grey levels in the light of a scene's picture, full scales, where its code is steepest: in the dark, of which
/// the stray light is the end.
pub(crate) fn fill_tolerance(scene: &Scene, grey: f64) -> f32 {
    let file = scene.file();
    // What is filled in is drawn before every effect that enlarges; sharpening may take stray light away as well.
    let leds = file.light.leds.as_ref().filter(|_| !is_sharpened(scene, EffectName::LensDistortion));
    let darkest = leds.map_or(0.0, |leds| leds.stray_level).max(DARKEST);
    (grey / 255.0 / file.electronics.steepest_code(darkest) / growth(scene, EffectName::LensDistortion))
        as f32
}
