//! Faults against the schema in words.

use serde_json::{Map, Value};

use super::error::DesignError;

pub(super) fn unknown_key(key: &str, value: &Value, known: &Map<String, Value>, at: &str) -> DesignError {
    // Jaro-Winkler forgives swapped letters and a missing unit suffix, as people mistype keys
    let nearest = known
        .keys()
        .map(|name| (strsim::jaro_winkler(name, key), name))
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let names: Vec<&str> = known.keys().map(String::as_str).collect();
    let fault = DesignError::at(join(at, key), value, "unknown key", names.join(", "));
    let fault = fault.with_cure_data(Value::Null);
    match nearest {
        Some((_, name)) => fault.with_help(format!("did you mean \"{name}\"?")),
        None => fault,
    }
}

pub(super) fn missing(name: &str, at: &str) -> DesignError {
    DesignError::at(join(at, name), "", "the field is missing", "")
}

pub(super) fn not_a_choice(choices: &[&Value], value: &Value, at: &str) -> DesignError {
    let fault = DesignError::at(at, value, "not one of the known choices", listed(choices));
    let meant = value.as_str().unwrap_or_default();
    let likeness = |choice: &&&Value| strsim::jaro_winkler(choice.as_str().unwrap_or_default(), meant);
    match choices.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b))) {
        // objects that are distinguished by their keys are no values
        Some(choice) if !value.is_object() => fault.with_cure_data((*choice).clone()),
        _ => fault,
    }
}

/// A number that a range allows, near to one that it does not.
pub(super) fn within(schema: &Value, number: f64) -> Option<Value> {
    let bound = |name: &str| schema.get(name).and_then(Value::as_f64);
    let is_whole = schema.get("type").and_then(Value::as_str) == Some("integer");
    let (low, above) = (bound("minimum"), bound("exclusiveMinimum"));
    let (high, below) = (bound("maximum"), bound("exclusiveMaximum"));
    let bottom = low.or(above).unwrap_or(f64::NEG_INFINITY);
    let top = high.or(below).unwrap_or(f64::INFINITY);
    let step = if is_whole { 1.0 } else { 1f64.min(0.5 * (top - bottom)) };
    let is_low = low.is_some_and(|low| number < low) || above.is_some_and(|above| number <= above);
    let found = match (is_low, low, high) {
        (true, Some(low), _) => low,
        (true, None, _) => bottom + step,
        (false, _, Some(high)) => high,
        (false, _, None) => top - step,
    };
    let fits =
        found.is_finite() && low.is_none_or(|low| found >= low) && high.is_none_or(|high| found <= high);
    let value = || if is_whole { Value::from(found as i64) } else { Value::from(found) };
    fits.then(value)
}

pub(super) fn listed(values: &[&Value]) -> String {
    values.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

pub(super) fn kind_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(number) if number.as_f64().is_some_and(|n| n.fract() != 0.0) => "a fraction",
        Value::Number(_) => "a number",
        Value::String(_) => "text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}

pub(super) fn type_words(schema: &Value) -> &'static str {
    match schema.get("type").and_then(Value::as_str) {
        Some("number") => "a number",
        Some("integer") => "a whole number",
        Some("string") => "text",
        Some("boolean") => "true or false",
        Some("array") => "a list",
        Some("object") => "an object",
        _ => "another kind of value",
    }
}

pub(super) fn first_sentence(text: &str) -> &str {
    text.split_once(".\n")
        .or_else(|| text.split_once(". "))
        .map_or(text, |(first, _)| first)
        .trim_end_matches('.')
}

/// `a.b` from `a` and `b`.
pub(super) fn join(at: &str, key: &str) -> String {
    if at.is_empty() { key.to_owned() } else { format!("{at}.{key}") }
}
