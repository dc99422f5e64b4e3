//! The form of `constants.json`.

use serde::{Deserialize, Serialize};

use super::law::SpringLaw;
use super::light::LightConstants;
use super::moving::MovingMass;
use super::uncertainty::{OpticsUncertainty, SpringTemperature, SpringTolerances, SpringUncertainty};
use domecast_optics::DomeShape;

/// Marks the file for readers.
pub const FORMAT: &str = "domecast-constants";
/// Raised when a reader of an earlier version would misread the file.
pub const VERSION: u32 = 1;

/// A 4x4 homogeneous transform, row-major.
pub type Matrix4 = [[f64; 4]; 4];

/// What a runtime must know of one sensor.
///
/// Lengths mm, angles rad, pixels px (the centre of the top-left pixel is 0, 0).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Constants {
    /// Always `domecast-constants`.
    pub format: String,
    /// Version of this file's form.
    pub version: u32,
    /// Name of the design.
    pub design: String,
    /// Intrinsics and place of the camera.
    pub camera: CameraConstants,
    /// Layers and dome.
    pub optics: OpticsConstants,
    /// What the dome is made of; not there in constants of earlier builds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub elastomer: Option<ElastomerConstants>,
    /// The circle that the paper's runtime looks into, in the undistorted frame.
    pub mask: MaskConstants,
    /// The markers on the sheet's top face.
    pub white_markers: Vec<WhiteMarker>,
    /// The dots on the dome.
    pub black_dots: Vec<BlackDot>,
    /// The dot left out so that a turned or mirrored picture shows itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub key: Option<KeyConstants>,
    /// The springs between the platforms.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub springs: Option<SpringConstants>,
    /// The lights: what `track --shape` reads the skin's shape with.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light: Option<LightConstants>,
    /// How far the built sensor may be off these numbers: the priors of `calibrate-optics`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerances: Option<CalibrationPriors>,
    /// What `calibrate-optics` left open; until then the tolerances stand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub optics_uncertainty: Option<OpticsUncertainty>,
    /// What calibrations say of the numbers that they measured, one entry each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub calibrations: Vec<serde_json::Value>,
}

/// The dome as an elastic body, bonded to the sheet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ElastomerConstants {
    /// Young's modulus at small strain, N/mm2.
    pub young_modulus_mpa: f64,
    /// Its standard deviation, N/mm2.
    pub young_modulus_sd_mpa: f64,
    /// Poisson's ratio.
    pub poisson_ratio: f64,
    /// Its standard deviation.
    pub poisson_ratio_sd: f64,
    /// Coulomb's coefficient of friction between membrane and objects.
    pub friction: f64,
}

impl ElastomerConstants {
    /// Whether the numbers are those of a solid.
    ///
    /// # Errors
    /// The field at fault and what is wrong with it.
    pub fn check(&self) -> Result<(), (&'static str, &'static str)> {
        let sd = |value: f64| value.is_finite() && value >= 0.0;
        if !(self.young_modulus_mpa.is_finite() && self.young_modulus_mpa > 0.0) {
            return Err(("elastomer.young_modulus_mpa", "is no modulus: a number above 0 is needed"));
        }
        if !(0.0..=0.4999).contains(&self.poisson_ratio) {
            return Err(("elastomer.poisson_ratio", "is none: 0 to 0.4999 are possible"));
        }
        if !(sd(self.young_modulus_sd_mpa) && sd(self.poisson_ratio_sd)) {
            return Err(("elastomer", "has a standard deviation that is none: 0 or more are possible"));
        }
        if !(0.0..=10.0).contains(&self.friction) {
            return Err(("elastomer.friction", "is no coefficient: 0 to 10 are possible"));
        }
        Ok(())
    }
}

/// Standard deviations of the nominal numbers, and of the centroids.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CalibrationPriors {
    /// Pupil, sensor frame, mm.
    pub pupil_mm: [f64; 3],
    /// Camera about its axes, rad.
    pub camera_rotation_rad: [f64; 3],
    /// Each flat layer, mm.
    pub layer_thickness_mm: f64,
    /// Each layer's index.
    pub index: f64,
    /// Each white marker on each axis, mm.
    pub white_marker_mm: f64,
    /// Each black dot in each direction along the dome, mm.
    pub black_dot_mm: f64,
    /// A white marker's centroid on each image axis, px.
    pub white_centroid_px: f64,
    /// A black dot's.
    pub black_centroid_px: f64,
    /// How far the camera moves in its mount after a calibration, on each axis, mm.
    #[serde(default)]
    pub camera_drift_mm: f64,
    /// How far it turns, about each axis, rad.
    #[serde(default)]
    pub camera_drift_rad: f64,
    /// The springs as they are bought.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub springs: Option<SpringTolerances>,
}

/// The camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CameraConstants {
    /// `pinhole`, `brown_conrady` or `kannala_brandt`.
    pub model: String,
    /// Image width, px.
    pub width: u32,
    /// Image height, px.
    pub height: u32,
    /// Intrinsic matrix.
    pub matrix: [[f64; 3]; 3],
    /// k1, k2, p1, p2, k3 (then k4, k5, k6), or k1..k4, or none.
    pub distortion: Vec<f64>,
    /// Covariance of fx, fy, cx, cy (px) and then of each of `distortion`, as a calibration of the camera gave it;
    /// `calibrate-optics` fits them too where it stands here.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub intrinsics_covariance: Vec<Vec<f64>>,
    /// Shift of the entrance pupil along the axis as a series in the field angle, mm; left out for a central lens.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pupil_shift_mm: Vec<f64>,
    /// Camera matrix of the undistorted frame, which has the raw frame's size.
    pub undistorted_matrix: [[f64; 3]; 3],
    /// Largest field angle at which the lens model holds.
    pub max_field_angle_rad: f64,
    /// From the sensor frame to the camera's, at rest.
    pub camera_from_sensor: Matrix4,
}

/// The layers and the dome.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct OpticsConstants {
    /// Radius of the sphere that the dots lie on.
    pub dome_radius_mm: f64,
    /// Height of that sphere's centre above the sheet's top, where the dome is no hemisphere: negative for a cap, the
    /// height of the cylinder that a hemisphere stands on above zero. Not there: 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub dome_center_z_mm: f64,
    /// From the camera outwards, the air gap at rest first.
    pub layers: Vec<LayerConstants>,
}

impl OpticsConstants {
    /// The dome's outer face.
    pub fn dome(&self) -> DomeShape {
        DomeShape::new(self.dome_radius_mm, self.dome_center_z_mm)
    }
}

/// Whether a number says no more than that it is not there.
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// One flat layer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LayerConstants {
    /// What it is made of.
    pub name: String,
    /// Refractive index of the reference (green) channel.
    pub index: f64,
    /// One for each channel, where the design gives three.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub index_rgb: Option<[f64; 3]>,
    /// Thickness; null for the medium that fills the dome.
    pub thickness_mm: Option<f64>,
}

/// The circular mask of the undistorted frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct MaskConstants {
    /// Its centre.
    pub center_px: [f64; 2],
    /// Its radius.
    pub radius_px: f64,
}

/// A white marker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct WhiteMarker {
    /// Its number.
    pub id: usize,
    /// Centre as painted, in the sensor frame.
    pub position_mm: [f64; 3],
    /// Diameter as painted.
    pub diameter_mm: f64,
    /// Where it appears to be for a runtime that knows nothing of refraction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub apparent_position_mm: Option<[f64; 3]>,
    /// Its centre in the raw image at rest.
    pub image_px: [f64; 2],
}

/// A black dot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BlackDot {
    /// Its number.
    pub id: usize,
    /// Its centre in the raw image at rest.
    pub image_px: [f64; 2],
    /// Its centre on the dome, in the sensor frame.
    pub surface_mm: [f64; 3],
    /// Outward unit normal there.
    pub normal: [f64; 3],
    /// Its centre on the printing plate.
    pub plate_mm: [f64; 2],
    /// Diameter on the dome.
    pub diameter_mm: f64,
    /// The dots beside it, by number, ascending.
    pub neighbors: Vec<usize>,
}

/// The dot that a symmetric pattern leaves out. Where a picture is turned or mirrored, the gap is seen at one of the
/// images instead of here.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct KeyConstants {
    /// Its centre in the raw image at rest.
    pub image_px: [f64; 2],
    /// Its centre on the dome, in the sensor frame.
    pub surface_mm: [f64; 3],
    /// The diameter that it would have on the dome.
    pub diameter_mm: f64,
    /// The dots beside it, by number, ascending.
    pub neighbors: Vec<usize>,
    /// Where the gap is seen in a turned or mirrored picture.
    pub images: Vec<KeyImageConstants>,
}

/// Where a turned or mirrored picture shows the gap.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct KeyImageConstants {
    /// By how much the picture is turned, degrees, from image x towards image y; after it was mirrored, if it is.
    pub turned_deg: f64,
    /// Whether the picture is mirrored left to right.
    pub mirrored: bool,
    /// The number of the dot at whose place the gap is seen.
    pub dot: usize,
}

/// The springs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SpringConstants {
    /// From displacement to wrench at `at_mm`, at rest.
    pub stiffness: [[f64; 6]; 6],
    /// Reference point, in the rest frame.
    pub at_mm: [f64; 3],
    /// `nominal` (from geometry) or `measured`.
    pub source: String,
    /// Stiffness as the springs are compressed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stiffness_at: Vec<StiffnessAt>,
    /// What the springs are made of: the law that `stiffness` and `stiffness_at` are tangents and secants of, or, once
    /// those are measured, what is added to them beyond the first order.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<SpringLaw>,
    /// The wrench that a calibration's reference showed at rest; it is no part of `stiffness`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<[f64; 6]>,
    /// What `calibrate-force` left open; until then the tolerances stand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<SpringUncertainty>,
    /// How the stiffness follows the temperature, where the design says it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature: Option<SpringTemperature>,
    /// What the springs carry.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moving: Option<MovingMass>,
    /// For a runtime that runs plain solvePnP on the apparent positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plain_runtime: Option<PlainRuntime>,
}

/// The stiffness at one compression.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StiffnessAt {
    /// How far the platform is pressed down from rest.
    pub compression_mm: f64,
    /// The 6x6 there.
    pub stiffness: [[f64; 6]; 6],
}

/// Constants for plain solvePnP.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PlainRuntime {
    /// From pose relative to `rest_pose` to the wrench that the springs' `stiffness` means.
    pub stiffness: [[f64; 6]; 6],
    /// The same as the springs are compressed, for a runtime that follows their own law: to be interpolated at the
    /// compression that the pose says, as the springs' `stiffness_at`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stiffness_at: Vec<StiffnessAt>,
    /// The pose that plain solvePnP finds at rest.
    pub rest_pose: Matrix4,
}
