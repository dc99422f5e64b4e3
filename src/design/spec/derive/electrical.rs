//! What drives the lights, how warm they get, and their boards.
//!
//! Data sheets state lights at 20 or 350 mA and at a junction of 25 or 85 degrees C; a sensor drives them with 10 to 50 mA,
//! nearly cold. The values here are estimates for that: measure yours, or take them from its data sheet's curves.

use std::f64::consts::PI;

use super::known::Known;
use super::rule::{Rule, fixed, follows};

const AS_BLUE: &str = "as a blue light's: a white one is a blue one under a phosphor";

pub(super) const CIRCUIT: &[Rule] = &[
    fixed("leds.electrical.drive", "\"resistor\"", "a resistor in series with each light"),
    fixed("leds.electrical.supply_voltage_v", "5", "what USB gives, as the camera has it"),
    fixed(
        "leds.electrical.forward_voltage_v.r",
        "1.8",
        "estimate: red AlInGaP at 25 mA; Lumileds DS144 (LUXEON C Color Line, 2015) has 2.0 V at 350 mA",
    ),
    fixed(
        "leds.electrical.forward_voltage_v.g",
        "2.4",
        "estimate: green InGaN at 25 mA; Lumileds DS144 (LUXEON C Color Line, 2015) has 2.55 V at 350 mA",
    ),
    fixed(
        "leds.electrical.forward_voltage_v.b",
        "2.7",
        "estimate: blue InGaN at 15 mA; Lumileds DS144 (LUXEON C Color Line, 2015) has 2.9 V at 350 mA",
    ),
    follows("leds.electrical.forward_voltage_v.w", AS_BLUE, |k| {
        k.number(k.n("leds.electrical.forward_voltage_v.b"))
    }),
    fixed(
        "leds.electrical.radiant_efficacy_mw_per_ma.r",
        "0.8",
        "estimate: the photon's energy times an external quantum efficiency, 1.98 eV x 0.4 at 625 nm",
    ),
    fixed(
        "leds.electrical.radiant_efficacy_mw_per_ma.g",
        "0.8",
        "estimate: the photon's energy times an external quantum efficiency, 2.34 eV x 0.35 at 530 nm",
    ),
    fixed(
        "leds.electrical.radiant_efficacy_mw_per_ma.b",
        "1.3",
        "estimate: the photon's energy times an external quantum efficiency, 2.64 eV x 0.5 at 470 nm",
    ),
    follows(
        "leds.electrical.radiant_efficacy_mw_per_ma.w",
        "estimate: 0.7 of a blue light's, the rest stays in the phosphor",
        |k| k.number(0.7 * k.n("leds.electrical.radiant_efficacy_mw_per_ma.b")),
    ),
    fixed(
        "leds.electrical.max_current_ma.r",
        "350",
        "what lights of 2 x 2 mm are measured at, a third of what they bear (Lumileds DS144, 2015); heat has its own limits",
    ),
    fixed("leds.electrical.max_current_ma.g", "350", "as a red light's"),
    fixed("leds.electrical.max_current_ma.b", "350", "as a red light's"),
    follows("leds.electrical.max_current_ma.w", AS_BLUE, |k| {
        k.number(k.n("leds.electrical.max_current_ma.b"))
    }),
    fixed(
        "leds.electrical.wire_length_mm",
        "300",
        "from the board through both platforms to the cable's end",
    ),
];

/// Heat that printed resin conducts, W/(m K): 0.2, usual for acrylic polymers.
const RESIN_W_PER_M_K: f64 = 0.2;
/// Heat that a small body gives to still air by convection and radiation, W/(m^2 K): 10, usual for faces of some centimetres.
const STILL_AIR_W_PER_M2_K: f64 = 10.0;
/// What a board's two wires carry away, W/K: long fins, `2 sqrt(h pi D k A)`, of copper (k 400 W/(m K)) 0.25 mm thick in insulation
/// 0.8 mm wide, in air that takes 15 W/(m^2 K) from so thin a body.
const TWO_WIRES_W_PER_K: f64 = 1.7e-3;

pub(super) const HEAT: &[Rule] = &[
    fixed(
        "leds.electrical.junction_to_board_k_per_w",
        "10",
        "estimate: three times the 2.8 to 3.5 K/W to the solder pad (Lumileds DS144, 2015), for solder and thin copper",
    ),
    follows(
        "leds.electrical.board_to_platform_k_per_w",
        "estimate, within a factor of two: 1 / (8 k r + 1.7 mW/K), a warm disc of the board's area inside resin, k = 0.2 W/(m K) \
         (Carslaw and Jaeger), and two wires as fins",
        |k| {
            let area_mm2 = k.at("leds.board_mm", 0) * k.at("leds.board_mm", 1);
            let radius_m = 1e-3 * (area_mm2 / PI).sqrt();
            k.number(tenth(1.0 / (8.0 * RESIN_W_PER_M_K * radius_m + TWO_WIRES_W_PER_K)))
        },
    ),
    follows(
        "leds.electrical.platform_to_air_k_per_w",
        "estimate: 1 / (h A), h = 10 W/(m^2 K) in still air, A the envelope's top and sides",
        |k| {
            let [x, y, z] = [0, 1, 2].map(|axis| k.at("envelope.size_mm", axis));
            let area_m2 = 1e-6 * (x * y + 2.0 * (x + y) * z);
            k.number(tenth(1.0 / (STILL_AIR_W_PER_M2_K * area_m2)))
        },
    ),
    fixed("leds.electrical.ambient_c", "25", "a room; a camera that warms the platform adds to it"),
    fixed(
        "leds.electrical.max_junction_c",
        "120",
        "the least that the lines of Lumileds DS144 (2015) allow: red ones",
    ),
    fixed(
        "leds.electrical.max_board_c",
        "50",
        "estimate: printed acrylic resins soften from 45 to 50 degrees C on (heat deflection temperature)",
    ),
];

pub(super) const BOARD: &[Rule] = &[
    follows(
        "leds.electrical.board.land_mm",
        "estimate: 0.4 of the package's width and 0.8 of its height; take them from the light's data sheet",
        |k| k.numbers(&[0.4 * package(k, 0), 0.8 * package(k, 1)]),
    ),
    follows(
        "leds.electrical.board.land_pitch_mm",
        "estimate: 0.6 of the package's width, so that a fifth of it is free between the lands",
        |k| k.number(0.6 * package(k, 0)),
    ),
    fixed("leds.electrical.board.min_wire_pad_mm", "0.4", "a thin wire, 0.25 mm of strands, and its solder"),
    fixed("leds.electrical.board.min_edge_mm", "0.2", "usual where boards are cut by a router"),
    fixed("leds.electrical.board.min_gap_mm", "0.15", "usual for pooled boards"),
    fixed("leds.electrical.board.mask_margin_mm", "0.05", "usual for pooled boards"),
    fixed("leds.electrical.board.silk_line_mm", "0.15", "usual for pooled boards"),
    fixed(
        "leds.electrical.board.min_single_mm",
        "5",
        "estimate: smaller boards fall through the router's table",
    ),
];

fn package(k: &Known<'_>, axis: usize) -> f64 {
    k.at("leds.package_mm", axis)
}

fn tenth(value: f64) -> f64 {
    (10.0 * value).round() / 10.0
}
