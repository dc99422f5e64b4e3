//! `domecast calibrate-light FRAMES CONSTANTS --ball-radius-mm R`

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::input::{input_fault, measured_beside, read_constants};
use super::output::{Failure, Output};
use domecast_files::StagedFile;
use domecast_live::decode::{self, Picture};
use domecast_live::frame_files::{has_extension, pictures_in, read_whole};
use domecast_runtime::calibrate::light::{LightFit, LightFitOptions, LightParameter, fit};
use domecast_runtime::track::CameraFrame;

/// What frames of the light's calibration are.
pub const FRAMES: &str = "a folder of PNG or JPEG frames, raw as the camera gives them: one of the untouched sensor, the first by name or \
                      --rest, and 5 to 20 presses of one ball";

/// What the command is given beside its folder.
#[derive(Debug, clap::Args)]
pub struct LightArguments {
    /// A folder of raw PNG or JPEG frames: the untouched sensor first by name (or `--rest`), then 5 to 20 presses of one ball, at
    /// one exposure.
    pub frames: PathBuf,
    /// The constants.json of the sensor.
    pub constants: PathBuf,
    /// Radius of the ball, mm.
    #[arg(long, value_name = "MM")]
    pub ball_radius_mm: f64,
    /// The frame of the untouched sensor, where it is not the first of the folder.
    #[arg(long, value_name = "FILE")]
    pub rest: Option<PathBuf>,
    /// Where to write [default: constants.measured.json beside the constants].
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// Fits the light to frames and writes measured constants.
pub fn run(output: &Output, arguments: &LightArguments) -> Result<(), Failure> {
    let LightArguments { frames, constants: constants_path, ball_radius_mm, rest, out } = arguments;
    let constants = read_constants(constants_path)?;
    let path = out.clone().unwrap_or_else(|| measured_beside(constants_path));
    let mut file = StagedFile::new(&path, "calibrate-light", &output.rules(&[frames, constants_path]))?;
    let names = frames_of(frames, rest.as_deref())?;
    output.step(&format!("reading {} frames", names.len()));
    let pictures = names.iter().map(|name| read(name)).collect::<Result<Vec<Picture>, Failure>>()?;
    let seen = names.iter().zip(&pictures).map(|(name, picture)| camera_frame(picture, name));
    let seen = seen.collect::<Result<Vec<_>, Failure>>()?;
    let Some((at_rest, presses)) = seen.split_first() else {
        return Err(input_fault(frames, "holds no frame", FRAMES));
    };
    output.step("fitting the light");
    let options = LightFitOptions { ball_radius_mm: *ball_radius_mm };
    let found = fit(&constants, at_rest, presses, &options).map_err(|error| {
        let of = error.frame.and_then(|frame| names.get(frame)).map_or(frames.as_path(), PathBuf::as_path);
        input_fault(of, error.problem, &error.cure)
    })?;
    file.write(found.constants.to_json().as_bytes())?;
    output.kept(file.commit()?);
    output.steps_done();
    say(output, &found)?;
    output.say(&format!("wrote {}", path.display()))?;
    let mut result = light_json(&found);
    result["constants"] = json!(path.display().to_string());
    result["frames"] = json!(seen.len());
    output.result(&result)
}

/// A fit for programs.
pub fn light_json(found: &LightFit) -> Value {
    json!({
        "rms_levels": found.rms_levels,
        "rest_rms_levels": found.rest_rms_levels,
        "iterations": found.iterations,
        "radius_by_presses_mm": found.radius_mm,
        "parameters": found.parameters,
        "not_observed": found.parameters.iter().filter(|p| !p.observed).map(|p| &p.name).collect::<Vec<_>>(),
        "not_distinguished": found.pairs,
        "presses": found.presses,
    })
}

/// A picture as the camera's frame; the fault is of the file or answer `of`.
pub fn camera_frame<'a>(picture: &'a Picture, of: &Path) -> Result<CameraFrame<'a>, Failure> {
    picture.frame().map_err(|problem| input_fault(of, problem, FRAMES))
}

fn say(output: &Output, found: &LightFit) -> Result<(), Failure> {
    let [before, after] = found.rms_levels;
    output.say(&format!(
        "{} presses, {} places under the ball: {before:.2} levels rms with the light of the frame at rest, {after:.2} after {} steps",
        found.presses.len(),
        found.presses.iter().map(|press| press.cells).sum::<usize>(),
        found.iterations
    ))?;
    output.say(&format!("the presses themselves say a radius of some {:.2} mm", found.radius_mm))?;
    for LightParameter { name, nominal, value, sd, observed, .. } in &found.parameters {
        let word = if *observed { "" } else { "  (not observed: the tolerance stands)" };
        output.say(&format!("{name:<24} {nominal:>10.5} -> {value:>10.5} +- {sd:.5}{word}"))?;
    }
    for pair in &found.pairs {
        let [a, b] = &pair.names;
        output.say(&format!("{a} and {b} are not distinguished (correlation {:.3})", pair.correlation))?;
    }
    Ok(())
}

fn read(path: &Path) -> Result<Picture, Failure> {
    let fault = |problem: String| input_fault(path, problem, FRAMES);
    let bytes = read_whole(path).map_err(|error| fault(format!("cannot be read ({error})")))?;
    decode::picture(&bytes).map_err(fault)
}

/// The frame at rest, then the others of a folder by name.
fn frames_of(folder: &Path, rest: Option<&Path>) -> Result<Vec<PathBuf>, Failure> {
    let found = pictures_in(folder)
        .map_err(|error| input_fault(folder, format!("cannot be read ({error})"), FRAMES))?;
    let is_rest = |path: &Path| {
        rest.is_some_and(|rest| {
            path == rest
                || std::fs::canonicalize(path)
                    .ok()
                    .is_some_and(|own| std::fs::canonicalize(rest).ok() == Some(own))
        })
    };
    let is_frame = |path: &PathBuf| has_extension(path, &["png", "jpg", "jpeg"]) && !is_rest(path);
    let frames: Vec<PathBuf> = found.into_iter().filter(is_frame).collect();
    if frames.is_empty() {
        return Err(input_fault(folder, "holds no PNG or JPEG frame", FRAMES));
    }
    Ok(rest.map(Path::to_path_buf).into_iter().chain(frames).collect())
}
