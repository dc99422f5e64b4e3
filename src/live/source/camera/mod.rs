//! A camera of this system.

mod request;
#[cfg(all(target_os = "linux", feature = "v4l2"))]
mod v4l2;

use std::path::Path;

use super::LiveSource;

pub use request::CameraRequest;

/// Opens a camera with its controls locked.
///
/// # Errors
/// What is wrong and what would cure it: no such device, no such size, a control that does not lock.
#[cfg(all(target_os = "linux", feature = "v4l2"))]
pub fn open_camera(device: &Path, request: CameraRequest) -> Result<Box<dyn LiveSource>, String> {
    Ok(Box::new(v4l2::V4l2Camera::open(device, request)?))
}

/// Opens a camera with its controls locked: not in this build.
///
/// # Errors
/// Always; with what reads cameras instead.
#[cfg(not(all(target_os = "linux", feature = "v4l2")))]
pub fn open_camera(device: &Path, _request: CameraRequest) -> Result<Box<dyn LiveSource>, String> {
    Err(format!(
        "{}: this build reads no cameras (Linux with the feature v4l2 does); pipe them in by ffmpeg: ffmpeg .. -f image2pipe \
         -c:v ppm -pix_fmt rgb24 - | domecast live -",
        device.display()
    ))
}
