//! Dust and scratches on sheet and lens, as they are written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use domecast_design::sections::Why;

/// What lies on the sheet's underside or before the lens and takes light on its way to the camera.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DustSection {
    /// Specks, in lots of one kind.
    #[schemars(length(max = 16))]
    pub specks: Vec<SpeckLot>,
    /// Scratches, in lots of one kind.
    #[schemars(length(max = 16))]
    pub scratches: Vec<ScratchLot>,
    /// Reasons and sources, by field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// The face that carries dust or scratches.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DustyFace {
    /// The sheet's underside, which moves with the platform.
    #[default]
    Sheet,
    /// A plane this far before the entrance pupil, mm: the lens's front, which moves with the camera.
    Lens(#[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1000.0))] f64),
}

/// Specks of one kind: some at places that are given, others at random ones.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpeckLot {
    /// The face that they lie on.
    #[serde(default)]
    pub on: DustyFace,
    /// Smallest and largest diameter of the disc of the same area, mm; even in its logarithm in between.
    #[schemars(inner(range(min = 1e-4, max = 100.0)))]
    pub diameter_mm: [f64; 2],
    /// Part of the light behind that a speck takes where it covers the whole way into the pupil, 0 to 1.
    #[serde(default = "whole")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub opacity: f64,
    /// Level that it shows instead, part of full scale: 0 is dark, lit fluff is bright.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub level: f64,
    /// Centres, mm: x and y of the sensor frame on the sheet, of the camera frame before the lens.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 1000))]
    pub at_mm: Vec<[f64; 2]>,
    /// Specks more, at places from the scene's seed, evenly over what the camera sees the dome's foot through.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1000))]
    pub random: u32,
}

/// Scratches of one kind, straight and of one width: some that are given, others at random places.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScratchLot {
    /// The face that they are in.
    #[serde(default)]
    pub on: DustyFace,
    /// Width, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub width_mm: f64,
    /// Part of the light behind that a scratch throws elsewhere, 0 to 1.
    #[serde(default = "whole")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub opacity: f64,
    /// Level that it shows instead, part of full scale.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub level: f64,
    /// Both ends of each, mm, in the frames of [`SpeckLot::at_mm`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 1000))]
    pub between_mm: Vec<[[f64; 2]; 2]>,
    /// Scratches more, at places and in directions from the scene's seed.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1000))]
    pub random: u32,
    /// Smallest and largest length of those, mm; even in its logarithm in between.
    #[serde(default = "millimetre")]
    #[schemars(inner(range(min = 1e-4, max = 100.0)))]
    pub length_mm: [f64; 2],
}

fn whole() -> f64 {
    1.0
}

fn millimetre() -> [f64; 2] {
    [1.0, 1.0]
}
