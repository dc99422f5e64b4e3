//! Ohm's law, heat, refusals and the board's rules, over varied lights.
use serde_json::{Value, json};

use super::*;

/// Values by JSON pointer.
type Changes = Vec<(&'static str, Value)>;

/// The lights of thumb24, with changes by JSON pointer.
fn leds(changes: &[(&str, Value)]) -> LedsSection {
    let mut design: Value = serde_json::from_str(include_str!("../../../designs/thumb24.json")).unwrap();
    for (pointer, value) in changes {
        *design.pointer_mut(&format!("/leds{pointer}")).unwrap_or_else(|| panic!("{pointer}")) =
            value.clone();
    }
    serde_json::from_value(design["leds"].clone()).unwrap()
}

fn solved(changes: &[(&str, Value)]) -> Electrical {
    Electrical::of_leds(&leds(changes)).unwrap().unwrap()
}

#[test]
fn every_circuit_keeps_ohms_law_and_its_energy() {
    for supply_v in [3.3, 5.0, 12.0] {
        for flux in [0.5, 3.0, 20.0, 60.0] {
            let changes = [
                ("/electrical/supply_voltage_v", json!(supply_v)),
                ("/radiant_flux_mw", json!({ "r": flux, "g": flux, "b": 0.5 * flux })),
            ];
            let section = leds(&changes).electrical;
            let found = solved(&changes);
            for light in &found.lights {
                let (ohm, current_a) = (light.resistor_ohm.unwrap(), 1e-3 * light.current_ma);
                let forward_v = section.forward_voltage_v.of(light.color);
                assert!((ohm * current_a + forward_v - supply_v).abs() < 1e-12, "{light:?}");
                let power_mw = light.resistor_power_mw + light.light_power_mw;
                assert!((power_mw - supply_v * light.current_ma).abs() < 1e-9, "{light:?}");
                // a step of E24 is at most 1.5 / 1.3
                let ratio = light.flux_mw / light.asked_flux_mw;
                assert!(ratio.ln().abs() <= 0.5 * (1.5f64 / 1.3).ln() + 1e-12, "{light:?}");
                let heat_w = 1e-3 * (light.light_power_mw - light.flux_mw);
                let rise_k = section.junction_to_board_k_per_w + section.board_to_platform_k_per_w;
                assert!((light.junction_c - found.platform_c - rise_k * heat_w).abs() < 1e-9, "{light:?}");
                assert!(light.resistor_rating_w.unwrap() >= 2e-3 * light.resistor_power_mw);
            }
            let sum: f64 = found.lights.iter().map(|light| light.current_ma).sum();
            assert_eq!(found.total_current_ma, sum);
            assert!((found.total_power_mw - supply_v * sum).abs() < 1e-9);
        }
    }
}

#[test]
fn a_white_light_sends_all_three_colours() {
    let found = solved(&[
        ("/list", json!([{ "color": "white", "azimuth_deg": 30 }])),
        ("/radiant_flux_mw", json!({ "r": 5, "g": 7, "b": 9 })),
    ]);
    let light = &found.lights[0];
    assert_eq!(light.asked_flux_mw, 21.0);
    // 21 mW at 0.91 mW/mA through what 2.7 V leave of 5 V
    assert!((light.ideal_resistor_ohm.unwrap() - 1000.0 * 2.3 / (21.0 / 0.91)).abs() < 1e-9);
    assert_eq!(light.resistor_ohm, Some(100.0));
}

#[test]
fn without_lights_or_with_drivers_of_their_own_there_are_no_circuits() {
    assert_eq!(Electrical::of_leds(&leds(&[("/list", json!([]))])), Ok(None));
    assert_eq!(Electrical::of_leds(&leds(&[("/electrical/drive", json!("own_driver"))])), Ok(None));
    // a light without flux stays dark and needs nothing
    let found = solved(&[("/radiant_flux_mw/g", json!(0))]);
    assert_eq!((found.lights[1].current_ma, found.lights[1].resistor_ohm), (0.0, None));
    assert!(found.lights[0].current_ma > 0.0);
}

/// Each refusal names its field, and its cure takes it away.
#[test]
fn what_cannot_be_is_named_and_cured() {
    let many = |count: usize| {
        let list: Vec<Value> =
            (0..count).map(|i| json!({ "color": "green", "azimuth_deg": 15 * i })).collect();
        json!(list)
    };
    let cases: [(&str, &str, Changes); 9] = [
        ("supply_voltage_v", "drives no current", vec![("/electrical/supply_voltage_v", json!(2.5))]),
        ("supply_voltage_v", "drives no current", vec![("/electrical/supply_voltage_v", json!(2.7))]),
        ("supply_voltage_v", "a resistor of", vec![("/electrical/supply_voltage_v", json!(2.701))]),
        ("max_current_ma.g", "takes", vec![("/electrical/max_current_ma/g", json!(20))]),
        ("max_current_ma.b", "takes", vec![("/electrical/max_current_ma/b", json!(5))]),
        (
            "max_junction_c",
            "degrees C",
            vec![("/electrical/board_to_platform_k_per_w", json!(3000)), ("/list", many(24))],
        ),
        (
            "radiant_efficacy_mw_per_ma.r",
            "more power than it takes",
            vec![("/electrical/radiant_efficacy_mw_per_ma/r", json!(2.0))],
        ),
        (
            "supply_voltage_v",
            "burns",
            vec![
                ("/electrical/supply_voltage_v", json!(48)),
                ("/electrical/board_to_platform_k_per_w", json!(10)),
            ],
        ),
        ("leds.radiant_flux_mw.r", "a resistor of", vec![("/radiant_flux_mw/r", json!(1e-5))]),
    ];
    for (field, says, changes) in cases {
        let mut given = leds(&changes);
        let fault = Electrical::of_leds(&given).expect_err(field);
        assert!(fault.field.ends_with(field), "{field}: {fault}");
        assert!(fault.problem.contains(says) && !fault.allowed.is_empty(), "{fault}");
        // the first fault's cure, then that of what is left, until nothing is
        let mut left = Some(fault);
        for _ in 0..4 {
            let Some(fault) = left else { break };
            let cure = *fault.cure.clone().unwrap_or_else(|| panic!("no cure: {fault}"));
            let mut tree = serde_json::to_value(&given).unwrap();
            let pointer = cure.field.trim_start_matches("leds").replace('.', "/");
            *tree.pointer_mut(&pointer).unwrap() = cure.value;
            given = serde_json::from_value(tree).unwrap();
            left = Electrical::of_leds(&given).err();
            if let Some(next) = &left {
                assert_ne!(next.kind(), fault.kind(), "the cure did not help: {fault}");
            }
        }
        assert!(left.is_none(), "{left:?}");
    }
}

#[test]
fn hot_boards_and_little_headroom_are_warnings() {
    let warned = |changes: &[(&str, Value)]| {
        let leds = leds(changes);
        let found = Electrical::of_leds(&leds).unwrap().unwrap();
        found.warnings(&leds).into_iter().map(|warning| warning.field).collect::<Vec<_>>()
    };
    assert_eq!(warned(&[]), Vec::<String>::new());
    let hot = warned(&[("/radiant_flux_mw/g", json!(60))]);
    assert_eq!(hot, ["leds.electrical.max_board_c"]);
    let low = warned(&[("/electrical/supply_voltage_v", json!(3.0))]);
    assert_eq!(low, ["leds.electrical.supply_voltage_v"], "0.3 V are left for blue");
}

fn sides(rect: BoardRect) -> glam::DVec2 {
    rect[1] - rect[0]
}

/// Distance of two rectangles, mm; 0 where they meet.
fn apart(a: BoardRect, b: BoardRect) -> f64 {
    (a[0] - b[1]).max(b[0] - a[1]).max(glam::DVec2::ZERO).length()
}

#[test]
fn boards_of_many_sizes_keep_their_makers_limits() {
    const ROUNDING: f64 = 1e-9;
    let mut drawn = 0;
    for package in [[1.0, 0.5], [1.6, 0.8], [2.0, 2.0], [3.0, 1.4]] {
        for wide in [2.0, 3.0, 3.6, 4.4, 6.0, 12.0] {
            for high in [1.0, 1.6, 2.0, 3.0, 5.0, 9.0] {
                for offset in [-1.0, 0.0, 0.4] {
                    let land = [0.4 * package[0], 0.8 * package[1]];
                    let given = leds(&[
                        ("/package_mm", json!(package)),
                        ("/board_mm", json!([wide, high])),
                        ("/board_offset_mm", json!(offset)),
                        ("/electrical/board/land_mm", json!(land)),
                        ("/electrical/board/land_pitch_mm", json!(0.6 * package[0])),
                    ]);
                    let limits = &given.electrical.board;
                    let board = match LedBoard::of(&given) {
                        Ok(board) => board,
                        Err(warning) => {
                            assert!(
                                warning.message.starts_with("No board is drawn: "),
                                "{}",
                                warning.message
                            );
                            continue;
                        }
                    };
                    drawn += 1;
                    let name = format!("{package:?} on {wide} x {high}, {offset}");
                    let edge = 0.5 * board.size_mm - limits.min_edge_mm + ROUNDING;
                    for (i, pad) in board.pads.iter().enumerate() {
                        assert!(
                            pad.rect_mm[0].cmpge(-edge).all() && pad.rect_mm[1].cmple(edge).all(),
                            "{name}"
                        );
                        for other in &board.pads[..i] {
                            let gap = apart(pad.rect_mm, other.rect_mm);
                            assert!(gap >= limits.min_gap_mm - ROUNDING, "{name}: {gap}");
                        }
                        if pad.is_for_wire {
                            assert!(
                                sides(pad.rect_mm).min_element() >= limits.min_wire_pad_mm - ROUNDING,
                                "{name}"
                            );
                            assert!(
                                apart(pad.rect_mm, board.package_mm) >= limits.min_gap_mm - ROUNDING,
                                "{name}"
                            );
                        }
                    }
                    let half = glam::DVec2::splat(0.5 * board.track_mm);
                    for (net, corners) in board.tracks_mm.iter().enumerate() {
                        for ends in corners.windows(2) {
                            let leg = [ends[0].min(ends[1]) - half, ends[0].max(ends[1]) + half];
                            assert!(leg[0].cmpge(-edge).all() && leg[1].cmple(edge).all(), "{name}: {leg:?}");
                            for pad in board.pads.iter().filter(|pad| pad.net != net) {
                                assert!(apart(leg, pad.rect_mm) >= limits.min_gap_mm - ROUNDING, "{name}");
                            }
                        }
                    }
                    let silk = glam::DVec2::splat(0.5 * board.silk_line_mm);
                    for line in &board.silk_mm {
                        let ink = [line[0].min(line[1]) - silk, line[0].max(line[1]) + silk];
                        assert!(ink[0].cmpge(-0.5 * board.size_mm).all(), "{name}: {ink:?}");
                        assert!(ink[1].cmple(0.5 * board.size_mm).all(), "{name}: {ink:?}");
                        for opening in board.mask_openings_mm() {
                            assert!(apart(ink, opening) > 0.0, "{name}: ink on a pad");
                        }
                    }
                }
            }
        }
    }
    assert!(drawn > 150, "{drawn} boards were drawn");
}

#[test]
fn a_board_without_room_says_how_much_it_takes() {
    let given = leds(&[("/board_mm", json!([2.4, 2.0]))]);
    let warning = LedBoard::of(&given).unwrap_err();
    assert_eq!(warning.field, "leds.board_mm");
    let (_, after) = warning.message.split_once("2 x 2 mm: ").unwrap();
    let wide: f64 = after.split(' ').next().unwrap().parse().unwrap();
    assert!(LedBoard::of(&leds(&[("/board_mm", json!([wide, 2.0]))])).is_ok(), "{}", warning.message);
    assert!(LedBoard::of(&leds(&[("/board_mm", json!([wide - 0.02, 2.0]))])).is_err());
    let touching = leds(&[("/electrical/board/land_pitch_mm", json!(0.9))]);
    assert_eq!(LedBoard::of(&touching).unwrap_err().field, "leds.electrical.board.land_pitch_mm");
}
