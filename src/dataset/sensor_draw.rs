//! What a sensor has of its own that no design file holds.

use domecast_sim::scene::slow_gel::SlowGelTerm;

/// What is drawn for a sensor and is no field of its design.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorDraw {
    /// Its number.
    pub sensor: u32,
    /// Brightness of each light.
    pub each: Vec<f64>,
    /// Distance at which the lens is sharp, mm.
    pub focus_mm: f64,
    /// What a channel takes of the neighbouring colour.
    pub crosstalk: f64,
    /// How the springs' calibration is off, a factor of the wrench.
    pub spring_gain: f64,
    /// Terms of a gel that yields slowly; none of an elastic one.
    pub gel: Vec<SlowGelTerm>,
}
