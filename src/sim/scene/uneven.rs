//! How evenly membrane and ink came out, as it is written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use domecast_design::sections::Why;

/// A membrane whose reflectance varies from place to place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UnevenMembraneSection {
    /// Standard deviation of the reflectance, part of its mean; no place is off by more than three of them.
    #[schemars(range(min = 0.0, max = 0.3))]
    pub amplitude: f64,
    /// Distance over which it is alike, mm: at this distance the correlation is `exp(-1/2)`.
    #[schemars(range(min = 0.2, max = 1000.0))]
    pub correlation_mm: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// Dots that are not all alike.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UnevenInkSection {
    /// Standard deviation of the ink's reflectance from dot to dot; no dot is off by more than three of them, nor
    /// below 0 or above 1.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 0.3))]
    pub reflectance: f64,
    /// Distance over which that is alike, mm: at this distance the correlation is `exp(-1/2)`.
    #[serde(default = "near")]
    #[schemars(range(min = 0.2, max = 1000.0))]
    pub correlation_mm: f64,
    /// Standard deviation of a dot's diameter, part of it, each dot for itself; none is off by more than three of them.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 0.1))]
    pub diameter: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

fn near() -> f64 {
    3.0
}
