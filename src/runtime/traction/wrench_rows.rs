//! What the springs say, and as rows of the least squares.

use domecast_springs::Wrench;
use glam::DVec3;

/// The rows of a wrench.
#[derive(Debug, Clone, Copy)]
pub(super) struct WrenchRows {
    /// What moments are about, in the platform's frame.
    pub about_mm: DVec3,
    /// Force and moment, and one over the deviation of each.
    pub six: [f64; 6],
    pub per_sd: [f64; 6],
}

/// What the springs say of a frame's load, and its deviations.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpringLoad {
    pub wrench: Wrench,
    pub sd: Wrench,
}
