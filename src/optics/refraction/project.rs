//! From a point of the dome, inside it or on the sheet, to its pixel.

use glam::{DVec2, DVec3};

use super::limit::RayLimit;
use super::sensor::SensorOptics;
use super::stack::{LayerPath, MAX_NEWTON_STEPS, Plate};
use crate::camera::Lens;
use crate::numeric::batch::fill;
use crate::numeric::{LengthMismatch, MAX_ITERATIONS, RootError, bracketed_newton};

/// How far outside the dome, relative to its radius, a point may be and still
/// be on it: what a file with seven digits says of a surface point.
const ON_DOME_TOLERANCE: f64 = 1e-6;

/// Where a point is seen, and how that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolvedPixel {
    /// The pixel.
    pub pixel: DVec2,
    /// Newton steps for the ray through the layers, at most
    /// [`SensorOptics::MAX_NEWTON_ITERATIONS`].
    pub newton_iterations: u32,
    /// Steps to the place of the entrance pupil, at most
    /// [`SensorOptics::MAX_PUPIL_ITERATIONS`]; each solves for a ray of its own. Zero
    /// for a central lens.
    pub pupil_iterations: u32,
    /// By how much the ray misses the point, in millimetres along the sheet.
    pub residual_mm: f64,
}

impl SensorOptics {
    /// The pixel that sees a point of the sensor frame (millimetres): on the
    /// dome, inside it, or on or under the sheet's top, where it may lie beside
    /// the dome.
    ///
    /// # Errors
    /// The limit that the point is past.
    pub fn project(&self, point_mm: DVec3) -> Result<DVec2, RayLimit> {
        Ok(self.lens.project(self.chief_ray(point_mm)?)?)
    }

    /// [`SensorOptics::project`] for a point of a dome that is out of shape: the medium is taken to reach as far as
    /// the point, also where it bulges past the undeformed dome.
    ///
    /// # Errors
    /// As `project`, but never [`RayLimit::OutsideDome`].
    pub fn project_deformed(&self, point_mm: DVec3) -> Result<DVec2, RayLimit> {
        if !point_mm.is_finite() {
            return Err(RayLimit::NotFinite);
        }
        let (pupil, _) = self.chief_pupil(point_mm)?;
        Ok(self.lens.project(self.central_ray(point_mm, pupil)?)?)
    }

    /// Bound on the Newton steps for the ray through the layers.
    pub const MAX_NEWTON_ITERATIONS: u32 = MAX_NEWTON_STEPS;

    /// Bound on the steps to the place of the entrance pupil.
    pub const MAX_PUPIL_ITERATIONS: u32 = MAX_ITERATIONS;

    /// [`SensorOptics::project`] and how it was found.
    ///
    /// # Errors
    /// As `project`.
    pub fn project_solved(&self, point_mm: DVec3) -> Result<SolvedPixel, RayLimit> {
        let point = self.usable_point(point_mm)?;
        let (pupil, pupil_iterations) = self.chief_pupil(point)?;
        let pixel = self.lens.project(self.central_ray(point, pupil)?)?;
        let reach_mm = DVec2::new(point.x - pupil.x, point.y - pupil.y).length();
        let (newton_iterations, residual_mm) = self.path(point, pupil)?.steps_and_residual(reach_mm)?;
        Ok(SolvedPixel { pixel, newton_iterations, pupil_iterations, residual_mm })
    }

    /// [`SensorOptics::project`] for each point.
    ///
    /// # Errors
    /// Slices of different length. The limits stand in the outputs.
    pub fn project_all(
        &self,
        points_mm: &[DVec3],
        pixels: &mut [Result<DVec2, RayLimit>],
    ) -> Result<(), LengthMismatch> {
        fill(points_mm, pixels, |&point| self.project(point))
    }

    /// Direction in air, camera frame, of the ray through a point.
    fn chief_ray(&self, point_mm: DVec3) -> Result<DVec3, RayLimit> {
        let point = self.usable_point(point_mm)?;
        let (pupil, _) = self.chief_pupil(point)?;
        self.central_ray(point, pupil)
    }

    /// The entrance pupil of the ray through a usable point, sensor frame, and
    /// the steps that it took.
    pub(super) fn chief_pupil(&self, point: DVec3) -> Result<(DVec3, u32), RayLimit> {
        if self.lens.is_central() {
            return Ok((self.sensor_from_camera.translation_mm, 0));
        }
        // The pupil's shift S(theta) must be the one that belongs to the field
        // angle of the ray from there: seen(S(theta)) = theta. The left side
        // starts above the right one at zero and, if the point is inside the
        // domain, ends below; the difference falls at a slope near -1.
        let end = self.lens.max_field_angle_rad();
        let shift_at = |theta: f64| self.lens.pupil_shift_mm(theta).0;
        let seen = |theta: f64| self.seen_angle_rad(point, shift_at(theta));
        let (mut theta, mut steps) = (end, 0);
        if seen(end) < end {
            let mismatch = |theta: f64| (seen(theta) - theta, -1.0);
            let root =
                bracketed_newton(mismatch, 0.0, end, seen(0.0).min(end)).map_err(|error| match error {
                    RootError::NotFinite { .. } => RayLimit::NotFinite,
                    _ => RayLimit::NotConverged,
                })?;
            (theta, steps) = (root.value, root.iterations);
        }
        let pupil = self.pupil_mm(shift_at(theta));
        if pupil.z > self.bottom_mm { Err(RayLimit::PupilInsideSheet) } else { Ok((pupil, steps)) }
    }

    /// Field angle at which a point is seen from a shifted pupil. A pupil that
    /// would be in the sheet counts as touching it; a point past the critical
    /// angle, or not in front, is seen along the sheet.
    fn seen_angle_rad(&self, point: DVec3, shift_mm: f64) -> f64 {
        let mut pupil = self.pupil_mm(shift_mm);
        pupil.z = pupil.z.min(self.bottom_mm);
        let ray = self.central_ray(point, pupil).unwrap_or_else(|_| {
            let along = DVec3::new(point.x - pupil.x, point.y - pupil.y, 0.0);
            self.sensor_from_camera.rotation.transpose() * along
        });
        Lens::field_angle_rad(ray)
    }

    pub(super) fn usable_point(&self, point: DVec3) -> Result<DVec3, RayLimit> {
        if !point.is_finite() {
            return Err(RayLimit::NotFinite);
        }
        let slack = ON_DOME_TOLERANCE * self.dome.radius_mm();
        // Above the top, one has to be in the dome.
        if point.z <= 0.0 || self.dome.outward_mm(point).length() <= self.dome.radius_mm() + slack {
            Ok(point)
        } else if point.z <= slack {
            Ok(DVec3::new(point.x, point.y, 0.0))
        } else {
            Err(RayLimit::OutsideDome)
        }
    }

    /// The layers between a pupil and a point.
    pub(super) fn path(&self, point: DVec3, pupil: DVec3) -> Result<LayerPath<'_>, RayLimit> {
        if point.z <= pupil.z {
            return Err(RayLimit::BehindCamera);
        }
        Ok(LayerPath {
            air_mm: self.bottom_mm.min(point.z) - pupil.z,
            plates: &self.plates,
            skipped_mm: (-point.z).clamp(0.0, -self.bottom_mm),
            fill: Plate { thickness_mm: point.z.max(0.0), ..self.fill },
        })
    }

    /// Direction in air, camera frame, of the ray from a point to a pupil.
    fn central_ray(&self, point: DVec3, pupil: DVec3) -> Result<DVec3, RayLimit> {
        let sideways = DVec2::new(point.x - pupil.x, point.y - pupil.y);
        let per_mm = self.path(point, pupil)?.tangent_per_mm(sideways.length())?;
        let tangent = sideways * per_mm;
        let direction = DVec3::new(tangent.x, tangent.y, 1.0);
        Ok(self.sensor_from_camera.rotation.transpose() * direction)
    }
}
