//! What lights cannot have: named by field, with a value that takes it away.

use serde_json::json;

use super::circuit::{Electrical, LedCircuit, asked_flux_mw, ideal_resistor_ohm};
use super::e24::{RANGE_OHM, nearest_ohm};
use crate::spec::sections::{ElectricalSection, LedColor, LedsSection};
use crate::spec::{Cure, DesignError, DesignWarning};

/// The E24 value may give more current than the ideal one by half of the series' widest step, 1.3 to 1.5; cures stay below it.
const BELOW: f64 = 0.9;
/// A forward voltage that is off by so much, V, as it is from light to light of one line, ...
const VOLTAGE_SPREAD_V: f64 = 0.1;
/// ... must not move the current by more than this share.
const MAX_CURRENT_SPREAD: f64 = 0.25;
/// Voltage that cures leave for the resistor, V.
const HEADROOM_V: f64 = 1.0;

fn field(name: &str) -> String {
    format!("leds.electrical.{name}")
}

/// The colours of the lights, each once.
fn colors(leds: &LedsSection) -> Vec<LedColor> {
    let mut found: Vec<LedColor> = Vec::new();
    for led in &leds.list {
        if !found.contains(&led.color) {
            found.push(led.color);
        }
    }
    found
}

/// A number for a file: three digits, rounded downwards but for what binary fractions leave.
fn floored(value: f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let places = 2 - value.log10().floor() as i32;
    let digits = (value * 10f64.powi(places) + 1e-6).floor();
    if places > 0 { digits / 10f64.powi(places) } else { digits * 10f64.powi(-places) }
}

/// The flux of one colour, or of all where the light is white, times a factor.
fn dimmed(leds: &LedsSection, color: LedColor, factor: f64) -> Cure {
    let flux = &leds.radiant_flux_mw;
    match color {
        LedColor::White => dimmed_all(leds, factor),
        _ => Cure::value(
            format!("leds.radiant_flux_mw.{}", color.key()),
            json!(floored(factor * asked_flux_mw(flux, color))),
        ),
    }
}

fn dimmed_all(leds: &LedsSection, factor: f64) -> Cure {
    let [r, g, b] = leds.radiant_flux_mw.to_array().map(|flux| floored(factor * flux));
    Cure::value("leds.radiant_flux_mw", json!({ "r": r, "g": g, "b": b }))
}

/// What stands in the way of any circuit.
pub(super) fn of_inputs(leds: &LedsSection) -> Vec<DesignError> {
    let section = &leds.electrical;
    let mut faults = Vec::new();
    let lit: Vec<LedColor> =
        colors(leds).into_iter().filter(|color| asked_flux_mw(&leds.radiant_flux_mw, *color) > 0.0).collect();
    let highest_v = lit.iter().map(|color| section.forward_voltage_v.of(*color)).fold(0.0, f64::max);
    if section.supply_voltage_v <= highest_v {
        let name = lit.iter().find(|color| section.forward_voltage_v.of(**color) >= section.supply_voltage_v);
        faults.push(
            DesignError::at(
                field("supply_voltage_v"),
                section.supply_voltage_v,
                format!("the supply drives no current through a {} light", name.map_or("", |c| c.as_str())),
                format!("more than its forward voltage, {highest_v} V"),
            )
            .with_cure(Cure::value(
                field("supply_voltage_v"),
                json!((10.0 * (highest_v + HEADROOM_V)).ceil() / 10.0),
            )),
        );
        return faults;
    }
    for color in lit {
        let forward_v = section.forward_voltage_v.of(color);
        let efficacy = section.radiant_efficacy_mw_per_ma.of(color);
        if efficacy >= forward_v {
            let path = field(&format!("radiant_efficacy_mw_per_ma.{}", color.key()));
            faults.push(
                DesignError::at(
                    path.clone(),
                    efficacy,
                    "the light would send more power than it takes",
                    format!("less than its forward voltage, {forward_v} (mW/mA is V)"),
                )
                .with_cure(Cure::value(path, json!(floored(0.4 * forward_v)))),
            );
            continue;
        }
        faults.extend(no_resistor(leds, color));
    }
    faults
}

/// A resistor that nobody sells.
fn no_resistor(leds: &LedsSection, color: LedColor) -> Option<DesignError> {
    let section = &leds.electrical;
    let flux_mw = asked_flux_mw(&leds.radiant_flux_mw, color);
    let ideal_ohm = ideal_resistor_ohm(section, color, flux_mw)?;
    if nearest_ohm(ideal_ohm).is_some() {
        return None;
    }
    let [low, high] = RANGE_OHM;
    let (at, value, cure) = if ideal_ohm < low {
        let supply = (10.0 * (section.forward_voltage_v.of(color) + HEADROOM_V)).ceil() / 10.0;
        // a supply that is high enough leaves too much current
        let cure = if supply > section.supply_voltage_v {
            Cure::value(field("supply_voltage_v"), json!(supply))
        } else {
            dimmed(leds, color, BELOW * ideal_ohm / low)
        };
        (field("supply_voltage_v"), section.supply_voltage_v, cure)
    } else {
        let path = match color {
            LedColor::White => "leds.radiant_flux_mw".to_owned(),
            _ => format!("leds.radiant_flux_mw.{}", color.key()),
        };
        (path, flux_mw, dimmed(leds, color, 2.0 * ideal_ohm / high))
    };
    let problem = format!("a {} light needs a resistor of {ideal_ohm:.3e} ohm", color.as_str());
    Some(DesignError::at(at, value, problem, format!("{low} to {high} ohm")).with_cure(cure))
}

/// What the circuits break.
pub(super) fn of_circuits(leds: &LedsSection, found: &Electrical) -> Vec<DesignError> {
    let section = &leds.electrical;
    let mut faults = Vec::new();
    for color in colors(leds) {
        let Some(light) = found.lights.iter().find(|light| light.color == color) else { continue };
        let limit_ma = section.max_current_ma.of(color);
        if light.current_ma > limit_ma {
            faults.push(
                DesignError::at(
                    field(&format!("max_current_ma.{}", color.key())),
                    limit_ma,
                    format!(
                        "a {} light of {} mW takes {:.1} mA",
                        color.as_str(),
                        light.asked_flux_mw,
                        light.current_ma
                    ),
                    format!("at most {limit_ma} mA"),
                )
                .with_cure(dimmed(leds, color, BELOW * limit_ma / ideal_ma(section, light))),
            );
        }
        if light.resistor_ohm.is_some() && light.resistor_rating_w.is_none() {
            let forward_v = section.forward_voltage_v.of(color);
            faults.push(
                DesignError::at(
                    field("supply_voltage_v"),
                    section.supply_voltage_v,
                    format!(
                        "the resistor of a {} light burns {:.2} W",
                        color.as_str(),
                        1e-3 * light.resistor_power_mw
                    ),
                    "at most 1 W, half of what a 2 W resistor bears",
                )
                .with_cure(Cure::value(
                    field("supply_voltage_v"),
                    json!((10.0 * (forward_v + HEADROOM_V)).ceil() / 10.0),
                )),
            );
        }
    }
    faults.extend(too_hot(leds, found));
    faults
}

fn ideal_ma(section: &ElectricalSection, light: &LedCircuit) -> f64 {
    light.asked_flux_mw / section.radiant_efficacy_mw_per_ma.of(light.color)
}

fn too_hot(leds: &LedsSection, found: &Electrical) -> Option<DesignError> {
    let section = &leds.electrical;
    let hottest = found.lights.iter().max_by(|a, b| a.junction_c.total_cmp(&b.junction_c))?;
    if hottest.junction_c <= section.max_junction_c {
        return None;
    }
    let fault = DesignError::at(
        field("max_junction_c"),
        section.max_junction_c,
        format!(
            "the junction of light {} ({}) gets {:.0} degrees C, its board {:.0}",
            hottest.light,
            hottest.color.as_str(),
            hottest.junction_c,
            hottest.board_c
        ),
        format!("at most {} degrees C", section.max_junction_c),
    );
    // all warming grows with the current
    let share = (section.max_junction_c - section.ambient_c) / (hottest.junction_c - section.ambient_c);
    Some(if share > 0.0 {
        fault.with_cure(dimmed_all(leds, BELOW * share))
    } else {
        fault.with_help("ambient_c alone is above it")
    })
}

/// What does not stop a build.
pub(super) fn warnings(leds: &LedsSection, found: &Electrical) -> Vec<DesignWarning> {
    let section = &leds.electrical;
    let mut notes = Vec::new();
    let hottest = found.lights.iter().max_by(|a, b| a.board_c.total_cmp(&b.board_c));
    if let Some(light) = hottest.filter(|light| light.board_c > section.max_board_c) {
        notes.push(DesignWarning {
            field: field("max_board_c"),
            message: format!(
                "The board of light {} ({}) gets {:.0} degrees C where the platform bears {}: less leds.radiant_flux_mw, more \
                 lights, or a larger board",
                light.light,
                light.color.as_str(),
                light.board_c,
                section.max_board_c
            ),
        });
    }
    for color in colors(leds) {
        let headroom_v = section.supply_voltage_v - section.forward_voltage_v.of(color);
        let spread = VOLTAGE_SPREAD_V / headroom_v;
        let is_lit = found.lights.iter().any(|light| light.color == color && light.resistor_ohm.is_some());
        if is_lit && spread > MAX_CURRENT_SPREAD {
            notes.push(DesignWarning {
                field: field("supply_voltage_v"),
                message: format!(
                    "{headroom_v:.2} V are left for the resistor of a {} light: {VOLTAGE_SPREAD_V} V of forward voltage \
                     move its current by {:.0} %",
                    color.as_str(),
                    100.0 * spread
                ),
            });
        }
    }
    notes
}
