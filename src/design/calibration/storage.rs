//! OpenCV's `FileStorage` and ROS `camera_info`: the same matrices, with a word for the model in one of them.

use serde_json::{Map, Value};

use super::parts::{Named, Parts, nine, numbers, pixels, word, wrong_count};
use super::{ALLOWED_FILE, CalibrationForm, CalibrationHints};
use crate::spec::DesignError;
use domecast_optics::camera::LensModel;

/// Names that programs give the camera matrix, without capitals and underscores.
const MATRIX_NAMES: [&str; 7] =
    ["cameramatrix", "k", "intrinsicmatrix", "intrinsics", "intrinsic", "mtx", "cammatrix"];
/// Names of the coefficients.
const DISTORTION_NAMES: [&str; 8] = [
    "distortioncoefficients",
    "distcoeffs",
    "d",
    "dist",
    "distortion",
    "distcoeff",
    "distcoef",
    "distortioncoeffs",
];
const WIDTH_NAMES: [&str; 2] = ["imagewidth", "width"];
const HEIGHT_NAMES: [&str; 2] = ["imageheight", "height"];
const SIZE_NAMES: [&str; 2] = ["imagesize", "resolution"];

/// The field of the first of these names that the file has.
fn find<'a>(top: &'a Map<String, Value>, names: &[&str]) -> Option<(&'a str, &'a Value)> {
    names.iter().find_map(|name| {
        let same = |key: &str| {
            let plain = key.chars().filter(|c| *c != '_').map(|c| c.to_ascii_lowercase());
            plain.eq(name.chars())
        };
        top.iter().find(|(key, _)| same(key)).map(|(key, value)| (key.as_str(), value))
    })
}

/// Reads the one camera of the file.
pub(super) fn read(top: &Map<String, Value>, hints: &CalibrationHints) -> Result<Parts, DesignError> {
    if let Some(wanted) = &hints.camera {
        let fault = DesignError::at(wanted.clone(), "", "only a Kalibr camchain names its cameras", "");
        return Err(fault.with_help("leave `calibration_camera` out"));
    }
    let ros_model = top.get("distortion_model");
    let Some((matrix_field, matrix)) = find(top, &MATRIX_NAMES) else {
        let keys: Vec<&str> = top.keys().map(String::as_str).take(8).collect();
        let mut fault = DesignError::at(
            "camera_matrix",
            "",
            "the field is missing: this is no calibration",
            ALLOWED_FILE,
        );
        let stereo = find(top, &["m1", "k1", "cameramatrix1", "m2"]).is_some();
        fault.help = Some(if stereo {
            "this is a calibration of two cameras: write the one that you use into a file of its own"
                .to_owned()
        } else {
            format!("the file has: {}", keys.join(", "))
        });
        return Err(fault);
    };
    let matrix = nine(matrix_field, matrix)?;
    let coefficients = match find(top, &DISTORTION_NAMES) {
        Some((field, value)) => Named { field: field.to_owned(), value: numbers(field, value)? },
        None => {
            return Err(DesignError::at(
                "distortion_coefficients",
                "",
                "the field is missing",
                "a list of coefficients, k1 first; zeros for a lens without distortion",
            ));
        }
    };
    let (model, form) = match ros_model {
        Some(name) => (ros(name, &coefficients)?, CalibrationForm::RosCameraInfo),
        None => (opencv(top, &coefficients, hints)?, CalibrationForm::OpencvStorage),
    };
    let (mut width, mut height) = (side(top, &WIDTH_NAMES)?, side(top, &HEIGHT_NAMES)?);
    if let (Some((field, value)), None, None) = (find(top, &SIZE_NAMES), &width, &height) {
        let Some([w, h]) = value.as_array().map(Vec::as_slice) else {
            return Err(DesignError::at(field, value, "not two numbers", "[width, height], px"));
        };
        width = Some(pixels(&format!("{field}[0]"), w)?);
        height = Some(pixels(&format!("{field}[1]"), h)?);
    }
    let mut distortion = coefficients;
    if model == LensModel::Pinhole {
        distortion.value.clear();
    }
    let camera = top.get("camera_name").and_then(Value::as_str).unwrap_or_default().to_owned();
    Ok(Parts { form, camera, width, height, matrix, model, distortion })
}

fn side(top: &Map<String, Value>, names: &[&str]) -> Result<Option<Named<u64>>, DesignError> {
    find(top, names).map(|(field, value)| pixels(field, value)).transpose()
}

/// The model by ROS's name for it.
fn ros(name: &Value, coefficients: &Named<Vec<f64>>) -> Result<LensModel, DesignError> {
    let text = word(name);
    let (model, counts, allowed): (_, &[usize], _) = match text.as_str() {
        "plumb_bob" | "radtan" => {
            (LensModel::BrownConrady, &[4, 5], "5: k1, k2, p1, p2, k3 (or 4, without k3)")
        }
        "rational_polynomial" => (LensModel::BrownConrady, &[8, 12, 14], "8, 12 or 14"),
        "equidistant" | "fisheye" => (LensModel::KannalaBrandt, &[4], "4: k1, k2, k3, k4"),
        _ => {
            return Err(DesignError::at(
                "distortion_model",
                format!("\"{text}\""),
                "this distortion is not among our lens models",
                "plumb_bob, radtan, rational_polynomial, equidistant or fisheye",
            ));
        }
    };
    let found = coefficients.value.len();
    if counts.contains(&found) {
        return Ok(model);
    }
    Err(wrong_count(&coefficients.field, found, &format!("`{text}`"), allowed))
}

/// The model that OpenCV's file says, or that the number of its coefficients leaves.
fn opencv(
    top: &Map<String, Value>,
    coefficients: &Named<Vec<f64>>,
    hints: &CalibrationHints,
) -> Result<LensModel, DesignError> {
    let count = coefficients.value.len();
    let stated = match top.get("camera_model").map(word) {
        Some(name) => Some(match name.as_str() {
            "fisheye" | "equidistant" => LensModel::KannalaBrandt,
            name => LensModel::parse(name).ok_or_else(|| {
                DesignError::at(
                    "camera_model",
                    format!("\"{name}\""),
                    "this lens model is not among ours",
                    "pinhole, brown_conrady or kannala_brandt (fisheye)",
                )
            })?,
        }),
        // `fisheye_model` is what OpenCV's own calibration program writes
        None => top
            .get("fisheye_model")
            .and_then(Value::as_i64)
            .map(|fisheye| if fisheye == 0 { LensModel::BrownConrady } else { LensModel::KannalaBrandt }),
    };
    let model = match (stated.or(hints.model), count) {
        (Some(model), _) => model,
        (None, 4) => {
            return Err(DesignError::at(
                coefficients.field.clone(),
                "a list of 4",
                "k1, k2, p1, p2 of the standard model or k1 to k4 of the fisheye model: the file does not say which",
                "a file that says it, or 5 coefficients",
            )
            .with_help(
                "say it in the design, as \"model\": \"kannala_brandt\" (fisheye) or \"brown_conrady\", or in the \
                 file, as `camera_model`",
            ));
        }
        (None, _) => LensModel::BrownConrady,
    };
    let zeros = coefficients.value.iter().all(|value| *value == 0.0);
    let (fits, allowed) = match model {
        LensModel::BrownConrady => (matches!(count, 4 | 5 | 8 | 12 | 14), "4, 5, 8, 12 or 14"),
        LensModel::KannalaBrandt => (count == 4, "4: k1, k2, k3, k4"),
        LensModel::Pinhole => (zeros, "none, or zeros"),
    };
    if fits { Ok(model) } else { Err(wrong_count(&coefficients.field, count, model.as_str(), allowed)) }
}
