//! `domecast calibrate-force MEASURED.csv CONSTANTS`

use std::path::Path;

use glam::{DVec2, DVec3};
use nalgebra::{Matrix6, Vector6};
use serde_json::json;

use super::input::{input_fault, measured_beside, read_constants};
use super::output::{Failure, Output};
use domecast_design::read_text;
use domecast_files::StagedFile;
use domecast_optics::pose::{PoseOptions, PoseSolver, Sighting};
use domecast_runtime::calibrate::Table;
use domecast_runtime::calibrate::force::{
    ForceError, ForceFit, MotionNoise, Pair, examine_fit, examine_pairs, fit,
};
use domecast_runtime::constants::{Constants, POSE_AXES, WRENCH_AXES, matrix_of};
use domecast_springs::Displacement;

/// Ranges (mm, rad) above which an axis counts as moved: some times what one frame resolves.
const MOVED: [f64; 6] = [0.02, 0.02, 0.02, 0.002, 0.002, 0.002];
/// Noise that a marker's centroid in a measured table may have, px.
const CENTROID_NOISE_PX: f64 = 0.5;
/// Standard deviation of a centroid where the constants do not say it, px.
const CENTROID_SD_PX: f64 = 0.1;
/// More of the rows than this without a pose are not this sensor's.
const MAX_REJECTED: f64 = 0.5;
/// What a table of this sensor holds.
const ALLOWED: &str = "rows of one displacement (mm, rad) and the wrench (N, N*mm, about springs.at_mm) that holds the \
                       platform there; nothing was written";

/// What is known of the motions' noise: `MM,RAD` for shifts and turns, or six numbers for tx .. rz.
pub fn motion_sd(text: &str) -> Result<[f64; 6], String> {
    let allowed =
        || format!("\"{text}\" is not two numbers (mm,rad) or six (tx .. rz), finite and not negative");
    let numbers: Vec<f64> =
        text.split(',').map(|v| v.trim().parse().map_err(|_| allowed())).collect::<Result<_, _>>()?;
    if numbers.iter().any(|v: &f64| !(v.is_finite() && *v >= 0.0 && *v < 1e3)) {
        return Err(allowed());
    }
    match numbers[..] {
        [mm, rad] => Ok([mm, mm, mm, rad, rad, rad]),
        [tx, ty, tz, rx, ry, rz] => Ok([tx, ty, tz, rx, ry, rz]),
        _ => Err(allowed()),
    }
}

/// A temperature in degrees C.
pub fn celsius(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|v: &f64| (-100.0..=200.0).contains(v));
    number.ok_or_else(|| "a number of degrees C from -100 to 200".into())
}

/// What is known of the measurement besides its table.
pub struct Known {
    /// Deviations of the motions' noise.
    pub motion_sd: Option<[f64; 6]>,
    /// Temperature of the springs.
    pub temperature_c: Option<f64>,
}

/// Fits the springs to measured pairs and writes constants with `"source": "measured"`.
pub fn run(
    output: &Output,
    measured: &Path,
    constants_path: &Path,
    out: Option<&Path>,
    known: &Known,
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
    let Measured { mut pairs, lines, rejected, is_by_pixels } = pairs_of(&table, &constants, measured)?;
    if let Some(sd) = known.motion_sd {
        let covariance = Matrix6::from_diagonal(&Vector6::from(sd.map(|v| v * v)));
        pairs.iter_mut().for_each(|pair| pair.displacement_covariance = covariance);
    }
    let noise = if known.motion_sd.is_some() || is_by_pixels {
        MotionNoise::Stated
    } else {
        MotionNoise::FromScatter
    };
    let Some(springs) = constants.springs.as_ref() else {
        return Err(input_fault(constants_path, "has no springs", "constants with springs"));
    };
    output.step("fitting the stiffness");
    let fault = |error: ForceError| {
        let allowed = match error {
            ForceError::Suspect(_) => ALLOWED,
            _ => "pairs that move on the axes to be fitted",
        };
        input_fault(measured, error.to_string(), allowed)
    };
    examine_pairs(&pairs, springs, &MOVED, &lines).map_err(fault)?;
    let found = fit(&pairs, &matrix_of(&springs.stiffness), &MOVED, noise).map_err(fault)?;
    examine_fit(&found, &pairs, springs).map_err(fault)?;
    found.write_into(&mut constants, &pairs, is_by_pixels);
    if let Some((own, at_c)) =
        constants.springs.as_mut().and_then(|s| s.temperature.as_mut()).zip(known.temperature_c)
    {
        own.at_c = at_c;
    }
    constants.calibrations.push(json!({ "kind": "force", "pairs": pairs.len(), "fit": found }));
    file.write(constants.to_json().as_bytes())?;
    output.kept(file.commit()?);
    output.steps_done();
    summary(output, &found, pairs.len())?;
    for reason in found.refused.iter().chain(&rejected) {
        output.warn(reason);
    }
    output.say(&format!("wrote {}", path.display()))?;
    output.result(&json!({
        "constants": path.display().to_string(), "pairs": pairs.len(), "fit": found, "rejected": rejected,
    }))
}

/// The numbers for people.
fn summary(output: &Output, found: &ForceFit, pairs: usize) -> Result<(), Failure> {
    output.say(&format!("{} pairs, model {:?}", pairs, found.model))?;
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
    if found.motion_sd.iter().any(|sd| *sd > 0.0) {
        let sds: Vec<String> = found.motion_sd.iter().map(|sd| format!("{sd:.4}")).collect();
        output.say(&format!("noise of the displacements taken out (mm, rad): {}", sds.join(", ")))?;
    }
    Ok(())
}

/// What a table holds.
struct Measured {
    pairs: Vec<Pair>,
    /// Line of each pair.
    lines: Vec<usize>,
    /// Rows without a pose, by line.
    rejected: Vec<String>,
    /// Whether the displacements come from the markers' pixels.
    is_by_pixels: bool,
}

/// Pairs of a table with displacements or marker pixels.
fn pairs_of(table: &Table, constants: &Constants, path: &Path) -> Result<Measured, Failure> {
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
            return Err(input_fault(path, missing_columns(table), allowed));
        }
    };
    let at_mm = constants.springs.as_ref().map_or(DVec3::ZERO, |s| DVec3::from_array(s.at_mm));
    let (mut pairs, mut lines, mut rejected) = (Vec::new(), Vec::new(), Vec::new());
    // The solver's covariance is that of its own noise.
    let centroid_px = constants.tolerances.map_or(CENTROID_SD_PX, |t| t.white_centroid_px);
    let variance_factor = (centroid_px / CENTROID_NOISE_PX).powi(2);
    for row in 0..table.rows.len() {
        let mut displacement_covariance = Matrix6::zeros();
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
                Ok(found) => {
                    displacement_covariance = found.displacement_covariance(at_mm) * variance_factor;
                    Displacement::of_pose(&found.pose, at_mm).to_array()
                }
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
        pairs.push(Pair { displacement, displacement_covariance, wrench });
        lines.push(table.lines[row]);
    }
    has_enough(&pairs, &rejected, table, path)?;
    Ok(Measured { pairs, lines, rejected, is_by_pixels: pixel_columns.is_some() && pose_columns.is_none() })
}

/// Which columns of the displacement a table lacks, in words.
fn missing_columns(table: &Table) -> String {
    let gaps: Vec<&str> = POSE_AXES.into_iter().filter(|name| table.column(name).is_none()).collect();
    match gaps.as_slice() {
        [one] => format!("the column {one} is missing"),
        all if all.len() == POSE_AXES.len() => "no displacements and no pixels".to_owned(),
        some => format!("the columns {} are missing", some.join(", ")),
    }
}

/// Whether enough of a table's rows have a pose.
fn has_enough(pairs: &[Pair], rejected: &[String], table: &Table, path: &Path) -> Result<(), Failure> {
    if table.rows.is_empty() {
        return Err(input_fault(path, "the table has a header and no rows", "a row for each measured load"));
    }
    if pairs.is_empty() {
        let first = rejected.first().cloned().unwrap_or_else(|| "no row has numbers".into());
        return Err(input_fault(path, format!("no usable pair; {first}"), "at least one row"));
    }
    if rejected.len() as f64 > MAX_REJECTED * table.rows.len() as f64 {
        let (count, rows) = (rejected.len(), table.rows.len());
        let problem = format!("{count} of {rows} rows show no pose of this sensor; {}", rejected[0]);
        return Err(input_fault(
            path,
            problem,
            "the markers' pixels in the order of their numbers, in raw frames",
        ));
    }
    Ok(())
}
