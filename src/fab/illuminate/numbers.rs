//! The numbers of `illuminate.json`.

use serde::Serialize;

use super::crescents::Crescent;
use crate::light::{DomeLevels, MarkerLevels};

/// A 5th percentile, median and 95th percentile by area; null where the percentile falls on a place without a number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Percentiles {
    /// One part in twenty of the area has less.
    pub p5: Option<f64>,
    /// Median.
    pub p50: Option<f64>,
    /// One part in twenty of the area has more.
    pub p95: Option<f64>,
}

/// How even one kind of light is; colours and channels are red, green, blue.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LightEvenness {
    /// Irradiance, mW/mm^2.
    pub irradiance_mw_mm2: [Percentiles; 3],
    /// 95th percentile over the 5th of each; null where the 5th is 0.
    pub p95_over_p5: [Option<f64>; 3],
    /// Standard deviation over mean of the three's sum.
    pub sum_coefficient_of_variation: Option<f64>,
}

/// The dome from the pole to a polar angle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Within {
    /// That polar angle about the sphere's centre, degrees.
    pub polar_angle_deg: f64,
    /// Places of equal area in it.
    pub places: usize,
    /// Those of them that the camera sees at rest.
    pub places_seen: usize,
    /// By the lights directly, for each colour of light, without crosstalk.
    pub direct: LightEvenness,
    /// With the dome lighting itself, for each channel of the camera, with crosstalk.
    pub total: LightEvenness,
    /// Condition number of `C L`.
    pub condition_number: Percentiles,
    /// Error of a normal in each tangential direction for one grey level of noise in each channel, degrees, of the places
    /// that the camera sees.
    pub normal_error_deg_per_level: Percentiles,
    /// Share of the area where the direct light of any colour is below a twentieth of its median here.
    pub crescent_share: f64,
    /// Share of the places seen with a channel above full scale.
    pub saturated_share: f64,
}

/// A number for each place, in one order: rings from the rim up, in each the azimuth from x.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Places {
    /// Rings of equal area.
    pub rings: usize,
    /// Places in each ring.
    pub per_ring: usize,
    /// Polar angle about the sphere's centre, degrees.
    pub polar_deg: Vec<f64>,
    /// Azimuth from x, degrees.
    pub azimuth_deg: Vec<f64>,
    /// Outward unit normal.
    pub normal: Vec<[f64; 3]>,
    /// Where the camera sees the place, raw image, px; null where it does not.
    pub image_px: Vec<Option<[f64; 2]>>,
    /// `L`, mW/mm^2: row k is the direct vector irradiance by the lights of colour k.
    pub vector_irradiance_mw_mm2: Vec<[[f64; 3]; 3]>,
    /// Irradiance that each channel sees, with the dome lighting itself, mW/mm^2.
    pub total_irradiance_mw_mm2: Vec<[f64; 3]>,
    /// Grey levels, of 255, of each channel for each mW/mm^2 that it sees on the place, at the exposure.
    pub grey_levels_per_mw_mm2: Vec<[f64; 3]>,
    /// Grey level of each channel at rest, of 255, not cut off; null where the camera does not see the place.
    pub level: Vec<Option<[f64; 3]>>,
    /// Condition number of `C L`; null where a colour is missing.
    pub condition_number: Vec<Option<f64>>,
    /// Error of the normal, degrees for each grey level of noise; null where a colour is missing or the camera does not see
    /// the place.
    pub normal_error_deg_per_level: Vec<Option<f64>>,
    /// Whether red, green, blue is below a twentieth of its median within 75 degrees.
    pub is_lacking: Vec<[bool; 3]>,
}

/// What the camera sees of the lights themselves.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LightsSeen {
    /// Pieces of the lights, 36 each, that it sees mirrored in the faces of sheet and silicone, one for each face.
    pub mirrored_pieces: usize,
    /// Level, of 255, that the brightest of them adds in any channel, not cut off at full scale.
    pub brightest_mirrored_level: Option<f64>,
    /// Where that one is in the raw image, px.
    pub brightest_mirrored_px: Option<[f64; 2]>,
}

/// Grey level of the dome between the dots, less that of a dot there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DotContrast {
    /// Part of the membrane's light that ink gives back.
    pub ink_reflectance: f64,
    /// At the 5th percentile of the dome's grey level, levels of 255.
    pub p5_levels: f64,
    /// At its median.
    pub p50_levels: f64,
    /// At its 95th percentile.
    pub p95_levels: f64,
}

/// Everything that `domecast illuminate` found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IlluminationReport {
    /// Version of this file's form.
    pub version: u32,
    /// Name of the design.
    pub design: String,
    /// domecast's version.
    pub domecast: &'static str,
    /// Exposure: level, of full scale, of a white surface for each mW/mm^2 on it. That of `report/light.json`: the design's
    /// `exposure.level_per_mw_mm2`, or what puts the brightest place of the dome in view at `exposure.brightest_level`.
    pub level_per_mw_mm2: f64,
    /// Whether that is the camera's largest, and the frame darker than wanted.
    pub is_exposure_at_limit: bool,
    /// Light from outside, levels of 255.
    pub stray_levels: f64,
    /// `C`: what each channel (row) sees of each colour (column).
    pub crosstalk: [[f64; 3]; 3],
    /// To 45, 60 and 75 degrees.
    pub within: Vec<Within>,
    /// Connected places within 75 degrees that lack a colour, the largest first.
    pub crescents: Vec<Crescent>,
    /// The lights themselves in the image.
    pub lights_seen: LightsSeen,
    /// Grey level of the dome in view, as in `report/light.json`.
    pub dome: DomeLevels,
    /// The white markers, as in `report/light.json`.
    pub markers: Vec<MarkerLevels>,
    /// The dots.
    pub dots: DotContrast,
    /// Place by place.
    pub places: Places,
}
