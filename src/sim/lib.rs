//! What the sensor will see: only the effects that a scene calls for.
//!
//! A [`Scene`] says what happens; [`Plan::of`] asks each [`Effect`] whether the scene calls for it, how large it
//! can be and what it costs, and leaves out what is smaller than the scene's tolerance; the used effects put their
//! parts into a [`Pipeline`], and a renderer draws frames and writes the exact truth about them.
//!
//! Each stage is a folder and knows those before it only:
//!
//! ```text
//! scene ─> contact ─> light ─> raster ─> electronics ─> output
//!          effects (declare, bound and switch) ─> plan ─^
//! ```

mod bound;
mod contact;
mod effect_name;
mod effects;
pub mod electronics;
mod error;
pub mod light;
pub mod output;
mod plan;
mod probe;
pub mod raster;
pub mod scene;
mod work;

pub use bound::Bound;
pub use contact::between::Around;
pub use contact::elastomer::elastomer_of;
pub use contact::record::{ContactErrorTruth, ContactTruth, ObjectTruth};
pub use contact::stepper::{Stepper, Touch};
pub use effect_name::{EffectChoice, EffectChoices, EffectName};
pub use effects::effect::{Cost, Effect};
pub use effects::pipeline::{self, Pipeline};
pub use error::SimError;
pub use light::shading::{Shading, SurfaceSample};
pub use output as run;
pub use output::drawn::{Drawn, Scratch};
pub use output::render::Renderer;
pub use output::truth::{DotTruth, EffectTruth, ExposureTruth, FrameTruth, MarkerTruth};
pub use plan::{Entry, Plan};
pub use probe::probe;
pub use raster::edges;
pub use raster::frame::{Frame, Image8};
pub use raster::sensor_state::SensorState;
pub use scene::Scene;
pub use work::{FollowedRays, Work};

#[cfg(test)]
mod tests;
