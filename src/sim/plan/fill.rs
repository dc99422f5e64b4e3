//! How far pixels of a lit membrane that are filled in between rays may be off.

use crate::effect_name::{EffectChoice, EffectName};
use crate::electronics::sharpening::gain;
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
    let grey = grey_before_sharpening(scene);
    if grey < 1.0 { 0.0 } else { (PART * grey).min(0.999 * grey.floor()).min(MAX_GREY) }
}

/// What of a scene's grey tolerance a picture may be off before the camera sharpens it, which makes differences larger and
/// rounds once more.
pub(crate) fn grey_before_sharpening(scene: &Scene) -> f64 {
    let grey = scene.file().tolerance.grey;
    let sharpening = scene.file().electronics.sharpening.as_ref().filter(|s| s.amount > 0.0);
    match sharpening.filter(|_| scene.choice(EffectName::Sharpening) != EffectChoice::Never) {
        Some(sharpening) => ((grey - 1.0) / gain(sharpening)).max(0.0),
        None => grey,
    }
}

/// So many grey levels in the light of a scene's picture, full scales, where its code is steepest: in the dark, of which
/// the stray light is the end.
pub(crate) fn fill_tolerance(scene: &Scene, grey: f64) -> f32 {
    let file = scene.file();
    let darkest = file.light.leds.as_ref().map_or(0.0, |leds| leds.stray_level).max(DARKEST);
    (grey / 255.0 / file.electronics.steepest_code(darkest)) as f32
}
