//! Light on the membrane, from emitters to irradiance: what the simulator draws with and the runtime reads shape with.
//!
//! ```text
//! emitter (lobe, diffuser) ─> hollows of the platform (cavity) ─> sheet, silicone (optics::LightTube, fresnel)
//!     ─> vector irradiance on the membrane (direct, visible) ─> tables over the dome (tables, field, dome_map)
//!     ─> the dome lighting itself (radiosity)
//! ```
//!
//! ```
//! use domecast_light::lobe::Lobe;
//!
//! // Lambert's law: a flux of one in all, and nothing backwards.
//! let lobe = Lobe::cosine_power(1.0);
//! assert!((lobe.integral() - 1.0).abs() < 1e-9 && lobe.per_sr(-0.1) == 0.0);
//! ```
//!
//! Nothing here knows a design or a scene: [`tables::Ways`] says what stands between lights and membrane, in numbers.

pub mod cavity;
pub mod direct;
pub mod dome_map;
pub mod field;
pub mod fresnel;
pub mod lobe;
pub mod quadrature;
pub mod radiosity;
pub mod separation;
pub mod shelf;
pub mod splines;
pub mod tables;
mod visible;

pub use cavity::Cavities;
