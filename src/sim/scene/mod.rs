//! What happens: from a scene file to a resolved, validated [`Scene`].

mod built;
pub mod camera;
mod check_camera;
pub mod dust;
pub mod electronics;
pub mod file;
pub mod light;
mod model;
mod motion;
pub mod object;
pub mod objects;
mod resolve;
pub mod slow_gel;
pub mod uneven;

pub use file::SceneFile;
pub use model::{RIM_POINTS, Scene, SceneDot};
pub use motion::{Held, Motion, State};
