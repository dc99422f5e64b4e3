//! `domecast build DESIGN`

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;

use super::output::{Failure, Output};
use crate::build::{self, BuildError};
use crate::design;

/// Makes everything, then writes it whole.
pub fn run(output: &Output, design_file: &Path, out: Option<&Path>) -> Result<(), Failure> {
    let began = Instant::now();
    output.step("reading the design");
    let design = design::load(design_file)?;
    let result = build::build(&design, &mut |doing| output.step(doing)).map_err(|error| match error {
        BuildError::Design(error) => Failure::from(error.in_file(design_file)),
        BuildError::Ours(what) => Failure::Internal(what),
    })?;
    let out = out.map_or_else(|| PathBuf::from("output").join(design.name()), Path::to_path_buf);
    output.step("writing");
    result.tree.write(&out).map_err(Failure::Write)?;
    output.steps_done();

    for warning in &result.manifest.warnings {
        output.warn(&format!("{}: {}", warning.field, warning.message));
    }
    let bytes: u64 = result.manifest.files.iter().map(|file| file.bytes).sum();
    output.say(&format!(
        "{}: {} dots, {} parts, {} files ({:.1} MB) in {:.2} s",
        out.display(),
        result.dot_count,
        result.manifest.parts.len(),
        result.manifest.files.len() + 1,
        bytes as f64 / 1e6,
        began.elapsed().as_secs_f64(),
    ))?;
    for headline in &result.headlines {
        output.say(&format!("  {headline}"))?;
    }
    for file in &result.manifest.files {
        output.say(&format!("  {}", file.path))?;
    }
    output.result(&json!({
        "ok": true,
        "out": out.display().to_string(),
        "manifest": result.manifest,
    }))
}
