//! From what a built sensor measures to measured constants.
//!
//! [`detect`] finds the marks in frames, [`force`] fits the wrench to displacements, [`optics`] fits what the camera sees to the geometry; both start from
//! the nominal constants and say of each number whether the data determined it.

pub mod detect;
pub mod force;
pub mod optics;
mod table;

pub use table::{Table, TableError};

#[cfg(test)]
mod tests;
