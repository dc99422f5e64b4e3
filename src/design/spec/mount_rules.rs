//! The rules of a mount: what springs need, and what a rigid mount cannot have.

use glam::DVec2;
use serde_json::{Value, json};

use super::error::DesignError;
use super::sections::DesignFile;

/// Sections and mount belong together.
pub(super) fn check(sections: &DesignFile) -> Result<(), DesignError> {
    let mount = &sections.mount;
    let parts = [
        ("springs", sections.springs.is_none()),
        ("magnets", sections.magnets.is_none()),
        ("magnet_pockets", sections.magnet_pockets.is_none()),
        ("white_markers", sections.white_markers.is_none()),
    ];
    if !mount.is_rigid() {
        if let Some((field, _)) = parts.iter().find(|(_, is_none)| *is_none) {
            return Err(DesignError::at(*field, "", "the field is missing", "")
                .with_help("only a rigid mount does without: mount.kind = \"rigid\""));
        }
        let count = sections.white_markers.positions_mm.len();
        if count < 4 {
            return Err(DesignError::at(
                "white_markers.positions_mm",
                json!(sections.white_markers.positions_mm),
                format!("the list has {count} entries"),
                "4 to 64",
            ));
        }
        return if mount.at_mm.is_empty() {
            Ok(())
        } else {
            let problem = "posts are given, but the platform stands on springs";
            Err(DesignError::at(
                "mount.at_mm",
                json!(mount.at_mm),
                problem,
                "mount.kind = \"rigid\", or no posts",
            ))
        };
    }
    let cannot = |field: &str, value: Value, problem: &str, allowed: &str| {
        Err(DesignError::at(field, value, format!("rigid mount: {problem}"), allowed))
    };
    for (field, is_none) in &parts[..3] {
        if !is_none {
            return cannot(field, Value::Null, "nothing springs or holds springs", "no such section");
        }
    }
    if sections.gravity.is_some() {
        return cannot("gravity", Value::Null, "no weight moves the platform", "no such section");
    }
    if !sections.loads.claims.is_empty() {
        let claims = sections.loads.claims.len();
        return cannot("loads.claims", json!(claims), "no net wrench is promised", "an empty list, []");
    }
    let markers = sections.white_markers.positions_mm.len();
    if markers > 0 {
        return cannot(
            "white_markers.positions_mm",
            json!(markers),
            "no pose is looked for",
            "no such section",
        );
    }
    if mount.at_mm.len() < 2 {
        let problem = "the upper platform stands on too few posts";
        return cannot("mount.at_mm", json!(mount.at_mm), problem, "two posts or more");
    }
    let half = 0.5 * DVec2::from_array(sections.platforms.outer_mm) - 0.5 * mount.post_diameter_mm;
    for (i, at) in mount.at_mm.iter().enumerate() {
        let place = DVec2::from_array(*at);
        let field = format!("mount.at_mm[{i}]");
        if !place.abs().cmple(half).all() {
            let allowed = format!("x within +-{:.3} and y within +-{:.3} mm", half.x, half.y);
            return cannot(&field, json!(at), "the post stands outside the platforms", &allowed);
        }
        let near = |other: &[f64; 2]| DVec2::from_array(*other).distance(place) < mount.post_diameter_mm;
        if mount.at_mm[..i].iter().any(near) {
            return cannot(
                &field,
                json!(at),
                "the post overlaps another",
                "posts apart by a diameter or more",
            );
        }
    }
    Ok(())
}
