//! Stage 5: what the sensor feels.
//!
//! In: the pose with its covariance, and the dots at it. Out: [`WrenchEstimate`], what the world does to the platform,
//! and the displacement of each dot on the dome.

mod dot_displacement;
mod estimate;
mod springs;

pub(super) use dot_displacement::DotDisplacements;
pub(super) use estimate::WrenchEstimate;
pub use springs::Springs;
