//! ROS camera_info, as `camera_calibration_parsers` reads it.

use super::number::list;
use domecast_runtime::constants::Constants;

/// `camera_info.yaml`: `plumb_bob` for up to five Brown-Conrady coefficients, `rational_polynomial` for 8, 12 and
/// 14,
/// `equidistant` for Kannala-Brandt. The projection matrix is the undistorted frame's.
pub fn camera_info_yaml(constants: &Constants) -> String {
    let camera = &constants.camera;
    let mut distortion = camera.distortion.clone();
    let model = match camera.model.as_str() {
        "kannala_brandt" => "equidistant",
        _ if distortion.len() > 5 => {
            let length = distortion.len().max(8);
            distortion.resize(length, 0.0);
            "rational_polynomial"
        }
        _ => {
            distortion.resize(5, 0.0);
            "plumb_bob"
        }
    };
    let flat = |rows: &[[f64; 3]; 3]| list(rows.iter().flatten().copied());
    let [a, b, c] = camera.undistorted_matrix;
    let projection = list([a, b, c].into_iter().flat_map(|row| [row[0], row[1], row[2], 0.0]));
    let identity = list([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    let node = |name: &str, rows: usize, cols: usize, data: &str| {
        format!("{name}:\n  rows: {rows}\n  cols: {cols}\n  data: {data}\n")
    };
    format!(
        "image_width: {}\nimage_height: {}\ncamera_name: {}\n{}distortion_model: {model}\n{}{}{}",
        camera.width,
        camera.height,
        constants.design.replace('-', "_"),
        node("camera_matrix", 3, 3, &flat(&camera.matrix)),
        node("distortion_coefficients", 1, distortion.len(), &list(distortion.iter().copied())),
        node("rectification_matrix", 3, 3, &identity),
        node("projection_matrix", 3, 4, &projection),
    )
}
