//! The layers between camera and membrane, and the dome.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Why;

/// The flat layers from the camera outwards, air not named: the gap is what the camera's position leaves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpticsSection {
    /// The layers, the nearest to the camera first; the last fills the dome and has no thickness.
    #[schemars(length(min = 1, max = 16))]
    pub layers: Vec<LayerSection>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// One flat layer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayerSection {
    /// What it is made of, in a word.
    pub name: String,
    /// Refractive index: one number, or one for each channel.
    pub index: IndexValue,
    /// Thickness, mm; zero is allowed; left out for the last layer, which fills the dome.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub thickness_mm: Option<f64>,
    /// Key of a part whose numbers stand for the fields that are left out here: `domecast list sheets` or `silicones`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// A refractive index relative to air.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum IndexValue {
    /// The same for every channel.
    One(#[schemars(range(min = 1.0, max = 4.0))] f64),
    /// One for each channel of the camera.
    PerChannel(IndexRgb),
}

/// A refractive index for each channel of the camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IndexRgb {
    /// At the red channel's mean wavelength.
    #[schemars(range(min = 1.0, max = 4.0))]
    pub r: f64,
    /// At the green channel's mean wavelength: the reference.
    #[schemars(range(min = 1.0, max = 4.0))]
    pub g: f64,
    /// At the blue channel's mean wavelength.
    #[schemars(range(min = 1.0, max = 4.0))]
    pub b: f64,
}

impl IndexValue {
    /// Red, green, blue.
    pub fn rgb(self) -> [f64; 3] {
        match self {
            Self::One(index) => [index; 3],
            Self::PerChannel(IndexRgb { r, g, b }) => [r, g, b],
        }
    }
}

/// The dome.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DomeSection {
    /// Radius of the clear elastomer's hemisphere, mm: the surface that carries the dots.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 10000.0))]
    pub radius_mm: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}
