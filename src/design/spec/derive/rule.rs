//! One rule, and what it gave.

use serde_json::Value;

use super::known::Known;

/// How a left-out field is given.
#[derive(Clone, Copy)]
pub(super) enum Gives {
    /// Always the same, as JSON text.
    Fixed(&'static str),
    /// From fields that are known; `None` where the field does not apply.
    Follows(fn(&Known<'_>) -> Option<Value>),
}

/// One rule.
#[derive(Clone, Copy)]
pub(super) struct Rule {
    pub(super) field: &'static str,
    /// In a sentence, with its formula.
    pub(super) says: &'static str,
    pub(super) gives: Gives,
}

pub(super) const fn fixed(field: &'static str, json: &'static str, says: &'static str) -> Rule {
    Rule { field, says, gives: Gives::Fixed(json) }
}

pub(super) const fn follows(
    field: &'static str,
    says: &'static str,
    give: fn(&Known<'_>) -> Option<Value>,
) -> Rule {
    Rule { field, says, gives: Gives::Follows(give) }
}

/// A field that the file leaves out, with its value and where that comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct DerivedField {
    /// The field, as a path.
    pub field: &'static str,
    /// The rule, in a sentence.
    pub rule: &'static str,
    /// Its value.
    pub value: Value,
}
