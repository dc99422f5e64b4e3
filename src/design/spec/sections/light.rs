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

/// The camera's exposure under the design's lights, and what else of light and noise a frame has. The build checks the
/// lit sensor with it; a scene has its own.
///
/// Where `level_per_mw_mm2` is left out the exposure is set as a camera's own control does: the brightest colour of the
/// dome comes to `brightest_level`, as far as `max_level_per_mw_mm2` allows. That bound follows from the camera: with the
/// lens at F/N, pixels of side p, full well W, quantum efficiency q, photons of energy e and exposure t, a white surface
/// under 1 mW/mm^2 gets the level `q t p^2 / (4 N^2 e W)`; F/2.8, 3 um, 5,000 electrons, 0.5, 550 nm and the 33 ms of
/// 30 Hz give some 2,600, and a gain of 1.5 the default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ExposureSection {
    /// Exposure and gain as one fixed number: level of a white surface in air for each mW/mm^2 of light on it; left out:
    /// set by the brightest colour.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e9))]
    pub level_per_mw_mm2: Option<f64>,
    /// Level that the brightest colour of the dome is exposed to, part of full scale.
    #[schemars(range(min = 0.05, max = 1.0))]
    pub brightest_level: f64,
    /// Largest exposure and gain that the camera has.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e9))]
    pub max_level_per_mw_mm2: f64,
    /// Level of what lies beside the dome, part of full scale: platforms painted black inside.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub surround_level: f64,
    /// Level that light from outside adds, part of full scale.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub stray_level: f64,
    /// What a channel takes of the neighbouring colour, of what it takes of its own.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub crosstalk: f64,
    /// Standard deviation of a pixel's grey value, levels of 255: shot and read noise and rounding.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub pixel_noise_levels: f64,
    /// Reasons and sources, by field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<super::Why>,
}

impl Default for ExposureSection {
    fn default() -> Self {
        Self {
            level_per_mw_mm2: None,
            brightest_level: 0.8,
            max_level_per_mw_mm2: 4000.0,
            surround_level: 0.02,
            stray_level: 0.005,
            crosstalk: 0.08,
            pixel_noise_levels: 1.5,
            why: None,
        }
    }
}
