//! Cameras on boards: sound as shipped, and each broken seat refused with what takes the fault away.

use serde_json::{Value, json};

use super::super::board_seat;
use super::seats::{refused_tree, set, verdict};
use super::*;

fn picam(edits: &[(&str, Value)]) -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/picam-r20.json");
    let design = Design::load(Path::new(path)).unwrap();
    // The text of a read design has the catalogue's numbers in it.
    let mut tree: Value = serde_json::from_str(design.text()).unwrap();
    set(&mut tree, "mesh", json!({ "chord_tolerance_mm": 0.03, "optical_chord_tolerance_mm": 0.05 }));
    set(&mut tree, "envelope.size_mm", json!([120, 120, 120]));
    for (field, value) in edits {
        set(&mut tree, field, value.clone());
    }
    tree
}

#[track_caller]
fn refused(field: &str, words: &[&str], edits: &[(&str, Value)]) {
    refused_tree(field, words, picam(edits));
}

#[test]
fn the_shipped_board_is_held() {
    let checked = verdict(&picam(&[])).unwrap_or_else(|faults| panic!("{faults:#?}"));
    assert!(checked.sight.iter().flat_map(|pose| &pose.counts).all(|count| count.blocked == 0));
    assert!(checked.notes.is_empty(), "{:?}", checked.notes);
    // A ribbon that has to turn is a note.
    let turned = verdict(&picam(&[("platforms.lower.cable_exit.azimuth_deg", json!(270))]));
    let notes = turned.unwrap_or_else(|faults| panic!("{faults:#?}")).notes;
    assert!(notes.iter().any(|note| note.message.contains("turn by 180")), "{notes:?}");
}

#[test]
fn a_board_that_does_not_fit_is_refused() {
    let sizes = json!([64.0, 30.0]);
    refused(
        "platforms.outer_mm",
        &["wall beside the board's pocket"],
        &[("camera_body.board.size_mm", sizes)],
    );
    refused(
        "camera.position_mm[2]",
        &["block above the board"],
        &[("camera_body.board.front_components_height_mm", json!(50))],
    );
    refused(
        "platforms.lower.underside_z_mm",
        &["room below the board"],
        &[("platforms.lower.underside_z_mm", json!(-63)), ("platforms.lower.cable_exit.height_mm", json!(1))],
    );
    refused(
        "platforms.lower.cable_exit.height_mm",
        &["would cut the posts"],
        &[("platforms.lower.cable_exit.height_mm", json!(6))],
    );
    refused(
        "platforms.lower.cable_exit.width_mm",
        &["width of the cable's exit"],
        &[("platforms.lower.cable_exit.width_mm", json!(12))],
    );
    refused(
        "camera_body.board.clearance_mm",
        &["its head meets the wall"],
        &[("camera_body.board.hole_diameter_mm", json!(3.3))],
    );
    refused(
        "camera_body.board.hole_diameter_mm",
        &["no screw is as thin"],
        &[("camera_body.board.hole_diameter_mm", json!(1))],
    );
}

/// The finished mesh is asked, not the dimensions that it was made from.
#[test]
fn posts_and_threads_that_are_missing_are_found() {
    let design = Design::from_str(&picam(&[]).to_string()).unwrap();
    let m = Measures::of(&design).unwrap();
    let made = build(&m, &passes()).unwrap();
    let assembly = Assembly::of(&m, &made).unwrap();
    assert_eq!(board_seat::bearing(&m, &assembly), []);
    let with = |change: &dyn Fn(&mut Measures)| {
        let mut asked = m.clone();
        change(&mut asked);
        let faults = board_seat::bearing(&asked, &assembly);
        faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
    };
    let elsewhere = with(&|m| m.camera_body.board.as_mut().unwrap().holes_mm[2] = [0.0, -8.0]);
    assert!(elsewhere.contains("post at hole 2"), "{elsewhere}");
    // The board beside its hole bears, but its screw finds no hole round which material stands.
    let deeper = with(&|m| m.camera_body.board.as_mut().unwrap().hole_diameter_mm = 3.3);
    assert!(deeper.contains("material round the M3 screw"), "{deeper}");
}

#[test]
fn a_board_and_its_description_belong_together() {
    let fault = |edits: &[(&str, Value)]| Design::from_str(&picam(edits).to_string()).unwrap_err().field;
    assert_eq!(fault(&[("camera_body.kind", json!("cylinder"))]), "camera_body.kind");
    let clamp = "platforms.lower.clamp.azimuth_deg";
    assert_eq!(fault(&[(clamp, json!([60, 180]))]), clamp);
    let hole = "camera_body.board.holes_mm[1]";
    assert_eq!(fault(&[(hole, json!([12.0, 0]))]), hole);
    assert_eq!(fault(&[(hole, json!([10.5, 2.5]))]), hole);
    let lens = "camera_body.board.lens_offset_mm";
    assert_eq!(fault(&[(lens, json!([0, 13]))]), lens);
    assert_eq!(fault(&[("camera_body.board.size_mm", json!([-1, 5]))]), "camera_body.board.size_mm");
    let mut tree = picam(&[]);
    tree["camera_body"].as_object_mut().unwrap().shift_remove("board");
    assert_eq!(Design::from_str(&tree.to_string()).unwrap_err().field, "camera_body.board");
}
