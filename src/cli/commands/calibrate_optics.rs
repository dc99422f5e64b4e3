//! `domecast calibrate-optics FRAMES|CENTROIDS.csv CONSTANTS`

use std::path::{Path, PathBuf};

use glam::DVec2;
use serde_json::json;

use super::input::{input_fault, measured_beside, read_constants};
use super::output::{Failure, Output};
use domecast_design::{read_text, read_up_to};
use domecast_files::StagedFile;
use domecast_runtime::calibrate::detect::Detector;
use domecast_runtime::calibrate::optics::{Kind, Observation, fit};
use domecast_runtime::calibrate::{Table, TableError};
use domecast_runtime::constants::Constants;
use domecast_runtime::frames::Gray;

const COLUMNS: &str = "columns frame,kind,id,u,v; kind is white or black; the lowest frame is at rest";

/// Bytes at most of a frame's file.
const MAX_FRAME_BYTES: u64 = 1 << 28;
const FRAMES: &str = "a folder of PNG frames, raw as the camera gives them; the first by name are at rest";

/// Where results go.
pub struct Files<'a> {
    /// The measured constants; beside the nominal ones where it is not given.
    pub out: Option<&'a Path>,
    /// The centroids that were found in frames.
    pub centroids: Option<&'a Path>,
}

/// Fits the optics to frames or centroids and writes measured constants.
pub fn run(
    output: &Output,
    seen: &Path,
    constants_path: &Path,
    files: &Files,
    rest_frames: usize,
) -> Result<(), Failure> {
    let constants = read_constants(constants_path)?;
    let path = files.out.map_or_else(|| measured_beside(constants_path), Path::to_path_buf);
    let inputs = [seen, constants_path];
    let mut file = StagedFile::new(&path, "calibrate-optics", &output.rules(&inputs))?;
    let mut centroids = files
        .centroids
        .map(|path| StagedFile::new(path, "calibrate-optics", &output.rules(&inputs)))
        .transpose()?;
    let Some(priors) = constants.tolerances else {
        let problem = "has no \"tolerances\", which are the priors of this calibration";
        return Err(input_fault(constants_path, problem, "constants written by `domecast build`"));
    };
    if constants.white_markers.is_empty() {
        return Err(input_fault(
            constants_path,
            "has no white markers (a rigid mount): this calibration takes the pose of every frame from them",
            "constants of a design with mount.kind = \"springs\"; on a rigid mount a lens measured before it is built in \
             (camera.calibration), and `track --reference N`, which takes off what the first N frames without load show",
        ));
    }
    let (observations, missing) = if seen.is_dir() || is_png(seen) {
        let found = observations_in(output, &frames_of(seen)?, &constants)?;
        if let Some(mut file) = centroids.take() {
            file.write(table_of(&found.0).as_bytes())?;
            output.kept(file.commit()?);
        }
        found
    } else {
        (table_in(seen)?, 0)
    };
    output.step("fitting the optics");
    let mut found = fit(&constants, &observations, &priors, rest_frames)
        .map_err(|error| input_fault(seen, error.to_string(), "marks of this sensor"))?;
    found.constants.calibrations.push(json!({
        "kind": "optics",
        "frames": found.poses.len(),
        "rms_px": found.rms_px,
        "parameters": found.parameters,
    }));
    file.write(found.constants.to_json().as_bytes())?;
    output.kept(file.commit()?);
    output.steps_done();
    let [before, after] = found.rms_px;
    output.say(&format!(
        "{} frames, {} centroids: {before:.3} px rms before, {after:.3} after {} steps, {} beyond three sd",
        found.poses.len(),
        observations.len(),
        found.iterations,
        found.outliers
    ))?;
    if missing > 0 {
        output.warn(&format!("{missing} black dots were not found in their frames"));
    }
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
        "black_dots_missing": missing,
        "parameters": found.parameters,
    }))
}

fn is_png(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
}

/// The frames of a folder by name, or the one that is named.
fn frames_of(path: &Path) -> Result<Vec<PathBuf>, Failure> {
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let entries = std::fs::read_dir(path)
        .map_err(|error| input_fault(path, format!("cannot be read ({error})"), FRAMES))?;
    let mut frames: Vec<PathBuf> =
        entries.filter_map(|e| Some(e.ok()?.path())).filter(|p| is_png(p)).collect();
    frames.sort();
    if frames.is_empty() {
        return Err(input_fault(path, "holds no PNG frame", FRAMES));
    }
    Ok(frames)
}

/// The marks in frames, and how many dots were not found.
fn observations_in(
    output: &Output,
    frames: &[PathBuf],
    constants: &Constants,
) -> Result<(Vec<Observation>, usize), Failure> {
    let detector =
        Detector::new(constants).map_err(|e| input_fault(Path::new("constants"), e.to_string(), FRAMES))?;
    let (mut observations, mut missing) = (Vec::new(), 0);
    for (number, path) in frames.iter().enumerate() {
        output.step(&format!("finding the marks in frame {number}"));
        let fault = |problem: String| input_fault(path, problem, FRAMES);
        let bytes = std::fs::File::open(path).and_then(|file| read_up_to(file, MAX_FRAME_BYTES));
        let bytes = bytes.map_err(|error| fault(format!("cannot be read ({error})")))?;
        let frame = Gray::from_png(&bytes).map_err(|error| fault(error.to_string()))?;
        let found = detector.observe(&frame, number).map_err(|error| fault(error.to_string()))?;
        missing += found.black_missing;
        observations.extend(found.observations);
    }
    Ok((observations, missing))
}

/// The table that [`observations_of`] reads.
pub fn table_of(observations: &[Observation]) -> String {
    let mut text = String::from("frame,kind,id,u,v\n");
    for Observation { frame, kind, id, centroid_px } in observations {
        let kind = if *kind == Kind::White { "white" } else { "black" };
        text += &format!("{frame},{kind},{id},{:.5},{:.5}\n", centroid_px.x, centroid_px.y);
    }
    text
}

/// The centroids of a table, which has at least one.
fn table_in(path: &Path) -> Result<Vec<Observation>, Failure> {
    if !path.exists() {
        let allowed = "a folder of PNG frames, one frame, or a CSV of frame,kind,id,u,v";
        return Err(input_fault(path, "there is no such file or folder", allowed));
    }
    let found = observations_of(&read_text(path)?).map_err(|e| input_fault(path, e.to_string(), COLUMNS))?;
    match found.is_empty() {
        true => {
            Err(input_fault(path, "the table has a header and no rows", "a row for each mark of each frame"))
        }
        false => Ok(found),
    }
}

/// The centroids of a table's text.
pub fn observations_of(text: &str) -> Result<Vec<Observation>, TableError> {
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
