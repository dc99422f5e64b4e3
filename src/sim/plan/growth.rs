//! How much what an effect changes can grow on its further way to the picture.

use crate::effect_name::{EffectChoice, EffectName};
use crate::electronics::exposure::{MIN_MEAN, MIN_PART};
use crate::electronics::sharpening::given_away;
use crate::light::bounds::grey_of_change;
use crate::light::random_field::MAX_DEVIATIONS;
use crate::plan::search::effect_of;
use crate::scene::Scene;

/// The most by which effects after this one multiply what its absence changes, in the code: every other effect's bound is
/// stated for a picture that nothing after it enlarges, but for what is looked up in pictures: they have been sharpened, and show
/// the dots as they are. 1 where nothing does.
pub(crate) fn growth(scene: &Scene, effect: EffectName) -> f64 {
    let file = scene.file();
    let after = |other: EffectName| is_after(scene, effect, other);
    let mut factor = 1.0;
    if let Some(section) = file.electronics.sharpening.as_ref().filter(|_| is_sharpened(scene, effect)) {
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
    if let Some(uneven) = file.ink.uneven.as_ref().filter(|_| effect <= EffectName::Dots)
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

fn is_after(scene: &Scene, effect: EffectName, other: EffectName) -> bool {
    effect < other && scene.choice(other) != EffectChoice::Never
}

/// Whether the camera sharpens what this effect changes, and its bound does not know.
pub(crate) fn is_sharpened(scene: &Scene, effect: EffectName) -> bool {
    let sharpening = scene.file().electronics.sharpening.as_ref().filter(|section| section.amount > 0.0);
    let drawn = effect_of(effect).is_some_and(|effect| effect.is_drawn());
    sharpening.is_some() && !drawn && is_after(scene, effect, EffectName::Sharpening)
}

/// What becomes of a change of the code by some grey levels that the absence of an effect makes, behind the effects after it.
pub(crate) fn grown(scene: &Scene, effect: EffectName, grey: f64) -> f64 {
    if grey <= 0.0 {
        return 0.0;
    }
    let (factor, gamma) = (growth(scene, effect), scene.file().electronics.gamma);
    if gamma > 1.0 && is_sharpened(scene, effect) {
        // The mask may take what is bright down to where the code is steep: the change as light, where the code is flattest,
        // and that as code from dark.
        let light = 1.0 - (1.0 - (grey / 255.0).min(1.0)).powf(gamma);
        return grey_of_change(gamma, factor * light);
    }
    grey * factor
}
