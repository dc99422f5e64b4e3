//! The platform's pose from its white markers, through lens and layers.
//!
//! [`Marker`] says where a disc's centroid appears; [`PoseSolver`] inverts that, with covariance, both poses where
//! two fit, and a named [`PoseError`] where none does. Where the pixels come from is not known here.

mod disc;
mod error;
mod estimate;
mod refine;
mod sheet;
mod solver;
mod start;

pub use disc::{DiscImage, Marker, outline_centroid_offset};
pub use error::PoseError;
pub use estimate::{PoseEstimate, PoseOptions, Sighting, displacement_from_motion};
pub use solver::{MAX_MARKERS, PoseSolver};

#[cfg(test)]
mod tests;
