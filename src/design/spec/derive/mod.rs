//! Fields that a design file may leave out, and the rules that give them.
//!
//! Every rule stands in a table, in the order in which they are applied: a rule reads only fields that the file gives
//! or that an earlier rule gave, so none can depend on itself. A field that stands in the file always wins.
//!
//! The rules are those that `designs/thumb24.json` was drawn by, written out: heights from what must fit over each
//! other, radii from the camera's view, sides from the radii and the process's walls. They are choices, not optima.

mod board;
mod camera;
mod electrical;
mod geometry;
mod known;
mod making;
mod mount;
mod pattern;
mod platforms;
mod room;
mod rule;
mod springs;
#[cfg(test)]
mod tests;

use serde_json::{Map, Value};

use super::error::DesignError;
use known::Known;
pub use rule::DerivedField;
use rule::{Gives, Rule};

/// All rules, in the order in which they are applied.
fn rules() -> impl Iterator<Item = &'static Rule> {
    [
        making::PROCESS,
        camera::LENS,
        camera::LAYERS,
        camera::BODY,
        springs::PURCHASED,
        mount::POSTS,
        platforms::LIGHTS,
        springs::LOADS,
        platforms::HEIGHTS,
        camera::PLACE,
        platforms::LIGHT_PLACES,
        springs::RING,
        platforms::OUTLINE,
        mount::POST_PLACES,
        platforms::LOWER,
        electrical::CIRCUIT,
        electrical::HEAT,
        electrical::BOARD,
        pattern::RULES,
        making::TOOLS,
        making::EXACTNESS,
    ]
    .into_iter()
    .flatten()
}

/// The rule of a field that may be left out, in a sentence; `None` where a file must give it.
pub fn rule_of(field: &str) -> Option<&'static str> {
    rules().find(|rule| rule.field == field).map(|rule| rule.says)
}

/// The fields that may be left out.
pub(super) fn fields() -> impl Iterator<Item = &'static str> {
    rules().map(|rule| rule.field)
}

/// Gives every left-out field of a design file's tree its value; what was given is returned in the order of the rules.
///
/// # Errors
/// A rule whose fields make no number: a lens that cannot be, or one that sees nothing of the dome.
pub fn derive(design: &mut Value) -> Result<Vec<DerivedField>, DesignError> {
    let mut given = Vec::new();
    let stripped = mount::to_strip(design);
    for rule in rules() {
        if known::lookup(design, rule.field).is_some() {
            continue;
        }
        let value = match rule.gives {
            Gives::Fixed(json) => Some(serde_json::from_str(json).unwrap_or(Value::Null)),
            Gives::Follows(give) => {
                let known = Known::new(design);
                let value = give(&known);
                if let Some(fault) = known.fault() {
                    return Err(DesignError::at(
                        rule.field,
                        "",
                        format!("the field is left out, and its rule ({}) has no result: {fault}", rule.says),
                        "a value in the file, or other values that it follows from",
                    ));
                }
                value
            }
        };
        if let Some(value) = value {
            put(design, rule.field, value.clone());
            given.push(DerivedField { field: rule.field, rule: rule.says, value });
        }
    }
    mount::strip(design, &stripped, &mut given);
    Ok(given)
}

/// Puts a value at a path of keys; what stands in the way and is no object is left to the schema's check.
fn put(tree: &mut Value, path: &str, value: Value) {
    let mut place = tree;
    let mut keys = path.split('.').peekable();
    while let Some(key) = keys.next() {
        let Value::Object(map) = place else { return };
        if keys.peek().is_none() {
            map.insert(key.to_owned(), value);
            return;
        }
        place = map.entry(key).or_insert_with(|| Value::Object(Map::new()));
    }
}
