//! How much what an effect changes can grow on its further way to the picture.

use crate::effect_name::{EffectChoice, EffectName};
use crate::electronics::exposure::{MIN_MEAN, MIN_PART};
use crate::electronics::sharpening::given_away;
use crate::light::random_field::MAX_DEVIATIONS;
use crate::scene::Scene;

/// The most by which effects after this one multiply what its absence changes, in the code: every other effect's bound is
/// stated for a picture that nothing after it enlarges. 1 where nothing does.
pub(crate) fn growth(scene: &Scene, effect: EffectName) -> f64 {
    let file = scene.file();
    let after = |other: EffectName| effect < other && scene.choice(other) != EffectChoice::Never;
    let mut factor = 1.0;
    if let Some(section) = file.electronics.sharpening.as_ref().filter(|_| after(EffectName::Sharpening)) {
        factor *= 1.0 + 2.0 * section.amount * given_away(section);
    }
    let electronics = &file.electronics;
    let (mut gain, mut min_mean) = (1.0_f64, f64::INFINITY);
    if let Some(section) = electronics.auto_exposure.as_ref().filter(|_| after(EffectName::AutoExposure)) {
        gain = section.gain[1].max(1.0);
        min_mean = MIN_PART * section.target_level;
    }
    if let Some(section) = electronics.white_balance.as_ref().filter(|_| after(EffectName::WhiteBalance)) {
        gain *= section.gain[1].max(1.0);
        // Both green's mean and the colour's own.
        min_mean = min_mean.min(0.5 * MIN_MEAN);
    }
    // What changes the mean by a part of it changes the gain by no more of itself, and with it every pixel.
    if min_mean.is_finite() {
        factor *= gain * (1.0 + 1.0 / min_mean);
    }
    // Some dots are darker than the ink that the bounds of what moves edges know.
    if let Some(uneven) = file.ink.uneven.as_ref().filter(|_| effect <= EffectName::InkEdge)
        && scene.choice(EffectName::UnevenInk) != EffectChoice::Never
    {
        let ink = file.ink.reflectance;
        let darkest = (ink - MAX_DEVIATIONS * uneven.reflectance).max(0.0);
        let slope = |reflectance: f64| electronics.steepest_code(file.light.membrane_level * reflectance);
        let steeper = slope(darkest) / slope(ink);
        let contrast = (1.0 - darkest) / (1.0 - ink).max(1e-3);
        factor *= contrast * if steeper.is_nan() { 1.0 } else { steeper.max(1.0) };
    }
    // The code of dark light grows by less than the light, that of gamma below 1 by more.
    factor.powf((1.0 / file.electronics.gamma).max(1.0))
}
