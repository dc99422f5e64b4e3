//! Which features of a part meet without meaning to, where its mesh has other holes than its features make.

use super::feature::{Blueprint, Feature};
use domecast_mesh::{BoundingBox, MeshError, Solid};

/// Pairs that are named at most.
const MAX_NAMED: usize = 3;
/// Without a smallest wall, features nearer than this are looked at, mm.
const NEAR_MM: f64 = 0.2;

/// Two features that come near each other inside the part.
struct Meeting<'a> {
    features: [&'a Feature; 2],
    /// Distance between them, mm; negative by how deep they run into each other.
    apart_mm: f64,
}

/// What is said of the features that meet, and the fields that decide them.
pub(super) struct Meetings {
    /// "LED pit 0 and light channel 0 are 0.020 mm apart: ..".
    pub text: String,
    /// The fields, the likeliest first.
    pub fields: Vec<&'static str>,
}

/// Looks for pairs of cuts that touch or overlap by less than the smallest wall. Cuts that are meant to open into
/// each other do so by more; others stay apart by that.
pub(super) fn meetings(b: &Blueprint, min_wall_mm: f64) -> Meetings {
    let limit = min_wall_mm.max(NEAR_MM);
    let found = pairs(b, limit).unwrap_or_default();
    let mut fields: Vec<&'static str> = Vec::new();
    for field in found.iter().flat_map(|meeting| meeting.features.map(|feature| feature.field)) {
        if !fields.contains(&field) {
            fields.push(field);
        }
    }
    if found.is_empty() {
        let text = format!(
            "no two features are nearer than {limit:.2} mm to each other: one of them misses the part"
        );
        return Meetings { text, fields };
    }
    let named: Vec<String> = found
        .iter()
        .take(MAX_NAMED)
        .map(|Meeting { features: [one, two], apart_mm }| {
            let names = format!("{} and {}", one.piece.name, two.piece.name);
            if *apart_mm > 0.0 {
                format!("{names} are {apart_mm:.3} mm apart")
            } else {
                format!("{names} run into each other by {:.3} mm", -apart_mm)
            }
        })
        .collect();
    let more = found.len().saturating_sub(MAX_NAMED);
    let more = if more > 0 { format!(", and {more} more pairs") } else { String::new() };
    let text =
        format!("{}{more}; {limit:.2} mm apart, or as deep into each other, would do", named.join(", "));
    Meetings { text, fields }
}

/// A cut as far as it is inside the part.
struct Tool<'a> {
    feature: &'a Feature,
    inside: Solid,
    bounds: BoundingBox,
}

/// The pairs, those with the smallest distance or depth first.
fn pairs(b: &Blueprint, limit: f64) -> Result<Vec<Meeting<'_>>, MeshError> {
    let solid = |feature: &Feature| feature.piece.solid(b.chord);
    let body = b.added.iter().map(solid).collect::<Result<Vec<_>, _>>().and_then(Solid::union)?;
    let mut tools: Vec<Tool<'_>> = Vec::new();
    for feature in &b.cut {
        let Some(inside) = solid(feature)?.intersection(&body)? else { continue };
        if let Some(bounds) = inside.to_mesh().bounds() {
            tools.push(Tool { feature, inside, bounds });
        }
    }
    let mut found = Vec::new();
    for (i, one) in tools.iter().enumerate() {
        for two in &tools[i + 1..] {
            let between = (one.bounds.min_mm - two.bounds.max_mm).max(two.bounds.min_mm - one.bounds.max_mm);
            if between.max_element() > limit {
                continue;
            }
            let gap = one.inside.gap_mm(&two.inside, limit);
            let apart_mm = if gap > 0.0 { gap } else { -depth_mm(&one.inside, &two.inside)? };
            if apart_mm.abs() < limit {
                found.push(Meeting { features: [one.feature, two.feature], apart_mm });
            }
        }
    }
    found.sort_by(|a, b| a.apart_mm.abs().total_cmp(&b.apart_mm.abs()));
    Ok(found)
}

/// How deep two solids are in each other: the smallest side of what they share.
fn depth_mm(one: &Solid, two: &Solid) -> Result<f64, MeshError> {
    let shared = one.intersection(two)?;
    Ok(shared
        .and_then(|shared| shared.to_mesh().bounds())
        .map_or(0.0, |bounds| bounds.size_mm().min_element()))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::tests::thumb24;
    use super::super::{Measures, PartError};
    use super::*;
    use domecast_mesh::{Fit, Shape};

    #[test]
    fn holes_that_run_into_each_other_are_named_with_depth_and_fields() {
        let mut m = Measures::of(&thumb24()).unwrap();
        m.process.min_wall_mm = 0.0;
        let mut b = Blueprint::new("plate", "a plate with two holes", m.chord);
        let plate = Shape::cuboid(DVec3::new(-5.0, -5.0, 0.0), DVec3::new(5.0, 5.0, 2.0));
        b.added.push(Feature::new("plate", "platforms.outer_mm", plate));
        for (i, x) in [-1.0, 1.0].into_iter().enumerate() {
            let hole = Shape::cylinder(1.05, -1.0, 3.0, Fit::Outside);
            b.cut.push(Feature::new("hole", "sheet.size_mm", hole).numbered(i).at(x, 0.0));
            b.genus += 1;
        }
        let fault = b.build(&m).unwrap_err();
        let said = fault.to_string();
        assert!(said.contains("hole 0 and hole 1 run into each other by 0.1"), "{said}");
        assert!(said.contains("would do"), "{said}");
        assert!(matches!(fault, PartError::Broken { field, .. } if field == "sheet.size_mm"));
    }
}
