//! What effects of the light change, and how bright a scene's picture is at most.

use std::sync::Arc;

use super::geometry_bound::poses;
use crate::SimError;
use crate::bound::Bound;
use crate::effect_name::{EffectChoice, EffectName};
use crate::electronics::hot_pixels::DarkCurrent;
use crate::light::bounds::{CoarseLight, grey_of_change_from, grey_of_level};
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
    Ok(Bound::grey(light.change_grey(&with, &without)))
}

/// No level of the picture is above this, full scales; above 1 it saturates.
///
/// # Errors
/// Lights that do not fit the design.
pub fn brightest_level(scene: &Scene) -> Result<f64, SimError> {
    let file = &scene.file().light;
    Ok(match light(scene)? {
        Some(light) => light.brightest(&whole(scene)).max(file.surround_level),
        None => [file.membrane_level, file.marker_level, file.surround_level].into_iter().fold(0.0, f64::max),
    })
}

/// Levels between which an edge may lie: the darkest and the brightest, full scales.
fn range(scene: &Scene) -> Result<(f64, f64), SimError> {
    let file = &scene.file().light;
    let dark = (file.membrane_level * scene.file().ink.reflectance).min(file.surround_level);
    // Under the design's lights parts of the dome may be dark.
    let darkest = if light(scene)?.is_some() { 0.0 } else { dark };
    Ok((darkest, brightest_level(scene)?))
}

/// What `covered`, a change of the part of a pixel that something covers, does to it at most, grey levels.
///
/// # Errors
/// Lights that do not fit the design.
pub fn covered_grey(scene: &Scene, covered: f64) -> Result<f64, SimError> {
    let (darkest, brightest) = range(scene)?;
    let change = covered.clamp(0.0, 1.0) * (brightest - darkest).max(0.0);
    Ok(grey_of_change_from(scene.file().electronics.gamma, darkest, change))
}

/// What ink over a part of a pixel more takes of it, grey levels.
///
/// # Errors
/// Lights that do not fit the design.
pub fn inked_grey(scene: &Scene, covered: f64) -> Result<f64, SimError> {
    let (file, ink) = (scene.file(), &scene.file().ink);
    let (darkest, ground) = match light(scene)? {
        Some(_) => (0.0, brightest_level(scene)?),
        None => (file.light.membrane_level * ink.reflectance, file.light.membrane_level),
    };
    let change = covered.clamp(0.0, 1.0) * ground * (1.0 - ink.reflectance);
    Ok(grey_of_change_from(file.electronics.gamma, darkest, change))
}

/// No value that the sensor reads is above this, full scales: the brightest level, and what the hottest pixel adds to it.
///
/// # Errors
/// Lights that do not fit the design.
pub fn brightest_value(scene: &Scene) -> Result<f64, SimError> {
    let hot = scene.file().electronics.hot_pixels.as_ref();
    Ok(brightest_level(scene)? + hot.map_or(0.0, |hot| DarkCurrent::of(scene, hot).largest()))
}

/// The largest step between two codes of the picture, grey levels.
///
/// # Errors
/// Lights that do not fit the design.
pub fn contrast_grey(scene: &Scene) -> Result<f64, SimError> {
    Ok(grey_of_level(scene.file().electronics.gamma, brightest_value(scene)?))
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
            light.darkening_grey(&whole(scene), &left).max(at_edge(scene.file().light.surround_level))
        }
        None => at_edge(brightest_level(scene)?),
    })
}
