//! What the camera must be able to see, as a solid of revolution.

use glam::{DVec2, DVec3};

use super::PartError;
use crate::mesh::Profile;
use crate::numeric::Rigid;
use crate::optics::SensorOptics;

/// Directions round a rim or marker that are followed.
const DIRECTIONS: usize = 48;
/// Heights at which the cone's radius is taken. The cone is the hull of
/// straight rays, so its radius is a convex function of height, and straight
/// lines between these heights lie outside it.
const HEIGHTS: usize = 9;

/// The camera's view of markers and dome below the sheet, at all spring
/// positions, in the frame of the platform: a radius for each height.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewCone {
    /// `(radius, z)` from bottom to top, mm.
    samples_mm: Vec<DVec2>,
    margin_mm: f64,
}

impl ViewCone {
    /// Follows the chief rays from the rims of markers and dome, through the
    /// sheet, down to the pupil; for every pose the largest distance from the
    /// axis at each height counts.
    ///
    /// * `targets_mm`: centre on the sheet's top face and radius of each disc
    ///   that must be seen whole (the dome's base is one of them);
    /// * `poses`: the poses `rest_from_platform` that the springs allow;
    /// * `low_z_mm`, `high_z_mm`: the heights between which a platform may
    ///   stand in the way;
    /// * `margin_mm`: gap kept across the edge ray.
    ///
    /// # Errors
    /// [`PartError::View`] if a pose is impossible, or nothing at all can be
    /// seen.
    pub fn over(
        optics: &SensorOptics,
        targets_mm: &[(DVec2, f64)],
        poses: &[Rigid],
        low_z_mm: f64,
        high_z_mm: f64,
        margin_mm: f64,
    ) -> Result<Self, PartError> {
        let heights: Vec<f64> = (0..HEIGHTS)
            .map(|i| low_z_mm + (high_z_mm - low_z_mm) * i as f64 / (HEIGHTS - 1) as f64)
            .collect();
        let mut samples_mm: Vec<DVec2> = heights.iter().map(|&z| DVec2::new(0.0, z)).collect();
        let mut seen = 0_usize;
        for pose in poses {
            let moved = optics.at_pose(pose).map_err(|error| PartError::View {
                problem: format!("at one of the springs' positions {error}"),
                field: "camera.position_mm".into(),
            })?;
            let sensor_from_camera = *moved.sensor_from_camera();
            for &(center, radius) in targets_mm {
                for k in 0..DIRECTIONS {
                    let angle = std::f64::consts::TAU * k as f64 / DIRECTIONS as f64;
                    let point = (center + radius * DVec2::from_angle(angle)).extend(0.0);
                    // A point that the lens cannot see needs no window; that
                    // the design requires it is checked elsewhere.
                    let Ok(pixel) = moved.project(point) else { continue };
                    let Ok(ray) = moved.lens().unproject(pixel) else { continue };
                    let shift = moved.lens().pupil_shift_mm(crate::camera::Lens::field_angle_rad(ray)).0;
                    let origin = sensor_from_camera.point(DVec3::Z * shift);
                    let direction = sensor_from_camera.vector(ray);
                    if direction.z <= 0.0 {
                        continue;
                    }
                    seen += 1;
                    for sample in &mut samples_mm {
                        let along = (sample.y - origin.z) / direction.z;
                        if along > 0.0 {
                            let p = origin + direction * along;
                            sample.x = sample.x.max(p.truncate().length());
                        }
                    }
                }
            }
        }
        if seen == 0 {
            return Err(PartError::View {
                problem: "neither the markers nor the dome's rim can be seen at any spring position".into(),
                field: "camera.position_mm".into(),
            });
        }
        Ok(Self { samples_mm, margin_mm })
    }

    /// Radius that must be free at a height, with the margin; beyond the
    /// sampled heights the last slope goes on.
    pub fn radius_mm(&self, z_mm: f64) -> f64 {
        let Some((low, high)) = self
            .samples_mm
            .windows(2)
            .map(|w| (w[0], w[1]))
            .find(|(_, high)| z_mm <= high.y)
            .or_else(|| self.samples_mm.windows(2).last().map(|w| (w[0], w[1])))
        else {
            return 0.0;
        };
        let slope = (high.x - low.x) / (high.y - low.y);
        // The margin is kept across the ray, which makes it longer sideways.
        low.x + slope * (z_mm - low.y) + self.margin_mm * (1.0 + slope * slope).sqrt()
    }

    /// The window to cut into the upper platform, from below its underside to
    /// above its top.
    pub(super) fn profile(&self, bottom_z_mm: f64, seat_z_mm: f64, top_z_mm: f64, over_mm: f64) -> Profile {
        let mut points = vec![];
        let first = self.radius_mm(bottom_z_mm);
        let second = self.radius_mm(bottom_z_mm + 0.1 * (seat_z_mm - bottom_z_mm));
        let slope = (second - first) / (0.1 * (seat_z_mm - bottom_z_mm));
        // Below the underside the first slope goes on, but not past the axis.
        points.push(((first - slope * over_mm).max(0.5 * first), bottom_z_mm - over_mm));
        let inner = self.samples_mm.iter().filter(|s| s.y > bottom_z_mm && s.y < seat_z_mm).map(|s| s.y);
        for z in std::iter::once(bottom_z_mm).chain(inner).chain([seat_z_mm]) {
            points.push((self.radius_mm(z), z));
        }
        let at_seat = self.radius_mm(seat_z_mm);
        points.push((at_seat, top_z_mm + over_mm));
        Profile::lines(&points)
    }
}
