//! `domecast build DESIGN`

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use serde_json::json;

use super::output::{Failure, Output};
use domecast_fab::build;
use domecast_fab::build::{Build, BuildError, Measured};
use domecast_files::StagedFolder;

/// How often a watched design is looked at: fast enough to feel immediate, slow enough to cost nothing.
const LOOK: Duration = Duration::from_millis(250);

/// Where to write, and where a measurement of the design lies.
#[derive(Debug, Clone, Copy)]
pub struct Folders<'a> {
    pub out: Option<&'a Path>,
    pub accuracy: Option<&'a Path>,
}

/// Makes everything, then writes it whole. With `watch`, again whenever the design file or the calibration
/// that it names changes.
pub fn run(output: &Output, design_file: &Path, folders: &Folders<'_>, watch: bool) -> Result<(), Failure> {
    if !watch {
        return once(output, design_file, folders, false);
    }
    let mut seen = None;
    let mut files = vec![design_file.to_path_buf()];
    loop {
        let now: Vec<_> = files.iter().map(|file| stamp(file)).collect();
        if seen.as_ref() != Some(&now) {
            files = watched_files(design_file);
            seen = Some(files.iter().map(|file| stamp(file)).collect());
            match once(output, design_file, folders, true) {
                // a fault in the design is what watching is for: say it, and wait for the next save
                Err(failure @ (Failure::Input(_) | Failure::Write(_))) => output.failure(&failure),
                other => other?,
            }
            output.say(&format!("watching {} (end with Ctrl-C)", design_file.display()))?;
        }
        std::thread::sleep(LOOK);
    }
}

/// The design, and the calibration that it names.
fn watched_files(design_file: &Path) -> Vec<PathBuf> {
    let named = || {
        let design = domecast_design::parse_json(&domecast_design::read_text(design_file).ok()?).ok()?;
        let name = design.pointer("/camera/calibration")?.as_str()?.to_owned();
        Some(design_file.parent().unwrap_or(Path::new("")).join(name))
    };
    std::iter::once(design_file.to_path_buf()).chain(named()).collect()
}

/// What distinguishes one state of a file from the next; `None` while an editor has it away.
fn stamp(path: &Path) -> Option<(SystemTime, u64)> {
    let about = std::fs::metadata(path).ok()?;
    Some((about.modified().ok()?, about.len()))
}

fn once(output: &Output, design_file: &Path, folders: &Folders<'_>, watched: bool) -> Result<(), Failure> {
    let began = Instant::now();
    output.step("reading the design");
    let design = domecast_design::Design::load(design_file)?;
    let out = folders.out.map_or_else(|| PathBuf::from("output").join(design.name()), Path::to_path_buf);
    let inputs: Vec<&Path> = [design_file].into_iter().chain(folders.accuracy).collect();
    let staged = StagedFolder::new(&out, "build", &output.rules(&inputs))?;
    let measured = match folders.accuracy.map(|dir| Measured::read(dir, &design)).transpose() {
        // a design that is being changed has left its measurement behind; the rest is still wanted
        Err(error) if watched => {
            output.warn(&error.to_string());
            None
        }
        other => other?,
    };
    // what each step took, so that a person sees what their settings cost
    let mut steps: Vec<(String, Instant)> = Vec::new();
    let mut on_step = |doing: &str| {
        steps.push((doing.to_owned(), Instant::now()));
        output.step(doing);
    };
    let mut result =
        build::build_with(&design, measured.as_ref(), &mut on_step).map_err(|error| match error {
            BuildError::Design(error) => Failure::from(error.in_file(design_file)),
            BuildError::Ours(what) => Failure::Internal(what),
        })?;
    let built = Instant::now();
    if watched {
        result.keep_fresh();
    }
    output.step("writing");
    result.tree.fill(&staged)?;
    output.kept(staged.commit()?);
    output.steps_done();
    summarize(output, &result, &out, began.elapsed())?;
    if design.settings().any_chosen() {
        output.say("exactness, as chosen from `accuracy`:")?;
        for line in design.settings().lines() {
            output.say(&format!("  {line}"))?;
        }
        let ends = steps.iter().skip(1).map(|(_, start)| *start).chain([built]);
        for ((doing, start), end) in steps.iter().zip(ends) {
            output.say(&format!("  {:.2} s {doing}", (end - *start).as_secs_f64()))?;
        }
    }
    Ok(())
}

fn summarize(output: &Output, result: &Build, out: &Path, took: Duration) -> Result<(), Failure> {
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
        took.as_secs_f64(),
    ))?;
    for left_out in &result.manifest.formats_left_out {
        output.say(&format!("  not written: {left_out}"))?;
    }
    for headline in &result.headlines {
        output.say(&format!("  {headline}"))?;
    }
    for file in &result.manifest.files {
        output.say(&format!("  {}", file.path))?;
    }
    output.say(&format!("look at {}", out.join("report/index.html").display()))?;
    output.result(&json!({
        "ok": true,
        "out": out.display().to_string(),
        "manifest": result.manifest,
    }))
}
