//! From a picture in linear light to the camera's bytes: one file a pass.
//!
//! Which of them a scene calls for, how large they are and what they cost, the effects of the same names say.

pub(crate) mod bayer;
pub(crate) mod compression;
pub(crate) mod defects;
pub(crate) mod defocus;
pub mod deviation;
pub(crate) mod exposure;
pub(crate) mod noise;
pub mod pass;
pub(crate) mod sharpening;
pub(crate) mod vignetting;
