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
    match nearest {
        Some((_, name)) => fault.with_help(format!("did you mean \"{name}\"?")),
        None => fault,
    }
}

pub(super) fn missing(name: &str, at: &str) -> DesignError {
    DesignError::at(join(at, name), "", "the field is missing", "")
}

pub(super) fn not_a_choice(choices: &[&Value], value: &Value, at: &str) -> DesignError {
    DesignError::at(at, value, "not one of the known choices", listed(choices))
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
