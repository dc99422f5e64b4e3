//! The light of a built sensor, from a frame at rest and presses of a ball of known radius.
//!
//! Where others learn a table from a hundred presses (gelsight, Taxim), the physics that frames are drawn with stands here, and only
//! what is unknown of it is fitted: flux, place and axis of each light, the lobe of its tape, the membrane's reflectance, crosstalk,
//! stray light, exposure, the lens's falloff. Where a ball of radius R lies on the skin, the skin is a sphere: the normal of a
//! place there is `(c - p) / R` once the ball's centre c is known, and that has three numbers to a frame.
//!
//! ```text
//! frame at rest ─> places over the dome ─> a first light (exposure, fluxes, tape)
//!     ─> presses read with it (crate::shape) ─> each ball's first centre, the cells surely under it (frames)
//!     ─> all together: levels at rest, and levels under the ball over those of the same place at rest (equations, solve)
//! ```
//!
//! Levels come from the very tables that frames are drawn and read with (`physics`), for each channel along its own ray: dispersion
//! parts the channels by some hundredths of a millimetre, a level or two where the light falls off. What lies under a ball is compared
//! with the same place of the frame at rest, so that paint and vignetting take no part in it. The numbers start at their nominal
//! values, and [`LightTolerances`](crate::constants::LightTolerances) are their priors: a number of which the frames say nothing keeps
//! its tolerance, and [`LightParameter::observed`] says so. Errors of the model that neighbouring places share are part of the
//! covariance (`scatter`).

mod checks;
mod equations;
mod fit;
mod frames;
mod measured;
mod model;
mod observed;
mod physics;
mod scatter;
mod solve;
mod types;
mod verdict;

pub use fit::{examine_press, fit, next_press};
pub use types::{BallPress, LightFit, LightFitError, LightFitOptions, LightPair, LightParameter};

#[cfg(test)]
mod tests;
