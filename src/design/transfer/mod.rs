//! Maps between the dome and the flat plate of a pad print.
//!
//! A pad picks the picture up from the plate and lays it on the dome. Seen from above, the plate reads like
//! the dome seen from outside; a map here says where on the dome each point of the plate lands. Three
//! nominal maps are known in closed form, see [`Nominal`]; a measured one is a nominal map with a fitted
//! [`Correction`].
//!
//! Plate coordinates are mm in the *plate* frame: origin under the pole, seen from above, x as the sensor's
//! x, y up as the sensor's y. Points of the dome are mm in the frame of the print pass: the sensor frame for a pass
//! from straight above, a tilted one for others; +z is the pad's stroke, reversed.
//!
//! # Example
//! ```
//! use domecast_design::glam::DVec2;
//! use domecast_design::transfer::{Nominal, TransferMap};
//!
//! let map = TransferMap::new(10.0, Nominal::Orthographic, None)?;
//! let plate_mm = DVec2::new(3.0, 4.0);
//! let dome_mm = map.dome_from_plate(plate_mm)?;
//! assert!((map.plate_from_dome(dome_mm)? - plate_mm).length() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod correction;
pub mod fit;
mod limit;
mod map;
pub mod measured_csv;
mod nominal;
mod polar;
#[cfg(test)]
mod tests;

pub use correction::Correction;
pub use limit::{TransferError, TransferLimit};
pub use map::{PlatePoint, TransferMap};
pub use nominal::Nominal;
pub(crate) use polar::{Polar, UnitPlate};
