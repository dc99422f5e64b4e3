//! Kalibr's camchain.

use super::number::list;
use domecast_runtime::constants::Constants;

/// Brown-Conrady's coefficients from the fifth on.
const NAMES: [&str; 10] = ["k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y"];

/// `kalibr.yaml` with one camera.
///
/// # Errors
/// The reason, in a sentence, where Kalibr has no word for the lens: its `radtan` ends at k1, k2, p1, p2.
pub fn kalibr_yaml(constants: &Constants) -> Result<String, String> {
    let camera = &constants.camera;
    let coefficient = |i: usize| camera.distortion.get(i).copied().unwrap_or(0.0);
    let four = || list((0..4).map(coefficient));
    let (model, coefficients) = match camera.model.as_str() {
        "kannala_brandt" => ("equidistant", four()),
        "pinhole" => ("none", list([])),
        _ => {
            if let Some(i) = (4..camera.distortion.len()).find(|i| coefficient(*i) != 0.0) {
                return Err(format!(
                    "Kalibr's radtan has k1, k2, p1, p2 only; this lens also has {} = {}, and without it the \
                     file would describe another lens",
                    NAMES.get(i - 4).unwrap_or(&"a coefficient"),
                    coefficient(i)
                ));
            }
            ("radtan", four())
        }
    };
    let [[fx, _, cx], [_, fy, cy], _] = camera.matrix;
    Ok(format!(
        "cam0:\n  camera_model: pinhole\n  intrinsics: {}\n  distortion_model: {model}\n  distortion_coeffs: \
         {coefficients}\n  resolution: [{}, {}]\n  rostopic: /{}/image_raw\n",
        list([fx, fy, cx, cy]),
        camera.width,
        camera.height,
        constants.design.replace('-', "_"),
    ))
}
