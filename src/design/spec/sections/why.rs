//! Reasons, as a design file gives them beside its values.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The reason for what a section says: one sentence for the whole, or one for each field.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Why {
    /// For the section as a whole.
    Whole(String),
    /// By the field's name.
    ByField(BTreeMap<String, String>),
}
