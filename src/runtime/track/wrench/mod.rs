//! Stage 5: what the sensor feels.
//!
//! In: the pose with its covariance, and the dots at it. Out: [`WrenchEstimate`], what the world does to the platform,
//! [`WrenchErrors`], how far that may be off, and the displacement of each dot on the dome.

mod dot_displacement;
mod estimate;
mod optics_errors;
mod spring_errors;
mod springs;

pub(super) use dot_displacement::{DotDisplacement, DotDisplacements};
pub(super) use estimate::{WrenchErrors, WrenchEstimate, WrenchEstimator};
pub use springs::Springs;
