//! What goes into the fit of the light and what comes out of it.

use glam::DVec3;
use serde::Serialize;

use crate::constants::Constants;
use crate::shape::ShapeError;

/// Settings of the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightFitOptions {
    /// Radius of the ball that was pressed, mm.
    pub ball_radius_mm: f64,
}

/// One fitted number of the light.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LightParameter {
    /// Name: `leds[0].flux`, `leds[0].up_mm`, `lobe.lambert_fraction`, `crosstalk.red_of_green`, ..
    pub name: String,
    /// Nominal value, in the unit of the name (flux mW).
    pub nominal: f64,
    /// Fitted value.
    pub value: f64,
    /// Standard deviation before (the tolerance).
    pub prior_sd: f64,
    /// Standard deviation after.
    pub sd: f64,
    /// Whether the frames said more of it than the tolerance does (less than seven tenths of it are left).
    pub observed: bool,
}

/// Two numbers of which only a combination is seen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LightPair {
    /// Names of both.
    pub names: [String; 2],
    /// Their correlation.
    pub correlation: f64,
}

/// The press of one frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BallPress {
    /// Number of the frame, from 1: 0 is the frame at rest.
    pub frame: usize,
    /// Centre of the ball, sensor frame, mm.
    pub center_mm: [f64; 3],
    /// Standard deviation on each of two axes across the dome's normal there, and along it, mm.
    pub center_sd_mm: [f64; 3],
    /// Angle of the press from the pole, about the dome's centre, and about the axis, degrees.
    pub place_deg: [f64; 2],
    /// Cells of its cap that were fitted.
    pub cells: usize,
    /// Root mean square of what is left of their levels, of 255.
    pub rms_levels: f64,
    /// Exposure of each channel against the frame at rest, from the untouched part.
    pub gain: [f64; 3],
}

/// A fitted light.
#[derive(Debug, Clone)]
pub struct LightFit {
    /// The constants with the measured light in place of the nominal one.
    pub constants: Constants,
    /// Every fitted number of the light.
    pub parameters: Vec<LightParameter>,
    /// Pairs of these of which only a combination is seen: correlated by more than 0.95.
    pub pairs: Vec<LightPair>,
    /// The presses.
    pub presses: Vec<BallPress>,
    /// Root mean square of the levels' residuals in the caps before and after, of 255.
    pub rms_levels: [f64; 2],
    /// The same of the places of the frame at rest.
    pub rest_rms_levels: [f64; 2],
    /// Radius that the presses themselves say, mm: within some hundredths of it, for a slope of the skin that is off by a third of a degree
    /// changes it by as much.
    pub radius_mm: f64,
    /// Steps taken.
    pub iterations: u32,
}

/// Why no light can be fitted: what is wrong, with which frame, and what cures it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LightFitError {
    /// Number of the frame at fault: 0 is the one at rest.
    pub frame: Option<usize>,
    /// What is wrong.
    pub problem: String,
    /// What to do.
    pub cure: String,
}

impl LightFitError {
    pub(super) fn new(problem: impl Into<String>, cure: impl Into<String>) -> Self {
        Self { frame: None, problem: problem.into(), cure: cure.into() }
    }

    pub(super) fn in_frame(frame: usize, problem: impl Into<String>, cure: impl Into<String>) -> Self {
        Self { frame: Some(frame), ..Self::new(problem, cure) }
    }

    pub(super) fn of_shape(frame: Option<usize>, error: &ShapeError) -> Self {
        Self { frame, problem: format!("{} {}", error.field, error.problem), cure: error.cure.into() }
    }
}

impl std::fmt::Display for LightFitError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(frame) = self.frame {
            write!(f, "frame {frame}: ")?;
        }
        write!(f, "{}; {}", self.problem, self.cure)
    }
}

impl std::error::Error for LightFitError {}

/// Where a direction from the dome's centre stands: from the pole, and about the axis, degrees.
pub(super) fn place_deg(direction: DVec3) -> [f64; 2] {
    let polar = direction.truncate().length().atan2(direction.z);
    [polar.to_degrees(), direction.y.atan2(direction.x).to_degrees().rem_euclid(360.0)]
}
