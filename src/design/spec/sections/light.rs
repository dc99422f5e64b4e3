//! What the lights send out and what surfaces give back.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A value for each colour of light: red, green, blue.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PowerRgb {
    /// Of red light.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub r: f64,
    /// Of green light.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub g: f64,
    /// Of blue light.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub b: f64,
}

impl PowerRgb {
    /// Red, green, blue.
    pub fn to_array(self) -> [f64; 3] {
        [self.r, self.g, self.b]
    }
}

/// Share of the light that a surface gives back in all directions alike, for each colour.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReflectanceRgb {
    /// Of red light.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub r: f64,
    /// Of green light.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub g: f64,
    /// Of blue light.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub b: f64,
}

impl ReflectanceRgb {
    /// Red, green, blue.
    pub fn to_array(self) -> [f64; 3] {
        [self.r, self.g, self.b]
    }
}

/// What the diffuser tape makes of a light: of what it lets through, a share leaves by Lambert's law whatever the
/// direction that it came from, and the rest in a Gaussian lobe about that direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiffuserSection {
    /// Share that leaves by Lambert's law.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub lambert_fraction: f64,
    /// Standard deviation of the Gaussian lobe, degrees.
    #[schemars(range(min = 3.0, max = 90.0))]
    pub lobe_width_deg: f64,
    /// Share of the light that is let through.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub transmittance: f64,
}
