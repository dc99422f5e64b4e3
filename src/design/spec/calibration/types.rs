//! What a calibration is, and what is known beside its file.

use domecast_optics::camera::LensModel;

/// What a calibration file may be, for messages.
pub(super) const ALLOWED_FILE: &str =
    "a calibration: OpenCV FileStorage (YAML, XML or JSON), ROS camera_info (YAML) or Kalibr camchain (YAML)";

/// Which program's form a calibration has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CalibrationForm {
    /// OpenCV's `FileStorage`.
    OpencvStorage,
    /// ROS `camera_info`.
    RosCameraInfo,
    /// Kalibr's camchain.
    KalibrCamchain,
}

impl CalibrationForm {
    /// The name that people know it by.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::OpencvStorage => "OpenCV FileStorage",
            Self::RosCameraInfo => "ROS camera_info",
            Self::KalibrCamchain => "Kalibr camchain",
        }
    }
}

/// What is known beside the file, and decides or is compared where the file is silent or has a choice.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CalibrationHints {
    /// Which camera of a camchain: `cam0`.
    pub camera: Option<String>,
    /// The lens model, where the file does not say it.
    pub model: Option<LensModel>,
    /// Image width, px.
    pub width: Option<u64>,
    /// Image height, px.
    pub height: Option<u64>,
}

/// A camera as its calibration gives it: every number finite, focal lengths and principal point plausible.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraCalibration {
    /// The form of the file.
    pub form: CalibrationForm,
    /// The camera's name in the file; empty where it has none.
    pub camera: String,
    /// Image width, px.
    pub width: u32,
    /// Image height, px.
    pub height: u32,
    /// Lens model.
    pub model: LensModel,
    /// Camera matrix `[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]`, px; the centre of the top-left pixel is (0, 0).
    pub matrix: [[f64; 3]; 3],
    /// Coefficients in OpenCV's order; a list of four for Brown-Conrady got its k3 = 0.
    pub distortion: Vec<f64>,
    pub(super) warnings: Vec<String>,
}
