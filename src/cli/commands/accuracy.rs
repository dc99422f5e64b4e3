//! `domecast accuracy DESIGN`

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;

use super::output::{Failure, Output};
use crate::accuracy;
use crate::accuracy::AccuracyError;
use domecast_design::DesignError;
use domecast_fab::build::{DESIGN_NAME, DesignRecord, MANIFEST_NAME, Manifest, Tree, sha256_hex};
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
    let done = |done: u32, doing: &str| {
        let filled = (20 * done / accuracy::STEPS) as usize;
        output.step(&format!("[{}{}] {doing}", "=".repeat(filled), " ".repeat(20 - filled)));
    };
    let measured = accuracy::measure(&design, scene.as_ref(), quick, &mut |count, doing| done(count, doing))
        .map_err(|error| match error {
            AccuracyError::Design(error) => Failure::from(error.in_file(design_file)),
            AccuracyError::Part(error) => Failure::from(DesignError::from(error).in_file(design_file)),
        })?;
    let mut tree = Tree::default();
    for file in measured.files() {
        tree.add(file.name, file.bytes);
    }
    tree.add(DESIGN_NAME, design.text().as_bytes().to_vec());
    let record =
        DesignRecord { name: design.name().to_owned(), sha256: sha256_hex(design.text().as_bytes()) };
    let manifest = Manifest::new(record, Vec::new(), Vec::new(), tree.files());
    let text =
        serde_json::to_string_pretty(&manifest).map_err(|error| Failure::Internal(error.to_string()))?;
    tree.add(MANIFEST_NAME, text.into_bytes());
    let out = out.map_or_else(
        || PathBuf::from("output").join(format!("{}-accuracy", design.name())),
        Path::to_path_buf,
    );
    output.step("writing");
    tree.write(&out)?;
    output.steps_done();
    for ladder in &measured.ladders {
        let rung = |index: Option<usize>| index.and_then(|index| ladder.rungs.get(index));
        let used = rung(ladder.in_use).map_or_else(String::new, |rung| {
            format!(
                "{} leaves {} {} at {:.3e} s a {}",
                rung.label,
                domecast_fab::numbers::significant(rung.max_error),
                ladder.unit,
                rung.per_item_s,
                ladder.item
            )
        });
        output.say(&format!("{}: {used}", ladder.title))?;
        if let (Some(asked), Some(enough)) = (ladder.asked, rung(ladder.meets)) {
            output.say(&format!(
                "  {} {} asked: {} is enough",
                domecast_fab::numbers::significant(asked),
                ladder.unit,
                enough.label
            ))?;
        }
    }
    for budget in &measured.budgets {
        output.say(&format!(
            "{}: {} {} ({} worked out)",
            budget.title,
            domecast_fab::numbers::significant(budget.total),
            budget.unit,
            domecast_fab::numbers::significant(budget.computed)
        ))?;
    }
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
