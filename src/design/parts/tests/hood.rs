//! A hood hides deep lights from the lens, and keeps off camera, platform and light.

use serde_json::{Value, json};

use super::seats::{set, verdict};
use super::*;

fn edited(edits: &[(&str, Value)]) -> Value {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../designs/thumb24.json"));
    let mut tree: Value = serde_json::from_str(&text.unwrap()).unwrap();
    // Coarse meshes: what is looked for is tenths of a millimetre.
    set(&mut tree, "mesh", json!({ "chord_tolerance_mm": 0.03, "optical_chord_tolerance_mm": 0.05 }));
    for (field, value) in edits {
        set(&mut tree, field, value.clone());
    }
    tree
}

const RIM: &str = "platforms.lower.hood.rim_from_pupil_mm";

#[test]
fn thumb24_is_held_and_seen_and_hides_its_lights() {
    let checked = verdict(&edited(&[])).unwrap();
    assert!(checked.sight.iter().flat_map(|pose| &pose.counts).all(|count| count.blocked == 0));
    // With its rim hardly above the lens it hides nothing.
    let low = verdict(&edited(&[(RIM, json!(0.95))])).unwrap_err();
    let said: Vec<String> = low.iter().map(ToString::to_string).collect();
    assert!(said.iter().any(|fault| fault.contains("shines straight into the lens")), "{said:?}");
}

#[test]
fn a_rim_in_the_view_or_in_the_block_is_refused() {
    // A rim just above the block neither holds the camera nor hides a light.
    for (rim_mm, word, is_sound_then) in
        [(2.4, "in the camera's view", true), (-3.0, "above the block", false)]
    {
        let mut tree = edited(&[(RIM, json!(rim_mm))]);
        let faults = verdict(&tree).unwrap_err();
        let named = |fault: &&PartError| fault.to_string().contains(word);
        let cure = faults.iter().find(named).and_then(PartError::cure);
        let Some(cure) = cure.cloned() else { panic!("{faults:?}") };
        assert_eq!(cure.field, RIM);
        set(&mut tree, RIM, cure.value);
        let left = verdict(&tree).err().unwrap_or_default();
        assert_eq!(left.is_empty(), is_sound_then, "{left:?}");
        assert!(!left.iter().any(|fault| named(&fault)), "{left:?}");
    }
}

#[test]
fn a_hood_without_its_gap_meets_the_platform() {
    let said = verdict(&edited(&[("platforms.lower.hood.gap_mm", json!(0.0))])).unwrap_err();
    let said: Vec<String> = said.iter().map(ToString::to_string).collect();
    assert!(
        said.iter().any(|fault| fault.contains("upper_platform") && fault.contains("lower_platform")),
        "{said:?}"
    );
}

/// Of a light just below the hood's rim, what goes across to the far side of the dome meets it.
#[test]
fn a_hood_between_light_and_dome_is_named_with_the_rim_that_would_do() {
    let mut m = Measures::of(&Design::from_str(&edited(&[]).to_string()).unwrap()).unwrap();
    light_ways::check(&m).unwrap();
    // A deep light with nothing before it, looked at where the springs are bound.
    m.leds.lip_top_z_mm = m.leds.center_z_mm - 2.0;
    for pose in &mut m.poses {
        pose.is_claimed = true;
    }
    let fault = light_ways::check(&m).unwrap_err();
    assert!(fault.to_string().contains("the hood stands between LED"), "{fault}");
    let cure = fault.cure().unwrap();
    assert_eq!(cure.field, RIM);
    m.platforms.lower.hood.as_mut().unwrap().rim_from_pupil_mm = cure.value.as_f64().unwrap();
    light_ways::check(&m).unwrap();
}
