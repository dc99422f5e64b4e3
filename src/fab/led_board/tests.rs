//! The files of the lights over varied designs: which there are, that they agree, and that they are the same each time.
use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::*;

fn design(name: &str, changes: &[(&str, Value)]) -> Design {
    let path = format!("{}/../../designs/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let mut tree: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    for (pointer, value) in changes {
        *tree.pointer_mut(pointer).unwrap_or_else(|| panic!("{pointer}")) = value.clone();
    }
    tree.to_string().parse().unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn files(design: &Design) -> BTreeMap<String, String> {
    let made = Lights::of(design).unwrap().files(design).unwrap();
    made.into_iter().map(|(path, bytes)| (path, String::from_utf8_lossy(&bytes).into_owned())).collect()
}

#[test]
fn every_shipped_design_has_a_board_and_a_wiring_table() {
    let names = ["thumb24", "thumb24-fisheye", "thumb24-wide", "digit-rigid", "picam-r20", "endoscope-r5"];
    for name in names {
        let design = design(name, &[]);
        let files = files(&design);
        assert_eq!(files.len(), 11, "{name}: {:?}", files.keys());
        assert_eq!(files, self::files(&design), "{name}: the same design gives the same bytes");
        let lights = design.sections().leds.list.len();
        let table = &files["parts/led_wiring.csv"];
        assert_eq!(table.lines().count(), lights + 2, "{name}: {table}");
        let columns = table.lines().next().unwrap().split(',').count();
        // cells in quotes hold one comma each
        let cells = |line: &str| line.split(',').count() - line.matches(", ").count();
        assert!(table.lines().all(|line| cells(line) == columns), "{name}: {table}");
        let rigid = design.is_rigid();
        assert_eq!(table.contains("none: between the platforms"), rigid, "{name}");
    }
}

#[test]
fn lights_that_differ_in_kind_have_other_files() {
    let count = |changes: &[(&str, Value)]| files(&design("thumb24", changes)).len();
    assert_eq!(count(&[("/leds/list", json!([]))]), 0);
    assert_eq!(count(&[("/leds/electrical/drive", json!("own_driver"))]), 0);
    assert_eq!(count(&[("/leds/list/0/color", json!("white"))]), 11);
    // lands that touch: the circuits, and no board
    let touching = [("/leds/electrical/board/land_pitch_mm", json!(0.9))];
    assert_eq!(count(&touching), 2);
    let lights = Lights::of(&design("thumb24", &touching)).unwrap();
    assert_eq!(lights.warnings.len(), 1);
    // where the lights point to is no matter of their boards
    let tilted = files(&design("thumb24", &[("/leds/tilt_deg", json!(70))]));
    assert_eq!(tilted, files(&design("thumb24", &[])));
}

#[test]
fn gerber_and_kicad_say_the_same_of_any_board() {
    for board_mm in [[4.4f64, 2.0], [5.123, 2.5], [3.6, 2.0], [3.0, 4.6]] {
        let design = design("thumb24", &[("/leds/board_mm", json!(board_mm))]);
        let lights = Lights::of(&design).unwrap();
        let board = lights.board.as_ref().unwrap_or_else(|| panic!("{:?}", lights.warnings));
        let files = files(&design);
        let profile = &files["parts/led_board-Edge_Cuts.gbr"];
        let corner = format!("X{}Y{}D01*", (board_mm[0] * 1e6).round(), (board_mm[1] * 1e6).round());
        assert!(profile.contains(&corner), "{corner} in {profile}");
        let pcb = &files["parts/led_board.kicad_pcb"];
        assert_eq!(pcb.matches('(').count(), pcb.matches(')').count());
        // a flash of the copper for each pad, with the place that KiCad has for it
        let copper = &files["parts/led_board-F_Cu.gbr"];
        assert_eq!(copper.matches("D03*").count(), board.pads.len());
        for pad in board.pads.iter().filter(|pad| pad.is_for_wire) {
            let middle = 0.5 * (pad.rect_mm[0] + pad.rect_mm[1]);
            let nm = ((middle + 0.5 * board.size_mm) * 1e6).round();
            assert!(copper.contains(&format!("X{}Y{}D03*", nm.x, nm.y)), "{nm} in {copper}");
            let rounded = |x: f64| domecast_mesh::number::rounded(x, 6);
            let at = format!("(at {} {})", rounded(100.0 + middle.x), rounded(100.0 - middle.y));
            assert!(pcb.contains(&at), "{at} in {pcb}");
        }
    }
}
