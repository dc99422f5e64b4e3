//! The layers between camera and membrane, and the dome.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Why;
use domecast_optics::DomeShape;

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
    /// Radius of the clear elastomer's sphere, mm: the surface that carries the dots.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 10000.0))]
    pub radius_mm: f64,
    /// Polar angle of the dome's rim seen from the sphere's centre, degrees: less than 90 makes a cap, which meets the
    /// sheet in a circle of radius_mm times its sine. Left out: 90, a hemisphere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 5.0, max = 90.0))]
    pub rim_angle_deg: Option<f64>,
    /// Height of the cylinder of the same radius that the hemisphere stands on, mm; only with a rim angle of 90 degrees.
    /// Dots lie on the sphere only, which is what a pad reaches. Left out: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 10000.0))]
    pub cylinder_height_mm: Option<f64>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

impl DomeSection {
    /// The dome's outer face without the membrane.
    pub fn shape(&self) -> DomeShape {
        match (self.cylinder_height_mm, self.rim_angle_deg) {
            (Some(height_mm), _) if height_mm > 0.0 => DomeShape::on_cylinder(self.radius_mm, height_mm),
            (_, Some(rim_deg)) if rim_deg < 90.0 => DomeShape::cap(self.radius_mm, rim_deg.to_radians()),
            _ => DomeShape::hemisphere(self.radius_mm),
        }
    }
}
