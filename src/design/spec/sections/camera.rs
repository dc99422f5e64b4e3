//! The camera: intrinsics, and place.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Why;

/// The lens models that a camera may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ModelName {
    /// No distortion; `distortion` is empty.
    Pinhole,
    /// OpenCV's standard model: k1, k2, p1, p2, k3, and optionally k4, k5, k6, then s1, s2, s3, s4 (thin prism), then
    /// tau_x, tau_y (tilt of the sensor, rad).
    BrownConrady,
    /// OpenCV's fisheye model: k1, k2, k3, k4.
    KannalaBrandt,
}

/// The camera as a calibration gives it, and where its entrance pupil stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraSection {
    /// Lens model.
    pub model: ModelName,
    /// Image width in px.
    #[schemars(range(min = 16, max = 20000))]
    pub width: u32,
    /// Image height in px.
    #[schemars(range(min = 16, max = 20000))]
    pub height: u32,
    /// Intrinsic matrix `[[fx,0,cx],[0,fy,cy],[0,0,1]]`, px; the centre of the top-left pixel is (0, 0).
    pub matrix: [[f64; 3]; 3],
    /// Distortion coefficients: none for pinhole; k1, k2, p1, p2, k3 (then k4, k5, k6, s1 to s4, tau_x,
    /// tau_y: 5, 8, 12 or 14) for `brown_conrady`; k1, k2, k3, k4 for `kannala_brandt`.
    #[schemars(length(max = 14))]
    pub distortion: Vec<f64>,
    /// Full field of view of the lens as sold, degrees; the model may reach less.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 360.0))]
    pub field_of_view_deg: f64,
    /// Entrance pupil in the sensor frame at rest, mm; z is negative, below the sheet.
    pub position_mm: [f64; 3],
    /// `[a, b, c]`: sensor_from_camera = Rz(c) Ry(b) Rx(a), degrees. Zero: the camera's axes are the sensor's.
    #[serde(default)]
    pub rotation_deg: [f64; 3],
    /// Shift of the entrance pupil along the camera's axis as a series in the field angle a (rad):
    /// shift = s1 a^2 + s2 a^4 + ..., mm, positive towards the scene. Empty for a central lens.
    #[serde(default)]
    #[schemars(length(max = 4))]
    pub pupil_shift_mm: Vec<f64>,
    /// The camera's calibration, a path from the design file's folder: OpenCV FileStorage (YAML, XML, JSON), ROS
    /// camera_info or Kalibr camchain; it gives model, width, height, matrix and distortion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<String>,
    /// Which camera of a camchain, where it has several: `cam0`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration_camera: Option<String>,
    /// Key of a part whose numbers stand for the fields that are left out here: `domecast list cameras`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}

/// What the paper's runtime does to the frame before it looks for markers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RuntimeSection {
    /// Radius of the circular mask in the undistorted frame, px.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(max = 20000.0))]
    pub mask_radius_px: f64,
    /// Field angle that the mask's edge must show, degrees; it sets the focal length of the undistorted
    /// frame, f = mask_radius_px / tan(angle). The frame keeps the raw frame's size and principal point.
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 90.0))]
    pub mask_field_angle_deg: f64,
    /// Reasons and sources, by field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<Why>,
}
