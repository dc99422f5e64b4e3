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

mod error;
mod outliers;
mod report;
mod sample;
mod search;
mod solve;
#[cfg(test)]
mod tests;

pub use error::FitError;
pub use report::Fit;
pub use sample::{MeasuredIn, Sample};
pub use search::{MIN_SAMPLES, fit};
