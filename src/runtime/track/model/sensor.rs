//! The sensor that is looked for.

use glam::DVec3;

use super::dots::{DotModel, KeyModel, dots_of, key_of};
use super::markers::MarkerModels;
use crate::constants::Constants;
use crate::track::error::TrackError;
use crate::track::frame::{MAX_PIXELS, Mask};
use domecast_optics::SensorOptics;
use domecast_optics::pose::{PoseOptions, PoseSolver};

/// Two poses both fit where they do so within this rms, px.
const MAX_AMBIGUOUS_RMS_PX: f64 = 1.0;
/// Farthest that the platform can be from rest where the constants do not give it, mm.
const DEFAULT_MAX_SHIFT_MM: f64 = 5.0;
/// Farthest that it can be pressed where the constants do not give it, mm.
const DEFAULT_MAX_PRESS_MM: f64 = 3.0;

/// The sensor that is looked for.
#[derive(Debug, Clone)]
pub(in crate::track) struct SensorModel {
    /// At rest.
    pub optics: SensorOptics,
    pub dots: Vec<DotModel>,
    /// The dot that is left out, where the constants name one.
    pub key: Option<KeyModel>,
    pub markers: MarkerModels,
    /// Farthest that the platform can be pressed, mm.
    pub max_press_mm: f64,
    /// Finds a pose from nothing; `None` of a rigid mount: its platform has one pose, at rest.
    pub solver: Option<PoseSolver>,
    pub mask: Mask,
    /// How far the dots of a place of the untouched skin, on the mean, are at most from where they were measured, px; `None`
    /// where the constants do not say it.
    pub max_still_px: Option<f64>,
    /// Whether the constants' dots were measured, at rest.
    pub are_dots_measured: bool,
}

impl SensorModel {
    /// From the constants; `max_residual_px`: largest rms of the markers' residuals that is a pose; `at_mm`: the point
    /// that displacements are stated about.
    pub fn new(constants: &Constants, max_residual_px: f64, at_mm: DVec3) -> Result<Self, TrackError> {
        let camera = &constants.camera;
        let pixels = (camera.width as usize).checked_mul(camera.height as usize);
        if pixels.is_none_or(|n| n == 0 || n > MAX_PIXELS) {
            let problem = format!("{} x {} is no frame", camera.width, camera.height);
            return Err(TrackError::at("camera.width", problem));
        }
        let fault = |problem: String| TrackError::at("camera, optics:", problem);
        let optics = constants.sensor().map_err(fault)?;
        let mask = &constants.mask;
        let matrix = camera.undistorted_matrix.as_flattened();
        if !(mask.center_px.iter().chain(matrix).all(|v| v.is_finite()) && mask.radius_px > 0.0) {
            return Err(TrackError::at("mask", "is no circle in the undistorted frame"));
        }
        let is_rigid = is_rigid(constants)?;
        let press_mm =
            constants.springs.as_ref().and_then(|s| s.stiffness_at.last()).map(|e| e.compression_mm);
        let max_shift_mm = press_mm.map_or(DEFAULT_MAX_SHIFT_MM, |press| press.clamp(0.5, 100.0) + 2.0);
        // Eight residuals less six of the pose: the solver's gate lets 1.84 times its noise pass as rms.
        let options = PoseOptions::new(max_residual_px.min(MAX_AMBIGUOUS_RMS_PX) / 1.84, max_shift_mm);
        let unusable = |error| TrackError::at("white_markers", format!("are not usable: {error}"));
        let solver = if is_rigid {
            None
        } else {
            Some(PoseSolver::new(&optics, &constants.markers(), options).map_err(unusable)?)
        };
        let dots = dots_of(constants, &optics)?;
        let key = key_of(constants, &optics, &dots)?;
        let max_press_mm = press_mm.unwrap_or(DEFAULT_MAX_PRESS_MM).clamp(0.0, 100.0);
        let markers = MarkerModels::new(constants, &optics, at_mm, max_press_mm)?;
        let mask = Mask::new(optics.lens(), camera, mask);
        let max_still_px =
            constants.tolerances.map(|t| t.black_centroid_px).filter(|px| px.is_finite() && *px > 0.0);
        let are_dots_measured = constants.optics_uncertainty.is_some();
        Ok(Self { optics, dots, key, markers, max_press_mm, solver, mask, max_still_px, are_dots_measured })
    }
}

/// Constants with neither springs nor white markers are those of a rigid mount: the platform is at rest in every frame,
/// and the dots are all that there is to follow.
fn is_rigid(constants: &Constants) -> Result<bool, TrackError> {
    if !constants.white_markers.is_empty() {
        return Ok(false);
    }
    if constants.springs.is_some() {
        let problem = "are none, but there are springs: where the platform is on them is found by four white markers; \
            leave out `springs` if it cannot move (a rigid mount)";
        return Err(TrackError::at("white_markers", problem));
    }
    if constants.black_dots.is_empty() {
        return Err(TrackError::at(
            "black_dots",
            "are none, nor are there white markers: nothing can be followed",
        ));
    }
    Ok(true)
}
