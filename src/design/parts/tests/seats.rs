//! Broken designs: each is refused with the field at fault, and the change that the refusal names takes it away.

use serde_json::{Value, json};

use super::*;

fn edited(edits: &[(&str, Value)]) -> Value {
    let text = std::fs::read_to_string(NEAR_LIGHTS).unwrap();
    let mut tree: Value = serde_json::from_str(&text).unwrap();
    // Coarse meshes: what is looked for is tenths of a millimetre.
    set(&mut tree, "mesh.chord_tolerance_mm", json!(0.03));
    set(&mut tree, "mesh.optical_chord_tolerance_mm", json!(0.05));
    // A channel for the cable, which thumb24 and its kin have no room for, and the two set screws that then have room beside it.
    set(&mut tree, "platforms.lower.cable_exit.width_mm", json!(3.2));
    set(&mut tree, "platforms.lower.cable_exit.height_mm", json!(2.5));
    set(&mut tree, "platforms.lower.clamp.azimuth_deg", json!([60, 300]));
    for (field, value) in edits {
        set(&mut tree, field, value.clone());
    }
    tree
}

/// Sets a field by the path that messages give: `platforms.lower.mounting.at_mm[2]`.
pub(super) fn set(tree: &mut Value, field: &str, value: Value) {
    let mut at = tree;
    for name in field.replace('[', ".").replace(']', "").split('.') {
        at = match name.parse::<usize>() {
            Ok(index) => &mut at[index],
            Err(_) => &mut at[name],
        };
    }
    *at = value;
}

/// Everything that is at fault with a design's parts, and what is noted where nothing is.
pub(super) fn verdict(tree: &Value) -> Result<CheckedSensor, Vec<PartError>> {
    let design = Design::from_str(&tree.to_string()).unwrap();
    let all = |error: PartError| error.faults().to_vec();
    let m = Measures::of(&design).map_err(all)?;
    let layout = design.layout().unwrap();
    let made = build_seated(&design, &m, &layout.passes).map_err(all)?;
    let assembly = Assembly::of(&m, &made).map_err(all)?;
    check_sensor(&design, &m, &made, &assembly, &layout.dots).map_err(all)
}

/// The fault whose cure is in a field.
pub(super) fn fault_in(faults: &[PartError], field: &str) -> Option<PartError> {
    // a wall's fault may be cured by a seat's field: that is another fault
    let of_seat = |fault: &&PartError| !matches!(fault, PartError::Cured { .. });
    let here = |fault: &&PartError| fault.cure().is_some_and(|cure| cure.field == field);
    faults.iter().filter(of_seat).find(here).cloned()
}

#[track_caller]
fn refused(field: &str, words: &[&str], edits: &[(&str, Value)]) {
    refused_tree(field, words, edited(edits));
}

#[track_caller]
pub(super) fn refused_tree(field: &str, words: &[&str], mut tree: Value) {
    let faults = verdict(&tree).expect_err("a broken design");
    let said: Vec<String> = faults.iter().map(ToString::to_string).collect();
    let Some(fault) = fault_in(&faults, field) else { panic!("{field} is not in {said:#?}") };
    for word in words {
        assert!(fault.to_string().contains(word), "\"{word}\" is not in \"{fault}\"");
    }
    let cure = fault.cure().unwrap().clone();
    set(&mut tree, &cure.field, cure.value);
    if let Err(left) = verdict(&tree) {
        let same = fault_in(&left, field);
        assert_eq!(same, None, "{field}: the change does not help; first {fault}");
    }
}

#[test]
fn a_sound_sensor_holds_everything_and_says_what_it_does_not() {
    let checked = verdict(&edited(&[])).unwrap();
    assert_eq!(checked.sight.len(), 7, "rest and six claimed loads");
    for pose in &checked.sight {
        for count in &pose.counts {
            assert_eq!(count.blocked, 0, "{}: {:?}", pose.pose, count.kind);
        }
        assert!(pose.counts.iter().map(|c| c.traced).sum::<usize>() > 2000, "{:?}", pose.counts);
    }
    let shipped = [
        ("platforms.lower.cable_exit.width_mm", json!(0)),
        ("platforms.lower.cable_exit.height_mm", json!(0)),
        ("platforms.lower.clamp.azimuth_deg", json!([60, 180, 300])),
    ];
    let shipped = verdict(&edited(&shipped)).unwrap();
    assert!(shipped.notes.is_empty(), "thumb24 as it is: {:?}", shipped.notes);
    let note = |field: &str| checked.notes.iter().find(|note| note.field == field).map(|n| n.message.clone());
    let push = note("platforms.lower.clamp.azimuth_deg").unwrap();
    assert!(push.contains("180 degrees: (-0.100, 0.000) mm"), "{push}");
    let cable = note("camera_body.cable_diameter_mm").unwrap();
    assert!(cable.contains("0.20 mm below the camera"), "{cable}");
    // Three at 120 degrees push nowhere; neither do two that face each other.
    for azimuths in [json!([60, 180, 300]), json!([90, 270])] {
        let tree = edited(&[
            ("platforms.lower.clamp.azimuth_deg", azimuths),
            ("platforms.lower.cable_exit.azimuth_deg", json!(0)),
            ("platforms.lower.clamp.hole_diameter_mm", json!(1.25)),
        ]);
        let design = Design::from_str(&tree.to_string()).unwrap();
        let notes = super::super::seats::notes(&Measures::of(&design).unwrap());
        assert!(notes.iter().all(|note| note.field != "platforms.lower.clamp.azimuth_deg"), "{notes:?}");
    }
}

#[test]
fn a_camera_off_its_bore_is_refused() {
    // Springs so long that the block's top is below the body.
    refused(
        "camera.position_mm[2]",
        &["camera and lower_platform", "off the bore", "missing"],
        &[
            ("springs.free_length_mm", json!(11.5)),
            ("springs.active_coils", json!(8)),
            ("platforms.lower.underside_z_mm", json!(-24.0)),
            ("platforms.lower.clamp.z_mm", json!(-20.0)),
            ("envelope.size_mm", json!([24, 24, 40])),
            ("loads.claims", json!([])),
        ],
    );
}

#[test]
fn set_screws_beside_the_camera_are_refused() {
    refused(
        "platforms.lower.clamp.z_mm",
        &["set screws and camera", "their axes pass the body"],
        &[("camera_body.length_mm", json!(3.6)), ("platforms.lower.clamp.z_mm", json!(-14.2))],
    );
    // A block so wide that no screw of this thread reaches the body.
    refused(
        "platforms.lower.clamp.hole_diameter_mm",
        &["longest M2 set screw"],
        &[
            ("platforms.outer_mm", json!([50, 50])),
            ("envelope.size_mm", json!([50, 50, 26])),
            ("platforms.lower.clamp.hole_diameter_mm", json!(1.6)),
        ],
    );
    refused(
        "platforms.lower.clamp.hole_diameter_mm",
        &["no set screw is as thin"],
        &[("platforms.lower.clamp.hole_diameter_mm", json!(1.0))],
    );
}

#[test]
fn a_cable_wider_than_its_exit_is_refused() {
    refused(
        "platforms.lower.cable_exit.width_mm",
        &["cable", "width"],
        &[("camera_body.cable_diameter_mm", json!(3.4))],
    );
    refused(
        "platforms.lower.cable_exit.height_mm",
        &["cable", "height"],
        &[("camera_body.cable_diameter_mm", json!(2.8))],
    );
}

#[test]
fn springs_and_magnets_without_a_seat_are_refused() {
    refused(
        "magnet_pockets.push_out_diameter_mm",
        &["push-out hole leaves no floor"],
        &[("magnet_pockets.push_out_diameter_mm", json!(2.9))],
    );
    refused("magnets.diameter_mm", &["springs and magnets"], &[("magnets.diameter_mm", json!(2.0))]);
    refused(
        "springs.places.ring.radius_mm",
        &["wall beside its seat"],
        &[("springs.places.ring.radius_mm", json!(10.2))],
    );
}

#[test]
fn lights_without_a_seat_are_refused() {
    refused(
        "leds.lip_top_z_mm",
        &["height of the package behind the lip"],
        &[("leds.lip_top_z_mm", json!(-4.2))],
    );
    refused("leds.center_z_mm", &["LED boards and acrylic_sheet"], &[("leds.center_z_mm", json!(-1.9))]);
}

#[test]
fn screws_outside_the_block_are_refused() {
    refused(
        "platforms.lower.mounting.at_mm[0]",
        &["mounting screw 0 and lower_platform"],
        &[("platforms.lower.mounting.at_mm[0]", json!([11.2, 9]))],
    );
}

#[test]
fn what_stands_in_the_view_is_named() {
    // A front glass narrower than the view.
    refused(
        "camera_body.lens_diameter_mm",
        &["camera: blocks the view", "white markers", "rays)"],
        &[("camera_body.lens_diameter_mm", json!(2.0))],
    );
}

#[test]
fn all_faults_come_in_one_run() {
    let faults = verdict(&edited(&[
        ("platforms.lower.mounting.at_mm[0]", json!([11.2, 9])),
        ("camera_body.cable_diameter_mm", json!(3.4)),
        ("leds.lip_top_z_mm", json!(-4.2)),
        ("magnet_pockets.push_out_diameter_mm", json!(2.9)),
    ]))
    .unwrap_err();
    for field in [
        "platforms.lower.mounting.at_mm[0]",
        "platforms.lower.cable_exit.width_mm",
        "leds.lip_top_z_mm",
        "magnet_pockets.push_out_diameter_mm",
    ] {
        assert!(fault_in(&faults, field).is_some(), "{field}: {faults:#?}");
    }
}

/// A camera with a narrow lens, deep below: its view needs an opening in the lower platform.
fn deep() -> Vec<(&'static str, Value)> {
    vec![
        ("camera.position_mm", json!([0, 0, -24])),
        ("camera.model", json!("pinhole")),
        ("camera.distortion", json!([])),
        ("camera.matrix", json!([[480, 0, 319.5], [0, 480, 239.5], [0, 0, 1]])),
        ("camera.field_of_view_deg", json!(80)),
        ("runtime.mask_field_angle_deg", json!(29)),
        ("pattern.polar_angle_deg", json!(50)),
        ("platforms.lower.underside_z_mm", json!(-30.2)),
        ("platforms.lower.clamp.z_mm", json!(-28)),
        ("platforms.lower.clamp.hole_diameter_mm", json!(2.5)),
        ("platforms.outer_mm", json!([36, 36])),
        ("envelope.size_mm", json!([36, 36, 45])),
        ("platforms.lower.mounting.at_mm", json!([[15, 15], [-15, 15], [-15, -15], [15, -15]])),
        ("platforms.lower.wire_hole_ring_radius_mm", json!(15.8)),
        ("springs.places.ring.radius_mm", json!(14)),
        ("leds.list", json!([])),
    ]
}

#[test]
fn a_deep_camera_looks_through_a_cone() {
    let tree = edited(&deep());
    let checked = verdict(&tree).unwrap_or_else(|faults| panic!("{faults:#?}"));
    assert!(checked.sight.iter().flat_map(|pose| &pose.counts).all(|count| count.blocked == 0));
    // The same camera down a plain bore is blind, and refused.
    let design = Design::from_str(&tree.to_string()).unwrap();
    let mut m = Measures::of(&design).unwrap();
    assert!(m.lower_view.take().is_some());
    let layout = design.layout().unwrap();
    let made = build(&m, &layout.passes).unwrap();
    let assembly = Assembly::of(&m, &made).unwrap();
    let said = check_sensor(&design, &m, &made, &assembly, &layout.dots).unwrap_err().to_string();
    for word in ["lower_platform: blocks the view", "the dome's rim 100.0 %", "platforms.window_margin_mm"] {
        assert!(said.contains(word), "\"{word}\" is not in \"{said}\"");
    }
}

#[test]
fn seats_that_the_view_cuts_into_are_named_with_their_place() {
    let with = |field: &'static str, value: Value| {
        let mut edits = deep();
        edits.push((field, value));
        edits
    };
    let lights = json!([{ "color": "red", "azimuth_deg": 0 }, { "color": "green", "azimuth_deg": 120 }]);
    refused(
        "springs.places.ring.radius_mm",
        &["the camera's view"],
        &with("springs.places.ring.radius_mm", json!(9.7)),
    );
    refused("leds.center_radius_mm", &["the camera's view"], &with("leds.list", lights));
    refused(
        "platforms.lower.mounting.at_mm[1]",
        &["the camera's view"],
        &with("platforms.lower.mounting.at_mm[1]", json!([-5, 5])),
    );
}

#[test]
fn mould_pins_beside_the_mould_are_refused() {
    refused("mould.pins.at_mm[0]", &["mould pin 0"], &[("mould.pins.at_mm[0]", json!([25, 25]))]);
}
