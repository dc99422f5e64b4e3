//! The runtime of a sensor: it knows the constants and no design.

pub mod calibrate;
pub mod constants;
pub mod frames;
pub mod shape;
pub mod track;
