//! Which wire goes where, with which resistor.
//!
//! All lights are fed from one supply: supply, resistor, the light's anode wire, its cathode wire, ground. The boards have
//! no room for the resistors; they sit at the cable's end.

use std::fmt::Write as _;

use domecast_design::Design;
use domecast_design::electrical::{Electrical, LedCircuit};
use domecast_design::sections::LedColor;

/// One of a light's two wires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wire {
    /// To the resistor and the supply.
    Anode,
    /// To ground.
    Cathode,
}

impl Wire {
    /// The colour of its insulation: the anode's is the light's, all cathodes are black.
    pub fn color(self, light: LedColor) -> &'static str {
        match self {
            Self::Anode => light.as_str(),
            Self::Cathode => "black",
        }
    }
}

/// A line of the wiring table.
#[derive(Debug, Clone, PartialEq)]
pub struct WiringRow<'a> {
    /// The light's circuit.
    pub circuit: &'a LedCircuit,
    /// The hole of the upper platform that its wires leave by, or what they do without one.
    pub upper_hole: String,
    /// The hole of the lower platform.
    pub lower_hole: String,
}

/// The wiring, a row for each light.
pub fn rows<'a>(design: &Design, electrical: &'a Electrical) -> Vec<WiringRow<'a>> {
    let sections = design.sections();
    let lower = &sections.platforms.lower;
    let hole = |diameter_mm: f64, light: &LedCircuit, place: &str, without: &str| {
        if diameter_mm > 0.0 {
            format!("wire hole {} at {} degrees, {diameter_mm} mm, {place}", light.light, light.azimuth_deg)
        } else {
            without.to_owned()
        }
    };
    let row = |circuit: &'a LedCircuit| WiringRow {
        circuit,
        upper_hole: hole(
            sections.leds.wire_hole_diameter_mm,
            circuit,
            "in the floor of its pit",
            "none: over the pit's edge",
        ),
        lower_hole: hole(
            lower.wire_hole_diameter_mm,
            circuit,
            &format!("{} mm off the axis", lower.wire_hole_ring_radius_mm),
            "none: between the platforms",
        ),
    };
    electrical.lights.iter().map(row).collect()
}

/// The wiring table: a line for each light, then one for their sum.
pub(super) fn csv(design: &Design, electrical: &Electrical) -> String {
    let mut out = String::from(
        "light,color,azimuth_deg,current_ma,flux_mw,resistor_ohm,resistor_rating_w,resistor_at,anode_wire,cathode_wire,\
         wire_length_mm,upper_platform,lower_platform\n",
    );
    let length_mm = design.sections().leds.electrical.wire_length_mm;
    for row in rows(design, electrical) {
        let light = row.circuit;
        let or_none = |value: Option<f64>| value.map_or_else(|| "none".to_owned(), |value| value.to_string());
        let at = if light.resistor_ohm.is_some() { "cable's end, anode wire" } else { "stays dark" };
        let _ = writeln!(
            out,
            "{},{},{},{:.3},{:.3},{},{},\"{at}\",{},{},{length_mm},\"{}\",\"{}\"",
            light.light,
            light.color.as_str(),
            light.azimuth_deg,
            light.current_ma,
            light.flux_mw,
            or_none(light.resistor_ohm),
            or_none(light.resistor_rating_w),
            Wire::Anode.color(light.color),
            Wire::Cathode.color(light.color),
            row.upper_hole,
            row.lower_hole
        );
    }
    let flux_mw: f64 = electrical.lights.iter().map(|light| light.flux_mw).sum();
    let _ = writeln!(
        out,
        "all,,,{:.3},{flux_mw:.3},,,\"{} V supply, {:.1} mW\",,,,,",
        electrical.total_current_ma, electrical.supply_voltage_v, electrical.total_power_mw
    );
    out
}
