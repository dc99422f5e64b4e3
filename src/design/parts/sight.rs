//! The white markers in lens and mask, as limits of a load.

use glam::{DVec2, DVec3};

use crate::spec::Design;
use domecast_optics::SensorOptics;
use domecast_optics::camera::Lens;
use domecast_optics::numeric::Rigid;
use domecast_optics::pose::Marker;
use domecast_springs::{Check, Limit};

/// What lens and mask leave of a design's white markers at a pose of the platform; what the window leaves is
/// decided by [`super::ViewCone`], which is made for every pose that these limits allow.
#[derive(Debug, Clone)]
pub struct MarkerView {
    optics: SensorOptics,
    markers: Vec<Marker>,
    undistorted_matrix: [[f64; 3]; 3],
    mask_radius_px: f64,
}

/// The ray to one point of a marker's edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeRay {
    /// The marker.
    pub id: u32,
    /// Direction in the camera's frame.
    pub ray: DVec3,
    /// Its field angle, rad.
    pub angle_rad: f64,
}

/// The markers of a design, numbered in its order.
pub fn markers_of(design: &Design) -> Vec<Marker> {
    let diameter_mm = design.sections().white_markers.diameter_mm;
    let numbered = (0..).zip(design.white_markers_mm());
    numbered.map(|(id, position_mm)| Marker { id, position_mm, diameter_mm }).collect()
}

impl MarkerView {
    /// From a design.
    pub fn of(design: &Design) -> Self {
        Self {
            optics: design.optics().clone(),
            markers: markers_of(design),
            undistorted_matrix: design.undistorted_matrix(),
            mask_radius_px: design.sections().runtime.mask_radius_px,
        }
    }

    /// How much of lens and mask the worst marker uses at a pose; `on_ray` gets every ray, with the optics at
    /// the pose. A point that the lens cannot see uses twice what there is.
    pub fn checks(&self, pose: &Rigid, mut on_ray: impl FnMut(&SensorOptics, EdgeRay)) -> Vec<Check> {
        let far = self.optics.lens().max_field_angle_rad();
        let (mut lens, mut mask) = ((0.0, 0), (0.0, 0));
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
                let angle_rad = Lens::field_angle_rad(ray);
                keep(&mut lens, angle_rad, marker.id);
                keep(&mut mask, self.mask_px(ray, pixel, optics), marker.id);
                on_ray(optics, EdgeRay { id: marker.id, ray, angle_rad });
            }
        }
        let part = |id: u32| format!("marker {id}");
        vec![
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
        ]
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
