//! What a camera's sensor and its processor do besides, as it is written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use domecast_design::sections::Why;

/// Pixels that do not see.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DefectsSection {
    /// Pixels whose dark current is large, by column and row.
    #[schemars(length(max = 10000))]
    pub hot: Vec<[u32; 2]>,
    /// Pixels that read nothing, by column and row.
    #[schemars(length(max = 10000))]
    pub dead: Vec<[u32; 2]>,
    /// Hot pixels more, of a million, at places from the scene's seed.
    #[schemars(range(min = 0.0, max = 100_000.0))]
    pub hot_per_million: f64,
    /// Dead pixels more, of a million, at places from the scene's seed.
    #[schemars(range(min = 0.0, max = 100_000.0))]
    pub dead_per_million: f64,
    /// What the dark current of a hot pixel adds, parts of full scale at a gain of 1: smallest and largest, even in
    /// its logarithm in between.
    #[schemars(inner(range(min = 1e-6, max = 1.0)))]
    pub hot_level: [f64; 2],
    /// Reasons and sources, by field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

impl Default for DefectsSection {
    fn default() -> Self {
        Self {
            hot: Vec::new(),
            dead: Vec::new(),
            hot_per_million: 0.0,
            dead_per_million: 0.0,
            hot_level: [0.05, 0.5],
            why: None,
        }
    }
}

/// Sharpening by the camera's processor: an unsharp mask on linear light, after the colours are made and before the code.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SharpeningSection {
    /// Standard deviation of the Gaussian that is taken off, px.
    #[schemars(range(min = 0.2, max = 20.0))]
    pub radius_px: f64,
    /// How much of the difference to it is added.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub amount: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// An exposure that the camera sets by itself: the gain follows the mean of the frames before.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AutoExposureSection {
    /// Mean level that the gain aims at, over the whole picture and all colours, part of full scale.
    #[schemars(range(min = 0.01, max = 0.9))]
    pub target_level: f64,
    /// Part of the way there, in the gain's logarithm, that one frame goes; 0 keeps the first gain.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub speed: f64,
    /// Gain of the first frame: 1 leaves the levels as the scene states them.
    #[serde(default = "one")]
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub first_gain: f64,
    /// Smallest and largest gain.
    #[serde(default = "gain_range")]
    #[schemars(inner(range(min = 0.001, max = 1000.0)))]
    pub gain: [f64; 2],
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// A white balance that the camera sets by itself: red and blue follow green until their means are alike.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WhiteBalanceSection {
    /// Part of the way there, in a gain's logarithm, that one frame goes; 0 keeps the first gains.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub speed: f64,
    /// Gains of red, green and blue in the first frame; that of green stays.
    #[serde(default = "ones")]
    #[schemars(inner(range(min = 0.01, max = 100.0)))]
    pub first: [f64; 3],
    /// Smallest and largest gain of a colour.
    #[serde(default = "gain_range")]
    #[schemars(inner(range(min = 0.01, max = 100.0)))]
    pub gain: [f64; 2],
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

fn one() -> f64 {
    1.0
}

fn ones() -> [f64; 3] {
    [1.0; 3]
}

fn gain_range() -> [f64; 2] {
    [0.25, 4.0]
}
