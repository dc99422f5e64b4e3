//! What a field of the design file means: from the schema that the sections' types make, and from a design at hand.

use serde_json::Value;

use super::error::DesignError;
use super::schema::strict_schema;

/// A field, explained.
#[derive(Debug, Clone, PartialEq)]
pub struct Explained {
    /// Its path, as in messages: `optics.layers[0].index`.
    pub field: String,
    /// What it means; the unit stands in the field's name.
    pub meaning: String,
    /// Its unit, read from its name; empty for what has none.
    pub unit: &'static str,
    /// What may stand there, in words.
    pub allowed: String,
    /// Whether the file must have it, and what is taken where it has not.
    pub presence: String,
    /// What stands there in the design at hand, as JSON; `None` where it has no such field.
    pub value: Option<String>,
    /// Why it stands there: the design's own words.
    pub why: Option<String>,
    /// Fields below it, each with the first sentence of its meaning.
    pub below: Vec<(String, String)>,
}

/// The units that names end in.
const UNITS: [(&str, &str); 20] = [
    ("_mw_per_ma", "mW/mA"),
    ("_k_per_w", "K/W"),
    ("_n_per_mm", "N/mm"),
    ("_nmm", "N*mm"),
    ("_g_per_cm3", "g/cm^3"),
    ("_mpa", "MPa"),
    ("_mps2", "m/s^2"),
    ("_percent", "percent"),
    ("_deg", "degrees"),
    ("_rad", "rad"),
    ("_mm", "mm"),
    ("_px", "px"),
    ("_ma", "mA"),
    ("_mw", "mW"),
    ("_c", "degrees C"),
    ("_n", "N"),
    ("_v", "V"),
    ("_g", "g"),
    ("_t", "T"),
    ("dpi", "dots per inch"),
];

/// Explains a field; `design` is the text of a design that shows a value and its reason.
///
/// # Errors
/// A path that the design file has no field for, with the nearest that it has.
pub fn explain(field: &str, design: &Value) -> Result<Explained, DesignError> {
    let root = strict_schema();
    let mut schema = root;
    let mut required = true;
    let mut value = Some(design);
    let mut why: Option<String> = None;
    let mut path = String::new();
    for piece in pieces(field) {
        match piece {
            PathPart::Index(index) => {
                let Some(items) = items_of(root, schema) else {
                    return Err(unknown(&format!("{path}[{index}]"), &path, "is no list", &[]));
                };
                schema = items;
                value = value.and_then(|value| value.get(index));
                path = format!("{path}[{index}]");
            }
            PathPart::Key(key) => {
                // a list's items may be meant without an index
                if property(root, schema, key).is_none()
                    && let Some(items) = items_of(root, schema)
                {
                    schema = items;
                    value = value.and_then(|value| value.get(0));
                    path += "[]";
                }
                let Some((found, must)) = property(root, schema, key) else {
                    let known: Vec<String> =
                        properties(root, schema).into_iter().map(|(name, ..)| name).collect();
                    return Err(unknown(key, &path, "has no such field", &known));
                };
                if let Some(reason) = value.and_then(|value| value.get("why")) {
                    why = match reason {
                        Value::String(whole) => Some(whole.clone()),
                        by_field => by_field.get(key).and_then(Value::as_str).map(str::to_owned),
                    };
                }
                schema = found;
                required = must;
                value = value.and_then(|value| value.get(key));
                path = if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
            }
        }
    }
    let last = path.rsplit('.').next().unwrap_or_default().trim_end_matches("[]").to_owned();
    let resolved = resolve(root, schema);
    Ok(Explained {
        unit: UNITS
            .iter()
            .find(|(end, _)| last.split('[').next().is_some_and(|name| name.ends_with(end)))
            .map_or("", |u| u.1),
        meaning: text(schema, "description").or_else(|| text(resolved, "description")).unwrap_or_default(),
        allowed: allowed(root, schema),
        presence: match (
            super::derive::rule_of(&path),
            required,
            schema.get("default").or_else(|| resolved.get("default")),
        ) {
            (Some(rule), ..) => format!("may be left out; then by a rule: {rule}"),
            (_, _, Some(default)) if !default.is_null() => format!("may be left out; then {default}"),
            (_, true, _) => "must be there".to_owned(),
            (_, false, _) => "may be left out".to_owned(),
        },
        value: value.filter(|value| !value.is_null()).map(Value::to_string),
        why,
        below: properties(root, schema)
            .into_iter()
            .filter(|(name, ..)| name != "why")
            .map(|(name, below, _)| {
                let meaning =
                    text(below, "description").or_else(|| text(resolve(root, below), "description"));
                (name, meaning.unwrap_or_default().split(['\n', ';']).next().unwrap_or_default().to_owned())
            })
            .collect(),
        field: path,
    })
}

enum PathPart<'a> {
    Key(&'a str),
    Index(usize),
}

/// `optics.layers[0].index` in pieces; an empty path is the file itself.
fn pieces(field: &str) -> Vec<PathPart<'_>> {
    let mut found = Vec::new();
    for part in field.split(['.', '/']).filter(|part| !part.is_empty()) {
        let mut rest = part.split('[');
        if let Some(key) = rest.next().filter(|key| !key.is_empty()) {
            found.push(PathPart::Key(key));
        }
        found.extend(rest.filter_map(|index| index.trim_end_matches(']').parse().ok()).map(PathPart::Index));
    }
    found
}

fn resolve<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
    let name = schema.get("$ref").and_then(Value::as_str).and_then(|path| path.strip_prefix("#/$defs/"));
    name.and_then(|name| root.get("$defs")?.get(name)).unwrap_or(schema)
}

/// A schema and the alternatives that it offers.
fn forms<'a>(root: &'a Value, schema: &'a Value) -> Vec<&'a Value> {
    let schema = resolve(root, schema);
    let options = ["oneOf", "anyOf"].iter().filter_map(|key| schema.get(key)?.as_array()).flatten();
    std::iter::once(schema).chain(options.map(|option| resolve(root, option))).collect()
}

/// Name, schema and necessity of each field below a schema.
fn properties<'a>(root: &'a Value, schema: &'a Value) -> Vec<(String, &'a Value, bool)> {
    let mut found: Vec<(String, &Value, bool)> = Vec::new();
    let list = forms(root, schema)
        .into_iter()
        .chain(items_of(root, schema).into_iter().flat_map(|s| forms(root, s)));
    for form in list {
        let must = form.get("required").and_then(Value::as_array);
        for (name, below) in form.get("properties").and_then(Value::as_object).into_iter().flatten() {
            if found.iter().all(|(known, ..)| known != name) {
                let required = must.is_some_and(|must| must.iter().any(|key| key == name));
                found.push((name.clone(), below, required));
            }
        }
    }
    found
}

fn property<'a>(root: &'a Value, schema: &'a Value, key: &str) -> Option<(&'a Value, bool)> {
    forms(root, schema).into_iter().find_map(|form| {
        let below = form.get("properties")?.get(key)?;
        let must = form.get("required").and_then(Value::as_array);
        Some((below, must.is_some_and(|must| must.iter().any(|name| name == key))))
    })
}

fn items_of<'a>(root: &'a Value, schema: &'a Value) -> Option<&'a Value> {
    forms(root, schema).into_iter().find_map(|form| form.get("items").filter(|items| items.is_object()))
}

fn text(schema: &Value, key: &str) -> Option<String> {
    // lines are broken for the source file's sake only
    schema.get(key).and_then(Value::as_str).map(|text| text.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// What may stand there: kind, choices, range, length.
fn allowed(root: &Value, schema: &Value) -> String {
    let mut words: Vec<String> = Vec::new();
    let mut add = |word: String| {
        if !word.is_empty() && !words.contains(&word) {
            words.push(word);
        }
    };
    for form in forms(root, schema) {
        if let Some(constant) = form.get("const") {
            let meaning = text(form, "description").map(|text| format!(" ({text})")).unwrap_or_default();
            add(format!("{constant}{meaning}"));
            continue;
        }
        for choice in form.get("enum").and_then(Value::as_array).into_iter().flatten() {
            add(choice.to_string());
        }
        if form.get("enum").is_none() {
            add(form.get("type").and_then(Value::as_str).unwrap_or_default().to_owned());
        }
        for (key, phrase) in [
            ("minimum", "at least"),
            ("exclusiveMinimum", "more than"),
            ("maximum", "at most"),
            ("exclusiveMaximum", "less than"),
            ("minItems", "items: at least"),
            ("maxItems", "items: at most"),
        ] {
            if let Some(limit) = form.get(key) {
                add(format!("{phrase} {limit}"));
            }
        }
    }
    words.join(", ")
}

fn unknown(piece: &str, path: &str, problem: &str, known: &[String]) -> DesignError {
    let place = if path.is_empty() { "the design file".to_owned() } else { format!("`{path}`") };
    let fault = DesignError::at(
        if path.is_empty() { piece.to_owned() } else { format!("{path}.{piece}") },
        "",
        format!("{place} {problem}"),
        known.join(", "),
    );
    let nearest =
        known.iter().max_by(|a, b| strsim::jaro_winkler(a, piece).total_cmp(&strsim::jaro_winkler(b, piece)));
    match nearest {
        Some(name) => fault.with_help(format!("did you mean \"{name}\"?")),
        None => fault,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn thumb24() -> Value {
        serde_json::from_str(include_str!("../../../designs/thumb24.json")).unwrap()
    }

    #[test]
    fn a_field_is_explained_with_value_and_reason() {
        let found = explain("dome.radius_mm", &thumb24()).unwrap();
        assert_eq!(found.unit, "mm");
        assert_eq!(found.value.as_deref(), Some("10"));
        assert!(found.why.unwrap().contains("20 mm diameter"), "the section's reason");
        assert!(found.meaning.len() > 10 && found.allowed.contains("number"));
    }

    #[test]
    fn lists_can_be_walked_with_and_without_an_index() {
        let with = explain("optics.layers[1].index", &thumb24()).unwrap();
        let without = explain("optics.layers.index", &thumb24()).unwrap();
        assert_eq!(with.meaning, without.meaning);
        assert!(with.value.unwrap().contains("1.412"));
    }

    #[test]
    fn every_field_of_a_design_has_a_meaning() {
        fn walk(value: &Value, path: &str, design: &Value, looked: &mut u32) {
            let Value::Object(map) = value else { return };
            for (key, below) in map.iter().filter(|(key, _)| *key != "why" && *key != "facts") {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                let found = explain(&path, design).unwrap_or_else(|error| panic!("{path}: {error}"));
                assert!(!found.meaning.is_empty(), "{path} is not explained");
                *looked += 1;
                walk(below, &path, design, looked);
            }
        }
        let design = thumb24();
        let mut looked = 0;
        walk(&design, "", &design, &mut looked);
        assert!(looked > 120, "{looked}");
    }

    #[test]
    fn an_unknown_field_names_the_nearest() {
        let error = explain("dome.radius", &json!({})).unwrap_err();
        assert!(error.to_string().contains("radius_mm"), "{error}");
        assert!(explain("dom.radius_mm", &json!({})).unwrap_err().to_string().contains("\"dome\""));
        assert!(explain("dome[3]", &json!({})).is_err());
        assert!(explain("", &json!({})).unwrap().below.len() > 20);
    }
}
