//! Caps, and hemispheres on cylinders: what is cast is the dome.

use serde_json::{Value, json};

use super::super::{mould, purchased};
use super::seats::set;
use super::*;

fn with(edits: &[(&str, Value)]) -> Measures {
    let text = include_str!("../../../../designs/thumb24.json");
    let mut tree: Value = serde_json::from_str(text).unwrap();
    set(&mut tree, "mesh", json!({ "chord_tolerance_mm": 0.03, "optical_chord_tolerance_mm": 0.01 }));
    set(&mut tree, "envelope.size_mm", json!([120, 120, 120]));
    for (field, value) in edits {
        set(&mut tree, field, value.clone());
    }
    Measures::of(&Design::from_str(&tree.to_string()).unwrap()).unwrap()
}

fn shapes() -> Vec<Measures> {
    vec![
        with(&[]),
        with(&[("dome.rim_angle_deg", json!(70)), ("dome.radius_mm", json!(10.642))]),
        with(&[("dome.rim_angle_deg", json!(89.9))]),
        with(&[
            ("dome.rim_angle_deg", json!(30)),
            ("dome.radius_mm", json!(20)),
            ("pattern.polar_angle_deg", json!(28)),
        ]),
        with(&[("dome.cylinder_height_mm", json!(0.5))]),
        with(&[("dome.cylinder_height_mm", json!(6))]),
    ]
}

#[test]
fn the_mould_holds_the_grown_dome_and_its_sealer() {
    for m in shapes() {
        let dome = &m.dome;
        let stand_in = purchased::dome(&m).shape.volume_mm3();
        assert!((stand_in / dome.volume_mm3() - 1.0).abs() < 1e-12, "{dome:?}");
        // Up to the cast's flat face the cavity is the grown dome, a sealer wider on the sphere and the wall.
        let grow = 1.0 / (1.0 - m.shrinkage);
        let sealer = m.mould.sealer_thickness_mm;
        let grown = dome.scaled_to(dome.radius_mm() * grow);
        let sealed = grown.with_radius_mm(grown.radius_mm() + sealer);
        let cavity = mould::cavity_shape(&m, -sealer);
        assert!((cavity.volume_mm3() / sealed.volume_mm3() - 1.0).abs() < 1e-12, "{dome:?}");
        assert!((m.cast_rim_mm() / grown.rim_radius_mm() - 1.0).abs() < 1e-12, "{dome:?}");
        let parts = build(&m, &passes()).unwrap();
        let part = parts.iter().find(|part| part.name == "mould_cavity").unwrap();
        let found = part.inspect();
        assert!(found.is_one_solid(), "{dome:?}: {:?}", found.problem());
        let (half, pins) = (mould::half_side_mm(&m), &m.mould.pins);
        let hole = std::f64::consts::PI * (0.5 * pins.diameter_mm + pins.clearance_mm).powi(2);
        let holes = hole * (pins.height_mm + pins.depth_clearance_mm) * pins.at_mm.len() as f64;
        let block = 4.0 * half * half * -mould::bottom_z_mm(&m);
        let expected = block - mould::cavity_shape(&m, 0.0).volume_mm3() - holes;
        assert!((found.volume_mm3 / expected - 1.0).abs() < 2e-4, "{dome:?}: {}", found.volume_mm3);
    }
}

#[test]
fn a_cap_opens_to_the_parting_plane() {
    for m in shapes() {
        let cavity = mould::cavity_shape(&m, 0.0);
        let Shape::Turned { profile, .. } = cavity else { panic!("turned") };
        let top = profile.points_mm.last().unwrap();
        assert!((top.x - m.mouth_radius_mm()).abs() < 1e-9 && top.y == 0.0);
        assert!(profile.points_mm.windows(2).all(|pair| pair[0].x <= pair[1].x), "{:?}", m.dome);
    }
}
