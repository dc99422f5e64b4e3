//! What the sensor will see: only the effects that a scene calls for.
//!
//! A [`Scene`] says what happens; [`Plan::of`] asks each [`Effect`] whether the scene calls for it, how large it
//! can be and what it costs, and leaves out what the scene's tolerance can spare; the used effects put their
//! parts into a [`Pipeline`], and a renderer draws frames and tells the exact truth about them.

mod coverage;
mod dent;
pub mod edges;
mod effect;
mod effects;
mod elastomer;
mod error;
mod eye;
mod field;
mod fill;
mod frame;
mod geometry_bound;
mod instant;
pub mod light;
mod lit;
mod outline;
pub mod output;
mod picture;
pub mod pipeline;
mod plan;
mod render;
mod rests;
mod rolled;
pub mod scene;
mod shading;
mod shapes;
mod splines;
mod spots;
mod touch;
mod truth;
mod work;

pub use effect::{Bound, Cost, Effect, EffectChoice, EffectChoices, EffectName};
pub use elastomer::elastomer_of;
pub use error::SimError;
pub use frame::{Frame, Image8};
pub use instant::Instant;
pub use output as run;
pub use pipeline::Pipeline;
pub use plan::{Entry, Plan};
pub use render::{Around, Drawn, Renderer, Scratch};
pub use scene::Scene;
pub use shading::{Shading, SurfaceSample};
pub use touch::{Stepper, Touch};
pub use truth::{ContactTruth, DotTruth, EffectTruth, FrameTruth, MarkerTruth};
pub use work::Work;

#[cfg(test)]
mod honesty;
#[cfg(test)]
mod lit_tests;
#[cfg(test)]
mod rolled_tests;
#[cfg(test)]
mod tests;
