//! Light on the membrane, from the design's lights.
//!
//! ```text
//! emitter (lobe, diffuser) ─> pit and window (cavity) ─> sheet, silicone (optics::LightTube, fresnel)
//!     ─> vector irradiance on the membrane (direct) ─> tables over the dome (tables, field, dome_map)
//!     ─> the dome lighting itself (radiosity) ─> levels in the picture (shade)
//! ```

mod bound_samples;
pub mod bounds;
pub mod cavity;
pub mod direct;
pub mod dome_map;
pub mod field;
pub mod fresnel;
pub(crate) mod gloss;
pub mod illumination;
pub mod lobe;
pub mod parts;
pub mod quadrature;
pub mod radiosity;
pub mod random_field;
mod rest;
pub mod separation;
pub mod setup;
pub mod shade;
pub mod shading;
mod shelf;
pub mod tables;
#[cfg(test)]
mod tests;
pub(crate) mod uneven;

pub use cavity::Cavities;
pub use parts::{LightUse, is_lit_by_leds};
pub use rest::{DomeLight, RestLight};
pub use shade::{ShadedDome, shading_of};
