//! White markers, the loads that the design claims, and what the image processing can measure.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Why;

/// White discs painted on the sheet's top face; their order is that of the constants.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WhiteMarkersSection {
    /// x, y of each disc's centre on the sheet's top face (z = 0), mm. Four or more, not on one line; none on a rigid
    /// mount.
    #[schemars(length(max = 64))]
    pub positions_mm: Vec<[f64; 2]>,
    /// Diameter of a disc, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub diameter_mm: f64,
    /// Share of the light that their paint gives back, by Lambert's law.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub reflectance: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// What stands for the section where a rigid mount leaves it out.
impl Default for WhiteMarkersSection {
    fn default() -> Self {
        Self { positions_mm: Vec::new(), diameter_mm: 1.0, reflectance: 0.0, why: None }
    }
}

impl WhiteMarkersSection {
    /// Whether the section is left out.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

/// The loads that the design claims to carry with every spring, stop and marker inside its limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadsSection {
    /// Each is checked by a build; none may be beyond a limit.
    #[schemars(length(max = 256))]
    pub claims: Vec<LoadClaim>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// One load that the world puts on the dome or platform, in the rest frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadClaim {
    /// A word for it.
    pub name: String,
    /// Force, N; a push on the pole has z < 0.
    pub force_n: [f64; 3],
    /// Moment besides that of the force, N*mm.
    #[serde(default)]
    pub moment_nmm: [f64; 3],
    /// Where the force acts, in the rest frame, mm.
    pub point_mm: [f64; 3],
}

/// Standard deviations of what the image processing measures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CentroidNoiseSection {
    /// Of a white marker's centroid in each image axis, px.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub white_centroid_px: f64,
    /// Of a black dot's centroid in each image axis, px.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub black_centroid_px: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}
