//! What the sensor will see: only the effects that a scene calls for.
//!
//! A [`Scene`] says what happens; [`Plan::of`] asks each [`Effect`] whether the scene calls for it, how large it
//! can be and what it costs, and leaves out what the scene's tolerance can spare; the used effects put their
//! parts into a [`Pipeline`], and a renderer draws frames and tells the exact truth about them.

mod effect;
mod effects;
mod error;
mod frame;
pub mod light;
pub mod pipeline;
mod plan;
pub mod scene;
mod shading;
mod work;

pub use effect::{Bound, Cost, Effect, EffectName};
pub use error::SimError;
pub use frame::{Frame, Image8};
pub use pipeline::Pipeline;
pub use plan::{Entry, Plan};
pub use scene::Scene;
pub use shading::{Shading, SurfaceSample};
pub use work::Work;
