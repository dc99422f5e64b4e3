//! OpenCV's FileStorage YAML: everything that the paper's pipeline needs, as matrices.

use super::number::number;
use domecast_runtime::constants::Constants;

/// A matrix node; OpenCV reads the rows one after the other.
fn matrix(name: &str, rows: usize, cols: usize, values: impl IntoIterator<Item = f64>) -> String {
    let parts: Vec<String> = values.into_iter().map(number).collect();
    let mut lines: Vec<String> = parts.chunks(cols.max(1)).map(|row| row.join(", ")).collect();
    if lines.is_empty() {
        lines.push(String::new());
    }
    let data = lines.join(",\n       ");
    format!("{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: [ {data} ]\n")
}

/// The constants for `cv2.FileStorage`.
///
/// `camera_matrix`, `distortion_coefficients` (for `cv2.undistort`, or for `cv2.fisheye` where `camera_model` is
/// `kannala_brandt`), `undistorted_matrix`, the mask, `white_markers_mm` (as painted), `apparent_white_markers_mm`
/// (for plain solvePnP), and the plain runtime's `rest_pose` and `stiffness` about `springs_at_mm`.
pub fn opencv_yaml(constants: &Constants) -> String {
    let camera = &constants.camera;
    let markers = &constants.white_markers;
    let mut text = String::from("%YAML:1.0\n---\n");
    text += &format!("design: \"{}\"\n", constants.design);
    text += &format!("camera_model: \"{}\"\n", camera.model);
    text += &format!("image_width: {}\nimage_height: {}\n", camera.width, camera.height);
    text += &matrix("camera_matrix", 3, 3, camera.matrix.into_iter().flatten());
    // OpenCV wants at least four coefficients, or none at all as zeros.
    let mut distortion = camera.distortion.clone();
    if distortion.is_empty() {
        distortion = vec![0.0; 5];
    }
    text += &matrix("distortion_coefficients", 1, distortion.len(), distortion.iter().copied());
    text += &matrix("undistorted_matrix", 3, 3, camera.undistorted_matrix.into_iter().flatten());
    text += &matrix("camera_from_sensor", 4, 4, camera.camera_from_sensor.into_iter().flatten());
    text += &matrix("mask_center_px", 1, 2, constants.mask.center_px);
    text += &format!("mask_radius_px: {}\n", number(constants.mask.radius_px));
    text += &matrix("white_markers_mm", markers.len(), 3, markers.iter().flat_map(|m| m.position_mm));
    if markers.iter().all(|m| m.apparent_position_mm.is_some()) {
        let apparent = markers.iter().filter_map(|m| m.apparent_position_mm).flatten();
        text += &matrix("apparent_white_markers_mm", markers.len(), 3, apparent);
    }
    text += &matrix("white_markers_px", markers.len(), 2, markers.iter().flat_map(|m| m.image_px));
    if let Some(springs) = &constants.springs {
        text += &format!("springs_source: \"{}\"\n", springs.source);
        text += &matrix("springs_at_mm", 1, 3, springs.at_mm);
        text += &matrix("springs_stiffness", 6, 6, springs.stiffness.into_iter().flatten());
        if let Some(plain) = &springs.plain_runtime {
            text += &matrix("plain_stiffness", 6, 6, plain.stiffness.into_iter().flatten());
            text += &matrix("plain_rest_pose", 4, 4, plain.rest_pose.into_iter().flatten());
        }
    }
    text
}
