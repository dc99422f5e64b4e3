//! The lens's brightness and sharpness, and the image sensor, as they are written.
//!
//! Every part may be left out: then the camera is ideal in that respect, and the effect is not called for.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::camera::{AutoExposureSection, DefectsSection, SharpeningSection, WhiteBalanceSection};
use domecast_design::sections::Why;

/// From light on the image plane to bytes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ElectronicsSection {
    /// Exponent of the code: level = light^(1/gamma); 1 is linear.
    #[schemars(range(min = 0.2, max = 5.0))]
    pub gamma: f64,
    /// Exponent n of the fall of brightness cos^n of the field angle; 0 for none.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub vignetting_exponent: f64,
    /// How the lens is focussed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focus: Option<FocusSection>,
    /// When light is gathered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shutter: Option<ShutterSection>,
    /// Colour filters over the pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bayer: Option<BayerPattern>,
    /// An exposure that the camera sets by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub auto_exposure: Option<AutoExposureSection>,
    /// Hot and dead pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub defects: Option<DefectsSection>,
    /// Shot, read and quantisation noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseSection>,
    /// A white balance that the camera sets by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub white_balance: Option<WhiteBalanceSection>,
    /// Sharpening by the camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sharpening: Option<SharpeningSection>,
    /// Quality of the JPEG code that the camera sends, 1 to 100; left out: no loss.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 100))]
    pub jpeg_quality: Option<u8>,
    /// How finely that code keeps colour.
    pub jpeg_chroma: JpegChroma,
    /// Reasons and sources, by field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

impl Default for ElectronicsSection {
    fn default() -> Self {
        Self {
            gamma: 1.0,
            vignetting_exponent: 0.0,
            focus: None,
            shutter: None,
            bayer: None,
            auto_exposure: None,
            defects: None,
            noise: None,
            white_balance: None,
            sharpening: None,
            jpeg_quality: None,
            jpeg_chroma: JpegChroma::HalfWidth,
            why: None,
        }
    }
}

impl ElectronicsSection {
    /// Largest slope of the code `level = light^(1/gamma)` at or above a level; infinite at 0 for gamma above 1.
    pub fn steepest_code(&self, darkest_level: f64) -> f64 {
        let power = 1.0 / self.gamma;
        if power >= 1.0 { power } else { power * darkest_level.clamp(0.0, 1.0).powf(power - 1.0) }
    }
}

/// A thin lens's focus.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FocusSection {
    /// Diameter of the entrance pupil, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 100.0))]
    pub pupil_diameter_mm: f64,
    /// Distance in air at which the image is sharp, mm.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e6))]
    pub distance_mm: f64,
}

/// When light is gathered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShutterSection {
    /// Time for which each row gathers light, s; centred on the row's time.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub exposure_s: f64,
    /// Time from the first row to the last, s; 0 for a global shutter. The middle row is at the frame's time.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub readout_s: f64,
}

/// How finely a JPEG keeps colour, of how finely it keeps light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum JpegChroma {
    /// For every pixel.
    #[serde(rename = "444")]
    Full,
    /// For every second pixel of a row, as UVC cameras do.
    #[serde(rename = "422")]
    HalfWidth,
    /// For every second pixel of every second row.
    #[serde(rename = "420")]
    Quarter,
}

impl JpegChroma {
    /// The name that files carry.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Full => "444",
            Self::HalfWidth => "422",
            Self::Quarter => "420",
        }
    }
}

/// Order of the colour filters from the top-left pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BayerPattern {
    /// Red green / green blue.
    Rggb,
    /// Blue green / green red.
    Bggr,
    /// Green red / blue green.
    Grbg,
    /// Green blue / red green.
    Gbrg,
}

/// Noise of the sensor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseSection {
    /// Electrons at full scale.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 1e9))]
    pub full_scale_electrons: f64,
    /// Standard deviation of reading, electrons.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e6))]
    pub read_electrons: f64,
    /// Bits of the converter.
    #[serde(default = "twelve")]
    #[schemars(range(min = 8, max = 16))]
    pub bits: u8,
}

fn twelve() -> u8 {
    12
}
