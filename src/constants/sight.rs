//! Where the white markers go under load, as limits of a load: lens, mask, and the platform's opening.

use glam::{DVec2, DVec3};

use crate::design::Design;
use crate::mechanics::{Check, Limit};
use crate::numeric::Rigid;
use crate::optics::SensorOptics;
use crate::parts::{Measures, ViewCone};
use crate::pose::Marker;

/// The white markers of a design, and what may hide them.
#[derive(Debug, Clone)]
pub struct MarkerSight {
    optics: SensorOptics,
    markers: Vec<Marker>,
    undistorted_matrix: [[f64; 3]; 3],
    mask_radius_px: f64,
    /// The window, and the heights between which it stands, mm; `None`: not checked.
    window: Option<(ViewCone, [f64; 2])>,
}

/// The markers of a design, numbered in its order.
pub fn markers_of(design: &Design) -> Vec<Marker> {
    let diameter_mm = design.sections().white_markers.diameter_mm;
    let numbered = (0..).zip(design.white_markers_mm());
    numbered.map(|(id, position_mm)| Marker { id, position_mm, diameter_mm }).collect()
}

impl MarkerSight {
    /// From a design; the window is left out of the checks where its shape cannot be computed.
    pub fn of(design: &Design) -> Self {
        let heights = [design.sections().platforms.upper.underside_z_mm, design.sheet_underside_z_mm()];
        Self {
            optics: design.optics().clone(),
            markers: markers_of(design),
            undistorted_matrix: design.undistorted_matrix(),
            mask_radius_px: design.sections().runtime.mask_radius_px,
            window: Measures::of(design).ok().map(|measures| (measures.view, heights)),
        }
    }

    /// How much of each limit the worst marker uses at a pose. A point that the lens cannot see uses twice what
    /// there is.
    pub fn checks(&self, pose: &Rigid) -> Vec<Check> {
        let far = self.optics.lens().max_field_angle_rad();
        let mut lens = (0.0, 0);
        let mut mask = (0.0, 0);
        let mut edge = (0.0, 0);
        let keep = |worst: &mut (f64, u32), used: f64, id: u32| {
            if used > worst.0 {
                *worst = (used, id);
            }
        };
        let placed = self.optics.at_pose(pose);
        for marker in &self.markers {
            let outline = placed.as_ref().ok().and_then(|optics| marker.outline_px(optics).ok());
            let (Some(outline), Ok(optics)) = (outline, &placed) else {
                keep(&mut lens, 2.0 * far, marker.id);
                continue;
            };
            for pixel in outline {
                let Ok(ray) = optics.lens().unproject(pixel) else {
                    keep(&mut lens, 2.0 * far, marker.id);
                    continue;
                };
                let angle = crate::camera::Lens::field_angle_rad(ray);
                keep(&mut lens, angle, marker.id);
                keep(&mut mask, self.mask_px(ray, pixel, optics), marker.id);
                if let Some((cone, heights)) = &self.window {
                    keep(&mut edge, window_use(optics, ray, angle, cone, *heights), marker.id);
                }
            }
        }
        let part = |id: u32| format!("marker {id}");
        let mut checks = vec![
            Check {
                limit: Limit::MarkerOutOfLens,
                part: part(lens.1),
                value: lens.0,
                bound: far,
                unit: "rad",
            },
            Check {
                limit: Limit::MarkerOutOfMask,
                part: part(mask.1),
                value: mask.0,
                bound: self.mask_radius_px,
                unit: "px",
            },
        ];
        if self.window.is_some() {
            let limit = Limit::MarkerBehindEdge;
            checks.push(Check { limit, part: part(edge.1), value: edge.0, bound: 1.0, unit: "1" });
        }
        checks
    }

    /// Distance from the mask's centre in the undistorted frame; twice the mask where that frame ends or the raw
    /// frame does.
    fn mask_px(&self, ray: DVec3, pixel: DVec2, optics: &SensorOptics) -> f64 {
        let spec = optics.lens().spec();
        let (right, bottom) = (f64::from(spec.width) - 0.5, f64::from(spec.height) - 0.5);
        let in_frame = pixel.x >= -0.5 && pixel.y >= -0.5 && pixel.x <= right && pixel.y <= bottom;
        if ray.z <= 0.0 || !in_frame {
            return 2.0 * self.mask_radius_px;
        }
        let [[fx, ..], [_, fy, _], _] = self.undistorted_matrix;
        DVec2::new(fx * ray.x, fy * ray.y).length() / ray.z
    }
}

/// Largest part of the window that a ray uses between two heights of the platform.
fn window_use(optics: &SensorOptics, ray: DVec3, angle: f64, window: &ViewCone, heights: [f64; 2]) -> f64 {
    let sensor_from_camera = optics.sensor_from_camera();
    let origin = sensor_from_camera.point(DVec3::Z * optics.lens().pupil_shift_mm(angle).0);
    let direction = sensor_from_camera.vector(ray);
    let at = |part: f64| {
        let z = heights[0] + part * (heights[1] - heights[0]);
        let along = (z - origin.z) / direction.z;
        if along > 0.0 { window.used(origin + direction * along) } else { 0.0 }
    };
    [0.0, 0.25, 0.5, 0.75, 1.0].map(at).into_iter().fold(0.0, f64::max)
}
