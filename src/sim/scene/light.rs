//! How bright things are, as it is written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::design::sections::Why;

/// Brightness. Levels are parts of the image's full scale, linear in light.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LightSection {
    /// Level of an evenly lit membrane; used where `leds` is left out.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub membrane_level: f64,
    /// Level of the white markers.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub marker_level: f64,
    /// Level of what lies beside the dome: sheet and platform.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub surround_level: f64,
    /// The design's lights; left out: the membrane is lit evenly.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leds: Option<LedLight>,
}

impl Default for LightSection {
    fn default() -> Self {
        Self { membrane_level: 0.6, marker_level: 0.95, surround_level: 0.15, leds: None }
    }
}

/// The design's lights at work.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LedLight {
    /// Brightness of all lights: 1 lets the brightest point of the undeformed membrane reach `membrane_level`.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub power: f64,
    /// Exponent m of the bare light's lobe cos^m.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub lobe_exponent: f64,
    /// Part of the diffuser's light that leaves by Lambert's law, 0 to 1; the rest keeps a Gaussian lobe.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub diffuser_lambert: f64,
    /// Standard deviation of the Gaussian lobe, degrees; 0 for no diffuser.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 90.0))]
    pub diffuser_sigma_deg: f64,
    /// Reflectance of the membrane, for light that is thrown from one part of the dome to another; 0 for none.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 0.999))]
    pub membrane_reflectance: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}
