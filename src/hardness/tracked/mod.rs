//! Hardness from what is tracked, frame by frame of a run.

mod contact;
mod model;
mod rest;

pub use contact::ContactHardness;
pub use model::HardnessModel;
pub use rest::TrackedRest;
