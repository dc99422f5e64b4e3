//! What happens: from a scene file to a resolved, validated [`Scene`].

pub mod electronics;
pub mod file;
pub mod light;
mod model;
mod motion;
pub mod object;
pub mod objects;
mod resolve;

pub use file::SceneFile;
pub use model::{RIM_POINTS, Scene, SceneDot};
pub use motion::{Held, Motion, State};
