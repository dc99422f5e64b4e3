//! The runtime's circle, in the raw frame.

use glam::DVec2;

use super::camera_frame::MAX_PIXELS;
use crate::constants::{CameraConstants, MaskConstants};
use domecast_optics::camera::{Lens, LensLimit};

/// Pixels of the raw frame that the circle of the undistorted frame holds.
#[derive(Debug, Clone)]
pub(crate) struct Mask {
    width: usize,
    inside: Vec<bool>,
    /// First and one past the last pixel inside, for each row.
    spans: Vec<[u32; 2]>,
}

impl Mask {
    /// Each raw pixel's ray, in the undistorted frame, against the circle: once, so that no frame is remapped.
    pub fn new(lens: &Lens, camera: &CameraConstants, mask: &MaskConstants) -> Self {
        let (width, height) = (camera.width as usize, camera.height as usize);
        debug_assert!(width * height <= MAX_PIXELS);
        let [[fx, _, cx], [_, fy, cy], _] = camera.undistorted_matrix;
        let center = DVec2::from_array(mask.center_px);
        let mut inside = vec![false; width * height];
        let mut spans = vec![[0, 0]; height];
        // Row by row, as far as the lens sees: many rays at a time cost a part of what they do one by one.
        let [[_, _, lens_x], [_, _, lens_y], _] = lens.spec().matrix;
        let mut pixels: Vec<DVec2> = (0..width).map(|x| DVec2::new(x as f64, 0.0)).collect();
        let mut rays = vec![Err(LensLimit::NotFinite); width];
        for y in 0..height {
            let half = (lens.max_radius_px().powi(2) - (y as f64 - lens_y).powi(2)).max(0.0).sqrt() + 1.0;
            let start = ((lens_x - half).max(0.0) as usize).min(width);
            let end = ((lens_x + half).max(0.0) as usize).saturating_add(1).clamp(start, width);
            let (pixels, rays) = (&mut pixels[start..end], &mut rays[start..end]);
            pixels.iter_mut().for_each(|pixel| pixel.y = y as f64);
            // Both are of one length.
            let Ok(()) = lens.unproject_all(pixels, rays) else { continue };
            let mut span = [u32::MAX, 0];
            for (x, ray) in (start..).zip(&*rays) {
                let Ok(ray) = ray else { continue };
                if ray.z <= 0.0 {
                    continue;
                }
                let at = DVec2::new(fx * ray.x / ray.z + cx, fy * ray.y / ray.z + cy);
                if at.distance(center) <= mask.radius_px {
                    inside[y * width + x] = true;
                    span = [span[0].min(x as u32), x as u32 + 1];
                }
            }
            if span[1] > 0 {
                spans[y] = span;
            }
        }
        Self { width, inside, spans }
    }

    /// Every pixel of a frame.
    #[cfg(test)]
    pub fn all(width: usize, height: usize) -> Self {
        Self { width, inside: vec![true; width * height], spans: vec![[0, width as u32]; height] }
    }

    /// Whether the pixel nearest to a place is inside.
    pub fn holds(&self, at: DVec2) -> bool {
        let (x, y) = (at.x.round(), at.y.round());
        if !(x >= 0.0 && y >= 0.0 && x < self.width as f64) {
            return false;
        }
        self.inside.get(y as usize * self.width + x as usize).copied().unwrap_or(false)
    }

    /// First and one past the last pixel inside of a row.
    pub fn span(&self, y: usize) -> [usize; 2] {
        self.spans.get(y).map_or([0, 0], |s| s.map(|v| v as usize))
    }
}
