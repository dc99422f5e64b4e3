//! Whether what a file says can be a camera, and the one expected.

use super::parts::{Named, Parts};
use super::types::{CalibrationHints, CameraCalibration};
use crate::spec::DesignError;
use domecast_optics::camera::{LensModel, LensSpec};

/// A focal length shorter than this share of the image's width would see nearly all around: it is in millimetres.
const MIN_FOCAL_SHARE: f64 = 0.05;
/// One longer than this many widths sees half a degree: it is in another unit.
const MAX_FOCAL_SHARE: f64 = 100.0;
/// A principal point farther from the middle than this share of the image belongs to another resolution: that of half the
/// image is a quarter of it away.
const MAX_OFF_CENTER: f64 = 0.2;
/// Beyond this share it is unusual.
const UNUSUAL_OFF_CENTER: f64 = 0.1;
/// Focal lengths along x and y that differ by more than this are unusual.
const UNUSUAL_ASPECT: f64 = 0.02;

/// Checks the parts and puts them together.
pub(super) fn check(parts: Parts, hints: &CalibrationHints) -> Result<CameraCalibration, DesignError> {
    let width = size("image_width", "width", parts.width.as_ref(), hints.width)?;
    let height = size("image_height", "height", parts.height.as_ref(), hints.height)?;
    if let Some(wanted) = hints.model.filter(|wanted| *wanted != parts.model) {
        return Err(DesignError::at(
            parts.distortion.field,
            "",
            format!("the file's lens model is {}, the design asks for {wanted}", parts.model),
            "one of the two",
        )
        .with_help("leave `model` out: the calibration gives it"));
    }
    let matrix = matrix_of(&parts.matrix)?;
    let focal = focal_lengths(&parts.matrix, [width, height])?;
    let mut warnings = center(&parts.matrix, [width, height])?;
    let aspect = focal[0] / focal[1];
    if (aspect - 1.0).abs() > UNUSUAL_ASPECT {
        warnings.push(format!(
            "the focal lengths along x and y, {} and {} px, differ by {:.0} %: pixels are square in nearly all \
             cameras; was the image stretched when the camera was calibrated?",
            focal[0],
            focal[1],
            100.0 * (aspect - 1.0).abs()
        ));
    }
    let mut distortion = parts.distortion.value;
    if parts.model == LensModel::BrownConrady && distortion.len() == 4 {
        distortion.push(0.0);
    }
    let spec = LensSpec {
        model: parts.model,
        width,
        height,
        matrix,
        distortion,
        field_of_view_rad: 1.0,
        pupil_shift_mm: Vec::new(),
    };
    spec.check().map_err(|fault| {
        let field = match fault.field.strip_prefix("distortion") {
            Some(index) => format!("{}{index}", parts.distortion.field),
            None => parts.matrix.field.clone(),
        };
        DesignError::at(field, fault.value, "the lens cannot be", fault.allowed)
    })?;
    let LensSpec { model, distortion, .. } = spec;
    Ok(CameraCalibration {
        form: parts.form,
        camera: parts.camera,
        width,
        height,
        model,
        matrix,
        distortion,
        warnings,
    })
}

/// The size that the file, the design or both give.
fn size(
    usual: &str,
    side: &str,
    found: Option<&Named<u64>>,
    wanted: Option<u64>,
) -> Result<u32, DesignError> {
    let pixels = match (found, wanted) {
        (Some(found), Some(wanted)) if found.value != wanted => {
            return Err(DesignError::at(
                found.field.clone(),
                found.value,
                format!("this calibration is of another resolution: the design's {side} is {wanted}"),
                wanted.to_string(),
            )
            .with_help(format!(
                "calibrate at the resolution that the sensor runs at, or leave the design's {side} out"
            )));
        }
        (Some(found), _) => found.value,
        (None, Some(wanted)) => wanted,
        (None, None) => {
            return Err(DesignError::at(
                usual,
                "",
                "the field is missing: a calibration holds for one resolution",
                "the image's size that the camera was calibrated at, px",
            )
            .with_help(format!("give it in the file, or as `{side}` of the design's camera")));
        }
    };
    u32::try_from(pixels)
        .map_err(|_| DesignError::at(usual, pixels, "too many pixels", "a whole number, 1 to 1000000"))
}

fn matrix_of(matrix: &Named<[f64; 9]>) -> Result<[[f64; 3]; 3], DesignError> {
    let [fx, skew, cx, below, fy, cy, last @ ..] = matrix.value;
    if skew != 0.0 {
        return Err(DesignError::at(
            format!("{}[1]", matrix.field),
            skew,
            "the matrix has skew, which our lens models do not have",
            "0",
        )
        .with_help("calibrate again with skew held at zero: the sensors of today have none"));
    }
    if below != 0.0 || last != [0.0, 0.0, 1.0] {
        return Err(DesignError::at(
            matrix.field.clone(),
            format!("{:?}", matrix.value),
            "not a camera matrix",
            "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]",
        ));
    }
    Ok([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
}

/// Focal lengths that can be pixels.
fn focal_lengths(matrix: &Named<[f64; 9]>, size: [u32; 2]) -> Result<[f64; 2], DesignError> {
    let focal = [matrix.value[0], matrix.value[4]];
    let width = f64::from(size[0].max(size[1]));
    for (name, value) in ["fx", "fy"].into_iter().zip(focal) {
        let field = format!("{}: {name}", matrix.field);
        let allowed = format!(
            "a focal length in px: {} to {} for an image of {} x {}",
            MIN_FOCAL_SHARE * width,
            MAX_FOCAL_SHARE * width,
            size[0],
            size[1]
        );
        if value <= 0.0 {
            return Err(DesignError::at(field, value, "a focal length is positive", allowed));
        }
        if value < MIN_FOCAL_SHARE * width {
            return Err(DesignError::at(field, value, "far too short for this image: is it in mm?", allowed)
                .with_help("divide it by the size of a pixel in mm"));
        }
        if value > MAX_FOCAL_SHARE * width {
            let problem = "far too long for this image: is it in micrometres, or of another resolution?";
            return Err(DesignError::at(field, value, problem, allowed));
        }
    }
    Ok(focal)
}

/// A principal point near the middle; a warning where it is unusual.
fn center(matrix: &Named<[f64; 9]>, size: [u32; 2]) -> Result<Vec<String>, DesignError> {
    let mut warnings = Vec::new();
    for (i, name) in ["cx", "cy"].into_iter().enumerate() {
        let (value, side) = (matrix.value[3 * i + 2], f64::from(size[i]));
        let middle = 0.5 * (side - 1.0);
        let off = (value - middle).abs() / side;
        if off > MAX_OFF_CENTER {
            return Err(DesignError::at(
                format!("{}: {name}", matrix.field),
                value,
                format!(
                    "the principal point is {:.0} % of the image away from its middle ({middle} px): is this the \
                     calibration of another resolution?",
                    100.0 * off
                ),
                format!("{} to {} px", middle - MAX_OFF_CENTER * side, middle + MAX_OFF_CENTER * side),
            )
            .with_help("calibrate at the resolution that the sensor runs at"));
        }
        if off > UNUSUAL_OFF_CENTER {
            warnings.push(format!(
                "{name} is {value} px, {:.0} % of the image away from its middle ({middle} px): that is much for a \
                 lens; is the calibration of this camera and this resolution?",
                100.0 * off
            ));
        }
    }
    Ok(warnings)
}
