//! The design's lights as the runtime's constants.

use glam::DVec3;

use domecast_design::sections::LedColor;
use domecast_design::{Design, DesignError, parts};
use domecast_runtime::constants::{
    DiffuserConstants, HollowConstants, LedConstants, LightConstants, LightTolerances, LobeConstants,
};
use domecast_sim::light::setup;

/// The nominal light of a design; `None` where it has no lights.
pub(super) fn light_of(design: &Design) -> Result<Option<LightConstants>, DesignError> {
    let sections = design.sections();
    let (leds, exposure) = (&sections.leds, &sections.exposure);
    if leds.list.is_empty() {
        return Ok(None);
    }
    let scene = crate::light::scene(design, 1.0, exposure.stray_level)?;
    let cavities = setup::cavities(design).map_err(crate::light::fault)?;
    let front_mm = if leds.diffuser.is_some() { leds.diffuser_thickness_mm } else { 0.0 };
    let diffuser = leds.diffuser.map(|tape| DiffuserConstants {
        lambert_fraction: tape.lambert_fraction,
        lobe_width_rad: tape.lobe_width_deg.to_radians(),
        transmittance: tape.transmittance,
    });
    let flux = leds.radiant_flux_mw.to_array();
    let mut list = Vec::new();
    for (i, led) in leds.list.iter().enumerate() {
        let pose = parts::platform_from_led(leds, i);
        let axis: DVec3 = pose.matrix3.z_axis;
        for &(name, flux) in colors(led.color, flux).iter().filter(|(name, _)| !name.is_empty()) {
            list.push(LedConstants {
                color: name.into(),
                // The tape's outer face is what shines.
                position_mm: (pose.translation + axis * front_mm).to_array(),
                axis: axis.to_array(),
                across: pose.matrix3.x_axis.to_array(),
                side_mm: leds.emitter_mm,
                flux,
                lobe: LobeConstants { exponent: leds.lobe_exponent, diffuser },
            });
        }
    }
    let crosstalk = setup::crosstalk_matrix(exposure.crosstalk).transpose();
    Ok(Some(LightConstants {
        leds: list,
        crosstalk: [crosstalk.x_axis, crosstalk.y_axis, crosstalk.z_axis].map(|row| row.to_array()),
        reflectance: sections.elastomer.membrane_reflectance.to_array(),
        mean_reflectance: setup::mean_reflectance(&scene),
        stray: exposure.stray_level,
        gamma: 1.0,
        through_platform: leds.through_platform,
        sheet_mm: sections.sheet.size_mm,
        hollows: cavities.iter().map(|(shape, own)| HollowConstants::new(shape.clone(), own)).collect(),
        source: "nominal".into(),
        tolerances: LightTolerances::default(),
        sd: None,
        uncertainty: None,
    }))
}

/// The colours that a light sends, by name, with their flux; unused places have no name.
fn colors(color: LedColor, [red, green, blue]: [f64; 3]) -> [(&'static str, f64); 3] {
    let all = [("red", red), ("green", green), ("blue", blue)];
    let only = |k: usize| [all[k], ("", 0.0), ("", 0.0)];
    match color {
        LedColor::Red => only(0),
        LedColor::Green => only(1),
        LedColor::Blue => only(2),
        LedColor::White => all,
    }
}
