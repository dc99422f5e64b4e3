//! `domecast accuracy DESIGN`

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;

use super::of_a_design;
use super::output::{Failure, Output};
use crate::accuracy;
use crate::accuracy::{Accuracy, AccuracyError};
use domecast_design::DesignError;
use domecast_fab::numbers::{duration, significant};
use domecast_files::StagedFolder;
use domecast_sim::{Scene, SimError};

/// Measures, then writes the result whole.
pub fn run(
    output: &Output,
    design_file: &Path,
    scene_file: Option<&Path>,
    out: Option<&Path>,
    quick: bool,
) -> Result<(), Failure> {
    let began = Instant::now();
    let design = domecast_design::Design::load(design_file)?;
    let scene = scene_file
        .map(|path| {
            Scene::load(path).map_err(|error| match error {
                SimError::Input(error) if error.file.is_none() => Failure::from(error.in_file(path)),
                SimError::Input(error) => Failure::Input(error),
                other => DesignError::at("", "", other.to_string(), "a scene that can be drawn")
                    .in_file(path)
                    .into(),
            })
        })
        .transpose()?;
    let out = out.map_or_else(
        || PathBuf::from("output").join(format!("{}-accuracy", design.name())),
        Path::to_path_buf,
    );
    let inputs: Vec<&Path> = [design_file].into_iter().chain(scene_file).collect();
    let staged = StagedFolder::new(&out, "accuracy", &output.rules(&inputs))?;
    let done = |done: u32, doing: &str| {
        let filled = (20 * done / accuracy::STEPS) as usize;
        output.step(&format!("[{}{}] {doing}", "=".repeat(filled), " ".repeat(20 - filled)));
    };
    let measured = accuracy::measure(&design, scene.as_ref(), quick, &mut |count, doing| done(count, doing))
        .map_err(|error| match error {
            AccuracyError::Design(error) => Failure::from(error.in_file(design_file)),
            AccuracyError::Part(error) => Failure::from(DesignError::from(error).in_file(design_file)),
        })?;
    of_a_design::write(output, staged, &design, accuracy::accuracy_files(&measured))?;
    summarize(output, &measured)?;
    output.say(&format!(
        "{:.1} s; look at {}",
        began.elapsed().as_secs_f64(),
        out.join("index.html").display()
    ))?;
    output.say(&format!(
        "to have it in the report: domecast build {} --accuracy {}",
        design_file.display(),
        out.display()
    ))?;
    output.result(&json!({ "ok": true, "out": out.display().to_string(), "accuracy": measured }))
}

/// For each sweep what is in use and what is enough, then the error budgets.
fn summarize(output: &Output, measured: &Accuracy) -> Result<(), Failure> {
    for sweep in &measured.sweeps {
        let sample = |index: Option<usize>| index.and_then(|index| sweep.samples.get(index));
        let missing = || "what is in use is not among the samples of a quick look".to_owned();
        let used = sample(sweep.in_use).map_or_else(missing, |sample| {
            format!(
                "{}: error {} {}, {} per {}",
                sample.label,
                significant(sample.max_error),
                sweep.unit,
                duration(sample.per_item_s),
                sweep.item
            )
        });
        output.say(&format!("{}: {used}", sweep.title))?;
        if let (Some(asked), Some(enough)) = (sweep.asked, sample(sweep.meets)) {
            output.say(&format!(
                "  {} {} asked: {} is enough",
                significant(asked),
                sweep.unit,
                enough.label
            ))?;
        }
    }
    for budget in &measured.budgets {
        output.say(&format!(
            "{}: {} {} ({} from computing)",
            budget.title,
            significant(budget.total),
            budget.unit,
            significant(budget.computed)
        ))?;
    }
    Ok(())
}
