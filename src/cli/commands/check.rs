//! `domecast check DIR`

use std::path::Path;

use serde_json::json;

use super::output::{Failure, Output};
use domecast_fab::build::check;

/// Reads a build again and prints what holds and what does not.
pub fn run(output: &Output, dir: &Path) -> Result<(), Failure> {
    let report = check::check(dir, &mut |doing| output.step(doing))?;
    output.steps_done();
    for finding in &report.findings {
        let mark = if finding.holds { "ok  " } else { "FAIL" };
        output.say(&format!("{mark} {:<34} {}", finding.subject, finding.detail))?;
    }
    let failed: Vec<_> = report.findings.iter().filter(|finding| !finding.holds).collect();
    output.say(&format!("{} checks, {} failed", report.findings.len(), failed.len()))?;
    output.result(&json!({
        "ok": failed.is_empty(),
        "design": report.design,
        "checks": report.findings.iter().map(|finding| json!({
            "subject": finding.subject, "holds": finding.holds, "detail": finding.detail,
        })).collect::<Vec<_>>(),
    }))?;
    if failed.is_empty() {
        return Ok(());
    }
    if !output.is_json() {
        // with --quiet the table is not shown, but what failed must be
        for finding in &failed {
            output.error(&format!("{}: {}: {}", dir.display(), finding.subject, finding.detail));
        }
    }
    Err(Failure::Negative)
}
