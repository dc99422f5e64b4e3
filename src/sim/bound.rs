//! How large an effect can be.

use serde::Serialize;

/// How large an effect can be in a scene: what its absence can do to a frame in which the scene's other effects take part. It
/// may be too large, never too small. What several geometric effects or effects of the light do together is bounded by itself.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Bound {
    /// Shift of any dot's or marker's centroid in any colour, px.
    pub px: f64,
    /// Change of any pixel, grey levels of 8 bits; for what is random, of the 99.9th percentile. What a shift of
    /// `px` does to the pixels at an edge is not counted here: the plan adds it.
    pub grey: f64,
}

impl Bound {
    /// An effect that no tolerance of a scene leaves out.
    pub const UNBOUNDED: Self = Self { px: f64::INFINITY, grey: f64::INFINITY };

    /// A bound on the place alone.
    pub fn px(px: f64) -> Self {
        Self { px, grey: 0.0 }
    }

    /// A bound on the brightness alone.
    pub fn grey(grey: f64) -> Self {
        Self { px: 0.0, grey }
    }
}
