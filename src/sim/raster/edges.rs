//! How the edges of dots are drawn: for those who measure it.

pub use crate::raster::coverage::Coverage;
pub use crate::raster::outline::RimFit;
pub use crate::scene::RIM_POINTS;

/// How far the drawn outlines of dots may be from the exact ones, grey levels at the edge.
pub const EDGE_GREY: f64 = 0.5;
