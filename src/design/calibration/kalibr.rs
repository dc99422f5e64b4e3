//! Kalibr's camchain: `cam0`, `cam1`, ... with `intrinsics`, `distortion_coeffs` and `resolution`.

use serde_json::{Map, Value};

use super::parts::{Named, Parts, numbers, pixels, word, wrong_count};
use super::{CalibrationForm, CalibrationHints};
use crate::spec::DesignError;
use domecast_optics::camera::LensModel;

/// The cameras of a camchain by name, or one camera without; `None` for files of another form.
pub(super) fn cameras(top: &Map<String, Value>) -> Option<Vec<(String, &Map<String, Value>)>> {
    let is_camera = |map: &Map<String, Value>| {
        map.contains_key("intrinsics")
            && (map.contains_key("camera_model") || map.contains_key("distortion_coeffs"))
    };
    if is_camera(top) {
        return Some(vec![(String::new(), top)]);
    }
    let numbered = |name: &str| {
        name.strip_prefix("cam").is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    };
    let found: Vec<(String, &Map<String, Value>)> = top
        .iter()
        .filter_map(|(name, value)| Some((name.clone(), value.as_object()?)))
        .filter(|(name, camera)| numbered(name) || is_camera(camera))
        .collect();
    (!found.is_empty()).then_some(found)
}

/// The camera that is asked for, or the only one.
fn choose<'a>(
    cameras: &'a [(String, &'a Map<String, Value>)],
    hints: &CalibrationHints,
) -> Result<&'a (String, &'a Map<String, Value>), DesignError> {
    let names: Vec<&str> = cameras.iter().map(|(name, _)| name.as_str()).collect();
    match (&hints.camera, cameras) {
        (Some(wanted), _) => cameras.iter().find(|(name, _)| name == wanted).ok_or_else(|| {
            DesignError::at(wanted.clone(), "", "the file has no camera of that name", names.join(" or "))
                .with_help("name one of them as `calibration_camera`")
        }),
        (None, [only]) => Ok(only),
        (None, _) => Err(DesignError::at(
            "",
            "",
            format!("the file has {} cameras, and none is named", cameras.len()),
            names.join(" or "),
        )
        .with_help(format!("say which: \"calibration_camera\": \"{}\"", names.first().unwrap_or(&"cam0")))),
    }
}

/// Reads one camera.
pub(super) fn read(
    cameras: &[(String, &Map<String, Value>)],
    hints: &CalibrationHints,
) -> Result<Parts, DesignError> {
    let (name, camera) = choose(cameras, hints)?;
    let field = |key: &str| if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") };
    let missing = |key: &str, allowed: &str| DesignError::at(field(key), "", "the field is missing", allowed);
    let projection = camera.get("camera_model").map_or_else(|| "pinhole".to_owned(), word);
    if projection != "pinhole" {
        let known = match projection.as_str() {
            "omni" => "the unified omnidirectional model (omni) is not among our lens models",
            "ds" => "the double sphere model (ds) is not among our lens models",
            "eucm" => "the extended unified model (eucm) is not among our lens models",
            _ => "this projection is not among our lens models",
        };
        return Err(DesignError::at(field("camera_model"), format!("\"{projection}\""), known, "pinhole")
            .with_help("calibrate again with `--models pinhole-equi` (wide lenses) or `pinhole-radtan`"));
    }
    let intrinsics = camera.get("intrinsics").ok_or_else(|| missing("intrinsics", "[fx, fy, cx, cy], px"))?;
    let found = numbers(&field("intrinsics"), intrinsics)?;
    let &[fx, fy, cx, cy] = found.as_slice() else {
        return Err(DesignError::at(
            field("intrinsics"),
            intrinsics,
            "not four numbers",
            "[fx, fy, cx, cy], px",
        ));
    };
    let model_field = field("distortion_model");
    let distortion_model = camera
        .get("distortion_model")
        .map(word)
        .ok_or_else(|| missing("distortion_model", "radtan, equidistant or none"))?;
    let coefficients = match camera.get("distortion_coeffs") {
        Some(value) => numbers(&field("distortion_coeffs"), value)?,
        None if distortion_model == "none" => Vec::new(),
        None => return Err(missing("distortion_coeffs", "a list of 4")),
    };
    let (model, count) = match distortion_model.as_str() {
        "radtan" | "plumb_bob" => (LensModel::BrownConrady, 4),
        "equidistant" | "equi" | "fisheye" => (LensModel::KannalaBrandt, 4),
        "none" => (LensModel::Pinhole, 0),
        other => {
            return Err(DesignError::at(
                model_field,
                format!("\"{other}\""),
                "this distortion is not among our lens models",
                "radtan, equidistant or none",
            )
            .with_help("calibrate again with `--models pinhole-equi` (wide lenses) or `pinhole-radtan`"));
        }
    };
    if coefficients.len() != count {
        let name = format!("`{distortion_model}`");
        return Err(wrong_count(&field("distortion_coeffs"), coefficients.len(), &name, &count.to_string()));
    }
    let (width, height) = match camera.get("resolution") {
        None => (None, None),
        Some(Value::Array(sides)) if sides.len() == 2 => {
            let side = |i: usize| pixels(&format!("{}[{i}]", field("resolution")), &sides[i]);
            (Some(side(0)?), Some(side(1)?))
        }
        Some(other) => {
            return Err(DesignError::at(
                field("resolution"),
                other,
                "not two numbers",
                "[width, height], px",
            ));
        }
    };
    Ok(Parts {
        form: CalibrationForm::KalibrCamchain,
        camera: name.clone(),
        width,
        height,
        matrix: Named { field: field("intrinsics"), value: [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0] },
        model,
        distortion: Named { field: field("distortion_coeffs"), value: coefficients },
    })
}
