//! One light with its resistor, before its temperature is known.

use serde::Serialize;

use super::e24::{nearest_ohm, rating_w};
use crate::spec::sections::{ElectricalSection, LedColor, LedSection, LedsSection, PowerRgb, ValueRgbw};

/// One light in its circuit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LedCircuit {
    /// Its place in `leds.list`.
    pub light: usize,
    /// Its colour.
    pub color: LedColor,
    /// Its direction from the axis, degrees.
    pub azimuth_deg: f64,
    /// Light that the design asks for, mW; of a white light the sum of the three colours.
    pub asked_flux_mw: f64,
    /// Resistor that would give it exactly, ohm; `None` for a light that stays dark.
    pub ideal_resistor_ohm: Option<f64>,
    /// The nearest E24 value, ohm.
    pub resistor_ohm: Option<f64>,
    /// What the resistor must bear, W: at least twice its power.
    pub resistor_rating_w: Option<f64>,
    /// Current with that resistor, mA.
    pub current_ma: f64,
    /// Light with that resistor, mW.
    pub flux_mw: f64,
    /// Power in the resistor, mW.
    pub resistor_power_mw: f64,
    /// Power in the light, mW.
    pub light_power_mw: f64,
    /// Temperature of its board, degrees C.
    pub board_c: f64,
    /// Temperature of its junction, degrees C.
    pub junction_c: f64,
}

/// All lights and their sum.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Electrical {
    /// Voltage that all are fed from, V.
    pub supply_voltage_v: f64,
    /// The lights, in the order of `leds.list`.
    pub lights: Vec<LedCircuit>,
    /// Current of all, mA.
    pub total_current_ma: f64,
    /// Power of all with their resistors, mW.
    pub total_power_mw: f64,
    /// The part of it that stays in the sensor, mW.
    pub power_in_sensor_mw: f64,
    /// Temperature of the platform, degrees C.
    pub platform_c: f64,
}

impl ValueRgbw {
    /// The value for a light of that colour.
    pub fn of(&self, color: LedColor) -> f64 {
        match color {
            LedColor::Red => self.r,
            LedColor::Green => self.g,
            LedColor::Blue => self.b,
            LedColor::White => self.w,
        }
    }
}

impl LedColor {
    /// Its name in the design file.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Red => "red",
            Self::Green => "green",
            Self::Blue => "blue",
            Self::White => "white",
        }
    }

    /// Its key in a [`ValueRgbw`].
    pub(super) fn key(self) -> &'static str {
        match self {
            Self::Red => "r",
            Self::Green => "g",
            Self::Blue => "b",
            Self::White => "w",
        }
    }
}

/// The light that the design asks of one light, mW: a white one sends all three colours.
pub(super) fn asked_flux_mw(flux: &PowerRgb, color: LedColor) -> f64 {
    match color {
        LedColor::Red => flux.r,
        LedColor::Green => flux.g,
        LedColor::Blue => flux.b,
        LedColor::White => flux.r + flux.g + flux.b,
    }
}

/// The resistor that gives a light its flux exactly, ohm; `None` for a light that stays dark.
pub(super) fn ideal_resistor_ohm(section: &ElectricalSection, color: LedColor, flux_mw: f64) -> Option<f64> {
    let current_a = 1e-3 * flux_mw / section.radiant_efficacy_mw_per_ma.of(color);
    (current_a > 0.0).then(|| (section.supply_voltage_v - section.forward_voltage_v.of(color)) / current_a)
}

/// One light with its E24 resistor; temperatures follow when all are known.
pub(super) fn circuit(leds: &LedsSection, light: usize, led: &LedSection) -> LedCircuit {
    let section = &leds.electrical;
    let LedSection { color, azimuth_deg } = *led;
    let asked = asked_flux_mw(&leds.radiant_flux_mw, color);
    let forward_v = section.forward_voltage_v.of(color);
    let ideal = ideal_resistor_ohm(section, color, asked);
    let resistor = ideal.and_then(nearest_ohm);
    let current_ma = resistor.map_or(0.0, |ohm| 1e3 * (section.supply_voltage_v - forward_v) / ohm);
    let resistor_power_mw = resistor.map_or(0.0, |ohm| 1e-3 * current_ma * current_ma * ohm);
    LedCircuit {
        light,
        color,
        azimuth_deg,
        asked_flux_mw: asked,
        ideal_resistor_ohm: ideal,
        resistor_ohm: resistor,
        resistor_rating_w: resistor.and_then(|_| rating_w(1e-3 * resistor_power_mw)),
        current_ma,
        flux_mw: current_ma * section.radiant_efficacy_mw_per_ma.of(color),
        resistor_power_mw,
        light_power_mw: current_ma * forward_v,
        board_c: section.ambient_c,
        junction_c: section.ambient_c,
    }
}
