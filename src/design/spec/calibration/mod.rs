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
//! use domecast_design::calibration::{CameraCalibration, CalibrationHints};
//!
//! let text = "image_width: 640
//! image_height: 480
//! distortion_model: equidistant
//! camera_matrix: {rows: 3, cols: 3, data: [229.0, 0.0, 319.5, 0.0, 229.0, 239.5, 0.0, 0.0, 1.0]}
//! distortion_coefficients: {rows: 1, cols: 4, data: [-0.01, 0.002, 0.0, 0.0]}
//! ";
//! let calibration = CameraCalibration::parse(text, &CalibrationHints::default())?;
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
mod types;

use std::path::Path;

use serde_json::{Map, Value, json};

use crate::spec::{DesignError, read_text};
pub use types::{CalibrationForm, CalibrationHints, CameraCalibration};

use types::ALLOWED_FILE;

impl CameraCalibration {
    /// Reads a calibration file.
    ///
    /// # Errors
    /// A missing file, a file that is no calibration, and what [`CameraCalibration::parse`] refuses; the file is named.
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
