//! What `domecast accuracy` measured of a design, to be shown in its report.

use std::fs;
use std::path::Path;

use super::manifest::{DESIGN_NAME, Manifest};
use crate::hash::sha256_hex;
use crate::report::MEASURED;
use domecast_design::{Design, DesignError};

/// Whether a measurement has what the report shows of it.
fn has_sweeps(json: &[u8]) -> bool {
    serde_json::from_slice::<serde_json::Value>(json).is_ok_and(|all| all["sweeps"].is_array())
}

/// The files of one measurement, whole and of the design that is built.
#[derive(Debug, Clone)]
pub struct Measured {
    files: Vec<(String, Vec<u8>)>,
}

impl Measured {
    /// Reads a measurement's folder.
    ///
    /// # Errors
    /// No measurement there, one of another design, a file that is missing or was changed since.
    pub fn read(dir: &Path, design: &Design) -> Result<Self, DesignError> {
        let manifest = Manifest::read(dir, "a folder that `domecast accuracy` wrote")?;
        let fault = |problem: String, allowed: &str| DesignError::at("", "", problem, allowed).in_file(dir);
        if manifest.design.sha256 != sha256_hex(design.text().as_bytes()) {
            return Err(fault(
                format!("was measured on another design, \"{}\" as it was then", manifest.design.name),
                "a measurement of exactly the design that is built",
            )
            .with_help("measure again: `domecast accuracy DESIGN`"));
        }
        if !manifest.files.iter().any(|file| file.path == "accuracy.json") {
            return Err(fault(
                "is not a measurement: it holds no accuracy.json".into(),
                "a folder that `domecast accuracy` wrote, not a build",
            ));
        }
        let mut files = Vec::new();
        for file in manifest.files.iter().filter(|file| file.path != DESIGN_NAME) {
            let bad = |problem: String| {
                fault(format!("{}: {problem}", file.path), "the files as they were written")
                    .with_help("measure again: `domecast accuracy DESIGN`")
            };
            if !file.is_inside() {
                return Err(bad("not a path inside the folder".into()));
            }
            let bytes = fs::read(dir.join(&file.path)).map_err(|error| bad(error.to_string()))?;
            if !file.is_of(&bytes) {
                return Err(bad("changed since it was measured (its hash differs)".into()));
            }
            if file.path == "accuracy.json" && !has_sweeps(&bytes) {
                return Err(bad("has no list `sweeps`: another version of domecast wrote it".into()));
            }
            files.push((format!("{MEASURED}/{}", file.path), bytes));
        }
        Ok(Self { files })
    }

    /// The files, by their paths in a build.
    pub(super) fn files(&self) -> &[(String, Vec<u8>)] {
        &self.files
    }
}
