//! What effects of the light change, and how bright a scene's picture is at most.

use std::sync::Arc;

use super::geometry_bound::poses;
use crate::SimError;
use crate::bound::Bound;
use crate::effect_name::{EffectChoice, EffectName};
use crate::light::bounds::{CoarseLight, grey_of_change, grey_of_level};
use crate::light::random_field::MAX_DEVIATIONS;
use crate::light::shading::Shading;
use crate::light::{LightUse, is_lit_by_leds};
use crate::scene::Scene;

/// The scene's light, coarsely; `None` where it is not lit by the design's lights.
fn light(scene: &Scene) -> Result<Option<Arc<CoarseLight>>, SimError> {
    if !is_lit_by_leds(scene) || scene.choice(EffectName::DirectLight) == EffectChoice::Never {
        return Ok(None);
    }
    CoarseLight::of(scene, &poses(scene)?)
}

/// The effects of light among those that may be used.
fn light_use(uses: &dyn Fn(EffectName) -> bool) -> LightUse {
    LightUse {
        direct: uses(EffectName::DirectLight),
        falloff: uses(EffectName::Falloff),
        diffuser: uses(EffectName::Diffuser),
        fresnel: uses(EffectName::Fresnel),
        platform_shadow: uses(EffectName::PlatformShadow),
        interreflection: uses(EffectName::Interreflection),
    }
}

/// All effects of light that the scene does not forbid.
fn whole(scene: &Scene) -> LightUse {
    let called = |name: EffectName| match name {
        EffectName::Diffuser => scene.design().sections().leds.diffuser.is_some(),
        EffectName::PlatformShadow => scene.design().sections().leds.through_platform < 1.0,
        _ => true,
    };
    light_use(&|name| called(name) && scene.choice(name) != EffectChoice::Never)
}

/// A bound on what some effects of light, left out together, change, with all others of the scene.
///
/// # Errors
/// Lights that do not fit the design.
pub fn change(scene: &Scene, left_out: &dyn Fn(EffectName) -> bool) -> Result<Bound, SimError> {
    let Some(light) = light(scene)? else { return Ok(Bound::default()) };
    let with = whole(scene);
    let kept = light_use(&|name| !left_out(name));
    let without = LightUse {
        direct: with.direct,
        falloff: with.falloff && kept.falloff,
        diffuser: with.diffuser && kept.diffuser,
        fresnel: with.fresnel && kept.fresnel,
        platform_shadow: with.platform_shadow && kept.platform_shadow,
        interreflection: with.interreflection && kept.interreflection,
    };
    // What mirrored lights add lifts a change to where a code of a gamma below 1 is steepest. A membrane of k times the light
    // changes k times as much, or k^(1/gamma) times where that is more.
    let (gamma, steepest) = (scene.file().electronics.gamma, (1.0 / scene.file().electronics.gamma).max(1.0));
    let grey = if shines(scene) && gamma < 1.0 {
        steepest * light.change_grey(&with, &without, 1.0)
    } else {
        light.change_grey(&with, &without, gamma)
    };
    Ok(Bound::grey((grey * (1.0 + unevenness(scene)).powf(steepest)).min(255.0)))
}

/// What a change of the membrane by some full scales makes of its code, grey levels, where mirrored lights may lift it to where
/// the code is steepest; `own` is what it makes without them.
pub fn lifted_grey(scene: &Scene, change: f64, own: f64) -> f64 {
    let gamma = scene.file().electronics.gamma;
    if shines(scene) && gamma < 1.0 { own.max(grey_of_change(gamma, change)) } else { own }
}

/// Whether the camera sees the lights mirrored in the sheet.
fn shines(scene: &Scene) -> bool {
    let gloss = scene.file().light.leds.as_ref().is_some_and(|leds| leds.gloss);
    gloss && is_lit_by_leds(scene) && scene.choice(EffectName::Gloss) != EffectChoice::Never
}

/// No place of an uneven membrane is brighter or darker than its mean by a larger part of it.
fn unevenness(scene: &Scene) -> f64 {
    let uneven = scene.file().uneven_membrane.as_ref();
    let uneven = uneven.filter(|_| scene.choice(EffectName::UnevenMembrane) != EffectChoice::Never);
    uneven.map_or(0.0, |uneven| MAX_DEVIATIONS * uneven.amplitude)
}

/// The largest gain that the camera may set, and 1 where that is more: what it does where it sets none.
pub fn max_gain(scene: &Scene) -> f64 {
    let section = scene.file().electronics.auto_exposure.as_ref();
    let section = section.filter(|_| scene.choice(EffectName::AutoExposure) != EffectChoice::Never);
    section.map_or(1.0, |section| section.gain[1].max(1.0))
}

/// The brightest of what is neither membrane nor marker: what lies beside the dome, dust, and mirrored lights, which may be as
/// bright as they are.
fn brightest_beside(scene: &Scene) -> f64 {
    let dust = scene.file().dust.as_ref();
    let dust = dust.filter(|_| scene.choice(EffectName::Dust) != EffectChoice::Never);
    let levels = dust.into_iter().flat_map(|dust| {
        let specks = dust.specks.iter().map(|lot| lot.level);
        specks.chain(dust.scratches.iter().map(|lot| lot.level))
    });
    // Not infinite, so that no part of it is no number.
    let mirrored = if shines(scene) { f64::MAX } else { 0.0 };
    levels.fold(scene.file().light.surround_level.max(mirrored), f64::max)
}

/// No level of the membrane is above this before any other effect than those of the light, full scales: of an even one and of
/// one that is as uneven as the scene's.
///
/// # Errors
/// Lights that do not fit the design.
pub fn brightest_membrane(scene: &Scene) -> Result<[f64; 2], SimError> {
    let even = match light(scene)? {
        Some(light) => light.brightest(&whole(scene)),
        None => scene.file().light.membrane_level,
    };
    Ok([even, even * (1.0 + unevenness(scene))])
}

/// No level of the picture is above this, full scales; above 1 it saturates.
///
/// # Errors
/// Lights that do not fit the design.
pub fn brightest_level(scene: &Scene) -> Result<f64, SimError> {
    let [_, membrane] = brightest_membrane(scene)?;
    // Under the design's lights the markers are among what the membrane's bound looks at.
    let markers = if light(scene)?.is_some() { 0.0 } else { scene.file().light.marker_level };
    Ok(membrane.max(markers).max(brightest_beside(scene)))
}

/// The membranes and markers that stand for what the scene shows of them: at rest, and as bright as objects can make them.
/// `None`: evenly lit.
///
/// # Errors
/// Lights that do not fit the design.
pub fn grounds(scene: &Scene) -> Result<Vec<Option<Box<dyn Shading>>>, SimError> {
    let Some(light) = light(scene)? else { return Ok(vec![None]) };
    let moved = if scene.file().objects.is_empty() { &[false][..] } else { &[false, true] };
    let used = whole(scene);
    Ok(moved.iter().map(|moved| Some(Box::new(light.ground(&used, *moved)) as Box<dyn Shading>)).collect())
}

/// The most that a loss by field angle takes of any pixel, grey levels; `left` tells what it leaves, `edge_rad` where the
/// lens ends.
///
/// # Errors
/// Lights that do not fit the design.
pub fn darkening_grey(scene: &Scene, edge_rad: f64, left: impl Fn(f64) -> f64) -> Result<f64, SimError> {
    let gamma = scene.file().electronics.gamma;
    let at_edge = |level: f64| grey_of_level(gamma, level) * (1.0 - left(edge_rad).powf(1.0 / gamma));
    Ok(match light(scene)? {
        Some(light) => {
            let uneven = (1.0 + unevenness(scene)).powf(1.0 / gamma);
            (uneven * light.darkening_grey(&whole(scene), &left)).max(at_edge(brightest_beside(scene)))
        }
        None => at_edge(brightest_level(scene)?),
    })
}
