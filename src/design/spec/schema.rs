//! The JSON schema of the design file and the check of a file against it.
//!
//! The schema is made from the section types themselves, so that the file that editors complete,
//! the text of `domecast schema` and the check done here cannot drift apart. A general schema
//! validator would find the same faults; this walk is ours for the sake of its messages.

use std::sync::OnceLock;

use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value};

use super::error::DesignError;
use super::schema_faults::{
    first_sentence, join, kind_of, listed, missing, not_a_choice, type_words, unknown_key, within,
};
use super::sections::DesignFile;

/// The JSON schema (draft 2020-12) of the design file.
pub fn design_schema() -> &'static Value {
    static SCHEMA: OnceLock<Value> = OnceLock::new();
    SCHEMA.get_or_init(|| {
        let mut schema = open_schema().clone();
        super::fill::relax(&mut schema);
        schema
    })
}

/// The schema of a design in which what it takes from elsewhere is filled in.
pub(super) fn strict_schema() -> &'static Value {
    static SCHEMA: OnceLock<Value> = OnceLock::new();
    SCHEMA.get_or_init(schema_of::<DesignFile>)
}

/// The schema of a design of which rules give what it leaves out.
pub(super) fn open_schema() -> &'static Value {
    static SCHEMA: OnceLock<Value> = OnceLock::new();
    SCHEMA.get_or_init(|| {
        let mut schema = strict_schema().clone();
        for field in super::derive::fields() {
            let keys: Vec<&str> = field.split('.').collect();
            // a section of which every field may be left out may be left out itself
            for depth in (1..=keys.len()).rev() {
                let (above, last) = keys[..depth].split_at(depth - 1);
                if !not_required(&mut schema, above, last[0]) {
                    break;
                }
            }
        }
        schema
    })
}

/// Takes a key from what the object at a path requires; whether that object then requires nothing more.
fn not_required(schema: &mut Value, path: &[&str], key: &str) -> bool {
    let mut place = String::new();
    for step in path {
        place += &format!("/properties/{step}");
        let Some(name) = schema.pointer(&place).and_then(|found| found.get("$ref")?.as_str()) else {
            continue;
        };
        place = name.trim_start_matches('#').to_owned();
    }
    let Some(object) = schema.pointer_mut(&place) else { return false };
    let Some(required) = object.get_mut("required").and_then(Value::as_array_mut) else { return true };
    required.retain(|name| name != key);
    required.is_empty()
}

/// The schema of any type of ours, without the `null` that optional fields would allow: in a
/// file that people write, a field either says something or is left out.
pub fn schema_of<T: JsonSchema>() -> Value {
    let generator =
        SchemaSettings::draft2020_12().with_transform(RecursiveTransform(forbid_null)).into_generator();
    generator.into_root_schema_for::<T>().to_value()
}

fn forbid_null(schema: &mut Schema) {
    let Some(object) = schema.as_object_mut() else { return };
    if let Some(Value::Array(types)) = object.get_mut("type") {
        types.retain(|name| name != "null");
        if let [only] = types.as_slice() {
            let only = only.clone();
            object.insert("type".into(), only);
        }
    }
    if let Some(Value::Array(options)) = object.get_mut("anyOf") {
        options.retain(|option| option.get("type") != Some(&Value::from("null")));
        if let [Value::Object(only)] = options.as_slice() {
            let only = only.clone();
            object.remove("anyOf");
            for (key, value) in only {
                object.entry(key).or_insert(value);
            }
        }
    }
    if object.get("default") == Some(&Value::Null) {
        object.remove("default");
    }
}

/// Checks `value` against the schema of `T`, naming every fault by its path below `at`.
///
/// # Errors
/// Unknown keys (with the nearest known one), missing fields, wrong types, values out of range.
pub fn check(schema: &Value, value: &Value, at: &str) -> Result<(), DesignError> {
    Walk { definitions: schema.get("$defs").and_then(Value::as_object) }.visit(schema, value, at)
}

struct Walk<'a> {
    definitions: Option<&'a Map<String, Value>>,
}

impl<'a> Walk<'a> {
    fn resolve(&self, schema: &'a Value) -> &'a Value {
        let name = schema.get("$ref").and_then(Value::as_str).and_then(|path| path.strip_prefix("#/$defs/"));
        name.and_then(|name| self.definitions?.get(name)).unwrap_or(schema)
    }

    fn visit(&self, schema: &'a Value, value: &Value, at: &str) -> Result<(), DesignError> {
        let schema = self.resolve(schema);
        if let Some(options) = alternatives(schema) {
            return self.visit_alternatives(schema, options, value, at);
        }
        check_type(schema, value, at)?;
        check_choice(schema, value, at)?;
        match value {
            Value::Number(number) => check_range(schema, number.as_f64().unwrap_or(f64::NAN), value, at),
            Value::Array(items) => self.visit_items(schema, items, at),
            Value::Object(map) => self.visit_object(schema, map, at),
            _ => Ok(()),
        }
    }

    /// Tagged alternatives are distinguished by their tag, others by the kind of JSON value, so that the
    /// message speaks of the alternative that the writer meant.
    fn visit_alternatives(
        &self,
        schema: &'a Value,
        options: &'a [Value],
        value: &Value,
        at: &str,
    ) -> Result<(), DesignError> {
        let options: Vec<&Value> = options.iter().map(|option| self.resolve(option)).collect();
        let constants: Vec<&Value> = options
            .iter()
            .flat_map(|option| option.get("const").into_iter().chain(enumerated(option)))
            .collect();
        if constants.len() >= options.len() {
            return if constants.contains(&value) {
                Ok(())
            } else {
                Err(not_a_choice(&constants, value, at))
            };
        }
        if let (Some(tag), Value::Object(map)) = (tag_of(&options), value) {
            let tags: Vec<&Value> = options
                .iter()
                .filter_map(|option| option.pointer(&format!("/properties/{tag}/const")))
                .collect();
            let Some(stands) = map.get(&tag) else {
                return Err(missing(&tag, at).with_help(format!("one of {}", listed(&tags))));
            };
            let found = options
                .iter()
                .find(|option| option.pointer(&format!("/properties/{tag}/const")) == Some(stands));
            return match found {
                // fields that stand beside the alternatives belong to each of them
                Some(option) => self.visit_object_with(option, Some(schema), map, at),
                None => Err(not_a_choice(&tags, stands, &join(at, &tag))),
            };
        }
        let mut fitting: Vec<&&Value> = options.iter().filter(|option| type_fits(option, value)).collect();
        // alternatives named by their only key: take the one whose key stands there
        if let (true, Value::Object(map)) = (fitting.len() > 1, value) {
            let named: Vec<&Value> =
                fitting.iter().filter_map(|option| option.pointer("/required/0")).collect();
            if !map.keys().any(|key| named.iter().any(|name| *name == key)) {
                return Err(not_a_choice(&named, value, at));
            }
            fitting.retain(|option| {
                let required = option.pointer("/required/0").and_then(Value::as_str);
                required.is_none_or(|name| map.contains_key(name))
            });
        }
        let mut first_fault = None;
        for option in &fitting {
            match self.visit(option, value, at) {
                Ok(()) => return Ok(()),
                Err(fault) => first_fault = first_fault.or(Some(fault)),
            }
        }
        Err(first_fault.unwrap_or_else(|| {
            let names: Vec<&str> = options.iter().map(|option| type_words(option)).collect();
            DesignError::at(
                at,
                value,
                format!("{} does not belong here", kind_of(value)),
                names.join(", or "),
            )
        }))
    }

    fn visit_items(&self, schema: &'a Value, items: &[Value], at: &str) -> Result<(), DesignError> {
        let whole = || Value::Array(items.to_vec());
        let bound =
            |name: &str| schema.get(name).and_then(Value::as_u64).and_then(|n| usize::try_from(n).ok());
        let (min, max) = (bound("minItems"), bound("maxItems"));
        if min.is_some_and(|min| items.len() < min) || max.is_some_and(|max| items.len() > max) {
            let allowed = match (min, max) {
                (Some(min), Some(max)) if min == max => format!("exactly {min}"),
                (Some(min), Some(max)) => format!("{min} to {max}"),
                (Some(min), None) => format!("at least {min}"),
                (_, max) => format!("at most {}", max.unwrap_or(0)),
            };
            return Err(DesignError::at(
                at,
                whole(),
                format!("the list has {} entries", items.len()),
                allowed,
            ));
        }
        if let Some(each) = schema.get("items") {
            let visited = items
                .iter()
                .enumerate()
                .map(|(index, item)| self.visit(each, item, &format!("{at}[{index}]")));
            return DesignError::all(visited.filter_map(Result::err).collect());
        }
        Ok(())
    }

    fn visit_object(&self, schema: &'a Value, map: &Map<String, Value>, at: &str) -> Result<(), DesignError> {
        self.visit_object_with(schema, None, map, at)
    }

    fn visit_object_with(
        &self,
        schema: &'a Value,
        beside: Option<&'a Value>,
        map: &Map<String, Value>,
        at: &str,
    ) -> Result<(), DesignError> {
        let sources = [Some(schema), beside];
        let known: Map<String, Value> = sources
            .iter()
            .flatten()
            .filter_map(|source| source.get("properties")?.as_object())
            .flat_map(|properties| properties.iter().map(|(key, value)| (key.clone(), value.clone())))
            .collect();
        let mut faults = Vec::new();
        for (key, value) in map {
            let found = sources
                .iter()
                .flatten()
                .find_map(|source| source.get("properties").and_then(|all| all.get(key)));
            match (found, schema.get("additionalProperties")) {
                (Some(field), _) => faults.extend(self.visit(field, value, &join(at, key)).err()),
                (None, Some(rest @ Value::Object(_))) => {
                    faults.extend(self.visit(rest, value, &join(at, key)).err());
                }
                (None, None | Some(Value::Bool(true))) if known.is_empty() => {}
                (None, _) => faults.push(unknown_key(key, value, &known, at)),
            }
        }
        for source in sources.iter().flatten() {
            for name in source.get("required").and_then(Value::as_array).into_iter().flatten() {
                if let Some(name) = name.as_str().filter(|name| !map.contains_key(*name)) {
                    let about =
                        known.get(name).and_then(|field| field.get("description")).and_then(Value::as_str);
                    let fault = missing(name, at);
                    faults.push(match about {
                        Some(about) => fault.with_help(format!("it says: {}", first_sentence(about))),
                        None => fault,
                    });
                }
            }
        }
        if let Some(Value::Object(reasons)) = map.get("why") {
            // a reason for a field that does not exist is a misspelt field
            if let Some((key, value)) = reasons.iter().find(|(key, _)| !known.contains_key(*key)) {
                faults.push(unknown_key(key, value, &known, &join(at, "why")));
            }
        }
        DesignError::all(faults)
    }
}

fn alternatives(schema: &Value) -> Option<&[Value]> {
    let options = schema.get("oneOf").or_else(|| schema.get("anyOf"))?;
    options.as_array().map(Vec::as_slice)
}

fn enumerated(schema: &Value) -> impl Iterator<Item = &Value> {
    schema.get("enum").and_then(Value::as_array).into_iter().flatten()
}

/// The property that every alternative fixes to a constant.
fn tag_of(options: &[&Value]) -> Option<String> {
    let first = options.first()?.get("properties")?.as_object()?;
    let is_tag = |name: &&String| {
        options.iter().all(|option| option.pointer(&format!("/properties/{name}/const")).is_some())
    };
    first.keys().find(is_tag).cloned()
}

fn check_type(schema: &Value, value: &Value, at: &str) -> Result<(), DesignError> {
    if type_fits(schema, value) {
        return Ok(());
    }
    let fault =
        DesignError::at(at, value, format!("{} does not belong here", kind_of(value)), type_words(schema));
    let reads_as_number = |text: &str| text.trim().replacen(',', ".", 1).parse::<f64>().is_ok();
    let fault = match value.as_str().and_then(|text| read_number(schema, text)) {
        Some(number) => fault.with_cure_data(number),
        None => fault,
    };
    match value.as_str() {
        Some(text) if text.contains(',') && reads_as_number(text) => {
            Err(fault.with_help("a decimal comma? JSON wants a bare number with a point, as in 10.5"))
        }
        Some(text) if reads_as_number(text) => Err(fault.with_help("write the number without quotes")),
        _ => Err(fault),
    }
}

/// The number that a text says, where the schema wants one.
fn read_number(schema: &Value, text: &str) -> Option<Value> {
    let number: Value = serde_json::from_str(&text.trim().replacen(',', ".", 1)).ok()?;
    (number.is_number() && type_fits(schema, &number)).then_some(number)
}

fn type_fits(schema: &Value, value: &Value) -> bool {
    let fits = |name: &str| match name {
        "number" => value.is_number(),
        "integer" => value.as_f64().is_some_and(|number| number.fract() == 0.0),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        _ => value.is_null(),
    };
    match schema.get("type") {
        Some(Value::String(name)) => fits(name),
        Some(Value::Array(names)) => names.iter().filter_map(Value::as_str).any(fits),
        _ => true,
    }
}

fn check_choice(schema: &Value, value: &Value, at: &str) -> Result<(), DesignError> {
    let choices: Vec<&Value> = schema.get("const").into_iter().chain(enumerated(schema)).collect();
    if choices.is_empty() || choices.contains(&value) {
        return Ok(());
    }
    Err(not_a_choice(&choices, value, at))
}

fn check_range(schema: &Value, number: f64, value: &Value, at: &str) -> Result<(), DesignError> {
    let bound = |name: &str| schema.get(name).and_then(Value::as_f64);
    let rules = [
        (bound("minimum"), "at least", number >= bound("minimum").unwrap_or(number)),
        (
            bound("exclusiveMinimum"),
            "more than",
            number > bound("exclusiveMinimum").unwrap_or(f64::NEG_INFINITY),
        ),
        (bound("maximum"), "at most", number <= bound("maximum").unwrap_or(number)),
        (bound("exclusiveMaximum"), "less than", number < bound("exclusiveMaximum").unwrap_or(f64::INFINITY)),
    ];
    if rules.iter().all(|(_, _, holds)| *holds) {
        return Ok(());
    }
    let allowed: Vec<String> =
        rules.iter().filter_map(|(bound, word, _)| bound.map(|bound| format!("{word} {bound}"))).collect();
    let fault = DesignError::at(at, value, "the value is out of range", allowed.join(" and "));
    let fault = match within(schema, number) {
        Some(value) => fault.with_cure_data(value),
        None => fault,
    };
    let in_degrees = number.to_degrees();
    let could_be = bound("minimum").is_none_or(|low| in_degrees >= low) && in_degrees <= 360.0;
    if at.ends_with("_deg") && number > 0.0 && could_be {
        return Err(
            fault.with_help(format!("radians for degrees? {number} rad would be {in_degrees:.1} degrees"))
        );
    }
    Err(fault)
}
