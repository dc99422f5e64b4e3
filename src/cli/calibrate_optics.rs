//! `domecast calibrate-optics CENTROIDS.csv CONSTANTS`

use std::path::Path;

use glam::DVec2;
use serde_json::json;

use super::calibrate_force::{input_fault, measured_beside, read_constants, write_whole};
use super::output::{Failure, Output};
use crate::calibrate::optics::{Kind, Observation, fit};
use crate::calibrate::{Table, TableError};
use crate::design::read_text;

const COLUMNS: &str = "columns frame,kind,id,u,v; kind is white or black; the lowest frame is at rest";

/// Fits the optics to centroids and writes measured constants.
pub fn run(
    output: &Output,
    centroids: &Path,
    constants_path: &Path,
    out: Option<&Path>,
    rest_frames: usize,
) -> Result<(), Failure> {
    let constants = read_constants(constants_path)?;
    let Some(priors) = constants.tolerances else {
        let problem = "has no \"tolerances\", which are the priors of this calibration";
        return Err(input_fault(constants_path, problem, "constants written by `domecast build`"));
    };
    let text = read_text(centroids)?;
    let observations = observations_of(&text).map_err(|e| input_fault(centroids, e.to_string(), COLUMNS))?;
    output.step("fitting the optics");
    let mut found = fit(&constants, &observations, &priors, rest_frames)
        .map_err(|error| input_fault(centroids, error.to_string(), "centroids of this sensor's marks"))?;
    found.constants.calibrations.push(json!({
        "kind": "optics",
        "frames": found.poses.len(),
        "rms_px": found.rms_px,
        "parameters": found.parameters,
    }));
    let path = out.map_or_else(|| measured_beside(constants_path), Path::to_path_buf);
    write_whole(&path, &found.constants.to_json())?;
    output.steps_done();
    let [before, after] = found.rms_px;
    output.say(&format!(
        "{} frames, {} centroids: {before:.3} px rms before, {after:.3} after {} steps, {} beyond three sd",
        found.poses.len(),
        observations.len(),
        found.iterations,
        found.outliers
    ))?;
    for p in &found.parameters {
        let word = if p.observed { "" } else { "  (not observed: the tolerance stands)" };
        output
            .say(&format!("{:<24} {:>10.5} -> {:>10.5} +- {:.5}{word}", p.name, p.nominal, p.value, p.sd))?;
    }
    output.say(&format!("wrote {}", path.display()))?;
    output.result(&json!({
        "constants": path.display().to_string(),
        "frames": found.poses.len(),
        "rms_px": found.rms_px,
        "iterations": found.iterations,
        "outliers": found.outliers,
        "parameters": found.parameters,
    }))
}

fn observations_of(text: &str) -> Result<Vec<Observation>, TableError> {
    let table = Table::parse(text)?;
    let column = |name: &str| {
        table.column(name).ok_or_else(|| TableError {
            line: 1,
            column: Some(name.into()),
            problem: "this column is missing".into(),
        })
    };
    let [frame, kind, id, u, v] =
        [column("frame")?, column("kind")?, column("id")?, column("u")?, column("v")?];
    let whole = |row: usize, at: usize| {
        let value = table.required(row, at)?;
        if value >= 0.0 && value.fract() == 0.0 && value < 1e9 {
            Ok(value as usize)
        } else {
            Err(TableError {
                line: table.lines[row],
                column: table.columns.get(at).cloned(),
                problem: format!("{value} is not a whole number from 0"),
            })
        }
    };
    let mut found = Vec::with_capacity(table.rows.len());
    for row in 0..table.rows.len() {
        let kind = match table.rows[row][kind].as_str() {
            "white" => Kind::White,
            "black" => Kind::Black,
            other => {
                return Err(TableError {
                    line: table.lines[row],
                    column: Some("kind".into()),
                    problem: format!("\"{other}\" is neither white nor black"),
                });
            }
        };
        let centroid_px = DVec2::new(table.required(row, u)?, table.required(row, v)?);
        found.push(Observation { frame: whole(row, frame)?, kind, id: whole(row, id)?, centroid_px });
    }
    Ok(found)
}
