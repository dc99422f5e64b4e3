//! One side of a comparison: a design, built in memory, or the folder of a build.

use std::path::Path;

use serde_json::Value;

use crate::build;
use crate::build::{BuildError, DESIGN_NAME, MANIFEST_NAME};
use domecast_design::DesignError;

const CONSTANTS: &str = "constants/constants.json";
const FORCES: &str = "report/force.json";

/// What is compared of a design or a build.
#[derive(Debug, Clone, PartialEq)]
pub struct CompareSide {
    /// The design as written.
    pub design: Value,
    /// `constants.json`.
    pub constants: Value,
    /// `manifest.json`.
    pub manifest: Value,
    /// `report/force.json`.
    pub forces: Value,
}

impl CompareSide {
    /// Reads the folder of a build, or builds a design file in memory.
    ///
    /// # Errors
    /// [`BuildError::Design`] with the file at fault; a folder that holds no build names the file that is missing.
    pub fn open(path: &Path, step: &mut dyn FnMut(&str)) -> Result<Self, BuildError> {
        if path.is_dir() {
            return Ok(Self::of_build(path)?);
        }
        let design = domecast_design::Design::load(path)?;
        let made = build::build(&design, step).map_err(|error| match error {
            BuildError::Design(error) => error.in_file(path).into(),
            ours @ BuildError::Ours(_) => ours,
        })?;
        let file = |name: &str| {
            let bytes = made.tree.files().find(|(path, _)| *path == name).map(|(_, bytes)| bytes);
            bytes.and_then(|bytes| serde_json::from_slice(bytes).ok()).unwrap_or_default()
        };
        Ok(Self {
            design: file(DESIGN_NAME),
            constants: file(CONSTANTS),
            manifest: file(MANIFEST_NAME),
            forces: file(FORCES),
        })
    }

    fn of_build(folder: &Path) -> Result<Self, DesignError> {
        let file = |name: &str| {
            let path = folder.join(name);
            let text = domecast_design::read_text(&path).map_err(|error| {
                error.with_help("name a design file, or a folder that `domecast build` wrote")
            })?;
            domecast_design::parse_json(&text).map_err(|error| error.in_file(&path))
        };
        Ok(Self {
            design: file(DESIGN_NAME)?,
            constants: file(CONSTANTS)?,
            manifest: file(MANIFEST_NAME)?,
            forces: file(FORCES)?,
        })
    }

    /// The design's name.
    pub fn name(&self) -> String {
        self.design.get("name").and_then(Value::as_str).unwrap_or("(without a name)").to_owned()
    }
}

/// A list of N numbers in a JSON object.
pub(super) fn numbers<const N: usize>(value: &Value, key: &str) -> Option<[f64; N]> {
    let list = value.get(key)?.as_array()?;
    let numbers: Vec<f64> = list.iter().filter_map(Value::as_f64).collect();
    numbers.try_into().ok()
}
