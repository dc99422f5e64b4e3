//! What a rigid mount and a camera's board do without: the rules serve springs and round cameras.

use serde_json::{Value, json};

use super::known::lookup;
use super::rule::DerivedField;

/// Sections that only springs need; a rigid mount refuses them where they are given.
const OF_SPRINGS: [&str; 4] = ["springs", "magnets", "magnet_pockets", "white_markers"];

/// Whether a text stands at a path.
fn is(design: &Value, path: &str, word: &str) -> bool {
    lookup(design, path).and_then(Value::as_str) == Some(word)
}

/// The sections of springs that a design with a rigid mount leaves out: rules may use their numbers (heights as if
/// springs stood there), and [`strip`] takes them away again. Empty for springs.
pub(super) fn to_strip(design: &Value) -> Vec<&'static str> {
    if !is(design, "mount.kind", "rigid") {
        return Vec::new();
    }
    OF_SPRINGS.into_iter().filter(|section| lookup(design, section).is_none()).collect()
}

/// Values that a rule gives otherwise for a rigid mount or a board; `None` where it gives its own.
pub(super) fn instead(design: &Value, field: &str) -> Option<Value> {
    let without = match field {
        "loads.claims" => is(design, "mount.kind", "rigid"),
        "platforms.lower.clamp.azimuth_deg" => is(design, "camera_body.kind", "board"),
        _ => false,
    };
    without.then(|| json!([]))
}

/// Takes the sections of springs away again.
pub(super) fn strip(design: &mut Value, sections: &[&str], derived: &mut Vec<DerivedField>) {
    if let Value::Object(map) = design {
        sections.iter().for_each(|section| {
            map.shift_remove(*section);
        });
    }
    let of = |field: &str| field.split('.').next().unwrap_or_default().to_owned();
    derived.retain(|field| !sections.contains(&of(field.field).as_str()));
}
