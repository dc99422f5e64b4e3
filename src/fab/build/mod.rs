//! The main job: from a design to the folder with everything that is needed to make the sensor.
//!
//! [`build`] makes all files in memory, [`Tree::write`] puts them in place whole, and [`check::check`]
//! reads them again. The only things shared between artwork, parts and constants are the resolved design
//! and its layout; that is why they agree.
//!
//! ```no_run
//! use domecast_fab::build::build;
//! use std::path::Path;
//!
//! let design = domecast_design::Design::load(Path::new("designs/thumb24.json"))?;
//! let made = build(&design, &mut |doing| eprintln!("{doing}"))?;
//! made.tree.write(Path::new("output/thumb24"))?;
//! println!("{} dots, {} files", made.dot_count, made.manifest.files.len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod check;
mod claims;
mod cures;
mod making;
mod manifest;
mod measured;
mod tree;

pub use crate::hash::sha256_hex;
pub use domecast_files::{WriteError, list_files};
pub use manifest::{
    DERIVED_NAME, DESIGN_NAME, DesignRecord, FileRecord, MANIFEST_NAME, Manifest, PartRecord, Warning,
};
pub use measured::Measured;
pub use tree::Tree;

use std::fmt;

use crate::artwork;
use crate::artwork::RenderError;
use crate::constants;
use crate::led_board::Lights;
use crate::light::LightCheck;
use crate::report;
use domecast_design::layout::LayoutError;
use domecast_design::layout::report::LayoutReport;
use domecast_design::parts;
use domecast_design::parts::PartError;
use domecast_design::settings::SAFETY;
use domecast_design::{Design, DesignError, DesignWarning};
use domecast_runtime::constants::Constants;
use making::{MadeParts, lay_out, make_parts};

/// Why a build could not be made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BuildError {
    /// The design is at fault.
    Design(Box<DesignError>),
    /// A library failed on something that every resolved design should allow: domecast is at fault.
    Ours(String),
}

impl From<DesignError> for BuildError {
    fn from(error: DesignError) -> Self {
        Self::Design(Box::new(error))
    }
}

impl From<LayoutError> for BuildError {
    fn from(error: LayoutError) -> Self {
        DesignError::from(error).into()
    }
}

impl From<RenderError> for BuildError {
    fn from(error: RenderError) -> Self {
        match error {
            RenderError::Size => DesignError::at(
                "print.dpi",
                "",
                "the film would be wider or higher than 60000 px at this resolution",
                "a lower resolution, or a smaller dome",
            )
            .into(),
            error => Self::Ours(format!("the artwork could not be drawn: {error}")),
        }
    }
}

impl From<PartError> for BuildError {
    fn from(error: PartError) -> Self {
        DesignError::from(error).into()
    }
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Design(error) => error.fmt(f),
            Self::Ours(what) => f.write_str(what),
        }
    }
}

impl std::error::Error for BuildError {}

/// Everything that a build writes.
#[derive(Debug)]
pub struct Build {
    /// The files, the manifest among them.
    pub tree: Tree,
    /// The manifest.
    pub manifest: Manifest,
    /// Number of dots.
    pub dot_count: usize,
    /// What the layout comes to, a sentence each.
    pub headlines: Vec<String>,
}

impl Build {
    /// Lets an open page see that it is out of date: adds the script that asks, and what it asks for. The files
    /// of a watched build differ from those of a plain one in this alone.
    pub fn keep_fresh(&mut self) {
        const PAGE: &str = "report/index.html";
        const STAMP: &str = "report/fresh-stamp.js";
        let page = self.tree.files().find(|(path, _)| *path == PAGE).map(|(_, bytes)| bytes.to_vec());
        let Some(page) = page.and_then(|bytes| String::from_utf8(bytes).ok()) else { return };
        self.tree.add(PAGE, report::watched(&page).into_bytes());
        self.tree.add(STAMP, report::stamp(&self.manifest.design.sha256).into_bytes());
        // the manifest lists all files but itself
        self.tree.remove(MANIFEST_NAME);
        let Manifest { design, parts, warnings, formats_left_out, .. } = self.manifest.clone();
        self.manifest = Manifest::new(design, parts, warnings, formats_left_out, self.tree.files());
        self.tree.add(MANIFEST_NAME, pretty(&self.manifest));
    }
}

/// Makes everything; `step` gets what is being made. Nothing is written to the disk.
///
/// # Errors
/// The first fault of the design that only shows when it is laid out, loaded or made.
pub fn build(design: &Design, step: &mut dyn FnMut(&str)) -> Result<Build, BuildError> {
    build_with(design, None, step)
}

/// Whether a design builds: its loads, dots, parts and light, without files and without a search for what would mend it.
///
/// # Errors
/// The first fault of the design.
pub fn verify(design: &Design) -> Result<(), DesignError> {
    let (parts, light) = rayon::join(|| cures::with_parts(design), || LightCheck::of(design));
    parts.and(light.map(|_| ()))
}

/// [`build`] with what was measured of the design, which goes into the report.
///
/// # Errors
/// As [`build`].
pub fn build_with(
    design: &Design,
    measured: Option<&Measured>,
    step: &mut dyn FnMut(&str),
) -> Result<Build, BuildError> {
    make(design, measured, step).map_err(|error| match error {
        BuildError::Design(error) => {
            let error = cures::with_cures(design, with_value(design, *error));
            design.with_lints(design.with_writable_cures(error)).into()
        }
        ours @ BuildError::Ours(_) => ours,
    })
}

fn make(
    design: &Design,
    measured: Option<&Measured>,
    step: &mut dyn FnMut(&str),
) -> Result<Build, BuildError> {
    let mut tree = Tree::default();
    for (path, bytes) in measured.map_or(&[][..], Measured::files) {
        tree.add(path.as_str(), bytes.clone());
    }
    add_design(&mut tree, design);
    let sha256 = sha256_hex(design.text().as_bytes());
    let lights = Lights::of(design)?;

    step("trying the claimed loads");
    let sight = claims::try_claims(design)?;
    step("laying out the dots");
    let (spec, layout) = lay_out(design)?;
    step("writing the constants");
    let springs = constants::springs_of(design, sight)?;
    let constants = constants::with_springs(design, &layout, &springs)?;
    tree.add("constants/constants.json", constants.to_json().into_bytes());
    // four pieces of work that share nothing but what they read, on as many threads as there are
    step("drawing the artwork, making the parts, lighting the sensor, driving the loads to their limits");
    let draw = || artwork::files(&spec, &layout);
    let judge = || LayoutReport::new(design, &spec, &layout);
    let make_parts = || make_parts(design, &layout, &springs);
    let load = || light_and_forces(design, &springs);
    let ((films, judged), (parts, loaded)) =
        rayon::join(|| rayon::join(draw, judge), || rayon::join(make_parts, load));
    for file in films? {
        tree.add(file.path, file.bytes);
    }
    tree.add("artwork/layout.json", pretty(&judged));
    let MadeParts { made, assembly, checked, files, poses } = parts?;
    for file in files {
        tree.add(file.path, file.bytes);
    }
    let (light, forces) = loaded?;
    let force_files = forces.files().into_iter().map(|(path, text)| (path, text.into_bytes()));
    for (path, bytes) in light.files().into_iter().chain(force_files).chain(lights.files(design)?) {
        tree.add(path, bytes);
    }
    step("writing what other programs read");
    tree.add("constants/constants.schema.json", Constants::schema().into_bytes());
    let forms = constants::formats::format_files(design, &constants, &made);
    for (path, text) in forms.files {
        tree.add(path, text.into_bytes());
    }
    let warnings = warnings(design, &[checked.notes, lights.warnings.clone()].concat(), &judged, &light);

    step("writing the page");
    let shown: Vec<(String, String)> =
        warnings.iter().map(|warning| (warning.field.clone(), warning.message.clone())).collect();
    let page = report::page(&report::ReportSubject {
        design,
        layout: &layout,
        judged: &judged,
        constants: &constants,
        forces: &forces,
        light: &light.report,
        lights: &lights,
        parts: &made,
        assembly: &assembly,
        sight: &checked.sight,
        poses: &poses,
        warnings: &shown,
        formats_left_out: &forms.left_out,
        hash: &sha256,
        files: &tree.files().collect::<Vec<_>>(),
    });
    tree.add("report/index.html", page.into_bytes());

    let record = DesignRecord { name: design.name().to_owned(), sha256 };
    let records = made.iter().map(part_record).collect();
    let manifest = Manifest::new(record, records, warnings, forms.left_out, tree.files());
    tree.add(MANIFEST_NAME, pretty(&manifest));
    let mut headlines = judged.headlines();
    headlines.extend(averaging(design, &forces));
    Ok(Build { tree, manifest, dot_count: layout.dots.len(), headlines })
}

/// The lit sensor, and what a frame of it resolves, which hangs on how the markers stand out in it.
fn light_and_forces(
    design: &Design,
    springs: &constants::DesignSprings,
) -> Result<(LightCheck, constants::ForceReport), DesignError> {
    let light = LightCheck::of(design)?;
    let noise_px: Vec<f64> = light.report.markers.iter().map(|marker| marker.centroid_sd_px).collect();
    let forces = constants::force_report(design, springs, &noise_px)?;
    Ok((light, forces))
}

/// The design's own warnings, then those of the assembled parts, of the pattern and of the light.
fn warnings(
    design: &Design,
    notes: &[DesignWarning],
    judged: &LayoutReport,
    light: &LightCheck,
) -> Vec<Warning> {
    let warning = |field: &str, message: String| Warning { field: field.into(), message };
    let own = design.warnings().iter().chain(notes).map(|own| warning(&own.field, own.message.clone()));
    let pattern = judged.warnings.iter().map(|message| warning("pattern", message.clone()));
    let lit = light.warnings.iter().map(|(field, message)| warning(field, message.clone()));
    own.chain(pattern).chain(lit).collect()
}

/// What a checker should find in a part's mesh.
fn part_record(part: &parts::Part) -> PartRecord {
    PartRecord {
        name: part.name.clone(),
        file: format!("parts/{}.stl", part.name),
        volume_mm3: part.volume_mm3,
        genus: part.genus,
        bbox_mm: [part.bounds.min_mm.to_array(), part.bounds.max_mm.to_array()],
    }
}

/// How many frames to average for the design's `accuracy.force_n`, where it gives one.
fn averaging(design: &Design, forces: &constants::ForceReport) -> Option<String> {
    let (asked, frames) = (design.sections().accuracy.as_ref()?, forces.frames_to_average?);
    Some(format!(
        "accuracy.force_n = {}: average {frames} frame{}, which keeps it with a safety factor of {SAFETY} as far as noise goes",
        asked.force_n,
        if frames == 1 { "" } else { "s" }
    ))
}

/// The design as it was written, and beside it what rules gave, for programs that read it.
fn add_design(tree: &mut Tree, design: &Design) {
    tree.add(DESIGN_NAME, design.text().as_bytes().to_vec());
    let entry = |one: &domecast_design::DerivedField| serde_json::json!({ "field": one.field, "value": one.value, "rule": one.rule });
    let derived: Vec<serde_json::Value> = design.derived().iter().map(entry).collect();
    if !derived.is_empty() {
        tree.add(DERIVED_NAME, pretty(&derived));
    }
}

/// A file for programs.
fn pretty(value: &impl serde::Serialize) -> Vec<u8> {
    // numbers, strings and lists only: nothing here can fail to be written
    let mut text = serde_json::to_string_pretty(value).unwrap_or_default();
    text.push('\n');
    text.into_bytes()
}

/// Makers report the field at fault; its value stands in the design.
fn with_value(design: &Design, mut error: DesignError) -> DesignError {
    if error.value.is_empty() && !error.field.is_empty() {
        let pointer = format!("/{}", error.field.replace(['.', '['], "/").replace(']', ""));
        let tree: serde_json::Value = serde_json::from_str(design.text()).unwrap_or_default();
        if let Some(value) = tree.pointer(&pointer) {
            let filled = DesignError::at(error.field.clone(), value, "", "");
            error.value = filled.value;
        }
    }
    error.more = error.more.into_iter().map(|more| with_value(design, more)).collect();
    error
}
