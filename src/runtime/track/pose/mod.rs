//! Stage 4: the platform's pose from the white markers.
//!
//! In: [`MarkerIdentities`](super::identities::MarkerIdentities). Out: [`PoseEstimate`]. Candidates that could be a
//! marker each are assigned here, by the pose that explains them best.

mod anywhere;
mod finder;
mod refine;
mod residual_scale;
mod with_dots;

pub(super) use finder::{PoseEstimate, PoseFinder};
#[cfg(test)]
pub(super) use refine::tests::pinhole_sensor;
pub(super) use refine::{MarkerSighting, refine};
