//! `domecast calibrate-force MEASURED.csv CONSTANTS`

use std::path::Path;

use glam::{DVec2, DVec3};
use serde_json::json;

use super::input::{input_fault, measured_beside, read_constants};
use super::output::{Failure, Output};
use domecast_design::read_text;
use domecast_files::StagedFile;
use domecast_optics::pose::{PoseOptions, PoseSolver, Sighting};
use domecast_runtime::calibrate::Table;
use domecast_runtime::calibrate::force::{Pair, fit};
use domecast_runtime::constants::{Constants, POSE_AXES, StiffnessAt, WRENCH_AXES, matrix_of, rows};
use domecast_springs::Displacement;

/// Ranges (mm, rad) above which an axis counts as moved: some times what one frame resolves.
const MOVED: [f64; 6] = [0.02, 0.02, 0.02, 0.002, 0.002, 0.002];
/// Noise that a marker's centroid in a measured table may have, px.
const CENTROID_NOISE_PX: f64 = 0.5;

/// Fits the springs to measured pairs and writes constants with `"source": "measured"`.
pub fn run(
    output: &Output,
    measured: &Path,
    constants_path: &Path,
    out: Option<&Path>,
) -> Result<(), Failure> {
    let mut constants = read_constants(constants_path)?;
    if constants.springs.is_none() {
        return Err(input_fault(
            constants_path,
            "has no springs (a rigid mount): there is no stiffness to fit, and no net wrench is promised",
            "constants of a design with mount.kind = \"springs\"; on a rigid mount a load cell under the posts has the net wrench",
        ));
    }
    let path = out.map_or_else(|| measured_beside(constants_path), Path::to_path_buf);
    let mut file = StagedFile::new(&path, "calibrate-force", &output.rules(&[measured, constants_path]))?;
    let text = read_text(measured)?;
    let table = Table::parse(&text)
        .map_err(|error| input_fault(measured, error.to_string(), "a table of displacements and wrenches"))?;
    output.step("reading the pairs");
    let (pairs, rejected) = pairs_of(&table, &constants, measured)?;
    let Some(springs) = constants.springs.as_mut() else {
        return Err(input_fault(constants_path, "has no springs", "constants with springs"));
    };
    output.step("fitting the stiffness");
    let found = fit(&pairs, &matrix_of(&springs.stiffness), &MOVED).map_err(|error| {
        input_fault(measured, error.to_string(), "pairs that move on the axes to be fitted")
    })?;
    springs.stiffness = found.stiffness;
    springs.source = "measured".into();
    springs.offset = found.offset;
    springs.stiffness_at = match &found.by_compression {
        Some(growth) => {
            let at = |compression_mm: f64| StiffnessAt {
                compression_mm,
                stiffness: rows(&(matrix_of(&found.stiffness) + matrix_of(growth) * compression_mm)),
            };
            let deepest = pairs.iter().map(|pair| -pair.displacement[2]).fold(0.0, f64::max);
            [0.0, 0.25, 0.5, 0.75, 1.0].map(|part| at(part * deepest)).to_vec()
        }
        None => Vec::new(),
    };
    constants.refit_plain_runtime();
    constants.calibrations.push(json!({ "kind": "force", "pairs": pairs.len(), "fit": found }));
    file.write(constants.to_json().as_bytes())?;
    output.kept(file.commit()?);
    output.steps_done();
    output.say(&format!("{} pairs, model {:?}", pairs.len(), found.model))?;
    for axis in &found.axes {
        let hysteresis = axis.hysteresis.map_or("-".to_owned(), |h| format!("{:.2} %", 100.0 * h));
        output.say(&format!(
            "{}: noise {:.4}, {} outliers of {}, hysteresis {hysteresis}",
            axis.axis,
            axis.sd,
            axis.outliers.len(),
            axis.readings
        ))?;
        for (j, name) in POSE_AXES.iter().enumerate() {
            if let Some(half) = axis.half_widths[j] {
                output.say(&format!("  by {name}: {:.4} +- {half:.4}", axis.coefficients[j]))?;
            }
        }
    }
    for reason in found.refused.iter().chain(&rejected) {
        output.warn(reason);
    }
    output.say(&format!("wrote {}", path.display()))?;
    output.result(&json!({
        "constants": path.display().to_string(), "pairs": pairs.len(), "fit": found, "rejected": rejected,
    }))
}

/// Pairs of a table with displacements or marker pixels; and the rows without a pose, by line.
fn pairs_of(table: &Table, constants: &Constants, path: &Path) -> Result<(Vec<Pair>, Vec<String>), Failure> {
    let fault = |error: domecast_runtime::calibrate::TableError| {
        input_fault(path, error.to_string(), "a finite number, or nothing where an axis is missing")
    };
    let wrench_columns = WRENCH_AXES.map(|name| table.column(name));
    if wrench_columns.iter().all(Option::is_none) {
        return Err(input_fault(
            path,
            "no column of Fx, Fy, Fz, Mx, My, Mz",
            "at least one axis of the reference",
        ));
    }
    let pose_columns: Option<Vec<usize>> = POSE_AXES.iter().map(|name| table.column(name)).collect();
    let markers = constants.markers();
    let pixel_columns: Option<Vec<[usize; 2]>> = markers
        .iter()
        .map(|m| Some([table.column(&format!("u{}", m.id))?, table.column(&format!("v{}", m.id))?]))
        .collect();
    let solver = match (&pose_columns, &pixel_columns) {
        (Some(_), _) => None,
        (None, Some(_)) => {
            let optics = constants.sensor().map_err(|e| input_fault(path, e, "constants of a sensor"))?;
            let reach = optics.air_gap_mm().abs().max(1.0);
            let made = PoseSolver::new(&optics, &markers, PoseOptions::new(CENTROID_NOISE_PX, reach));
            Some(made.map_err(|e| input_fault(path, e.to_string(), "four white markers in the constants"))?)
        }
        (None, None) => {
            let allowed = "columns tx,ty,tz,rx,ry,rz (mm, rad) or u0,v0,u1,v1,.. (px) for every white marker";
            return Err(input_fault(path, "no displacements and no pixels", allowed));
        }
    };
    let at_mm = constants.springs.as_ref().map_or(DVec3::ZERO, |s| DVec3::from_array(s.at_mm));
    let (mut pairs, mut rejected) = (Vec::new(), Vec::new());
    for row in 0..table.rows.len() {
        let displacement = if let (Some(solver), Some(columns)) = (&solver, &pixel_columns) {
            let mut sightings = Vec::new();
            for (marker, [u, v]) in markers.iter().zip(columns) {
                if let (Some(u), Some(v)) =
                    (table.number(row, *u).map_err(fault)?, table.number(row, *v).map_err(fault)?)
                {
                    sightings.push(Sighting { id: marker.id, centroid_px: DVec2::new(u, v) });
                }
            }
            match solver.solve(&sightings) {
                Ok(found) => Displacement::of_pose(&found.pose, at_mm).to_array(),
                Err(error) => {
                    rejected.push(format!("line {}: {error}", table.lines[row]));
                    continue;
                }
            }
        } else {
            let mut d = [0.0; 6];
            for (value, column) in d.iter_mut().zip(pose_columns.iter().flatten()) {
                *value = table.required(row, *column).map_err(fault)?;
            }
            d
        };
        let mut wrench = [None; 6];
        for (value, column) in wrench.iter_mut().zip(wrench_columns) {
            if let Some(column) = column {
                *value = table.number(row, column).map_err(fault)?;
            }
        }
        pairs.push(Pair { displacement, wrench });
    }
    if pairs.is_empty() {
        let first = rejected.first().cloned().unwrap_or_else(|| "the table has no rows".into());
        return Err(input_fault(path, format!("no usable pair; {first}"), "at least one row"));
    }
    Ok((pairs, rejected))
}
