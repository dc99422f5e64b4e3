//! The weight of what the springs carry.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use domecast_optics::numeric::Rigid;
use domecast_springs::Wrench;

/// N from g and m/s^2.
const N_PER_G_MPS2: f64 = 1e-3;

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
    /// Its weight under an acceleration (m/s^2, rest frame), about `at_mm`, where the platform is at `rest_from_platform`.
    pub fn weight(&self, acceleration_mps2: DVec3, rest_from_platform: &Rigid, at_mm: DVec3) -> Wrench {
        let force_n = acceleration_mps2 * (self.mass_g * N_PER_G_MPS2);
        let point_mm = rest_from_platform.point(DVec3::from_array(self.center_of_mass_mm));
        Wrench::of_load(force_n, DVec3::ZERO, point_mm, at_mm)
    }
}
