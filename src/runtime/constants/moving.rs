//! The weight of what the springs carry.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use domecast_springs::N_PER_G_MPS2;

/// What the springs carry: upper platform, sheet, dome and magnets. A sensor that is turned or accelerated feels it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct MovingMass {
    /// Its mass, g.
    pub mass_g: f64,
    /// Standard deviation of that, g.
    pub mass_sd_g: f64,
    /// Its centre at rest, in the sensor frame.
    pub center_of_mass_mm: [f64; 3],
}

impl MovingMass {
    /// Its weight under an acceleration, m/s^2, N.
    pub fn weight_n(&self, acceleration_mps2: DVec3) -> DVec3 {
        acceleration_mps2 * (self.mass_g * N_PER_G_MPS2)
    }
}
