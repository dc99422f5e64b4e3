//! `domecast illuminate DESIGN`

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;

use super::of_a_design;
use super::output::{Failure, Output};
use domecast_fab::illuminate::{IlluminationCheck, IlluminationReport};
use domecast_fab::numbers::{percent, significant};
use domecast_files::StagedFolder;

/// Computes the light on the dome, then writes the result whole.
pub fn run(output: &Output, design_file: &Path, out: Option<&Path>) -> Result<(), Failure> {
    let began = Instant::now();
    output.step("reading the design");
    let design = domecast_design::Design::load(design_file)?;
    let out = out
        .map_or_else(|| PathBuf::from("output").join(format!("{}-light", design.name())), Path::to_path_buf);
    let staged = StagedFolder::new(&out, "illuminate", &output.rules(&[design_file]))?;
    output.step("lighting the dome");
    let check = IlluminationCheck::of(&design).map_err(|error| Failure::from(error.in_file(design_file)))?;
    of_a_design::write(output, staged, &design, check.files())?;
    summarize(output, &check.report)?;
    output.say(&format!(
        "{:.1} s; look at {}",
        began.elapsed().as_secs_f64(),
        out.join("index.html").display()
    ))?;
    let IlluminationReport { within, crescents, lights_seen, .. } = &check.report;
    output.result(&json!({
        "ok": true,
        "out": out.display().to_string(),
        "level_per_mw_mm2": check.report.level_per_mw_mm2,
        "within": within,
        "crescents": crescents,
        "lights_seen": lights_seen,
    }))
}

fn summarize(output: &Output, report: &IlluminationReport) -> Result<(), Failure> {
    let number = |value: Option<f64>| value.map_or("-".to_owned(), significant);
    for within in &report.within {
        output.say(&format!(
            "to {} degrees: normal {} / {} / {} degrees a grey level, condition number {} / {} / {} (5th / 50th / 95th \
             percentile), crescents {}",
            within.polar_angle_deg,
            number(within.normal_error_deg_per_level.p5),
            number(within.normal_error_deg_per_level.p50),
            number(within.normal_error_deg_per_level.p95),
            number(within.condition_number.p5),
            number(within.condition_number.p50),
            number(within.condition_number.p95),
            percent(within.crescent_share),
        ))?;
    }
    Ok(())
}
