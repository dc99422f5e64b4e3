//! Results that are computed from a design alone: their files beside the design and a manifest of all.

use super::output::{Failure, Output};
use domecast_design::Design;
use domecast_fab::build::{DESIGN_NAME, DesignRecord, MANIFEST_NAME, Manifest, Tree, sha256_hex};
use domecast_files::StagedFolder;

/// Puts such a result in its place, whole.
pub fn write(
    output: &Output,
    staged: StagedFolder,
    design: &Design,
    files: Vec<(String, Vec<u8>)>,
) -> Result<(), Failure> {
    let mut tree = Tree::default();
    for (name, bytes) in files {
        tree.add(name, bytes);
    }
    tree.add(DESIGN_NAME, design.text().as_bytes().to_vec());
    let record =
        DesignRecord { name: design.name().to_owned(), sha256: sha256_hex(design.text().as_bytes()) };
    let manifest = Manifest::new(record, Vec::new(), Vec::new(), Vec::new(), tree.files());
    let text =
        serde_json::to_string_pretty(&manifest).map_err(|error| Failure::Internal(error.to_string()))?;
    tree.add(MANIFEST_NAME, text.into_bytes());
    output.step("writing");
    tree.fill(&staged)?;
    output.kept(staged.commit()?);
    output.steps_done();
    Ok(())
}
