//! `domecast illuminate DESIGN`

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use serde_json::json;

use super::of_a_design;
use super::output::{Failure, Output};
use domecast_design::Design;
use domecast_fab::illuminate::optimize::{Optimization, SearchOptions, optimize};
use domecast_fab::illuminate::{IlluminationCheck, IlluminationReport};
use domecast_fab::numbers::{percent, significant};
use domecast_files::{StagedFolder, StopWish};

/// The search for better lights.
#[derive(Debug, Args)]
pub struct LightSearch {
    /// Search for lights with which the normals' error is smaller, and that the design's parts have room for; write the
    /// design with them. Ctrl-C ends the search with the best so far.
    #[arg(long)]
    optimize: bool,
    /// Polar angle to which the error of normals counts, degrees.
    #[arg(long, value_name = "DEG", default_value_t = SearchOptions::default().polar_angle_deg, requires = "optimize")]
    polar_angle_deg: f64,
    /// How many lights the search looks at, at most.
    #[arg(long, value_name = "N", default_value_t = SearchOptions::default().evaluations, requires = "optimize")]
    evaluations: usize,
    /// Seed of the search.
    #[arg(long, value_name = "N", default_value_t = SearchOptions::default().seed, requires = "optimize")]
    seed: u64,
}

/// Computes the light on the dome, searches for a better one where that is asked for, then writes the result whole.
pub fn run(
    output: &Output,
    design_file: &Path,
    out: Option<&Path>,
    search: &LightSearch,
) -> Result<(), Failure> {
    let began = Instant::now();
    let LightSearch { polar_angle_deg, evaluations, seed, .. } = *search;
    let options = SearchOptions { polar_angle_deg, evaluations, seed };
    if search.optimize {
        options.check()?;
    }
    output.step("reading the design");
    let design = Design::load(design_file)?;
    let out = out
        .map_or_else(|| PathBuf::from("output").join(format!("{}-light", design.name())), Path::to_path_buf);
    let staged = StagedFolder::new(&out, "illuminate", &output.rules(&[design_file]))?;
    output.step("lighting the dome");
    let in_file = |error: domecast_design::DesignError| Failure::from(error.in_file(design_file));
    let check = IlluminationCheck::of(&design).map_err(in_file)?;
    let searched = if search.optimize {
        let wish = StopWish::heed();
        let step = &mut |doing: &str| output.step(doing);
        Some(optimize(&design, &check.report, &options, step, &|| wish.came()).map_err(in_file)?)
    } else {
        None
    };
    of_a_design::write(output, staged, &design, check.files(searched.as_ref()))?;
    summarize(output, &check.report)?;
    if let Some(searched) = &searched {
        summarize_search(output, searched, &out)?;
    }
    output.say(&format!(
        "{:.1} s; look at {}",
        began.elapsed().as_secs_f64(),
        out.join("index.html").display()
    ))?;
    let IlluminationReport { within, crescents, lights_seen, .. } = &check.report;
    let mut result = json!({
        "ok": true,
        "out": out.display().to_string(),
        "level_per_mw_mm2": check.report.level_per_mw_mm2,
        "within": within,
        "crescents": crescents,
        "lights_seen": lights_seen,
    });
    if let Some(searched) = &searched {
        result["optimize"] = json!({
            "status": searched.report.status,
            "evaluations": searched.report.evaluations,
            "changes": searched.report.changes,
            "ratio": searched.report.ratio,
            "proposal": searched.proposal_name().map(|name| out.join(name).display().to_string()),
        });
    }
    output.result(&result)
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

fn summarize_search(output: &Output, searched: &Optimization, out: &Path) -> Result<(), Failure> {
    let report = &searched.report;
    let looked = format!("search {}: {} lights looked at", report.status, report.evaluations);
    let (Some(best), Some(name)) = (&report.best, searched.proposal_name()) else {
        return output.say(&format!("{looked}, none better than the given ones that can be made"));
    };
    let number = |value: Option<f64>| value.map_or("-".to_owned(), significant);
    output.say(&format!(
        "{looked}; to {} degrees one place in twenty has more than {} degrees a grey level, {} before",
        significant(report.polar_angle_deg),
        number(best.illuminate_normal_error_p95_deg_per_level),
        number(report.start.illuminate_normal_error_p95_deg_per_level),
    ))?;
    for change in report.changes.iter().filter(|change| !change.value.is_null()) {
        output.say(&format!("  {} = {}", change.field, change.value))?;
    }
    output.say(&format!("build it: domecast build {}", out.join(name).display()))
}
