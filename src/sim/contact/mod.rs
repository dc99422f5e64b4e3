//! The dome under an object: displacement and equilibrium, frame by frame.

pub(crate) mod between;
pub(crate) mod displacement_map;
pub(crate) mod elastomer;
pub(crate) mod level;
pub(crate) mod record;
#[cfg(test)]
mod several_tests;
pub(crate) mod shape;
pub(crate) mod stepper;
