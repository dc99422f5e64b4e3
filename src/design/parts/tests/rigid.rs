//! Rigid mounts: sound as they stand, and each broken one refused with what takes the fault away.

use serde_json::{Value, json};

use super::super::mount;
use super::seats::{refused_tree, set, verdict};
use super::*;

/// A dome in the size of a DIGIT on four posts.
fn rigid(edits: &[(&str, Value)]) -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/digit-rigid.json");
    let mut tree: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    set(&mut tree, "mesh", json!({ "chord_tolerance_mm": 0.03, "optical_chord_tolerance_mm": 0.05 }));
    set(&mut tree, "envelope.size_mm", json!([120, 120, 120]));
    for (field, value) in edits {
        set(&mut tree, field, value.clone());
    }
    tree
}

#[test]
fn a_platform_on_posts_is_held_and_does_not_move() {
    let tree = rigid(&[]);
    let checked = verdict(&tree).unwrap_or_else(|faults| panic!("{faults:#?}"));
    assert!(checked.sight.iter().flat_map(|pose| &pose.counts).all(|count| count.blocked == 0));
    let design = Design::from_str(&tree.to_string()).unwrap();
    let m = Measures::of(&design).unwrap();
    assert!(m.poses.len() == 1 && m.spring_axes_mm.is_empty() && design.springs_at_mm().is_empty());
    assert!(crate::suspension_of(&design).unwrap_err().to_string().contains("rigid mount"));
    let made = build(&m, &passes()).unwrap();
    assert!(made.iter().all(|part| part.name != "marker_stencil" && part.check().is_ok()));
    let assembly = Assembly::of(&m, &made).unwrap();
    assert!(assembly.items.iter().all(|item| !item.name.contains("magnet") && !item.name.contains("spring")));
    // The posts reach the upper platform's underside, to rounding.
    let lower = made.iter().find(|part| part.name == "lower_platform").unwrap();
    assert!((lower.bounds.max_mm.z - m.platforms.upper.underside_z_mm).abs() < 1e-5);
    let upper = assembly.items.iter().find(|item| item.name == "upper_platform").map(|item| &item.mesh);
    assert_eq!(mount::bearing(&m, upper), []);
    let mut off = m.clone();
    off.mount.at_mm[1] = [0.0, 0.0];
    let faults = mount::bearing(&off, upper);
    assert!(faults.iter().any(|fault| fault.to_string().contains("above post 1")), "{faults:?}");
}

#[test]
fn posts_that_do_not_hold_are_refused() {
    let refused =
        |field: &str, words: &[&str], edits: &[(&str, Value)]| refused_tree(field, words, rigid(edits));
    refused("mount.post_diameter_mm", &["wall of a post"], &[("mount.post_diameter_mm", json!(3.0))]);
    refused("mount.hole_diameter_mm", &["no screw is as thin"], &[("mount.hole_diameter_mm", json!(1.0))]);
    refused(
        "platforms.upper.underside_z_mm",
        &["an M3 screw goes into"],
        &[("mount.hole_diameter_mm", json!(3.2))],
    );
}

#[test]
fn a_rigid_mount_has_nothing_of_springs() {
    let thumb: Value = serde_json::from_str(include_str!("../../../../designs/thumb24.json")).unwrap();
    let fault = |edits: &[(&str, Value)]| Design::from_str(&rigid(edits).to_string()).unwrap_err();
    for field in ["springs", "magnets", "magnet_pockets"] {
        let fault = fault(&[(field, thumb[field].clone())]);
        assert!(fault.field == field && fault.to_string().contains("rigid mount"), "{fault}");
    }
    assert_eq!(fault(&[("loads", thumb["loads"].clone())]).field, "loads.claims");
    assert_eq!(
        fault(&[("white_markers", thumb["white_markers"].clone())]).field,
        "white_markers.positions_mm"
    );
    assert_eq!(fault(&[("mount.at_mm", json!([[9, 9]]))]).field, "mount.at_mm");
    assert_eq!(fault(&[("mount.at_mm", json!([[9, 9], [99, 0]]))]).field, "mount.at_mm[1]");
    assert_eq!(fault(&[("mount.at_mm", json!([[9, 9], [9, 8]]))]).field, "mount.at_mm[1]");
    // Springs that are left out elsewhere follow from rules, they do not vanish.
    for field in ["springs", "magnets", "magnet_pockets", "white_markers"] {
        let mut tree = thumb.clone();
        tree.as_object_mut().unwrap().shift_remove(field);
        let read = Design::from_str(&tree.to_string()).unwrap_or_else(|fault| panic!("{field}: {fault}"));
        let s = read.sections();
        let gone =
            [s.springs.is_none(), s.magnets.is_none(), s.magnet_pockets.is_none(), s.white_markers.is_none()];
        assert_eq!(gone, [false; 4], "{field}");
    }
    let mut few = thumb.clone();
    set(&mut few, "white_markers.positions_mm", json!([[7.5, 7.5], [-7.5, 7.5]]));
    assert_eq!(Design::from_str(&few.to_string()).unwrap_err().field, "white_markers.positions_mm");
}
