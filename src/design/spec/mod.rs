//! From a design file to a resolved, validated [`Design`].
//!
//! A file is read strictly ([`read_text`], [`parse_json`]), checked against the schema that is made
//! from the section types ([`design_schema`]), and then resolved: rules that hold between fields are
//! checked and derived values are computed once. What later modules see is valid by construction;
//! they never check again, and they never see a default that the file does not state.

mod body_rules;
pub mod calibration;
pub mod catalogue;
mod change;
mod derive;
mod design;
mod error;
mod explain;
mod fill;
mod kind;
mod lens;
mod lints;
mod mount_rules;
mod resolve;
mod rules;
mod schema;
mod schema_faults;
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
pub use error::{Cure, DesignError};
pub use explain::{Explained, explain};
pub use fill::{Filled, Filling, fill, read_filled};
pub use kind::FileKind;
pub use schema::{design_schema, schema_of};
pub use sections::DesignFile;
pub use source::{parse as parse_json, read_text, read_text_from, read_up_to};

/// The fields that tracing and projecting need; nothing else in the file matters to them.
const OPTICS_FIELDS: [&str; 4] = ["name", "camera", "optics", "dome"];

impl Design {
    /// Reads and resolves a whole design file.
    ///
    /// # Errors
    /// The first fault of the file: see [`DesignError`].
    pub fn load(path: &Path) -> Result<Self, DesignError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        Self::from_text_with_cures(&read_text(path)?, folder).map_err(|error| error.in_file(path))
    }

    /// [`Design::from_text`], where a fault of the rules between fields names a change that was tried and takes it away.
    /// Trying takes some tenths of a second.
    ///
    /// # Errors
    /// As [`Design::from_text`].
    pub fn from_text_with_cures(text: &str, folder: &Path) -> Result<Self, DesignError> {
        filled_design(text, Some(folder)).map_err(|fault| match *fault {
            (error, Some(given)) => change::with_cures_by_rules(&given, error, |whole| {
                resolve::resolve(from_value(&whole)?, text, Vec::new()).map(|_| ())
            }),
            (error, None) => error,
        })
    }

    /// Resolves a design from its text; the paths in it are from `folder`.
    ///
    /// # Errors
    /// The first fault of the text: see [`DesignError`].
    pub fn from_text(text: &str, folder: &Path) -> Result<Self, DesignError> {
        filled_design(text, Some(folder)).map_err(|fault| fault.0)
    }
}

/// A fault, and the tree that it is of where every field is as the schema says.
type Unresolved = (DesignError, Option<Value>);

/// A design from its text, with what it takes from elsewhere; one that took something has a text of its own, complete
/// in itself. A fault comes with the filled tree, where there is one whose every field is as the schema says.
fn filled_design(text: &str, folder: Option<&Path>) -> Result<Design, Box<Unresolved>> {
    let plain = |error| Box::new((error, None));
    let mut value = parse_json(text).map_err(plain)?;
    check_kind(&value).map_err(plain)?;
    let filling = fill(&mut value, folder).map_err(plain)?;
    let filled = if filling.fields.is_empty() { None } else { Some(format!("{value:#}\n")) };
    schema::check(schema::open_schema(), &value, "").map_err(plain)?;
    let text = filled.as_deref().unwrap_or(text);
    let given = value.clone();
    let resolved =
        derive(&mut value).and_then(|derived| resolve::resolve(from_value(&value)?, text, derived));
    let mut design = resolved.map_err(|error| Box::new((error, Some(given))))?;
    design.warnings.extend(filling.warnings);
    Ok(design)
}

impl std::str::FromStr for Design {
    type Err = DesignError;

    /// Resolves a design from its text, which lies in no folder: see [`Design::from_text`].
    fn from_str(text: &str) -> Result<Self, DesignError> {
        filled_design(text, None).map_err(|fault| fault.0)
    }
}

/// Reads only the camera, the layers and the dome of a design; other fields may say anything.
///
/// # Errors
/// The first fault of those fields.
pub fn load_optics(path: &Path) -> Result<SensorOptics, DesignError> {
    let text = read_text(path)?;
    filled_optics(&text, path.parent()).map_err(|error| error.in_file(path))
}

/// [`load_optics`] on text.
///
/// # Errors
/// The first fault of those fields.
pub fn optics_from_text(text: &str) -> Result<SensorOptics, DesignError> {
    filled_optics(text, None)
}

fn filled_optics(text: &str, folder: Option<&Path>) -> Result<SensorOptics, DesignError> {
    let mut value = parse_json(text)?;
    FileKind::Design.expect(&value)?;
    // where the camera stands may follow from the whole design
    let is_whole = |path: &str| value.pointer(path).is_some();
    let given = ["/camera/position_mm", "/optics/layers"].into_iter().all(is_whole);
    let seen = ["/camera/field_of_view_deg", "/camera/calibration", "/camera/from"].into_iter().any(is_whole);
    if !(given && seen) {
        fill(&mut value, folder)?;
        schema::check(schema::open_schema(), &value, "")?;
        derive(&mut value)?;
    }
    if let Value::Object(map) = &mut value {
        map.retain(|key, _| OPTICS_FIELDS.contains(&key.as_str()));
    }
    fill(&mut value, folder)?;
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

/// A file of another version or kind would be full of unknown keys: say the real reason first.
fn check_kind(value: &Value) -> Result<(), DesignError> {
    FileKind::Design.expect(value)?;
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
