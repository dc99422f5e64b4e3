//! How bright things are, as it is written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use domecast_design::sections::Why;

/// Brightness. Levels are parts of the image's full scale, linear in light.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LightSection {
    /// Level of an evenly lit membrane; used where `leds` is left out.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub membrane_level: f64,
    /// Level of the white markers; used where `leds` is left out.
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
///
/// Their flux, lobes, diffuser and the reflectances of what they light are the design's (`leds`, `elastomer`,
/// `white_markers`); here stands how they are driven and how long the camera looks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LedLight {
    /// Brightness of all lights, of the design's `radiant_flux_mw`.
    #[serde(default = "one")]
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub power: f64,
    /// Brightness of each light beside `power`, in the design's order; left out: 1 for each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 24), inner(range(min = 0.0, max = 1000.0)))]
    pub each: Vec<f64>,
    /// How each light stands beside where the design has it, in the design's order, while the platform is as designed; left out:
    /// where it belongs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 24))]
    pub moved: Vec<MovedLed>,
    /// Exposure and gain in one number: level that the image of a white surface in air gets for each mW/mm^2 of
    /// light on it.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e9))]
    pub level_per_mw_mm2: f64,
    /// Level that light from outside, leaking through the membrane, gives it besides.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub stray_level: f64,
    /// Whether the camera sees the lights mirrored in the sheet's faces.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub gloss: bool,
    /// What a channel of the camera takes of the neighbouring colour of light (red of green, green of red and blue,
    /// blue of green), of what it takes of its own.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub crosstalk: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// How a built light stands beside where the design has it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MovedLed {
    /// Away from the axis, mm.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub out_mm: f64,
    /// Along its ring, counter-clockwise from above, mm.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub along_mm: f64,
    /// Up, mm.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub up_mm: f64,
    /// Its face turned about the direction along the ring, degrees.
    #[schemars(range(min = -20.0, max = 20.0))]
    pub tilt_deg: f64,
    /// Its face turned about the direction across that and across the way that it faces, degrees.
    #[schemars(range(min = -20.0, max = 20.0))]
    pub turn_deg: f64,
}

fn one() -> f64 {
    1.0
}
