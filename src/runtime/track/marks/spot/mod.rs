//! Dark spots: centroids from the grey pixels around where they are expected.

mod ground;
mod meter;
mod stencil;

pub use meter::{DarkSpot, SpotFault, SpotMeter, SpotOutline};
pub use stencil::MAX_RADIUS_PX;
