//! From pixels to points of the dome and back: lens models, flat refracting layers, the dome, and the platform's pose
//! from its white markers.
//!
//! The sensor's optics stand at the top; [`camera`] has the lenses, [`pose`] the pose, [`numeric`] what they share.

pub mod camera;
pub mod numeric;
pub mod pose;
mod refraction;

pub use refraction::*;
