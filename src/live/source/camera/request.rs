//! What is wanted of a camera.

use crate::source::controls::ControlRequest;

/// What is wanted of a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraRequest {
    /// Pixels across and down, as the constants have them.
    pub size: [u32; 2],
    /// Frames a second.
    pub rate_hz: f64,
    /// Exposure, gain, white balance.
    pub controls: ControlRequest,
}
