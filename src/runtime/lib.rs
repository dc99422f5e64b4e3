//! The runtime of a sensor: it knows the constants and no design.

pub mod calibrate;
mod cholesky;
pub mod constants;
pub mod frames;
#[cfg(feature = "overlay")]
pub mod overlay;
pub mod shape;
pub mod track;
#[cfg(feature = "traction")]
pub mod traction;
