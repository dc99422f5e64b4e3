//! `domecast explain FIELD`

use std::path::Path;

use serde_json::{Value, json};

use super::output::{Failure, Output};

/// The design whose values and reasons are shown where none is named.
const EXAMPLE: &str = include_str!("../../../designs/thumb24.json");

/// Prints what a field means, its allowed values, and its value and reason in a design.
pub fn run(output: &Output, field: &str, design: Option<&Path>) -> Result<(), Failure> {
    let (name, value): (String, Value) = match design {
        Some(path) => (path.display().to_string(), domecast_design::read_filled(path)?),
        None => ("thumb24".into(), serde_json::from_str(EXAMPLE).unwrap_or_default()),
    };
    let mut value = value;
    let derived = domecast_design::derive(&mut value)?;
    let found = domecast_design::explain(field, &value)?;
    let by_rule: Vec<_> =
        derived.iter().filter(|one| field.is_empty() || is_below(one.field, &found.field)).collect();
    if !found.field.is_empty() {
        output.say(&found.field)?;
    }
    if !found.meaning.is_empty() {
        output.say(&format!("  {}", found.meaning))?;
    }
    for (head, text) in [("unit", found.unit), ("allowed", &found.allowed), ("", &found.presence)] {
        if !text.is_empty() && !found.field.is_empty() {
            output.say(&if head.is_empty() { format!("  {text}") } else { format!("  {head}: {text}") })?;
        }
    }
    if let Some(value) = found.value.as_ref().filter(|_| found.below.is_empty()) {
        output.say(&format!("  {name} has {value}"))?;
    }
    if let Some(why) = &found.why {
        output.say(&format!("  because: {why}"))?;
    }
    for (field, meaning) in &found.below {
        output.say(&format!("    {field:<28} {meaning}"))?;
    }
    if !by_rule.is_empty() {
        output.say(&format!("  {name} leaves to rules:"))?;
    }
    for one in &by_rule {
        output.say(&format!("    {} = {}: {}", one.field, one.value, one.rule))?;
    }
    output.result(&json!({
        "field": found.field,
        "meaning": found.meaning,
        "unit": found.unit,
        "allowed": found.allowed,
        "presence": found.presence,
        "value": found.value.and_then(|value| serde_json::from_str::<Value>(&value).ok()),
        "why": found.why,
        "derived": by_rule
            .iter()
            .map(|one| json!({ "field": one.field, "value": one.value, "rule": one.rule }))
            .collect::<Vec<_>>(),
        "below": found.below.iter().map(|(field, _)| field).collect::<Vec<_>>(),
    }))
}

/// Whether a field is another or lies below it.
fn is_below(field: &str, above: &str) -> bool {
    field.strip_prefix(above).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}
