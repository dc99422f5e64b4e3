//! `domecast calibrate-print MEASURED.csv DESIGN`: a measured print in, a design with a better map out.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::ValueEnum;
use serde_json::{Value, json};

use super::output::{Failure, Output};
use domecast_design::layout::calibrate::{CalibrateError, Calibration, Printed, calibrate};
use domecast_design::layout::{Layout, LayoutSpec};
use domecast_design::{Design, DesignError, parse_json, read_text};
use domecast_files::StagedFile;

/// Which artwork was printed and measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Marks {
    /// The test target, `artwork/print-target.*`.
    Target,
    /// The design's own dots, `artwork/dots.*`.
    Dots,
}

/// The map may reach this far past the outermost mark without a word: about the size of a mark, rad.
const BEYOND_RAD: f64 = 0.07;

/// Rejected points that are named one by one.
const NAMED: usize = 12;

/// Fits the map, writes the new design, and prints how well it fits.
pub fn run(
    output: &Output,
    measured: &Path,
    design_file: &Path,
    out: Option<&Path>,
    marks: Option<Marks>,
) -> Result<(), Failure> {
    output.step("reading");
    let design = Design::load(design_file)?;
    let out = out.map_or_else(|| beside(design_file), Path::to_path_buf);
    let mut file = StagedFile::new(&out, "calibrate-print", &output.rules(&[measured, design_file]))?;
    let text = read_text(measured)?;
    let printed = marks.map(|marks| match marks {
        Marks::Target => Printed::Target,
        Marks::Dots => Printed::Dots,
    });
    output.step("fitting");
    let found = calibrate(&design, &text, printed).map_err(|error| fault(error, measured, design_file))?;
    let new_text = with_map(&design, &found)?;
    // The new design must stand on its own before it is written.
    let new_design = Design::from_str(&new_text).map_err(|error| error.in_file(design_file))?;
    file.write(new_text.as_bytes())?;
    output.kept(file.commit()?);
    output.steps_done();
    if let Err(error) = LayoutSpec::of_design(&new_design).and_then(|spec| Layout::new(&spec)) {
        output.warn(&format!("the new map does not print the design's pattern: {error}"));
    }
    summarize(output, &found, &out)?;
    output.result(&report(&found, &out))
}

fn fault(error: CalibrateError, measured: &Path, design_file: &Path) -> DesignError {
    match error {
        CalibrateError::Table(error) => {
            let column = if error.column.is_empty() { "line".to_owned() } else { error.column };
            let mut fault = DesignError::at(column, json!(error.value), error.problem, error.allowed);
            fault.place = Some((error.line, 1));
            fault.in_file(measured)
        }
        CalibrateError::Layout(error) => DesignError::from(error).in_file(design_file),
        CalibrateError::Fit { .. } => DesignError::at(
            "",
            "",
            error.to_string(),
            "a print of the test target, measured from outside: 10 marks or more, few of them mistaken",
        )
        .in_file(measured),
    }
}

/// The design's text with the new map in its `print` section; everything else stays as it was written.
fn with_map(design: &Design, found: &Calibration) -> Result<String, Failure> {
    let ours = |error: serde_json::Error| Failure::Internal(error.to_string());
    let mut value: Value = parse_json(design.text())?;
    let transfer = serde_json::to_value(found.transfer).map_err(ours)?;
    let measured = serde_json::to_value(&found.measured).map_err(ours)?;
    match value.get_mut("print").and_then(Value::as_object_mut) {
        Some(print) => {
            print.insert("transfer".into(), transfer);
            print.insert("measured".into(), measured);
        }
        None => return Err(Failure::Internal("a resolved design has no print section".into())),
    }
    let mut text = serde_json::to_string_pretty(&value).map_err(ours)?;
    text.push('\n');
    Ok(text)
}

/// `designs/thumb24.json` becomes `designs/thumb24-measured.json`.
fn beside(design_file: &Path) -> PathBuf {
    let stem = design_file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let stem = stem.strip_suffix("-measured").unwrap_or(&stem);
    design_file.with_file_name(format!("{stem}-measured.json"))
}

fn summarize(output: &Output, found: &Calibration, out: &Path) -> Result<(), Failure> {
    let fit = &found.fit;
    let used = found.table.rows.len() - fit.rejected.len();
    output.say(&format!("{}: a measured map on top of the {} one", out.display(), fit.nominal.as_str()))?;
    output.say(&format!(
        "  {used} points of {} prints used, {} numbers fitted, to {:.1} deg from the pole",
        found.table.prints.len(),
        fit.parameters,
        found.measured.max_polar_deg
    ))?;
    output.say(&format!(
        "  residual {:.4} mm rms per axis, {:.4} mm at most; marks land {:.4} mm off on average, {:.4} mm before",
        fit.residual_rms_mm, fit.residual_max_mm, found.error_after_mm, found.error_before_mm
    ))?;
    match (fit.scatter_mm, fit.lack_of_fit_mm, fit.print_shift_mm) {
        (Some(scatter), Some(lack), Some(shift)) => output.say(&format!(
            "  print-to-print scatter {scatter:.4} mm per axis (whole prints shift by {shift:.4}); the map itself \
             misses {lack:.4}"
        ))?,
        _ => output.say("  one print only: how much of the residual is print-to-print scatter is not known")?,
    }
    if fit.correction.max_polar_rad > fit.measured_to_rad + BEYOND_RAD {
        output.warn(&format!(
            "the marks landed up to {:.1} deg from the pole; from there to {:.1} deg the map is extrapolated by its \
             formula: print the target once more with the new design to measure that part",
            fit.measured_to_rad.to_degrees(),
            fit.correction.max_polar_rad.to_degrees()
        ));
    }
    for index in fit.rejected.iter().take(NAMED) {
        if let Some(row) = found.table.rows.get(*index) {
            output
                .warn(&format!("line {}: mark {} does not fit the others and is left out", row.line, row.id));
        }
    }
    if fit.rejected.len() > NAMED {
        output.warn(&format!("{} more points are left out", fit.rejected.len() - NAMED));
    }
    Ok(())
}

fn report(found: &Calibration, out: &Path) -> Value {
    let fit = &found.fit;
    let rejected = fit.rejected.iter().filter_map(|index| found.table.rows.get(*index));
    json!({
        "ok": true,
        "out": out.display().to_string(),
        "printed": match found.printed { Printed::Target => "target", Printed::Dots => "dots" },
        "transfer": fit.nominal.as_str(),
        "measured": found.measured,
        "parameters": fit.parameters,
        "measured_to_deg": fit.measured_to_rad.to_degrees(),
        "prints": found.table.prints.len(),
        "residual_rms_mm": fit.residual_rms_mm,
        "residual_max_mm": fit.residual_max_mm,
        "scatter_mm": fit.scatter_mm,
        "print_shift_mm": fit.print_shift_mm,
        "lack_of_fit_mm": fit.lack_of_fit_mm,
        "error_before_mm": found.error_before_mm,
        "error_after_mm": found.error_after_mm,
        "rejected": rejected.map(|row| json!({ "line": row.line, "id": row.id })).collect::<Vec<_>>(),
    })
}
