//! What drives the lights, and the boards that they stand on.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Why;

/// A value for each kind of light: red, green, blue, white.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ValueRgbw {
    /// Of a red light.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e5))]
    pub r: f64,
    /// Of a green light.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e5))]
    pub g: f64,
    /// Of a blue light.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e5))]
    pub b: f64,
    /// Of a white light.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e5))]
    pub w: f64,
}

/// What sets the current of a light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LedDrive {
    /// A resistor in series with each light, at the cable's end.
    Resistor,
    /// A driver inside the package, as addressable lights have it: no resistor, and no board with two pads.
    OwnDriver,
}

/// What drives the lights, how warm they get, and the board of one light. A white light is one light with two wires: its
/// current is that of the three fluxes' sum.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ElectricalSection {
    /// What sets the current.
    pub drive: LedDrive,
    /// Voltage that all lights are fed from, each with its own resistor, V.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 60.0))]
    pub supply_voltage_v: f64,
    /// Forward voltage of a light at the current that it gets, V.
    pub forward_voltage_v: ValueRgbw,
    /// Light for each milliampere, mW/mA, at the current that it gets; of a white light the sum of its three colours.
    pub radiant_efficacy_mw_per_ma: ValueRgbw,
    /// Largest direct current that the light's maker allows, mA.
    pub max_current_ma: ValueRgbw,
    /// Thermal resistance from junction to board, K/W.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub junction_to_board_k_per_w: f64,
    /// Thermal resistance from a board to the platform round it, K/W.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub board_to_platform_k_per_w: f64,
    /// Thermal resistance from the platform to the air, for the heat of all lights, K/W.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub platform_to_air_k_per_w: f64,
    /// Temperature of the platform while the lights are off, degrees C.
    #[schemars(range(min = -100.0, max = 300.0))]
    pub ambient_c: f64,
    /// Highest junction temperature that the light's maker allows, degrees C; beyond it the build stops.
    #[schemars(range(min = -100.0, max = 500.0))]
    pub max_junction_c: f64,
    /// Highest temperature of a board that the platform bears, degrees C; beyond it the build warns.
    #[schemars(range(min = -100.0, max = 500.0))]
    pub max_board_c: f64,
    /// Length of each of a light's two wires, from the board to the cable's end, mm.
    #[schemars(range(min = 0.0, max = 1e5))]
    pub wire_length_mm: f64,
    /// The board's copper, and what its maker can make.
    pub board: LedBoardSection,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// The copper of a light's board, and the limits of who makes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LedBoardSection {
    /// Sides of each of the light's two lands, across and along the board's height, mm.
    pub land_mm: [f64; 2],
    /// Distance of the middles of the two lands, which lie side by side across the board, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub land_pitch_mm: f64,
    /// Smallest side of a pad that a wire is soldered to, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub min_wire_pad_mm: f64,
    /// Least distance of copper from the board's edge, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub min_edge_mm: f64,
    /// Least distance of copper from other copper, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 10.0))]
    pub min_gap_mm: f64,
    /// How far the solder mask stays off the pads, mm.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub mask_margin_mm: f64,
    /// Thinnest line of the silkscreen, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 10.0))]
    pub silk_line_mm: f64,
    /// Smallest side of a board that is cut singly, mm; smaller ones are ordered in a panel.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub min_single_mm: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}
