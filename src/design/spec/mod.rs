//! From a design file to a resolved, validated [`Design`].
//!
//! A file is read strictly ([`read_text`], [`parse_json`]), checked against the schema that is made
//! from the section types ([`design_schema`]), and then resolved: rules that hold between fields are
//! checked and derived values are computed once. What later modules see is valid by construction;
//! they never check again, and they never see a default that the file does not state.

mod derive;
mod design;
mod error;
mod explain;
mod lens;
mod lints;
mod resolve;
mod rules;
mod schema;
pub mod sections;
pub mod settings;
mod source;
#[cfg(test)]
mod tests;

use std::path::Path;

use serde::de::DeserializeOwned;
use serde_json::Value;

use domecast_optics::SensorOptics;

pub use derive::{DerivedField, derive, rule_of};
pub use design::{Design, DesignWarning};
pub use error::DesignError;
pub use explain::{Explained, explain};
pub use schema::{design_schema, schema_of};
pub use sections::DesignFile;
pub use source::{parse as parse_json, read_text};

/// The fields that tracing and projecting need; nothing else in the file matters to them.
const OPTICS_FIELDS: [&str; 4] = ["name", "camera", "optics", "dome"];

impl Design {
    /// Reads and resolves a whole design file.
    ///
    /// # Errors
    /// The first fault of the file: see [`DesignError`].
    pub fn load(path: &Path) -> Result<Self, DesignError> {
        read_text(path)?.parse().map_err(|error: DesignError| error.in_file(path))
    }
}

impl std::str::FromStr for Design {
    type Err = DesignError;

    /// Resolves a design from its text.
    fn from_str(text: &str) -> Result<Self, DesignError> {
        let mut value = parse_json(text)?;
        check_version(&value)?;
        schema::check(design_schema(), &value, "")?;
        let derived = derive(&mut value)?;
        resolve::resolve(from_value(&value)?, text, derived)
    }
}

/// Reads only the camera, the layers and the dome of a design; other fields may say anything.
///
/// # Errors
/// The first fault of those fields.
pub fn load_optics(path: &Path) -> Result<SensorOptics, DesignError> {
    let text = read_text(path)?;
    optics_from_text(&text).map_err(|error| error.in_file(path))
}

/// [`load_optics`] on text.
///
/// # Errors
/// The first fault of those fields.
pub fn optics_from_text(text: &str) -> Result<SensorOptics, DesignError> {
    let mut value = parse_json(text)?;
    // where the camera stands may follow from the whole design
    let is_whole = |path: &str| value.pointer(path).is_some();
    if !["/camera/position_mm", "/camera/field_of_view_deg", "/optics/layers"].into_iter().all(is_whole) {
        schema::check(design_schema(), &value, "")?;
        derive(&mut value)?;
    }
    if let Value::Object(map) = &mut value {
        map.retain(|key, _| OPTICS_FIELDS.contains(&key.as_str()));
    }
    let file: sections::OpticsFile = from_value(&value)?;
    resolve::optics(&file.camera, &file.optics, &file.dome)
}

/// Checks a tree against the schema of `T`, then reads it: for files of other kinds than designs too.
///
/// # Errors
/// The first fault of the tree, by its field.
pub fn from_value<T: DeserializeOwned + schemars::JsonSchema>(value: &Value) -> Result<T, DesignError> {
    schema::check(&schema_of::<T>(), value, "")?;
    // the schema is made from the same types, so this fails only where the schema cannot say a rule
    serde_json::from_value(value.clone())
        .map_err(|error| DesignError::at("", "", error.to_string(), "what `domecast schema` describes"))
}

/// A file of another version would be full of unknown keys: say the real reason first.
fn check_version(value: &Value) -> Result<(), DesignError> {
    match value.get("version") {
        Some(Value::Number(number)) if number.as_u64() != Some(1) => Err(DesignError::at(
            "version",
            number,
            "this release does not read that version of the design file",
            "1",
        )
        .with_help("start from a current example, such as designs/thumb24.json")),
        _ => Ok(()),
    }
}
