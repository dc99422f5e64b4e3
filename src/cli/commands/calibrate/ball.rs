//! Presses of a ball of known radius: the lights.

use std::path::Path;

use super::outcome::kind_of;
use super::session::{CalibrationSession, Step};
use crate::commands::calibrate_light::{FRAMES, camera_frame};
use crate::commands::input::input_fault;
use crate::commands::output::Failure;
use domecast_live::decode::{Picture, picture};
use domecast_runtime::calibrate::light::{
    LightFit, LightFitError, LightFitOptions, examine_press, fit, next_press,
};
use domecast_runtime::constants::Constants;

/// The step's name.
pub const BALL: &str = "ball";

/// The radius that an answer says, mm: `radius 4 mm`.
pub fn parse(words: &[&str]) -> Result<f64, String> {
    let ["radius", number, unit] = words else {
        return Err("says no radius (half the diameter) of the ball".into());
    };
    if *unit != "mm" {
        return Err(format!("says the radius in \"{unit}\""));
    }
    match number.parse::<f64>() {
        Ok(radius_mm) if radius_mm.is_finite() => Ok(radius_mm),
        _ => Err(format!("says a radius of \"{number}\"")),
    }
}

/// The presses of a session.
fn balls(steps: &[Step]) -> impl Iterator<Item = &Step> {
    steps.iter().filter(|step| kind_of(step) == BALL)
}

fn radius_mm(step: &Step) -> Option<f64> {
    let words: Vec<&str> = step.said.split_whitespace().skip(1).collect();
    parse(&words).ok()
}

/// The mean of a step's frames, which show one thing: less noise.
fn mean_of(pictures: &[Picture]) -> Option<Picture> {
    let first = pictures.first()?;
    let mut sums = vec![0_u32; first.bytes.len()];
    for picture in pictures {
        if picture.bytes.len() != sums.len() {
            return None;
        }
        sums.iter_mut().zip(&picture.bytes).for_each(|(sum, byte)| *sum += u32::from(*byte));
    }
    let count = pictures.len() as u32;
    let bytes = sums.iter().map(|sum| ((sum + count / 2) / count).min(255) as u8).collect();
    Some(Picture { bytes, ..first.clone() })
}

/// The mean of frames as they are kept, PNG.
fn mean_of_files(files: &[Vec<u8>], of: &Path) -> Result<Picture, Failure> {
    let fault = |problem: String| input_fault(of, problem, FRAMES);
    let pictures = files.iter().map(|bytes| picture(bytes)).collect::<Result<Vec<_>, _>>().map_err(fault)?;
    mean_of(&pictures).ok_or_else(|| fault("has no frames, or frames of several sizes".into()))
}

/// Looks at the frames of a press before it is kept; where it lies, from the pole and about the axis, degrees.
pub fn examine(
    session: &CalibrationSession,
    constants: &Constants,
    frames: &[Vec<u8>],
    (said, radius): (&str, f64),
) -> Result<[f64; 2], Failure> {
    let at = Path::new(said);
    if let Some(other) = balls(&session.steps).find(|step| radius_mm(step) != Some(radius)) {
        let problem = format!("is another ball than that of {} (\"{}\")", other.name, other.said);
        return Err(input_fault(at, problem, "presses of one ball"));
    }
    let Some(rest) = session.steps.iter().find(|step| kind_of(step) == "rest") else {
        return Err(input_fault(at, "has no frame at rest before it", "the steps in their order"));
    };
    let still = mean_of_files(&session.frames_of(rest)?, at)?;
    let pressed = mean_of_files(frames, at)?;
    let found = examine_press(
        constants,
        &camera_frame(&still, at)?,
        &camera_frame(&pressed, at)?,
        &LightFitOptions { ball_radius_mm: radius },
    );
    found.map_err(|error| input_fault(at, error.problem, &error.cure))
}

/// The press that is missing, as an answer with its place; `None` before the first one, and once there are enough.
pub fn next(constants: &Constants, steps: &[Step]) -> Option<String> {
    let taken: Vec<[f64; 2]> = balls(steps).filter_map(|step| step.place_deg).collect();
    let last = balls(steps).last()?;
    let [polar, azimuth] = next_press(constants, &taken).ok()??;
    Some(format!("{} ({polar:.0} degrees from the pole, azimuth {azimuth:.0})", last.said))
}

/// The lights by the presses of a session; `None` where there are none.
pub fn fit_light(session: &CalibrationSession, constants: &Constants) -> Result<Option<LightFit>, Failure> {
    let presses: Vec<&Step> = balls(&session.steps).collect();
    let Some(ball_radius_mm) = presses.first().and_then(|step| radius_mm(step)) else { return Ok(None) };
    let rest = session.steps.iter().find(|step| kind_of(step) == "rest");
    let steps: Vec<&Step> = rest.into_iter().chain(presses).collect();
    let read = |step: &&Step| mean_of_files(&session.frames_of(step)?, &session.path(&step.name));
    let pictures = steps.iter().map(read).collect::<Result<Vec<Picture>, Failure>>()?;
    let seen = steps.iter().zip(&pictures).map(|(step, own)| camera_frame(own, &session.path(&step.name)));
    let seen = seen.collect::<Result<Vec<_>, Failure>>()?;
    let Some((still, pressed)) = seen.split_first() else { return Ok(None) };
    let fault = |error: LightFitError| {
        let of = error.frame.and_then(|frame| steps.get(frame)).map_or(BALL, |step| &step.name);
        let cure = format!("{}; `undo` takes steps back, the last first", error.cure);
        input_fault(&session.path(of), error.problem, &cure)
    };
    fit(constants, still, pressed, &LightFitOptions { ball_radius_mm }).map(Some).map_err(fault)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_is_said_by_its_radius_with_the_unit() {
        assert_eq!(parse(&["radius", "4", "mm"]), Ok(4.0));
        for wrong in
            [&["4", "mm"][..], &["radius", "4"], &["radius", "0.4", "cm"], &["radius", "nan", "mm"], &[]]
        {
            assert!(parse(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn the_mean_of_frames_is_rounded_and_only_of_one_size() {
        let of = |bytes: &[u8]| Picture { width: bytes.len(), height: 1, channels: 1, bytes: bytes.to_vec() };
        let mean = mean_of(&[of(&[0, 10]), of(&[1, 11]), of(&[1, 12])]).expect("a mean");
        assert_eq!(mean.bytes, [1, 11]);
        assert!(mean_of(&[of(&[0]), of(&[0, 1])]).is_none() && mean_of(&[]).is_none());
    }
}
