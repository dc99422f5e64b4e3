//! Camera calibrations that other programs wrote, as the `camera` section of a design wants them.
//!
//! Read are OpenCV's `FileStorage` (YAML, XML, JSON), ROS `camera_info` (YAML) and Kalibr's camchain (YAML), with the
//! models that [`domecast_optics::camera`] has: Brown-Conrady with 4, 5, 8, 12 or 14 coefficients (`plumb_bob`,
//! `radtan`, `rational_polynomial`) and Kannala-Brandt with 4 (`equidistant`, `fisheye`). What a file says and we
//! cannot follow, or what can hardly be meant (a focal length in millimetres, the calibration of another
//! resolution), is a named fault, never a guess: a wrong lens looks like a working sensor.
//!
//! # Example
//! ```
//! use domecast_design::calibration::{Calibration, CalibrationHints};
//!
//! let text = "image_width: 640
//! image_height: 480
//! distortion_model: equidistant
//! camera_matrix: {rows: 3, cols: 3, data: [229.0, 0.0, 319.5, 0.0, 229.0, 239.5, 0.0, 0.0, 1.0]}
//! distortion_coefficients: {rows: 1, cols: 4, data: [-0.01, 0.002, 0.0, 0.0]}
//! ";
//! let calibration = Calibration::parse(text, &CalibrationHints::default())?;
//! assert_eq!((calibration.width, calibration.model.as_str()), (640, "kannala_brandt"));
//! # Ok::<(), domecast_design::DesignError>(())
//! ```

mod checks;
mod kalibr;
mod parts;
mod storage;
#[cfg(test)]
mod tests;
mod tree;

use std::path::Path;

use serde_json::{Map, Value, json};

use crate::spec::{DesignError, read_text};
use domecast_optics::camera::LensModel;

/// What a calibration file may be, for messages.
const ALLOWED_FILE: &str =
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
pub struct Calibration {
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
    warnings: Vec<String>,
}

impl Calibration {
    /// Reads a calibration file.
    ///
    /// # Errors
    /// A missing file, a file that is no calibration, and what [`Calibration::parse`] refuses; the file is named.
    pub fn load(path: &Path, hints: &CalibrationHints) -> Result<Self, DesignError> {
        let text = read_text(path).map_err(|mut fault| {
            fault.allowed = ALLOWED_FILE.to_owned();
            fault
        })?;
        Self::parse(&text, hints).map_err(|fault| fault.in_file(path))
    }

    /// Reads a calibration from its text: XML where it begins with `<`, JSON where it begins with `{`, else YAML.
    ///
    /// # Errors
    /// Text that none of the forms has, models that we lack, wrong numbers of coefficients, a size that is missing or
    /// is not the one expected, skew, focal lengths that are not in pixels, a principal point far from the middle.
    pub fn parse(text: &str, hints: &CalibrationHints) -> Result<Self, DesignError> {
        let tree = tree::parse(text)?;
        let Value::Object(top) = &tree else {
            return Err(DesignError::at("", "", "this is no calibration", ALLOWED_FILE));
        };
        let parts = match kalibr::cameras(top) {
            Some(cameras) => kalibr::read(&cameras, hints)?,
            None => storage::read(top, hints)?,
        };
        checks::check(parts, hints)
    }

    /// The fields of a design's `camera` section that a calibration gives.
    pub fn fields(&self) -> Map<String, Value> {
        let fields = json!({
            "model": self.model.as_str(),
            "width": self.width,
            "height": self.height,
            "matrix": self.matrix,
            "distortion": self.distortion,
        });
        match fields {
            Value::Object(fields) => fields,
            _ => Map::new(),
        }
    }

    /// What is unusual but possible, with numbers.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }
}
