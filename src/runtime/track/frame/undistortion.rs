//! The paper's frame: undistorted and masked, for those who want to see it. Nothing is measured in it.

use glam::{DVec2, DVec3};

use super::camera_frame::{CameraFrame, MAX_PIXELS};
use crate::constants::Constants;
use crate::track::error::TrackError;
use domecast_optics::camera::{Lens, LensLimit};

/// Where each pixel of the undistorted frame comes from, found once.
#[derive(Debug, Clone)]
pub struct Undistorted {
    width: usize,
    height: usize,
    /// Place in the raw frame in 256ths of a pixel; negative where there is none.
    from: Vec<[i32; 2]>,
}

impl Undistorted {
    /// The map of a sensor's camera.
    ///
    /// # Errors
    /// [`TrackError`] for a lens that cannot be, or frames of more than 2^26 px.
    pub fn new(constants: &Constants) -> Result<Self, TrackError> {
        let camera = &constants.camera;
        let (width, height) = (camera.width as usize, camera.height as usize);
        if width.checked_mul(height).is_none_or(|n| n == 0 || n > MAX_PIXELS) {
            return Err(TrackError::at("camera.width", format!("{width} x {height} is no frame")));
        }
        let spec = constants.optics_spec().map_err(|problem| TrackError::at("camera", problem))?;
        let lens = Lens::new(spec.lens).map_err(|error| TrackError::at("camera", error.to_string()))?;
        let [[fx, _, cx], [_, fy, cy], _] = camera.undistorted_matrix;
        let center = DVec2::from_array(constants.mask.center_px);
        let mut from = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let at = DVec2::new(x as f64, y as f64);
                let raw = if at.distance(center) <= constants.mask.radius_px {
                    lens.project(DVec3::new((at.x - cx) / fx, (at.y - cy) / fy, 1.0))
                } else {
                    Err(LensLimit::NotFinite)
                };
                let inside = |p: &DVec2| {
                    p.x >= 0.0 && p.y >= 0.0 && p.x < width as f64 - 1.0 && p.y < height as f64 - 1.0
                };
                from.push(
                    raw.ok()
                        .filter(inside)
                        .map_or([-1, -1], |p| [(256.0 * p.x).round() as i32, (256.0 * p.y).round() as i32]),
                );
            }
        }
        Ok(Self { width, height, from })
    }

    /// The undistorted, masked frame, with the channels of the raw one; `None` for a frame of another size.
    pub fn of<'a>(&self, frame: &CameraFrame<'_>, out: &'a mut Vec<u8>) -> Option<&'a [u8]> {
        if frame.width() != self.width || frame.height() != self.height {
            return None;
        }
        let channels = frame.channels();
        let bytes = frame.bytes();
        out.clear();
        out.resize(self.width * self.height * channels, 0);
        for (to, [u, v]) in out.chunks_exact_mut(channels).zip(&self.from) {
            if *u < 0 {
                continue;
            }
            let (x, y) = ((*u >> 8) as usize, (*v >> 8) as usize);
            let (a, b) = ((*u & 255) as u32, (*v & 255) as u32);
            let at = |x: usize, y: usize, c: usize| {
                u32::from(bytes.get((y * self.width + x) * channels + c).copied().unwrap_or(0))
            };
            for (c, to) in to.iter_mut().enumerate() {
                let top = at(x, y, c) * (256 - a) + at(x + 1, y, c) * a;
                let bottom = at(x, y + 1, c) * (256 - a) + at(x + 1, y + 1, c) * a;
                *to = ((top * (256 - b) + bottom * b + (1 << 15)) >> 16) as u8;
            }
        }
        Some(out)
    }
}
