//! Objects: their exact distances, where they lie on the dome, and what of them touches it.

mod deepest;
mod distance;
mod feature;
mod mesh_distance;
mod placed;
mod solid;

pub(crate) use deepest::{FIRST_LOOK, deepest, deepest_from, first_looks, look_spacing_mm};
pub use distance::Distance;
pub(crate) use feature::{Feature, feature_at};
pub(crate) use placed::Placed;
pub use solid::ContactSolid;
