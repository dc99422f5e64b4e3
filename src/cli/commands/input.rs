//! What commands read alike: constants, and faults of an input file.

use std::path::{Path, PathBuf};

use super::output::Failure;
use domecast_design::{DesignError, FileKind, read_text};
use domecast_runtime::constants::{Constants, ConstantsError};

/// The failure of an input file: what is wrong with it, and what is allowed.
pub fn input_fault(path: &Path, problem: impl Into<String>, allowed: &str) -> Failure {
    DesignError::at("", "", problem, allowed).in_file(path).into()
}

/// Reads a `constants.json`.
pub fn read_constants(path: &Path) -> Result<Constants, Failure> {
    let text = read_text(path)?;
    text.parse().map_err(|error: ConstantsError| {
        let tree = domecast_design::parse_json(&text).ok();
        match tree.map(|value| FileKind::Constants.expect(&value)) {
            Some(Err(other)) => other.in_file(path).into(),
            _ => input_fault(path, error.problem, "a constants.json of this release"),
        }
    })
}

/// Where measured constants go by default: beside the nominal ones.
pub fn measured_beside(constants: &Path) -> PathBuf {
    constants.with_file_name("constants.measured.json")
}
