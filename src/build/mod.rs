//! The main job: from a design to the folder with everything that is needed to make the sensor.
//!
//! [`build`] makes all files in memory, [`Tree::write`] puts them in place whole, and [`check::check`]
//! reads them again. The only things shared between artwork, parts and constants are the resolved design
//! and its layout; that is why they agree.

pub mod check;
mod manifest;
pub mod sight;
mod tree;

pub use manifest::{
    DESIGN_NAME, DesignRecord, FileRecord, MANIFEST_NAME, Manifest, PartRecord, Warning, sha256_hex,
};
pub use tree::{Tree, WriteError, list_files};

use crate::artwork;
use crate::constants;
use crate::design::{Design, DesignError};
use crate::layout::{Layout, LayoutSpec};
use crate::numeric::Rigid;
use crate::parts;

/// Everything that a build writes.
#[derive(Debug)]
pub struct Build {
    /// The files, the manifest among them.
    pub tree: Tree,
    /// The manifest.
    pub manifest: Manifest,
    /// Number of dots.
    pub dot_count: usize,
}

/// Makes everything; `step` is told what is being made. Nothing is written to the disk.
///
/// # Errors
/// The first fault of the design that only shows when it is laid out, loaded or made.
pub fn build(design: &Design, step: &mut dyn FnMut(&str)) -> Result<Build, DesignError> {
    let mut tree = Tree::default();
    let mut warnings: Vec<Warning> = design
        .warnings()
        .iter()
        .map(|warning| Warning { field: warning.field.clone(), message: warning.message.clone() })
        .collect();
    tree.add(DESIGN_NAME, design.text().as_bytes().to_vec());
    let sha256 = sha256_hex(design.text().as_bytes());

    step("laying out the dots");
    let layout = layout_of(design)?;
    step("trying the claimed loads");
    sight::markers(design, &Rigid::identity(), "at rest")?;
    step("writing the constants");
    let constants = constants::of(design, &layout)?;
    tree.add("constants/constants.json", constants.to_json().into_bytes());
    step("drawing the artwork");
    tree.add("artwork/dots.svg", artwork::dots_svg(design, &layout, &sha256)?);
    tree.add("artwork/camera-view.png", artwork::camera_view_png(design, &layout)?);
    step("making the parts");
    let mut records = Vec::new();
    for part in parts::build(design)? {
        let file = format!("parts/{}.stl", part.name);
        let mut bytes = Vec::new();
        part.write_stl(&mut bytes).map_err(|error| DesignError::at("mesh", "", error.to_string(), ""))?;
        tree.add(file.clone(), bytes);
        records.push(PartRecord {
            name: part.name.to_owned(),
            file,
            volume_mm3: part.volume_mm3,
            genus: part.genus,
            bbox_mm: [part.bounds.low_mm.to_array(), part.bounds.high_mm.to_array()],
        });
    }
    warnings.extend(layout.warnings.iter().map(|message| Warning { field: "pattern".into(), message: message.clone() }));

    let record = DesignRecord { name: design.name().to_owned(), sha256 };
    let manifest = Manifest::new(record, records, warnings, &tree);
    // numbers, strings and lists only: nothing here can fail to be written
    let mut text = serde_json::to_string_pretty(&manifest).unwrap_or_default();
    text.push('\n');
    tree.add(MANIFEST_NAME, text.into_bytes());
    Ok(Build { tree, manifest, dot_count: layout.dots.len() })
}

/// The layout of a design's dots.
fn layout_of(design: &Design) -> Result<Layout, DesignError> {
    Layout::new(&LayoutSpec::of(design)?).map_err(DesignError::from)
}
