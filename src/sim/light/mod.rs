//! Light on the membrane, from the design's lights.
//!
//! ```text
//! design, scene (setup), what the platform leaves open (hollows) ─> the crate `light`: irradiance of the membrane
//!     ─> levels in the picture (shade)
//! ```

mod bound_samples;
pub mod bounds;
pub(crate) mod coarse_ground;
pub(crate) mod gloss;
pub mod hollows;
pub mod illumination;
pub mod parts;
pub mod random_field;
mod rest;
pub mod setup;
pub mod shade;
pub mod shading;
#[cfg(test)]
mod tests;
pub(crate) mod uneven;

pub use domecast_light::{Cavities, cavity, direct, dome_map, field, fresnel, lobe, quadrature, radiosity};
pub use domecast_light::{separation, shelf, tables};
pub use parts::{LightUse, is_lit_by_leds};
pub use rest::{DomeLight, RestLight};
pub use shade::{ShadedDome, shading_of};
