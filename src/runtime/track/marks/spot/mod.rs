//! Dark spots: centroids from the grey pixels around where they are expected.

mod ground;
mod light_edge;
mod meter;
mod shape;
mod stencil;
mod two_sided;
mod window;

pub use meter::{DarkSpot, SpotFault, SpotMeter, SpotOutline};
pub use shape::SpotShape;
pub use stencil::MAX_RADIUS_PX;
