//! How the edges of dots are drawn: for those who measure it.

pub use super::coverage::Coverage;
pub use super::outline::RimFit;
pub use super::scene::RIM_POINTS;

/// How far the drawn outlines of dots may be from the exact ones, grey levels at the edge.
pub const EDGE_GREY: f64 = 0.5;
