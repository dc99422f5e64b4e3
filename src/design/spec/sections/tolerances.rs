//! How far the built sensor may be off its nominal values.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Why;

/// How far a built sensor may be off its nominal values, each as one standard deviation: the spread of the Monte Carlo and the priors of the calibrations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TolerancesSection {
    /// Entrance pupil along x, y, z, mm.
    pub pupil_mm: [f64; 3],
    /// Camera about each of its axes, degrees.
    pub camera_rotation_deg: [f64; 3],
    /// Dome radius, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub dome_radius_mm: f64,
    /// Thickness of each flat layer, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub layer_thickness_mm: f64,
    /// Refractive index of each layer but air, the same in all channels.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub index: f64,
    /// A white marker along each axis of the sheet, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub white_marker_mm: f64,
    /// A black dot along the dome, in each direction, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub black_dot_mm: f64,
    /// A print as a whole on each axis, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub print_registration_mm: f64,
    /// A print as a whole about the pole, degrees.
    #[schemars(range(min = 0.0, max = 180.0))]
    pub print_rotation_deg: f64,
    /// A single dot on the plate, on each axis, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub print_scatter_mm: f64,
    /// The springs' wire, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub wire_diameter_mm: f64,
    /// The springs' outer diameter, mm.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub spring_diameter_mm: f64,
    /// The springs' active coils.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub active_coils: f64,
    /// The moduli of the springs' wire, percent of them.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub modulus_percent: f64,
    /// How far the camera moves in its mount after a calibration, on each axis, mm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub camera_drift_mm: f64,
    /// How far it turns after a calibration, about each axis, degrees.
    #[schemars(range(min = 0.0, max = 180.0))]
    pub camera_drift_deg: f64,
    /// Sensors drawn in a Monte Carlo; chosen from `accuracy` where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 100000))]
    pub samples: Option<u32>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

impl TolerancesSection {
    /// Sensors drawn in a Monte Carlo. A resolved design states it; before that a usual number.
    pub fn sensors(&self) -> u32 {
        self.samples.unwrap_or(256)
    }
}
