//! What accuracy costs in time, measured for one design on one machine.
//!
//! For each solver with a setting a [`sweep::Sweep`] goes from crude to far finer than needed: the error of every sample
//! against a reference that is far better, and the median of its time. [`budget::ErrorBudget`]s say what the errors mean
//! for the position of a dot and for a force, beside what printing and building add. The settings that a build takes are
//! not chosen from these measurements but from bounds ([`domecast_design::settings`]); the sweeps show that the bounds
//! hold.

mod budget;
mod clock;
mod contact;
mod files;
mod frames;
mod lens;
mod light;
mod measure;
mod meshes;
mod monte_carlo;
mod outline;
mod page;
mod placement;
mod pose;
mod result;
mod shape;
mod supersampling;
mod sweep;
mod sweep_chart;
mod tenth;
#[cfg(test)]
mod tests;
mod tracking;

pub use files::accuracy_files;
pub use measure::{STEPS, measure};
pub use result::{Accuracy, AccuracyError};
