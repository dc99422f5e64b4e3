//! Fitting a measured map to a printed test target.
//!
//! Where a mark stands on the plate is known, where it landed on the dome was measured. The model is a nominal
//! map with a [`Correction`](super::Correction); it is linear in all but the rotation, so that Gauss and Newton's iteration
//! converges in a few steps. Residuals are taken where the measurement was made, on the dome or in the view
//! from outside: there its errors are even, on the plate they are not. What is reported of them is in mm along
//! the dome, whichever the measurement was: a view from outside shortens what scatters towards the rim.
//!
//! Outliers are found first, see `outliers`. The number of terms and the nominal map are then chosen by the Bayesian
//! information criterion (G. Schwarz, Annals of Statistics 6(2), 1978).
//!
//! # Example
//! ```
//! use domecast_design::glam::DVec2;
//! use domecast_design::transfer::fit::{MeasuredIn, Sample, fit};
//! use domecast_design::transfer::{Nominal, TransferMap};
//!
//! // marks on three rings, printed by a pad that keeps arc length
//! let pad = TransferMap::new(10.0, Nominal::Equidistant, None)?;
//! let mut samples = Vec::new();
//! for mark in 0..36 {
//!     let radius_mm = 3.0 * f64::from(mark / 12 + 1);
//!     let plate_mm = DVec2::from_angle(std::f64::consts::TAU * f64::from(mark) / 12.0) * radius_mm;
//!     samples.push(Sample { plate_mm, landed: pad.dome_from_plate(plate_mm)?, mark, print: 0 });
//! }
//! let found = fit(10.0, &samples, MeasuredIn::Dome, 1.0)?;
//! assert!(found.residual_rms_mm < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod outliers;
mod report;
mod sample;
mod search;
mod solve;
#[cfg(test)]
mod tests;

pub use error::FitError;
pub use report::TransferFit;
pub use sample::{MeasuredIn, Sample};
pub use search::{MIN_SAMPLES, fit};
