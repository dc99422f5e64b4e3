//! What a build wrote, from which design, with what warnings.

use std::fs;
use std::path::{Component, Path};

use crate::hash::sha256_hex;
use serde::{Deserialize, Serialize};

use domecast_design::DesignError;

/// The manifest's name in the folder of a build.
pub const MANIFEST_NAME: &str = "manifest.json";
/// The exact copy of the design file, in the folder of a build.
pub const DESIGN_NAME: &str = "design.json";
/// The fields that the design file leaves to rules, with values and rules; only where there are some.
pub const DERIVED_NAME: &str = "derived.json";
/// Marks the file for readers.
const FORMAT: &str = "domecast-manifest";
/// Raised when a reader of an earlier version would misread the file.
const VERSION: u32 = 1;

/// The manifest of a build.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Always `domecast-manifest`.
    pub format: String,
    /// Version of this file's form.
    pub version: u32,
    /// The release of domecast that wrote it.
    pub domecast: String,
    /// The design that it was made from.
    pub design: DesignRecord,
    /// The meshes, with what a checker should find in them.
    pub parts: Vec<PartRecord>,
    /// What the maker should look at, each with the field to change.
    pub warnings: Vec<Warning>,
    /// What no file could be written for, and why.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub formats_left_out: Vec<String>,
    /// Every file but this one, by path.
    pub files: Vec<FileRecord>,
}

/// The design of a build; the file itself stands beside the manifest as `design.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DesignRecord {
    /// Its name.
    pub name: String,
    /// SHA-256 of the design file's bytes, hexadecimal.
    pub sha256: String,
}

/// What a mesh must turn out to be when it is read back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartRecord {
    /// Name of the part.
    pub name: String,
    /// Its mesh, relative to the folder.
    pub file: String,
    /// Volume of the mesh, mm^3.
    pub volume_mm3: f64,
    /// Genus of the surface: the number of holes through the part.
    pub genus: i64,
    /// Lowest and highest corner, mm, in the part's own frame.
    pub bbox_mm: [[f64; 3]; 2],
}

/// One file of a build.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileRecord {
    /// Path relative to the folder, with `/`.
    pub path: String,
    /// Size in bytes.
    pub bytes: u64,
    /// SHA-256, hexadecimal.
    pub sha256: String,
}

impl FileRecord {
    /// Whether the path stays in the folder: a manifest that was tampered with must not lead out of it.
    pub fn is_inside(&self) -> bool {
        Path::new(&self.path).components().all(|part| matches!(part, Component::Normal(_)))
    }

    /// Whether this is the file as it was written.
    pub fn is_of(&self, bytes: &[u8]) -> bool {
        bytes.len() as u64 == self.bytes && sha256_hex(bytes) == self.sha256
    }
}

/// Something that does not stop a build but that its maker should know.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Warning {
    /// The design field to change, as a path.
    pub field: String,
    /// What is the matter, with numbers.
    pub message: String,
}

impl Manifest {
    /// The manifest of `files`: path and content of each.
    pub fn new<'a>(
        design: DesignRecord,
        parts: Vec<PartRecord>,
        warnings: Vec<Warning>,
        formats_left_out: Vec<String>,
        files: impl Iterator<Item = (&'a str, &'a [u8])>,
    ) -> Self {
        let files = files
            .map(|(path, bytes)| FileRecord {
                path: path.to_owned(),
                bytes: bytes.len() as u64,
                sha256: sha256_hex(bytes),
            })
            .collect();
        Self {
            format: FORMAT.into(),
            version: VERSION,
            domecast: env!("CARGO_PKG_VERSION").into(),
            design,
            parts,
            warnings,
            formats_left_out,
            files,
        }
    }

    /// Reads the manifest of a folder, which must be `allowed`.
    ///
    /// # Errors
    /// No folder, no manifest in it, or one of another kind.
    pub fn read(dir: &Path, allowed: &str) -> Result<Self, DesignError> {
        let path = dir.join(MANIFEST_NAME);
        let fault = |problem: String| {
            DesignError::at("", "", problem, format!("{allowed}, with its {MANIFEST_NAME}")).in_file(&path)
        };
        let text = fs::read_to_string(&path)
            .map_err(|error| fault(format!("nothing can be read here ({error})")))?;
        Self::parse(&text).map_err(fault)
    }

    /// Reads a manifest's text.
    ///
    /// # Errors
    /// A sentence that says what is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let manifest: Self =
            serde_json::from_str(text).map_err(|error| format!("is not a manifest: {error}"))?;
        if manifest.format != FORMAT || manifest.version != VERSION {
            return Err(format!(
                "has format \"{}\" version {}; this release reads \"{FORMAT}\" version {VERSION}",
                manifest.format, manifest.version
            ));
        }
        Ok(manifest)
    }
}
