//! What the built sensor is, from what its camera sees: pupil, camera rotation, sheet, indices, markers and dots.
//!
//! Least squares over all frames at once: every number starts at its nominal value with the design's tolerance as
//! its prior, the first frames are at rest, which is what rest means, and every other has a pose of its own. One
//! frame at rest leaves its own noise in all that is measured from rest; ten leave a third of it.
//! The camera's intrinsics are fitted where their covariance is known. What cannot be this sensor is refused, with the
//! mistake that it looks like.
//!
//! Poses are eliminated frame by frame (Schur's complement), so a frame costs little.

mod fit;
mod intrinsics;
mod mistakes;
mod normal;
mod plausibility;
mod problem;
mod types;

pub use fit::fit;
pub use types::{Kind, Observation, OpticsFit, OpticsFitError, Parameter};
