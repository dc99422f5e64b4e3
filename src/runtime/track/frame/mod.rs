//! Stage 1: what the camera gives, as it is.
//!
//! In: bytes of a frame. Out: [`Plane`], one channel of it, and [`Exposure`], what its levels say before any mark is
//! looked for.

mod camera_frame;
mod exposure;
mod mask;
mod plane;
mod undistortion;

pub use camera_frame::{CameraFrame, FrameFault, MAX_PIXELS};
pub(crate) use exposure::{Exposure, ExposureMeter, sharpness};
pub(crate) use mask::Mask;
pub(crate) use plane::Plane;
pub use undistortion::Undistorted;
