//! The build of a design.

mod manifest;
mod tree;

pub use manifest::{
    DESIGN_NAME, DesignRecord, FileRecord, MANIFEST_NAME, Manifest, PartRecord, Warning, sha256_hex,
};
pub use tree::{Tree, WriteError, list_files};
