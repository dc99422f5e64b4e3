//! Lens models: the direction of a ray in air to a pixel, and back.
//!
//! One type, [`Lens`], serves three forms ([`LensModel`]): a pinhole, Brown-Conrady
//! with 5, 8, 12 or 14 coefficients, and Kannala-Brandt with 4. All share one
//! interface, one set of limits ([`LensLimit`]) and one conformance suite.
//!
//! # Example
//! ```
//! use domecast_optics::camera::{Lens, LensSpec, LensModel};
//! use domecast_optics::glam::DVec2;
//!
//! let lens = Lens::new(LensSpec {
//!     model: LensModel::KannalaBrandt,
//!     width: 640,
//!     height: 480,
//!     matrix: [[230.0, 0.0, 319.5], [0.0, 230.0, 239.5], [0.0, 0.0, 1.0]],
//!     distortion: vec![-0.01, 0.002, 0.0, 0.0],
//!     field_of_view_rad: 3.0,
//!     pupil_shift_mm: vec![],
//! })?;
//! let pixel = DVec2::new(100.0, 50.0);
//! let ray = lens.unproject(pixel)?;
//! assert!((lens.project(ray)? - pixel).length() < 1e-10);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Domain
//! A distortion polynomial is a lens only up to its *fold*, the first place
//! where the image radius stops growing; past it two rays share a pixel and
//! nothing that looks at pixels alone can notice. [`Lens::new`] finds the fold
//! once, from the real roots of the derivative, and everything past it, or
//! past the stated field of view, is answered with a named limit.
//!
//! # Frames and units
//! Camera frame: x right, y down, z forward. Pixels: the centre of the
//! top-left pixel is (0, 0). The *field angle* of a ray is its angle to +z, in
//! air.
//!
//! # The entrance pupil
//! The rays that a wide lens accepts do not all cross one point. The pupil
//! lies on the axis at `s(theta) = c1 theta^2 + c2 theta^4 + ...` millimetres
//! in front of the camera's origin ([`LensSpec::pupil_shift_mm`]): even powers
//! only, since the lens is symmetric about its axis, and zero on the axis, where the
//! origin is put. See [`Lens::pupil_shift_mm`].
//!
#![doc = include_str!("lenses.md")]

mod brown_conrady;
mod brown_formula;
mod inverse;
mod kannala_brandt;
mod lanes;
mod lens;
mod limit;
mod perspective;
mod pinhole;
mod pupil;
mod spec;
mod thin_prism;
mod tilt;

pub use lens::{Lens, SolvedRay};
pub use limit::LensLimit;
pub use spec::{LensError, LensModel, LensSpec};

#[cfg(test)]
mod conformance;
#[cfg(test)]
mod tests;
