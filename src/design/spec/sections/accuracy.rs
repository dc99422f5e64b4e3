//! How exact the results must be.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Why;

/// How exact the results must be: from these the tolerances of meshes and outlines and the number of drawn sensors are chosen, where the file does not give them itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AccuracySection {
    /// What computing may add to a dot's place on the dome, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 10.0))]
    pub dot_placement_mm: f64,
    /// What computing may add to a dot's place in the image, px; statistics over sensors are that certain too.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub image_px: f64,
    /// How far a mesh may be from the exact surface, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 10.0))]
    pub mesh_mm: f64,
    /// What a force must be known to, N, one standard deviation; where one frame's noise is above it, the build says how many frames have to be averaged.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1000.0))]
    pub force_n: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}
