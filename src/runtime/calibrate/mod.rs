//! From what a built sensor measures to measured constants.
//!
//! [`detect`] finds the marks in frames, [`force`] fits the wrench to displacements, [`optics`] fits what the camera sees to the geometry, [`light`] the
//! lights to presses of a ball; all start from the nominal constants and say of each number whether the data determined it.
//!
//! Measurements come as tables; an empty cell is a reading that is missing.
//!
//! ```
//! use domecast_runtime::calibrate::Table;
//!
//! let table = Table::parse("tx,Fx\n0.1,0.6\n0.2,\n")?;
//! assert_eq!(table.number(0, 1)?, Some(0.6));
//! assert_eq!(table.number(1, 1)?, None);
//! # Ok::<(), domecast_runtime::calibrate::TableError>(())
//! ```

pub mod detect;
pub mod force;
pub mod light;
pub mod optics;
mod table;

pub use table::{Table, TableError};

#[cfg(test)]
mod tests;
