//! What a question for a distance answers.

use glam::DVec3;

/// Distance to a solid's surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Signed distance, negative inside, mm.
    pub value_mm: f64,
    /// Its gradient, of length 1: outwards. On the medial axis, where there is none, one of its limits.
    pub outward: DVec3,
}
