//! Perspective without distortion: `image = (x / z, y / z)`.

use glam::{DMat2, DVec2, DVec3};
use nalgebra::{Matrix2x3, Matrix3x2};

use super::LensLimit;
use super::limit::{Domain, END_ROUNDING};
use super::perspective::{half_view_rad, plane_by_ray, plane_point, ray_by_image, ray_of};

/// The ideal camera; its domain ends at half the field of view.
#[derive(Debug, Clone)]
pub(super) struct Pinhole {
    domain: Domain,
    end: f64,
}

impl Pinhole {
    pub fn new(field_of_view_rad: f64) -> Self {
        let domain = Domain::new(half_view_rad(field_of_view_rad), None);
        Self { domain, end: domain.end_rad.tan() }
    }

    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    pub fn max_radius(&self) -> f64 {
        self.end
    }

    pub fn project(&self, ray: DVec3) -> Result<DVec2, LensLimit> {
        plane_point(ray, self.end, &self.domain)
    }

    pub fn project_with_jacobian(&self, ray: DVec3) -> Result<(DVec2, Matrix2x3<f64>), LensLimit> {
        let point = self.project(ray)?;
        Ok((point, plane_by_ray(ray, point, DMat2::IDENTITY)))
    }

    pub fn unproject(&self, image: DVec2) -> Result<DVec3, LensLimit> {
        // Overflow to infinity fails the test too.
        if image.length_squared() <= self.end * self.end * (1.0 + 2.0 * END_ROUNDING) {
            Ok(ray_of(image))
        } else {
            Err(self.domain.limit)
        }
    }

    pub fn unproject_with_jacobian(&self, image: DVec2) -> Result<(DVec3, Matrix3x2<f64>), LensLimit> {
        let ray = self.unproject(image)?;
        Ok((ray, ray_by_image(ray, DMat2::IDENTITY)))
    }
}
