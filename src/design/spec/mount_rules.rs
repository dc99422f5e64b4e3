//! The rules of a mount: what springs need, and what a rigid mount cannot have.

use glam::DVec2;
use serde_json::{Value, json};

use super::error::DesignError;
use super::sections::DesignFile;

/// What a post keeps from the sides where posts are proposed, mm.
const POST_INSET_MM: f64 = 0.2;

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
            )
            .cured_by("mount.at_mm", json!([])))
        };
    }
    for (field, is_none) in &parts[..3] {
        if !is_none {
            let fault = cannot(field, Value::Null, "nothing springs or holds springs", "no such section");
            return Err(fault.cured_by(field, Value::Null));
        }
    }
    if sections.gravity.is_some() {
        let fault = cannot("gravity", Value::Null, "no weight moves the platform", "no such section");
        return Err(fault.cured_by("gravity", Value::Null));
    }
    if !sections.loads.claims.is_empty() {
        let claims = sections.loads.claims.len();
        let fault = cannot("loads.claims", json!(claims), "no net wrench is promised", "an empty list, []");
        return Err(fault.cured_by("loads.claims", json!([])));
    }
    let markers = sections.white_markers.positions_mm.len();
    if markers > 0 {
        let field = "white_markers.positions_mm";
        let fault = cannot(field, json!(markers), "no pose is looked for", "no such section");
        return Err(fault.cured_by("white_markers", Value::Null));
    }
    if mount.at_mm.len() < 2 {
        let problem = "the upper platform stands on too few posts";
        let corner = 0.5 * DVec2::from_array(sections.platforms.outer_mm)
            - (0.5 * mount.post_diameter_mm + POST_INSET_MM);
        let corners = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]
            .map(|side| (corner * DVec2::from_array(side)).to_array().map(hundredth));
        let fault = cannot("mount.at_mm", json!(mount.at_mm), problem, "two posts or more");
        return Err(fault.cured_by("mount.at_mm", json!(corners)));
    }
    posts(sections)
}

/// Posts stand on the platforms, apart from each other.
fn posts(sections: &DesignFile) -> Result<(), DesignError> {
    let mount = &sections.mount;
    let half = 0.5 * DVec2::from_array(sections.platforms.outer_mm) - 0.5 * mount.post_diameter_mm;
    for (i, at) in mount.at_mm.iter().enumerate() {
        let place = DVec2::from_array(*at);
        let field = format!("mount.at_mm[{i}]");
        if !place.abs().cmple(half).all() {
            let allowed = format!("x within +-{:.3} and y within +-{:.3} mm", half.x, half.y);
            let inside = place.clamp(-half.abs(), half.abs()).to_array().map(hundredth);
            let fault = cannot(&field, json!(at), "the post stands outside the platforms", &allowed);
            return Err(fault.cured_by(&field, json!(inside)));
        }
        let near = |other: &[f64; 2]| DVec2::from_array(*other).distance(place) < mount.post_diameter_mm;
        if mount.at_mm[..i].iter().any(near) {
            let problem = "the post overlaps another";
            let fault = cannot(&field, json!(at), problem, "posts apart by a diameter or more");
            // one post less stands clear of the others
            let rest: Vec<[f64; 2]> =
                mount.at_mm.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, at)| *at).collect();
            return Err(if rest.len() >= 2 { fault.cured_by("mount.at_mm", json!(rest)) } else { fault });
        }
    }
    Ok(())
}

/// To 0.01 mm towards the middle.
fn hundredth(value_mm: f64) -> f64 {
    (100.0 * value_mm.abs() + 1e-6).floor().copysign(value_mm) / 100.0
}

fn cannot(field: &str, value: Value, problem: &str, allowed: &str) -> DesignError {
    DesignError::at(field, value, format!("rigid mount: {problem}"), allowed)
}
