//! What a rigid mount does without: the rules serve springs.

use serde_json::Value;

use super::known::lookup;
use super::rule::DerivedField;

/// Sections that only springs need; a rigid mount refuses them where they are given.
const OF_SPRINGS: [&str; 4] = ["springs", "magnets", "magnet_pockets", "white_markers"];

/// Whether the platform stands on posts.
pub(super) fn is_rigid(design: &Value) -> bool {
    lookup(design, "mount.kind").is_some_and(|kind| kind == "rigid")
}

/// The sections of springs that a design with a rigid mount leaves out: rules may use their numbers (heights as if
/// springs stood there), and [`strip`] takes them away again. Empty for springs.
pub(super) fn to_strip(design: &Value) -> Vec<&'static str> {
    if !is_rigid(design) {
        return Vec::new();
    }
    OF_SPRINGS.into_iter().filter(|section| lookup(design, section).is_none()).collect()
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
