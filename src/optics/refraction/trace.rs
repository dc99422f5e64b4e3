//! From a pixel to the dome: Snell's law in closed form.

use glam::{DVec2, DVec3};

use super::limit::RayLimit;
use super::sensor::SensorOptics;
use super::stack::travel;
use crate::camera::Lens;
use crate::numeric::LengthMismatch;
use crate::numeric::batch::fill_runs;

/// Rounding slack at the dome's rim, relative to its radius: a ray that meets
/// the sheet's top this little outside the base circle still meets the rim.
const RIM_ROUNDING: f64 = 1e-11;

/// Rays that are kept between the lens and the layers.
const TRACE_RUN: usize = 64;

/// Where a pixel's chief ray meets the dome.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The pixel.
    pub pixel: DVec2,
    /// The point on the dome, sensor frame, millimetres.
    pub surface_mm: DVec3,
    /// Outward unit normal there.
    pub normal: DVec3,
    /// Angle of the ray in air to the camera's axis, radians.
    pub field_angle_rad: f64,
}

/// A ray's way to the dome, sensor frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct RayHit {
    /// Unit direction in air.
    pub direction: DVec3,
    /// Air in its way, along the normal.
    pub gap_mm: f64,
    /// Unit direction in the dome.
    pub inside: DVec3,
    /// Length of the way in the dome.
    pub inside_mm: f64,
    /// Where it meets the dome.
    pub point: DVec3,
}

impl SensorOptics {
    /// Where the chief ray of a pixel meets the dome.
    ///
    /// # Errors
    /// The limit that the pixel is past.
    pub fn trace(&self, pixel: DVec2) -> Result<SurfacePoint, RayLimit> {
        self.trace_ray(pixel, self.lens.unproject(pixel)?)
    }

    #[inline]
    fn trace_ray(&self, pixel: DVec2, ray: DVec3) -> Result<SurfacePoint, RayLimit> {
        let field_angle_rad = Lens::field_angle_of_unit_rad(ray);
        let hit = self.intersect_dome(ray, field_angle_rad)?;
        Ok(self.surface_point(pixel, field_angle_rad, &hit))
    }

    /// Where a pixel's chief ray meets the dome, and its unit direction inside, away from the camera. Here sphere or cylinder goes on
    /// below the dome's base: a ray that comes up beside the base is followed back to it. What lies on
    /// the dome then goes on smoothly for a way beyond its outline in the image.
    ///
    /// # Errors
    /// As `trace`, less the rays that pass the base but not what goes on below it.
    #[inline]
    pub fn trace_continued(&self, pixel: DVec2) -> Result<(DVec3, DVec3), RayLimit> {
        self.follow_continued(self.lens.unproject(pixel)?)
    }

    /// [`SensorOptics::trace_continued`] from the unit direction that the pixel sees, camera frame
    /// ([`Lens::unproject`]).
    ///
    /// # Errors
    /// As `trace_continued`, less the lens's.
    #[inline]
    pub fn follow_continued(&self, ray: DVec3) -> Result<(DVec3, DVec3), RayLimit> {
        // Only a pupil that moves asks for the angle.
        let field_angle_rad = if self.lens.is_central() { 0.0 } else { Lens::field_angle_rad(ray) };
        let (hit, _) = self.intersect_continued(ray, field_angle_rad)?;
        Ok((hit.point, hit.inside))
    }

    pub(super) fn surface_point(&self, pixel: DVec2, field_angle_rad: f64, hit: &RayHit) -> SurfacePoint {
        SurfacePoint { pixel, surface_mm: hit.point, normal: self.dome.normal(hit.point), field_angle_rad }
    }

    /// A ray of the camera, through the layers and on to the dome.
    #[inline]
    pub(super) fn intersect_dome(&self, ray: DVec3, field_angle_rad: f64) -> Result<RayHit, RayLimit> {
        match self.intersect_continued(ray, field_angle_rad)? {
            (hit, false) => Ok(hit),
            (_, true) => Err(RayLimit::MissesDome),
        }
    }

    /// [`Self::intersect_dome`]; a ray that comes up beside the dome's base is followed back to sphere or cylinder below, and
    /// the second value is then true.
    #[inline]
    fn intersect_continued(&self, ray: DVec3, field_angle_rad: f64) -> Result<(RayHit, bool), RayLimit> {
        let direction = self.sensor_from_camera.vector(ray);
        let origin = if self.lens.is_central() {
            self.sensor_from_camera.translation_mm
        } else {
            self.pupil_mm(self.lens.pupil_shift_mm(field_angle_rad).0)
        };
        let gap_mm = self.bottom_mm - origin.z;
        if gap_mm < 0.0 {
            return Err(RayLimit::PupilInsideSheet);
        }
        if direction.z <= 0.0 {
            return Err(RayLimit::MissesDome);
        }
        let p = DVec2::new(direction.x, direction.y);
        let base =
            DVec2::new(origin.x, origin.y) + p * (gap_mm / direction.z + travel(&self.plates, direction.z));
        let radius = self.dome.rim_radius_mm();
        let distance = base.length();
        // From a ray so grazing that its travel overflowed.
        if !distance.is_finite() {
            return Err(RayLimit::MissesDome);
        }
        let beside = distance > radius * (1.0 + RIM_ROUNDING);
        let n = self.fill.index;
        let up = (self.fill.excess + direction.z * direction.z).sqrt() / n;
        let sideways = p / n;
        let inside = DVec3::new(sideways.x, sideways.y, up);
        let c = (radius - distance) * (radius + distance);
        let c = if beside { c } else { c.max(0.0) };
        let met = if self.dome.center_z_mm() > 0.0 {
            self.leave_pillar(base, inside, c)
        } else {
            // |base + s inside - center| = radius of the sphere: s^2 + 2 b s - c = 0.
            let b = base.dot(sideways) - self.dome.center_z_mm() * up;
            let leaves = !beside || (b > 0.0 && b * b + c > 0.0);
            // Where it comes up beside the rim it has left the sphere already.
            leaves.then(|| far_root(1.0, b, c))
        };
        let s = met.ok_or(RayLimit::MissesDome)?;
        let flat = base + sideways * s;
        // Onto the face to the last bit that the arithmetic has.
        let mut point = self.dome.onto(DVec3::new(flat.x, flat.y, up * s));
        if !beside {
            point.z = point.z.max(0.0);
        }
        let hit = RayHit { direction, gap_mm, inside, inside_mm: s, point };
        Ok((hit, beside))
    }

    /// Length of a ray's way from the sheet's top to where it leaves a hemisphere on a cylinder; `c` is the square of the
    /// cylinder's radius less that of the base's distance from the axis. A base beside it is led back to the cylinder.
    fn leave_pillar(&self, base: DVec2, inside: DVec3, c: f64) -> Option<f64> {
        let sideways = inside.truncate();
        let (a, b) = (sideways.length_squared(), base.dot(sideways));
        let center_z_mm = self.dome.center_z_mm();
        let enough = b * b + a * c;
        if c < 0.0 && (b <= 0.0 || enough <= 0.0) {
            return None;
        }
        // Along the axis, or nearly, no cylinder is met below the sphere.
        let wall = if a > 0.0 { far_root(a, b, c) } else { f64::INFINITY };
        if wall * inside.z <= center_z_mm {
            return Some(wall);
        }
        let b = b - center_z_mm * inside.z;
        Some(far_root(1.0, b, c - center_z_mm * center_z_mm))
    }

    /// [`SensorOptics::trace`] for each pixel, written to the place of the same
    /// number; see [`crate::numeric::batch::fill`].
    ///
    /// # Errors
    /// Slices of different length. The limits stand in the outputs.
    pub fn trace_all(
        &self,
        pixels: &[DVec2],
        hits: &mut [Result<SurfacePoint, RayLimit>],
    ) -> Result<(), LengthMismatch> {
        fill_runs(pixels, hits, |pixels, hits| {
            let mut rays = [Ok(DVec3::Z); TRACE_RUN];
            for (pixels, hits) in pixels.chunks(TRACE_RUN).zip(hits.chunks_mut(TRACE_RUN)) {
                let rays = &mut rays[..pixels.len()];
                self.lens.unproject_run(pixels, rays);
                for ((hit, &pixel), &ray) in hits.iter_mut().zip(pixels).zip(&*rays) {
                    *hit = ray.map_err(RayLimit::from).and_then(|ray| self.trace_ray(pixel, ray));
                }
            }
        })
    }
}

/// The larger root of `a s^2 + 2 b s - c = 0`, by the form that does not cancel.
#[inline]
fn far_root(a: f64, b: f64, c: f64) -> f64 {
    let root = (b * b + a * c).max(0.0).sqrt();
    if b > 0.0 { c / (b + root) } else { (root - b) / a }
}
