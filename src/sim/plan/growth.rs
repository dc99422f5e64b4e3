//! How much what an effect changes can grow on its further way to the picture.

use crate::effect_name::{EffectChoice, EffectName};
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
    // The membrane is below all of them: where it is brighter than its mean, so is what they change.
    if let Some(uneven) = &file.uneven_membrane
        && effect != EffectName::UnevenMembrane
        && scene.choice(EffectName::UnevenMembrane) != EffectChoice::Never
    {
        factor *= 1.0 + MAX_DEVIATIONS * uneven.amplitude;
    }
    // The code of dark light grows by less than the light, that of gamma below 1 by more.
    factor.powf((1.0 / file.electronics.gamma).max(1.0))
}
