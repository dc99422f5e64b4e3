//! The design file that a search proposes: the changed fields, each with its reason.

use serde_json::{Map, Value, json};

use super::candidate::Candidate;
use super::options::SearchOptions;
use crate::numbers::significant;
use domecast_design::sections::Why;
use domecast_design::{Cure, Design, DesignError};

/// Longest name of a design.
const MAX_NAME: usize = 64;
/// What the name of a proposal ends with.
pub const SUFFIX: &str = "-optimized";

/// The candidate's design under a name of its own, with reasons for what was changed.
///
/// # Errors
/// A design whose reasons cannot be set.
pub fn explained(
    start: &Design,
    made: &Candidate,
    options: &SearchOptions,
    before: f64,
    after: f64,
) -> Result<Design, DesignError> {
    let reason = format!(
        "choice: searched by `domecast illuminate --optimize` with seed {}: by direct light the normals' error to {} degrees \
         is {} degrees a grey level at the 95th percentile, {} before",
        options.seed,
        significant(options.polar_angle_deg),
        significant(after),
        significant(before),
    );
    let lip = "choice: as low as hides the lights from the lens at every position of the springs, by `domecast illuminate \
               --optimize`";
    let underside = "choice: the underside lies as deep as its rule asks for below the lights that `domecast illuminate \
                     --optimize` found";
    let mut changes = made.changes.clone();
    let name: String = start.name().chars().take(MAX_NAME - SUFFIX.len()).collect();
    changes.push(Cure { field: "name".into(), value: json!(format!("{name}{SUFFIX}")) });
    let leds: Vec<(&str, &str)> = made
        .changes
        .iter()
        .filter(|change| is_new(start, change))
        .filter_map(|change| change.field.strip_prefix("leds."))
        .map(|field| (field, if field == "lip_top_z_mm" { lip } else { reason.as_str() }))
        .collect();
    changes.extend(reasons("leds", start.sections().leds.why.as_ref(), &leds));
    let deeper = start.with_changes(&made.changes)?;
    let [now, then] = [&deeper, start].map(|design| design.sections().platforms.upper.underside_z_mm);
    if now != then {
        changes.extend(reasons(
            "platforms",
            start.sections().platforms.why.as_ref(),
            &[("upper", underside)],
        ));
    }
    start.with_changes(&changes)
}

/// Whether a change gives its field another value than the design has.
fn is_new(start: &Design, change: &Cure) -> bool {
    let whole = serde_json::to_value(start.sections()).unwrap_or_default();
    let now = change.field.split('.').try_fold(&whole, |at, key| at.get(key));
    now.unwrap_or(&Value::Null) != &change.value
}

/// The reasons of a section with those of some fields replaced; a reason for the section as a whole gets them added.
fn reasons(section: &str, given: Option<&Why>, new: &[(&str, &str)]) -> Option<Cure> {
    let mut said: Vec<&str> = new.iter().map(|(_, reason)| *reason).collect();
    said.dedup();
    let value = match given {
        _ if new.is_empty() => return None,
        Some(Why::Whole(text)) => json!(format!("{text}; changed since: {}", said.join("; "))),
        Some(Why::ByField(fields)) => {
            let mut all: Map<String, Value> =
                fields.iter().map(|(field, reason)| (field.clone(), json!(reason))).collect();
            all.extend(new.iter().map(|(field, reason)| ((*field).to_owned(), json!(reason))));
            Value::Object(all)
        }
        None => {
            Value::Object(new.iter().map(|(field, reason)| ((*field).to_owned(), json!(reason))).collect())
        }
    };
    Some(Cure { field: format!("{section}.why"), value })
}
