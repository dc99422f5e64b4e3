//! Pixel to dome and dome to pixel, through flat layers and a solid dome.
//!
//! The camera stands in air under a flat sheet of any number of layers; the
//! sheet's top face (`z = 0`) carries a solid dome ([`DomeShape`]). Everything is in the
//! *sensor* frame: origin at the centre of the dome's base, +z out through the
//! pole, millimetres.
//!
//! * [`SensorOptics::trace`]: a pixel's chief ray, by Snell's law in closed
//!   form (index times sine is the same in all layers), to the
//!   dome.
//! * [`SensorOptics::project`]: a point on the dome, inside it, or on the
//!   sheet's top, to its pixel. The unknown is the tangent of the ray in the
//!   layer of lowest index; the sideways reach is a rising, concave function of
//!   it, so Newton's method from below converges to the one solution without ever
//!   passing it.
//!
//! A point is seen only if its chief ray lies in the domain of the lens. Every
//! way in which there is no answer has its name ([`RayLimit`]).

mod dome;
mod jacobian;
mod limit;
mod project;
mod sensor;
mod spec;
mod stack;
mod trace;
mod tube;

pub use dome::DomeShape;
pub use jacobian::PixelMotion;
pub use limit::RayLimit;
pub use project::SolvedPixel;
pub use sensor::SensorOptics;
pub use spec::{ColorChannel, FlatLayer, OpticsError, OpticsSpec};
pub use trace::SurfacePoint;
pub use tube::LightTube;

#[cfg(test)]
mod tests;
