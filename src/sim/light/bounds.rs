//! How much light there can be at most, in closed form: for bounds that must hold before anything is computed.

use std::f64::consts::{PI, TAU};

use super::setup::{emitter_tops_mm, source_power};
use crate::sim::SimError;
use crate::sim::scene::Scene;

/// The largest change of a code, in grey levels of 8 bits, that a change of light by `change` (full scales) makes,
/// wherever on the scale: for gamma of 1 and more the code `x^(1/gamma)` is concave and changes most from dark, for
/// less it is steepest at full scale.
pub fn grey_of_change(gamma: f64, change: f64) -> f64 {
    let clear = change.clamp(0.0, 1.0);
    let power = 1.0 / gamma;
    let code = if power <= 1.0 { clear.powf(power) } else { (power * clear).min(1.0) };
    255.0 * code
}

/// A level that no point of the undeformed or dented membrane exceeds under the design's lights, whichever
/// effects of light take part.
///
/// An emitter of intensity `I` below the sheet, with air of thickness `d` above it, gives no surface more than
/// `I / d^2`: the reach `X` of a ray is at least `d tan`, so the solid angle for an area across the ray is at most
/// `cos^2 / d^2`. The membrane's own light adds at most the series of its reflectance.
///
/// # Errors
/// Lights that do not fit the design.
pub fn brightest_level(scene: &Scene) -> Result<f64, SimError> {
    let Some(light) = &scene.file().light.leds else { return Ok(0.0) };
    let sections = scene.design().sections();
    let m = sections.leds.lobe_exponent;
    // Bare; or behind a diffuser, whose lobe squeezes into the hemisphere what would leave it: for lobes of m at
    // least 1, which send little along the sheet, that less than doubles the densest direction (tested). For others,
    // light along the sheet has the density 1 / integral of cos exp(..), below 2 / width^3.
    let bare = (m + 1.0) / TAU;
    let diffuse = sections.leds.diffuser.map_or(0.0, |d| {
        let width = d.lobe_width_deg.to_radians();
        let lobe = if m >= 1.0 { 2.0 * bare } else { 2.0 / width.powi(3).min(1.0) };
        d.transmittance * (d.lambert_fraction / PI + (1.0 - d.lambert_fraction) * lobe)
    });
    let per_sr = bare.max(diffuse);
    let bottom = scene.design().sheet_underside_z_mm();
    let powers = source_power(scene)?;
    let mut irradiance = [0.0; 3];
    for (power, top) in powers.iter().zip(emitter_tops_mm(scene.design())) {
        let air_mm = bottom - top;
        let most = if air_mm > 0.0 { per_sr / (air_mm * air_mm) } else { f64::INFINITY };
        for (sum, channel) in irradiance.iter_mut().zip(power) {
            *sum += if *channel > 0.0 { channel * most } else { 0.0 };
        }
    }
    let reflectance = sections.elastomer.membrane_reflectance.to_array();
    let level = irradiance.iter().zip(reflectance).map(|(e, r)| e * r / (1.0 - r)).fold(0.0, f64::max);
    Ok(level * light.level_per_mw_mm2 + light.stray_level)
}

/// The bound of an effect that changes the light by no more than there is.
///
/// # Errors
/// As [`brightest_level`].
pub fn all_of_it(scene: &Scene) -> Result<crate::sim::Bound, SimError> {
    let most = brightest_level(scene)?;
    Ok(crate::sim::Bound::grey(grey_of_change(scene.file().electronics.gamma, most)))
}
