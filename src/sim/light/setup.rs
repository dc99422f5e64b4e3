//! From the design's lights and the scene's to the sources of a field.

use std::sync::OnceLock;

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};

use super::cavity::Cavities;
use super::direct::Emitter;
use super::hollows::hollows_of;
use super::lobe::{Diffuser, Lobe};
use super::parts::LightUse;
use super::shelf::Shelf;
use super::tables::{Source, Ways};
use crate::SimError;
use crate::scene::Scene;
use crate::scene::light::MovedLed;
use domecast_design::parts;
use domecast_design::parts::Measures;
use domecast_design::sections::{LedColor, LedsSection};
use domecast_design::{Design, DesignError};
use domecast_files::Cache;
use domecast_optics::{ColorChannel, SensorOptics};

/// Channels of the camera.
pub type Channels = [f64; 3];

/// The colours that a light sends.
fn colors(color: LedColor) -> &'static [ColorChannel] {
    match color {
        LedColor::Red => &[ColorChannel::Red],
        LedColor::Green => &[ColorChannel::Green],
        LedColor::Blue => &[ColorChannel::Blue],
        LedColor::White => &ColorChannel::ALL,
    }
}

/// How the channels see a colour of light.
fn seen(color: ColorChannel, crosstalk: f64) -> Channels {
    std::array::from_fn(|channel| match channel.abs_diff(color as usize) {
        0 => 1.0,
        1 => crosstalk,
        _ => 0.0,
    })
}

/// What each channel (row) sees of each colour (column).
pub fn crosstalk_matrix(crosstalk: f64) -> DMat3 {
    let [red, green, blue] = ColorChannel::ALL.map(|color| DVec3::from_array(seen(color, crosstalk)));
    DMat3::from_cols(red, green, blue)
}

/// The brightness that the scene gives each light of the design.
fn drives(scene: &Scene, count: usize) -> Result<Vec<f64>, SimError> {
    let Some(light) = &scene.file().light.leds else { return Ok(Vec::new()) };
    let lists = [
        ("light.leds.each", serde_json::json!(light.each), light.each.len(), "number"),
        ("light.leds.moved", serde_json::json!(light.moved), light.moved.len(), "entry"),
    ];
    if let Some((field, value, given, what)) =
        lists.into_iter().find(|(_, _, given, _)| *given != 0 && *given != count)
    {
        return Err(DesignError::at(
            field,
            value,
            format!("{given} for {count} lights"),
            format!("one {what} for each of the design's {count} lights, or none at all"),
        )
        .into());
    }
    let each = |i: usize| light.each.get(i).copied().unwrap_or(1.0);
    Ok((0..count).map(|i| light.power * each(i)).collect())
}

/// Height of the highest point of each emitter, with or without the diffuser in front, mm.
pub fn emitter_tops_mm(leds: &LedsSection) -> Vec<f64> {
    (0..leds.list.len())
        .map(|i| {
            let pose = parts::platform_from_led(leds, i);
            let front = pose.matrix3.z_axis.z.max(0.0) * leds.diffuser_thickness_mm;
            pose.translation.z + 0.5 * leds.emitter_mm * pose.matrix3.y_axis.z.abs() + front
        })
        .collect()
}

/// The sources of a scene, for the effects that take part.
///
/// # Errors
/// Lights that do not fit the design, or stand in the sheet.
pub fn sources(scene: &Scene, used: &LightUse) -> Result<Vec<Source>, SimError> {
    let leds = &scene.design().sections().leds;
    if used.diffuser {
        return sources_of(scene, leds, &lobe(leds, scene.cache()));
    }
    let bare = LedsSection { diffuser: None, ..leds.clone() };
    sources_of(scene, &bare, &lobe(&bare, None))
}

/// What one of the lights sends into each direction, behind its diffuser where it has one.
pub fn lobe(leds: &LedsSection, cache: Option<&Cache>) -> Lobe {
    static SHELF: Shelf<OnceLock<Lobe>> = Shelf::new();
    let key = format!("{} {:?}", leds.lobe_exponent, leds.diffuser);
    let kept = SHELF.get(&key);
    if let Some(found) = kept.get() {
        return found.clone();
    }
    let bare = Lobe::cosine_power(leds.lobe_exponent);
    let made = match leds.diffuser {
        None => bare,
        Some(tape) => {
            let behind = || {
                bare.behind(&Diffuser {
                    lambert_fraction: tape.lambert_fraction,
                    lobe_width_rad: tape.lobe_width_deg.to_radians(),
                    transmittance: tape.transmittance,
                })
            };
            let known = cache.and_then(|cache| {
                let key = format!("light's lobe {key}");
                Lobe::of_numbers(&cache.numbers(&key, Lobe::NUMBERS, || behind().numbers()))
            });
            known.unwrap_or_else(behind)
        }
    };
    kept.get_or_init(|| made).clone()
}

/// The sources of other lights than the design's, in the light of a scene: its power and crosstalk.
///
/// # Errors
/// Lights that stand in the sheet, or of another number than the scene drives one by one.
pub fn sources_of(scene: &Scene, leds: &LedsSection, lobe: &Lobe) -> Result<Vec<Source>, SimError> {
    let Some(light) = &scene.file().light.leds else { return Ok(Vec::new()) };
    let design = scene.design();
    for (i, top) in emitter_tops_mm(leds).into_iter().enumerate() {
        let top = top + light.moved.get(i).map_or(0.0, |moved| moved.up_mm);
        let bottom = design.sheet_underside_z_mm();
        if top >= bottom {
            return Err(DesignError::at(
                "leds.center_z_mm",
                leds.center_z_mm,
                format!("the top of light {i} reaches z = {top:.3} mm, into the sheet"),
                format!("a light that ends below the sheet's underside, z = {bottom} mm"),
            )
            .into());
        }
    }
    let front_mm = if leds.diffuser.is_some() { leds.diffuser_thickness_mm } else { 0.0 };
    let flux = leds.radiant_flux_mw.to_array();
    let mut out = Vec::new();
    for ((i, led), drive) in leds.list.iter().enumerate().zip(drives(scene, leds.list.len())?) {
        let mut pose = parts::platform_from_led(leds, i);
        // The tape's outer face is what shines.
        pose.translation += pose.matrix3.z_axis * front_mm;
        if let Some(moved) = light.moved.get(i) {
            pose = beside(pose, moved);
        }
        for &color in colors(led.color) {
            out.push(Source {
                emitter: Emitter {
                    platform_from_emitter: pose,
                    half_side_mm: 0.5 * leds.emitter_mm,
                    flux_mw: 1.0,
                    lobe: lobe.clone(),
                },
                optics: design.optics().for_channel(color),
                seen_mw: seen(color, light.crosstalk).map(|r| r * drive * flux[color as usize]),
            });
        }
    }
    Ok(out)
}

/// A light's pose where it stands beside that of the design.
fn beside(pose: DAffine3, moved: &MovedLed) -> DAffine3 {
    let out = pose.translation.with_z(0.0).normalize_or(DVec3::X);
    let along = DVec3::Z.cross(out);
    let across = pose.matrix3.z_axis.cross(along).normalize_or(DVec3::Z);
    let turn = along * moved.tilt_deg.to_radians() + across * moved.turn_deg.to_radians();
    DAffine3 {
        matrix3: DMat3::from_quat(DQuat::from_scaled_axis(turn)) * pose.matrix3,
        translation: pose.translation + out * moved.out_mm + along * moved.along_mm + DVec3::Z * moved.up_mm,
    }
}

/// The ways of the light of a scene, for the effects that take part.
///
/// # Errors
/// Lights that do not fit the design, or a platform that cannot be made.
pub fn ways(scene: &Scene, used: &LightUse) -> Result<Ways, SimError> {
    let design = scene.design();
    let cavities = if used.platform_shadow { Some(cavities(design)?) } else { None };
    Ok(Ways { fresnel: used.fresnel, ..ways_among(scene, sources(scene, used)?, cavities) })
}

/// The ways of such sources as the caller has, through what the caller's platform leaves open; `None` where none stands in
/// the way. The sheet is that of the scene's design.
pub fn ways_among(scene: &Scene, sources: Vec<Source>, cavities: Option<Cavities>) -> Ways {
    let design = scene.design();
    Ways {
        sources,
        optics: channel_optics(design),
        cavities,
        through_platform: design.sections().leds.through_platform,
        sheet_half_mm: sheet_half_mm(design),
        fresnel: true,
    }
}

/// What the upper platform leaves open to the light.
///
/// # Errors
/// A platform that the design cannot have.
pub fn cavities(design: &Design) -> Result<Cavities, SimError> {
    static SHELF: Shelf<OnceLock<Cavities>> = Shelf::new();
    let kept = SHELF.get(design.text());
    if let Some(found) = kept.get() {
        return Ok(found.clone());
    }
    let made = cavities_of(&Measures::of(design).map_err(DesignError::from)?)?;
    Ok(kept.get_or_init(|| made).clone())
}

/// The same of the measures.
///
/// # Errors
/// A platform that they do not allow.
pub fn cavities_of(measures: &Measures) -> Result<Cavities, SimError> {
    let shapes = parts::upper_platform(measures).map_err(DesignError::from)?;
    // No light goes down before it goes up into the sheet.
    let leds = &measures.leds;
    let lowest = leds.center_z_mm - leds.emitter_mm - leds.diffuser_thickness_mm;
    Ok(hollows_of(&shapes).between(lowest, measures.seat_z_mm()))
}

/// Half sides of the sheet, mm.
pub fn sheet_half_mm(design: &Design) -> DVec2 {
    0.5 * DVec2::from_array(design.sections().sheet.size_mm)
}

/// The membrane's reflectance, with the dots' share of the dome less bright: for the light in the dome as a whole.
pub fn mean_reflectance(scene: &Scene) -> Channels {
    let printed: f64 = scene
        .layout()
        .dots
        .iter()
        .map(|dot| 0.25 * std::f64::consts::PI * dot.diameter_mm * dot.diameter_mm)
        .sum();
    let share = (printed / scene.optics().dome().area_mm2()).min(1.0);
    let ink = scene.file().ink.reflectance;
    let bare = scene.design().sections().elastomer.membrane_reflectance.to_array();
    bare.map(|r| r * (1.0 - share + share * ink))
}

/// Layers and dome for every channel.
pub fn channel_optics(design: &Design) -> [SensorOptics; 3] {
    ColorChannel::ALL.map(|channel| design.optics().for_channel(channel))
}

/// Index of the medium that a point is seen in: the dome's, or the sheet's top layer's where `beside` it.
pub fn index_at(optics: &SensorOptics, beside: bool) -> f64 {
    let layers = optics.layers();
    let from_end = if beside && layers.len() > 2 { 2 } else { 1 };
    layers.get(layers.len() - from_end).map_or(1.0, |layer| layer.index_for(optics.channel()))
}

/// A direction towards the camera, inside the sheet's top layer, from a point of the sheet's top at rest: its
/// momentum (index times sine), or 0 where the camera does not see it.
pub fn momentum_to_camera(optics: &SensorOptics, point_mm: DVec3) -> f64 {
    let ray = optics.project(point_mm).and_then(|pixel| Ok(optics.lens().unproject(pixel)?));
    ray.map_or(0.0, |ray| {
        let direction = optics.sensor_from_camera().vector(ray);
        direction.truncate().length().min(1.0)
    })
}
